//! The program `nappe-server`: arguments to configuration, server until a signal, drain.

use std::{
    convert::identity,
    fmt::Display,
    io::{self, Write as _},
    process::ExitCode,
    thread,
    time::Duration,
};

use clap::Parser;
use nappe_server::{
    App, Config, Log, Signals, check_processor, command_line, outlive_file_limits, runtime, say,
};
use tokio::sync::oneshot;

/// Serves simulations of cloth and snow over gRPC.
#[derive(Parser)]
#[command(version)]
struct Arguments {
    #[command(flatten)]
    config: Config,
    /// What is logged, in the syntax of tracing: error, warn, info, debug, nappe_server=debug.
    #[arg(long, env = "NAPPE_LOG", default_value = "info")]
    log: String,
    /// Ends the server when its standard input closes, as when the program that started it ends or is killed.
    #[arg(long)]
    until_stdin_closes: bool,
}

fn main() -> ExitCode {
    let arguments: Arguments = match command_line(identity) {
        Ok(arguments) => arguments,
        Err(code) => return code,
    };
    if let Err(error) = check_processor() {
        return failed(&error);
    }
    // It is dropped last, when nothing is left that could log.
    let _log = match Log::start(&arguments.log) {
        Ok(log) => log,
        Err(error) => return failed(&error),
    };
    if let Err(error) = outlive_file_limits() {
        return failed(&format!("cannot catch signals: {error}"));
    }
    let runtime = match runtime() {
        Ok(runtime) => runtime,
        Err(error) => return failed(&format!("no runtime could be started: {error}")),
    };
    let input = match arguments.until_stdin_closes.then(input_closed).transpose() {
        Ok(input) => input,
        Err(error) => {
            return failed(&format!("the system starts no thread that reads standard input: {error}"));
        }
    };
    let code = runtime.block_on(run(arguments.config, input));

    // Blocking work that hangs must not keep the program alive.
    runtime.shutdown_timeout(Duration::from_millis(200));
    code
}

async fn run(config: Config, input: Option<oneshot::Receiver<()>>) -> ExitCode {
    let signals = match Signals::listen() {
        Ok(signals) => signals,
        Err(error) => return failed(&format!("cannot catch signals: {error}")),
    };
    let app = match App::start(config) {
        Ok(app) => app,
        Err(error) => return failed(&error),
    };
    if let Err(error) = announce(&app.url()) {
        return failed(&format!("cannot write the address on standard output: {error}"));
    }
    match (app.token_path(), app.token()) {
        (Some(path), _) => tracing::info!("clients of this user find the token in {}", path.display()),
        (None, Some(_)) => tracing::info!("clients show the token of the file that was given"),
        (None, None) => tracing::warn!("no token is asked for: whoever reaches the address may call"),
    }
    let input = async {
        match input {
            Some(closed) => drop(closed.await),
            None => std::future::pending().await,
        }
    };
    tokio::select! {
        signal = signals.first() => match signal {
            Ok(signal) => tracing::info!("{signal}: draining"),
            Err(error) => tracing::error!("cannot catch signals, ending: {error}"),
        },
        () = input => tracing::info!("the standard input closed: draining"),
    }

    app.shutdown().await;
    tracing::info!("ended");
    ExitCode::SUCCESS
}

/// Resolves when the standard input is at its end. It is read on a thread of its own, which ends with the program.
///
/// # Errors
/// When the system starts no thread.
fn input_closed() -> io::Result<oneshot::Receiver<()>> {
    let (sender, receiver) = oneshot::channel();
    thread::Builder::new().spawn(move || {
        // What is written to it means nothing, and an input that cannot be read counts as closed.
        let _ = io::copy(&mut io::stdin().lock(), &mut io::sink());
        let _ = sender.send(());
    })?;
    Ok(receiver)
}

/// Scripts read the address from the first line of the output.
fn announce(url: &str) -> io::Result<()> {
    let mut out = io::stdout().lock();
    writeln!(out, "nappe-server listens on {url}")?;
    out.flush()
}

fn failed(message: &impl Display) -> ExitCode {
    say(&format!("nappe-server: {message}"));
    ExitCode::FAILURE
}

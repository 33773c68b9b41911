//! The program `nappe-server`: arguments to configuration, server until a signal, drain.

use std::{process::ExitCode, time::Duration};

use clap::Parser;
use nappe_server::{App, Config, Signals, check_processor};
use tokio::sync::oneshot;
use tracing_subscriber::EnvFilter;

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
    let arguments = Arguments::parse();
    tracing_subscriber::fmt()
        .with_env_filter(EnvFilter::new(&arguments.log))
        .with_writer(std::io::stderr)
        .init();
    if let Err(error) = check_processor() {
        return failed(&error.to_string());
    }
    let runtime = match tokio::runtime::Runtime::new() {
        Ok(runtime) => runtime,
        Err(error) => return failed(&format!("no runtime could be started: {error}")),
    };
    let input = arguments.until_stdin_closes.then(input_closed);
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
        Err(error) => return failed(&error.to_string()),
    };
    announce(&app.url());
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
fn input_closed() -> oneshot::Receiver<()> {
    let (sender, receiver) = oneshot::channel();
    std::thread::spawn(move || {
        // What is written to it means nothing, and an input that cannot be read counts as closed.
        let _ = std::io::copy(&mut std::io::stdin().lock(), &mut std::io::sink());
        let _ = sender.send(());
    });
    receiver
}

#[allow(clippy::print_stdout, reason = "a script reads the address from the first line of the output")]
fn announce(url: &str) {
    println!("nappe-server listens on {url}");
}

#[allow(clippy::print_stderr, reason = "a program tells its user why it did not start")]
fn failed(message: &str) -> ExitCode {
    eprintln!("nappe-server: {message}");
    ExitCode::FAILURE
}

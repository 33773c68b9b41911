//! The display program: watches a session on a server and shows it in Rerun, until the session ends.
//!
//! Enters: a server's address and a session's id. Leaves: a Rerun viewer that shows it, or a recording file.
//! A thin shell over `nappe_rerun::show`, which `nappe view` calls too.

use std::{io, path::PathBuf, process::ExitCode};

use clap::Parser;
use nappe_client::{Client, Event, GridOptions, Token};
use nappe_rerun::{ColorBy, ShowOptions, Shown, Sink, show};

/// Exit code of a program that a second signal ended.
const INTERRUPTED: i32 = 130;

/// Watches a session on a nappe server and shows it in Rerun.
#[derive(Debug, Parser)]
#[command(name = "nappe-viewer", version)]
struct Arguments {
    /// Address of the server.
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:6277", env = "NAPPE_SERVER")]
    server: String,
    /// File with the token of the server; found by itself, if the server is yours and on this machine.
    #[arg(long, value_name = "FILE", env = "NAPPE_TOKEN_FILE")]
    token: Option<PathBuf>,
    /// Id of the session.
    #[arg(long, value_name = "ID")]
    session: String,
    /// Writes every frame to this file (.rrd) instead of opening a viewer.
    #[arg(long, value_name = "FILE", conflicts_with = "connect")]
    save: Option<PathBuf>,
    /// Shows the session in the viewer at this address, for example rerun+http://127.0.0.1:9876/proxy.
    #[arg(long, value_name = "URL")]
    connect: Option<String>,
    /// What the colour of snow shows: plastic_ratio, speed, stress or body.
    #[arg(long, value_name = "NUMBER")]
    color: Option<ColorBy>,
    /// Shows the snow's grid as well: its mass as smoke, or its velocities on a plane, slice:y=0.5 (m).
    #[arg(long, value_name = "smoke|slice:AXIS=METRES")]
    grid: Option<GridOptions>,
}

#[tokio::main]
async fn main() -> ExitCode {
    let arguments = Arguments::parse();
    match run(arguments).await {
        Ok(shown) => {
            say(&summary(&shown));
            ExitCode::SUCCESS
        }
        Err(error) => {
            say(&format!("nappe-viewer: {error}"));
            ExitCode::FAILURE
        }
    }
}

async fn run(arguments: Arguments) -> Result<Shown, Box<dyn std::error::Error>> {
    let client = match &arguments.token {
        None => Client::connect(&arguments.server).await?,
        Some(path) => Client::connect_with(&arguments.server, &Token::read(path)?).await?,
    };
    let oldest_frame = client.get_session(&arguments.session).await?.oldest_frame;
    let sink = match (arguments.save, arguments.connect) {
        (Some(path), _) => Sink::Save(path),
        (None, Some(url)) => Sink::Connect(url),
        (None, None) => Sink::Spawn,
    };

    let mut options = ShowOptions::for_sink(&sink, oldest_frame);
    options.color_by = arguments.color;
    options.watch.grid = arguments.grid;

    let progress = |event: &Event| {
        if let Event::Reconnected { attempts, cause } = event {
            say(&format!("connected again after {attempts} attempts ({cause})"));
        }
    };
    Ok(show(&client, &arguments.session, sink, options, interrupted(), progress).await?)
}

/// Completes on Ctrl-C or SIGTERM: the recording is then closed properly. A second signal ends the program at once.
async fn interrupted() {
    if signal().await.is_err() {
        // No signal can be had on this system: the session's end stops the program.
        std::future::pending::<()>().await;
    }
    tokio::spawn(async {
        if signal().await.is_ok() {
            std::process::exit(INTERRUPTED);
        }
    });
}

/// Waits for a signal that asks the program to end.
#[cfg(unix)]
async fn signal() -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        _ = interrupt.recv() => Ok(()),
        _ = terminate.recv() => Ok(()),
    }
}

/// Waits for a signal that asks the program to end.
#[cfg(not(unix))]
async fn signal() -> io::Result<()> {
    tokio::signal::ctrl_c().await
}

fn summary(shown: &Shown) -> String {
    let Shown { frame_count, dropped_count, end } = shown;
    let end = end.map_or_else(
        || "stopped".to_owned(),
        |end| format!("the session ended after step {}, state {:016x}", end.step, end.state_hash),
    );
    format!("{frame_count} frames shown, {dropped_count} left out; {end}")
}

#[allow(clippy::print_stderr, reason = "a program speaks to its user")]
fn say(text: &str) {
    eprintln!("{text}");
}

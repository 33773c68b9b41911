//! `nappe connect`: a server on another machine, reached through ssh as if it were here.
//!
//! ssh runs this verb there as its far end (`--far-end`), which starts a server or finds the one that runs, says in one
//! line where it is and what it asks for, and ends what it started when its input is closed. The token travels inside
//! the connection of ssh, and is left here for clients of the same user.

use std::{io::Read as _, net::SocketAddr};

use clap::{Args, Parser};
use nappe_client::{
    Client,
    token::{Token, TokenFile, local_servers, private_folder},
};
use nappe_server::{Address, App, Config, DEFAULT_PORT, TokenPlace, numbers::whole};
use serde::{Deserialize, Serialize};
use serde_json::json;

use crate::{
    outside::{
        remote,
        ssh::{FarCommand, SshArgs},
        web::{Link, LinkArgs},
    },
    words::{
        error::{CliError, Exit, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Reach a server on another machine through ssh
///
/// It is started there if none runs.
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe connect anna@cluster                       a server there, on a free port here
  nappe connect anna@node7 --jump anna@login       through another machine
  nappe connect cluster --port 7000 -- --max-sessions 4   arguments of `nappe serve` for a server of its own

Uses the system's ssh with your configuration, keys and known hosts; a machine that ssh does not know is refused.
nappe has to be installed there. Ctrl-C ends the connection, and the server if it was started for it.")]
pub(crate) struct ConnectArgs {
    #[command(flatten)]
    ssh: SshArgs,
    /// Port here [default: a free one]
    #[arg(long, value_name = "PORT", default_value_t = 0, hide_default_value = true, value_parser = whole::<u16>(0..))]
    port: u16,
    /// Port there at which a running server is looked for
    #[arg(long, value_name = "PORT", default_value_t = DEFAULT_PORT, value_parser = whole::<u16>(0..))]
    far_port: u16,
    /// The command there
    #[arg(long, value_name = "PATH", default_value = "nappe")]
    program: String,
    /// Plays the other end, which ssh starts
    #[arg(long, hide = true)]
    far_end: bool,
    #[command(flatten)]
    link: LinkArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Arguments of `nappe serve`: with any, a server is started even if one runs
    #[arg(last = true, value_name = "SERVE-ARGUMENT")]
    serve: Vec<String>,
}

/// What the far end says.
#[derive(Serialize, Deserialize)]
struct Answer {
    /// Where the server listens there.
    address: SocketAddr,
    token: Option<String>,
    version: String,
    /// Whether it was started for this connection.
    started: bool,
}

/// Arguments of the server that the far end starts.
#[derive(Debug, Parser)]
#[command(name = "nappe serve", no_binary_name = true)]
struct FarServer {
    #[command(flatten)]
    config: Config,
}

/// Runs `nappe connect`.
///
/// # Errors
/// When ssh does not come through, there is no nappe there, or no server can be started.
pub(crate) fn run(args: &ConnectArgs) -> Result<()> {
    if args.far_end { far_end(args) } else { near_end(args) }
}

fn near_end(args: &ConnectArgs) -> Result<()> {
    let folder = private_folder().map_err(CliError::failure)?;
    let far_port = args.far_port.to_string();
    let mut words = vec![args.program.as_str(), "connect", "--far-end", "--far-port", &far_port, "-", "--"];
    words.extend(args.serve.iter().map(String::as_str));
    remote::block_on(async {
        let mut signal = std::pin::pin!(remote::interrupted_by(remote::catch_signals()?));
        let mut far = FarCommand::start(&args.ssh, &folder, &words)?;
        let line = tokio::select! {
            biased;
            signal = signal.as_mut() => {
                signal?;
                far.abort();
                return Err(CliError::new(Exit::Interrupted, "interrupted before the other end answered"));
            }
            line = far.first_line(&args.program) => line?,
        };
        let answer: Answer = serde_json::from_str(&line).map_err(|_no_answer| {
            CliError::failure("the nappe there does not know `connect`: it is older, or no nappe")
        })?;

        let here = far.forward(args.port, answer.address)?;
        // As long as it is held, clients of this user find the token.
        let _left = match &answer.token {
            None => None,
            Some(token) => {
                let left = Token::parse(token).and_then(|token| TokenFile::leave(&token, here));
                Some(left.map_err(CliError::failure)?)
            }
        };
        announce(args, here, &answer).await?;
        tokio::select! {
            biased;
            signal = signal.as_mut() => signal,
            broken = far.broken() => Err(broken),
        }
    })
}

/// Says where the server is, and a link that lets a browser in, once: on a terminal, or where it is asked for.
async fn announce(args: &ConnectArgs, here: SocketAddr, answer: &Answer) -> Result<()> {
    let (url, machine) = (format!("http://{here}"), &args.ssh.destination);
    let Answer { address, version, started, token: _ } = answer;
    match args.output.format() {
        Format::Json => output::json(&json!({
            "url": url, "machine": machine, "far_address": address, "version": version, "started": started,
        })),
        Format::Text => {
            let server = if *started { "was started and ends with this" } else { "ran already and goes on" };
            let link = if args.link.is_wanted() { link(&url).await } else { None };
            let page = link.unwrap_or_default();
            output::line(&format!(
                "nappe {version} on {machine}: the server at {address} there {server}. In another terminal:\n\n  \
                 export NAPPE_SERVER={url}\n  nappe list\n\n{page}Ctrl-C ends the connection."
            ))
        }
    }
}

/// What is said of a link to the page. None if the server there makes none: it is older.
async fn link(url: &str) -> Option<String> {
    let client = Client::connect(url).await.ok()?;
    let link = Link::make(&client, None).await.ok()?;
    Some(format!("In a browser, {}:\n\n  {}\n\n", link.told(), link.url))
}

/// Says where a server is and what it asks for, and goes on until the input is closed.
fn far_end(args: &ConnectArgs) -> Result<()> {
    remote::block_on(async {
        let signals = remote::catch_signals()?;
        let running = local_servers(args.far_port).into_iter().next().filter(|_| args.serve.is_empty());
        let version = env!("CARGO_PKG_VERSION").to_owned();
        let app = if let Some(server) = running {
            let token = Some(server.token.reveal().to_owned());
            output::json(&Answer { address: server.address, token, version, started: false })?;
            None
        } else {
            let app = App::start(far_config(args)?).map_err(CliError::failure)?;
            let token = app.token().map(|token| token.reveal().to_owned());
            output::json(&Answer { address: app.local_addr(), token, version, started: true })?;
            Some(app)
        };

        let ended = tokio::select! {
            ended = input_closed() => ended,
            signal = remote::interrupted_by(signals) => signal,
        };
        if let Some(app) = app {
            app.shutdown().await;
        }
        ended
    })
}

/// The server that is started: on a free port of loopback, unless its arguments say otherwise.
fn far_config(args: &ConnectArgs) -> Result<Config> {
    let named = args.serve.iter().any(|word| word.starts_with("--address"));
    let default = ["--address", "127.0.0.1:0"].into_iter().filter(|_| !named);
    let words = default.chain(args.serve.iter().map(String::as_str));
    let FarServer { config } = FarServer::try_parse_from(words).map_err(CliError::usage)?;
    if matches!(config.address, Address::Unix(_)) {
        return Err(CliError::usage(
            "a port is forwarded: the server there listens on TCP, not on a Unix socket",
        ));
    }
    Ok(Config { token_place: TokenPlace::Memory, ..config })
}

/// Waits until nobody can write to the input any more: ssh is gone, or was asked to end.
///
/// # Errors
/// When the system starts no thread.
async fn input_closed() -> Result<()> {
    let (closed, wait) = tokio::sync::oneshot::channel();
    let reader = std::thread::Builder::new().spawn(move || {
        // Nothing is read here; whatever comes, the end of it is what counts.
        let _ = std::io::stdin().lock().read_to_end(&mut Vec::new());
        let _ = closed.send(());
    });
    reader.map_err(|error| {
        CliError::failure(format!("the system starts no thread that reads standard input: {error}"))
    })?;
    let _ = wait.await;
    Ok(())
}

//! `nappe serve`: a server in this process until Ctrl-C, SIGTERM or the end of its terminal, perhaps with a Rerun viewer.

use std::{convert::Infallible, ffi::OsString, time::Duration};

use clap::Args;
use nappe_server::{Address, App, Config, Log, LogError, numbers::whole};
use serde_json::json;
use tokio::time::timeout;

use crate::{
    outside::{
        remote,
        viewer::{self, Child, Form, Place, Viewer},
        web::LinkArgs,
    },
    words::{
        error::{CliError, Result},
        output::{self, Format, OutputArgs},
    },
};

/// How long the viewer may take to leave.
const LEAVE: Duration = Duration::from_secs(1);

/// Run a server until Ctrl-C
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe serve                          on the loopback interface, port 6277
  nappe serve --address 127.0.0.1:0    on a free port
  nappe serve --token my.token         asks for the token in a file, for clients elsewhere
  nappe serve --links 30               with a link for each of 30 browsers
  nappe serve --rerun                  with a Rerun viewer that shows every session
  nappe serve --rerun rerun+http://192.168.1.5:9876/proxy

Callers show a token, which is drawn at each start and left where clients of the same user on this machine find it. The
link that is printed on a terminal, or with --link, lets a browser in, once and within 10 minutes; `nappe view --web`
makes another.

With --json the first line is an object with `url`, `version` and `token_file`. The log goes to standard error.")]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    config: Config,
    /// Show every session in Rerun: in the viewer at HOST:PORT, or in one that is started here
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "", value_parser = viewer::address)]
    rerun: Option<String>,
    /// What is logged, in the syntax of tracing: error, warn, info, debug, nappe_server=debug
    #[arg(long, env = "NAPPE_LOG", default_value = "info")]
    log: String,
    #[command(flatten)]
    link: LinkArgs,
    /// Print so many links, each of which lets one browser in, also into a file or a pipe
    #[arg(long, value_name = "N", conflicts_with_all = ["json", "link"], value_parser = whole::<u32>(1..=App::MOST_LINKS))]
    links: Option<u32>,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe serve`.
///
/// # Errors
/// When the address cannot be had, or there is no viewer to show the sessions.
pub(crate) fn run(args: &ServeArgs) -> Result<()> {
    if args.links.is_some() && !matches!(args.config.address, Address::Tcp(_)) {
        let why = "--links: browsers cannot reach a Unix socket; serve at a HOST:PORT, or leave --links out";
        return Err(CliError::usage(why));
    }
    remote::block_on(async {
        let viewer = match &args.rerun {
            Some(_) => Some(Viewer::find().await?),
            None => None,
        };
        let _log = Log::start(&args.log).map_err(|error| match error {
            LogError::Filter { .. } => CliError::usage(error),
            error => CliError::failure(error),
        })?;
        let signals = remote::catch_signals()?;
        let app = App::start(args.config.clone()).map_err(CliError::failure)?;
        let mut child = match &viewer {
            Some(viewer) => Some(show_all(viewer, &app, args).await?),
            None => None,
        };
        announce(&app, args)?;
        let ended = tokio::select! {
            never = followed(child.as_mut()) => match never {},
            signal = remote::interrupted_by(signals) => signal,
        };
        if let Some(child) = &mut child {
            // It has nothing to lose, and the server does not wait for it.
            let _ = timeout(LEAVE, child.finish()).await;
        }
        app.shutdown().await;
        ended
    })
}

/// Starts the viewer of all sessions.
async fn show_all(viewer: &Viewer, app: &App, args: &ServeArgs) -> Result<Child> {
    let connect = args.rerun.as_deref().filter(|url| !url.is_empty()).map(|url| format!("--connect={url}"));
    let options = [Some("--every-session".to_owned()), connect];
    let options = options.into_iter().flatten().map(OsString::from).collect();
    viewer.start(&Place::here(app.url(), app.token()), options, Form::View).await
}

/// Tells when the viewer ends, which never ends the server.
async fn followed(child: Option<&mut Child>) -> Infallible {
    if let Some(child) = child
        && let Err(failure) = child.end().await
    {
        output::note(&format!("nappe: sessions are no longer shown in Rerun: {}", CliError::from(failure)));
    }
    std::future::pending().await
}

/// Says where the server listens, where its token is, and how a browser comes in: the token itself is never printed.
fn announce(app: &App, args: &ServeArgs) -> Result<()> {
    let (url, version, file) = (app.url(), env!("CARGO_PKG_VERSION"), app.token_path());
    match args.output.format() {
        Format::Json => output::json(&json!({ "url": url, "version": version, "token_file": file })),
        Format::Text => {
            let token = match (file, app.token()) {
                (Some(file), _) => format!("your clients find its token in {}", file.display()),
                (None, Some(_)) => "clients show the token of the file that it was given".to_owned(),
                (None, None) => "it asks for no token: whoever reaches the address may call".to_owned(),
            };
            let page = page(app, args)?;
            output::line(&format!("nappe {version} serves on {url}; Ctrl-C ends it\n{token}{page}"))
        }
    }
}

/// What is said of the page for browsers, if there is one. A link that gives the token is not left in a log, which others
/// may read, unless it is asked for.
fn page(app: &App, args: &ServeArgs) -> Result<String> {
    let is_wanted = args.links.is_some() || args.link.is_wanted();
    if app.token().is_some() && !is_wanted {
        let is_served = matches!(app.address(), Address::Tcp(_));
        let way = format!("\na link for a browser: nappe view --web --server {}", app.url());
        return Ok(if is_served { way } else { String::new() });
    }
    // Without a token all browsers open the same address.
    let (count, once) = match app.token() {
        Some(_) => (args.links.unwrap_or(1), ", good once and for 10 minutes"),
        None => (1, ""),
    };
    let mut links = Vec::new();
    for _ in 0..count {
        links.extend(app.page_link().map_err(CliError::failure)?);
    }
    Ok(match links.as_slice() {
        [] => String::new(),
        [link] => format!("\nin a browser{once}: {link}"),
        several => format!("\nin {} browsers{once} each:\n{}", several.len(), several.join("\n")),
    })
}

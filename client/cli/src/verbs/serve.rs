//! `nappe serve`: a server in this process until Ctrl-C or SIGTERM, perhaps with a Rerun viewer.

use clap::Args;
use nappe_server::{App, Config};
use serde_json::json;
use tracing_subscriber::EnvFilter;

use crate::{
    error::{CliError, Result},
    follow,
    output::{self, Format, OutputArgs},
    remote,
};

/// Run a server until Ctrl-C
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe serve                          on the loopback interface, port 6277
  nappe serve --address 127.0.0.1:0    on a free port
  nappe serve --rerun                  with a Rerun viewer that shows every session
  nappe serve --rerun rerun+http://192.168.1.5:9876/proxy

With --json the first line is an object with `url` and `version`. The log goes to standard error.")]
pub(crate) struct ServeArgs {
    #[command(flatten)]
    config: Config,
    /// Show every session in Rerun: in the viewer at URL, or in one that is started here
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = "")]
    rerun: Option<String>,
    /// What is logged, in the syntax of tracing: error, warn, info, debug, nappe_server=debug
    #[arg(long, env = "NAPPE_LOG", default_value = "info")]
    log: String,
    #[command(flatten)]
    output: OutputArgs,
}

/// Runs `nappe serve`.
///
/// # Errors
/// When the address cannot be had, or Rerun is asked for in a build without it.
pub(crate) fn run(args: &ServeArgs) -> Result<()> {
    let viewer = args.rerun.as_deref().map(follow::Viewer::new).transpose()?;
    tracing_subscriber::fmt().with_env_filter(EnvFilter::new(&args.log)).with_writer(std::io::stderr).init();
    remote::block_on(async {
        let signals = remote::catch_signals()?;
        let app = App::start(args.config.clone()).map_err(CliError::failure)?;
        let url = app.url();
        match args.output.format() {
            Format::Json => output::json(&json!({ "url": url, "version": env!("CARGO_PKG_VERSION") }))?,
            Format::Text => {
                output::line(&format!(
                    "nappe {} serves on {url}; Ctrl-C ends it",
                    env!("CARGO_PKG_VERSION")
                ))?;
            }
        }
        let followed = async {
            match viewer {
                Some(viewer) => follow::follow(&url, viewer).await,
                None => std::future::pending().await,
            }
        };
        let ended = tokio::select! {
            ended = followed => ended,
            signal = remote::interrupted_by(signals) => signal,
        };
        app.shutdown().await;
        ended
    })
}

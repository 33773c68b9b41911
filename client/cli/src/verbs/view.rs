//! `nappe view`: shows a session in Rerun, live or as a recording.

use std::path::PathBuf;

use clap::Args;

use crate::{args::SessionArgs, error::Result, fields::ShownArgs};

/// Show a session in Rerun
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe view first                    a viewer on this screen, started if none is running
  nappe view first --connect          the viewer that runs on this machine
  nappe view first --connect rerun+http://192.168.1.5:9876/proxy
  nappe view first --save first.rrd   no viewer: every frame that the server keeps and those to come
  nappe view first --color speed --grid smoke          snow coloured by its speed, its mass as smoke
  nappe view first --grid slice:z=0                    arrows: velocities of the grid on a plane")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) session: SessionArgs,
    /// Connect to a running viewer instead of starting one
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = DEFAULT_VIEWER)]
    pub(crate) connect: Option<String>,
    /// Write a recording, until the session ends or Ctrl-C
    #[arg(long, value_name = "FILE.rrd", conflicts_with = "connect")]
    pub(crate) save: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shown: ShownArgs,
}

/// Where a Rerun viewer listens unless told otherwise.
pub(crate) const DEFAULT_VIEWER: &str = "rerun+http://127.0.0.1:9876/proxy";

/// Runs `nappe view`.
///
/// # Errors
/// In a build without Rerun.
#[cfg(not(feature = "rerun"))]
pub(crate) fn run(args: &ViewArgs) -> Result<()> {
    use crate::error::CliError;
    // Read here, so that both builds have the same command line.
    let SessionArgs { id, server, output } = &args.session;
    let _ = (server, output, &args.connect, &args.save, args.shown.grid());
    Err(CliError::usage(format!("session {id}: this build has no Rerun and cannot show it")).hint(
        "`nappe watch ID --save FOLDER` keeps PLY meshes; the feature `rerun`, on by default, brings Rerun",
    ))
}

/// Runs `nappe view`.
///
/// # Errors
/// When there is no such session, no server, no viewer, or the recording cannot be written.
#[cfg(feature = "rerun")]
pub(crate) fn run(args: &ViewArgs) -> Result<()> {
    live::run(args)
}

#[cfg(feature = "rerun")]
mod live {
    use nappe_rerun::{ShowError, ShowOptions, Shown, Sink, show};

    use super::ViewArgs;
    use crate::{
        error::{CliError, Exit, Result},
        output::{self, Format},
        paths, remote,
    };

    pub(super) fn run(args: &ViewArgs) -> Result<()> {
        let sink = sink(args)?;
        remote::block_on(async {
            let client = remote::connect(&args.session.server).await?;
            let session = client.get_session(&args.session.id).await?;
            let mut options = ShowOptions::for_sink(&sink, session.oldest_frame);
            options.watch.grid = args.shown.grid();
            options.color_by = args.shown.color().map(Into::into);
            let stop = async {
                // Without signal handlers, the session's end still ends the view.
                if remote::interrupted().await.is_err() {
                    std::future::pending::<()>().await;
                }
            };
            let shown = show(&client, &args.session.id, sink, options, stop, |_| {}).await;
            print(args, &shown.map_err(in_words)?)
        })
    }

    fn sink(args: &ViewArgs) -> Result<Sink> {
        match (&args.save, &args.connect) {
            (Some(path), _) if paths::is_recording(path) => Ok(Sink::Save(path.clone())),
            (Some(path), _) => Err(CliError::usage(format!(
                "--save {}: a Rerun recording is a file FILE.rrd",
                path.display()
            ))
            .hint("`nappe watch ID --save FOLDER` keeps PLY meshes")),
            (None, Some(url)) => Ok(Sink::Connect(url.clone())),
            (None, None) => Ok(Sink::Spawn),
        }
    }

    fn in_words(error: ShowError) -> CliError {
        match error {
            ShowError::Client(error) => error.into(),
            error => CliError::new(Exit::Failure, error),
        }
    }

    fn print(args: &ViewArgs, shown: &Shown) -> Result<()> {
        match args.session.output.format() {
            Format::Json => output::json(&serde_json::json!({
                "session_id": args.session.id,
                "frames": shown.frame_count,
                "dropped": shown.dropped_count,
                "finished": shown.end.is_some(),
                "saved": args.save,
            })),
            Format::Text => output::line(&format!(
                "{} frames shown, {} left out; the session {}",
                output::count(shown.frame_count),
                output::count(shown.dropped_count),
                if shown.end.is_some() { "has ended" } else { "goes on" },
            )),
        }
    }
}

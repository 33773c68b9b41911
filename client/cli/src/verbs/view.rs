//! `nappe view`: shows a session in Rerun, live or as a recording.

use std::{ffi::OsString, path::PathBuf};

use clap::Args;

use crate::{
    args::SessionArgs,
    error::{CliError, Result},
    fields::ShownArgs,
    output::{self, Format},
    paths, remote,
    save::File,
    viewer::{self, Form, Place, Shown, Viewer},
    write::ForceArgs,
};

/// Show a session in Rerun
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe view first                    a viewer on this screen, started if none is running
  nappe view first --connect          the viewer that runs on this machine
  nappe view first --connect rerun+http://192.168.1.5:9876/proxy
  nappe view first --save first.rrd   no viewer: every frame that the server keeps and those to come
  nappe view first --color speed --grid smoke          snow coloured by its speed, its mass as smoke
  nappe view first --grid slice:z=0                    arrows: velocities of the grid on a plane

NAPPE_VIEWER names the program that shows and records [default: nappe-viewer, beside nappe or on PATH].")]
pub(crate) struct ViewArgs {
    #[command(flatten)]
    pub(crate) session: SessionArgs,
    /// Connect to a running viewer instead of starting one: HOST:PORT, or rerun+http://HOST:PORT/proxy
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = DEFAULT_VIEWER, value_parser = viewer::address)]
    pub(crate) connect: Option<String>,
    /// Write a recording, until the session ends or Ctrl-C
    #[arg(long, value_name = "FILE.rrd", conflicts_with = "connect")]
    pub(crate) save: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) force: ForceArgs,
    #[command(flatten)]
    pub(crate) shown: ShownArgs,
}

/// Where a Rerun viewer listens unless told otherwise.
const DEFAULT_VIEWER: &str = "rerun+http://127.0.0.1:9876/proxy";

/// Runs `nappe view`.
///
/// # Errors
/// When there is no such session, no server, no viewer, or the recording cannot be written.
pub(crate) fn run(args: &ViewArgs) -> Result<()> {
    let file = file(args)?;
    let options = options(args, file.as_ref());
    let form = if file.is_some() { Form::Recording } else { Form::View };
    let SessionArgs { id, server, .. } = &args.session;
    remote::block_on(async {
        let viewer = Viewer::find().await?;
        remote::connect(server).await?.get_session(id).await?;
        let mut child = viewer.start(&Place::at(&server.server, &server.token), options, form).await?;
        let shown = tokio::select! {
            ended = child.end() => ended,
            signal = remote::interrupted() => { signal?; child.finish().await }
        };
        let Some(file) = file else { return print(args, shown?) };
        let kept = file.keep(&shown);
        let shown = shown.map_err(|failure| file.told(failure.into()))?;
        kept?;
        print(args, shown)
    })
}

/// The file of a recording, if there is to be one.
fn file(args: &ViewArgs) -> Result<Option<File>> {
    let Some(path) = &args.save else { return Ok(None) };
    if paths::is_recording(path) {
        return File::open(path, args.force.existing()).map(Some);
    }
    Err(CliError::usage(format!("--save {}: a Rerun recording is a file FILE.rrd", path.display()))
        .hint("`nappe watch ID --save FOLDER` keeps PLY meshes"))
}

/// What the viewer is told.
fn options(args: &ViewArgs, file: Option<&File>) -> Vec<OsString> {
    let id = &args.session.id;
    let mut options = match (file, &args.connect) {
        (Some(file), _) => viewer::saved(id, file.place()),
        (None, Some(url)) => [viewer::session(id), vec![format!("--connect={url}").into()]].concat(),
        (None, None) => viewer::session(id),
    };
    options.extend(args.shown.viewer_options());
    options
}

fn print(args: &ViewArgs, shown: Shown) -> Result<()> {
    match args.session.output.format() {
        Format::Json => output::json(&serde_json::json!({
            "session_id": args.session.id,
            "frames": shown.frames,
            "dropped": shown.dropped,
            "finished": shown.finished,
            "saved": args.save,
        })),
        Format::Text => output::line(&format!(
            "{} frames shown, {} left out; the session {}",
            output::count(shown.frames),
            output::count(shown.dropped),
            if shown.finished { "has ended" } else { "goes on" },
        )),
    }
}

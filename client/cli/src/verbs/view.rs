//! `nappe view`: shows a session in Rerun, live or as a recording; or makes a link to the server's page.

use std::{ffi::OsString, path::PathBuf};

use clap::Args;

use crate::{
    files::{paths, write::ForceArgs},
    options::{args::ServerArgs, fields::ShownArgs},
    outside::{
        remote,
        viewer::{self, Form, Place, Shown, Viewer},
        web::{self, Link},
    },
    save::File,
    words::{
        error::{CliError, Result},
        output::{self, Format, OutputArgs},
    },
};

/// Show a session in Rerun or in a browser
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe view first                    a viewer on this screen, started if none is running
  nappe view first --connect          the viewer that runs on this machine
  nappe view first --connect rerun+http://192.168.1.5:9876/proxy
  nappe view first --save first.rrd   no viewer: every frame that the server keeps and those to come
  nappe view first --color speed --grid smoke          snow coloured by its speed, its mass as smoke
  nappe view first --grid slice:z=0                    arrows: velocities of the grid on a plane
  nappe view first --web              a link to the server's page, which lets one browser in, once
  nappe view --web --open             and starts the browser; other users of this machine can see the link

NAPPE_VIEWER names the program that shows and records [default: nappe-viewer, beside nappe or on PATH].")]
pub(crate) struct ViewArgs {
    /// Id of the session, as `nappe list` shows it
    #[arg(value_name = "SESSION", required_unless_present = "web")]
    id: Option<String>,
    #[command(flatten)]
    server: ServerArgs,
    #[command(flatten)]
    output: OutputArgs,
    /// Print a link to the server's page, which lets one browser in, once
    #[arg(long, conflicts_with_all = ["connect", "save", "force", "grid", "grid_nodes", "color"])]
    web: bool,
    /// Start the browser of this machine with it
    #[arg(long, requires = "web")]
    open: bool,
    /// Connect to a running viewer instead of starting one: HOST:PORT, or rerun+http://HOST:PORT/proxy
    #[arg(long, value_name = "URL", num_args = 0..=1, default_missing_value = DEFAULT_VIEWER, value_parser = viewer::address)]
    connect: Option<String>,
    /// Write a recording, until the session ends or Ctrl-C
    #[arg(long, value_name = "FILE.rrd", conflicts_with = "connect")]
    save: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    #[command(flatten)]
    shown: ShownArgs,
}

/// Where a Rerun viewer listens unless told otherwise.
const DEFAULT_VIEWER: &str = "rerun+http://127.0.0.1:9876/proxy";

/// Runs `nappe view`.
///
/// # Errors
/// When there is no such session, no server, no viewer, no browser, or the recording cannot be written.
pub(crate) fn run(args: &ViewArgs) -> Result<()> {
    let Some(id) = args.id.as_deref().filter(|_| !args.web) else { return link(args) };
    let file = file(args)?;
    let options = options(args, id, file.as_ref());
    let form = if file.is_some() { Form::Recording } else { Form::View };
    let server = &args.server;
    remote::block_on(async {
        let viewer = Viewer::find().await?;
        remote::connect(server).await?.get_session(id).await?;
        let mut child = viewer.start(&Place::at(&server.server, &server.token), options, form).await?;
        let shown = tokio::select! {
            ended = child.end() => ended,
            signal = remote::interrupted() => { signal?; child.finish().await }
        };
        let Some(file) = file else { return print(args, id, shown?) };
        let kept = file.keep(&shown);
        let shown = shown.map_err(|failure| file.told(failure.into()))?;
        kept?;
        print(args, id, shown)
    })
}

/// Makes a link to the page of the server, prints it, and starts a browser with it if asked to.
fn link(args: &ViewArgs) -> Result<()> {
    if args.server.server.starts_with("unix:") {
        return Err(CliError::usage("no browser opens a Unix socket: `nappe serve --address HOST:PORT`"));
    }
    let link = remote::block_on(async {
        let client = remote::connect(&args.server).await?;
        if let Some(id) = &args.id {
            client.get_session(id).await?;
        }
        Ok(Link::make(&client, args.id.as_deref()).await?)
    })?;
    let Link { url, expires_in_seconds } = &link;
    match args.output.format() {
        Format::Json => {
            output::json(&serde_json::json!({ "url": url, "expires_in_seconds": expires_in_seconds }))?;
        }
        Format::Text => {
            output::line(url)?;
            output::note(&link.told());
        }
    }
    if args.open { web::open(url) } else { Ok(()) }
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
fn options(args: &ViewArgs, id: &str, file: Option<&File>) -> Vec<OsString> {
    let mut options = match (file, &args.connect) {
        (Some(file), _) => viewer::saved(id, file.place()),
        (None, Some(url)) => [viewer::session(id), vec![format!("--connect={url}").into()]].concat(),
        (None, None) => viewer::session(id),
    };
    options.extend(args.shown.viewer_options());
    options
}

fn print(args: &ViewArgs, id: &str, shown: Shown) -> Result<()> {
    match args.output.format() {
        Format::Json => output::json(&serde_json::json!({
            "session_id": id,
            "frames": shown.frames,
            "dropped": shown.dropped,
            "finished": shown.finished,
            "saved": args.save,
        })),
        Format::Text => output::line(&format!(
            "{} shown, {} left out; the session {}",
            output::several(shown.frames, "frame"),
            output::count(shown.dropped),
            if shown.finished { "has ended" } else { "goes on" },
        )),
    }
}

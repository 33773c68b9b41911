//! Computes a whole scene on a server, embedded or remote: the common part of `run`, `mecasim` and the demo.
//!
//! Enters: a scene and the options of the command line. Leaves: saved frames, and a summary on standard output.

mod embedded;
mod start;
mod resume;
mod pace;
mod progress;
mod record;
mod drive;
mod summary;

use std::path::Path;

use nappe_client::{Client, holds_snow};

pub(crate) use self::embedded::Embedded;
use self::{drive::Driven, progress::Shown, resume::Resumed, start::SavedFrame, summary::Summary};
use crate::{
    files::paths,
    options::args::{ComputeArgs, OtherServerArgs, OverrideArgs, TokenArgs},
    outside::{remote, viewer::Place},
    save::{Beside, Destination},
    scenes::scene::{self, Input},
    words::{
        error::{Exit, Result},
        output::{self, Format},
    },
};

/// Which server computes.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Server<'a> {
    /// One inside this command.
    Embedded,
    /// The one at this address, which is shown a token.
    At(&'a str, &'a TokenArgs),
}

impl<'a> Server<'a> {
    /// The server that was asked for, or an embedded one.
    pub(crate) fn new(args: &'a OtherServerArgs) -> Self {
        args.server.as_deref().map_or(Self::Embedded, |address| Self::At(address, &args.token))
    }

    /// Who must know the name of a shipped scene.
    pub(crate) fn names(self) -> scene::Names {
        match self {
            Self::Embedded => scene::Names::Ours,
            Self::At(..) => scene::Names::Servers,
        }
    }
}

/// What is computed.
struct Run<'a> {
    scene: &'a Input,
    overrides: OverrideArgs,
    shown: Shown,
    /// The frame that it begins at; none: it begins at the start of the scene.
    start: Option<SavedFrame>,
}

/// Computes a scene, saves its frames if asked to, prints the summary.
///
/// # Errors
/// When the scene is refused, the simulation fails, a frame cannot be saved, or the user ends it.
pub(crate) async fn compute(
    scene: &Input,
    args: &ComputeArgs,
    server: Server<'_>,
    format: Format,
) -> Result<()> {
    // First, so that a path that cannot be written is known before hours are computed.
    let save = args.save.as_deref().or(args.resume.as_deref());
    args.fields.check(save)?;
    args.picture.check(save)?;
    let shown = if args.quiet { Shown::Nothing } else { Shown::Progress };
    let (run, destination) = if let Some(folder) = &args.resume {
        let resumed = Resumed::find(folder, scene)?;
        let step_limit = args.overrides.step_limit().or_else(|| scene.steps()).unwrap_or(0);
        if resumed.has_ended(step_limit) {
            return tell_end(folder, resumed.reached.step, format);
        }
        let Resumed { frame, reached } = resumed;
        let fields = args.fields.as_saved(&frame.notes.properties);
        let overrides = args.overrides.or_in(frame.notes.precision);
        let run = Run { scene, overrides, shown, start: Some(frame) };
        (run, Some(Destination::going_on(folder, &fields, reached)))
    } else {
        let destination = destination(scene, args).await?;
        let start = args.start.as_deref().map(SavedFrame::read).transpose()?;
        (Run { scene, overrides: args.overrides.clone(), shown, start }, destination)
    };
    let folder = destination.as_ref().and_then(Destination::resumable).map(Path::to_owned);

    let (driven, summary) = match server {
        Server::At(address, token) => {
            let client = remote::connect_to(address, token).await?;
            let place = Place::at(address, token);
            Box::pin(compute_on(&client, &place, &run, destination)).await?
        }
        Server::Embedded => {
            let embedded = Embedded::start(args.ranks.clone()).await?;
            let place = embedded.place();
            let done = Box::pin(compute_on(&embedded.client, &place, &run, destination)).await;
            embedded.shutdown().await;
            done?
        }
    };
    let has_frames = args.resume.is_some() || driven.saved.is_some_and(|frames| frames > 0);
    let can_go_on = has_frames && !holds_snow(&driven.session);
    summary.print(&driven, format).map_err(|error| match &folder {
        Some(folder) if error.exit == Exit::Interrupted && can_go_on => {
            error.hint(format!("it goes on with: {}", resume::again(folder)))
        }
        _ => error,
    })
}

/// Where the frames go that are asked for: a table alone, or what `--save` names with a table beside it.
async fn destination(scene: &Input, args: &ComputeArgs) -> Result<Option<Destination>> {
    let (path, table) = match (&args.save, &args.table) {
        (Some(path), table) => (path, table.as_deref()),
        (None, Some(table)) => {
            paths::check_table(table)?;
            (table, None)
        }
        (None, None) => return Ok(None),
    };
    let beside = Beside { scene: Some(scene), table, picture: args.picture };
    Destination::open(path, args.force.existing(), &args.fields, beside).await.map(Some)
}

/// Tells that a run which was to go on in a folder has ended there after so many steps.
fn tell_end(folder: &Path, step: u64, format: Format) -> Result<()> {
    match format {
        Format::Json => output::json(&serde_json::json!({ "ended": true, "steps": step, "saved": folder })),
        Format::Text => output::line(&format!(
            "The run in {} has ended: its last frame is that of step {}. --steps N, with a larger number, goes on",
            folder.display(),
            output::count(step)
        )),
    }
}

async fn compute_on(
    client: &Client,
    place: &Place,
    run: &Run<'_>,
    mut destination: Option<Destination>,
) -> Result<(Driven, Summary)> {
    let Run { scene, overrides, shown, start } = run;
    let begun = match start {
        Some(start) => Some(start.send(client, scene.digest().as_deref()).await?),
        None => None,
    };
    let session = scene.create(client, String::new(), overrides, begun.as_ref()).await?;
    let begins = start.as_ref().map_or(Ok(()), |start| start.check(&session));
    let has_all = destination.as_ref().map_or(Ok(()), |destination| destination.check(&session));
    let driven = match begins.and(has_all) {
        Ok(()) => drive::drive(client, place, &session, destination.as_mut(), *shown).await,
        Err(error) => Err(error),
    };
    let told = driven.as_ref().ok().and_then(|driven| driven.told);
    let failure = driven.as_ref().ok().and_then(|driven| driven.session.failure.as_ref());
    let saved = match destination {
        Some(destination) => Some(Box::pin(destination.finish(told, failure)).await),
        None => None,
    };

    // A remote server is left as it was found, also after a failure. An error of the drive is reported first.
    let deleted = client.delete_session(&session.session_id).await;
    let driven = driven?;
    deleted?;
    let summary = Summary::new(scene.name().to_owned(), &driven, saved.transpose()?);
    Ok((driven, summary))
}

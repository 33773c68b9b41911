//! Computes a whole scene on a server, embedded or remote: the common part of `run`, `mecasim` and the demo.
//!
//! Enters: a scene and the options of the command line. Leaves: saved frames, and a summary on standard output.

mod embedded;
mod start;
mod resume;
mod pace;
mod progress;
mod job;
mod record;
mod drive;
mod summary;

use std::path::Path;

use nappe_client::{Client, holds_snow, v1};

pub(crate) use self::embedded::Embedded;
use self::{
    drive::{DriveEnd, Driven},
    job::{Found, Job},
    progress::Shown,
    resume::Resumed,
    start::SavedFrame,
    summary::Summary,
};
use crate::{
    files::{paths, write::Existing},
    options::args::{ComputeArgs, JobArgs, OtherServerArgs, OverrideArgs, TokenArgs},
    outside::{remote, viewer::Place},
    save::{Beside, Destination},
    scenes::{
        saved,
        scene::{self, Input},
    },
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
    /// What keeps it, if it is kept.
    job: Option<Job>,
    /// The file of the session that it goes on from; none: it begins.
    state: Option<Vec<u8>>,
}

/// What is computed, and where its frames go.
struct Prepared<'a> {
    run: Run<'a>,
    destination: Option<Destination>,
}

/// Computes a scene, saves its frames if asked to, prints the summary.
///
/// # Errors
/// When the scene is refused, the simulation fails, a frame cannot be saved, or the user ends it.
pub(crate) async fn compute(
    scene: &Input,
    args: &ComputeArgs,
    job: &JobArgs,
    server: Server<'_>,
    format: Format,
) -> Result<()> {
    let Some(Prepared { mut run, destination }) = Box::pin(prepare(scene, args, job, format)).await? else {
        return Ok(());
    };
    let folder = destination.as_ref().and_then(Destination::resumable).map(Path::to_owned);

    let (driven, summary) = match server {
        Server::At(address, token) => {
            let client = remote::connect_to(address, token).await?;
            let place = Place::at(address, token);
            Box::pin(compute_on(&client, &place, &mut run, destination)).await?
        }
        Server::Embedded => {
            let embedded = match &run.job {
                Some(_) => Embedded::for_files(args.ranks.clone()).await?,
                None => Embedded::start(args.ranks.clone()).await?,
            };
            let place = embedded.place();
            let done = Box::pin(compute_on(&embedded.client, &place, &mut run, destination)).await;
            embedded.shutdown().await;
            done?
        }
    };
    let has_frames = args.resume.is_some() || driven.saved.is_some_and(|frames| frames > 0);
    let can_go_on = has_frames && !holds_snow(&driven.session);
    let again = match &folder {
        _ if run.job.is_some() => Some("the same command line goes on from the last state kept".to_owned()),
        Some(folder) if can_go_on => Some(format!("it goes on with: {}", resume::again(folder))),
        _ => None,
    };
    summary.print(&driven, format).map_err(|error| match again {
        Some(again) if error.exit == Exit::Interrupted => error.hint(again),
        _ => error,
    })
}

/// Finds what is to be computed, and makes room for its frames; none of a run that has ended, which is told.
async fn prepare<'a>(
    scene: &'a Input,
    args: &ComputeArgs,
    job: &JobArgs,
    format: Format,
) -> Result<Option<Prepared<'a>>> {
    // First, so that a path that cannot be written is known before hours are computed.
    let save = args.save.as_deref().or(args.resume.as_deref());
    args.fields.check(save)?;
    args.picture.check(save)?;
    let shown = if args.quiet { Shown::Nothing } else { Shown::Progress };
    let overrides = args.overrides.clone();
    let run = Run { scene, overrides, shown, start: None, job: None, state: None };
    if let Some((job, found)) = Job::open(job, scene, args)? {
        return prepare_kept(run, args, (job, found), format);
    }
    if let Some(folder) = &args.resume {
        let resumed = Resumed::find(folder, scene)?;
        let step_limit = args.overrides.step_limit().or_else(|| scene.steps()).unwrap_or(0);
        if resumed.has_ended(step_limit) {
            let again = "--steps N, with a larger number, goes on";
            tell_end(Some(folder), resumed.reached.step, again, format)?;
            return Ok(None);
        }
        let Resumed { frame, reached } = resumed;
        let fields = args.fields.as_saved(&frame.notes.properties);
        let overrides = args.overrides.or_in(frame.notes.precision);
        let run = Run { overrides, start: Some(frame), ..run };
        let destination = Some(Destination::going_on(folder, &fields, reached)?);
        return Ok(Some(Prepared { run, destination }));
    }
    let destination = destination(scene, args).await?;
    let start = args.start.as_deref().map(SavedFrame::read).transpose()?;
    Ok(Some(Prepared { run: Run { start, ..run }, destination }))
}

/// The same of a run that is kept.
fn prepare_kept<'a>(
    run: Run<'a>,
    args: &ComputeArgs,
    (job, found): (Job, Found),
    format: Format,
) -> Result<Option<Prepared<'a>>> {
    let cleared = |existing| {
        let folder = |path| Destination::cleared(path, existing, &args.fields, run.scene);
        args.save.as_deref().map(folder).transpose()
    };
    let (destination, state) = match found {
        Found::Ended(step) => {
            tell_end(args.save.as_deref(), step, "--fresh begins it anew", format)?;
            return Ok(None);
        }
        Found::Nothing => (cleared(args.force.existing())?, None),
        // The frames that are there are its own.
        Found::Begun => (cleared(Existing::Overwritten)?, None),
        Found::State(state) => {
            let folder = |path| Destination::of_same(path, &args.fields, run.scene);
            (args.save.as_deref().map(folder).transpose()?, Some(state))
        }
    };
    Ok(Some(Prepared { run: Run { job: Some(job), state, ..run }, destination }))
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

/// Tells that a run which was to go on, in a folder if its frames are saved, has ended after so many steps; and what goes on.
fn tell_end(folder: Option<&Path>, step: u64, again: &str, format: Format) -> Result<()> {
    let steps = output::count(step);
    match (format, folder) {
        (Format::Json, _) => {
            output::json(&serde_json::json!({ "ended": true, "steps": step, "saved": folder }))
        }
        (Format::Text, Some(folder)) => output::line(&format!(
            "The run in {} has ended: its last frame is that of step {steps}. {again}",
            folder.display()
        )),
        (Format::Text, None) => output::line(&format!("The run has ended after {steps} steps. {again}")),
    }
}

async fn compute_on(
    client: &Client,
    place: &Place,
    run: &mut Run<'_>,
    mut destination: Option<Destination>,
) -> Result<(Driven, Summary)> {
    let session = make(client, run).await?;
    let begins = run.start.as_ref().map_or(Ok(()), |start| start.check(&session));
    let has_all = destination.as_ref().map_or(Ok(()), |destination| destination.check(&session));
    let is_noted = begins.and(has_all).and_then(|()| run.job.as_mut().map_or(Ok(()), Job::begin));
    let driven = match is_noted {
        Ok(()) => {
            let (destination, job) = (destination.as_mut(), run.job.as_mut());
            drive::drive(client, place, &session, destination, run.shown, job).await
        }
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
    let summary = Summary::new(run.scene.name().to_owned(), &driven, saved.transpose()?);
    if let Some(job) = &run.job
        && driven.end == DriveEnd::Session
        && driven.session.failure.is_none()
    {
        job.end(driven.session.step)?;
    }
    Ok((driven, summary))
}

/// Makes the session that is driven: of a scene, or of what was kept of a run, which is told.
async fn make(client: &Client, run: &mut Run<'_>) -> Result<v1::Session> {
    if let Some(file) = run.state.take() {
        let session = saved::go_on(client, file, String::new(), &run.overrides).await?;
        let step = output::count(session.step);
        output::note(&format!("{}: the run goes on from step {step}", run.scene.name()));
        return Ok(session);
    }
    let begun = match &run.start {
        Some(start) => Some(start.send(client, run.scene.digest().as_deref()).await?),
        None => None,
    };
    run.scene.create(client, String::new(), &run.overrides, begun.as_ref()).await
}

//! Drives a session from its start to its end, saving every frame if asked to.
//!
//! With frames to save, the session waits for the frames to be written: none is lost, however slow the disk, and the
//! server keeps no more than it keeps anyway. Without, it plays as fast as it can and only its diagnostics travel. A run that is
//! kept stands now and then, until its frames are written and its state is kept.

use std::{
    future::{self, Future},
    path::Path,
    time::Duration,
};

use nappe_client::{
    Client, ClientError, DiagnosticsEvent, Event, FrameStream, SessionEnd, Wait, WatchOptions, v1,
};
use tokio::{task::yield_now, time::sleep};

use super::{
    job::Job,
    progress::{Progress, Shown},
    record,
};
use crate::{
    outside::{remote, viewer::Place},
    save::{Destination, Form, Recording, Sink},
    words::error::{CliError, Result},
};

/// Rate of diagnostics when no frame is saved (Hz).
const DIAGNOSTICS_HZ: f64 = 10.0;

/// A session that was driven, and why that ended.
#[derive(Debug)]
pub(crate) struct Driven {
    /// The session as it stands: finished, failed, or paused when the user ended it.
    pub(crate) session: v1::Session,
    /// Steps that it had taken at its start.
    pub(crate) first_step: u64,
    /// Why the drive ended.
    pub(crate) end: DriveEnd,
    /// The end that the frames' stream told, if frames were saved here until then.
    pub(crate) told: Option<SessionEnd>,
    /// Frames that were saved, if they go anywhere: an interrupted session has made more of them.
    pub(crate) saved: Option<u64>,
}

/// Why a drive ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriveEnd {
    /// The session came to its end, or failed.
    Session,
    /// Ctrl-C, SIGTERM, or a terminal that closed.
    Interrupted,
}

/// Drives a session that is paused where its run begins or goes on, and keeps its frames if they go anywhere, and its states if it
/// is that of a job, which has no recording.
///
/// # Errors
/// When the connection breaks or a frame cannot be saved; a failed simulation is no error here.
pub(super) async fn drive(
    client: &Client,
    place: &Place,
    session: &v1::Session,
    destination: Option<&mut Destination>,
    shown: Shown,
    job: Option<&mut Job>,
) -> Result<Driven> {
    let id = session.session_id.as_str();
    let Some(Destination { path, form, .. }) = destination else {
        let progress = Progress::start(session, shown);
        return until_end(client, session, &progress, Box::pin(play(client, id, &progress, job))).await;
    };
    match form {
        Form::Sink(sink) => {
            let progress = Progress::start(session, shown);
            let mut kept = Kept::default();
            let saved = Box::pin(save(client, session, sink, &progress, &mut kept, job));
            let driven = until_end(client, session, &progress, saved).await?;
            Ok(Driven { told: kept.told, saved: Some(kept.frame_count), ..driven })
        }
        Form::Recording(recording, beside) => {
            let beside = beside.as_mut();
            let recorded = record(client, (place, path.as_path()), session, recording, beside, shown);
            Box::pin(recorded).await.map_err(|error| recording.file().told(error))
        }
    }
}

/// Drives a session that a viewer records, and keeps its frames beside the recording if asked to.
async fn record(
    client: &Client,
    (place, path): (&Place, &Path),
    session: &v1::Session,
    recording: &Recording,
    beside: Option<&mut Sink>,
    shown: Shown,
) -> Result<Driven> {
    let id = session.session_id.as_str();
    let mut child = record::begin(recording, place, id, path).await?;
    let progress = Progress::start(session, shown);
    let mut kept = Kept::default();
    let played = Box::pin(async {
        match beside {
            Some(sink) => Box::pin(save(client, session, sink, &progress, &mut kept, None)).await,
            None => Box::pin(play(client, id, &progress, None)).await,
        }
    });
    let recorded = Box::pin(record::follow(&mut child, client, id, played));
    let driven = until_end(client, session, &progress, recorded).await;
    let closed = child.finish().await;
    let kept = recording.file().keep(&closed);
    let driven = driven?;
    let saved = match closed {
        Ok(shown) => Some(shown.frames),
        // A session that came to its end was waited for already.
        Err(_) if driven.end == DriveEnd::Session => None,
        Err(failure) => return Err(failure.into()),
    };
    kept?;
    Ok(Driven { saved, ..driven })
}

/// Waits for the end of a session's computation, or for the user's.
async fn until_end(
    client: &Client,
    begun: &v1::Session,
    progress: &Progress,
    computed: impl Future<Output = Result<()>>,
) -> Result<Driven> {
    let end = tokio::select! {
        done = computed => { done?; DriveEnd::Session }
        signal = remote::interrupted() => { signal?; DriveEnd::Interrupted }
        never = progress.tell() => match never {},
    };
    progress.finish();
    let (id, first_step) = (begun.session_id.as_str(), begun.step);
    let session = match end {
        DriveEnd::Session => client.get_session(id).await?,
        DriveEnd::Interrupted => client.pause(id, Wait::Yes).await?.session,
    };
    Ok(Driven { session, first_step, end, told: None, saved: None })
}

/// Plays and saves every frame.
async fn save(
    client: &Client,
    session: &v1::Session,
    sink: &mut Sink,
    progress: &Progress,
    kept: &mut Kept,
    job: Option<&mut Job>,
) -> Result<()> {
    let id = session.session_id.as_str();
    let options = WatchOptions { pace_to_watcher: true, ..WatchOptions::every_from(0) };
    let frames = client.watch(id, sink.watch(options, session)).await?;
    client.play(id, 0.0).await?;

    let newest = job.as_ref().filter(|job| job.goes_on()).map(|_| session.frame);
    let mut saving = Saving { client, id, frames, sink, progress, kept, job, newest, broken: None };
    while saving.go_on().await? == Arrival::Saved {
        // Where frames come faster than they are written none is waited for, and Ctrl-C would not be seen.
        yield_now().await;
    }
    let session = client.get_session(id).await?;
    saving.nothing_lost(&session)
}

/// Plays without frames; diagnostics only tell how far it is.
async fn play(client: &Client, id: &str, progress: &Progress, mut job: Option<&mut Job>) -> Result<()> {
    let mut stream = client.watch_diagnostics(id, DIAGNOSTICS_HZ).await?;
    client.play(id, 0.0).await?;
    loop {
        let wait = job.as_deref().map(Job::wait);
        let next = tokio::select! {
            next = stream.next_event() => next,
            () = due(wait) => {
                job = Box::pin(kept(client, id, progress, job)).await?;
                continue;
            }
        };
        let Some(next) = next else { return Ok(()) };
        match next {
            Ok(DiagnosticsEvent::Diagnostics(diagnostics)) => progress.show(&diagnostics),
            Ok(DiagnosticsEvent::Broken { cause }) => progress.note(&remote::broke(client, &cause)),
            Ok(DiagnosticsEvent::Reconnected { attempts, cause }) => {
                progress.note(&remote::back(attempts, &cause));
            }
            Ok(_) => {}
            Err(error) => return unless_ended(client, id, error).await,
        }
    }
}

/// Returns once a state is due that is due in so long; never if none is.
async fn due(wait: Option<Duration>) {
    match wait {
        Some(wait) => sleep(wait).await,
        None => future::pending().await,
    }
}

/// Has a session of a job stand, keeps its state and plays on; the job, unless the session has ended meanwhile.
async fn kept<'a>(
    client: &Client,
    id: &str,
    progress: &Progress,
    job: Option<&'a mut Job>,
) -> Result<Option<&'a mut Job>> {
    let Some(job) = job else { return Ok(None) };
    let Some(session) = stand(client, id).await? else { return Ok(None) };
    job.keep(client, &session, progress).await;
    client.play(id, 0.0).await?;
    Ok(Some(job))
}

/// The session as it stands after the step in progress; none if it has ended.
async fn stand(client: &Client, id: &str) -> Result<Option<v1::Session>> {
    match client.pause(id, Wait::Yes).await {
        Ok(paused) => Ok(Some(paused.session).filter(|session| !has_ended(session))),
        Err(error) => unless_ended(client, id, error).await.map(|()| None),
    }
}

/// A stream's error is no news when the session itself has ended: then the session says why.
async fn unless_ended(client: &Client, id: &str, error: ClientError) -> Result<()> {
    let session = client.get_session(id).await?;
    if has_ended(&session) { Ok(()) } else { Err(error.into()) }
}

fn has_ended(session: &v1::Session) -> bool {
    matches!(session.state(), v1::SessionState::Finished | v1::SessionState::Failed)
}

/// What was kept of a session's frames, also if the user ends it.
#[derive(Clone, Copy, Debug, Default)]
struct Kept {
    frame_count: u64,
    told: Option<SessionEnd>,
}

/// A drive that saves.
struct Saving<'a> {
    client: &'a Client,
    id: &'a str,
    frames: FrameStream,
    sink: &'a mut Sink,
    progress: &'a Progress,
    kept: &'a mut Kept,
    /// The run that is kept, if it is, until its session ends.
    job: Option<&'a mut Job>,
    /// Newest frame saved.
    newest: Option<u64>,
    /// Why the stream stopped, if it did.
    broken: Option<ClientError>,
}

/// Whether the stream goes on.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Arrival {
    /// An event, which was saved if it is a frame.
    Saved,
    /// The stream is over, by its end or by an error.
    Over,
}

impl Saving<'_> {
    /// A session that finished must have given every frame; one that failed gave what it could.
    fn nothing_lost(&mut self, session: &v1::Session) -> Result<()> {
        if session.state() == v1::SessionState::Failed || self.newest == Some(session.frame) {
            return Ok(());
        }
        Err(match self.broken.take() {
            Some(error) => error.into(),
            None => CliError::failure(format!(
                "the stream of session {} ended before its last frame, {}: the frames saved are not all",
                self.id, session.frame
            )),
        })
    }

    /// Receives what comes next, or keeps a state that is due.
    async fn go_on(&mut self) -> Result<Arrival> {
        let wait = self.job.as_deref().map(Job::wait);
        tokio::select! {
            arrival = self.receive() => arrival,
            () = due(wait) => Box::pin(self.keep_state()).await,
        }
    }

    /// Has the session stand, saves its frames until then, keeps its state and plays on.
    async fn keep_state(&mut self) -> Result<Arrival> {
        let Some(session) = stand(self.client, self.id).await? else {
            self.job = None;
            return Ok(Arrival::Saved);
        };
        while self.newest < Some(session.frame) {
            if self.receive().await? == Arrival::Over {
                return Ok(Arrival::Over);
            }
        }
        if let Some(job) = &mut self.job {
            job.keep(self.client, &session, self.progress).await;
        }
        self.client.play(self.id, 0.0).await?;
        Ok(Arrival::Saved)
    }

    /// Saves the next frame, whatever else arrives before it. Dropping the future loses nothing.
    async fn receive(&mut self) -> Result<Arrival> {
        match self.frames.next().await {
            Some(Ok(Event::Topology(topology))) => self.sink.topology(topology),
            Some(Ok(Event::Frame(frame))) => {
                if let Some(diagnostics) = &frame.diagnostics {
                    self.progress.show(diagnostics);
                }
                self.newest = Some(frame.frame);
                self.sink.frame(&frame)?;
                self.kept.frame_count += 1;
            }
            Some(Ok(Event::End(end))) => {
                self.kept.told = Some(end);
                return Ok(Arrival::Over);
            }
            Some(Ok(Event::Broken { cause })) => self.progress.note(&remote::broke(self.client, &cause)),
            Some(Ok(Event::Reconnected { attempts, cause })) => {
                self.progress.note(&remote::back(attempts, &cause));
            }
            None => return Ok(Arrival::Over),
            Some(Ok(_)) => {}
            Some(Err(error)) => {
                self.broken = Some(error);
                return Ok(Arrival::Over);
            }
        }
        Ok(Arrival::Saved)
    }
}

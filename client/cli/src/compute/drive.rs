//! Drives a session from its start to its end, saving every frame if asked to.
//!
//! With frames to save, the server is asked for a few frames' worth of steps at a time and the
//! next window starts when those frames are written: no frame is lost, however slow the disk, and
//! the server never keeps more than a window. Without, the session plays as fast as it can and
//! only its diagnostics travel.

use nappe_client::{Client, ClientError, Event, FrameStream, Wait, WatchOptions, v1};

use super::progress::Progress;
use crate::{
    error::{CliError, Result},
    fields::{NODE_BYTES, PARTICLE_BYTES},
    remote,
    save::Sink,
};

/// Frames in a window.
const WINDOW_FRAMES: u64 = 8;
/// Rate of diagnostics when no frame is saved (Hz).
const DIAGNOSTICS_HZ: f64 = 10.0;

/// A session that was driven, and why that ended.
#[derive(Debug)]
pub(crate) struct Driven {
    /// The session as it stands: finished, failed, or paused when the user ended it.
    pub(crate) session: v1::Session,
    /// Why the drive ended.
    pub(crate) end: DriveEnd,
}

/// Why a drive ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DriveEnd {
    /// The session came to its end, or failed.
    Session,
    /// Ctrl-C or SIGTERM.
    Interrupted,
}

/// Drives a session that is paused at its start.
///
/// # Errors
/// When the connection breaks or a frame cannot be saved; a failed simulation is no error here.
pub(crate) async fn drive(client: &Client, session: &v1::Session, sink: Option<&mut Sink>) -> Result<Driven> {
    let progress = Progress::start(session.step_limit);
    let id = session.session_id.as_str();

    let computed = async {
        match sink {
            Some(sink) => save(client, session, sink, &progress).await,
            None => play(client, id, &progress).await,
        }
    };
    let end = tokio::select! {
        done = computed => { done?; DriveEnd::Session }
        signal = remote::interrupted() => { signal?; DriveEnd::Interrupted }
    };

    progress.finish();
    let session = match end {
        DriveEnd::Session => client.get_session(id).await?,
        DriveEnd::Interrupted => client.pause(id).await?,
    };
    Ok(Driven { session, end })
}

/// Steps in windows and saves every frame.
async fn save(client: &Client, session: &v1::Session, sink: &mut Sink, progress: &Progress) -> Result<()> {
    let id = session.session_id.as_str();
    let options = sink.watch(WatchOptions::every_from(0), session);
    let window = window_steps(client, session, &options).await?;
    let frames = client.watch(id, options).await?;
    let mut saving = Saving { client, id, frames, sink, progress, newest: None, broken: None };
    saving.run(window).await
}

/// Steps of a window: as many as [`WINDOW_FRAMES`] frames take, fewer if the server keeps fewer.
async fn window_steps(client: &Client, session: &v1::Session, options: &WatchOptions) -> Result<u64> {
    let limits = client.server_info().await?.limits.unwrap_or_default();
    let nodes = options.grid.map_or(0, |_| u64::from(limits.max_grid_nodes));
    let frame_bytes = (session.particle_count * PARTICLE_BYTES + nodes * NODE_BYTES).max(1);
    // Half of what is kept, so that the window before may still be on its way.
    let kept = limits.history_bytes_per_session / 2 / frame_bytes;
    let frames = WINDOW_FRAMES.min(kept).max(1);
    let steps = frames * u64::from(session.frame_interval_steps.max(1));
    Ok(steps.min(limits.max_steps_per_call.max(1)))
}

/// Plays without frames; diagnostics only move the progress bar.
async fn play(client: &Client, id: &str, progress: &Progress) -> Result<()> {
    let mut stream = client.watch_diagnostics(id, DIAGNOSTICS_HZ).await?;
    client.play(id, 0.0).await?;
    while let Some(next) = stream.next().await {
        match next {
            Ok(diagnostics) => progress.show(&diagnostics),
            Err(error) => return unless_ended(client, id, error).await,
        }
    }
    Ok(())
}

/// A stream's error is no news when the session itself has ended: then the session says why.
async fn unless_ended(client: &Client, id: &str, error: ClientError) -> Result<()> {
    let session = client.get_session(id).await?;
    if has_ended(&session) { Ok(()) } else { Err(error.into()) }
}

fn has_ended(session: &v1::Session) -> bool {
    matches!(session.state(), v1::SessionState::Finished | v1::SessionState::Failed)
}

/// A drive that saves.
struct Saving<'a> {
    client: &'a Client,
    id: &'a str,
    frames: FrameStream,
    sink: &'a mut Sink,
    progress: &'a Progress,
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
    async fn run(&mut self, window: u64) -> Result<()> {
        loop {
            let session = self.step_window(window).await?;
            let ended = has_ended(&session);
            while ended || self.newest.is_none_or(|newest| newest < session.frame) {
                if self.receive().await? == Arrival::Over {
                    break;
                }
            }
            if ended {
                return self.nothing_lost(&session);
            }
            if let Some(error) = self.broken.take() {
                return Err(error.into());
            }
        }
    }

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

    /// Takes the steps of a window and saves what arrives meanwhile.
    async fn step_window(&mut self, window: u64) -> Result<v1::Session> {
        let (client, id) = (self.client, self.id);
        let mut stepping = std::pin::pin!(client.step(id, window, Wait::Yes));
        let mut streaming = true;
        loop {
            tokio::select! {
                answer = &mut stepping => return match answer {
                    Ok(session) => Ok(session),
                    Err(error) => self.failed_session(error).await,
                },
                arrival = self.receive(), if streaming => streaming = arrival? == Arrival::Saved,
            }
        }
    }

    /// The session, if it is because it failed that a call did.
    async fn failed_session(&self, error: ClientError) -> Result<v1::Session> {
        let session = self.client.get_session(self.id).await?;
        if has_ended(&session) { Ok(session) } else { Err(error.into()) }
    }

    /// Saves the next frame, whatever else arrives before it.
    async fn receive(&mut self) -> Result<Arrival> {
        match self.frames.next().await {
            Some(Ok(Event::Topology(topology))) => self.sink.topology(topology)?,
            Some(Ok(Event::Frame(frame))) => {
                if let Some(diagnostics) = &frame.diagnostics {
                    self.progress.show(diagnostics);
                }
                self.newest = Some(frame.frame);
                self.sink.frame(&frame)?;
            }
            Some(Ok(Event::End(_))) | None => return Ok(Arrival::Over),
            Some(Ok(_)) => {}
            Some(Err(error)) => {
                self.broken = Some(error);
                return Ok(Arrival::Over);
            }
        }
        Ok(Arrival::Saved)
    }
}

//! A session on a server to Rerun, until it ends: client in, Rerun out.
//!
//! Enters: a client, a session, a sink. Leaves: the session in a file (every frame) or a viewer (the newest).

use std::{future::Future, pin::pin, sync::Arc};

use nappe_client::{
    Client, ClientError, Delivery, Event, FrameStream, Reason, SessionEnd, WatchOptions, holds_snow, v1,
};
use tokio::{sync::mpsc, task};

use crate::{
    coloring::ColorBy,
    error::RerunError,
    live::LiveRecorder,
    recorder::{Recorder, Sink},
};

/// Events that wait for the file: few, because each may hold megabytes.
const QUEUE: usize = 4;

/// How a session is shown.
#[derive(Debug, Clone, Default)]
pub struct ShowOptions {
    /// How its frames are watched. [`ShowOptions::for_sink`] chooses well. The array that the colour needs is
    /// asked for as well.
    pub watch: WatchOptions,
    /// What the colour of snow shows; `None`: how it is packed, if the session may hold snow.
    pub color_by: Option<ColorBy>,
    /// What the recording is called in Rerun; `None`: as the session's title, or its id where it has none.
    pub name: Option<String>,
    /// Ends the showing after so many frames; `None`: with the session.
    pub frame_limit: Option<u64>,
}

impl ShowOptions {
    /// Every frame the server still keeps for a file, the newest at most 60 times per second for a viewer.
    pub fn for_sink(sink: &Sink, oldest_frame: u64) -> Self {
        let watch = match sink {
            Sink::Save(_) => WatchOptions::every_from(oldest_frame),
            Sink::Connect(_) | Sink::Spawn => WatchOptions::latest(60.0),
        };
        Self { watch, ..Self::default() }
    }
}

/// What was shown.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Shown {
    /// Frames that arrived, whether they were drawn or not.
    pub frame_count: u64,
    /// Frames that the server or the live recorder left out.
    pub dropped_count: u64,
    /// How the session ended; `None` if `stop` came first.
    pub end: Option<SessionEnd>,
}

/// Why showing stopped.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ShowError {
    /// The server or the connection failed.
    #[error(transparent)]
    Client(#[from] ClientError),
    /// The recording or the viewer failed.
    #[error(transparent)]
    Rerun(#[from] RerunError),
}

/// Shows a session until it ends or `stop` completes, then closes the recording. `progress` sees each event.
///
/// # Errors
/// If the session cannot be watched, or the recording cannot be opened, written or closed. What was recorded
/// before an error of the server is kept and closed properly.
pub async fn show(
    client: &Client,
    session_id: &str,
    sink: Sink,
    options: ShowOptions,
    stop: impl Future<Output = ()>,
    progress: impl FnMut(&Event),
) -> Result<Shown, ShowError> {
    let session = client.get_session(session_id).await?;
    let is_complete = matches!(sink, Sink::Save(_)) && options.watch.delivery == Delivery::Every;
    let ShowOptions { watch: wanted, color_by, name, frame_limit } = options;
    let (frames, color_by) = watch(client, &session, wanted, color_by).await?;
    let title = if session.title.is_empty() { session.session_id } else { session.title };
    let title = name.unwrap_or(title);
    let mut show = Show { frames, color_by, frame_limit, shown: Shown::default(), progress };
    if is_complete { show.every(title, sink, stop).await } else { show.latest(title, sink, stop).await }
}

/// Watches with the array that the colour needs. Frames that were made before somebody asked for it lack it: when
/// no colour was asked for, they are shown without.
async fn watch(
    client: &Client,
    session: &v1::Session,
    watch: WatchOptions,
    color_by: Option<ColorBy>,
) -> Result<(FrameStream, ColorBy), ClientError> {
    let color = color_by.unwrap_or_default();
    let is_wanted = color_by.is_some() || holds_snow(session);
    let Some(field) = color.field().filter(|_| is_wanted) else {
        return Ok((client.watch(&session.session_id, watch).await?, color));
    };

    let with_color = WatchOptions { fields: watch.fields.with(field), ..watch.clone() };
    match client.watch(&session.session_id, with_color).await {
        Err(error) if color_by.is_none() && error.known_reason() == Some(Reason::FrameExpired) => {
            Ok((client.watch(&session.session_id, watch).await?, color))
        }
        opened => Ok((opened?, color)),
    }
}

struct Show<Progress> {
    frames: FrameStream,
    color_by: ColorBy,
    frame_limit: Option<u64>,
    shown: Shown,
    progress: Progress,
}

impl<Progress: FnMut(&Event)> Show<Progress> {
    /// Every frame goes to a thread that writes; the stream waits while the queue is full.
    async fn every(
        &mut self,
        title: String,
        sink: Sink,
        stop: impl Future<Output = ()>,
    ) -> Result<Shown, ShowError> {
        let (queue, events) = mpsc::channel(QUEUE);
        let color_by = self.color_by;
        let writer = task::spawn_blocking(move || write(&title, sink, color_by, events));

        let mut stop = pin!(stop);
        let received = loop {
            match self.next(stop.as_mut()).await {
                Ok(Some(event)) => {
                    // The writer hangs up only when it failed; its error is read below.
                    if queue.send(event).await.is_err() {
                        break Ok(());
                    }
                }
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            }
        };

        drop(queue);
        joined(writer.await)??;
        received?;
        Ok(self.shown)
    }

    /// The newest frame goes to a slot; nothing waits for the viewer.
    async fn latest(
        &mut self,
        title: String,
        sink: Sink,
        stop: impl Future<Output = ()>,
    ) -> Result<Shown, ShowError> {
        let color_by = self.color_by;
        let start = move || LiveRecorder::start(&title, sink, color_by);
        let recorder = joined(task::spawn_blocking(start).await)??;
        let mut stop = pin!(stop);
        let received = loop {
            match self.next(stop.as_mut()).await {
                Ok(Some(Event::Topology(topology))) => recorder.topology(Arc::new(topology)),
                Ok(Some(Event::Frame(frame))) => recorder.frame(Arc::new(frame)),
                Ok(Some(_)) => {}
                Ok(None) => break Ok(()),
                Err(error) => break Err(error),
            }
            if recorder.has_failed() {
                break Ok(());
            }
        };

        let summary = joined(task::spawn_blocking(move || recorder.finish()).await)??;
        received?;
        self.shown.dropped_count += summary.dropped_count;
        Ok(self.shown)
    }

    /// The next event, counted; `None` at the end of the stream, after the last frame wanted, or when `stop` is done.
    async fn next(
        &mut self,
        stop: std::pin::Pin<&mut impl Future<Output = ()>>,
    ) -> Result<Option<Event>, ClientError> {
        if self.frame_limit.is_some_and(|limit| self.shown.frame_count >= limit) {
            return Ok(None);
        }
        let event = tokio::select! {
            event = self.frames.next() => event,
            () = stop => None,
        };

        let Some(event) = event.transpose()? else { return Ok(None) };
        match &event {
            Event::Frame(frame) => {
                self.shown.frame_count += 1;
                self.shown.dropped_count += frame.dropped_count;
            }
            Event::End(end) => self.shown.end = Some(*end),
            _ => {}
        }

        (self.progress)(&event);
        Ok(Some(event))
    }
}

/// The writing thread: opens, records until the queue closes, closes.
fn write(
    title: &str,
    sink: Sink,
    color_by: ColorBy,
    mut events: mpsc::Receiver<Event>,
) -> Result<(), RerunError> {
    let mut recorder = Recorder::open(title, sink, color_by)?;
    while let Some(event) = events.blocking_recv() {
        match event {
            Event::Topology(topology) => recorder.topology(&topology)?,
            Event::Frame(frame) => recorder.frame(&frame)?,
            _ => {}
        }
    }
    recorder.finish()
}

fn joined<T>(result: Result<T, task::JoinError>) -> Result<T, RerunError> {
    result.map_err(|error| RerunError::Thread { cause: error.to_string() })
}

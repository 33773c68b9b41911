//! Streams: frames with reconnect and resume, and diagnostics without particles.
//!
//! Enters: `WatchFramesResponse` messages. Leaves: [`Event`]s. When the connection breaks, the stream asks
//! again, from the next frame (every frame) or from the newest (latest), and says so in an event.

use nappe_proto::v1;
use tonic::Streaming;

use crate::{
    client::{CALL_LIMIT, Client},
    decode::Decoder,
    error::ClientError,
    frame::Frame,
    options::{Delivery, WatchOptions},
    topology::Topology,
};

/// What a stream of frames brings.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant, reason = "nearly every event is a frame")]
pub enum Event {
    /// What the session is made of: first, and again only if it changed while the connection was broken.
    Topology(Topology),
    /// The particles at the next instant.
    Frame(Frame),
    /// The session finished; nothing follows.
    End(SessionEnd),
    /// The connection broke and is back.
    Reconnected {
        /// Attempts that it took.
        attempts: u32,
        /// The error that broke it.
        cause: String,
    },
}

/// How a session finished.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct SessionEnd {
    /// Number of the newest frame.
    pub frame: u64,
    /// Steps taken since the start.
    pub step: u64,
    /// Hash of the final state.
    pub state_hash: u64,
}

/// The frames of a session.
#[derive(Debug)]
pub struct FrameStream {
    client: Client,
    session_id: String,
    options: WatchOptions,
    decoder: Decoder,
    link: Link,
    /// Newest topology given to the caller.
    topology: Option<Topology>,
    /// The frame after the newest one given to the caller.
    next_frame: Option<u64>,
    /// Failures since a message last arrived.
    failures: u32,
}

/// The state of the connection.
#[derive(Debug)]
enum Link {
    Open(Box<Streaming<v1::WatchFramesResponse>>),
    Broken { cause: ClientError },
    Closed,
}

impl Client {
    /// Watches a session. The first message is the topology.
    ///
    /// # Errors
    /// If there is no such session, its watchers are too many, or the first frame wanted is no longer kept.
    pub async fn watch(&self, session_id: &str, options: WatchOptions) -> Result<FrameStream, ClientError> {
        let stream = self.open(session_id, &options, options.from_frame).await?;
        Ok(FrameStream {
            client: self.clone(),
            session_id: session_id.to_owned(),
            decoder: Decoder::new(options.fields, options.limits),
            link: Link::Open(Box::new(stream)),
            topology: None,
            next_frame: options.from_frame,
            failures: 0,
            options,
        })
    }

    /// Watches the diagnostics of a session, at most `max_rate_hz` messages per second (Hz); 0: one per frame.
    ///
    /// # Errors
    /// If there is no such session, or its watchers are too many.
    pub async fn watch_diagnostics(
        &self,
        session_id: &str,
        max_rate_hz: f64,
    ) -> Result<DiagnosticsStream, ClientError> {
        let message = v1::WatchDiagnosticsRequest { session_id: session_id.to_owned(), max_rate_hz };
        let mut calls = self.calls.clone();
        let stream = self.within("WatchDiagnostics", CALL_LIMIT, calls.watch_diagnostics(message)).await?;
        Ok(DiagnosticsStream { client: self.clone(), stream: Some(stream) })
    }

    /// Opens a stream of frames. The limit holds until it is open, not for the stream itself.
    async fn open(
        &self,
        session_id: &str,
        options: &WatchOptions,
        from_frame: Option<u64>,
    ) -> Result<Streaming<v1::WatchFramesResponse>, ClientError> {
        let message = options.request(session_id, from_frame);
        let mut calls = self.calls.clone();
        self.within("WatchFrames", CALL_LIMIT, calls.watch_frames(message)).await
    }
}

impl FrameStream {
    /// The next event; `None` after the end or after an error. Dropping the future loses no event.
    pub async fn next(&mut self) -> Option<Result<Event, ClientError>> {
        loop {
            let event = match &mut self.link {
                Link::Closed => return None,
                Link::Broken { .. } => self.reconnect().await,
                Link::Open(stream) => match stream.message().await {
                    Ok(Some(message)) => self.read(message),
                    Ok(None) => Err(ClientError::Truncated { session_id: self.session_id.clone() }),
                    Err(status) => {
                        let cause = ClientError::from_status(&status, &self.client.endpoint);
                        self.broken(cause)
                    }
                },
            };
            match event {
                Ok(None) => {}
                Ok(Some(event)) => return Some(Ok(event)),
                Err(error) => {
                    self.link = Link::Closed;
                    return Some(Err(error));
                }
            }
        }
    }
}

impl FrameStream {
    /// One message to an event, or to nothing when it is a piece of a frame.
    fn read(&mut self, message: v1::WatchFramesResponse) -> Result<Option<Event>, ClientError> {
        use v1::watch_frames_response::Event as Wire;
        self.failures = 0;
        match message.event {
            Some(Wire::Topology(wire)) => {
                let Some(topology) = self.decoder.topology(wire)? else { return Ok(None) };
                if self.topology.as_ref() == Some(&topology) {
                    return Ok(None);
                }
                self.topology = Some(topology.clone());
                Ok(Some(Event::Topology(topology)))
            }
            Some(Wire::Frame(wire)) => {
                let Some(frame) = self.decoder.frame(wire)? else { return Ok(None) };
                self.next_frame = Some(frame.frame + 1);
                Ok(Some(Event::Frame(frame)))
            }
            Some(Wire::End(end)) => {
                self.link = Link::Closed;
                let v1::SessionEnd { frame, step, state_hash } = end;
                Ok(Some(Event::End(SessionEnd { frame, step, state_hash })))
            }
            // An event of a newer server.
            None => Ok(None),
        }
    }

    /// Decides whether an error is worth another attempt.
    fn broken(&mut self, cause: ClientError) -> Result<Option<Event>, ClientError> {
        if !cause.is_transient() {
            return Err(cause);
        }
        self.failures += 1;
        if self.failures > self.options.reconnect.max_attempts {
            return Err(cause);
        }
        self.link = Link::Broken { cause };
        Ok(None)
    }

    /// Waits and asks again, from the frame after the newest one received.
    async fn reconnect(&mut self) -> Result<Option<Event>, ClientError> {
        if let Some(wait) = self.options.reconnect.delay(self.failures, fastrand::f64()) {
            tokio::time::sleep(wait).await;
        }
        let from_frame = match self.options.delivery {
            Delivery::Every => self.next_frame,
            Delivery::Latest => None,
        };
        match self.client.open(&self.session_id, &self.options, from_frame).await {
            Ok(stream) => {
                let link = std::mem::replace(&mut self.link, Link::Open(Box::new(stream)));
                let Link::Broken { cause } = link else { return Ok(None) };
                Ok(Some(Event::Reconnected { attempts: self.failures, cause: cause.to_string() }))
            }
            Err(cause) => self.broken(cause),
        }
    }
}

/// The diagnostics of a session, newest last.
#[derive(Debug)]
pub struct DiagnosticsStream {
    client: Client,
    stream: Option<Streaming<v1::WatchDiagnosticsResponse>>,
}

impl DiagnosticsStream {
    /// The next diagnostics; `None` after the session's end or after an error.
    pub async fn next(&mut self) -> Option<Result<v1::Diagnostics, ClientError>> {
        loop {
            match self.stream.as_mut()?.message().await {
                Ok(Some(message)) => {
                    if let Some(diagnostics) = message.diagnostics {
                        return Some(Ok(diagnostics));
                    }
                }
                Ok(None) => self.stream = None,
                Err(status) => {
                    self.stream = None;
                    return Some(Err(ClientError::from_status(&status, &self.client.endpoint)));
                }
            }
        }
    }
}

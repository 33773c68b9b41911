//! The diagnostics of a session without its particles, with reconnect and resume.
//!
//! Enters: `WatchDiagnosticsResponse` messages. Leaves: [`DiagnosticsEvent`]s, by the same rules as frames.

use nappe_proto::v1;
use tonic::Streaming;

use crate::{
    client::{Client, NO_LIMIT},
    error::ClientError,
    options::Delivery,
    reconnect::ReconnectPolicy,
    resume::{Arrival, Resuming, Source},
    watch::SessionEnd,
};

/// How a stream of diagnostics is wanted.
#[derive(Debug, Clone, Default)]
pub struct DiagnosticsOptions {
    /// Those of every frame, or of the newest.
    pub delivery: Delivery,
    /// The first frame wanted, for [`Delivery::Every`]. `None`: the newest.
    pub from_frame: Option<u64>,
    /// Most messages per second, for [`Delivery::Latest`] (Hz); 0: no limit.
    pub max_rate_hz: f64,
    /// Uid that the session must have; empty: any. A stream that comes back asks for the one that it began with.
    pub session_uid: String,
    /// What to do when the connection breaks.
    pub reconnect: ReconnectPolicy,
}

/// What a stream of diagnostics brings.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
#[allow(clippy::large_enum_variant, reason = "nearly every event is a message of diagnostics")]
pub enum DiagnosticsEvent {
    /// What the step before the next frame told.
    Diagnostics(v1::Diagnostics),
    /// How the session stands, or what happened to it: playing, paused, failed, parameters changed ...
    Change(v1::StateChange),
    /// Nothing came for 5 s; the server is there.
    Progress(v1::Progress),
    /// The session finished; nothing follows.
    End(SessionEnd),
    /// The connection broke; the stream is asked for again.
    Broken {
        /// The error that broke it.
        cause: String,
    },
    /// The connection broke and is back.
    Reconnected {
        /// Attempts that it took.
        attempts: u32,
        /// The error that broke it.
        cause: String,
    },
}

/// The diagnostics of a session, newest last.
#[derive(Debug)]
pub struct DiagnosticsStream {
    stream: Resuming<Diagnostics>,
}

/// Which diagnostics to ask for.
#[derive(Debug)]
struct Diagnostics {
    session_id: String,
    options: DiagnosticsOptions,
    /// The frame after the newest one given to the caller, or the first one wanted.
    next_frame: Option<u64>,
}

impl Source for Diagnostics {
    type Message = v1::WatchDiagnosticsResponse;

    async fn open(&self, client: &Client) -> Result<Streaming<Self::Message>, ClientError> {
        let DiagnosticsOptions { delivery, from_frame, max_rate_hz, session_uid, .. } = &self.options;
        let message = v1::WatchDiagnosticsRequest {
            max_rate_hz: *max_rate_hz,
            session_uid: session_uid.clone(),
            delivery: delivery.wire().into(),
            from_frame: if *delivery == Delivery::Every { self.next_frame } else { *from_frame },
            ..v1::WatchDiagnosticsRequest::of(&self.session_id)
        };
        let mut calls = client.calls.clone();
        client.within("WatchDiagnostics", NO_LIMIT, calls.watch_diagnostics(message)).await
    }
}

impl Client {
    /// Watches the diagnostics of a session, at most `max_rate_hz` messages per second (Hz); 0: one per frame.
    ///
    /// # Errors
    /// If there is no such session, or its watchers are too many.
    pub async fn watch_diagnostics(
        &self,
        session_id: &str,
        max_rate_hz: f64,
    ) -> Result<DiagnosticsStream, ClientError> {
        let delivery = if max_rate_hz == 0.0 { Delivery::Every } else { Delivery::Latest };
        let options = DiagnosticsOptions { delivery, max_rate_hz, ..DiagnosticsOptions::default() };
        self.watch_diagnostics_with(session_id, options).await
    }

    /// Watches the diagnostics of a session.
    ///
    /// # Errors
    /// If there is no such session, its watchers are too many, or the first frame wanted is no longer kept.
    pub async fn watch_diagnostics_with(
        &self,
        session_id: &str,
        options: DiagnosticsOptions,
    ) -> Result<DiagnosticsStream, ClientError> {
        let (session_id, next_frame, policy) = (session_id.to_owned(), options.from_frame, options.reconnect);
        let source = Diagnostics { session_id, options, next_frame };
        Ok(DiagnosticsStream { stream: Resuming::open(source, self, policy).await? })
    }
}

impl DiagnosticsStream {
    /// The next diagnostics; `None` after the session's end or after an error.
    pub async fn next(&mut self) -> Option<Result<v1::Diagnostics, ClientError>> {
        loop {
            match self.next_event().await? {
                Ok(DiagnosticsEvent::Diagnostics(diagnostics)) => return Some(Ok(diagnostics)),
                Ok(_) => {}
                Err(error) => return Some(Err(error)),
            }
        }
    }

    /// The next event; `None` after the end or after an error. Dropping the future loses no event.
    pub async fn next_event(&mut self) -> Option<Result<DiagnosticsEvent, ClientError>> {
        loop {
            let event = match self.stream.next().await? {
                Ok(Arrival::Message(message)) => self.read(message),
                Ok(Arrival::Broken { cause }) => Some(DiagnosticsEvent::Broken { cause }),
                Ok(Arrival::Reconnected { attempts, cause }) => {
                    Some(DiagnosticsEvent::Reconnected { attempts, cause })
                }
                Ok(Arrival::Over) => {
                    self.stream.close();
                    let session_id = self.stream.source.session_id.clone();
                    return Some(Err(ClientError::Truncated { session_id }));
                }
                Err(error) => return Some(Err(error)),
            };
            if let Some(event) = event {
                return Some(Ok(event));
            }
        }
    }

    /// One message to an event; none of a newer server.
    fn read(&mut self, message: v1::WatchDiagnosticsResponse) -> Option<DiagnosticsEvent> {
        use v1::watch_diagnostics_response::Event as Wire;
        Some(match message.event? {
            Wire::Diagnostics(diagnostics) => {
                self.stream.source.next_frame = Some(diagnostics.frame + 1);
                DiagnosticsEvent::Diagnostics(diagnostics)
            }
            Wire::Change(change) => {
                self.stream.source.options.session_uid.clone_from(&change.session_uid);
                DiagnosticsEvent::Change(change)
            }
            Wire::Progress(progress) => DiagnosticsEvent::Progress(progress),
            Wire::End(end) => {
                self.stream.close();
                DiagnosticsEvent::End(end.into())
            }
        })
    }
}

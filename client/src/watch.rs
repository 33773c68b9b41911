//! The frames of a session, with reconnect and resume.
//!
//! Enters: `WatchFramesResponse` messages. Leaves: [`Event`]s. When the connection breaks, the stream asks
//! again, from the next frame (every frame) or from the newest (latest), and says so in an event. It asks for the
//! session that it began with: one that was given the same id later is refused with `SESSION_REPLACED`.

use nappe_proto::v1;
use tonic::Streaming;

use crate::{
    client::{Client, NO_LIMIT},
    decode::Decoder,
    error::ClientError,
    frame::Frame,
    options::{Delivery, WatchOptions},
    resume::{Arrival, Resuming, Source},
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
    /// How the session stands, or what happened to it: playing, paused, failed, parameters changed ...
    Change(v1::StateChange),
    /// No frame came for 5 s; the server is there.
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

impl From<v1::SessionEnd> for SessionEnd {
    fn from(v1::SessionEnd { frame, step, state_hash }: v1::SessionEnd) -> Self {
        Self { frame, step, state_hash }
    }
}

/// The frames of a session.
#[derive(Debug)]
pub struct FrameStream {
    stream: Resuming<Frames>,
    decoder: Decoder,
    /// Newest topology given to the caller.
    topology: Option<Topology>,
}

/// Which frames to ask for.
#[derive(Debug)]
struct Frames {
    session_id: String,
    options: WatchOptions,
    /// The frame after the newest one given to the caller, or the first one wanted.
    next_frame: Option<u64>,
}

impl Source for Frames {
    type Message = v1::WatchFramesResponse;

    async fn open(&self, client: &Client) -> Result<Streaming<Self::Message>, ClientError> {
        let from_frame = match self.options.delivery {
            Delivery::Every => self.next_frame,
            // The newest; the server says what is wrong with a first frame of the caller's.
            Delivery::Latest => self.options.from_frame,
        };
        let message = self.options.request(&self.session_id, from_frame);
        let mut calls = match self.options.delivery {
            Delivery::Latest => client.calls.clone(),
            Delivery::Every => client.bulk.clone(),
        };
        client.within("WatchFrames", NO_LIMIT, calls.watch_frames(message)).await
    }
}

impl Client {
    /// Watches a session. The first message is the topology.
    ///
    /// # Errors
    /// If there is no such session, its watchers are too many, or the first frame wanted is no longer kept.
    pub async fn watch(&self, session_id: &str, options: WatchOptions) -> Result<FrameStream, ClientError> {
        let (decoder, policy) = (Decoder::new(options.fields, options.limits), options.reconnect);
        let (session_id, next_frame) = (session_id.to_owned(), options.from_frame);
        let stream = Resuming::open(Frames { session_id, options, next_frame }, self, policy).await?;
        Ok(FrameStream { stream, decoder, topology: None })
    }
}

impl FrameStream {
    /// Uid of the session, once the topology has begun to arrive.
    pub fn session_uid(&self) -> &str {
        &self.stream.source.options.session_uid
    }

    /// The next event; `None` after the end or after an error. Dropping the future loses no event.
    pub async fn next(&mut self) -> Option<Result<Event, ClientError>> {
        loop {
            let event = match self.stream.next().await? {
                Ok(Arrival::Message(message)) => self.read(message),
                Ok(Arrival::Broken { cause }) => Ok(Some(Event::Broken { cause })),
                Ok(Arrival::Reconnected { attempts, cause }) => {
                    Ok(Some(Event::Reconnected { attempts, cause }))
                }
                Ok(Arrival::Over) => {
                    Err(ClientError::Truncated { session_id: self.stream.source.session_id.clone() })
                }
                Err(error) => Err(error),
            };
            match event {
                Ok(None) => {}
                Ok(Some(event)) => return Some(Ok(event)),
                Err(error) => {
                    self.stream.close();
                    return Some(Err(error));
                }
            }
        }
    }

    /// One message to an event, or to nothing when it is a piece of a frame.
    fn read(&mut self, message: v1::WatchFramesResponse) -> Result<Option<Event>, ClientError> {
        use v1::watch_frames_response::Event as Wire;
        Ok(match message.event {
            Some(Wire::Topology(wire)) => {
                self.stream.source.options.session_uid.clone_from(&wire.session_uid);
                let topology = self.decoder.topology(wire)?;
                let Some(topology) = topology.filter(|topology| self.topology.as_ref() != Some(topology))
                else {
                    return Ok(None);
                };
                self.topology = Some(topology.clone());
                Some(Event::Topology(topology))
            }
            Some(Wire::Frame(wire)) => {
                let Some(frame) = self.decoder.frame(wire)? else { return Ok(None) };
                self.stream.source.next_frame = Some(frame.frame + 1);
                Some(Event::Frame(frame))
            }
            Some(Wire::Change(change)) => Some(Event::Change(change)),
            Some(Wire::Progress(progress)) => Some(Event::Progress(progress)),
            Some(Wire::End(end)) => {
                self.stream.close();
                Some(Event::End(end.into()))
            }
            // An event of a newer server.
            None => None,
        })
    }
}

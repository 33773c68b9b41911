//! A stream that is asked for again when its connection breaks.
//!
//! Enters: how to ask for it. Leaves: its messages, and when it came back. What to ask for the next time is the
//! caller's to say, in the source. Where nobody listens any more, the stream soon ends: sessions live in the memory of their
//! server.

use std::time::Duration;

use tokio::time::Instant;
use tonic::Streaming;

use crate::{client::Client, error::ClientError, reconnect::ReconnectPolicy};

/// How to ask for a stream, from where it stands.
pub(crate) trait Source {
    /// A message of the stream.
    type Message;

    /// Asks for the stream. A limit of time holds until it is open, not for the stream itself.
    async fn open(&self, client: &Client) -> Result<Streaming<Self::Message>, ClientError>;
}

/// A stream with its source.
#[derive(Debug)]
pub(crate) struct Resuming<S: Source> {
    pub(crate) source: S,
    client: Client,
    policy: ReconnectPolicy,
    link: Link<S::Message>,
    /// Failures since a message last arrived.
    failures: u32,
    /// Since when nobody listens at the address, if the last failure said so.
    refused_since: Option<Instant>,
}

/// The state of the connection.
#[derive(Debug)]
enum Link<M> {
    Open(Box<Streaming<M>>),
    Broken { cause: ClientError },
    Closed,
}

/// What a stream brings.
#[derive(Debug)]
pub(crate) enum Arrival<M> {
    Message(M),
    /// The connection broke; whoever asks for what comes next has it asked for again.
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
    /// The server closed the stream without an error.
    Over,
}

impl<S: Source> Resuming<S> {
    /// Asks for the stream.
    pub(crate) async fn open(
        source: S,
        client: &Client,
        policy: ReconnectPolicy,
    ) -> Result<Self, ClientError> {
        let stream = source.open(client).await?;
        let link = Link::Open(Box::new(stream));
        Ok(Self { source, client: client.clone(), policy, link, failures: 0, refused_since: None })
    }

    /// What comes next; `None` once closed. Dropping the future loses nothing.
    pub(crate) async fn next(&mut self) -> Option<Result<Arrival<S::Message>, ClientError>> {
        loop {
            let arrived = match &mut self.link {
                Link::Closed => return None,
                // It is rare and large: on the heap, so that the caller's future stays small.
                Link::Broken { .. } => Box::pin(self.reconnect()).await,
                Link::Open(stream) => match stream.message().await {
                    Ok(Some(message)) => {
                        self.failures = 0;
                        Ok(Some(Arrival::Message(message)))
                    }
                    Ok(None) => Ok(Some(Arrival::Over)),
                    Err(status) => self.broken(ClientError::from_status(&status, self.client.endpoint())),
                },
            };
            match arrived {
                Ok(None) => {}
                Ok(Some(arrival)) => return Some(Ok(arrival)),
                Err(error) => {
                    self.close();
                    return Some(Err(error));
                }
            }
        }
    }

    /// Ends the stream: nothing follows any more.
    pub(crate) fn close(&mut self) {
        self.link = Link::Closed;
    }

    /// Decides whether an error is worth another attempt.
    fn broken(&mut self, cause: ClientError) -> Result<Option<Arrival<S::Message>>, ClientError> {
        if !cause.is_transient() {
            return Err(cause);
        }
        self.failures += 1;
        let is_refused = matches!(cause, ClientError::Connect { .. });
        self.refused_since = is_refused.then(|| self.refused_since.unwrap_or_else(Instant::now));
        if self.failures > self.policy.max_attempts || self.refused_left() == Some(Duration::ZERO) {
            return Err(cause);
        }

        let was_open = matches!(self.link, Link::Open(_));
        let told = was_open.then(|| Arrival::Broken { cause: cause.to_string() });
        self.link = Link::Broken { cause };
        Ok(told)
    }

    /// How much longer nobody may listen at the address, if nobody does.
    fn refused_left(&self) -> Option<Duration> {
        self.refused_since.map(|since| self.policy.refused_limit.saturating_sub(since.elapsed()))
    }

    /// Waits and asks again.
    async fn reconnect(&mut self) -> Result<Option<Arrival<S::Message>>, ClientError> {
        if let Some(wait) = self.policy.delay(self.failures, fastrand::f64()) {
            tokio::time::sleep(self.refused_left().map_or(wait, |left| wait.min(left))).await;
        }
        match self.source.open(&self.client).await {
            Ok(stream) => {
                let link = std::mem::replace(&mut self.link, Link::Open(Box::new(stream)));
                let Link::Broken { cause } = link else { return Ok(None) };
                Ok(Some(Arrival::Reconnected { attempts: self.failures, cause: cause.to_string() }))
            }
            Err(cause) => self.broken(cause),
        }
    }
}

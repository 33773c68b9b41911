//! Steps with changes before them and the state after them, in one call: for a controller in a loop.
//!
//! Enters: what to change, how many steps, which arrays. Leaves: the session and a whole frame.

use nappe_proto::v1;

use crate::{
    client::Client,
    decode::decode_whole,
    error::ClientError,
    frame::Frame,
    options::{DecodeLimits, Encoding},
    selection::Fields,
};

/// Steps, what comes before them and what is told after them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Steps {
    /// So many more; 0: one. Only without `to_step`.
    pub step_count: u64,
    /// Until the session has taken so many since its initial state: such a call can be repeated.
    pub to_step: Option<u64>,
    /// Changes before the first of them, all or none.
    pub changes: Option<v1::Changes>,
    /// Arrays of the state after them, besides positions.
    pub fields: Fields,
    /// How the arrays travel.
    pub encoding: Encoding,
    /// What the client agrees to hold in memory.
    pub limits: DecodeLimits,
}

impl Client {
    /// Changes parameters, takes steps and returns the session with the state after them. There is no deadline: a
    /// step takes what it takes.
    ///
    /// # Errors
    /// If there is no such session, it has ended, a change is refused, a step fails, or the frame is above 3 MiB.
    pub async fn advance(&self, session_id: &str, steps: Steps) -> Result<(v1::Session, Frame), ClientError> {
        let Steps { step_count, to_step, changes, fields, encoding, limits } = steps;
        let message = v1::StepSessionRequest {
            step_count,
            to_step,
            changes,
            wait: true,
            frame: Some(v1::FrameRequest { fields: fields.request(), encoding: encoding.wire().into() }),
            ..v1::StepSessionRequest::of(session_id)
        };

        let method = "StepSession";
        let lacks = |what| ClientError::Incomplete { method, what };
        let v1::StepSessionResponse { session, frame } = self.stepped(message).await?;
        let (session, frame) = (session.ok_or(lacks("session"))?, frame.ok_or(lacks("frame"))?);
        let frame = decode_whole(frame, session.particle_count, fields, limits)?;
        Ok((session, frame))
    }
}

//! What is taken of a session to be saved or kept, between two of its steps.

use std::sync::Arc;

use nappe_proto::v1;
use nappe_sim::world::WorldState;

use super::{pending_changes::Queue, status::Properties};
use crate::{
    state::SavedSession,
    stream::{EncodedFrame, FieldSet},
};

/// What is to be saved of a session as it stands between two steps.
#[derive(Debug)]
pub(super) struct Taken {
    /// As it is described.
    pub(super) session: v1::Session,
    pub(super) state: WorldState,
    pub(super) state_hash: u64,
    /// The newest frame.
    pub(super) newest: Arc<EncodedFrame>,
    /// The changes that wait.
    pub(super) pending: Queue,
}

impl Taken {
    /// What a file has of the session, with this setup.
    pub(super) fn saved<Setup>(self, properties: &Properties, setup: Setup) -> SavedSession<Setup> {
        let Self { session, state, state_hash, newest, pending } = self;
        let mut frame = newest.whole(FieldSet::ALWAYS);
        // Its only field has a section of its own.
        let positions = frame.fields.pop().map_or_else(Vec::new, |field| field.data.to_vec());
        let origin = &properties.origin;
        SavedSession {
            session: v1::CreateSessionResponse { session: Some(session), warnings: origin.warnings.clone() },
            request: origin.request.clone(),
            setup,
            initial: properties.initial_changes.to_vec(),
            state,
            pending: pending.into_waiting(),
            frame,
            positions,
            state_hash,
            hash_interval: properties.hash_interval,
            colors: properties.colors.to_vec(),
        }
    }
}

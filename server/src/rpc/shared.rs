//! What all calls share: configuration, sessions, meshes, request ids, the signal to end.

use std::sync::Arc;

use tokio_util::sync::CancellationToken;
use tonic::Status;

use super::{request_ids::RequestIds, validate};
use crate::{
    config::Config,
    error::{Reason, ServiceError},
    scenes::MeshStore,
    session::{Registry, Session},
};

/// Everything that calls share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub config: Config,
    pub registry: Arc<Registry>,
    pub meshes: Arc<MeshStore>,
    pub request_ids: RequestIds,
    /// One permit per upload that may still start.
    pub uploads: tokio::sync::Semaphore,
    /// Cancelled when the server begins to end.
    pub draining: CancellationToken,
}

impl Shared {
    pub(crate) fn new(config: Config, draining: CancellationToken) -> Self {
        let limits = &config.limits;
        Self {
            registry: Arc::new(Registry::new(limits.max_sessions)),
            meshes: Arc::new(MeshStore::new(limits)),
            request_ids: RequestIds::default(),
            uploads: tokio::sync::Semaphore::new(limits.max_uploads as usize),
            draining,
            config,
        }
    }

    /// The session of an id, if it has this uid; an empty one fits every session.
    ///
    /// # Errors
    /// If the id is malformed, no session has it, or the one that has it is another.
    pub(crate) fn session(&self, id: &str, uid: &str) -> Result<Arc<Session>, ServiceError> {
        validate::session_id(id)?;
        let session = self.registry.get(id)?;
        session.expect_uid(uid)?;
        Ok(session)
    }

    /// The answer of a session, or why there is none. A shutdown deletes sessions too, and is then the
    /// reason.
    pub(crate) fn answered<T>(&self, answer: Result<T, ServiceError>) -> Result<T, Status> {
        answer.map_err(|error| {
            let drained = error.reason == Reason::SessionDeleted && self.draining.is_cancelled();
            if drained { ServiceError::draining().into() } else { error.into() }
        })
    }
}

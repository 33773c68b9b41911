//! What all calls share: configuration, sessions, meshes, requests, the sign to end.

use std::sync::Arc;

use tokio_util::sync::CancellationToken;
use tonic::Status;

use super::{request_ids::Requests, validate};
use crate::{
    config::Config,
    error::{Reason, ServiceError},
    scenes::MeshStore,
    session::{Registry, Session},
    stream::draining_error,
};

/// Everything that calls share.
#[derive(Debug)]
pub(crate) struct Shared {
    /// Limits and times.
    pub config: Config,
    /// Sessions.
    pub registry: Arc<Registry>,
    /// Uploaded meshes.
    pub meshes: Arc<MeshStore>,
    /// Requests that were carried out.
    pub requests: Requests,
    /// Uploads in progress.
    pub uploads: tokio::sync::Semaphore,
    /// Cancelled when the server is to end.
    pub draining: CancellationToken,
}

impl Shared {
    /// Nothing yet.
    pub(crate) fn new(config: Config, draining: CancellationToken) -> Self {
        let limits = &config.limits;
        Self {
            registry: Arc::new(Registry::new(limits.max_sessions)),
            meshes: Arc::new(MeshStore::new(limits)),
            requests: Requests::default(),
            uploads: tokio::sync::Semaphore::new(limits.max_uploads as usize),
            draining,
            config,
        }
    }

    pub(crate) fn session(&self, id: &str) -> Result<Arc<Session>, ServiceError> {
        validate::session_id(id)?;
        self.registry.get(id)
    }

    /// The answer of a session, or why there is none: a drain deletes sessions, too.
    pub(crate) fn answered<T>(&self, answer: Result<T, ServiceError>) -> Result<T, Status> {
        answer.map_err(|error| {
            let drained = error.reason == Reason::SessionDeleted && self.draining.is_cancelled();
            if drained { draining_error().into() } else { error.into() }
        })
    }
}

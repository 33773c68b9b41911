//! What all calls share: configuration, sessions, meshes, request ids, the signal to end.

use std::{sync::Arc, time::Instant};

use nappe_proto::token::Token;
use nappe_sim::world::Vectors;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};
use tokio_util::sync::CancellationToken;
use tonic::Status;

use super::{request_ids::RequestIds, upload::UnaryUploads, validate};
use crate::{
    config::Config,
    counters::Counters,
    error::{Reason, ServiceError},
    links::Links,
    memory::MemoryAccount,
    passes::{Passes, Visitor},
    refusals::Refusals,
    scenes::{Checkpoint, MeshStore},
    session::{Registry, Session},
    state::StateFolder,
    stream::Streams,
};

/// Everything that calls share.
#[derive(Debug)]
pub(crate) struct Shared {
    pub config: Config,
    pub registry: Arc<Registry>,
    pub meshes: Arc<MeshStore>,
    pub streams: Arc<Streams>,
    pub request_ids: RequestIds,
    /// Bytes of sessions, meshes and requests.
    pub memory: Arc<MemoryAccount>,
    /// Bytes of requests in progress, a part of these.
    pub requests: Arc<MemoryAccount>,
    /// One permit per upload that may still start.
    pub uploads: Arc<Semaphore>,
    pub unary_uploads: Arc<UnaryUploads>,
    pub counters: Arc<Counters>,
    pub refusals: Arc<Refusals>,
    pub links: Links,
    /// What links to one session gave.
    pub passes: Arc<Passes>,
    /// Where sessions are kept, if they are.
    pub state: Option<Arc<StateFolder>>,
    /// Cancelled when the server begins to end.
    pub draining: CancellationToken,
}

impl Shared {
    pub(crate) fn new(
        config: Config,
        token: Option<Token>,
        state: Option<Arc<StateFolder>>,
        draining: CancellationToken,
    ) -> Self {
        let limits = &config.limits;
        let memory = MemoryAccount::of_server(limits.server_bytes());
        Self {
            registry: Arc::new(Registry::new(limits.max_sessions)),
            meshes: Arc::new(MeshStore::new(limits, Arc::clone(&memory))),
            streams: Streams::new(limits.max_held_bytes, config.watcher_stall()),
            request_ids: RequestIds::default(),
            requests: MemoryAccount::of_requests(limits.max_request_bytes, &memory),
            memory,
            uploads: Arc::new(Semaphore::new(limits.max_uploads as usize)),
            unary_uploads: Arc::new(UnaryUploads::default()),
            counters: Arc::default(),
            refusals: Arc::default(),
            links: Links::new(token, config.link_time),
            passes: Arc::default(),
            state,
            draining,
            config,
        }
    }

    /// The session of an id, if it has this uid; an empty one fits every session. Those that are not for the visitor do not exist
    /// for it.
    ///
    /// # Errors
    /// If the id is malformed, no session has it, the one that has it is another, or the method is not for the visitor there.
    pub(crate) fn session(
        &self,
        visitor: &Visitor,
        id: &str,
        uid: &str,
    ) -> Result<Arc<Session>, ServiceError> {
        validate::session_id(id)?;
        let session = self.registry.get(id)?;
        if !visitor.sees(session.uid()) {
            return Err(Registry::missing(id));
        }
        session.expect_uid(uid)?;
        visitor.check(session.uid())?;
        session.touch();
        Ok(session)
    }

    /// Keeps a session from now on, where sessions are kept.
    pub(super) async fn keep(&self, session: &Session) {
        if let Some(state) = &self.state {
            let folder = state.session(session.uid());
            session.keep(folder, self.config.checkpoint_time(), &self.config.limits).await;
        }
    }

    /// Ends what links gave whose time is over, or whose session is not there any more.
    pub(crate) fn end_passes(&self) {
        self.passes.end_over(Instant::now(), |uid| self.registry.has(uid));
        // Nobody steers these copies any more: they go when they were idle for long.
        self.registry.pause(&self.passes.take_left());
    }

    /// Points (m) and velocities (m/s) of an uploaded mesh, without a copy.
    ///
    /// # Errors
    /// If no mesh has the id.
    pub(crate) fn vectors(&self, id: &str) -> Result<[Vectors; 2], ServiceError> {
        self.meshes.vectors(id).ok_or_else(|| no_mesh(id))
    }

    /// The uploaded file of a session.
    ///
    /// # Errors
    /// If no such file has the id.
    pub(crate) fn checkpoint(&self, id: &str) -> Result<Checkpoint, ServiceError> {
        self.meshes.checkpoint(id).ok_or_else(|| {
            let message = format!(
                "no uploaded file of a session has the id '{id}': it was never uploaded, or dropped for others"
            );
            ServiceError::new(Reason::CheckpointNotFound, message).with("checkpoint_id", id)
        })
    }

    /// A place among the uploads in progress.
    ///
    /// # Errors
    /// If there are as many as are allowed.
    pub(crate) fn upload_place(&self) -> Result<OwnedSemaphorePermit, ServiceError> {
        Arc::clone(&self.uploads).try_acquire_owned().map_err(|_full| {
            let allowed = self.config.limits.max_uploads;
            let message = format!("{allowed} uploads are in progress; allowed: at most {allowed}");
            ServiceError::new(Reason::TooManyUploads, message).with("allowed", allowed)
        })
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

/// The error of a mesh that there is not.
pub(super) fn no_mesh(id: &str) -> ServiceError {
    let message = format!("no mesh has the id '{id}': it was never uploaded, or dropped for others");
    ServiceError::new(Reason::MeshNotFound, message).with("mesh_id", id)
}

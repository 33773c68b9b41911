//! Uploads in calls of one message each: begun, added to at offsets, finished.
//!
//! Enters: headers and pieces, repeated or overlapping. Leaves: meshes. An upload that pauses, takes too long or comes
//! too slowly is forgotten, as one that streams is; its answer is remembered for as long as an upload may pause.

use std::{
    collections::HashMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use bytes::Bytes;
use tokio::{sync::OwnedSemaphorePermit, time::Instant};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::{
    incoming::{Header, Incoming, Stored, blocking, broken, check_piece},
    patience::{Lapse, UploadTimes},
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::MeshStore,
};

/// Stands for the bytes of an upload that was finished.
const FINISHED: usize = usize::MAX;

/// Uploads in progress, by their ids.
#[derive(Debug, Default)]
pub(crate) struct UnaryUploads {
    uploads: Mutex<HashMap<String, Arc<Upload>>>,
}

#[derive(Debug)]
struct Upload {
    start: Instant,
    /// One call at a time.
    state: Arc<tokio::sync::Mutex<Progress>>,
    /// Bytes that have come, or [`FINISHED`], and when the last call was.
    seen: Mutex<(usize, Instant)>,
}

#[derive(Debug)]
enum Progress {
    /// With its place among the uploads.
    Coming(Box<Incoming>, OwnedSemaphorePermit),
    Done(Result<Stored, ServiceError>),
}

impl Progress {
    /// Adds a piece at an offset; gives the bytes that have come.
    fn append(&mut self, offset: u64, data: &[u8]) -> Result<usize, ServiceError> {
        let Self::Coming(incoming, _) = self else {
            return Err(broken("the upload was finished; allowed: pieces before its end"));
        };

        let (received, total) = (incoming.received(), incoming.total());
        if offset > received as u64 {
            let message =
                format!("a piece begins at {offset}, and {received} bytes have come: some are missing");
            return Err(broken(message).with("offset", offset).with("received", received));
        }
        let begin = offset as usize;
        check_piece(data.len(), total - begin, total)?;

        // What came before changes nothing.
        incoming.append(&data[(received - begin).min(data.len())..])?;
        Ok(incoming.received())
    }

    /// Ends the upload, once; an upload that is not whole goes on.
    fn finish(&mut self, limits: &Limits, meshes: &MeshStore) -> Result<Stored, ServiceError> {
        match self {
            Self::Done(stored) => return stored.clone(),
            Self::Coming(incoming, _) => incoming.check_whole()?,
        }
        let unknown = Err(ServiceError::internal("checking the mesh panicked: this is a bug in the server"));
        let Self::Coming(incoming, _place) = std::mem::replace(self, Self::Done(unknown)) else {
            unreachable!("an upload that is done was answered above");
        };
        let stored = incoming.finish(limits, meshes);
        *self = Self::Done(stored.clone());
        stored
    }
}

impl UnaryUploads {
    /// Begins an upload, which holds `place`; gives its id and its size (bytes).
    ///
    /// # Errors
    /// A header that is not allowed.
    pub(in crate::rpc) fn begin(
        self: &Arc<Self>,
        header: &Header,
        limits: &Limits,
        (claim, place): (Claim, OwnedSemaphorePermit),
        (times, draining): (UploadTimes, CancellationToken),
    ) -> Result<(String, u64), ServiceError> {
        let incoming = Incoming::new(header, limits, claim)?;
        let (id, total) = (format!("upload-{}", Uuid::new_v4().simple()), incoming.total() as u64);
        let now = Instant::now();
        let upload = Arc::new(Upload {
            start: now,
            state: Arc::new(tokio::sync::Mutex::new(Progress::Coming(Box::new(incoming), place))),
            seen: Mutex::new((0, now)),
        });
        self.lock().insert(id.clone(), Arc::clone(&upload));

        let (all, own) = (Arc::clone(self), id.clone());
        tokio::spawn(async move {
            tokio::select! {
                () = lapse(&upload, times) => {}
                () = draining.cancelled() => {}
            }
            all.lock().remove(&own);
        });
        Ok((id, total))
    }

    /// Adds a piece at an offset; gives the bytes that have come.
    ///
    /// # Errors
    /// An upload that is not there, a piece that leaves a gap or goes beyond the whole.
    pub(in crate::rpc) async fn append(
        &self,
        id: &str,
        offset: u64,
        data: Bytes,
    ) -> Result<u64, ServiceError> {
        let upload = self.get(id)?;
        let state = Arc::clone(&upload.state).lock_owned().await;

        // A call that is given up is carried out all the same: what it holds is then whole.
        blocking(move || {
            let mut state = state;
            let received = state.append(offset, &data)?;
            *lock(&upload.seen) = (received, Instant::now());
            Ok(received as u64)
        })
        .await
    }

    /// Ends an upload and keeps its mesh.
    ///
    /// # Errors
    /// An upload that is not there or not whole, or a mesh that cannot be simulated.
    pub(in crate::rpc) async fn finish(
        &self,
        id: &str,
        limits: &Limits,
        meshes: &Arc<MeshStore>,
    ) -> Result<Stored, ServiceError> {
        let upload = self.get(id)?;
        let state = Arc::clone(&upload.state).lock_owned().await;
        let (limits, meshes) = (limits.clone(), Arc::clone(meshes));
        blocking(move || {
            let mut state = state;
            let stored = state.finish(&limits, &meshes);
            *lock(&upload.seen) = (FINISHED, Instant::now());
            stored
        })
        .await
    }

    fn get(&self, id: &str) -> Result<Arc<Upload>, ServiceError> {
        self.lock().get(id).cloned().ok_or_else(|| {
            let id: String = id.chars().take(80).collect();
            let message = format!("no upload in progress has the id '{id}'");
            ServiceError::new(Reason::UploadNotFound, message).with("upload_id", id)
        })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<String, Arc<Upload>>> {
        lock(&self.uploads)
    }
}

/// Waits until an upload has paused for too long, or is too slow.
async fn lapse(upload: &Upload, times: UploadTimes) {
    loop {
        let (received, last) = *lock(&upload.seen);
        let (until, lapse) = match received {
            // Its answer is remembered.
            FINISHED => (last + times.idle, Lapse::Idle),
            received => times.patience(upload.start, last, received),
        };
        if Instant::now() >= until {
            tracing::info!(?lapse, received, "an upload is forgotten");
            return;
        }
        tokio::time::sleep_until(until).await;
    }
}

/// No code that holds one of these locks can leave what it guards half changed.
fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

//! Receives a mesh in pieces: header first, sizes checked before anything is stored.
//!
//! Enters: a stream of pieces. Leaves: a mesh, or the reason why it was refused. What comes is decoded on threads
//! that may block, so that a large mesh holds up no other call.

use std::sync::Arc;

use nappe_proto::v1::{UploadMeshRequest, upload_mesh_request::Part};
use tokio::time::Instant;
use tokio_stream::{Stream, StreamExt as _};
use tonic::{Code, Status};

use super::{
    incoming::{Header, Incoming, Stored, blocking, broken, check_piece},
    patience::UploadTimes,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::MeshStore,
};

/// Small pieces are decoded together, as soon as they are so many bytes.
const BATCH_BYTES: usize = 256 << 10;

/// Receives an upload in the time that it has, and keeps its mesh; its memory is taken from `claim`.
///
/// # Errors
/// A status that says what is wrong with the pieces or the mesh, or that of a broken stream.
pub(in crate::rpc) async fn receive(
    pieces: impl Stream<Item = Result<UploadMeshRequest, Status>> + Unpin,
    limits: &Limits,
    times: UploadTimes,
    claim: Claim,
    meshes: Arc<MeshStore>,
) -> Result<Stored, Status> {
    let mut pieces = Pieces { stream: pieces, times, start: Instant::now(), received: 0 };
    let header = match pieces.next().await? {
        Some(Part::Header(header)) => Header::Mesh(header),
        Some(Part::File(header)) => Header::File(header),
        Some(Part::Data(_)) | None => return Err(broken("the first message has no header").into()),
    };

    let mut incoming = Incoming::new(&header, limits, claim)?;
    let mut batch = Vec::new();
    while let Some(part) = pieces.next().await? {
        let Part::Data(piece) = part else {
            return Err(broken("a second header came").into());
        };
        let missing = incoming.total() - incoming.received() - batch.len();
        check_piece(piece.len(), missing, incoming.total())?;
        pieces.received += piece.len();
        batch.extend_from_slice(&piece);
        if batch.len() >= BATCH_BYTES {
            (incoming, batch) = blocking(move || take(incoming, batch)).await?;
        }
    }

    // Reading a file and checking sort, which takes a while for a large mesh.
    let limits = limits.clone();
    let stored = blocking(move || take(incoming, batch)?.0.finish(&limits, &meshes));
    Ok(stored.await?)
}

/// Takes a batch; gives its memory back, empty.
fn take(mut incoming: Incoming, mut batch: Vec<u8>) -> Result<(Incoming, Vec<u8>), ServiceError> {
    incoming.append(&batch)?;
    batch.clear();
    Ok((incoming, batch))
}

/// Gives a reason to a status that the framework made while reading a stream.
pub(in crate::rpc) fn with_reason(status: Status) -> Status {
    let reason = match status.code() {
        _ if !status.details().is_empty() => return status,
        Code::OutOfRange | Code::ResourceExhausted => Reason::MessageTooLarge,
        Code::Cancelled | Code::Unknown | Code::Unavailable => Reason::RequestCancelled,
        _ => Reason::InvalidMessage,
    };
    ServiceError::new(reason, status.message()).into()
}

/// The pieces of an upload, and what it has sent so far.
struct Pieces<S> {
    stream: S,
    times: UploadTimes,
    start: Instant,
    /// Bytes of data.
    received: usize,
}

impl<S: Stream<Item = Result<UploadMeshRequest, Status>> + Unpin> Pieces<S> {
    async fn next(&mut self) -> Result<Option<Part>, Status> {
        let (until, lapse) = self.times.patience(self.start, Instant::now(), self.received);
        let piece = tokio::time::timeout_at(until, self.stream.next()).await;
        match piece.map_err(|_elapsed| self.times.error(lapse, self.received))?.transpose()? {
            None => Ok(None),
            Some(UploadMeshRequest { part: Some(part) }) => Ok(Some(part)),
            Some(UploadMeshRequest { part: None }) => {
                Err(broken("a message has neither header nor data").into())
            }
        }
    }
}

//! An upload of any kind, while its bytes come: arrays or a file.

use nappe_proto::v1::{FileHeader, MeshHeader};
use nappe_sim::mesh::MeshError;

use tokio::task::spawn_blocking;

use super::{assembly::Assembly, file::FileUpload, layout::Layout};
use crate::{
    config::{Limits, PIECE_BYTES},
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::MeshStore,
};

/// What an upload announces.
#[derive(Clone, Debug)]
pub(in crate::rpc) enum Header {
    Mesh(MeshHeader),
    File(FileHeader),
}

/// An upload of which some bytes have come.
#[derive(Debug)]
pub(super) enum Incoming {
    Arrays(Assembly),
    File(FileUpload),
}

/// A mesh that is kept, or the file of a session or of frames.
#[derive(Clone, Debug)]
pub(in crate::rpc) struct Stored {
    pub(in crate::rpc) mesh_id: String,
    pub(in crate::rpc) warnings: Vec<String>,
}

impl Incoming {
    /// An upload of no bytes yet, whose memory is taken from `claim`.
    ///
    /// # Errors
    /// A header that is not allowed.
    pub(super) fn new(header: &Header, limits: &Limits, claim: Claim) -> Result<Self, ServiceError> {
        Ok(match header {
            Header::Mesh(header) => Self::Arrays(Assembly::new(Layout::of(header, limits)?, claim)),
            Header::File(header) => Self::File(FileUpload::new(header, limits, claim)?),
        })
    }

    /// Bytes of the whole.
    pub(super) fn total(&self) -> usize {
        match self {
            Self::Arrays(assembly) => assembly.total(),
            Self::File(file) => file.total(),
        }
    }

    /// Bytes that have come.
    pub(super) fn received(&self) -> usize {
        match self {
            Self::Arrays(assembly) => assembly.received(),
            Self::File(file) => file.received(),
        }
    }

    /// Takes the bytes that come next: no more than are missing.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), ServiceError> {
        match self {
            Self::Arrays(assembly) => assembly.append(bytes),
            Self::File(file) => file.append(bytes),
        }
    }

    /// # Errors
    /// If bytes are missing.
    pub(super) fn check_whole(&self) -> Result<(), ServiceError> {
        let (came, total) = (self.received(), self.total());
        if came == total {
            return Ok(());
        }
        let message = format!("the upload ended after {came} of {total} bytes");
        Err(broken(message).with("bytes", came).with("total_bytes", total))
    }

    /// Checks what has come and keeps it. Its memory is claimed until the store has claimed its own.
    ///
    /// # Errors
    /// If bytes are missing, or it cannot be simulated or gone on from.
    pub(super) fn finish(self, limits: &Limits, meshes: &MeshStore) -> Result<Stored, ServiceError> {
        self.check_whole()?;
        let (mesh, mut warnings, _claim) = match self {
            Self::Arrays(assembly) => assembly.finish(),
            Self::File(file) if file.is_checkpoint() => {
                let (file, _claim) = file.into_checkpoint()?;
                return Ok(Stored { mesh_id: meshes.insert_checkpoint(file)?, warnings: Vec::new() });
            }
            Self::File(file) if file.is_frames() => {
                let (frames, _claim) = file.into_frames(limits)?;
                return Ok(Stored { mesh_id: meshes.insert_frames(frames)?, warnings: Vec::new() });
            }
            Self::File(file) => file.finish(limits)?,
        };
        let invalid = |error: MeshError| ServiceError::new(Reason::InvalidMesh, error.to_string());
        let odd = mesh.check().map_err(invalid)?;
        warnings.extend(odd.iter().map(ToString::to_string));
        Ok(Stored { mesh_id: meshes.insert(mesh)?, warnings })
    }
}

/// Checks a piece, of which `missing` bytes are new at most.
///
/// # Errors
/// A piece that is empty or too large, or that goes beyond the whole.
pub(super) fn check_piece(length: usize, missing: usize, total: usize) -> Result<(), ServiceError> {
    if length == 0 {
        return Err(broken("a piece has no bytes; allowed: 1 or more"));
    }

    if length > PIECE_BYTES {
        let message = format!("a piece has {length} bytes; allowed: at most {PIECE_BYTES}");
        return Err(broken(message).with("bytes", length).with("allowed", PIECE_BYTES));
    }

    if length > missing {
        let message = format!("more bytes came than the {total} that the header announces");
        return Err(broken(message).with("total_bytes", total));
    }
    Ok(())
}

/// Pieces that do not follow their header.
pub(super) fn broken(message: impl Into<String>) -> ServiceError {
    ServiceError::new(Reason::InvalidUpload, message)
}

/// Does work on a thread that may block, so that it holds up no other call.
///
/// # Errors
/// Those of the work, or that it panicked.
pub(super) async fn blocking<T: Send + 'static>(
    work: impl FnOnce() -> Result<T, ServiceError> + Send + 'static,
) -> Result<T, ServiceError> {
    spawn_blocking(work).await.map_err(|_panic| {
        ServiceError::internal("reading the upload panicked: this is a bug in the server")
    })?
}

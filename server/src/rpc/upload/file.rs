//! A mesh file that comes in pieces, and is read when it is whole, by the readers of the command; or the file of a session, or of frames.
//!
//! Enters: a header, then bytes. Leaves: the mesh or the frames, or what the reader found wrong, with file and line; the file of a session as it is,
//! of which the hashes were checked.

use nappe_proto::v1::{FileFormat, FileHeader};
use nappe_scene::{
    SceneError,
    mesh::{EtiOptions, Loaded, MeshFile, PointFrames, read_pc2},
};
use nappe_sim::mesh::TriangleMesh;

use super::layout::{check_name, check_points, check_size};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    state::Opened,
};

/// The file grows by a quarter at a time: while it is copied, old and new are there.
const GROWTH_SHARE: usize = 4;
/// Bytes by which it grows at least.
const LEAST_GROWTH: usize = 1 << 20;

/// A file of which some bytes have come.
#[derive(Debug)]
pub(super) struct FileUpload {
    name: String,
    format: FileFormat,
    /// Bytes of each file: one, or those of a set.
    sizes: [usize; 4],
    options: EtiOptions,
    data: Vec<u8>,
    claim: Claim,
}

impl FileUpload {
    /// # Errors
    /// A format, a name or a size that is not allowed.
    pub(super) fn new(header: &FileHeader, limits: &Limits, claim: Claim) -> Result<Self, ServiceError> {
        check_name("file.name", &header.name)?;
        let format = match FileFormat::try_from(header.format) {
            Ok(FileFormat::Unspecified) => {
                return Err(ServiceError::field(
                    "file.format",
                    "is missing: OBJ, OFF, PLY, STL, ETI, CHECKPOINT or PC2 is needed",
                ));
            }
            Ok(format) => format,
            Err(_unknown) => {
                let problem = format!("is {}, which this version does not know", header.format);
                return Err(ServiceError::field("file.format", problem).with("value", header.format));
            }
        };
        if header.byte_count == 0 {
            return Err(ServiceError::field("file.byte_count", "is 0: a file has bytes"));
        }

        let others = [header.faceset_byte_count, header.masses_byte_count, header.texcoord_byte_count];
        if format != FileFormat::Eti && (others != [0; 3] || header.missing_mass.is_some()) {
            let problem = "has files or masses of a set, and is none; allowed: one file";
            return Err(ServiceError::field("file.format", problem));
        }
        if header.missing_mass.is_some_and(|mass| !mass.is_finite() || mass < 0.0) {
            let problem = "is no mass; allowed: a finite number, 0 (pinned) or more";
            return Err(ServiceError::field("file.missing_mass", problem));
        }

        let sizes = [header.byte_count, others[0], others[1], others[2]];
        check_size(sizes.iter().fold(0, |sum: u64, size| sum.saturating_add(*size)), limits)?;
        Ok(Self {
            name: header.name.clone(),
            format,
            sizes: sizes
                .map(|size| usize::try_from(size).expect("the total, which is within the limit, fits")),
            options: EtiOptions { missing_mass: header.missing_mass },
            data: Vec::new(),
            claim,
        })
    }

    /// Bytes of the whole.
    pub(super) fn total(&self) -> usize {
        self.sizes.iter().sum()
    }

    /// Bytes that have come.
    pub(super) fn received(&self) -> usize {
        self.data.len()
    }

    /// Keeps the bytes that come next: no more than are missing.
    ///
    /// # Errors
    /// If there is no memory for them.
    pub(super) fn append(&mut self, bytes: &[u8]) -> Result<(), ServiceError> {
        let needed = self.data.len() + bytes.len();
        if needed > self.data.capacity() {
            let grown = self.data.len() + (self.data.len() / GROWTH_SHARE).max(LEAST_GROWTH);
            let capacity = needed.max(grown).min(self.total());
            self.claim.grow((capacity - self.data.capacity()) as u64)?;
            let _copied = self.claim.beside(self.data.capacity() as u64)?;
            self.data.try_reserve_exact(capacity - self.data.len()).map_err(|error| {
                let message = format!("there is no memory for the upload: {error}");
                ServiceError::new(Reason::RequestMemoryFull, message)
            })?;
        }
        self.data.extend_from_slice(bytes);
        Ok(())
    }

    /// Whether it is the file of a session, and no mesh.
    pub(super) fn is_checkpoint(&self) -> bool {
        self.format == FileFormat::Checkpoint
    }

    /// The file of a session, and what its memory is claimed by.
    ///
    /// # Errors
    /// What of the file was cut or altered.
    pub(super) fn into_checkpoint(self) -> Result<(Vec<u8>, Claim), ServiceError> {
        Opened::of(&self.data).map_err(|error| ServiceError::from(&error))?;
        Ok((self.data, self.claim))
    }

    /// Whether it holds frames of points, and no mesh.
    pub(super) fn is_frames(&self) -> bool {
        self.format == FileFormat::Pc2
    }

    /// Reads frames of points, after the memory that this takes was claimed.
    ///
    /// # Errors
    /// No memory, what is wrong with the file, or more points than the limits allow.
    pub(super) fn into_frames(self, limits: &Limits) -> Result<(PointFrames, Claim), ServiceError> {
        self.claim.grow(self.data.len() as u64)?;
        let frames = read_pc2(&self.data, self.name_in_messages()).map_err(|error| refused(&error))?;
        check_points(u64::from(frames.points), limits)?;
        Ok((frames, self.claim))
    }

    fn name_in_messages(&self) -> &str {
        if self.name.is_empty() { "upload" } else { &self.name }
    }

    /// Reads the file of a mesh, after the memory that this takes was claimed.
    ///
    /// # Errors
    /// Bytes that are missing, no memory, what is wrong with the file, or a mesh above the limits.
    pub(super) fn finish(self, limits: &Limits) -> Result<(TriangleMesh, Vec<String>, Claim), ServiceError> {
        let (file, rest) = self.data.split_at(self.sizes[0]);
        let (faceset, rest) = rest.split_at(self.sizes[1]);
        let (masses, texcoord) = rest.split_at(self.sizes[2]);
        let file = match self.format {
            FileFormat::Obj => MeshFile::Obj(file),
            FileFormat::Off => MeshFile::Off(file),
            FileFormat::Ply => MeshFile::Ply(file),
            FileFormat::Stl => MeshFile::Stl(file),
            FileFormat::Eti | FileFormat::Checkpoint | FileFormat::Pc2 | FileFormat::Unspecified => {
                MeshFile::Eti {
                    points: file,
                    others: [faceset, masses, texcoord].map(|bytes| (!bytes.is_empty()).then_some(bytes)),
                    options: self.options,
                }
            }
        };

        self.claim.grow(file.memory_bytes())?;
        let Loaded { mesh, warnings } =
            file.read(self.name_in_messages()).map_err(|error| refused(&error))?;
        check_points(mesh.points.len() as u64, limits)?;
        Ok((mesh, warnings, self.claim))
    }
}

/// What a reader found wrong, with its place.
fn refused(error: &SceneError) -> ServiceError {
    let refused = ServiceError::new(Reason::InvalidMesh, error.to_string())
        .with("violation", error.kind.reason())
        .with("file", &error.file);
    let refused = if error.line > 0 { refused.with("line", error.line) } else { refused };
    if error.column > 0 { refused.with("column", error.column) } else { refused }
}

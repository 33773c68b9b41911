//! Receives a mesh in pieces: header first, sizes checked before anything is stored.
//!
//! Enters: a stream of pieces. Leaves: a mesh, or the reason why it was refused.

use std::time::Duration;

use bytes::Bytes;
use nappe_proto::v1::{MeshHeader, UploadMeshRequest, upload_mesh_request::Part};
use nappe_scene::{is_printable, printable};
use nappe_sim::mesh::TriangleMesh;
use tokio_stream::{Stream, StreamExt as _};
use tonic::{Code, Status};

use crate::{
    config::{Limits, PIECE_BYTES},
    error::{Reason, ServiceError},
    scenes::MeshStore,
};

/// Longest name of a mesh (bytes).
const NAME_BYTES: usize = 256;

/// Receives an upload that pauses for at most `idle`.
///
/// # Errors
/// A status that says what is wrong with the pieces, or that of a broken stream.
pub(super) async fn receive(
    pieces: &mut (impl Stream<Item = Result<UploadMeshRequest, Status>> + Unpin),
    limits: &Limits,
    idle: Duration,
) -> Result<TriangleMesh, Status> {
    let Some(Part::Header(header)) = next(pieces, idle).await? else {
        return Err(broken("the first message has no header").into());
    };
    let layout = Layout::of(&header, limits)?;

    // Grows as data comes: a header alone takes no memory.
    let mut data = Vec::new();
    while let Some(part) = next(pieces, idle).await? {
        let Part::Data(piece) = part else {
            return Err(broken("a second header came").into());
        };
        check_piece(&piece, data.len(), &layout)?;
        data.extend_from_slice(&piece);
    }

    if data.len() != layout.total() {
        let (came, total) = (data.len(), layout.total());
        let error = broken(format!("the upload ended after {came} of {total} bytes"));
        return Err(error.with("bytes", came).with("total_bytes", total).into());
    }
    Ok(layout.decode(&data))
}

/// Checks a mesh and keeps it. Returns its id and warnings about it.
///
/// # Errors
/// If it cannot be simulated.
pub(super) fn store(mesh: TriangleMesh, meshes: &MeshStore) -> Result<(String, Vec<String>), ServiceError> {
    let warnings = mesh.check().map_err(|error| ServiceError::new(Reason::InvalidMesh, error.to_string()))?;
    Ok((meshes.insert(mesh), warnings.iter().map(ToString::to_string).collect()))
}

/// Gives a reason to a status that the framework made while reading a stream.
pub(super) fn with_reason(status: Status) -> Status {
    let reason = match status.code() {
        _ if !status.details().is_empty() => return status,
        Code::OutOfRange | Code::ResourceExhausted => Reason::MessageTooLarge,
        Code::Cancelled | Code::Unknown | Code::Unavailable => Reason::RequestCancelled,
        _ => Reason::InvalidMessage,
    };
    ServiceError::new(reason, status.message()).into()
}

async fn next(
    pieces: &mut (impl Stream<Item = Result<UploadMeshRequest, Status>> + Unpin),
    idle: Duration,
) -> Result<Option<Part>, Status> {
    let piece = tokio::time::timeout(idle, pieces.next()).await.map_err(|_elapsed| {
        let seconds = idle.as_secs_f64();
        let message = format!("no piece came within {seconds} s: the upload is forgotten");
        ServiceError::new(Reason::UploadTimedOut, message).with("seconds", seconds)
    })?;

    match piece.transpose()? {
        None => Ok(None),
        Some(UploadMeshRequest { part: Some(part) }) => Ok(Some(part)),
        Some(UploadMeshRequest { part: None }) => Err(broken("a message has neither header nor data").into()),
    }
}

fn check_piece(piece: &Bytes, received: usize, layout: &Layout) -> Result<(), ServiceError> {
    if piece.len() > PIECE_BYTES {
        let message = format!("a piece has {} bytes; allowed: at most {PIECE_BYTES}", piece.len());
        return Err(broken(message).with("bytes", piece.len()).with("allowed", PIECE_BYTES));
    }

    if piece.len() > layout.total() - received {
        let total = layout.total();
        let message = format!("more bytes came than the {total} that the header announces");
        return Err(broken(message).with("total_bytes", total));
    }
    Ok(())
}

fn broken(message: impl Into<String>) -> ServiceError {
    ServiceError::new(Reason::InvalidUpload, message)
}

/// Sizes of the arrays (bytes), in the order in which they come.
#[derive(Debug)]
struct Layout {
    points: usize,
    triangles: usize,
    masses: usize,
    uv: usize,
}

impl Layout {
    fn of(header: &MeshHeader, limits: &Limits) -> Result<Self, ServiceError> {
        if header.name.len() > NAME_BYTES {
            let problem = format!("has {} bytes; allowed: at most {NAME_BYTES}", header.name.len());
            return Err(ServiceError::field("header.name", problem));
        }

        if !is_printable(&header.name) {
            let problem =
                format!("is '{}'; allowed: a name without control characters", printable(&header.name));
            return Err(ServiceError::field("header.name", problem));
        }

        let points = header.point_count;
        if points == 0 {
            return Err(ServiceError::field("header.point_count", "is 0: a mesh has points"));
        }

        for (field, count) in [("header.mass_count", header.mass_count), ("header.uv_count", header.uv_count)]
        {
            if count != 0 && count != points {
                let problem = format!("is {count}: allowed are 0 and the number of points, {points}");
                return Err(ServiceError::field(field, problem));
            }
        }

        if points > limits.max_particles {
            let allowed = limits.max_particles;
            let message = format!("the mesh has {points} points; allowed: at most {allowed}");
            return Err(ServiceError::new(Reason::MeshTooLarge, message)
                .with("points", points)
                .with("allowed", allowed));
        }

        let sizes = [(points, 24), (header.triangle_count, 12), (header.mass_count, 8), (header.uv_count, 8)]
            .map(|(count, bytes)| count.saturating_mul(bytes));
        let total = sizes.iter().fold(0_u64, |sum, size| sum.saturating_add(*size));
        if total > limits.max_mesh_bytes {
            let allowed = limits.max_mesh_bytes;
            let message = format!("the upload has {total} bytes; allowed: at most {allowed}");
            return Err(ServiceError::new(Reason::MeshTooLarge, message)
                .with("bytes", total)
                .with("allowed", allowed));
        }

        let [points, triangles, masses, uv] = sizes.map(|size| {
            usize::try_from(size).expect("the total, which is within the limit, fits into memory")
        });
        Ok(Self { points, triangles, masses, uv })
    }

    fn total(&self) -> usize {
        self.points + self.triangles + self.masses + self.uv
    }

    fn decode(&self, data: &[u8]) -> TriangleMesh {
        let (points, rest) = data.split_at(self.points);
        let (triangles, rest) = rest.split_at(self.triangles);
        let (masses, uv) = rest.split_at(self.masses);
        TriangleMesh {
            points: group(&numbers(points, f64::from_le_bytes)),
            triangles: group(&numbers(triangles, u32::from_le_bytes)),
            masses: numbers(masses, f64::from_le_bytes),
            uv: group(&numbers(uv, |bytes| f64::from(f32::from_le_bytes(bytes)))),
        }
    }
}

fn numbers<T, const N: usize>(bytes: &[u8], from: impl Fn([u8; N]) -> T) -> Vec<T> {
    bytes.as_chunks().0.iter().map(|chunk| from(*chunk)).collect()
}

fn group<T: Copy, const N: usize>(flat: &[T]) -> Vec<[T; N]> {
    flat.as_chunks().0.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn header(point_count: u64, triangle_count: u64) -> MeshHeader {
        MeshHeader { name: "test".into(), point_count, triangle_count, ..MeshHeader::default() }
    }

    #[test]
    fn counts_that_overflow_are_refused_before_memory_is_taken() {
        let limits = Limits { max_particles: u64::MAX, ..Limits::default() };
        for (points, triangles) in [(u64::MAX, 0), (1, u64::MAX), (u64::MAX / 24, u64::MAX / 12)] {
            let error = Layout::of(&header(points, triangles), &limits).expect_err("too large");
            assert_eq!(error.reason, Reason::MeshTooLarge);
        }
    }

    #[test]
    fn a_layout_decodes_what_was_packed() {
        let sizes = MeshHeader { mass_count: 3, uv_count: 3, ..header(3, 1) };
        let layout = Layout::of(&sizes, &Limits::default()).expect("small");
        let mut data: Vec<u8> = (0..9).flat_map(|i| f64::from(i).to_le_bytes()).collect();
        data.extend([0_u32, 1, 2].iter().flat_map(|i| i.to_le_bytes()));
        data.extend([0.5_f64, 0.25, 0.0].iter().flat_map(|m| m.to_le_bytes()));
        data.extend([0.0_f32, 0.0, 1.0, 0.0, 0.0, 1.0].iter().flat_map(|c| c.to_le_bytes()));
        assert_eq!(data.len(), layout.total());
        let mesh = layout.decode(&data);
        assert_eq!(mesh.points, [[0.0, 1.0, 2.0], [3.0, 4.0, 5.0], [6.0, 7.0, 8.0]]);
        assert_eq!(mesh.triangles, [[0, 1, 2]]);
        assert_eq!(mesh.masses, [0.5, 0.25, 0.0]);
        assert_eq!(mesh.uv[1], [1.0, 0.0]);
    }
}

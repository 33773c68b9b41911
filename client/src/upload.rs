//! Mesh upload: arrays to a header and pieces of at most 1 MiB.
//!
//! Enters: [`MeshUpload`]. Leaves: `UploadMeshRequest` messages, in the order that the contract asks for.

use bytes::Bytes;
use nappe_proto::v1;

/// Largest piece (bytes).
const PIECE_BYTES: usize = 1 << 20;

/// A mesh to send.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct MeshUpload {
    /// A name for messages.
    pub name: String,
    /// Positions of the points (m).
    pub points: Vec<[f64; 3]>,
    /// Triangles: indices of points.
    pub triangles: Vec<[u32; 3]>,
    /// One mass per point (kg; 0 pins the particle), or none.
    pub masses: Vec<f64>,
    /// One pair of texture coordinates per point, or none.
    pub uv: Vec<[f32; 2]>,
    /// One velocity per point (m/s), or none.
    pub velocities: Vec<[f64; 3]>,
}

/// A mesh that the server keeps.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct UploadedMesh {
    /// Its id: a scene names it as `mesh = { upload = "ID" }`.
    pub mesh_id: String,
    /// What is odd about the mesh and does not stop a simulation.
    pub warnings: Vec<String>,
}

/// Why a mesh cannot be sent.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[non_exhaustive]
#[allow(missing_docs, reason = "the message of each variant says what its fields are")]
pub enum MeshError {
    /// An optional array has neither no value nor one per point.
    #[error("{count} {what} for {points} points (allowed: one per point, or none)")]
    Count { what: &'static str, count: usize, points: usize },
}

impl MeshUpload {
    /// The messages of the upload.
    ///
    /// # Errors
    /// If masses, texture coordinates or velocities are neither absent nor one per point.
    pub(crate) fn messages(&self) -> Result<Vec<v1::UploadMeshRequest>, MeshError> {
        use v1::upload_mesh_request::Part;
        let points = self.points.len();
        let (masses, uv, velocities) = (self.masses.len(), self.uv.len(), self.velocities.len());
        for (what, count) in [("masses", masses), ("texture coordinates", uv), ("velocities", velocities)] {
            if count != 0 && count != points {
                return Err(MeshError::Count { what, count, points });
            }
        }

        let header = v1::MeshHeader {
            name: self.name.clone(),
            point_count: points as u64,
            triangle_count: self.triangles.len() as u64,
            mass_count: self.masses.len() as u64,
            uv_count: self.uv.len() as u64,
            velocity_count: velocities as u64,
        };

        let mut messages = vec![v1::UploadMeshRequest { part: Some(Part::Header(header)) }];
        messages.extend(pieces(self.packed()));
        Ok(messages)
    }

    /// The arrays one after the other, little-endian.
    fn packed(&self) -> Bytes {
        let size =
            self.points.len() * 24 + self.triangles.len() * 12 + self.masses.len() * 8 + self.uv.len() * 8;
        let size = size + self.velocities.len() * 24;
        let mut data = Vec::with_capacity(size);
        data.extend(self.points.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        data.extend(self.triangles.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        data.extend(self.masses.iter().flat_map(|value| value.to_le_bytes()));
        data.extend(self.uv.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        data.extend(self.velocities.as_flattened().iter().flat_map(|value| value.to_le_bytes()));
        data.into()
    }
}

/// Data in pieces: slices of shared bytes, without a copy.
pub(crate) fn pieces(mut data: Bytes) -> impl Iterator<Item = v1::UploadMeshRequest> {
    use v1::upload_mesh_request::Part;
    std::iter::from_fn(move || {
        let piece = data.split_to(data.len().min(PIECE_BYTES));
        (!piece.is_empty()).then(|| v1::UploadMeshRequest { part: Some(Part::Data(piece)) })
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn data_of(messages: &[v1::UploadMeshRequest]) -> Vec<usize> {
        let length = |message: &v1::UploadMeshRequest| match &message.part {
            Some(v1::upload_mesh_request::Part::Data(data)) => Some(data.len()),
            _ => None,
        };
        messages.iter().filter_map(length).collect()
    }

    #[test]
    fn an_upload_is_a_header_then_pieces_of_at_most_one_mebibyte() {
        let points = vec![[1.0, 2.0, 3.0]; 100_000];
        let mesh = MeshUpload { masses: vec![0.5; points.len()], points, ..MeshUpload::default() };
        let messages = mesh.messages().expect("counts agree");
        let lengths = data_of(&messages);
        assert_eq!(messages.len(), lengths.len() + 1);
        assert!(matches!(messages[0].part, Some(v1::upload_mesh_request::Part::Header(_))));
        assert!(lengths.iter().all(|&length| length <= PIECE_BYTES));
        assert_eq!(lengths.iter().sum::<usize>(), 100_000 * 32);
    }

    #[test]
    fn the_arrays_are_packed_little_endian_in_the_order_of_the_header() {
        let mesh = MeshUpload {
            points: vec![[1.0, 2.0, 3.0]],
            triangles: vec![[0, 0, 0x0102_0304]],
            masses: vec![4.0],
            uv: vec![[0.5, 0.25]],
            ..MeshUpload::default()
        };

        let mut expected = Vec::new();
        for value in [1.0_f64, 2.0, 3.0] {
            expected.extend(value.to_le_bytes());
        }
        expected.extend([0, 0, 0, 0, 0, 0, 0, 0, 4, 3, 2, 1]);
        expected.extend(4.0_f64.to_le_bytes());
        expected.extend(0.5_f32.to_le_bytes());
        expected.extend(0.25_f32.to_le_bytes());

        assert_eq!(mesh.packed(), expected);
    }

    #[test]
    fn masses_that_miss_a_point_are_refused_with_both_counts() {
        let mesh = MeshUpload { points: vec![[0.0; 3]; 3], masses: vec![1.0; 2], ..MeshUpload::default() };
        assert_eq!(mesh.messages(), Err(MeshError::Count { what: "masses", count: 2, points: 3 }));
    }
}

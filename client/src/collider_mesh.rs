//! The closed surface of a mesh collider: its points and triangles, as bytes of the wire.
//!
//! Enters: `v1::MeshShape`. Leaves: what is wrong with it, if anything; its arrays.

use nappe_proto::v1;

/// Bytes of a point and of a triangle.
const TRIPLE_BYTES: usize = 12;

/// What is wrong with a surface that is to be drawn.
pub(crate) fn check(mesh: &v1::MeshShape) -> Result<(), &'static str> {
    let v1::MeshShape { points_f32, triangles_u32, .. } = mesh;
    let is_whole = |bytes: &[u8]| bytes.len().is_multiple_of(TRIPLE_BYTES);
    if !is_whole(points_f32) || !is_whole(triangles_u32) {
        return Err("its arrays hold no whole number of points and triangles");
    }
    if triangles_u32.is_empty() {
        return Err("it has no triangles");
    }

    let count = points_f32.len() / TRIPLE_BYTES;
    if !words(points_f32).map(f32::from_le_bytes).all(f32::is_finite) {
        return Err("a coordinate is not finite");
    }
    if words(triangles_u32).map(u32::from_le_bytes).any(|point| point as usize >= count) {
        return Err("a triangle of it names a point that is not there");
    }
    Ok(())
}

/// The points of a mesh collider at time 0 (m).
pub fn mesh_points(mesh: &v1::MeshShape) -> Vec<[f32; 3]> {
    triples(&mesh.points_f32, f32::from_le_bytes)
}

/// The triangles of a mesh collider, turned outwards: indices into its points.
pub fn mesh_triangles(mesh: &v1::MeshShape) -> Vec<[u32; 3]> {
    triples(&mesh.triangles_u32, u32::from_le_bytes)
}

fn triples<T>(bytes: &[u8], read: fn([u8; 4]) -> T) -> Vec<[T; 3]> {
    let triple =
        |t: &[u8]| std::array::from_fn(|i| read([t[4 * i], t[4 * i + 1], t[4 * i + 2], t[4 * i + 3]]));
    bytes.chunks_exact(TRIPLE_BYTES).map(triple).collect()
}

fn words(bytes: &[u8]) -> impl Iterator<Item = [u8; 4]> {
    bytes.chunks_exact(4).map(|word| [word[0], word[1], word[2], word[3]])
}

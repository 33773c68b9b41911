//! Meshes from formulas and texts, and back: each format in its file. Nothing here opens files.
//!
//! Readers take a text or bytes and a name for messages; no memory is taken for a count before
//! the file has shown what it counts. Writers give text or write to an `impl Write`.

pub(crate) mod numbers;
mod grid;
mod eti;
mod obj;
mod off;
mod ply;

pub use eti::{EtiOptions, EtiTexts, EtiWritten, NamedText, read_eti, write_eti};
pub use grid::course_grid;
pub use numbers::{six_digits, to_six_digits};
pub use obj::{read_obj, write_obj};
pub use off::{read_off, write_off};
pub use ply::{PlyFrame, PlyProperty, read_ply, write_ply, write_ply_frame};

use nappe_sim::mesh::TriangleMesh;

/// A mesh that was read, and what is odd about its file.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Loaded {
    /// The mesh.
    pub mesh: TriangleMesh,
    /// What is odd and was passed over.
    pub remarks: Vec<String>,
}

/// A polygon as a fan of triangles from its first corner.
fn fan(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> {
    let first = corners.first().copied().unwrap_or(0);
    corners.windows(2).skip(1).map(move |pair| [first, pair[0], pair[1]])
}

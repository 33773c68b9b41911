//! Meshes from formulas and texts, and back: each format in its file; the solids that closed ones enclose. Nothing here
//! opens files.
//!
//! Readers take a text or bytes and a name for messages; no memory is taken for a count before
//! the file has shown what it counts. Writers give text or write to an `impl Write`.

pub(crate) mod numbers;
mod loaded;
pub(crate) mod text;
mod ears;
mod polygon;
mod memory;
mod grid;
mod eti;
mod obj;
mod off;
mod ply;
mod stl;
mod vtp;
mod usda;
pub(crate) mod endings;
pub(crate) mod gzip;
mod format;
mod springs_csv;
mod pc2;
mod parts;
mod closed;
mod holes;
mod mended;
mod torus;
mod walker;
mod tunic;
#[cfg(test)]
mod tests;

pub use closed::enclosed_volume;
pub(crate) use closed::{Closed, NotClosed};
pub use eti::{EtiOptions, EtiTexts, EtiWritten, NamedText, read_eti, write_eti};
pub use format::MeshFile;
pub use grid::course_grid;
pub(crate) use holes::{Holes, MOST_EDGES};
pub use loaded::Loaded;
pub(crate) use mended::{Mended, mend};
pub use numbers::{six_digits, to_six_digits};
pub use obj::{read_obj, write_obj};
pub use off::{read_off, write_off};
pub(crate) use parts::Part;
pub use pc2::{PointFrames, read_pc2, write_pc2};
pub use ply::{PlyFrame, PlyNumbers, PlyProperty, read_ply, write_ply, write_ply_frame};
pub use springs_csv::{read_springs_csv, springs_csv};
pub use stl::read_stl;
pub(crate) use torus::shipped_torus;
pub(crate) use tunic::shipped_tunic;
pub use usda::{usda_numbers, usda_vectors};
pub use vtp::{VtpArray, VtpCells, VtpFact, VtpFile, VtpNumbers, VtpTold, escaped, write_vtp};
pub(crate) use walker::{shipped_walk, shipped_walker};

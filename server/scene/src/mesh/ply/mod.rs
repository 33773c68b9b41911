//! PLY, binary or text: positions, texture coordinates, masses, velocities, faces and springs; other properties are
//! ignored.
//!
//! Reads any of the three encodings; writes binary little-endian: doubles for a mesh, the numbers of a
//! frame as they are. The reader is ours: it knows strips and fans of triangles, takes no memory
//! for a count of the header alone, and its errors name the line or the element. Modules in reading order:

mod lines;
mod places;
mod header;
mod payload;
mod springs;
mod read;
mod write;

pub(super) use read::memory_bytes;
pub use read::read_ply;
pub use write::{PlyFrame, PlyNumbers, PlyProperty, write_ply, write_ply_frame};

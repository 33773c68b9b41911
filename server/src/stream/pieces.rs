//! How large one message may be, and how the pieces of a frame or a topology are numbered.

use nappe_proto::v1;

use crate::config::PIECE_BYTES;

/// Arrays in one message (bytes); the rest of [`PIECE_BYTES`] is for everything around them.
pub(super) const BUDGET_BYTES: usize = PIECE_BYTES - 4096;

/// The pieces of one frame or topology, each with its position among them.
pub(super) fn numbered<T>(pieces: Vec<T>) -> impl Iterator<Item = (v1::Chunk, T)> {
    let count = pieces.len() as u32;
    (0..).zip(pieces).map(move |(index, piece)| (v1::Chunk { index, count }, piece))
}

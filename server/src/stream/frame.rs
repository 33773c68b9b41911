//! A frame encoded once for all its watchers, and cut into messages of at most 1 MiB.
//!
//! Enters: a simulation between two steps. Leaves: little-endian arrays in shared memory; a
//! watcher's messages refer to them without a copy. Nodes of the snow's grid are shared too, and
//! packed for each watcher that wants them. What is not finite does not leave.

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::world::Simulation;

use super::{
    fields::{Array, Contents, Wanted},
    grid_frame::{Grid, NODE_BYTES, cut, packed_count},
    packing::NotFinite,
};
use crate::config::PIECE_BYTES;

/// Bytes of a message kept free for everything but arrays.
pub(crate) const MARGIN_BYTES: usize = 4096;

/// What a frame says besides its arrays.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameHead {
    /// Frame number.
    pub frame: u64,
    /// Steps taken.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Hash of the exact state, on some frames.
    pub state_hash: Option<u64>,
    /// Figures of its step.
    pub diagnostics: v1::Diagnostics,
}

/// A frame as all its watchers share it.
#[derive(Debug)]
pub(crate) struct EncodedFrame {
    /// Number, step, time, figures.
    pub head: FrameHead,
    arrays: [Option<Bytes>; Array::ALL.len()],
    grid: Option<Grid>,
}

impl EncodedFrame {
    /// Encodes what is `wanted` of the state as it is.
    ///
    /// # Errors
    /// The first number that is not finite.
    pub(crate) fn encode(
        simulation: &Simulation,
        wanted: Contents,
        head: FrameHead,
    ) -> Result<Self, NotFinite> {
        let mut arrays = [const { None }; Array::ALL.len()];
        for array in wanted.arrays() {
            arrays[array as usize] = Some(array.encode(simulation)?);
        }
        let grid = if wanted.covers(Contents::GRID) { Grid::of(simulation)? } else { None };
        Ok(Self { head, arrays, grid })
    }

    /// What it holds.
    pub(crate) fn contents(&self) -> Contents {
        let grid = if self.grid.is_some() { Contents::GRID } else { Contents::NONE };
        Array::ALL
            .into_iter()
            .filter(|array| self.arrays[*array as usize].is_some())
            .fold(grid, Contents::with)
    }

    /// Memory of the arrays and the grid (bytes).
    pub(crate) fn size(&self) -> usize {
        let arrays: usize = self.arrays.iter().flatten().map(Bytes::len).sum();
        arrays + self.grid.as_ref().map_or(0, Grid::size)
    }

    /// The messages of the frame with what is `wanted`, each of at most 1 MiB.
    pub(crate) fn pieces(&self, wanted: &Wanted, dropped_count: u64) -> Vec<v1::Frame> {
        let mut cutter = Cutter::new(PIECE_BYTES - MARGIN_BYTES);
        for array in wanted.arrays.arrays() {
            if let Some(data) = &self.arrays[array as usize] {
                cutter.add_array(array, data.clone());
            }
        }
        if let (Some(grid), Some(choice)) = (&self.grid, &wanted.grid) {
            cutter.add_grid(grid.choose(choice));
        }
        let count = cutter.pieces.len() as u32;
        let mut diagnostics = Some(self.head.diagnostics.clone());
        let pieces = cutter.pieces.into_iter().enumerate();
        pieces
            .map(|(index, Piece { fields, grid })| v1::Frame {
                frame: self.head.frame,
                step: self.head.step,
                time_seconds: self.head.time,
                state_hash: self.head.state_hash,
                topology_id: TOPOLOGY_ID,
                fields,
                chunk: Some(v1::Chunk { index: index as u32, count }),
                dropped_count: if index == 0 { dropped_count } else { 0 },
                diagnostics: diagnostics.take(),
                grid,
            })
            .collect()
    }
}

/// A session has one topology, for all its life.
pub(crate) const TOPOLOGY_ID: u32 = 1;

/// What one message carries of arrays and grid.
#[derive(Debug, Default)]
struct Piece {
    fields: Vec<v1::FieldData>,
    grid: Option<v1::GridField>,
}

/// Cuts arrays at particles and grids at nodes into pieces of at most `budget` bytes; at least one.
struct Cutter {
    pieces: Vec<Piece>,
    /// Bytes left in the last piece.
    room: usize,
    budget: usize,
}

impl Cutter {
    fn new(budget: usize) -> Self {
        Self { pieces: vec![Piece::default()], room: budget, budget }
    }

    /// How many of `left` elements go into the piece at hand, which is a new one if there is no room.
    fn take(&mut self, element: usize, left: usize) -> (&mut Piece, usize) {
        if self.room < element && left > 0 {
            self.pieces.push(Piece::default());
            self.room = self.budget;
        }
        let count = (self.room / element).min(left);
        self.room -= count * element;
        (self.pieces.last_mut().expect("there is a piece"), count)
    }

    fn add_array(&mut self, array: Array, mut data: Bytes) {
        let (stride, mut first_particle) = (array.stride(), 0);
        while !data.is_empty() {
            let (piece, count) = self.take(stride, data.len() / stride);
            piece.fields.push(v1::FieldData {
                field: array.field().into(),
                encoding: array.encoding().into(),
                first_particle,
                data: data.split_to(count * stride),
            });
            first_particle += count as u32;
        }
    }

    /// A grid without nodes is said, too.
    fn add_grid(&mut self, mut grid: v1::GridField) {
        loop {
            let (piece, count) = self.take(NODE_BYTES, packed_count(&grid));
            piece.grid = Some(cut(&mut grid, count));
            if packed_count(&grid) == 0 {
                return;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_every_particle_once_and_stay_within_the_budget() {
        let arrays = [Array::PositionsF32, Array::VelocitiesF64, Array::StressNormsF32];
        let strides = [12, 24, 4];
        assert_eq!(arrays.map(Array::stride), strides);
        for particles in [0, 1, 7, 100, 1000] {
            let mut cutter = Cutter::new(1000);
            for array in arrays {
                cutter.add_array(array, Bytes::from(vec![1_u8; particles * array.stride()]));
            }
            let mut covered = [0; 3];
            for piece in &cutter.pieces {
                assert!(piece.fields.iter().map(|f| f.data.len()).sum::<usize>() <= 1000);
                for field in &piece.fields {
                    let i = arrays.iter().position(|a| a.field() == field.field()).expect("one of them");
                    assert_eq!(field.first_particle as usize, covered[i], "pieces follow each other");
                    covered[i] += field.data.len() / strides[i];
                }
            }
            assert_eq!(covered, [particles; 3]);
        }
    }

    #[test]
    fn a_grid_follows_the_arrays_and_goes_on_in_further_pieces() {
        for nodes in [0, 1, 20, 100] {
            let mut cutter = Cutter::new(1000);
            cutter.add_array(Array::PositionsF32, Bytes::from(vec![0; 996]));
            cutter.add_grid(v1::GridField {
                index_i32: Bytes::from(vec![1; 12 * nodes]),
                mass_f32: Bytes::from(vec![2; 4 * nodes]),
                velocity_f32: Bytes::from(vec![3; 12 * nodes]),
                node_count: nodes as u64,
                ..v1::GridField::default()
            });
            // 35 nodes in 1000 bytes; a grid without nodes needs no piece of its own.
            assert_eq!(cutter.pieces.len(), 1 + usize::div_ceil(nodes, 35));
            let grids: Vec<_> = cutter.pieces.iter().filter_map(|piece| piece.grid.as_ref()).collect();
            assert_eq!(grids.iter().map(|grid| packed_count(grid)).sum::<usize>(), nodes);
            assert!(!grids.is_empty() && grids.iter().all(|grid| grid.node_count == nodes as u64));
        }
    }
}

//! A frame encoded once for all its watchers, and cut into messages of at most 1 MiB.
//!
//! Enters: a simulation between two steps. Leaves: little-endian fields in shared memory, in segments; a
//! watcher's messages refer to them without a copy. Nodes of the snow's grid are shared too, and
//! packed for each watcher that wants them. A number that is not finite is never sent.

use std::sync::Arc;

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::{
    collide::Bounds,
    world::{Carried, Simulation},
};
use prost::Message as _;

use super::{
    arrays::{Arrays, Number as _, Segments},
    collider::poses,
    fields::{EncodedField, FieldSet, Wanted},
    grid_frame::{GridFrame, node_bytes, packed_count, take_nodes},
    packing::NotFinite,
    pieces::{BUDGET_BYTES, numbered},
    topology::TOPOLOGY_ID,
};

/// What a piece of memory takes besides its bytes: the allocator's header and rounding, and the counter of
/// whoever shares it.
const ALLOCATION_BYTES: usize = 64;
/// What a segment of an array takes besides its numbers: its allocation and that of its owner.
const ARRAY_BYTES: usize = 2 * ALLOCATION_BYTES + 64;
/// What a message takes within another one besides its own bytes, at most: its key and its length.
const HEAD_BYTES: usize = 8;
/// Arrays of a grid.
const GRID_ALLOCATIONS: usize = 3;

/// What a frame says besides its fields.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct FrameHead {
    /// Frame number, from 0.
    pub frame: u64,
    /// Steps taken before this frame.
    pub step: u64,
    /// Simulated time (s).
    pub time_seconds: f64,
    /// Hash of the exact state, on some frames.
    pub state_hash: Option<u64>,
    /// Diagnostics of the step that made the frame.
    pub diagnostics: v1::Diagnostics,
    /// Where the colliders are that keys or calls move.
    pub poses: Vec<v1::ColliderPose>,
}

impl FrameHead {
    /// The head of a frame of the state as it is, without a hash.
    pub(crate) fn of(simulation: &Simulation, frame: u64, diagnostics: v1::Diagnostics) -> Self {
        // A frame made at a stop is newer than the one that its step reported.
        let diagnostics = v1::Diagnostics { frame, ..diagnostics };
        let (step, time_seconds) = (simulation.step_count(), simulation.time());
        Self { frame, step, time_seconds, state_hash: None, diagnostics, poses: poses(simulation) }
    }
}

/// A frame as all its watchers share it.
#[derive(Clone, Debug)]
pub(crate) struct EncodedFrame {
    pub head: FrameHead,
    fields: [Option<Segments>; EncodedField::COUNT],
    grid: Option<Arc<GridFrame>>,
    /// What a session needs to know that is to begin at it, if it has velocities.
    carried: Option<Arc<v1::Carried>>,
}

impl EncodedFrame {
    /// Encodes what is `wanted` of the state as it is.
    ///
    /// # Errors
    /// The first number that is not finite.
    pub(crate) fn encode(
        simulation: &Simulation,
        wanted: FieldSet,
        head: FrameHead,
        arrays: &Arc<Arrays>,
    ) -> Result<Self, NotFinite> {
        let mut fields = [const { None }; EncodedField::COUNT];
        for field in wanted.fields() {
            fields[field.index()] = Some(field.encode(simulation, arrays)?);
        }

        let forces = wanted.covers(FieldSet::GRID_FORCES).then(|| simulation.grid_forces());
        let grid = if forces.is_some() || wanted.covers(FieldSet::GRID) {
            GridFrame::of(simulation, forces.as_deref(), arrays.memory())?
        } else {
            None
        };
        let carried = wanted.has_velocities().then(|| Arc::new(carried(simulation)));
        Ok(Self { head, fields, grid: grid.map(Arc::new), carried })
    }

    /// A frame of positions alone: three numbers in binary32 for each particle (m), as they are on the wire. Runs on the rayon pool
    /// that the caller installed.
    pub(crate) fn of_positions(head: FrameHead, positions: &[u8], arrays: &Arc<Arrays>) -> Self {
        let numbers = positions.as_chunks::<4>().0;
        let mut array: Vec<f32> = arrays.take(numbers.len() / 3, 3);
        array.clear();
        array.extend(numbers.iter().map(|number| f32::from_le_bytes(*number).to_wire()));
        let mut fields = [const { None }; EncodedField::COUNT];
        fields[EncodedField::POSITIONS_F32.index()] = Some(arrays.share(array, 3));
        Self { head, fields, grid: None, carried: None }
    }

    /// The same frame with a hash.
    pub(crate) fn with_hash(&self, state_hash: u64) -> Self {
        let head = FrameHead { state_hash: Some(state_hash), ..self.head.clone() };
        Self { head, ..self.clone() }
    }

    /// The same frame with what another one of its state holds too.
    pub(crate) fn with_more(&self, more: Self) -> Self {
        let mut frame = self.clone();
        for (field, other) in frame.fields.iter_mut().zip(more.fields) {
            *field = field.take().or(other);
        }
        // One that comes later has what the first one lacks.
        frame.grid = more.grid.or(frame.grid);
        frame.carried = frame.carried.or(more.carried);
        frame
    }

    /// The same frame with nothing but what is `kept` of it.
    pub(super) fn only(&self, kept: FieldSet) -> Self {
        let mut frame = self.clone();
        for dropped in EncodedField::all().filter(|field| !kept.has_part(field.index())) {
            frame.fields[dropped.index()] = None;
        }
        frame.grid = frame.grid.filter(|_| kept.covers(FieldSet::GRID));
        frame.carried = frame.carried.filter(|_| kept.has_velocities());
        frame
    }

    /// What it holds.
    pub(crate) fn fields(&self) -> FieldSet {
        let grid = match self.grid.as_deref().map(GridFrame::has_forces) {
            None => FieldSet::NONE,
            Some(false) => FieldSet::GRID,
            Some(true) => FieldSet::GRID.union(FieldSet::GRID_FORCES),
        };
        EncodedField::all().filter(|field| self.fields[field.index()].is_some()).fold(grid, FieldSet::with)
    }

    /// The least and the greatest coordinates (m) of all particles, in binary32.
    pub(crate) fn bounds(&self) -> Bounds {
        let segments = self.fields[EncodedField::POSITIONS_F32.index()].as_deref().unwrap_or_default();
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        let [low, high] = &mut bounds;
        for place in segments.iter().flat_map(|segment| segment.as_chunks::<12>().0) {
            for (c, number) in place.as_chunks::<4>().0.iter().enumerate() {
                let number = f64::from(f32::from_le_bytes(*number));
                (low[c], high[c]) = (low[c].min(number), high[c].max(number));
            }
        }
        bounds
    }

    fn segments(&self) -> impl Iterator<Item = &Bytes> {
        self.fields.iter().flatten().flat_map(|segments| segments.iter())
    }

    /// Memory of its arrays (bytes).
    pub(crate) fn array_bytes(&self) -> usize {
        let arrays = self.segments().map(Bytes::len);
        arrays.sum::<usize>() + self.grid.as_ref().map_or(0, |grid| grid.size())
    }

    /// Memory that it takes (bytes): arrays, diagnostics, and what keeps them.
    pub(crate) fn size(&self) -> usize {
        let lists = self.fields.iter().flatten().count() * ALLOCATION_BYTES;
        let arrays = self.segments().count() * (ARRAY_BYTES + size_of::<Bytes>()) + lists;
        let grid = self.grid.as_ref().map_or(0, |_| GRID_ALLOCATIONS * ALLOCATION_BYTES);
        let stages = self.head.diagnostics.stages.capacity() * size_of::<v1::StageTime>() + ALLOCATION_BYTES;
        let load =
            |load: &v1::ColliderLoad| size_of::<v1::ColliderLoad>() + load.name.capacity() + ALLOCATION_BYTES;
        let loads: usize = self.head.diagnostics.loads.iter().map(load).sum();
        let poses =
            self.head.poses.iter().map(|pose| size_of_val(pose) + pose.name.len() + 2 * ALLOCATION_BYTES);
        let poses: usize = poses.sum();
        let carried = self.carried.as_deref().map_or(0, carried_size);
        let beside = grid + stages + loads + poses + carried;
        size_of::<Self>() + ALLOCATION_BYTES + self.array_bytes() + arrays + beside
    }

    /// The frame with these fields as one message, however large.
    pub(crate) fn whole(&self, fields: FieldSet) -> v1::Frame {
        let whole = |field: EncodedField| {
            let segments = self.fields[field.index()].as_deref()?;
            let data = match segments {
                [] => return None,
                [one] => one.clone(),
                several => several.concat().into(),
            };
            Some(field_data(field, 0, data))
        };
        let carried = self.carried.as_deref().filter(|_| fields.has_velocities()).cloned();
        let fields = fields.fields().filter_map(whole).collect();
        let diagnostics = Some(self.head.diagnostics.clone());
        v1::Frame { diagnostics, poses: self.head.poses.clone(), carried, ..self.message(fields) }
    }

    /// A message of the frame, without what its first piece alone has.
    fn message(&self, fields: Vec<v1::FieldData>) -> v1::Frame {
        v1::Frame {
            frame: self.head.frame,
            step: self.head.step,
            time_seconds: self.head.time_seconds,
            state_hash: self.head.state_hash,
            topology_id: TOPOLOGY_ID,
            fields,
            ..v1::Frame::default()
        }
    }

    /// The messages of the frame with what is `wanted`, each of at most 1 MiB.
    pub(crate) fn pieces(&self, wanted: &Wanted, dropped_count: u64) -> Vec<v1::Frame> {
        let mut cutter = Cutter::new(BUDGET_BYTES);
        let carried = self.carried.as_deref().filter(|_| wanted.fields.has_velocities());
        let carried_bytes = carried.map_or(0, |carried| HEAD_BYTES + carried.encoded_len());
        cutter.room = cutter.room.saturating_sub(poses_bytes(&self.head.poses) + carried_bytes);
        for field in wanted.fields.fields() {
            if let Some(segments) = &self.fields[field.index()] {
                cutter.add_field(field, segments);
            }
        }

        if let (Some(grid), Some(choice)) = (&self.grid, &wanted.grid) {
            cutter.add_grid(grid.choose(choice));
        }

        let message =
            |(chunk, Piece { fields, grid })| v1::Frame { chunk: Some(chunk), grid, ..self.message(fields) };
        let mut pieces: Vec<_> = numbered(cutter.pieces).map(message).collect();
        if let Some(first) = pieces.first_mut() {
            first.dropped_count = dropped_count;
            first.diagnostics = Some(self.head.diagnostics.clone());
            first.poses.clone_from(&self.head.poses);
            first.carried = carried.cloned();
        }
        pieces
    }
}

/// Bytes that poses take in a message, at most.
fn poses_bytes(poses: &[v1::ColliderPose]) -> usize {
    poses.iter().map(|pose| HEAD_BYTES + pose.encoded_len()).sum()
}

/// What further steps depend on beside positions and velocities, as the message of a frame.
fn carried(simulation: &Simulation) -> v1::Carried {
    let Carried { numbers, missing } = simulation.carried();
    let missing = missing.into_iter().map(|missing| missing.name().to_owned()).collect();
    v1::Carried { numbers, missing }
}

/// Memory that this takes (bytes).
fn carried_size(carried: &v1::Carried) -> usize {
    let names = carried.missing.iter().map(|name| size_of_val(name) + name.capacity() + ALLOCATION_BYTES);
    size_of_val(carried.numbers.as_slice()) + names.sum::<usize>() + 3 * ALLOCATION_BYTES
}

/// What one message carries of fields and grid.
#[derive(Debug, Default)]
struct Piece {
    fields: Vec<v1::FieldData>,
    grid: Option<v1::GridField>,
}

/// Cuts fields at particles and grids at nodes into pieces of at most `budget` bytes; at least one.
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

    /// How many of `left` elements of `element` bytes go into the last piece, which is a new one if
    /// the old one has no room.
    fn take(&mut self, element: usize, left: usize) -> (&mut Piece, usize) {
        if self.room < element && left > 0 {
            self.pieces.push(Piece::default());
            self.room = self.budget;
        }
        let count = (self.room / element).min(left);
        self.room -= count * element;
        (self.pieces.last_mut().expect("there is a piece"), count)
    }

    /// Each message has one segment of a field at most: none refers to two.
    fn add_field(&mut self, field: EncodedField, segments: &[Bytes]) {
        let (stride, mut first_particle) = (field.stride(), 0);
        for segment in segments {
            if first_particle > 0 {
                self.room = 0;
            }
            let mut data = segment.clone();
            while !data.is_empty() {
                let (piece, count) = self.take(stride, data.len() / stride);
                piece.fields.push(field_data(field, first_particle, data.split_to(count * stride)));
                first_particle += count as u32;
            }
        }
    }

    /// An empty grid is sent too: it says that there are no nodes.
    fn add_grid(&mut self, mut grid: v1::GridField) {
        let bytes = node_bytes(&grid);
        loop {
            let (piece, count) = self.take(bytes, packed_count(&grid));
            piece.grid = Some(take_nodes(&mut grid, count));
            if packed_count(&grid) == 0 {
                return;
            }
        }
    }
}

fn field_data(field: EncodedField, first_particle: u32, data: Bytes) -> v1::FieldData {
    v1::FieldData {
        field: field.field().into(),
        encoding: field.encoding().into(),
        first_particle,
        data,
        // Raw encodings pack the numbers themselves.
        scale: None,
        error_bound: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_every_particle_once_and_stay_within_the_budget() {
        let pair = |field, encoding| EncodedField::of(field, encoding).expect("there is one");
        let fields = [
            EncodedField::POSITIONS_F32,
            pair(v1::Field::Velocities, v1::Encoding::RawF64),
            pair(v1::Field::StressNorm, v1::Encoding::RawF32),
        ];
        let strides = [12, 24, 4];
        assert_eq!(fields.map(EncodedField::stride), strides);
        for particles in [0, 1, 7, 100, 1000] {
            let mut cutter = Cutter::new(1000);
            for field in fields {
                let segment = |count| Bytes::from(vec![1_u8; count * field.stride()]);
                cutter.add_field(field, &[segment(particles / 3), segment(particles - particles / 3)]);
            }
            let mut covered = [0; 3];
            for piece in &cutter.pieces {
                assert!(piece.fields.iter().map(|f| f.data.len()).sum::<usize>() <= 1000);
                for field in &piece.fields {
                    let i = fields.iter().position(|f| f.field() == field.field()).expect("one of them");
                    assert_eq!(field.first_particle as usize, covered[i], "pieces follow each other");
                    covered[i] += field.data.len() / strides[i];
                }
            }
            assert_eq!(covered, [particles; 3]);
        }
    }

    #[test]
    fn a_grid_follows_the_fields_and_continues_in_further_pieces() {
        for nodes in [0, 1, 20, 100] {
            let mut cutter = Cutter::new(1000);
            cutter.add_field(EncodedField::POSITIONS_F32, &[Bytes::from(vec![0; 996])]);
            cutter.add_grid(v1::GridField {
                index_i32: Bytes::from(vec![1; 12 * nodes]),
                mass_f32: Bytes::from(vec![2; 4 * nodes]),
                velocity_f32: Bytes::from(vec![3; 12 * nodes]),
                node_count: nodes as u64,
                ..v1::GridField::default()
            });

            // 35 nodes in 1000 bytes; an empty grid needs no piece of its own.
            assert_eq!(cutter.pieces.len(), 1 + usize::div_ceil(nodes, 35));
            let grids: Vec<_> = cutter.pieces.iter().filter_map(|piece| piece.grid.as_ref()).collect();
            assert_eq!(grids.iter().map(|grid| packed_count(grid)).sum::<usize>(), nodes);
            assert!(!grids.is_empty() && grids.iter().all(|grid| grid.node_count == nodes as u64));
        }
    }
}

//! A frame encoded once for all its watchers, and cut into messages of at most 1 MiB.
//!
//! Enters: a simulation between two steps. Leaves: little-endian arrays in shared memory; a
//! watcher's messages refer to them without a copy. What is not finite does not leave.

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::world::Simulation;

use crate::config::PIECE_BYTES;

/// Bytes of a message kept free for everything but arrays.
pub(crate) const MARGIN_BYTES: usize = 4096;

/// An array over the particles, packed in one way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Array {
    /// Positions (m), binary32.
    PositionsF32,
    /// Positions (m), binary64.
    PositionsF64,
    /// Velocities (m/s), binary32.
    VelocitiesF32,
    /// Velocities (m/s), binary64.
    VelocitiesF64,
}

impl Array {
    /// Every array.
    pub(crate) const ALL: [Self; 4] =
        [Self::PositionsF32, Self::PositionsF64, Self::VelocitiesF32, Self::VelocitiesF64];

    /// The array of a field in an encoding.
    pub(crate) fn of(field: v1::Field, encoding: v1::Encoding) -> Option<Self> {
        Self::ALL.into_iter().find(|array| array.field() == field && array.encoding() == encoding)
    }

    const fn field(self) -> v1::Field {
        match self {
            Self::PositionsF32 | Self::PositionsF64 => v1::Field::Positions,
            Self::VelocitiesF32 | Self::VelocitiesF64 => v1::Field::Velocities,
        }
    }

    const fn encoding(self) -> v1::Encoding {
        match self {
            Self::PositionsF32 | Self::VelocitiesF32 => v1::Encoding::RawF32,
            Self::PositionsF64 | Self::VelocitiesF64 => v1::Encoding::RawF64,
        }
    }

    /// Bytes of a particle.
    const fn stride(self) -> usize {
        match self {
            Self::PositionsF32 | Self::VelocitiesF32 => 12,
            Self::PositionsF64 | Self::VelocitiesF64 => 24,
        }
    }
}

/// A set of arrays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct ArraySet(u8);

impl ArraySet {
    /// No array.
    pub(crate) const NONE: Self = Self(0);
    /// What every frame has.
    pub(crate) const ALWAYS: Self = Self::NONE.with(Array::PositionsF32);
    /// Every array.
    pub(crate) const ALL: Self = Self(0b1111);

    /// This set and one more array.
    #[must_use]
    pub(crate) const fn with(self, array: Array) -> Self {
        Self(self.0 | 1 << array as u8)
    }

    /// Both sets together.
    #[must_use]
    pub(crate) const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether it has all arrays of `other`.
    pub(crate) const fn covers(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Its arrays, in the order of their definition.
    pub(crate) fn iter(self) -> impl Iterator<Item = Array> {
        Array::ALL.into_iter().filter(move |array| self.covers(Self::NONE.with(*array)))
    }

    pub(crate) const fn bits(self) -> u8 {
        self.0
    }

    pub(crate) const fn from_bits(bits: u8) -> Self {
        Self(bits & Self::ALL.0)
    }
}

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
    arrays: [Option<Bytes>; 4],
}

/// A number of the state that cannot leave: it is not finite in the encoding asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NotFinite {
    /// The particle.
    pub particle: u64,
    /// The value.
    pub value: f64,
}

impl EncodedFrame {
    /// Encodes the arrays of `wanted` from the state as it is.
    ///
    /// # Errors
    /// The first component that is not finite.
    pub(crate) fn encode(
        simulation: &Simulation,
        wanted: ArraySet,
        head: FrameHead,
    ) -> Result<Self, NotFinite> {
        let mut arrays = [const { None }; 4];
        let (mut narrow, mut wide) = (Vec::new(), Vec::new());
        for array in wanted.iter() {
            arrays[array as usize] = Some(match array {
                Array::PositionsF32 => {
                    simulation.positions_f32(&mut narrow);
                    pack(&narrow, f32::to_le_bytes, f64::from)?
                }
                Array::VelocitiesF32 => {
                    simulation.velocities_f32(&mut narrow);
                    pack(&narrow, f32::to_le_bytes, f64::from)?
                }
                Array::PositionsF64 => {
                    simulation.positions_f64(&mut wide);
                    pack(&wide, f64::to_le_bytes, f64::from)?
                }
                Array::VelocitiesF64 => {
                    simulation.velocities_f64(&mut wide);
                    pack(&wide, f64::to_le_bytes, f64::from)?
                }
            });
        }
        Ok(Self { head, arrays })
    }

    /// The arrays that it has.
    pub(crate) fn arrays(&self) -> ArraySet {
        Array::ALL
            .into_iter()
            .filter(|array| self.arrays[*array as usize].is_some())
            .fold(ArraySet::NONE, ArraySet::with)
    }

    /// Memory of the arrays (bytes).
    pub(crate) fn size(&self) -> usize {
        self.arrays.iter().flatten().map(Bytes::len).sum()
    }

    /// The messages of the frame with the arrays of `wanted`, each of at most 1 MiB.
    pub(crate) fn pieces(&self, wanted: ArraySet, dropped_count: u64) -> Vec<v1::Frame> {
        let mut pieces = split(self.fields(wanted), PIECE_BYTES - MARGIN_BYTES);
        let count = pieces.len() as u32;
        let mut diagnostics = Some(self.head.diagnostics.clone());
        pieces
            .drain(..)
            .enumerate()
            .map(|(index, fields)| v1::Frame {
                frame: self.head.frame,
                step: self.head.step,
                time_seconds: self.head.time,
                state_hash: self.head.state_hash,
                topology_id: TOPOLOGY_ID,
                fields,
                chunk: Some(v1::Chunk { index: index as u32, count }),
                dropped_count: if index == 0 { dropped_count } else { 0 },
                diagnostics: diagnostics.take(),
            })
            .collect()
    }

    fn fields(&self, wanted: ArraySet) -> Vec<(Array, Bytes)> {
        wanted
            .iter()
            .filter_map(|array| self.arrays[array as usize].clone().map(|data| (array, data)))
            .collect()
    }
}

/// A session has one topology, for all its life.
pub(crate) const TOPOLOGY_ID: u32 = 1;

/// Cuts arrays at particles into groups of at most `budget` bytes; at least one group.
fn split(fields: Vec<(Array, Bytes)>, budget: usize) -> Vec<Vec<v1::FieldData>> {
    let mut groups = vec![Vec::new()];
    let mut room = budget;
    for (array, mut data) in fields {
        let mut first_particle = 0;
        while !data.is_empty() {
            if room < array.stride() {
                groups.push(Vec::new());
                room = budget;
            }
            let particles = (room / array.stride()).min(data.len() / array.stride());
            let piece = data.split_to(particles * array.stride());
            room -= piece.len();
            groups.last_mut().expect("there is a group").push(v1::FieldData {
                field: array.field().into(),
                encoding: array.encoding().into(),
                first_particle,
                data: piece,
            });
            first_particle += particles as u32;
        }
    }
    groups
}

/// Packs components into bytes, and finds the first that is not finite.
fn pack<T: Copy, const N: usize>(
    components: &[T],
    to_bytes: impl Fn(T) -> [u8; N],
    widen: impl Fn(T) -> f64,
) -> Result<Bytes, NotFinite> {
    if let Some(i) = components.iter().position(|c| !widen(*c).is_finite()) {
        return Err(NotFinite { particle: (i / 3) as u64, value: widen(components[i]) });
    }
    let mut packed = vec![0; components.len() * N];
    for (bytes, component) in packed.chunks_exact_mut(N).zip(components) {
        bytes.copy_from_slice(&to_bytes(*component));
    }
    Ok(packed.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pieces_cover_every_particle_once_and_stay_within_the_budget() {
        for particles in [0, 1, 7, 100, 1000] {
            let fields: Vec<_> = [Array::PositionsF32, Array::VelocitiesF64]
                .map(|array| (array, Bytes::from(vec![1_u8; particles * array.stride()])))
                .into();
            let groups = split(fields, 1000);
            let mut covered = [0, 0];
            for group in &groups {
                assert!(group.iter().map(|f| f.data.len()).sum::<usize>() <= 1000);
                for field in group {
                    let i = usize::from(field.field() == v1::Field::Velocities);
                    assert_eq!(field.first_particle as usize, covered[i], "pieces follow each other");
                    covered[i] += field.data.len() / [12, 24][i];
                }
            }
            assert_eq!(covered, [particles; 2]);
        }
    }

    #[test]
    fn arrays_are_little_endian_and_what_is_not_finite_is_named() {
        let packed = pack(&[1.0_f32, -0.0, 2.5], f32::to_le_bytes, f64::from).expect("finite");
        assert_eq!(packed[..4], [0, 0, 0x80, 0x3f]);
        assert_eq!(packed[4..8], [0, 0, 0, 0x80]);
        let broken = pack(&[0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0], f64::to_le_bytes, f64::from);
        assert_eq!(broken.expect_err("not finite").particle, 1);
    }

    #[test]
    fn sets_of_arrays_know_their_members() {
        let set = ArraySet::ALWAYS.with(Array::VelocitiesF64);
        assert!(ArraySet::ALL.covers(set) && !set.covers(ArraySet::ALL));
        assert_eq!(set.iter().collect::<Vec<_>>(), [Array::PositionsF32, Array::VelocitiesF64]);
        assert_eq!(ArraySet::from_bits(set.bits()), set);
        assert_eq!(Array::of(v1::Field::Velocities, v1::Encoding::RawF32), Some(Array::VelocitiesF32));
        assert_eq!(Array::of(v1::Field::Unspecified, v1::Encoding::RawF32), None);
    }
}

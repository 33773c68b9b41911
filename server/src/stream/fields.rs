//! What a frame can hold, and what a watcher wants of it: arrays over the particles, the grid's nodes.
//!
//! Enters: a field and an encoding of a request. Leaves: an array that knows how to read itself
//! off a simulation, and sets of them.

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::world::Simulation;

use super::{
    grid_frame::GridChoice,
    packing::{NotFinite, pack},
};

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
    /// Plastic volume ratios, binary32.
    PlasticRatiosF32,
    /// Plastic volume ratios, binary64.
    PlasticRatiosF64,
    /// Norms of the Cauchy stress (Pa), binary32.
    StressNormsF32,
    /// Norms of the Cauchy stress (Pa), binary64.
    StressNormsF64,
}

impl Array {
    /// Every array.
    pub(crate) const ALL: [Self; 8] = [
        Self::PositionsF32,
        Self::PositionsF64,
        Self::VelocitiesF32,
        Self::VelocitiesF64,
        Self::PlasticRatiosF32,
        Self::PlasticRatiosF64,
        Self::StressNormsF32,
        Self::StressNormsF64,
    ];

    /// The array of a field in an encoding.
    pub(crate) fn of(field: v1::Field, encoding: v1::Encoding) -> Option<Self> {
        Self::ALL.into_iter().find(|array| array.field() == field && array.encoding() == encoding)
    }

    /// Its field.
    pub(crate) const fn field(self) -> v1::Field {
        match self {
            Self::PositionsF32 | Self::PositionsF64 => v1::Field::Positions,
            Self::VelocitiesF32 | Self::VelocitiesF64 => v1::Field::Velocities,
            Self::PlasticRatiosF32 | Self::PlasticRatiosF64 => v1::Field::PlasticRatio,
            Self::StressNormsF32 | Self::StressNormsF64 => v1::Field::StressNorm,
        }
    }

    /// Its encoding.
    pub(crate) const fn encoding(self) -> v1::Encoding {
        match self {
            Self::PositionsF32 | Self::VelocitiesF32 | Self::PlasticRatiosF32 | Self::StressNormsF32 => {
                v1::Encoding::RawF32
            }
            Self::PositionsF64 | Self::VelocitiesF64 | Self::PlasticRatiosF64 | Self::StressNormsF64 => {
                v1::Encoding::RawF64
            }
        }
    }

    /// Numbers of a particle.
    const fn width(self) -> usize {
        match self.field() {
            v1::Field::PlasticRatio | v1::Field::StressNorm => 1,
            _ => 3,
        }
    }

    /// Bytes of a particle.
    pub(crate) const fn stride(self) -> usize {
        match self.encoding() {
            v1::Encoding::RawF64 => 8 * self.width(),
            _ => 4 * self.width(),
        }
    }

    /// What its numbers are, for messages.
    const fn quantity(self) -> &'static str {
        match self.field() {
            v1::Field::Velocities => "velocity",
            v1::Field::PlasticRatio => "plastic ratio",
            v1::Field::StressNorm => "stress norm",
            _ => "position",
        }
    }

    /// Encodes the array from the state as it is.
    ///
    /// # Errors
    /// The first number that is not finite.
    pub(crate) fn encode(self, simulation: &Simulation) -> Result<Bytes, NotFinite> {
        let (mut narrow, mut wide) = (Vec::new(), Vec::new());
        match self {
            Self::PositionsF32 => simulation.positions_f32(&mut narrow),
            Self::VelocitiesF32 => simulation.velocities_f32(&mut narrow),
            Self::PlasticRatiosF32 => simulation.plastic_ratios_f32(&mut narrow),
            Self::StressNormsF32 => simulation.stress_norms_f32(&mut narrow),
            Self::PositionsF64 => simulation.positions_f64(&mut wide),
            Self::VelocitiesF64 => simulation.velocities_f64(&mut wide),
            Self::PlasticRatiosF64 => simulation.plastic_ratios_f64(&mut wide),
            Self::StressNormsF64 => simulation.stress_norms_f64(&mut wide),
        }
        match self.encoding() {
            v1::Encoding::RawF64 => pack(&wide, self.width(), self.quantity()),
            _ => pack(&narrow, self.width(), self.quantity()),
        }
    }
}

/// What a frame holds: a set of arrays, and maybe the grid's nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Contents(u16);

impl Contents {
    /// No array.
    pub(crate) const NONE: Self = Self(0);
    /// What every frame has.
    pub(crate) const ALWAYS: Self = Self::NONE.with(Array::PositionsF32);
    /// The grid's nodes.
    pub(crate) const GRID: Self = Self(1 << Array::ALL.len());
    /// Every array, and the grid's nodes.
    pub(crate) const ALL: Self = Self((1 << (Array::ALL.len() + 1)) - 1);

    /// This set and one more array.
    #[must_use]
    pub(crate) const fn with(self, array: Array) -> Self {
        Self(self.0 | 1 << array as u16)
    }

    /// Both sets together.
    #[must_use]
    pub(crate) const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether it has all of `other`.
    pub(crate) const fn covers(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Its arrays, in the order of their definition.
    pub(crate) fn arrays(self) -> impl Iterator<Item = Array> {
        Array::ALL.into_iter().filter(move |array| self.covers(Self::NONE.with(*array)))
    }

    pub(crate) const fn bits(self) -> u16 {
        self.0
    }

    pub(crate) const fn from_bits(bits: u16) -> Self {
        Self(bits & Self::ALL.0)
    }
}

/// What one watcher gets of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wanted {
    /// Arrays.
    pub arrays: Contents,
    /// Nodes of the snow's grid, if any.
    pub grid: Option<GridChoice>,
}

impl Wanted {
    /// What a frame must hold for it.
    pub(crate) fn contents(&self) -> Contents {
        if self.grid.is_some() { self.arrays.union(Contents::GRID) } else { self.arrays }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sets_of_contents_know_their_members() {
        let set = Contents::ALWAYS.with(Array::VelocitiesF64);
        assert!(Contents::ALL.covers(set) && !set.covers(Contents::ALL));
        assert_eq!(set.arrays().collect::<Vec<_>>(), [Array::PositionsF32, Array::VelocitiesF64]);
        assert_eq!(Contents::from_bits(set.bits()), set);
        assert!(Contents::ALL.covers(Contents::GRID) && !set.covers(Contents::GRID));
        assert_eq!(set.union(Contents::GRID).arrays().count(), 2, "the grid is no array");
        assert_eq!(Contents::ALL.arrays().count(), Array::ALL.len());
    }

    #[test]
    fn every_array_has_its_own_field_and_encoding() {
        for array in Array::ALL {
            assert_eq!(Array::of(array.field(), array.encoding()), Some(array));
        }
        assert_eq!(Array::of(v1::Field::StressNorm, v1::Encoding::RawF32), Some(Array::StressNormsF32));
        assert_eq!(Array::of(v1::Field::Unspecified, v1::Encoding::RawF32), None);
    }
}

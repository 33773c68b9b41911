//! What a frame can hold, and what a watcher wants of it: fields of the particles, the grid's nodes.
//!
//! Enters: a field and an encoding of a request. Leaves: an encoded field that knows how to read
//! itself off a simulation, and sets of them.

use bytes::Bytes;
use nappe_proto::v1;
use nappe_sim::world::Simulation;

use super::{
    grid_frame::GridChoice,
    packing::{NotFinite, pack},
};

/// A field of the particles in one encoding.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum EncodedField {
    /// (m)
    PositionsF32,
    /// (m)
    PositionsF64,
    /// (m/s)
    VelocitiesF32,
    /// (m/s)
    VelocitiesF64,
    /// Plastic volume ratios J_P.
    PlasticRatiosF32,
    /// Plastic volume ratios J_P.
    PlasticRatiosF64,
    /// Frobenius norms of the Cauchy stress (Pa).
    StressNormsF32,
    /// Frobenius norms of the Cauchy stress (Pa).
    StressNormsF64,
}

impl EncodedField {
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

    /// A field in an encoding; none if a request names one that does not exist.
    pub(crate) fn of(field: v1::Field, encoding: v1::Encoding) -> Option<Self> {
        Self::ALL.into_iter().find(|encoded| encoded.field() == field && encoded.encoding() == encoding)
    }

    pub(crate) const fn field(self) -> v1::Field {
        match self {
            Self::PositionsF32 | Self::PositionsF64 => v1::Field::Positions,
            Self::VelocitiesF32 | Self::VelocitiesF64 => v1::Field::Velocities,
            Self::PlasticRatiosF32 | Self::PlasticRatiosF64 => v1::Field::PlasticRatio,
            Self::StressNormsF32 | Self::StressNormsF64 => v1::Field::StressNorm,
        }
    }

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

    /// Numbers per particle.
    const fn width(self) -> usize {
        match self.field() {
            v1::Field::PlasticRatio | v1::Field::StressNorm => 1,
            _ => 3,
        }
    }

    /// Bytes per particle.
    pub(crate) const fn stride(self) -> usize {
        match self.encoding() {
            v1::Encoding::RawF64 => 8 * self.width(),
            _ => 4 * self.width(),
        }
    }

    /// What one of its numbers is called in messages.
    const fn quantity(self) -> &'static str {
        match self.field() {
            v1::Field::Velocities => "velocity",
            v1::Field::PlasticRatio => "plastic ratio",
            v1::Field::StressNorm => "stress norm",
            _ => "position",
        }
    }

    /// Encodes the field from the state as it is.
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

/// What a frame holds: a set of encoded fields, and perhaps the grid's nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FieldSet(u16);

impl FieldSet {
    pub(crate) const NONE: Self = Self(0);
    /// What every frame has.
    pub(crate) const ALWAYS: Self = Self::NONE.with(EncodedField::PositionsF32);
    /// The grid's nodes.
    pub(crate) const GRID: Self = Self(1 << EncodedField::ALL.len());
    /// Every field in every encoding, and the grid's nodes.
    pub(crate) const ALL: Self = Self((1 << (EncodedField::ALL.len() + 1)) - 1);

    /// Parts that a frame may have: the encoded fields, and the grid's nodes.
    pub(crate) const PARTS: usize = EncodedField::ALL.len() + 1;

    /// Part `part` alone.
    pub(crate) const fn of_part(part: usize) -> Self {
        Self(1 << part & Self::ALL.0)
    }

    /// Whether it has part `part`, in the order of the fields' definition, the grid last.
    pub(crate) const fn has_part(self, part: usize) -> bool {
        self.0 >> part & 1 == 1
    }

    /// This set and one more field.
    #[must_use]
    pub(crate) const fn with(self, field: EncodedField) -> Self {
        Self(self.0 | 1 << field as u16)
    }

    #[must_use]
    pub(crate) const fn union(self, other: Self) -> Self {
        Self(self.0 | other.0)
    }

    /// Whether it has all of `other`.
    pub(crate) const fn covers(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// Its fields, in the order of their definition; the grid is none of them.
    pub(crate) fn fields(self) -> impl Iterator<Item = EncodedField> {
        EncodedField::ALL.into_iter().filter(move |field| self.covers(Self::NONE.with(*field)))
    }
}

/// What one watcher gets of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Wanted {
    pub fields: FieldSet,
    /// Nodes of the snow's grid, if any.
    pub grid: Option<GridChoice>,
}

impl Wanted {
    /// What a frame must hold for this watcher.
    pub(crate) fn needed(&self) -> FieldSet {
        if self.grid.is_some() { self.fields.union(FieldSet::GRID) } else { self.fields }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_set_of_fields_knows_its_members() {
        let set = FieldSet::ALWAYS.with(EncodedField::VelocitiesF64);
        assert!(FieldSet::ALL.covers(set) && !set.covers(FieldSet::ALL));
        let members = [EncodedField::PositionsF32, EncodedField::VelocitiesF64];
        assert_eq!(set.fields().collect::<Vec<_>>(), members);
        let parts = (0..FieldSet::PARTS).filter(|part| set.has_part(*part));
        assert_eq!(parts.fold(FieldSet::NONE, |all, part| all.union(FieldSet::of_part(part))), set);
        assert!(FieldSet::ALL.covers(FieldSet::GRID) && !set.covers(FieldSet::GRID));
        assert_eq!(set.union(FieldSet::GRID).fields().count(), 2, "the grid is no field");
        assert_eq!(FieldSet::ALL.fields().count(), EncodedField::ALL.len());
    }

    #[test]
    fn every_encoded_field_has_its_own_field_and_encoding() {
        for encoded in EncodedField::ALL {
            assert_eq!(EncodedField::of(encoded.field(), encoded.encoding()), Some(encoded));
        }
        let stress = EncodedField::of(v1::Field::StressNorm, v1::Encoding::RawF32);
        assert_eq!(stress, Some(EncodedField::StressNormsF32));
        assert_eq!(EncodedField::of(v1::Field::Unspecified, v1::Encoding::RawF32), None);
    }
}

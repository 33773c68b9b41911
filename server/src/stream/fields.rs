//! What a frame can hold, and what a watcher wants of it: fields of the particles, the grid's nodes.
//!
//! Enters: a field and an encoding of a request. Leaves: their pair, which knows how to read itself off a
//! simulation, and sets of such pairs.

use std::sync::Arc;

use nappe_proto::v1;
use nappe_sim::{field::Field, world::Simulation};

use super::{
    arrays::{Arrays, Number, Segments},
    grid_frame::GridChoice,
    packing::{NotFinite, pack},
};

/// A field of the particles in one encoding: a pair of which every combination exists.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct EncodedField {
    field: Field,
    encoding: v1::Encoding,
}

/// Every encoding that a field can have.
const ENCODINGS: [v1::Encoding; 2] = [v1::Encoding::RawF32, v1::Encoding::RawF64];

impl EncodedField {
    /// How many there are.
    pub(crate) const COUNT: usize = Field::ALL.len() * ENCODINGS.len();

    /// Positions in binary32 (m), which every frame has.
    pub(crate) const POSITIONS_F32: Self = Self { field: Field::Positions, encoding: v1::Encoding::RawF32 };

    /// All pairs, field by field; each stands at its index.
    pub(crate) fn all() -> impl Iterator<Item = Self> {
        Field::ALL.into_iter().flat_map(|field| ENCODINGS.map(|encoding| Self { field, encoding }))
    }

    /// A field in an encoding; none if a request names one that does not exist.
    pub(crate) fn of(field: v1::Field, encoding: v1::Encoding) -> Option<Self> {
        Self::all().find(|encoded| encoded.field() == field && encoded.encoding == encoding)
    }

    /// Its place among all pairs.
    pub(crate) const fn index(self) -> usize {
        // The numbers of encodings start at 1 and have no gap, which a test checks.
        self.field as usize * ENCODINGS.len() + self.encoding as usize - 1
    }

    /// The field as the contract names it.
    pub(crate) const fn field(self) -> v1::Field {
        match self.field {
            Field::Positions => v1::Field::Positions,
            Field::Velocities => v1::Field::Velocities,
            Field::PlasticRatios => v1::Field::PlasticRatio,
            Field::StressNorms => v1::Field::StressNorm,
            Field::Forces => v1::Field::Forces,
            Field::Accelerations => v1::Field::Accelerations,
        }
    }

    pub(crate) const fn encoding(self) -> v1::Encoding {
        self.encoding
    }

    /// Bytes per particle.
    pub(crate) const fn stride(self) -> usize {
        match self.encoding {
            v1::Encoding::RawF64 => 8 * self.field.width(),
            _ => 4 * self.field.width(),
        }
    }

    /// What one of its numbers is called in messages.
    const fn quantity(self) -> &'static str {
        match self.field {
            Field::Positions => "position",
            Field::Velocities => "velocity",
            Field::PlasticRatios => "plastic ratio",
            Field::StressNorms => "stress norm",
            Field::Forces => "force",
            Field::Accelerations => "acceleration",
        }
    }

    /// Copies the field from the state as it is, by all threads of the caller's pool.
    ///
    /// # Errors
    /// The first number that is not finite.
    pub(crate) fn encode(self, simulation: &Simulation, arrays: &Arc<Arrays>) -> Result<Segments, NotFinite> {
        match self.encoding {
            v1::Encoding::RawF64 => self.encode_in::<f64>(simulation, arrays),
            _ => self.encode_in::<f32>(simulation, arrays),
        }
    }

    fn encode_in<T: Number>(
        self,
        simulation: &Simulation,
        arrays: &Arc<Arrays>,
    ) -> Result<Segments, NotFinite> {
        let (particles, width) = (simulation.particle_count(), self.field.width());
        let mut numbers: Vec<T> = arrays.take(particles, width);
        numbers.resize(particles * width, T::default());
        simulation.read(self.field, &mut numbers);
        pack(&mut numbers, width, self.quantity())?;
        Ok(arrays.share(numbers, width))
    }
}

/// What a frame holds: a set of encoded fields, and perhaps the grid's nodes and the forces on them, one flag for each part.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct FieldSet([bool; Self::PARTS]);

impl FieldSet {
    /// Parts that a frame may have: the encoded fields in their order, the grid's nodes, and the forces on them.
    pub(crate) const PARTS: usize = EncodedField::COUNT + 2;

    pub(crate) const NONE: Self = Self([false; Self::PARTS]);
    /// What every frame has.
    pub(crate) const ALWAYS: Self = Self::of_part(EncodedField::POSITIONS_F32.index());
    /// Every field of the state in every encoding: without what is evaluated, and without the grid's nodes.
    pub(crate) const OF_STATE: Self = {
        let mut set = Self::NONE;
        let mut part = 0;
        while part < EncodedField::COUNT {
            set.0[part] = !Field::ALL[part / ENCODINGS.len()].is_evaluated();
            part += 1;
        }
        set
    };
    /// The grid's nodes.
    pub(crate) const GRID: Self = Self::of_part(EncodedField::COUNT);
    /// The forces on the grid's nodes.
    pub(crate) const GRID_FORCES: Self = Self::of_part(EncodedField::COUNT + 1);
    /// Every field in every encoding, and the grid's nodes with their forces.
    #[cfg(test)]
    const ALL: Self = Self([true; Self::PARTS]);

    /// Part `part` alone.
    pub(crate) const fn of_part(part: usize) -> Self {
        let mut set = Self::NONE;
        set.0[part] = true;
        set
    }

    /// Whether it has part `part`.
    pub(crate) const fn has_part(self, part: usize) -> bool {
        self.0[part]
    }

    /// This set and one more field.
    #[must_use]
    pub(crate) fn with(self, field: EncodedField) -> Self {
        self.union(Self::of_part(field.index()))
    }

    #[must_use]
    pub(crate) fn union(self, other: Self) -> Self {
        Self(std::array::from_fn(|part| self.0[part] || other.0[part]))
    }

    /// Whether it has all of `other`.
    pub(crate) fn covers(self, other: Self) -> bool {
        self.union(other) == self
    }

    /// What it has beyond `other`.
    #[must_use]
    pub(crate) fn without(self, other: Self) -> Self {
        Self(std::array::from_fn(|part| self.0[part] && !other.0[part]))
    }

    /// Bytes of its fields for each particle.
    pub(crate) fn stride(self) -> usize {
        self.fields().map(EncodedField::stride).sum()
    }

    /// Whether velocities are among its fields.
    pub(crate) fn has_velocities(self) -> bool {
        self.fields().any(|encoded| encoded.field == Field::Velocities)
    }

    /// Its fields, in their order; the grid is none of them.
    pub(crate) fn fields(self) -> impl Iterator<Item = EncodedField> {
        EncodedField::all().filter(move |field| self.has_part(field.index()))
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
        self.fields.union(match self.grid {
            None => FieldSet::NONE,
            Some(GridChoice { has_forces: false, .. }) => FieldSet::GRID,
            Some(GridChoice { has_forces: true, .. }) => FieldSet::GRID.union(FieldSet::GRID_FORCES),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const VELOCITIES_F64: EncodedField =
        EncodedField { field: Field::Velocities, encoding: v1::Encoding::RawF64 };

    #[test]
    fn a_set_of_fields_knows_its_members() {
        let set = FieldSet::ALWAYS.with(VELOCITIES_F64);
        assert!(FieldSet::ALL.covers(set) && !set.covers(FieldSet::ALL));
        assert_eq!(set.fields().collect::<Vec<_>>(), [EncodedField::POSITIONS_F32, VELOCITIES_F64]);
        let parts = (0..FieldSet::PARTS).filter(|part| set.has_part(*part));
        assert_eq!(parts.fold(FieldSet::NONE, |all, part| all.union(FieldSet::of_part(part))), set);
        assert!(FieldSet::ALL.covers(FieldSet::GRID) && !set.covers(FieldSet::GRID));
        assert_eq!(set.union(FieldSet::GRID).fields().count(), 2, "the grid is no field");
        assert_eq!(FieldSet::ALL.fields().count(), EncodedField::COUNT);
        let beside = FieldSet::ALL.without(FieldSet::OF_STATE);
        assert!(beside.covers(FieldSet::GRID) && beside.fields().all(|encoded| encoded.field.is_evaluated()));
        assert!(!FieldSet::OF_STATE.fields().any(|encoded| encoded.field.is_evaluated()));
        assert_eq!((set.stride(), FieldSet::OF_STATE.stride(), beside.stride()), (36, 96, 72));
        assert!(set.has_velocities() && !FieldSet::ALWAYS.has_velocities());
    }

    #[test]
    fn every_pair_of_the_contract_is_at_its_index() {
        for (index, encoded) in EncodedField::all().enumerate() {
            assert_eq!(encoded.index(), index);
            assert_eq!(EncodedField::of(encoded.field(), encoded.encoding()), Some(encoded));
        }
        assert_eq!(EncodedField::all().count(), EncodedField::COUNT);
        assert_eq!(EncodedField::of(v1::Field::Unspecified, v1::Encoding::RawF32), None);
        assert_eq!(EncodedField::of(v1::Field::Positions, v1::Encoding::Unspecified), None);

        // A field or an encoding that is added to the contract is added here.
        let number = |field| i32::from(EncodedField { field, ..EncodedField::POSITIONS_F32 }.field());
        let is_field = |number: &i32| v1::Field::try_from(*number).is_ok();
        assert_eq!((1..64).filter(is_field).collect::<Vec<_>>(), Field::ALL.map(number));
        let is_encoding = |number: &i32| v1::Encoding::try_from(*number).is_ok();
        assert_eq!((1..64).filter(is_encoding).collect::<Vec<_>>(), ENCODINGS.map(i32::from));
    }
}

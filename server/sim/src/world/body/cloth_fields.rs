//! Fields of a cloth: read in the user's numbering, or evaluated for that; taken as bytes, and put into a copy of the cloth.

use std::ops::Range;

use super::cloth::Cloth;
use crate::{
    cloth,
    field::Field,
    math::{Bytes as _, LANES, Padded, Real, Sixteen, Vec3},
    parallel::{Own, per_row, several_per_block_mut},
    surroundings::Surroundings,
};

/// Particles that a thread copies at a time.
const BLOCK_SIZE: usize = 4096;

impl<R: Real> Cloth<R> {
    /// Writes what its bodies have of a field over that of all bodies.
    pub(crate) fn read<T: Real>(&self, field: Field, around: &Surroundings<'_>, out: &mut [T]) {
        let rows = self.evaluated(field, around);
        for part in self.parts.iter() {
            let [first, count] = [part.first_particle as usize, part.count()].map(|n| field.width() * n);
            let out = &mut out[first..first + count];
            match field {
                Field::Positions => self.read_vectors(&part.own, out, |place| self.state.x[place].vector()),
                Field::Velocities => self.read_vectors(&part.own, out, |place| self.state.v[place].vector()),
                Field::PlasticRatios => out.fill(T::one()),
                Field::StressNorms => out.fill(T::zero()),
                Field::Forces | Field::Accelerations => {
                    self.read_vectors(&part.own, out, |place| rows[place / LANES].get(place % LANES));
                }
            }
        }
    }

    /// A field that is evaluated at the state as it is, in what surrounds the step that comes next, in the model's order; nothing
    /// of one that is a part of the state.
    fn evaluated(&self, field: Field, around: &Surroundings<'_>) -> Vec<Sixteen<R>> {
        if !field.is_evaluated() {
            return Vec::new();
        }
        let Self { model, parameters, settings, state, acting, .. } = self;
        let mut pulls = self.pulls.clone();
        pulls.renew(model, state);
        let given = acting.now(around.time, around.dt).chain(pulls.now());
        cloth::evaluated(field, model, parameters, settings, around, state, given)
    }

    /// Writes a vector of each particle, which `of` gives by its place in the model.
    fn read_vectors<T: Real>(&self, own: &Range<u32>, out: &mut [T], of: impl Fn(usize) -> Vec3<R> + Sync) {
        let number = |value: R| T::of(value.to_f64());
        let place = &self.model.place[own.start as usize..own.end as usize];
        let fields = (several_per_block_mut(out, 3 * BLOCK_SIZE), per_row(place));
        Own::whole(place.len(), BLOCK_SIZE).each(fields, |_, (out, places)| {
            for (out, &place) in out.as_chunks_mut().0.iter_mut().zip(places) {
                let v = of(place as usize);
                *out = [number(v.x), number(v.y), number(v.z)];
            }
        });
    }

    /// Bytes of a field, of all particles on rank 0 of several; none of one that is the same in every state, or evaluated from it.
    pub(crate) fn take_field(&self, field: Field) -> Vec<u8> {
        match field {
            Field::Positions => self.model.share.all_bytes(&self.state.x),
            Field::Velocities => self.model.share.all_bytes(&self.state.v),
            Field::PlasticRatios | Field::StressNorms | Field::Forces | Field::Accelerations => Vec::new(),
        }
    }

    /// Takes over a field from its bytes.
    ///
    /// # Panics
    /// If it is that of another cloth.
    pub(crate) fn put_field(&mut self, field: Field, taken: &[u8]) {
        let vectors = match field {
            Field::Positions => &mut self.state.x,
            Field::Velocities => &mut self.state.v,
            Field::PlasticRatios | Field::StressNorms | Field::Forces | Field::Accelerations => return,
        };
        assert_eq!(taken.len(), vectors.len() * Padded::<R>::BYTES, "a field of the same cloth");
        for (vector, bytes) in vectors.iter_mut().zip(taken.chunks_exact(Padded::<R>::BYTES)) {
            *vector = Padded::read(bytes);
        }
    }
}

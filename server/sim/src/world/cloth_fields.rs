//! Fields of a cloth: read in the user's numbering; taken as bytes, and put into a copy of the cloth.

use std::ops::Range;

use super::cloth::Cloth;
use crate::{
    field::Field,
    math::{Bytes as _, Padded, Real},
    parallel::{Own, per_row, several_per_block_mut},
};

/// Particles that a thread copies at a time.
const BLOCK_SIZE: usize = 4096;

impl<R: Real> Cloth<R> {
    /// Writes what its bodies have of a field over that of all bodies.
    pub(super) fn read<T: Real>(&self, field: Field, out: &mut [T]) {
        for part in self.parts.iter() {
            let [first, count] = [part.first_particle as usize, part.count()].map(|n| field.width() * n);
            let out = &mut out[first..first + count];
            match field {
                Field::Positions => self.read_vectors(&self.state.x, &part.own, out),
                Field::Velocities => self.read_vectors(&self.state.v, &part.own, out),
                Field::PlasticRatios => out.fill(T::one()),
                Field::StressNorms => out.fill(T::zero()),
            }
        }
    }

    fn read_vectors<T: Real>(&self, vectors: &[Padded<R>], own: &Range<u32>, out: &mut [T]) {
        let number = |value: R| T::of(value.to_f64());
        let place = &self.model.place[own.start as usize..own.end as usize];
        let fields = (several_per_block_mut(out, 3 * BLOCK_SIZE), per_row(place));
        Own::whole(place.len(), BLOCK_SIZE).each(fields, |_, (out, places)| {
            for (out, &place) in out.as_chunks_mut().0.iter_mut().zip(places) {
                let v = vectors[place as usize].vector();
                *out = [number(v.x), number(v.y), number(v.z)];
            }
        });
    }

    /// Bytes of a field, of all particles on rank 0 of several; none of one that is the same in every state.
    pub(super) fn take_field(&self, field: Field) -> Vec<u8> {
        match field {
            Field::Positions => self.model.share.all_bytes(&self.state.x),
            Field::Velocities => self.model.share.all_bytes(&self.state.v),
            Field::PlasticRatios | Field::StressNorms => Vec::new(),
        }
    }

    /// Takes over a field from its bytes.
    ///
    /// # Panics
    /// If it is that of another cloth.
    pub(super) fn put_field(&mut self, field: Field, taken: &[u8]) {
        let vectors = match field {
            Field::Positions => &mut self.state.x,
            Field::Velocities => &mut self.state.v,
            Field::PlasticRatios | Field::StressNorms => return,
        };
        assert_eq!(taken.len(), vectors.len() * Padded::<R>::BYTES, "a field of the same cloth");
        for (vector, bytes) in vectors.iter_mut().zip(taken.chunks_exact(Padded::<R>::BYTES)) {
            *vector = Padded::read(bytes);
        }
    }
}

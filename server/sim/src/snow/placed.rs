//! What calls do to snow: forces on particles, other positions and velocities.

use super::{body::Snow, book::Book, init::settle, step::sort_anew};
use crate::{held_length::HeldLength, math::Real};

/// Position (m) and velocity (m/s) of a particle.
pub(crate) type Place<R> = [[R; 3]; 2];

impl<R: Real> Snow<R> {
    /// Positions and velocities, in the user's numbering.
    pub(crate) fn places(&self) -> Vec<Place<R>> {
        let particles = &self.state.particles;
        let mut places = vec![[[R::zero(); 3]; 2]; particles.len()];
        for (at, id) in particles.id.iter().enumerate() {
            places[*id as usize] = [particles.x(at), particles.v(at)];
        }
        places
    }

    /// Puts the particles from `first` on, in the user's numbering, at these places, each with C (1/s) by rows and without
    /// deformation. The length of certified steps and the book of energy begin anew.
    pub(crate) fn put_at(
        &mut self,
        first: usize,
        places: &[Place<R>],
        affine: &dyn Fn(usize) -> [[f64; 3]; 3],
    ) {
        let Self { model, state, work } = self;
        (state.hold, state.book) = (HeldLength::default(), Book::default());
        let own = first..first + places.len();
        let particles = &mut state.particles;
        let mut others = Vec::new();
        for at in 0..particles.len() {
            let id = particles.id[at] as usize;
            if !own.contains(&id) {
                others.push((id, particles.v0_tau(at)));
                continue;
            }
            particles.set_motion(at, places[id - first], R::one());
            let unit =
                std::array::from_fn(|r| std::array::from_fn(|c| if r == c { R::one() } else { R::zero() }));
            particles.set_tensors(at, unit, affine(id).map(|row| row.map(R::of)), [R::zero(); 6]);
        }

        work.grid.written_blocks.clear();
        sort_anew(model, &state.particles, work);
        settle(model, state, work);
        // Stresses of others as they were.
        others.sort_unstable_by_key(|(id, _)| *id);
        let particles = &mut state.particles;
        for at in 0..particles.len() {
            let id = particles.id[at] as usize;
            if let Ok(other) = others.binary_search_by_key(&id, |(id, _)| *id) {
                let (f, c) = (particles.f_e(at), particles.c(at));
                particles.set_tensors(at, f, c, others[other].1);
            }
        }
    }

    /// Sets forces on particles (N), in the user's numbering of the snow.
    pub(crate) fn set_forces(&mut self, forces: impl Iterator<Item = (usize, [f64; 3])>) {
        let of = &mut self.work.forces;
        of.resize(self.state.particles.len(), [0.0; 3]);
        forces.for_each(|(particle, force)| of[particle] = force);
        if of.iter().all(|force| *force == [0.0; 3]) {
            *of = Vec::new();
        }
    }

    /// Forces on particles (N), in the user's numbering; none where all are 0.
    pub(crate) fn forces(&self) -> &[[f64; 3]] {
        &self.work.forces
    }
}

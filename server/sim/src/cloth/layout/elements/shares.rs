//! What each particle has of its elements: energy, and what bounds an explicit step.

use super::Packs;
use crate::{
    cloth::laws::ElementLaw,
    math::{Pack, Padded, Portable, Real, three},
};

impl<R: Real, const N: usize, const C: usize> Packs<R, N, C> {
    /// Adds to each of its particles an equal part of its energy (J), at positions `x` (m) with this stiffness.
    pub(super) fn add_energies<L: ElementLaw<N, C, F>, const F: usize>(
        &self,
        x: &[Padded<R>],
        stiffness: f64,
        energies: &mut [f64],
    ) {
        for (block, energies) in energies.chunks_mut(self.lists.block_size).enumerate() {
            for pack in self.lists.packs(block) {
                let rest = std::array::from_fn(|c| Portable::load(&self.rest[pack][c]));
                let at = std::array::from_fn(|corner| {
                    let of_lane = self.lists.particles[pack][corner]
                        .map(|name| x[self.lists.halos.particle(block, pack, name) as usize].vector());
                    three!(|c| Portable::load(&of_lane.map(|x| x[c])))
                });
                let energy = L::evaluate(rest, at).energy.store();
                for corner in 0..N {
                    for (name, energy) in self.lists.names(pack, corner).iter().zip(energy) {
                        if let Some(sum) = energies.get_mut(usize::from(*name)) {
                            *sum += stiffness * energy / N as f64;
                        }
                    }
                }
            }
        }
    }

    /// Adds to each of its particles what it adds to the bound of an explicit step.
    pub(super) fn add_shares<L: ElementLaw<N, C, F>, const F: usize>(&self, shares: &mut [f64]) {
        for (block, shares) in shares.chunks_mut(self.lists.block_size).enumerate() {
            for pack in self.lists.packs(block) {
                for lane in 0..usize::from(self.lists.used[pack]) {
                    let rest = std::array::from_fn(|c| self.rest[pack][c][lane].to_f64());
                    for (corner, share) in L::shares(rest).into_iter().enumerate() {
                        let name = usize::from(self.lists.particles[pack][corner][lane]);
                        shares.get_mut(name).into_iter().for_each(|sum| *sum += share);
                    }
                }
            }
        }
    }
}

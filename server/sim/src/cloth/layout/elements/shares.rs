//! What each particle has of its elements: energy, stretch, and what bounds an explicit step.

use super::Packs;
use crate::{
    cloth::laws::{ElementLaw, Evaluated, Treatment},
    math::{LANES, Pack, Padded, Portable, Real, three},
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
                let energy = self.evaluated::<L, F>([block, pack], x).energy.store();
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

    /// Tells of each element that is stretched by how much its length exceeds that at rest, as their quotient, and its first two
    /// particles. Those of several blocks are told of more than once.
    pub(super) fn tell_stretch<L: ElementLaw<N, C, F>, const F: usize>(
        &self,
        x: &[Padded<R>],
        tell: &mut dyn FnMut([usize; 2], f64),
    ) {
        if F == 0 || N < 2 {
            return;
        }
        for block in 0..x.len().div_ceil(self.lists.block_size) {
            for pack in self.lists.packs(block) {
                let stretch = self.evaluated::<L, F>([block, pack], x).stretch.store();
                for lane in 0..usize::from(self.lists.used[pack]) {
                    let particle = |corner: usize| {
                        let name = self.lists.particles[pack][corner][lane];
                        self.lists.halos.particle(block, pack, name) as usize
                    };
                    tell([particle(0), particle(1)], stretch[lane].to_f64());
                }
            }
        }
    }

    /// A pack of a block, evaluated at positions `x` (m).
    fn evaluated<L: ElementLaw<N, C, F>, const F: usize>(
        &self,
        [block, pack]: [usize; 2],
        x: &[Padded<R>],
    ) -> Evaluated<Portable<R>, N, F> {
        let rest = std::array::from_fn(|c| Portable::load(&self.rest[pack][c]));
        let at = std::array::from_fn(|corner| {
            let of_lane: [_; LANES] = self.lists.particles[pack][corner]
                .map(|name| x[self.lists.halos.particle(block, pack, name) as usize].vector());
            three!(|c| Portable::load(&of_lane.map(|x| x[c])))
        });
        L::evaluate(rest, at, Treatment { mirror: Portable::one(), elastic: Portable::one() })
    }

    /// The sum of about how long the sides of elements are at rest (m), and how many were counted; those of several blocks
    /// count more than once, and laws of elements that do not stretch have none.
    pub(super) fn sizes<L: ElementLaw<N, C, F>, const F: usize>(&self) -> [f64; 2] {
        let [mut sum, mut count] = [0.0; 2];
        for (rest, used) in self.rest.iter().zip(&self.lists.used) {
            for lane in 0..usize::from(*used) {
                let size = L::size(std::array::from_fn(|c| rest[c][lane].to_f64()));
                if size > 0.0 {
                    [sum, count] = [sum + size, count + 1.0];
                }
            }
        }
        [sum, count]
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

//! Figures of snow: energies, momenta.
//!
//! Reads particles in sorted order; writes sums in binary64, added block by block in a fixed tree.

use rayon::prelude::*;

use super::{
    law::constitutive::{Coefficients, Moduli, energy_density, hardened},
    particles::{Group, Particles, read},
    step::Engine,
    transfer::particle_update::{Constants, Lane, constants},
};
use crate::{
    math::{LANES, Pack, Real, WithSimd, dispatch, svd},
    parallel,
    report::Diagnostics,
};

/// Kinetic, elastic, gravitational energy, momentum, angular momentum, mass.
pub(super) const SUMS: usize = 10;

/// What the particles add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct SnowSums {
    pub(super) diagnostics: Diagnostics,
    /// About the origin, affine part included (kg m²/s).
    pub(super) angular_momentum: [f64; 3],
    /// (kg)
    pub(super) mass: f64,
}

impl<R: Real> Engine<R> {
    /// Adds up all particles; `partials` is scratch.
    pub(super) fn sums(&self, gravity: [f64; 3], partials: &mut Vec<[f64; SUMS]>) -> SnowSums {
        partials.resize(self.grid.blocks.len(), [0.0; SUMS]);
        partials.par_iter_mut().enumerate().for_each(|(b, sums)| *sums = self.block_sums(b, gravity));
        let [kinetic_energy, elastic_energy, gravitational_energy, px, py, pz, lx, ly, lz, mass] =
            parallel::sum(partials);
        let diagnostics = Diagnostics {
            kinetic_energy,
            elastic_energy,
            gravitational_energy,
            momentum: [px, py, pz],
            max_stretch: 0.0,
        };
        SnowSums { diagnostics, angular_momentum: [lx, ly, lz], mass }
    }

    fn block_sums(&self, b: usize, gravity: [f64; 3]) -> [f64; SUMS] {
        let Self { particles, sorter, coefficients, settings, .. } = self;
        let list = &sorter.order[sorter.starts[b] as usize..sorter.starts[b + 1] as usize];
        let second_moment = match settings.kernel.inverse_moment() {
            inverse if inverse > 0.0 && self.is_affine() => settings.cell * settings.cell / inverse,
            _ => 0.0,
        };
        let mut sums = [0.0; SUMS];
        for start in (0..list.len()).step_by(LANES) {
            let group = Group::of(&list[start..]);
            let constants = constants(&particles.fixed, &particles.object, &group);
            let energy = dispatch(ElasticEnergy { particles, group: &group, coefficients, constants });
            for lane in 0..group.count {
                let at = group.at[lane] as usize;
                let m = particles.mass(at).to_f64();
                let (x, v) = (particles.x(at).map(Real::to_f64), particles.v(at).map(Real::to_f64));
                let c = particles.affine(at).map(|row| row.map(Real::to_f64));
                sums[0] += 0.5 * m * dot(v, v);
                sums[1] += energy[lane].to_f64();
                sums[2] -= m * dot(gravity, x);
                sums[9] += m;
                for a in 0..3 {
                    let (j, k) = ((a + 1) % 3, (a + 2) % 3);
                    sums[3 + a] += m * v[a];
                    sums[6 + a] += m * (x[j] * v[k] - x[k] * v[j] + second_moment * (c[k][j] - c[j][k]));
                }
            }
        }
        sums
    }
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

struct ElasticEnergy<'a, R> {
    particles: &'a Particles<R>,
    group: &'a Group,
    coefficients: &'a [Coefficients<R>],
    constants: Constants<R>,
}

impl<R: Real> WithSimd<R> for ElasticEnergy<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = Lane<R>;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Lane<R> {
        let [xx, xy, xz, yx] = read::<P, 0>(&self.particles.shape, self.group);
        let [yy, yz, zx, zy] = read::<P, 1>(&self.particles.shape, self.group);
        let [zz, ..] = read::<P, 0>(&self.particles.affine, self.group);
        let [.., jp] = read::<P, 1>(&self.particles.motion, self.group);
        let moduli =
            Moduli::gather(self.coefficients, &self.constants.object, P::load(&self.constants.fixed[1]));
        let sigma = svd(&[[xx, yx, zx], [xy, yy, zy], [xz, yz, zz]]).sigma;
        (energy_density(&sigma, hardened(jp, &moduli), &moduli) * P::load(&self.constants.fixed[0])).store()
    }
}

//! What the second derivative of the energy makes of a field of velocities: the change of the stress of a group of particles,
//! and what it exerts on nodes.

use std::marker::PhantomData;

use super::{
    particles_to_grid::{BlockParticles, Contributions, add, flush, row_weights},
    scheme::Scheme,
    weights::axis_weights,
};
use crate::{
    math::{Pack, Real, WithSimd, svd},
    snow::{
        law::{MaterialConstants, Moduli, hardened, piola_change, product},
        particles::{Constants, Group, Lanes, Particles},
        settings::SnowSettings,
    },
};

/// V0 dP F^T of a group, dP from dF = (grad u) F.
pub(super) struct StressChange<'a, R: Real> {
    pub(super) particles: &'a Particles<R>,
    pub(super) materials: &'a [MaterialConstants<R>],
    pub(super) group: &'a Group,
    pub(super) constants: Constants<R>,
    /// Enters: grad u, by columns; leaves: V0 dP F^T (J), by columns.
    pub(super) stress: &'a mut [[Lanes<R>; 3]; 3],
}

impl<R: Real> WithSimd<R> for StressChange<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { particles, group, stress, .. } = self;
        let (_, plastic_ratio) = particles.v_and_plastic_ratio::<P>(group);
        let f = particles.f_e_columns::<P>(group);
        let mut gradient = f;
        for axis in 0..3 {
            for k in 0..3 {
                gradient[axis][k] = P::load(&stress[axis][k]);
            }
        }

        let Constants { volume, stiffness, object } = &self.constants;
        let moduli = Moduli::gather(self.materials, object, P::load(stiffness));
        let change = product(&gradient, &f);
        let piola = piola_change(&svd(&f), &change, hardened(plastic_ratio, &moduli), &moduli);
        let volume = P::load(volume);
        for axis in 0..3 {
            for k in 0..3 {
                let sum = piola[0][k] * f[0][axis] + piola[1][k] * f[1][axis];
                stress[axis][k] = ((sum + piola[2][k] * f[2][axis]) * volume).store();
            }
        }
    }
}

/// Adds what the stresses of a group exert on nodes.
pub(super) struct ScatterStress<'a, R: Real, S, const N: usize> {
    pub(super) settings: &'a SnowSettings,
    pub(super) particles: &'a Particles<R>,
    pub(super) group: &'a Group,
    pub(super) block: BlockParticles<'a>,
    pub(super) start: usize,
    pub(super) stress: &'a [[Lanes<R>; 3]; 3],
    pub(super) cell: &'a mut usize,
    pub(super) out: &'a mut [R],
    pub(super) scheme: PhantomData<S>,
}

impl<R: Real, S: Scheme, const N: usize> WithSimd<R> for ScatterStress<'_, R, S, N> {
    const WIDE_BINARY64: bool = false;
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let zero = P::zero();
        let mut rows = Contributions::new();
        self.contributions::<P>(&mut rows);

        let Self { group, block, cell, out, .. } = self;
        let (mut sums, mut forces) = ([[zero; N]; N], [[zero; N]; N]);
        for lane in 0..group.count {
            while block.cells[*cell + 1] as usize <= self.start + lane {
                flush::<P, N>(&mut sums, out, *cell);
                flush::<P, N>(&mut forces, out, *cell);
                *cell += 1;
            }
            add::<P, S, N>(&rows, lane, &mut sums, &mut forces);
        }

        flush::<P, N>(&mut sums, out, *cell);
        flush::<P, N>(&mut forces, out, *cell);
    }
}

impl<R: Real, S: Scheme, const N: usize> ScatterStress<'_, R, S, N> {
    /// What the group's stresses give to the nodes.
    #[inline(always)]
    fn contributions<P: Pack<Number = R>>(&self, out: &mut Contributions<R>) {
        let zero = P::zero();
        let ([x, y, z], _) = self.particles.x_and_mass::<P>(self.group);
        let scale = R::of(1.0 / self.settings.cell);
        let moment = R::of(self.settings.kernel.inverse_moment() / self.settings.cell);
        let axes = [
            axis_weights::<P, N>(x * scale),
            axis_weights::<P, N>(y * scale),
            axis_weights::<P, N>(z * scale),
        ];
        let mut base = [zero; 3];
        for axis in 0..3 {
            let mut column = [zero; 3];
            for k in 0..3 {
                column[k] = P::load(&self.stress[axis][k]) * if S::SLOPES { scale } else { moment };
                base[k] -= column[k] * axes[axis].offset;
            }
            let quads = P::rows([column[0], column[1], column[2], zero]);
            if S::SLOPES {
                out.force[axis] = quads;
            } else {
                out.along[axis] = quads;
            }
        }

        if !S::SLOPES {
            out.base = P::rows([base[0], base[1], base[2], zero]);
        }

        out.wz = P::rows(axes[2].w);
        out.dz = P::rows(axes[2].d);
        row_weights::<P, S, N>(&axes, &mut out.rows);
    }
}

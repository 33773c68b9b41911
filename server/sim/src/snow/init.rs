//! The engine before its first step, after a restart, and after places were renewed.
//!
//! Reads particles in any order; writes the sorted order, stresses, extremes, and volumes where they
//! come from the grid.

use super::{
    Integration, Transfer,
    bound::Extremes,
    grid::{
        blocks::{ROOM, block_of},
        sort::within_reach,
    },
    particles::Group,
    step::{Engine, StepContext},
    transfer::{
        particle_update::{Arrival, Deformation, RunFigures, TOGETHER, Tally, Update, motion},
        weights::weights,
    },
};
use crate::{
    math::{LANES, Real, dispatch},
    report::{NoStopwatch, StepFailure},
};
use rayon::prelude::*;

impl<R: Real> Engine<R> {
    /// Sorts from nothing; a particle out of reach is left to [`Self::lost`].
    pub(super) fn sort_anew(&mut self) {
        let Self { settings, particles, sorter, grid, first_nodes, .. } = self;
        let inverse_cell = R::of(1.0 / settings.cell);
        first_nodes.clear();
        first_nodes.extend((0..particles.len()).map(|at| {
            particles
                .x(at)
                .map(|x| weights(settings.kernel, x * inverse_cell).0)
                .map(|node| if within_reach(node) { node } else { 0 })
        }));
        sorter.rebuild(first_nodes, &particles.id, grid, settings.periodic);
        // Seldom needed again, and twelve bytes a particle.
        *first_nodes = Vec::new();
        let spare = grid.blocks.len() + ROOM;
        sorter.reserve(spare);
        grid.reserve(spare);
        self.figures.reserve(spare);
        self.partials.reserve(spare);
        self.block_figures.reserve(8 * spare);
        self.worst = None;
        self.figures.clear();
        self.figures.resize(self.sorter.sorted().run_count(), RunFigures::default());
    }

    /// The first particle, in the user's numbering, that is nowhere or out of reach.
    pub(super) fn lost(&self) -> Option<StepFailure> {
        let limit = f64::from(super::grid::blocks::REACH - 2) * 4.0 * self.settings.cell;
        let places = (0..self.particles.len()).filter(|at| {
            let x = self.particles.x(*at).map(Real::to_f64);
            !x.iter().all(|c| c.abs() < limit)
        });
        let place = places.min_by_key(|at| self.particles.id[*at])?;
        let (particle, position) =
            (u64::from(self.particles.id[place]), self.particles.x(place).map(Real::to_f64));
        Some(match position.iter().find(|c| !c.is_finite()) {
            Some(&value) => StepFailure::NotFinite { particle, quantity: "position", value },
            None => StepFailure::OutOfRange { particle, position, limit },
        })
    }

    /// Renews stresses, and measures what bounds the first step. Positions and velocities stay.
    pub(super) fn refresh(&mut self) {
        let Self { settings, coefficients, particles, sorter, grid, figures, .. } = self;
        let affine: Vec<_> = (0..particles.len()).map(|at| particles.affine(at)).collect();
        let velocity: Vec<_> = (0..particles.len()).map(|at| particles.v(at)).collect();
        let (planes, fixed, object) = particles.planes();
        let sorted = sorter.sorted();
        figures.par_iter_mut().enumerate().for_each(|(run, figures)| {
            let (.., list) = sorted.run(run);
            let (mut tally, mut arrivals) = (Tally::new(), [Arrival::new(); TOGETHER]);
            let (mut moving, mut codes) = ([[[[R::zero(); 4]; LANES]; 2]; TOGETHER], [[0; LANES]; TOGETHER]);
            for start in (0..list.len()).step_by(LANES * TOGETHER) {
                let groups: [Group; TOGETHER] = std::array::from_fn(|k| Group::from(list, start + k * LANES));
                for ((group, arrival), moving) in groups.iter().zip(&mut arrivals).zip(&mut moving) {
                    motion(&planes, group, moving);
                    arrival.density = [R::of(R::LARGEST); LANES];
                    for lane in 0..LANES {
                        let at = group.at[lane] as usize;
                        for k in 0..3 {
                            arrival.v[k][lane] = velocity[at][k];
                            for axis in 0..3 {
                                arrival.affine[axis][k][lane] = affine[at][k][axis];
                            }
                        }
                    }
                }
                dispatch(Update {
                    groups: &groups,
                    moving: &moving,
                    arrivals: &arrivals,
                    fixed,
                    object,
                    planes: &planes,
                    coefficients,
                    dt: R::zero(),
                    inverse_cell: R::one(),
                    ballistic_below: R::zero(),
                    deformation: Deformation::Refresh,
                    width: 3,
                    tally: &mut tally,
                    periodic: settings.periodic,
                    codes: &mut codes,
                });
            }
            *figures = tally.finish();
        });
        let _ = grid;
        self.extremes = self.figures.iter().fold(Extremes::default(), |all, block| all.max(block.extremes));
    }

    /// Volumes from the density on the grid (step 2): V0 = m / sum w m_i / h³.
    pub(super) fn volumes_from_grid(&mut self, of: &[bool]) {
        let still = StepContext { dt: 0.0, time: 0.0, gravity: [0.0; 3], colliders: &[], last: false };
        self.onto_grid(&still, &mut NoStopwatch);
        let density = self.densities();
        let Self { particles, .. } = self;
        for (at, density) in density.into_iter().enumerate() {
            if of[usize::from(particles.object[at])] {
                particles.fixed[at][0] = R::of(particles.mass(at).to_f64() / density);
            }
        }
    }

    /// Density on the grid around each particle (kg/m³), by place.
    fn densities(&self) -> Vec<f64> {
        let h = self.settings.cell;
        let mut density = vec![0.0; self.particles.len()];
        for (b, in_front) in self.grid.in_front.iter().enumerate() {
            let block = block_of(self.grid.blocks[b]);
            let list = &self.sorter.order[self.sorter.starts[b] as usize..self.sorter.starts[b + 1] as usize];
            for &place in list {
                let at = place as usize;
                let axes = self.particles.x(at).map(|x| weights(self.settings.kernel, x * R::of(1.0 / h)));
                let mut sum = 0.0;
                for i in 0..64 {
                    let steps = [i / 16, i / 4 % 4, i % 4];
                    let w: f64 = (0..3).map(|a| axes[a].1[steps[a]].to_f64()).product();
                    if w > 0.0 {
                        let local = [0, 1, 2].map(|a| axes[a].0.rem_euclid(4) as usize + steps[a]);
                        let corner = local.iter().fold(0, |corner, l| 2 * corner + l / 4);
                        let node = local.iter().fold(0, |node, l| 4 * node + l % 4);
                        sum += w * self.grid.nodes[in_front[corner] as usize][node][3].to_f64();
                    }
                }
                density[at] = sum / (h * h * h);
            }
            debug_assert!(block.iter().all(|c| c.abs() < super::grid::blocks::REACH));
        }
        density
    }

    /// Puts particles in the sorted order, so that those of a block lie together again.
    pub(super) fn renew_places(&mut self) {
        let Self { particles, sorter, spare, .. } = self;
        let order = &sorter.order;
        spare.resize(order.len(), [R::zero(); 4]);
        for plane in
            [&mut particles.motion, &mut particles.shape, &mut particles.affine, &mut particles.stress]
        {
            for half in 0..2 {
                spare
                    .par_iter_mut()
                    .zip(order)
                    .for_each(|(quad, place)| *quad = plane[*place as usize][half]);
                plane.par_iter_mut().zip(&*spare).for_each(|(pair, quad)| pair[half] = *quad);
            }
        }
        spare.par_iter_mut().zip(order).for_each(|(quad, place)| {
            let [volume, factor] = particles.fixed[*place as usize];
            *quad = [volume, factor, R::zero(), R::zero()];
        });
        particles.fixed.par_iter_mut().zip(&*spare).for_each(|(fixed, quad)| *fixed = [quad[0], quad[1]]);
        sorter.renumber(&mut particles.id, &mut particles.object);
    }

    /// Whether velocities are solved for.
    pub(super) fn is_implicit(&self) -> bool {
        matches!(self.settings.integration, Integration::SemiImplicit { beta, .. } if beta > 0.0)
    }

    /// Share of FLIP says whether C is an affine velocity or a gradient.
    pub(super) fn is_affine(&self) -> bool {
        !matches!(self.settings.transfer, Transfer::PicFlip(_))
    }
}

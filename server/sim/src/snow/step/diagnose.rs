//! What a step tells of the snow: energies, momenta, counts.
//!
//! Reads particles in sorted order; writes sums in binary64, added block by block in a fixed tree.

use super::{failure::culprits, reach::around};
use crate::{
    collide::Collider,
    linalg::SolveReport,
    math::{LANES, Pack, Real, WithSimd, array::dot, dispatch, svd},
    parallel::{self, Own, per_block_mut},
    report::{BoundKind, Diagnostics, Notices, SnowReport, TimeBound, Work},
    snow::{
        book::Entry,
        bound::smallest,
        grid::Sorted,
        law::{MaterialConstants, Moduli, energy_density, hardened},
        model::SnowModel,
        particles::{Constants, Group, Lanes, Particles},
        ranks::SnowRanks,
        state::{SUMS, SnowState, SnowWorkspace},
    },
    time_step::TimeStep,
};

/// What one step of the world tells of the snow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnowStep {
    /// Energies and momentum of the new state.
    pub diagnostics: Diagnostics,
    /// Counts, the bound on the next step, mass and angular momentum.
    pub report: SnowReport,
    /// Nodes of the grid that touched a collider in the last step of the snow.
    pub contact_count: u64,
    /// The last linear solve of a semi-implicit run.
    pub solve: Option<SolveReport>,
    /// Particles that went through a collider, over all steps of the snow, and those that are torn.
    pub notices: Notices,
    /// What the steps of the snow cost.
    pub work: Work,
}

/// What the particles add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct SnowSums {
    pub(crate) diagnostics: Diagnostics,
    /// About the origin, affine part included (kg m²/s).
    pub(crate) angular_momentum: [f64; 3],
    /// Mass of all particles (kg).
    pub(crate) mass: f64,
    /// Kinetic energy of affine velocities (J).
    pub(crate) affine_energy: f64,
    /// Mass times position (kg m).
    pub(crate) moment: [f64; 3],
    /// Gravitational energy of each particle without its sign (J).
    pub(crate) lifted: f64,
    /// What the last step counted.
    counted: Counted,
}

/// Yielded, clamped, inverted and ballistic particles; the least and the greatest J_P.
type Counted = [f64; 6];

/// Of no particles.
pub(crate) const NOTHING: Counted = [0.0, 0.0, 0.0, 0.0, f64::INFINITY, f64::NEG_INFINITY];

fn both([a, b, c, d, low, high]: Counted, other: Counted) -> Counted {
    [a + other[0], b + other[1], c + other[2], d + other[3], low.min(other[4]), high.max(other[5])]
}

impl SnowSums {
    /// For the book of energy.
    pub(in crate::snow) fn entry(&self) -> Entry {
        let Diagnostics { kinetic_energy, elastic_energy, momentum, .. } = self.diagnostics;
        let moved = kinetic_energy + self.affine_energy + elastic_energy;
        Entry { moved, mass: self.mass, momentum, moment: self.moment, lifted: self.lifted }
    }
}

/// Adds up all particles.
pub(crate) fn sums<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    gravity: [f64; 3],
    work: &mut SnowWorkspace<R>,
) -> SnowSums {
    let SnowWorkspace { sorter, partials, ranks, chunk_diagnostics, .. } = work;
    let ranks = ranks.as_ref().filter(|ranks| ranks.is_divided());
    let counted = chunk_diagnostics.iter().fold(NOTHING, |all, chunk| {
        let ([a, b, c, d], [low, high]) = (chunk.counts.map(f64::from), chunk.plastic_ratio_range);
        both(all, [a, b, c, d, low, high])
    });
    sums_of(model, particles, (sorter.sorted(), ranks), gravity, (partials, counted))
}

/// The same, with what was counted here; `partials` is scratch.
pub(crate) fn sums_of<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    (sorted, ranks): (Sorted<'_>, Option<&SnowRanks>),
    gravity: [f64; 3],
    (partials, counted): (&mut Vec<[f64; SUMS]>, Counted),
) -> SnowSums {
    partials.resize(sorted.cells.len(), [0.0; SUMS]);
    let of_block = |block| block_sums(model, particles, sorted.places(block), gravity);
    Own::whole(partials.len(), 1).each(per_block_mut(partials), |block, sums| *sums = of_block(block));
    let mut all = NOTHING;
    let [kinetic_energy, elastic_energy, gravitational_energy, px, py, pz, lx, ly, lz, mass, rest @ ..] =
        if let Some(ranks) = ranks {
            ranks.blocks.sum_own_and_tell(partials, &|partial| *partial, counted, |own| all = both(all, own))
        } else {
            all = counted;
            parallel::sum(partials)
        };
    let [affine_energy, mx, my, mz, lifted] = rest;
    let diagnostics = Diagnostics {
        external_work: 0.0,
        kinetic_energy,
        elastic_energy,
        gravitational_energy,
        momentum: [px, py, pz],
        max_stretch: 0.0,
    };
    SnowSums {
        diagnostics,
        angular_momentum: [lx, ly, lz],
        mass,
        affine_energy,
        moment: [mx, my, mz],
        lifted,
        counted: all,
    }
}

/// The sums over one block, whose particles are at the places of a list.
fn block_sums<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    list: &[u32],
    gravity: [f64; 3],
) -> [f64; SUMS] {
    let SnowModel { settings, materials, .. } = model;
    let second_moment = match settings.kernel.inverse_moment() {
        inverse if inverse > 0.0 && settings.transfer.is_affine() => settings.cell * settings.cell / inverse,
        _ => 0.0,
    };
    let mut sums = [0.0; SUMS];
    for start in (0..list.len()).step_by(LANES) {
        let group = Group::of(&list[start..]);
        let constants = particles.constants(&group);
        let energy = dispatch(ElasticEnergy { particles, group: &group, materials, constants });
        for lane in 0..group.count {
            let at = group.at[lane] as usize;
            let m = particles.mass(at).to_f64();
            let (x, v) = (particles.x(at).map(Real::to_f64), particles.v(at).map(Real::to_f64));
            let c = particles.c(at).map(|row| row.map(Real::to_f64));
            sums[0] += 0.5 * m * dot(v, v);
            sums[1] += energy[lane].to_f64();
            sums[2] -= m * dot(gravity, x);
            sums[9] += m;
            sums[10] += 0.5 * m * second_moment * c.iter().map(|row| dot(*row, *row)).sum::<f64>();
            sums[14] += (m * dot(gravity, x)).abs();
            for a in 0..3 {
                let (j, k) = ((a + 1) % 3, (a + 2) % 3);
                sums[3 + a] += m * v[a];
                sums[11 + a] += m * x[a];
                sums[6 + a] += m * (x[j] * v[k] - x[k] * v[j] + second_moment * (c[k][j] - c[j][k]));
            }
        }
    }

    sums
}

struct ElasticEnergy<'a, R> {
    particles: &'a Particles<R>,
    group: &'a Group,
    materials: &'a [MaterialConstants<R>],
    constants: Constants<R>,
}

impl<R: Real> WithSimd<R> for ElasticEnergy<'_, R> {
    const WIDE_BINARY64: bool = false;
    type Output = Lanes<R>;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Lanes<R> {
        let Constants { volume, stiffness, object } = &self.constants;
        let f = self.particles.f_e_columns::<P>(self.group);
        let (_, plastic_ratio) = self.particles.v_and_plastic_ratio::<P>(self.group);
        let moduli = Moduli::gather(self.materials, object, P::load(stiffness));
        let sigma = svd(&f).sigma;
        (energy_density(&sigma, hardened(plastic_ratio, &moduli), &moduli) * P::load(volume)).store()
    }
}

/// Everything that a step of the world tells but for energies and momentum: `substeps` steps of the
/// snow were taken, the last of them of `dt` (s), and so many particles are torn.
pub(crate) fn report<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    (substeps, dt, torn_count): (u32, f64, u64),
    sums: &SnowSums,
    (colliders, times): (&[Collider], [f64; 2]),
) -> SnowReport {
    let [counts @ .., low, high] = sums.counted;
    let counts = counts.map(|count| count as u64);
    let own_blocks = work.grid.node_blocks.len();
    let block_count = work.divided().map_or(own_blocks, |ranks| ranks.nodes.block_count());
    let around = around(model, work, colliders, times);
    let (kind, bound) = smallest(&model.settings, &work.extremes, &around);
    let bound = match model.settings.time_step {
        TimeStep::Certified { safety } => {
            TimeBound { kind, dt: safety * bound, particle: culprits(model, state, work).of(kind) }
        }
        TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) => {
            TimeBound { kind: BoundKind::Fixed, dt, particle: None }
        }
    };
    SnowReport {
        substeps,
        dt,
        bound,
        mass: sums.mass,
        grid_mass_error: work.grid_diagnostics.mass / model.mass - 1.0,
        plastic_count: counts[0],
        clamped_count: counts[1],
        inverted_count: counts[2],
        ballistic_count: counts[3],
        torn_count,
        plastic_ratio_range: [low, high],
        max_speed: work.extremes.speed2.sqrt(),
        dropped_momentum: work.grid_diagnostics.dropped,
        angular_momentum: sums.angular_momentum,
        block_count: block_count as u64,
    }
}

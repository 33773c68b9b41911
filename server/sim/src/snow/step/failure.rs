//! Why a step is not taken: what is checked, and the particle or the node at fault.

use super::{culprit::culprits_in, reach::around};
use crate::{
    collide::Collider,
    math::Real,
    parallel::sum_by,
    report::{BoundKind, StepFailure},
    snow::{
        bound::{Culprits, smallest},
        grid::{REACH, allowed_bytes, needed_bytes},
        model::SnowModel,
        particles::Particles,
        settings::SnowSettings,
        state::{SnowState, SnowWorkspace},
    },
    time_step::TimeStep,
};

/// Cells that a node may move in one step: more, and particles leave what the sorted order can follow.
pub(crate) const MOVE: f64 = 1.0;
/// Largest singular value of F_E: beyond it, binary32 could overflow in the next step.
const STRETCH: f64 = 1e3;
/// Largest relative difference between the mass on the grid and that of the particles.
const MASS_ERROR: f64 = 1e-3;

/// The particles that set the bounds on the next step.
pub(crate) fn culprits<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
) -> Culprits {
    let all = || {
        let own = culprits_in(model, &state.particles, work.sorter.order.iter(), &work.extremes);
        let Some(ranks) = work.divided() else { return own };
        let mut all = Culprits::default();
        ranks.blocks.tell(own.0.map(|id| id.map_or(f64::INFINITY, |id| id as f64)), |ids: [f64; 5]| {
            let least =
                |k: usize| ids[k].is_finite().then_some(ids[k] as u64).into_iter().chain(all.0[k]).min();
            all = Culprits(std::array::from_fn(least));
        });
        all
    };
    work.culprits.unwrap_or_else(all)
}

/// Refuses a fixed step (s) above the bound between two times (s); gives the smallest bound and its kind.
pub(crate) fn check_time_step<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    colliders: &[Collider],
    times: [f64; 2],
) -> Result<(BoundKind, f64), StepFailure> {
    let around = around(model, work, colliders, times);
    let (kind, limit) = smallest(&model.settings, &work.extremes, &around);
    match model.settings.time_step {
        TimeStep::Fixed(dt) if dt > limit => {
            let particle = culprits(model, state, work).of(kind).unwrap_or_default();
            Err(StepFailure::TimeStep { particle, dt, limit, bound: kind })
        }
        _ => Ok((kind, limit)),
    }
}

/// Refuses to go on from a state that a step might make infinite.
pub(crate) fn check_stretch<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
) -> Result<(), StepFailure> {
    let value = work.extremes.stretch2.sqrt();
    if value <= STRETCH {
        return Ok(());
    }
    let particle = culprits(model, state, work).stretched();
    Err(StepFailure::Deformation { particle, value, limit: STRETCH })
}

/// Refuses to go on where the grid would take too many bytes: snow flies apart.
pub(crate) fn check_grid<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    work: &SnowWorkspace<R>,
) -> Result<(), StepFailure> {
    let blocks = match work.divided() {
        Some(ranks) => [ranks.blocks.block_count(), ranks.nodes.block_count()],
        None => [work.grid.blocks.len(), work.grid.node_blocks.len()],
    };
    let bytes = needed_bytes::<R>(&model.settings, blocks);
    let limit = allowed_bytes(particles.len());
    if bytes <= limit {
        return Ok(());
    }
    let (particle, position) = farthest(particles, work);
    Err(StepFailure::GridMemory { particle, position, bytes, limit })
}

/// The particle, in the user's numbering, that is farthest from the mean of all, and its position (m).
fn farthest<R: Real>(particles: &Particles<R>, work: &SnowWorkspace<R>) -> (u64, [f64; 3]) {
    let sorted = work.sorter.sorted();
    let position = |at: u32| particles.x(at as usize).map(Real::to_f64);
    let positions = || sorted.order.iter().map(|at| (particles.id[*at as usize], position(*at)));
    let blocks: Vec<usize> = (0..sorted.cells.len()).collect();
    let of_block = |block: &usize| {
        let places = sorted.places(*block).iter().map(|at| position(*at));
        places.fold([0.0; 3], |sum, x| [0, 1, 2].map(|a| sum[a] + x[a]))
    };
    let mean = match work.divided() {
        Some(ranks) => ranks.blocks.sum_own_and_tell(&blocks, &of_block, [], |[]| {}),
        None => sum_by(&blocks, &of_block),
    };
    let mean = mean.map(|sum| sum / particles.len() as f64);
    let distance2 = |x: [f64; 3]| (0..3).map(|a| (x[a] - mean[a]).powi(2)).sum::<f64>();
    let farther = |(a, x): &(u32, [f64; 3]), (b, y): &(u32, [f64; 3])| {
        distance2(*x).total_cmp(&distance2(*y)).then(b.cmp(a))
    };
    let own = positions().max_by(farther);
    let Some(ranks) = work.divided() else { return own.map_or((0, [0.0; 3]), |(id, x)| (u64::from(id), x)) };
    let told = own.map_or([f64::NEG_INFINITY, 0.0, 0.0, 0.0, 0.0], |(id, x)| {
        [distance2(x), f64::from(id), x[0], x[1], x[2]]
    });
    let [_, id, x @ ..] = ranks.blocks.greatest(told);
    (id as u64, x)
}

/// Refuses a grid that holds another mass than the particles.
pub(crate) fn check_mass(expected: f64, found: f64) -> Result<(), StepFailure> {
    let error = found / expected - 1.0;
    if error.abs() > MASS_ERROR { Err(StepFailure::Mass { expected, found }) } else { Ok(()) }
}

/// Refuses a state whose kinetic and elastic energy (J) together are more than the settings allow.
pub(crate) fn check_energy<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    value: f64,
) -> Result<(), StepFailure> {
    match model.settings.max_energy {
        Some(limit) if value > limit || value.is_nan() => {
            let particle = culprits(model, state, work).fastest();
            Err(StepFailure::Energy { particle, value, limit })
        }
        _ => Ok(()),
    }
}

/// What made a node move by too many cells, or not to a finite place: where no particle is at fault, sums on the grid are.
pub(crate) fn node_failure<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    moved: f64,
    node: [i32; 3],
) -> StepFailure {
    not_finite(&state.particles, work).unwrap_or_else(|| {
        let particle = culprits(model, state, work).fastest();
        if moved.is_finite() {
            StepFailure::NodeSpeed { particle, node, value: moved, limit: MOVE }
        } else {
            StepFailure::NotFinite { particle, quantity: "velocity on the grid".into(), value: moved }
        }
    })
}

/// The first particle, in the user's numbering, that is nowhere or out of reach.
pub(crate) fn lost<R: Real>(
    settings: &SnowSettings,
    particles: &Particles<R>,
    work: &SnowWorkspace<R>,
) -> Option<StepFailure> {
    let limit = f64::from(REACH - 2) * 4.0 * settings.cell;
    let places = work.sorter.order.iter().map(|at| *at as usize).filter(|at| {
        let x = particles.x(*at).map(Real::to_f64);
        !x.iter().all(|c| c.abs() < limit)
    });

    let own = places.min_by_key(|at| particles.id[*at]);
    let own = own.map(|at| (u64::from(particles.id[at]), particles.x(at).map(Real::to_f64)));
    let (particle, position) = least(work, own)?;
    Some(match position.iter().find(|c| !c.is_finite()) {
        Some(&value) => StepFailure::NotFinite { particle, quantity: "position".into(), value },
        None => StepFailure::OutOfRange { particle, position, limit },
    })
}

/// Of what ranks found, a particle with three numbers, that of the particle of least number.
fn least<R: Real>(work: &SnowWorkspace<R>, own: Option<(u64, [f64; 3])>) -> Option<(u64, [f64; 3])> {
    let Some(ranks) = work.divided() else { return own };
    let told = own.map_or([f64::NEG_INFINITY; 4], |(id, [x, y, z])| [-(id as f64), x, y, z]);
    let mut best: Option<(u64, [f64; 3])> = None;
    ranks.blocks.tell(told, |[id, numbers @ ..]: [f64; 4]| {
        let id = id.is_finite().then_some(-id as u64);
        if let Some(id) = id.filter(|id| best.is_none_or(|(other, _)| *id < other)) {
            best = Some((id, numbers));
        }
    });
    best
}

/// What is looked at of a particle, in this order.
const QUANTITIES: [&str; 6] =
    ["position", "velocity", "deformation gradient", "affine velocity", "plastic volume ratio", "stress"];

/// The first number of a particle that is not finite, in the user's numbering of particles.
fn not_finite<R: Real>(particles: &Particles<R>, work: &SnowWorkspace<R>) -> Option<StepFailure> {
    let invalid = |place: usize| {
        let first = |quantity: usize, numbers: &[R]| {
            let value = numbers.iter().map(|n| n.to_f64()).find(|n| !n.is_finite());
            value.map(|value| [quantity as f64, value, 0.0])
        };
        first(0, &particles.x(place))
            .or_else(|| first(1, &particles.v(place)))
            .or_else(|| first(2, particles.f_e(place).as_flattened()))
            .or_else(|| first(3, particles.c(place).as_flattened()))
            .or_else(|| first(4, &[particles.plastic_ratio(place)]))
            .or_else(|| first(5, &particles.v0_tau(place)))
    };
    let places = work.sorter.order.iter().map(|place| *place as usize);
    let found = places.filter_map(|place| invalid(place).map(|what| (u64::from(particles.id[place]), what)));
    let (particle, [quantity, value, _]) = least(work, found.min_by_key(|(id, _)| *id))?;
    let quantity = QUANTITIES[quantity as usize].into();
    Some(StepFailure::NotFinite { particle, quantity, value })
}

//! Why a step is not taken: what is checked, and the particle or the node at fault.

use super::culprit::culprits_in;
use crate::{
    collide::Collider,
    math::Real,
    parallel::sum_by,
    report::{BoundKind, StepFailure},
    snow::{
        bound::{Culprits, smallest},
        grid::{REACH, Sorted, allowed_bytes, needed_bytes},
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
    let all = || culprits_in(model, &state.particles, work.sorter.order.iter(), &work.extremes);
    work.culprits.unwrap_or_else(all)
}

/// Refuses a fixed step (s) above the bound; gives the smallest bound and its kind.
pub(crate) fn check_time_step<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    colliders: &[Collider],
) -> Result<(BoundKind, f64), StepFailure> {
    let (kind, limit) = smallest(&model.settings, &work.extremes, colliders);
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
    let blocks = [work.grid.blocks.len(), work.grid.node_blocks.len()];
    let bytes = needed_bytes::<R>(&model.settings, blocks);
    let limit = allowed_bytes(particles.len());
    if bytes <= limit {
        return Ok(());
    }
    let (particle, position) = farthest(particles, work.sorter.sorted());
    Err(StepFailure::GridMemory { particle, position, bytes, limit })
}

/// The particle, in the user's numbering, that is farthest from the mean of all, and its position (m).
fn farthest<R: Real>(particles: &Particles<R>, sorted: Sorted<'_>) -> (u64, [f64; 3]) {
    let position = |at: usize| particles.x(at).map(Real::to_f64);
    let positions = || (0..particles.len()).map(|at| (particles.id[at], position(at)));
    let blocks: Vec<usize> = (0..sorted.cells.len()).collect();
    let mean = sum_by(&blocks, &|block| {
        let places = sorted.places(*block).iter().map(|at| position(*at as usize));
        places.fold([0.0; 3], |sum, x| [0, 1, 2].map(|a| sum[a] + x[a]))
    });
    let mean = mean.map(|sum| sum / particles.len() as f64);
    let distance2 = |x: [f64; 3]| (0..3).map(|a| (x[a] - mean[a]).powi(2)).sum::<f64>();
    let farther = |(a, x): &(u32, [f64; 3]), (b, y): &(u32, [f64; 3])| {
        distance2(*x).total_cmp(&distance2(*y)).then(b.cmp(a))
    };
    positions().max_by(farther).map_or((0, [0.0; 3]), |(id, x)| (u64::from(id), x))
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

/// What made a node move by too many cells, or not to a finite place.
pub(crate) fn node_failure<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    moved: f64,
    node: [i32; 3],
) -> StepFailure {
    not_finite(&state.particles).unwrap_or_else(|| StepFailure::NodeSpeed {
        particle: culprits(model, state, work).fastest(),
        node,
        value: moved,
        limit: MOVE,
    })
}

/// The first particle, in the user's numbering, that is nowhere or out of reach.
pub(crate) fn lost<R: Real>(settings: &SnowSettings, particles: &Particles<R>) -> Option<StepFailure> {
    let limit = f64::from(REACH - 2) * 4.0 * settings.cell;
    let places = (0..particles.len()).filter(|at| {
        let x = particles.x(*at).map(Real::to_f64);
        !x.iter().all(|c| c.abs() < limit)
    });

    let place = places.min_by_key(|at| particles.id[*at])?;
    let (particle, position) = (u64::from(particles.id[place]), particles.x(place).map(Real::to_f64));
    Some(match position.iter().find(|c| !c.is_finite()) {
        Some(&value) => StepFailure::NotFinite { particle, quantity: "position".into(), value },
        None => StepFailure::OutOfRange { particle, position, limit },
    })
}

/// The first number of a particle that is not finite, in the user's numbering of particles.
fn not_finite<R: Real>(particles: &Particles<R>) -> Option<StepFailure> {
    let invalid = |place: usize| {
        let first = |quantity: &'static str, numbers: &[R]| {
            numbers.iter().map(|n| n.to_f64()).find(|n| !n.is_finite()).map(|value| (quantity, value))
        };
        first("position", &particles.x(place))
            .or_else(|| first("velocity", &particles.v(place)))
            .or_else(|| first("deformation gradient", particles.f_e(place).as_flattened()))
            .or_else(|| first("affine velocity", particles.c(place).as_flattened()))
            .or_else(|| first("plastic volume ratio", &[particles.plastic_ratio(place)]))
            .or_else(|| first("stress", &particles.v0_tau(place)))
    };
    let found =
        (0..particles.len()).filter_map(|place| invalid(place).map(|what| (particles.id[place], what)));
    let (id, (quantity, value)) = found.min_by_key(|(id, _)| *id)?;
    Some(StepFailure::NotFinite { particle: u64::from(id), quantity: quantity.into(), value })
}

//! Snow before its first step, and after its particles were put in place of others.
//!
//! Reads a setup, or particles in any order; writes the sorted order, stresses, extremes, and volumes
//! where they come from the grid.

use super::{
    attached::Attached,
    book::Book,
    bound::Extremes,
    grid::{Grid, REACH, Sorted, block_of},
    law::MaterialConstants,
    model::SnowModel,
    particles::{Group, Motion, Particles},
    setup::{SnowError, SnowSetup},
    state::{SnowState, SnowWorkspace},
    step::{check_grid, check_time_step, lost, renew_places, sort_anew, sums},
    transfer::{
        Arrival, ChunkDiagnostics, Deformation, StepContext, TOGETHER, Tally, Update, particles_to_grid,
        update_grid, weights,
    },
};
use crate::{
    collide::Collider,
    held_length::HeldLength,
    interrupt::{self, Interrupt},
    math::{LANES, Real, dispatch},
    parallel::{Own, per_block_mut},
    sub_step::SubStep,
};

/// A model, its state, and what a step works with.
pub(super) type Parts<R> = (SnowModel<R>, SnowState<R>, SnowWorkspace<R>);

/// Builds snow from a setup that was checked.
///
/// # Errors
/// When a particle is out of reach, or particles are so far apart that the grid would take too many bytes.
pub(super) fn build<R: Real>(setup: &SnowSetup) -> Result<Parts<R>, SnowError> {
    let particles: Particles<R> = Particles::of(&setup.objects);
    interrupt::point();
    let masses = (0..particles.len()).map(|at| particles.mass(at).to_f64());
    let mut model = SnowModel {
        settings: setup.settings,
        materials: setup.objects.iter().map(|object| MaterialConstants::of(&object.material)).collect(),
        objects: setup.objects.iter().map(|object| (object.name.clone(), object.x.len())).collect(),
        mass: 0.0,
        least_mass: masses.fold(f64::INFINITY, f64::min),
        attached: Attached::default(),
    };
    let (mut state, mut work) = (
        SnowState { particles, hold: HeldLength::default(), book: Book::default() },
        SnowWorkspace::default(),
    );

    sort_anew(&model, &state.particles, &mut work);
    interrupt::point();
    if let Some(failure) = lost(&model.settings, &state.particles, &work) {
        return Err(SnowError::Settings(failure.to_string()));
    }
    check_grid(&model, &state.particles, &work)
        .map_err(|failure| SnowError::Settings(failure.to_string()))?;

    let from_grid: Vec<bool> = setup.objects.iter().map(|object| object.volume.is_empty()).collect();
    if from_grid.contains(&true) {
        volumes_from_grid(&model, &mut state.particles, &mut work, &from_grid);
    }

    settle(&model, &mut state, &mut work);
    interrupt::point();

    model.mass = sums(&model, &state.particles, [0.0; 3], &mut work).mass;
    Ok((model, state, work))
}

/// Refuses a fixed step above the bound at the start.
pub(super) fn check_first_step<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &SnowWorkspace<R>,
    colliders: &[Collider],
) -> Result<(), SnowError> {
    let checked = check_time_step(model, state, work, colliders, [0.0; 2]);
    checked.map(|_| ()).map_err(|failure| SnowError::Settings(failure.to_string()))
}

/// Puts particles in order, renews stresses, and measures what bounds the first step.
pub(super) fn settle<R: Real>(model: &SnowModel<R>, state: &mut SnowState<R>, work: &mut SnowWorkspace<R>) {
    renew_places(&mut state.particles, work);
    interrupt::point();
    sort_anew(model, &state.particles, work);
    interrupt::point();
    refresh(model, &mut state.particles, work);
}

/// Renews stresses, and measures what bounds the first step. Positions and velocities stay.
fn refresh<R: Real>(model: &SnowModel<R>, particles: &mut Particles<R>, work: &mut SnowWorkspace<R>) {
    let SnowModel { settings, materials, attached, .. } = model;
    let c: Vec<_> = (0..particles.len()).map(|at| particles.c(at)).collect();
    let velocity: Vec<_> = (0..particles.len()).map(|at| particles.v(at)).collect();

    let (particles, sorted) = (particles.share(), work.sorter.sorted());
    work.chunk_diagnostics.clear();
    work.chunk_diagnostics.resize(sorted.chunks.count(), ChunkDiagnostics::default());
    let chunks = Own::whole(work.chunk_diagnostics.len(), 1);
    chunks.each(per_block_mut(&mut work.chunk_diagnostics), |chunk, diagnostics| {
        let (.., list) = sorted.chunk(chunk);
        let (mut tally, mut arrivals) = (Tally::new(), [Arrival::new(); TOGETHER]);
        let (mut motions, mut codes) = ([Motion::new(); TOGETHER], [[0; LANES]; TOGETHER]);

        for start in (0..list.len()).step_by(LANES * TOGETHER) {
            let groups: [Group; TOGETHER] = std::array::from_fn(|k| Group::from(list, start + k * LANES));
            for ((group, arrival), motion) in groups.iter().zip(&mut arrivals).zip(&mut motions) {
                particles.read_motion(group, motion);
                arrival.density = [R::of(R::LARGEST); LANES];
                for lane in 0..LANES {
                    let at = group.at[lane] as usize;
                    for k in 0..3 {
                        arrival.v[k][lane] = velocity[at][k];
                        for axis in 0..3 {
                            arrival.c[axis][k][lane] = c[at][k][axis];
                        }
                    }
                }
            }
            dispatch(Update {
                groups: &groups,
                motions: &motions,
                arrivals: &arrivals,
                particles: &particles,
                materials,
                attached,
                dt: R::zero(),
                inverse_cell: R::one(),
                ballistic_below: R::zero(),
                deformation: Deformation::Refresh,
                width: 3,
                tally: &mut tally,
                periodic: settings.periodic,
                codes: &mut codes,
                given: &mut [[R::zero(); LANES]; TOGETHER],
            });
        }
        *diagnostics = tally.finish();
    });

    let chunks = work.chunk_diagnostics.iter();
    work.extremes = chunks.fold(Extremes::default(), |all, chunk| all.max(chunk.extremes));
}

/// Volumes of objects from the density on the grid (Stomakhin et al. 2013, step 2): V0 = m / sum w m_i / h³.
fn volumes_from_grid<R: Real>(
    model: &SnowModel<R>,
    particles: &mut Particles<R>,
    work: &mut SnowWorkspace<R>,
    of: &[bool],
) {
    let never = Interrupt::default();
    let still = StepContext {
        sub_step: SubStep::default(),
        gravity: [0.0; 3],
        wind: [0.0; 3],
        colliders: &[],
        interrupt: &never,
    };
    particles_to_grid(model, particles, work.sorter.sorted(), &mut work.grid, still.sub_step.dt);
    let (diagnostics, loads) = (&mut work.block_diagnostics, &mut work.loads.nodes);
    work.grid_diagnostics = update_grid(model, &still, &mut work.grid, diagnostics, loads);

    let density = densities(model, particles, work.sorter.sorted(), &work.grid);
    for (at, density) in density.into_iter().enumerate() {
        if of[usize::from(particles.object[at])] {
            particles.set_volume(at, R::of(particles.mass(at).to_f64() / density));
        }
    }
}

/// Density on the grid around each particle (kg/m³), by place.
fn densities<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    sorted: Sorted<'_>,
    grid: &Grid<R>,
) -> Vec<f64> {
    let (h, kernel) = (model.settings.cell, model.settings.kernel);
    let mut density = vec![0.0; particles.len()];
    for (b, in_front) in grid.in_front.iter().enumerate() {
        interrupt::point();
        let block = block_of(grid.blocks[b]);
        for &place in sorted.places(b) {
            let at = place as usize;
            let axes = particles.x(at).map(|x| weights(kernel, x * R::of(1.0 / h)));
            let mut sum = 0.0;
            for i in 0..64 {
                let steps = [i / 16, i / 4 % 4, i % 4];
                let w: f64 = (0..3).map(|a| axes[a].1[steps[a]].to_f64()).product();
                if w > 0.0 {
                    let local = [0, 1, 2].map(|a| axes[a].0.rem_euclid(4) as usize + steps[a]);
                    let corner = local.iter().fold(0, |corner, l| 2 * corner + l / 4);
                    let node = local.iter().fold(0, |node, l| 4 * node + l % 4);
                    sum += w * grid.nodes[in_front[corner] as usize][node][3].to_f64();
                }
            }
            density[at] = sum / (h * h * h);
        }
        debug_assert!(block.iter().all(|c| c.abs() < REACH));
    }

    density
}

//! A step of the world, in steps of the snow; and one of those, in the paper's order.
//!
//! Reads and writes the state. A step that would diverge is refused before it touches a particle:
//! velocities on the grid decide, and a particle whose nodes are finite and move by less than a cell
//! stays finite.

mod culprit;
mod reach;
mod failure;
mod time_step;
mod order;
mod diagnose;
mod torn;
mod push;

pub use diagnose::SnowStep;

pub(super) use diagnose::{NOTHING, sums, sums_of};
pub(super) use failure::{check_grid, check_time_step, lost};
pub(super) use order::{divide, renew_places, sort_anew};

use self::{
    culprit::culprits_in_chunks,
    diagnose::{SnowSums, report},
    failure::{MOVE, check_energy, check_mass, check_stretch, culprits},
    order::renew_order,
    push::push,
    time_step::Division,
    torn::{Torn, torn},
};
use super::{
    book::Taken,
    bound::Extremes,
    grid::tile_len,
    model::SnowModel,
    ranks::Found,
    settings::Forces,
    state::{SnowState, SnowWorkspace, Totals},
    transfer::{
        GridDiagnostics, StepContext, fastest_node, particles_to_grid, solve_velocities, update_grid,
        update_particles,
    },
};
use crate::{
    collide::{Felt, Moved},
    linalg::SolveReport,
    math::Real,
    parallel,
    report::{Diagnostics, Notices, Stage, StepFailure, Stopwatch},
    surroundings::Surroundings,
};

/// Advances snow by one step of the world, in as many steps of the snow as the bound asks for.
///
/// # Errors
/// When a step of the snow cannot be taken: particles are then as before that step.
pub fn step<R: Real>(
    model: &SnowModel<R>,
    state: &mut SnowState<R>,
    work: &mut SnowWorkspace<R>,
    around: &Surroundings<'_>,
    watch: &mut dyn Stopwatch,
) -> Result<SnowStep, StepFailure> {
    let (mut division, mut moved) = (Division::of(around), Moved::of(around.colliders));
    divide(model, &state.particles, work);
    if !state.book.is_open() {
        let sums = sums(model, &state.particles, around.gravity, work);
        state.book.open(sums.entry());
    }
    let mut solve = None;
    work.totals = Totals::default();
    work.loads.felt.clear();
    work.loads.felt.resize(around.colliders.len(), Felt::default());
    while !division.is_done() {
        check_stretch(model, state, work)?;
        check_grid(model, &state.particles, work)?;
        let context = division.next(model, state, work)?;
        let colliders = moved.over(around.colliders, context.sub_step);
        let context = StepContext { colliders, ..context };

        let solved = match velocities_on_grid(model, state, work, &context, watch)? {
            Nodes::Ready { solve } => solve,
            Nodes::TooFast { moved, node } => {
                division.retry(model, state, work, moved, node)?;
                continue;
            }
        };
        solve = solved.or(solve);

        advance_particles(model, state, work, &context, &division, watch)?;
        if !work.forces.is_empty() {
            let done = push(state, work, context.sub_step.dt);
            work.totals.given += done;
            work.totals.external += done;
        }
        division.go_on();
    }

    let sums = sums(model, &state.particles, around.gravity, work);
    let Torn { all, elastic, first } = torn(model, &state.particles, work);
    let taken = (division.substeps, division.dt, all);
    let times = [around.time, around.time + around.dt];
    let report = report(model, state, work, taken, &sums, (around.colliders, times));
    watch.lap(Stage::Diagnose);
    check_energy(model, state, work, sums.diagnostics.kinetic_energy + sums.diagnostics.elastic_energy)?;
    let (frame, work_of_colliders) = carried(work, around, &sums);
    let taken = Taken {
        gravity: around.gravity,
        substeps: division.substeps,
        dt: division.dt,
        given: work.totals.given + work_of_colliders,
        frame,
        rounding: R::ROUNDING,
    };
    let fastest = culprits(model, state, work).fastest();
    state.book.enter(&model.settings, sums.entry(), &taken, fastest)?;
    let contact_count = work.grid_diagnostics.contacts;
    let diagnostics = Diagnostics { external_work: work.totals.external, ..sums.diagnostics };
    let Totals { notices, spent, .. } = work.totals;
    let notices = Notices { torn_count: elastic, first_torn: first, ..notices };
    Ok(SnowStep { diagnostics, report, contact_count, solve, notices, work: spent })
}

/// The velocity (m/s) of the surfaces that snow touched in a step of the world, and what the motion of colliders gave (J): where
/// nothing was touched, the velocity of the snow as a whole.
fn carried<R: Real>(work: &SnowWorkspace<R>, around: &Surroundings<'_>, sums: &SnowSums) -> ([f64; 3], f64) {
    let (mut push, mut along, mut given) = (0.0, [0.0; 3], 0.0);
    let [start, end] = [around.time, around.time + around.dt];
    let middle = sums.moment.map(|c| c / sums.mass);
    for (collider, felt) in around.colliders.iter().zip(&work.loads.felt) {
        let (pushed, velocity) = (felt.push(), collider.mean_velocity(middle, [start, end]));
        push += pushed;
        along = [0, 1, 2].map(|c| along[c] + pushed * velocity[c]);
        given += felt.work();
    }
    let momentum = sums.diagnostics.momentum;
    let frame = if push > 0.0 { along.map(|c| c / push) } else { momentum.map(|c| c / sums.mass) };
    (frame, given)
}

/// What a step finds on the grid.
enum Nodes {
    /// Velocities at the end of the step; the report of their solve, if there was one.
    Ready { solve: Option<SolveReport> },
    /// A node would move by too many cells: no particle has moved.
    TooFast { moved: f64, node: [i32; 3] },
}

/// The first half of a step, Stomakhin et al. 2013, section 4: new velocities on the grid. Particles
/// stay as they are. Stage 2, volumes, comes before the first step.
fn velocities_on_grid<R: Real>(
    model: &SnowModel<R>,
    state: &SnowState<R>,
    work: &mut SnowWorkspace<R>,
    context: &StepContext<'_>,
    watch: &mut dyn Stopwatch,
) -> Result<Nodes, StepFailure> {
    let SnowWorkspace { sorter, grid, ranks, loads, .. } = work;
    let (particles, sorted) = (&state.particles, sorter.sorted());
    let cells_moved = |speed2: f64| speed2.sqrt() * context.sub_step.dt / model.settings.cell;

    // 1 and 3. Masses and momenta of particles to nodes, with what forces add to momenta.
    particles_to_grid(model, particles, sorted, grid, context.sub_step.dt);
    work.totals.spent.force_evaluations += 1;
    watch.lap(Stage::ParticlesToGrid);

    // 4 and 5. Velocities of nodes, and their collisions.
    if let Some(ranks) = ranks {
        let (blocks, len) = (grid.blocks.len(), tile_len(model.settings.kernel.width()));
        ranks.fetch_tiles(blocks, &mut grid.tiles, len);
        if model.settings.transfer.forces() == Forces::Apart {
            ranks.fetch_tiles(blocks, &mut grid.impulses, len);
        }
    }
    let mut total = update_grid(model, context, grid, &mut work.block_diagnostics, &mut loads.nodes);
    if let Some(ranks) = ranks {
        total = ranks.total(total, &work.block_diagnostics[grid.own_nodes.clone()]);
    }
    work.grid_diagnostics = total;
    watch.lap(Stage::GridUpdate);

    // Velocities that a solve follows are only where it begins.
    let limit = if model.settings.integration.is_implicit() { f64::MAX } else { MOVE };
    let moved = cells_moved(total.speed2);
    if moved > limit || moved.is_nan() {
        return Ok(Nodes::TooFast { moved, node: total.fastest });
    }

    check_mass(model.mass, total.mass)?;

    // 6. Velocities at the end of a semi-implicit step.
    let memory = (&mut work.implicit, &mut loads.nodes);
    let solved = solve_velocities(model, context, particles, sorted, grid, memory);
    if context.interrupt.is_requested() {
        return Err(StepFailure::Interrupted);
    }
    if !matches!(solved, Ok(None)) {
        watch.lap(Stage::Solve);
    }

    let solve = solved.map_err(|outcome| StepFailure::Solver { outcome })?;
    work.totals.spent.matrix_products += solve.map_or(0, |solve| u64::from(solve.products));

    let (speed2, node) = if solve.is_some() { fastest_node(grid, model.least_mass) } else { (0.0, [0; 3]) };
    let moved = cells_moved(speed2);
    if moved > MOVE || moved.is_nan() {
        return Ok(Nodes::TooFast { moved, node });
    }

    let GridDiagnostics { medium_work, wind_work, .. } = work.grid_diagnostics;
    work.totals.external += medium_work;
    work.totals.given += wind_work;
    work.sum_node_loads();
    Ok(Nodes::Ready { solve })
}

/// The second half: the grid's velocities move and deform particles, which then find their new order.
fn advance_particles<R: Real>(
    model: &SnowModel<R>,
    state: &mut SnowState<R>,
    work: &mut SnowWorkspace<R>,
    context: &StepContext<'_>,
    division: &Division<'_>,
    watch: &mut dyn Stopwatch,
) -> Result<(), StepFailure> {
    let particles = &mut state.particles;

    // 7 to 10. Deformation gradients; velocities and collisions of particles; positions.
    let SnowWorkspace { sorter, grid, chunk_diagnostics, block_given, loads, .. } = work;
    let told = (&mut *chunk_diagnostics, &mut *block_given, &mut loads.particles);
    update_particles(model, context, particles, sorter, grid, told);
    watch.lap(Stage::GridToParticles);

    // What bounds the next step. Chunks are those of the old order: looked up before it changes.
    let none = (Extremes::default(), Notices::default());
    let (extremes, notices) = chunk_diagnostics
        .iter()
        .fold(none, |(extremes, notices), chunk| (extremes.max(chunk.extremes), notices.and(chunk.notices)));
    let culprits = || culprits_in_chunks(model, particles, sorter.sorted(), &extremes, chunk_diagnostics);
    let culprits = division.is_last().then(culprits).unwrap_or_default();
    work.take_loads();

    let followed = renew_order(model, particles, work);
    watch.lap(Stage::Sort);
    let (blocks, nodes) = (work.grid.blocks.len(), work.grid.own_nodes.len());
    let found = Found { blocks, nodes, extremes, culprits, followed, notices };
    let (found, given) = match &mut work.ranks {
        None => (found, parallel::sum_by(&work.block_given, &|given| [*given])[0]),
        Some(ranks) => {
            let mut all: Option<Found> = None;
            let given = ranks.count(&found, &work.block_given, |found| {
                all = Some(all.map_or(*found, |all| all.and(found)));
            });
            (all.unwrap_or(found), given)
        }
    };
    work.totals.given += given;
    work.totals.notices = work.totals.notices.and(found.notices);
    work.extremes = found.extremes;
    work.culprits = division.is_last().then_some(found.culprits);
    if found.followed {
        return Ok(());
    }

    lost(&model.settings, particles, work).map_or(Ok(()), Err)
}

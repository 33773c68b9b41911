//! What a step reported, as the message that watchers and descriptions of sessions carry.
//!
//! Enters: the report of a step, the colliders that it names and the time that it took. Leaves: `v1::Diagnostics`.

use nappe_proto::v1;
use nappe_sim::{
    collide::Collider,
    linalg::{Outcome, SolveReport},
    report::{
        BoundKind, ClothSteps, Diagnostics, Load, Rejection, RestReport, SnowReport, Stage, StageSeconds,
        StepReport, SurfaceReport, WakeCause,
    },
    world::Simulation,
};

/// The diagnostics of a step among colliders whose newest frame is `frame`, without notices of it.
pub(crate) fn diagnostics(
    report: &StepReport,
    colliders: &[Collider],
    frame: u64,
    stage_seconds: &StageSeconds,
    step_seconds: f64,
) -> v1::Diagnostics {
    let Diagnostics {
        kinetic_energy,
        elastic_energy,
        gravitational_energy,
        momentum,
        max_stretch,
        external_work,
    } = report.diagnostics;

    v1::Diagnostics {
        step: report.step,
        time_seconds: report.time,
        frame,
        kinetic_energy,
        elastic_energy,
        gravitational_energy,
        momentum: Some(momentum.into()),
        max_stretch,
        external_work,
        contact_count: report.contact_count,
        solve: report.solve.as_ref().map(solve),
        stages: stages(stage_seconds),
        step_seconds,
        snow: report.snow.as_ref().map(snow),
        cloth: report.cloth.as_ref().map(cloth),
        notices: Some(v1::Notices::default()),
        loads: report.loads.iter().zip(colliders).map(load).collect(),
        surface: report.surface.as_ref().map(surface),
        rest: report.rest.as_ref().map(rest),
    }
}

/// Where there was no pair, no number says how near they came.
fn surface(report: &SurfaceReport) -> v1::SurfaceReport {
    let SurfaceReport {
        pairs,
        active,
        rounds,
        least_gap,
        failed,
        crossings,
        yield_m,
        yielding,
        largest_push,
    } = *report;
    let least_gap_m = Some(least_gap).filter(|gap| gap.is_finite());
    let largest_push_n = largest_push;
    v1::SurfaceReport {
        pairs,
        active,
        rounds,
        least_gap_m,
        failed,
        crossings,
        yield_m,
        yielding,
        largest_push_n,
    }
}

fn rest(report: &RestReport) -> v1::RestReport {
    let RestReport { pieces, calm_pieces, way, change, pieces_asleep, told, long_steps, wakes, wake, .. } =
        *report;
    let cause = wake.map(|wake| wake_cause(wake.cause).into());
    v1::RestReport {
        calm_share: report.calm_share(),
        pieces,
        calm_pieces,
        way_m: way,
        change_m: change,
        awake_share: report.awake_share(),
        pieces_asleep,
        told_m: told,
        long_steps,
        wakes,
        wake_cause: cause,
    }
}

const fn wake_cause(cause: WakeCause) -> v1::WakeCause {
    match cause {
        WakeCause::Call => v1::WakeCause::Call,
        WakeCause::Force => v1::WakeCause::Force,
        WakeCause::Wind => v1::WakeCause::Wind,
        WakeCause::Pin => v1::WakeCause::Pin,
        WakeCause::Collider => v1::WakeCause::Collider,
        WakeCause::Motion => v1::WakeCause::Motion,
        WakeCause::Error => v1::WakeCause::Error,
    }
}

fn load((load, collider): (&Load, &Collider)) -> v1::ColliderLoad {
    let Load { force, torque, contacts } = *load;
    v1::ColliderLoad {
        name: collider.name.clone(),
        force: Some(force.into()),
        torque: Some(torque.into()),
        contacts,
    }
}

/// The diagnostics of frame 0, before the first step.
pub(crate) fn initial_diagnostics(simulation: &Simulation) -> v1::Diagnostics {
    let report = StepReport {
        step: simulation.step_count(),
        time: simulation.time(),
        diagnostics: simulation.diagnose(),
        ..StepReport::default()
    };
    diagnostics(&report, simulation.colliders(), 0, &[0.0; Stage::ALL.len()], 0.0)
}

fn solve(report: &SolveReport) -> v1::SolveReport {
    let outcome = match report.outcome {
        Outcome::Converged => v1::SolveOutcome::Converged,
        Outcome::IterationCap => v1::SolveOutcome::IterationCap,
        Outcome::NegativeCurvature { .. } => v1::SolveOutcome::NegativeCurvature,
        Outcome::ZeroCurvature { .. } => v1::SolveOutcome::ZeroCurvature,
        Outcome::Singular { .. } => v1::SolveOutcome::Singular,
        Outcome::IndefinitePreconditioner { .. } => v1::SolveOutcome::IndefinitePreconditioner,
        Outcome::NotFinite { .. } => v1::SolveOutcome::NotFinite,
    };

    v1::SolveReport {
        outcome: outcome.into(),
        iterations: report.iterations,
        relative_residual: report.relative_residual,
    }
}

/// Particles are those over all bodies already.
fn cloth(steps: &ClothSteps) -> v1::ClothSteps {
    v1::ClothSteps {
        substeps: steps.substeps,
        rejected: steps.rejected,
        dt_seconds: steps.dt,
        bound: bound(steps.bound.kind).into(),
        bound_particle: steps.bound.particle,
        bound_seconds: steps.bound.dt.min(f64::MAX),
        error_rms: steps.error.rms,
        error_largest: steps.error.largest,
        preconditioner: steps.preconditioner.map(|kind| kind.name().to_owned()),
        solve_error_m: steps.error.of_solve,
        solves: steps.solves,
    }
}

/// A sub-step of cloth that was not accepted, as the message that watchers get.
pub(crate) fn rejected(rejection: &Rejection) -> v1::RejectedStep {
    let Rejection { time, dt, body, cause } = rejection;
    v1::RejectedStep {
        time_seconds: *time,
        dt_seconds: *dt,
        body: body.clone(),
        reason: cause.reason().to_owned(),
        message: cause.to_string(),
        particle: cause.particle(),
        value: cause.value().filter(|value| value.is_finite()),
    }
}

fn bound(kind: BoundKind) -> v1::TimeBound {
    match kind {
        BoundKind::ElasticWave => v1::TimeBound::ElasticWave,
        BoundKind::IsolatedParticle => v1::TimeBound::IsolatedParticle,
        BoundKind::ParticleSpeed => v1::TimeBound::ParticleSpeed,
        BoundKind::VelocityGradient => v1::TimeBound::VelocityGradient,
        BoundKind::ColliderSpeed => v1::TimeBound::ColliderSpeed,
        BoundKind::Fixed => v1::TimeBound::Fixed,
        BoundKind::Frame => v1::TimeBound::Frame,
        BoundKind::Stiffness => v1::TimeBound::Stiffness,
        BoundKind::Damping => v1::TimeBound::Damping,
        BoundKind::SpringSpeed => v1::TimeBound::SpringSpeed,
        BoundKind::Medium => v1::TimeBound::Medium,
        BoundKind::Acceptance => v1::TimeBound::Acceptance,
        BoundKind::Tolerance => v1::TimeBound::Tolerance,
    }
}

/// A bound that allows any step becomes the largest finite number.
fn snow(report: &SnowReport) -> v1::SnowDiagnostics {
    let [min_plastic_ratio, max_plastic_ratio] = report.plastic_ratio_range;

    v1::SnowDiagnostics {
        substeps: report.substeps,
        dt_seconds: report.dt,
        bound: bound(report.bound.kind).into(),
        bound_particle: report.bound.particle,
        bound_seconds: report.bound.dt.min(f64::MAX),
        mass: report.mass,
        grid_mass_error: report.grid_mass_error,
        plastic_count: report.plastic_count,
        inverted_count: report.inverted_count,
        clamped_count: report.clamped_count,
        ballistic_count: report.ballistic_count,
        min_plastic_ratio,
        max_plastic_ratio,
        max_speed: report.max_speed,
        dropped_momentum: report.dropped_momentum,
        angular_momentum: Some(report.angular_momentum.into()),
        block_count: report.block_count,
        torn_count: report.torn_count,
    }
}

/// Stages that took no time are left out.
fn stages(seconds: &StageSeconds) -> Vec<v1::StageTime> {
    let timed = Stage::ALL.iter().zip(seconds).filter(|(_, seconds)| **seconds > 0.0);
    timed
        .map(|(stage, seconds)| v1::StageTime { stage: stage.name().to_owned(), seconds: *seconds })
        .collect()
}

#[cfg(test)]
mod tests {
    use nappe_sim::report::Wake;

    use super::*;

    #[test]
    fn a_gap_that_no_pair_has_is_absent() {
        let none = SurfaceReport { crossings: Some(3), ..SurfaceReport::default() };
        assert_eq!(surface(&none), v1::SurfaceReport { crossings: Some(3), ..v1::SurfaceReport::default() });
        let some = SurfaceReport {
            pairs: 9,
            active: 4,
            rounds: 2,
            least_gap: 2e-3,
            failed: 1,
            crossings: None,
            yield_m: 0.017,
            yielding: 6,
            largest_push: 0.5,
        };
        let expected = v1::SurfaceReport {
            pairs: 9,
            active: 4,
            rounds: 2,
            least_gap_m: Some(2e-3),
            failed: 1,
            crossings: None,
            yield_m: 0.017,
            yielding: 6,
            largest_push_n: 0.5,
        };
        assert_eq!(surface(&some), expected);
    }

    #[test]
    fn what_lies_still_is_told_as_a_share_of_the_particles() {
        let report = RestReport {
            particles: 40,
            calm_particles: 10,
            pieces: 3,
            calm_pieces: 2,
            way: 0.25,
            change: 0.125,
            particles_asleep: 5,
            pieces_asleep: 1,
            told: 0.5,
            long_steps: 7,
            wakes: 4,
            wake: Some(Wake { step: 9, cause: WakeCause::Collider }),
        };
        let expected = v1::RestReport {
            calm_share: 0.25,
            pieces: 3,
            calm_pieces: 2,
            way_m: 0.25,
            change_m: 0.125,
            awake_share: 0.875,
            pieces_asleep: 1,
            told_m: 0.5,
            long_steps: 7,
            wakes: 4,
            wake_cause: Some(v1::WakeCause::Collider.into()),
        };
        assert_eq!(rest(&report), expected);
    }
}

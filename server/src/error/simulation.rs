//! Errors of the simulation as errors of the service.
//!
//! Enters: why a step failed, why a change was refused, or the file of a session. Leaves: a reason, or the whole error.

use nappe_proto::Reason;
use nappe_sim::{
    interrupt::Interrupted,
    math::number,
    report::StepFailure,
    world::{ChangeError, MoveError, PullError, allowed},
};

use super::service_error::ServiceError;
use crate::state::FileError;

/// The reason that stands for the failure of a step: that of its word.
pub(crate) fn step_reason(failure: &StepFailure) -> Reason {
    Reason::of(failure.reason()).expect("the word of each failure of a step is that of a reason")
}

impl From<Interrupted> for ServiceError {
    fn from(_: Interrupted) -> Self {
        Self::new(Reason::RequestCancelled, "the caller is gone: the session is not made")
    }
}

impl From<&FileError> for ServiceError {
    fn from(error: &FileError) -> Self {
        let refused =
            Self::new(Reason::InvalidCheckpoint, format!("the file of a session is refused: {error}"));
        match error {
            FileError::Section { section, .. } => refused.with("section", section),
            _ => refused,
        }
    }
}

/// A time of a path: its particle and point, and after which time it has to be.
fn of_time(error: ServiceError, [particle, point]: [usize; 2], [time, after]: [f64; 2]) -> ServiceError {
    let error = error.with("particle", particle).with("point", point).with("value", time);
    error.with("allowed", format!("above {}", number(after)))
}

/// What is allowed, both ends included.
fn range([low, high]: [f64; 2]) -> String {
    format!("{} to {}", number(low), number(high))
}

impl From<&ChangeError> for ServiceError {
    fn from(error: &ChangeError) -> Self {
        let message = error.to_string();
        let refused = Self::new(Reason::InvalidChange, &message);
        match error {
            ChangeError::OutOfRange { field, value, allowed } => refused
                .with("field", field)
                .with("value", value)
                .with("allowed", range(*allowed))
                .at_field(*field, format!("is {}: allowed are {}", number(*value), range(*allowed))),
            ChangeError::UnknownBody { name, known } => {
                refused.with("body", name).with("known", known).at_field("springs.body", message)
            }
            ChangeError::NoSuchSprings { body, kind } => {
                refused.with("body", body).with("kind", kind).at_field("springs.kind", message)
            }
            ChangeError::SnowHasNoSprings { name } => {
                refused.with("body", name).at_field("springs.body", message)
            }
            ChangeError::NoAir { body } => refused.with("body", body).at_field("air.body", message),
            ChangeError::SharedAir { body, others } => {
                refused.with("body", body).with("others", others).at_field("air.body", message)
            }
            ChangeError::NoneFeelsAir => refused.at_field("air", message),
            ChangeError::NoCloth => refused.at_field("springs", message),
            ChangeError::WrongCount { body, what, found, needed } => {
                counted(refused, body, [*found, *needed]).at_field(format!("states.{what}_f64"), message)
            }
            ChangeError::StateTwice { body, .. } => refused.with("body", body).at_field("states", message),
            ChangeError::StateRange { body, what, particle, value, allowed } => {
                of_particle(refused, (body, *particle), *value, *allowed)
                    .at_field(format!("states.{what}_f64"), message)
            }
            ChangeError::BeyondGrid { body, particle, value, reach } => {
                of_particle(refused, (body, *particle), *value, [-reach, *reach])
                    .at_field("states.positions_f64", message)
            }
            ChangeError::NotApart { bodies, particles, .. } => {
                of_meeting(refused, bodies, *particles, message)
            }
            ChangeError::ForceCount { body, found, needed } => {
                counted(refused, body, [*found, *needed]).at_field("forces.forces_f64", message)
            }
            ChangeError::ForceOnPin { body, particle } => refused
                .with("body", body)
                .with("particle", particle)
                .at_field("forces.particles_u32", message),
            ChangeError::NotInBody { body, particle, count } => refused
                .with("body", body)
                .with("particle", particle)
                .with("particle_count", count)
                .at_field("forces.particles_u32", message),
            ChangeError::OnFigure { figure: body, .. }
            | ChangeError::Attached { object: body, .. }
            | ChangeError::SnowOverRanks { body } => refused.with("body", body).at_field("body", message),
            ChangeError::NotPinned { particle } => {
                refused.with("particle", particle).at_field("pins.particle", message)
            }
            ChangeError::EmptyPath { particle } => {
                refused.with("particle", particle).at_field("paths.times_seconds", message)
            }
            ChangeError::TimesOfPath { particle, point, time, after } => {
                of_time(refused, [*particle as usize, *point], [*time, *after])
                    .at_field("paths.times_seconds", message)
            }
            ChangeError::NoSuchParticle { particle, count } => refused
                .with("particle", particle)
                .with("particle_count", count)
                .at_field("pins.particle", message),
            ChangeError::Pull(error) => of_pull(refused, error, message),
            ChangeError::Collider(error) => of_move(refused, error, message),
        }
    }
}

/// A value of a particle, and what is allowed.
fn of_particle(
    refused: ServiceError,
    (body, particle): (&str, usize),
    value: f64,
    allowed: [f64; 2],
) -> ServiceError {
    refused.with("body", body).with("particle", particle).with("value", value).with("allowed", range(allowed))
}

/// How many values a change has for a body, and how many it needs.
fn counted(refused: ServiceError, body: &str, [found, needed]: [usize; 2]) -> ServiceError {
    refused.with("body", body).with("found", found).with("allowed", needed)
}

/// Where surfaces of two bodies meet that have to be apart, at a particle of each.
fn of_meeting(
    refused: ServiceError,
    [body, other]: &[String; 2],
    [particle, other_particle]: [u32; 2],
    message: String,
) -> ServiceError {
    refused
        .with("body", body)
        .with("particle", particle)
        .with("other", other)
        .with("other_particle", other_particle)
        .at_field("states.positions_f64", message)
}

/// What is wrong with a pull.
fn of_pull(refused: ServiceError, error: &PullError, message: String) -> ServiceError {
    match error {
        PullError::OnSnow { body } => refused.with("body", body).at_field("pulls.body", message),
        PullError::Count { body, found, needed } => {
            counted(refused, body, [*found, *needed]).at_field("pulls.points_f64", message)
        }
        PullError::NotInBody { body, particle, count } => refused
            .with("body", body)
            .with("particle", particle)
            .with("particle_count", count)
            .at_field("pulls.particles_u32", message),
        PullError::OnPin { body, particle } => {
            refused.with("body", body).with("particle", particle).at_field("pulls.particles_u32", message)
        }
        PullError::TooMany { found, allowed } => {
            refused.with("found", found).with("allowed", allowed).at_field("pulls.points_f64", message)
        }
    }
}

/// What is wrong with the move of a collider.
fn of_move(refused: ServiceError, error: &MoveError, message: String) -> ServiceError {
    match error {
        MoveError::UnknownCollider { name, known } => {
            refused.with("collider", name).with("known", known).at_field("colliders.name", message)
        }
        MoveError::ColliderTwice { name } => {
            refused.with("collider", name).at_field("colliders.name", message)
        }
        MoveError::EmptyWay { name } => {
            refused.with("collider", name).at_field("collider_paths.times_seconds", message)
        }
        MoveError::TimesOfWay { name, key, time, after } => refused
            .with("collider", name)
            .with("point", key)
            .with("value", time)
            .with("allowed", format!("above {}", number(*after)))
            .at_field("collider_paths.times_seconds", message),
        MoveError::TurnLength { name, key, length } => refused
            .with("collider", name)
            .with("point", key)
            .with("value", length)
            .with("allowed", "1 within 1e-6")
            .at_field("colliders.turn", message),
        MoveError::SurfaceSpeed { name, key, speed } => refused
            .with("collider", name)
            .with("point", key)
            .with("value", speed)
            .with("allowed", format!("at most {}", number(allowed::SPEED[1])))
            .at_field("colliders.duration_seconds", message),
    }
}

#[cfg(test)]
mod tests {
    use nappe_sim::{linalg::Outcome, report::BoundKind};

    use super::*;

    #[test]
    fn every_failure_of_a_step_has_a_reason() {
        let failures = [
            StepFailure::NotFinite { particle: 0, quantity: "x".into(), value: f64::NAN },
            StepFailure::Collapsed { particle: 0, other: 1, value: 1e-9, rest_length: 1.0 },
            StepFailure::Stretch { particle: 0, other: 1, value: 2.0, limit: 1.0, pin: None },
            StepFailure::Energy { particle: 0, value: 2.0, limit: 1.0 },
            StepFailure::Solver { outcome: Outcome::Singular { iteration: 1 } },
            StepFailure::TimeStep { particle: 0, dt: 2.0, limit: 1.0, bound: BoundKind::ElasticWave },
            StepFailure::Substeps {
                particle: 0,
                dt: 2.0,
                limit: 1,
                bound: BoundKind::ElasticWave,
                law: None,
            },
            StepFailure::Descent { particle: 0, value: 0.0, predicted: 1.0, limit: 0.1 },
            StepFailure::EnergyGain { particle: 0, value: 2.0, limit: 1.0 },
            StepFailure::Unbalanced { particle: 0, value: 2.0, limit: 1.0, sweeps: 320 },
            StepFailure::Missed { particle: 0, value: 2.0, limit: 1.0, solves: 4 },
            StepFailure::Inaccurate { particle: 0, value: 2.0, limit: 1.0 },
            StepFailure::Passed { particle: 0, collider: "table".to_owned() },
            StepFailure::Contact { particles: [0, 1], gap: 1e-9, driven: None },
            StepFailure::Crowded { particle: 0, limit: 1 },
            StepFailure::PairMemory { bytes: 1 },
            StepFailure::NeverStable { particle: 0 },
            StepFailure::NodeSpeed { particle: 0, node: [0; 3], value: 2.0, limit: 1.0 },
            StepFailure::Deformation { particle: 0, value: 2.0, limit: 1.0 },
            StepFailure::OutOfRange { particle: 0, position: [2.0; 3], limit: 1.0 },
            StepFailure::GridMemory { particle: 0, position: [2.0; 3], bytes: 2, limit: 1 },
            StepFailure::Mass { expected: 2.0, found: 1.0 },
            StepFailure::Interrupted,
        ];
        for failure in failures {
            assert_eq!(step_reason(&failure).name(), failure.reason(), "{failure}");
        }
    }
}

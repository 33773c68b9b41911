//! What a step tells: diagnostics, time per stage, or the reason why it failed.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

mod stage;
mod task;
mod bound;
mod failure;
mod cloth;
mod snow;
mod load;
mod surface;
mod rest;
mod work;

pub use bound::{BoundKind, TimeBound};
pub use cloth::{ClothSteps, ErrorEstimate, Rejection};
pub use failure::{StepError, StepFailure};
pub use load::Load;
pub use rest::{RestReport, Wake, WakeCause};
pub use snow::SnowReport;
pub use stage::{NoStopwatch, Stage, StageClock, StageSeconds, Stopwatch};
pub use surface::SurfaceReport;
pub use task::Task;
pub use work::Work;

use crate::linalg::{Outcome, SolveReport, Stop};

/// Diagnostics of a state.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct Diagnostics {
    /// Kinetic energy of the free particles (J).
    pub kinetic_energy: f64,
    /// Elastic energy (J).
    pub elastic_energy: f64,
    /// Gravitational energy of the free particles (J), zero at the origin.
    pub gravitational_energy: f64,
    /// Linear momentum of the free particles (kg m/s).
    pub momentum: [f64; 3],
    /// Largest length over rest length of any spring; 0 without springs.
    pub max_stretch: f64,
    /// Work (J) that the air and given forces did in the step that led here; 0 of a state that no step led to.
    pub external_work: f64,
}

impl Diagnostics {
    /// These diagnostics and those of another body together.
    pub(crate) fn with(&self, other: &Self) -> Self {
        Self {
            kinetic_energy: self.kinetic_energy + other.kinetic_energy,
            elastic_energy: self.elastic_energy + other.elastic_energy,
            gravitational_energy: self.gravitational_energy + other.gravitational_energy,
            momentum: std::array::from_fn(|c| self.momentum[c] + other.momentum[c]),
            max_stretch: self.max_stretch.max(other.max_stretch),
            external_work: self.external_work + other.external_work,
        }
    }

    /// Kinetic, elastic and gravitational energy together (J).
    pub fn total_energy(&self) -> f64 {
        self.kinetic_energy + self.elastic_energy + self.gravitational_energy
    }
}

/// What a step reports.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
pub struct StepReport {
    /// Steps taken, this one included.
    pub step: u64,
    /// Simulated time (s).
    pub time: f64,
    /// Diagnostics of the new state, all bodies together.
    pub diagnostics: Diagnostics,
    /// Particles that touched a collider, each once per sub-step in which it did.
    pub contact_count: u64,
    /// What each collider felt, in the order of the setup; empty without colliders.
    pub loads: Arc<[Load]>,
    /// The linear solve with the largest residual among all bodies and their sub-steps, with the iterations that its
    /// body made in the step; none when all are explicit.
    pub solve: Option<SolveReport>,
    /// How all cloths were stepped together; none without cloth.
    pub cloth: Option<ClothSteps>,
    /// Sub-steps of the cloths that were not accepted and taken again, in their order.
    pub rejections: Vec<Rejection>,
    /// What kept the surfaces of cloth apart, all bodies together; none where no body has a thickness and nothing is counted.
    pub surface: Option<SurfaceReport>,
    /// How much of the cloth lies still; none where nothing is watched.
    pub rest: Option<RestReport>,
    /// Diagnostics of the snow; none without snow.
    pub snow: Option<SnowReport>,
    /// What the user should know although the step was taken.
    pub notices: Notices,
    /// What it cost, over all bodies, their sub-steps and what was rejected.
    pub work: Work,
}

/// What happened in a step that was taken, and makes its result doubtful. Particles are in the user's numbering, over
/// all bodies.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default, Serialize, Deserialize)]
pub struct Notices {
    /// Solves of cloth that ended at their iteration cap, above their tolerance.
    pub capped_solves: u32,
    /// Solves of cloth that met a curvature or a preconditioner that is not positive.
    pub indefinite_solves: u32,
    /// Particles, pins of cloth too, that went through a collider or into it, each once per sub-step in which it did.
    pub passed_count: u64,
    /// The first of them.
    pub first_passed: Option<u64>,
    /// Particles of cloth that the faces of a mesh collider leave no room: they end a sub-step nearer to it than its margin, by
    /// more than 1e-9 m, each once per sub-step in which it does.
    pub pinched_count: u64,
    /// The first of them.
    pub first_pinched: Option<u64>,
    /// Corners of figures that are farther than 1 mm off their frames at the end of a sub-step, each once per sub-step.
    pub yielding_count: u64,
    /// The first of them.
    pub first_yielding: Option<u64>,
    /// Particles of snow without plasticity that are stretched farther than the cells of the grid can bear, at the end of the step.
    pub torn_count: u64,
    /// The first of them.
    pub first_torn: Option<u64>,
}

impl Notices {
    /// These of one body or sub-step and those of another together.
    #[must_use]
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            capped_solves: self.capped_solves + other.capped_solves,
            indefinite_solves: self.indefinite_solves + other.indefinite_solves,
            passed_count: self.passed_count + other.passed_count,
            first_passed: self.first_passed.into_iter().chain(other.first_passed).min(),
            pinched_count: self.pinched_count + other.pinched_count,
            first_pinched: self.first_pinched.into_iter().chain(other.first_pinched).min(),
            yielding_count: self.yielding_count + other.yielding_count,
            first_yielding: self.first_yielding.into_iter().chain(other.first_yielding).min(),
            torn_count: self.torn_count + other.torn_count,
            first_torn: self.first_torn.into_iter().chain(other.first_torn).min(),
        }
    }

    /// Counts how a solve ended that was to stop so.
    pub(crate) fn count(&mut self, outcome: Outcome, stop: Stop) {
        match (outcome, stop) {
            (Outcome::IterationCap, Stop::Residual { .. }) => self.capped_solves += 1,
            (
                Outcome::NegativeCurvature { .. }
                | Outcome::ZeroCurvature { .. }
                | Outcome::IndefinitePreconditioner { .. },
                _,
            ) => self.indefinite_solves += 1,
            _ => {}
        }
    }
}

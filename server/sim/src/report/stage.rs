//! The stages of a step, and what measures them: by a clock that the caller brings.

use crate::names::names;

/// A stage of a step (Zara 2001, section 6, and those of snow).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub enum Stage {
    /// Evaluation of a state of cloth: forces of springs, gravity and the medium, for an implicit step its matrix too;
    /// with energies, momentum and stretch.
    Force,
    /// New velocities and positions of cloth.
    Position,
    /// Solving for the change of velocity.
    Solve,
    /// Particles of cloth that touch colliders.
    Collide,
    /// Snow: particles sorted by block and cell.
    Sort,
    /// Snow: weights, masses and momenta from particles to nodes, forces included.
    ParticlesToGrid,
    /// Snow: nodes' velocities, gravity and colliders.
    GridUpdate,
    /// Snow: velocities back to particles, elastic predictor, plastic return, positions.
    GridToParticles,
    /// Snow: energies, momentum and the checks on them.
    Diagnose,
}

names!(Stage {
    Force: "force",
    Position: "position",
    Solve: "solve",
    Collide: "collide",
    Sort: "sort",
    ParticlesToGrid: "particles_to_grid",
    GridUpdate: "grid_update",
    GridToParticles: "grid_to_particles",
    Diagnose: "diagnose",
});

/// Seconds in each stage, in the order of [`Stage::ALL`].
pub type StageSeconds = [f64; Stage::ALL.len()];

/// A clock that the caller brings: the library reads none.
pub trait Stopwatch {
    /// The time since the last call belongs to `stage`.
    fn lap(&mut self, stage: Stage);
}

/// The stopwatch of those who measure nothing.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoStopwatch;

impl Stopwatch for NoStopwatch {
    fn lap(&mut self, _: Stage) {}
}

/// The stopwatch of those who measure every stage, by what tells them the time (s).
#[derive(Clone, Copy, Debug)]
pub struct StageClock<F> {
    now: F,
    last: f64,
    /// What was measured until now.
    pub seconds: StageSeconds,
}

impl<F: FnMut() -> f64> StageClock<F> {
    /// Starts now; `now` is the time (s) since some moment.
    pub fn start(mut now: F) -> Self {
        let last = now();
        Self { now, last, seconds: StageSeconds::default() }
    }
}

impl<F: FnMut() -> f64> Stopwatch for StageClock<F> {
    fn lap(&mut self, stage: Stage) {
        let now = (self.now)();
        self.seconds[stage as usize] += now - self.last;
        self.last = now;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_stage_has_the_time_since_the_one_before() {
        let mut times = [10.0, 11.0, 13.0, 13.5].into_iter();
        let mut clock = StageClock::start(move || times.next().expect("a time per call"));
        for stage in [Stage::Force, Stage::Solve, Stage::Force] {
            clock.lap(stage);
        }
        let mut expected = StageSeconds::default();
        expected[Stage::Force as usize] = 1.5;
        expected[Stage::Solve as usize] = 2.0;
        assert_eq!(clock.seconds, expected);
    }

    #[test]
    fn stages_are_numbered_in_the_order_of_their_list() {
        for (place, stage) in Stage::ALL.into_iter().enumerate() {
            assert_eq!(stage as usize, place);
        }
    }
}

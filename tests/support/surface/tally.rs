//! What a run comes to: crossings after each step, steps that were taken again, rounds, gaps, speeds.

use nappe_sim::{
    math::Precision,
    report::{StepError, StepReport},
    world::{BodySetup, Change, Simulation, WorldSetup},
};

use super::bodies::built;
use crate::{
    Scene,
    crossings::crossings,
    scene::{positions, try_advance, velocities},
};

/// Steps between those after which crossings are counted apart from the program too.
const COUNTED: u64 = 10;

/// What the steps of a run told, and what was counted of their states.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tally {
    /// Steps of the world.
    pub steps: u64,
    /// Those that told of surfaces and counted crossings.
    pub told: u64,
    /// Sub-steps that were taken.
    pub substeps: u64,
    /// Sub-steps that were taken again shorter.
    pub rejected: u64,
    /// The most crossings that a step told of.
    pub crossings: u64,
    /// The most that were counted here.
    pub seen: u64,
    /// Rounds of each step, the most of its sub-steps, in sum.
    pub rounds: u64,
    /// The most pairs that pushed in a step.
    pub active: u64,
    /// Least distance (m) of a pair at the end of a sub-step.
    pub least_gap: f64,
    /// The most total energy (J) after a step.
    pub energy: f64,
}

impl Default for Tally {
    fn default() -> Self {
        Self {
            steps: 0,
            told: 0,
            substeps: 0,
            rejected: 0,
            crossings: 0,
            seen: 0,
            rounds: 0,
            active: 0,
            least_gap: f64::INFINITY,
            energy: f64::NEG_INFINITY,
        }
    }
}

impl Tally {
    fn add(&mut self, report: &StepReport) {
        self.steps += 1;
        if let Some(cloth) = report.cloth {
            self.substeps += u64::from(cloth.substeps);
            self.rejected += u64::from(cloth.rejected);
        }
        if let Some(surface) = report.surface {
            self.told += u64::from(surface.crossings.is_some());
            self.crossings = self.crossings.max(surface.crossings.unwrap_or(0));
            self.rounds += u64::from(surface.rounds);
            self.active = self.active.max(surface.active);
            self.least_gap = self.least_gap.min(surface.least_gap);
        }
        self.energy = self.energy.max(report.diagnostics.total_energy());
    }

    /// What this and another run come to together.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            steps: self.steps + other.steps,
            told: self.told + other.told,
            substeps: self.substeps + other.substeps,
            rejected: self.rejected + other.rejected,
            crossings: self.crossings.max(other.crossings),
            seen: self.seen.max(other.seen),
            rounds: self.rounds + other.rounds,
            active: self.active.max(other.active),
            least_gap: self.least_gap.min(other.least_gap),
            energy: self.energy.max(other.energy),
        }
    }

    /// What a run has that kept no surfaces apart as it should: crossings, steps that say nothing of them, no contact at all,
    /// or more than a twentieth of its sub-steps taken again.
    pub fn complaint(&self) -> Option<String> {
        let is_kept = self.crossings == 0 && self.seen == 0 && self.told == self.steps && self.active > 0;
        let is_smooth = 20 * self.rejected <= self.substeps + self.rejected;
        (!(is_kept && is_smooth)).then(|| format!("{self:?}"))
    }
}

/// A simulation whose steps are counted.
#[derive(Clone, Debug)]
pub struct Watched {
    /// As it is now.
    pub simulation: Simulation,
    /// What its steps came to.
    pub tally: Tally,
    triangles: Vec<[u32; 3]>,
    /// Those of them that are of figures, which may cross each other.
    of_figures: Vec<[u32; 3]>,
}

impl Watched {
    /// The simulation of a scene, which must be accepted.
    pub fn new(scene: &Scene, precision: Precision) -> Self {
        let simulation = scene.simulate(precision);
        let triangles = scene.network.triangles.clone();
        Self { simulation, tally: Tally::default(), triangles, of_figures: Vec::new() }
    }

    /// The simulation of a world, in which crossings of bodies with a thickness are counted.
    pub fn of_world(setup: &WorldSetup, precision: Precision) -> Self {
        let (mut triangles, mut of_figures, mut first) = (Vec::new(), Vec::new(), 0);
        for BodySetup { network, .. } in &setup.bodies {
            if network.thickness > 0.0 {
                let own = network.triangles.iter().map(|corners| corners.map(|corner| first + corner));
                triangles.extend(own.clone());
                of_figures.extend(own.filter(|_| network.is_figure()));
            }
            first += network.x.len() as u32;
        }
        Self { simulation: built(setup, precision), tally: Tally::default(), triangles, of_figures }
    }

    /// The same state in another scene of the same cloth, which has other pins.
    #[must_use]
    pub fn in_scene(self, scene: &Scene) -> Self {
        let mut simulation = scene.simulate(self.simulation.precision());
        let state = Change::State {
            body: "body".to_owned(),
            positions: positions(&self.simulation).into(),
            velocities: Some(velocities(&self.simulation).into()),
        };
        simulation.apply(&[state]).unwrap_or_else(|error| panic!("refused: {error}"));
        Self { simulation, ..self }
    }

    /// Takes a step.
    ///
    /// # Errors
    /// The failure of the step.
    pub fn step(&mut self) -> Result<StepReport, StepError> {
        let report = try_advance(&mut self.simulation, 1)?;
        self.tally.add(&report);
        if self.tally.steps.is_multiple_of(COUNTED) {
            self.count();
        }
        Ok(report)
    }

    /// Takes steps, which must all succeed, and counts crossings after the last one.
    pub fn go(&mut self, steps: u64) {
        for _ in 0..steps {
            self.step().unwrap_or_else(|error| panic!("{error}; so far {:?}", self.tally));
        }
        self.count();
    }

    fn count(&mut self) {
        let x = positions(&self.simulation);
        let seen = crossings(&self.triangles, &x) - crossings(&self.of_figures, &x);
        self.tally.seen = self.tally.seen.max(seen);
    }
}

/// Root of the mean square of speeds (m/s) of particles of these masses (kg), and of their vertical part.
pub fn speeds(simulation: &Simulation, masses: &[f64]) -> [f64; 2] {
    let (mut all, mut vertical) = (0.0, 0.0);
    for (v, m) in velocities(simulation).iter().zip(masses) {
        all += m * v.iter().map(|c| c * c).sum::<f64>();
        vertical += m * v[1] * v[1];
    }
    let mass = masses.iter().sum::<f64>();
    [all, vertical].map(|sum| (sum / mass).sqrt())
}

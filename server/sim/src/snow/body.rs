//! Snow as a body of a world: built from a setup, stepped, restored.

use super::{
    Integration, Kernel, SnowError, SnowSettings, SnowSetup, TimeStep, Transfer,
    bound::{Worst, smallest},
    diagnose::SnowSums,
    law::constitutive::Coefficients,
    particles::Particles,
    setup::check,
    step::{Engine, StepContext},
};
use crate::{
    collide::Collider,
    linalg::SolveReport,
    math::{Real, vec3},
    report::{BoundKind, Diagnostics, SnowReport, Stage, StepFailure, Stopwatch, TimeBound},
    surroundings::Surroundings,
};

/// What one step of the world tells of the snow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SnowStep {
    /// Energies and momentum of the new state.
    pub diagnostics: Diagnostics,
    /// Everything else.
    pub report: SnowReport,
    /// Nodes of the grid that touched a collider in the last step of the snow.
    pub contact_count: u64,
    /// The last linear solve of a semi-implicit run.
    pub solve: Option<SolveReport>,
}

/// Cells that a node may move in one step: more, and particles leave what the sorted order can follow.
const MOVE: f64 = 1.0;
/// Largest singular value of F_E: beyond it, binary32 could overflow in the next step.
const STRETCH: f64 = 1e3;
/// Largest relative difference between the mass on the grid and that of the particles.
const MASS_ERROR: f64 = 1e-3;

/// Snow: the particles of all objects on one grid.
#[derive(Debug)]
pub struct Snow<R: Real> {
    pub(super) names: Vec<(String, usize)>,
    pub(super) engine: Engine<R>,
    pub(super) mass: f64,
}

impl<R: Real> Snow<R> {
    /// Builds snow; the strings are remarks that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup.
    pub fn new(setup: &SnowSetup) -> Result<(Self, Vec<String>), SnowError> {
        let remarks = check(setup)?;
        let coefficients = setup.objects.iter().map(|object| Coefficients::of(&object.material)).collect();
        let mut engine = Engine::new(setup.settings, coefficients, particles(setup));
        engine.sort_anew();
        if let Some(failure) = engine.lost() {
            return Err(SnowError::Settings(failure.to_string()));
        }
        let from_grid: Vec<bool> = setup.objects.iter().map(|object| object.volume.is_empty()).collect();
        if from_grid.contains(&true) {
            engine.volumes_from_grid(&from_grid);
        }
        engine.renew_places();
        engine.sort_anew();
        engine.refresh();
        let names = setup.objects.iter().map(|object| (object.name.clone(), object.x.len())).collect();
        let mass = engine.sums([0.0; 3], &mut Vec::new()).mass;
        Ok((Self { names, engine, mass }, remarks))
    }

    /// Refuses a fixed step above the bound at the start.
    pub(crate) fn check_step(&self, colliders: &[Collider]) -> Result<(), SnowError> {
        let TimeStep::Fixed(dt) = self.settings().time_step else { return Ok(()) };
        let (kind, limit) = smallest(self.settings(), &self.engine.extremes, colliders);
        if dt <= limit {
            return Ok(());
        }
        let particle = self.culprit(kind).unwrap_or_default();
        let failure = StepFailure::TimeStep { particle, dt, limit, bound: kind.name() };
        Err(SnowError::Settings(failure.to_string()))
    }

    /// Advances by one step of the world, in as many steps of the snow as the bound asks for.
    ///
    /// # Errors
    /// When a step of the snow cannot be taken: particles are then as before that step.
    pub fn step(
        &mut self,
        around: &Surroundings<'_>,
        watch: &mut dyn Stopwatch,
    ) -> Result<SnowStep, StepFailure> {
        let end = around.time + around.dt;
        let (mut left, mut substeps, mut shorter) = (around.dt, 0, 1.0);
        let mut dt = 0.0;
        let (mut contacts, mut solve) = (0, None);
        while left > 0.0 {
            self.check_state()?;
            let steps = self.steps_left(left, shorter, substeps, around.colliders)?;
            dt = left / steps;
            let context = StepContext {
                dt,
                time: end - left + dt,
                gravity: around.gravity,
                colliders: around.colliders,
                last: steps <= 1.0,
            };
            let grid = self.engine.onto_grid(&context, watch);
            let moved = grid.speed2.sqrt() * dt / self.settings().cell;
            // Velocities that a solve follows are only where it begins.
            let limit = if self.engine.is_implicit() { f64::MAX } else { MOVE };
            if moved > limit || moved.is_nan() {
                (shorter, substeps) = (self.shortened(shorter, moved, grid.fastest)?, substeps + 1);
                continue;
            }
            let error = grid.mass / self.mass - 1.0;
            if error.abs() > MASS_ERROR {
                return Err(StepFailure::Mass { expected: self.mass, found: grid.mass });
            }
            let solved = self.engine.solve(&context, watch);
            let solved = solved.map_err(|outcome| StepFailure::Solver { outcome })?;
            solve = solved.or(solve);
            let (speed2, fastest) = if solved.is_some() { self.engine.fastest_node() } else { (0.0, [0; 3]) };
            let moved = speed2.sqrt() * dt / self.settings().cell;
            if moved > MOVE || moved.is_nan() {
                (shorter, substeps) = (self.shortened(shorter, moved, fastest)?, substeps + 1);
                continue;
            }
            self.engine.onto_particles(&context, watch);
            if let Some(failure) = self.engine.strayed.then(|| self.engine.lost()).flatten() {
                return Err(failure);
            }
            contacts = grid.contacts;
            shorter = 1.0;
            substeps += 1;
            left = if steps <= 1.0 { 0.0 } else { left - dt };
        }
        let mut partials = std::mem::take(&mut self.engine.partials);
        let sums = self.engine.sums(around.gravity, &mut partials);
        self.engine.partials = partials;
        let report = self.report(substeps, dt, &sums, around.colliders);
        watch.lap(Stage::Diagnose);
        self.judge(&sums)?;
        Ok(SnowStep { diagnostics: sums.diagnostics, report, contact_count: contacts, solve })
    }

    /// In how many equal steps the rest of the world's step is to be taken.
    fn steps_left(
        &self,
        left: f64,
        shorter: f64,
        taken: u32,
        colliders: &[Collider],
    ) -> Result<f64, StepFailure> {
        let settings = self.settings();
        let (kind, bound) = smallest(settings, &self.engine.extremes, colliders);
        let allowed = match settings.time_step {
            TimeStep::Certified { safety } => safety * bound * shorter,
            TimeStep::Fixed(dt) if dt > bound => {
                let particle = self.culprit(kind).unwrap_or_default();
                return Err(StepFailure::TimeStep { particle, dt, limit: bound, bound: kind.name() });
            }
            TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) => dt,
        };
        // A whole number of steps stays one when the quotient is rounded.
        let steps = (left / allowed - 1e-9).ceil().max(1.0);
        let limit = settings.max_substeps;
        if f64::from(taken) + steps > f64::from(limit) {
            let particle = self.culprit(kind).unwrap_or_default();
            return Err(StepFailure::Substeps { particle, dt: allowed, limit, bound: kind.name() });
        }
        Ok(steps)
    }

    /// Refuses to go on from a state that a step might make infinite.
    fn check_state(&self) -> Result<(), StepFailure> {
        let value = self.engine.extremes.stretch2.sqrt();
        if value <= STRETCH {
            return Ok(());
        }
        let particle = self.worst().stretched();
        Err(StepFailure::Deformation { particle, value, limit: STRETCH })
    }

    /// How much shorter the same step is to be taken again, since nothing has moved yet; a step that
    /// is fixed, or whose numbers are out of range, fails.
    fn shortened(&self, shorter: f64, moved: f64, node: [i32; 3]) -> Result<f64, StepFailure> {
        if moved.is_finite() && matches!(self.settings().time_step, TimeStep::Certified { .. }) {
            return Ok(shorter * 0.5 * MOVE / moved);
        }
        Err(self.node_failure(moved, node))
    }

    fn judge(&self, sums: &SnowSums) -> Result<(), StepFailure> {
        let value = sums.diagnostics.kinetic_energy + sums.diagnostics.elastic_energy;
        match self.settings().max_energy {
            Some(limit) if value > limit || value.is_nan() => {
                let particle = self.worst().fastest();
                Err(StepFailure::Energy { particle, value, limit })
            }
            _ => Ok(()),
        }
    }

    /// What made a node too fast, or not finite.
    fn node_failure(&self, moved: f64, node: [i32; 3]) -> StepFailure {
        self.engine.not_finite().unwrap_or_else(|| StepFailure::NodeSpeed {
            particle: self.worst().fastest(),
            node,
            value: moved,
            limit: MOVE,
        })
    }

    fn report(&self, substeps: u32, dt: f64, sums: &SnowSums, colliders: &[Collider]) -> SnowReport {
        let figures = &self.engine.figures;
        let count = |k: usize| figures.iter().map(|block| u64::from(block.counts[k])).sum();
        let (kind, bound) = smallest(self.settings(), &self.engine.extremes, colliders);
        let bound = match self.settings().time_step {
            TimeStep::Certified { safety } => self.bound(kind, safety * bound),
            TimeStep::Fixed(dt) | TimeStep::Unchecked(dt) => {
                TimeBound { kind: BoundKind::Fixed, dt, particle: None }
            }
        };
        SnowReport {
            substeps,
            dt,
            bound,
            mass: sums.mass,
            grid_mass_error: self.engine.grid_figures.mass / self.mass - 1.0,
            plastic_count: count(0),
            clamped_count: count(1),
            inverted_count: count(2),
            ballistic_count: count(3),
            plastic_ratio_range: figures
                .iter()
                .fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], block| {
                    [low.min(block.jp[0]), high.max(block.jp[1])]
                }),
            max_speed: self.engine.extremes.speed2.sqrt(),
            dropped_momentum: self.engine.grid_figures.dropped,
            angular_momentum: sums.angular_momentum,
            block_count: self.engine.grid.node_blocks.len() as u64,
        }
    }

    fn bound(&self, kind: BoundKind, dt: f64) -> TimeBound {
        TimeBound { kind, dt, particle: self.culprit(kind) }
    }

    /// The particle that sets a bound.
    fn culprit(&self, kind: BoundKind) -> Option<u64> {
        self.worst().of(kind)
    }

    fn worst(&self) -> Worst {
        self.engine.worst.unwrap_or_else(|| self.engine.worst_of_all())
    }

    /// How it is stepped.
    pub fn settings(&self) -> &SnowSettings {
        &self.engine.settings
    }

    /// Bytes in use by particles, order and grid.
    pub fn memory_bytes(&self) -> usize {
        let Engine { particles, sorter, grid, spare, first_nodes, .. } = &self.engine;
        particles.bytes()
            + sorter.bytes()
            + grid.bytes()
            + spare.capacity() * size_of::<[R; 4]>()
            + first_nodes.capacity() * 12
    }

    /// Figures of the state as it is.
    pub fn diagnose(&self, gravity: [f64; 3]) -> Diagnostics {
        self.engine.sums(gravity, &mut Vec::new()).diagnostics
    }
}

/// The particles of all objects, in the user's order.
fn particles<R: Real>(setup: &SnowSetup) -> Particles<R> {
    let mut particles = Particles::default();
    for (object, part) in setup.objects.iter().enumerate() {
        for i in 0..part.x.len() {
            let (x, v) = (vec3::<R>(part.x[i]), vec3::<R>(part.v[i]));
            particles.motion.push([[x.x, x.y, x.z, R::of(part.mass[i])], [v.x, v.y, v.z, R::one()]]);
            let volume = part.volume.get(i).copied().unwrap_or(1.0);
            let factor = part.stiffness.get(i).copied().unwrap_or(1.0);
            particles.fixed.push([R::of(volume), R::of(factor)]);
            particles.id.push(particles.id.len() as u32);
            particles.object.push(object as u16);
        }
    }
    particles.motion.shrink_to_fit();
    particles.fixed.shrink_to_fit();
    particles.id.shrink_to_fit();
    particles.object.shrink_to_fit();
    let count = particles.id.len();
    particles.shape = vec![[[R::zero(); 4]; 2]; count];
    particles.affine = particles.shape.clone();
    particles.stress = particles.shape.clone();
    let (zero, one) = (R::zero(), R::one());
    for at in 0..count {
        let identity = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
        particles.set_tensors(at, identity, [[zero; 3]; 3], [zero; 6]);
    }
    particles
}

/// Says why a kernel and a transfer do not go together.
pub(super) fn combination_fault(settings: &SnowSettings) -> Option<String> {
    let linear = settings.kernel == Kernel::Linear;
    if linear && !matches!(settings.transfer, Transfer::PicFlip(_)) {
        return Some("the linear kernel goes with pic_flip alone: its second moment is not constant".into());
    }
    if linear && matches!(settings.integration, Integration::SemiImplicit { .. }) {
        return Some("the linear kernel goes with explicit integration alone".into());
    }
    None
}

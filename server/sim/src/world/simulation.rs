//! A world in a precision chosen at run time.

use std::sync::Arc;

use super::{
    calls::{
        changes::{Change, ChangeError},
        rules::ChangeRules,
    },
    clock::{
        World,
        begin::{BeginError, Beginning},
        carried::Carried,
    },
    setup::{
        SetupError, WorldSetup,
        forces::CalledForces,
        parameters::WorldParameters,
        topology::{BodyTopology, StepBound},
    },
};
use crate::{
    collide::{Collider, Pose},
    field::Field,
    interrupt::Interrupt,
    math::{Precision, Real},
    parallel::{Communicator, Ranks},
    report::{Diagnostics, StepError, StepReport, Stopwatch},
    snow::{GridNode, ParticleState, Snow},
};

/// A simulation in the precision chosen at run time. A clone goes on with the same
/// bits, and gives up with the original.
#[derive(Clone, Debug)]
pub enum Simulation {
    /// State in binary32.
    F32(World<f32>),
    /// State in binary64.
    F64(World<f64>),
}

/// The same expression on the world of either precision.
macro_rules! on_world {
    ($simulation:expr, $world:ident => $body:expr) => {
        match $simulation {
            Simulation::F32($world) => $body,
            Simulation::F64($world) => $body,
        }
    };
}

impl Simulation {
    /// Builds a simulation; the strings are warnings that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup, and where.
    pub fn new(setup: &WorldSetup, precision: Precision) -> Result<(Self, Vec<String>), SetupError> {
        Ok(match precision {
            Precision::F32 => {
                let (world, warnings) = World::new(setup)?;
                (Self::F32(world), warnings)
            }
            Precision::F64 => {
                let (world, warnings) = World::new(setup)?;
                (Self::F64(world), warnings)
            }
        })
    }

    /// Builds the part of a simulation that one of several ranks steps: each has the whole setup, and computes some of its
    /// blocks. All ranks make the same calls in the same order; results have the bits of one.
    ///
    /// # Errors
    /// What is wrong with the setup, and where; what several ranks cannot step: semi-implicit snow, vertex block
    /// descent, an assembled matrix.
    pub fn over(
        setup: &WorldSetup,
        precision: Precision,
        communicator: Arc<dyn Communicator>,
    ) -> Result<(Self, Vec<String>), SetupError> {
        let ranks = Some(Ranks::new(communicator));
        Ok(match precision {
            Precision::F32 => {
                let (world, warnings) = World::over(setup, ranks)?;
                (Self::F32(world), warnings)
            }
            Precision::F64 => {
                let (world, warnings) = World::over(setup, ranks)?;
                (Self::F64(world), warnings)
            }
        })
    }

    /// Precision of the state.
    pub const fn precision(&self) -> Precision {
        match self {
            Self::F32(_) => Precision::F32,
            Self::F64(_) => Precision::F64,
        }
    }

    /// Time step (s).
    pub fn dt(&self) -> f64 {
        on_world!(self, world => world.dt())
    }

    /// Number of steps taken since the start.
    pub fn step_count(&self) -> u64 {
        on_world!(self, world => world.step_count())
    }

    /// Simulated time (s).
    pub fn time(&self) -> f64 {
        on_world!(self, world => world.time())
    }

    /// Number of particles of all bodies.
    pub fn particle_count(&self) -> usize {
        on_world!(self, world => world.particle_count())
    }

    /// Number of particles of snow: the last ones.
    pub fn snow_particle_count(&self) -> usize {
        on_world!(self, world => world.snow_particle_count())
    }

    /// Number of springs of all bodies.
    pub fn spring_count(&self) -> usize {
        on_world!(self, world => world.spring_count())
    }

    /// Takes one step, on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// When the step fails: cloths are then as before it, snow as after its last good step within it.
    pub fn step(&mut self, watch: &mut dyn Stopwatch) -> Result<StepReport, StepError> {
        on_world!(self, world => world.step(watch))
    }

    /// What asks a step in progress to give up; the step then fails with
    /// [`StepFailure::Interrupted`](crate::report::StepFailure::Interrupted).
    pub fn interrupt(&self) -> &Interrupt {
        on_world!(self, world => world.interrupt())
    }

    /// Diagnostics of the state as it is.
    pub fn diagnose(&self) -> Diagnostics {
        on_world!(self, world => world.diagnose())
    }

    /// Checks changes without applying them: by its rules, and by where bodies are now. Runs on the rayon pool that the caller
    /// installed.
    ///
    /// # Errors
    /// The first change that is refused; or where surfaces with a thickness would meet, after all of them.
    pub fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        on_world!(self, world => world.check(changes))
    }

    /// Applies changes, all or none, on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// As [`Self::check`].
    pub fn apply(&mut self, changes: &[Change]) -> Result<(), ChangeError> {
        on_world!(self, world => world.apply(changes))
    }

    /// Begins elsewhere than at the start of its setup, of which the changes before the first step were applied. Runs on the rayon
    /// pool that the caller installed.
    ///
    /// # Errors
    /// When it has snow, the particles are others or are where none may be, or the numbers are none that it tells. It is not to
    /// be stepped then.
    pub fn begin(&mut self, at: &Beginning) -> Result<(), BeginError> {
        on_world!(self, world => world.begin(at))
    }

    /// What further steps depend on beside the setup, the steps taken, positions and velocities: for a frame at which another
    /// simulation is to begin. Runs on the rayon pool that the caller installed.
    pub fn carried(&self) -> Carried {
        on_world!(self, world => world.carried())
    }

    /// Which changes it accepts.
    pub fn rules(&self) -> &Arc<ChangeRules> {
        on_world!(self, world => world.rules())
    }

    /// A copy that goes on from here with the same bits, and that nobody has asked to give up.
    #[must_use]
    pub fn fork(&self) -> Self {
        let mut copy = self.clone();
        on_world!(&mut copy, world => world.interrupt = Interrupt::default());
        copy
    }

    /// Parameters as they are now.
    pub fn parameters(&self) -> WorldParameters {
        on_world!(self, world => world.parameters())
    }

    /// Forces that calls have set on each body on which any acts, in the order of their particles. They list `most` particles in
    /// all; what is more is left out by whole bodies.
    pub fn called_forces(&self, most: usize) -> Vec<CalledForces> {
        on_world!(self, world => world.called_forces(most))
    }

    /// Writes a field over `out`, in the user's numbering: exact in `f64`, rounded in `f32`. Forces and accelerations are
    /// evaluated for it, on the rayon pool that the caller installed.
    ///
    /// # Panics
    /// Unless `out` has [`Field::width`] numbers per particle; for what is evaluated, where several ranks step the simulation.
    pub fn read<T: Real>(&self, field: Field, out: &mut [T]) {
        on_world!(self, world => world.read(field, out));
    }

    /// Hash (XXH3, 64 bits) of all on which further steps depend: steps, parameters, and of each particle its number and
    /// its exact state, in any order. Runs on the rayon pool that the caller installed.
    pub fn state_hash(&self) -> u64 {
        on_world!(self, world => world.state_hash())
    }

    /// What frames refer to.
    pub fn topology(&self) -> Vec<BodyTopology> {
        on_world!(self, world => world.topology())
    }

    /// What particles hit.
    pub fn colliders(&self) -> &[Collider] {
        on_world!(self, world => world.colliders())
    }

    /// The pose that a collider has now, by its index in the setup.
    ///
    /// # Panics
    /// If there are not so many colliders.
    pub fn collider_pose(&self, index: usize) -> Pose {
        on_world!(self, world => world.collider_pose(index))
    }

    /// Velocity (m/s) of the medium, as it is now.
    pub fn wind(&self) -> [f64; 3] {
        on_world!(self, world => world.wind())
    }

    /// Largest explicit steps, one per cloth, and one for all bodies with a thickness.
    pub fn step_bounds(&self) -> Vec<StepBound> {
        on_world!(self, world => world.step_bounds())
    }

    /// Side of the snow's cells (m); none without snow.
    pub fn snow_cell(&self) -> Option<f64> {
        on_world!(self, world => world.snow().map(|snow| snow.settings().cell))
    }

    /// Bytes that the snow's particles, order and grid take; 0 without snow.
    pub fn snow_memory_bytes(&self) -> usize {
        on_world!(self, world => world.snow().map_or(0, Snow::memory_bytes))
    }

    /// Bytes of what changes have given it: ways of colliders, also those of the scene, ways of pins, forces, and pulls.
    pub fn changed_memory_bytes(&self) -> usize {
        on_world!(self, world => world.changed_bytes())
    }

    /// Bytes that the pairs of surfaces that may meet take, as the last step left them; 0 without a thickness.
    pub fn pair_memory_bytes(&self) -> usize {
        on_world!(self, world => world.pair_bytes())
    }

    /// Lets the pairs of surfaces that may meet take so many bytes from now on; at first they take what they need. A step for which that is not enough
    /// fails with [`StepFailure::PairMemory`](crate::report::StepFailure::PairMemory), and can be taken again with more.
    pub fn limit_pair_memory(&mut self, bytes: u64) {
        on_world!(self, world => world.limit_pairs(bytes));
    }

    /// Nodes of the snow's grid with mass, as the last step left them; empty before the first and
    /// without snow. Clears `out` first.
    pub fn grid_nodes(&self, out: &mut Vec<GridNode>) {
        out.clear();
        on_world!(self, world => world.snow().into_iter().for_each(|snow| snow.grid_nodes(out)));
    }

    /// The force of the stress (N) on each of the nodes of [`Self::grid_nodes`], at the state as it is; 0 on those that no
    /// particle reaches any more. Runs on the rayon pool that the caller installed.
    ///
    /// # Panics
    /// When several ranks have begun to step it.
    pub fn grid_forces(&self) -> Vec<[f64; 3]> {
        on_world!(self, world => world.snow().map_or_else(Vec::new, Snow::grid_forces))
    }

    /// Particles of the snow, in the user's numbering of the snow; empty without snow.
    pub fn snow_particles(&self) -> Vec<ParticleState> {
        on_world!(self, world => world.snow().map_or_else(Vec::new, Snow::particles))
    }

    /// Puts particles in place of those of the snow.
    ///
    /// # Panics
    /// When there are more or fewer than the snow has.
    pub fn restore_snow(&mut self, particles: &[ParticleState]) {
        on_world!(self, world => world.snow_mut().into_iter().for_each(|snow| snow.restore(particles)));
    }

    /// Adds `dv(particle, x, v)` (m/s) to the velocity of each particle of the snow: what a body
    /// force does in one step. Particles are in the user's numbering of the snow.
    pub fn kick_snow(&mut self, dv: impl Fn(u32, [f64; 3], [f64; 3]) -> [f64; 3] + Sync) {
        on_world!(self, world => world.snow_mut().into_iter().for_each(|snow| snow.kick(&dv)));
    }
}

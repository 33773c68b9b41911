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
    report::{Diagnostics, StepError, StepReport, Stopwatch, Task},
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

/// Methods that are those of the world of either precision.
macro_rules! of_world {
    ($($(#[$about:meta])* fn $name:ident($($argument:ident: $kind:ty),*) -> $given:ty;)+) => {
        impl Simulation {
            $(
                $(#[$about])*
                pub fn $name(&self, $($argument: $kind),*) -> $given {
                    on_world!(self, world => world.$name($($argument),*))
                }
            )+
        }
    };
}

of_world! {
    /// Time step (s).
    fn dt() -> f64;

    /// Number of steps taken since the start.
    fn step_count() -> u64;

    /// Simulated time (s).
    fn time() -> f64;

    /// Number of particles of all bodies.
    fn particle_count() -> usize;

    /// Number of particles of snow: the last ones.
    fn snow_particle_count() -> usize;

    /// Number of springs of all bodies.
    fn spring_count() -> usize;

    /// What asks a step in progress to give up; the step then fails with
    /// [`StepFailure::Interrupted`](crate::report::StepFailure::Interrupted).
    fn interrupt() -> &Interrupt;

    /// Diagnostics of the state as it is.
    fn diagnose() -> Diagnostics;

    /// Checks changes without applying them: by its rules, and by where bodies are now. Runs on the rayon pool that the caller
    /// installed.
    ///
    /// # Errors
    /// The first change that is refused; or where surfaces with a thickness would meet, after all of them.
    fn check(changes: &[Change]) -> Result<(), ChangeError>;

    /// What further steps depend on beside the setup, the steps taken, positions and velocities: for a frame at which another
    /// simulation is to begin. Runs on the rayon pool that the caller installed.
    fn carried() -> Carried;

    /// Which changes it accepts.
    fn rules() -> &Arc<ChangeRules>;

    /// Parameters as they are now.
    fn parameters() -> WorldParameters;

    /// Forces that calls have set on each body on which any acts, in the order of their particles. They list `most` particles in
    /// all; what is more is left out by whole bodies.
    fn called_forces(most: usize) -> Vec<CalledForces>;

    /// Hash (XXH3, 64 bits) of all on which further steps depend: steps, parameters, and of each particle its number and
    /// its exact state, in any order. Runs on the rayon pool that the caller installed.
    fn state_hash() -> u64;

    /// What frames refer to.
    fn topology() -> Vec<BodyTopology>;

    /// What particles hit.
    fn colliders() -> &[Collider];

    /// The pose that a collider has now, by its index in the setup.
    ///
    /// # Panics
    /// If there are not so many colliders.
    fn collider_pose(index: usize) -> Pose;

    /// Velocity (m/s) of the medium, as it is now.
    fn wind() -> [f64; 3];

    /// Largest explicit steps, one per cloth, and one for all bodies with a thickness.
    fn step_bounds() -> Vec<StepBound>;
}

impl Simulation {
    /// Builds a simulation; the strings are warnings that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup, and where.
    pub fn new(setup: &WorldSetup, precision: Precision) -> Result<(Self, Vec<String>), SetupError> {
        Self::made(setup, precision, None)
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
        Self::made(setup, precision, Some(Ranks::new(communicator)))
    }

    fn made(
        setup: &WorldSetup,
        precision: Precision,
        ranks: Option<Ranks>,
    ) -> Result<(Self, Vec<String>), SetupError> {
        match precision {
            Precision::F32 => World::new(setup, ranks).map(|(world, notes)| (Self::F32(world), notes)),
            Precision::F64 => World::new(setup, ranks).map(|(world, notes)| (Self::F64(world), notes)),
        }
    }

    /// Precision of the state.
    pub const fn precision(&self) -> Precision {
        match self {
            Self::F32(_) => Precision::F32,
            Self::F64(_) => Precision::F64,
        }
    }

    /// Takes one step, on the rayon pool that the caller installed.
    ///
    /// # Errors
    /// When the step fails: cloths are then as before it, snow as after its last good step within it.
    pub fn step(&mut self, watch: &mut dyn Stopwatch) -> Result<StepReport, StepError> {
        on_world!(self, world => world.step(watch))
    }

    /// Does the tasks of a step of each cloth by itself, at the state as it is, and calls `watch` with each once it is done: to be
    /// timed one by one, on the rayon pool that the caller installed. A step does several of them in one sweep, and does not
    /// call this.
    pub fn tasks(&self, watch: &mut dyn FnMut(Task)) {
        on_world!(self, world => world.tasks(watch));
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

    /// A copy that goes on from here with the same bits, and that nobody has asked to give up.
    #[must_use]
    pub fn fork(&self) -> Self {
        let mut copy = self.clone();
        on_world!(&mut copy, world => world.interrupt = Interrupt::default());
        copy
    }

    /// Writes a field over `out`, in the user's numbering: exact in `f64`, rounded in `f32`. Forces and accelerations are
    /// evaluated for it, on the rayon pool that the caller installed.
    ///
    /// # Panics
    /// Unless `out` has [`Field::width`] numbers per particle; for what is evaluated, where several ranks step the simulation.
    pub fn read<T: Real>(&self, field: Field, out: &mut [T]) {
        on_world!(self, world => world.read(field, out));
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

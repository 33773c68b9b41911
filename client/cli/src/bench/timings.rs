//! The same simulation timed on several thread counts, one step each in turn. Whatever else the machine does
//! disturbs all of them alike, so that their ratios mean something.
//!
//! Reads a world and thread counts; writes a [`Timing`] of each, all of which end in the same state.

use std::time::Instant;

use nappe_sim::{
    math::Precision,
    report::{StageClock, Task},
    world::{Simulation, WorldSetup},
};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::sample::{self, Sample};
use crate::words::{
    error::{CliError, Exit, Result},
    output,
};

/// Hashes that are timed.
const HASHES: usize = 5;

/// How many steps each thread count takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct StepCounts {
    /// Steps that are not timed: the first allocates and fills the caches.
    pub(crate) warm_up: usize,
    /// Steps that are timed.
    pub(crate) timed: usize,
}

/// What was measured on one thread count.
#[derive(Debug)]
pub(crate) struct Timing {
    /// Number of threads.
    pub(crate) threads: usize,
    /// The timed steps, in order.
    pub(crate) samples: Vec<Sample>,
    /// Hash of the state at the end; the same for every thread count.
    pub(crate) state_hash: u64,
    /// Seconds of that hash on these threads, the fastest of [`HASHES`].
    pub(crate) hash_seconds: f64,
    /// Memory of the snow at the end (bytes), its grid included; 0 without snow.
    pub(crate) snow_bytes: usize,
}

/// Seconds of each task of a step, in the order of [`Task::ALL`].
pub(crate) type TaskSeconds = [f64; Task::ALL.len()];

/// A simulation and the threads that step it.
struct Runner {
    pool: ThreadPool,
    simulation: Simulation,
    samples: Vec<Sample>,
}

/// Times the world on each of the thread counts and checks that all end in the same state.
///
/// # Errors
/// When threads cannot be started, when the simulation diverges, or when two thread counts end in
/// different states: results must not depend on the number of threads.
pub(crate) fn measure(
    setup: &WorldSetup,
    precision: Precision,
    threads: &[usize],
    steps: StepCounts,
) -> Result<Vec<Timing>> {
    finish(stepped(setup, precision, threads, steps)?)
}

/// The same, and each task of a step by itself at the state in the end, as often as steps are timed.
///
/// # Errors
/// As [`measure`].
pub(crate) fn measure_with_tasks(
    setup: &WorldSetup,
    precision: Precision,
    threads: &[usize],
    steps: StepCounts,
) -> Result<Vec<(Timing, Vec<TaskSeconds>)>> {
    let runners = stepped(setup, precision, threads, steps)?;
    let mut tasks = vec![Vec::new(); runners.len()];
    for repetition in 0..=steps.timed {
        for (runner, tasks) in runners.iter().zip(&mut tasks) {
            let seconds = runner.tasks();
            // The first ones fill the caches.
            if repetition > 0 {
                tasks.push(seconds);
            }
        }
    }
    Ok(finish(runners)?.into_iter().zip(tasks).collect())
}

/// Simulations that took their steps, one step each in turn.
fn stepped(
    setup: &WorldSetup,
    precision: Precision,
    threads: &[usize],
    steps: StepCounts,
) -> Result<Vec<Runner>> {
    let mut runners = threads.iter().map(|&n| runner(setup, precision, n)).collect::<Result<Vec<_>>>()?;
    for step in 0..steps.warm_up + steps.timed {
        for runner in &mut runners {
            let sample = runner.step()?;
            if step >= steps.warm_up {
                runner.samples.push(sample);
            }
        }
    }
    Ok(runners)
}

/// What was measured, of simulations that ended in the same state.
fn finish(runners: Vec<Runner>) -> Result<Vec<Timing>> {
    let timings: Vec<Timing> = runners.into_iter().map(Runner::finish).collect();
    let first = &timings[0];
    if let Some(other) = timings.iter().find(|timing| timing.state_hash != first.state_hash) {
        return Err(CliError::failure(format!(
            "{} and {} threads ended in different states ({:016x} and {:016x}): the results depend on the number of threads",
            first.threads, other.threads, first.state_hash, other.state_hash,
        ))
        .hint("this is an error in nappe; please report it with this line"));
    }
    Ok(timings)
}

/// Builds the simulation.
///
/// # Errors
/// When the simulation refuses the world, which would be an error in this program.
pub(crate) fn build(setup: &WorldSetup, precision: Precision) -> Result<Simulation> {
    let (simulation, _warnings) = Simulation::new(setup, precision)
        .map_err(|error| CliError::failure(format!("cannot build the world to be timed: {error}")))?;
    Ok(simulation)
}

fn runner(setup: &WorldSetup, precision: Precision, threads: usize) -> Result<Runner> {
    let pool = ThreadPoolBuilder::new().num_threads(threads).build().map_err(|error| {
        let threads = output::several(threads as u64, "thread");
        CliError::failure(format!("cannot start {threads}: {error}"))
    })?;
    Ok(Runner { pool, simulation: build(setup, precision)?, samples: Vec::new() })
}

impl Runner {
    fn step(&mut self) -> Result<Sample> {
        let Self { pool, simulation, .. } = self;
        pool.install(|| {
            let begin = Instant::now();
            let mut clock = StageClock::start(|| begin.elapsed().as_secs_f64());
            let report = simulation.step(&mut clock).map_err(|error| {
                CliError::new(Exit::Diverged, format!("the timed simulation diverged: {error}"))
            })?;
            Ok(Sample::new(&report, begin.elapsed().as_secs_f64(), clock.seconds))
        })
    }

    /// Times each task of a step by itself.
    fn tasks(&self) -> TaskSeconds {
        self.pool.install(|| {
            let (mut seconds, mut last) = (TaskSeconds::default(), Instant::now());
            self.simulation.tasks(&mut |task| {
                let now = Instant::now();
                seconds[task as usize] += now.duration_since(last).as_secs_f64();
                last = now;
            });
            seconds
        })
    }

    fn finish(self) -> Timing {
        let hash = || {
            let begin = Instant::now();
            let hash = self.pool.install(|| self.simulation.state_hash());
            (hash, begin.elapsed().as_secs_f64())
        };
        let hashes: Vec<_> = (0..HASHES).map(|_| hash()).collect();
        Timing {
            threads: self.pool.current_num_threads(),
            samples: self.samples,
            state_hash: hashes[0].0,
            hash_seconds: sample::minimum(hashes.iter().map(|(_, seconds)| *seconds)),
            snow_bytes: self.simulation.snow_memory_bytes(),
        }
    }
}

//! The same simulation on several thread counts, one step each in turn, so that whatever else the
//! machine does disturbs all of them alike and their ratios mean something.

use nappe_sim::{
    math::Precision,
    snow::Snow,
    world::{Simulation, WorldSetup},
};
use rayon::{ThreadPool, ThreadPoolBuilder};

use super::sample::{Sample, StageClock};
use crate::error::{CliError, Exit, Result};

/// How often each lane steps.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Laps {
    /// Steps that are not counted: the first allocates and fills the caches.
    pub(crate) warm_up: usize,
    /// Steps that are.
    pub(crate) counted: usize,
}

/// What a thread count came to.
#[derive(Debug)]
pub(crate) struct Lane {
    /// Threads.
    pub(crate) threads: usize,
    /// Counted steps.
    pub(crate) samples: Vec<Sample>,
    /// Hash of the state at the end; the same for every lane.
    pub(crate) state_hash: u64,
    /// Memory of the snow at the end (bytes), its grid included; 0 without snow.
    pub(crate) snow_bytes: usize,
}

struct Runner {
    pool: ThreadPool,
    simulation: Simulation,
    samples: Vec<Sample>,
}

/// Runs the world on each of the thread counts and checks that all end in the same state.
///
/// # Errors
/// When threads cannot be started, when the simulation diverges, or when two thread counts end in
/// different states: results must not depend on the number of threads.
pub(crate) fn race(
    setup: &WorldSetup,
    precision: Precision,
    threads: &[usize],
    laps: Laps,
) -> Result<Vec<Lane>> {
    let mut runners = threads.iter().map(|&n| runner(setup, precision, n)).collect::<Result<Vec<_>>>()?;
    for lap in 0..laps.warm_up + laps.counted {
        for runner in &mut runners {
            let sample = runner.step()?;
            if lap >= laps.warm_up {
                runner.samples.push(sample);
            }
        }
    }
    let lanes: Vec<Lane> = runners.into_iter().map(Runner::finish).collect();
    if let Some(odd) = lanes.iter().find(|lane| lane.state_hash != lanes[0].state_hash) {
        return Err(CliError::failure(format!(
            "{} and {} threads ended in different states ({:016x} and {:016x}): the results depend on the number of threads",
            lanes[0].threads, odd.threads, lanes[0].state_hash, odd.state_hash,
        ))
        .hint("this is a fault of nappe; please report it with this line"));
    }
    Ok(lanes)
}

/// Builds the simulation.
///
/// # Errors
/// When the simulation refuses the world, which would be a fault of this program.
pub(crate) fn build(setup: &WorldSetup, precision: Precision) -> Result<Simulation> {
    let (simulation, _remarks) = Simulation::new(setup, precision)
        .map_err(|error| CliError::failure(format!("cannot build the world to be timed: {error}")))?;
    Ok(simulation)
}

fn runner(setup: &WorldSetup, precision: Precision, threads: usize) -> Result<Runner> {
    let pool = ThreadPoolBuilder::new()
        .num_threads(threads)
        .build()
        .map_err(|error| CliError::failure(format!("cannot start {threads} threads: {error}")))?;
    Ok(Runner { pool, simulation: build(setup, precision)?, samples: Vec::new() })
}

impl Runner {
    fn step(&mut self) -> Result<Sample> {
        let Self { pool, simulation, .. } = self;
        pool.install(|| {
            let mut clock = StageClock::start();
            let report = simulation.step(&mut clock).map_err(|error| {
                CliError::new(Exit::Diverged, format!("the timed simulation diverged: {error}"))
            })?;
            Ok(clock.stop(&report))
        })
    }

    fn finish(self) -> Lane {
        Lane {
            threads: self.pool.current_num_threads(),
            samples: self.samples,
            state_hash: self.simulation.state_hash(),
            snow_bytes: match &self.simulation {
                Simulation::F32(world) => world.snow().map_or(0, Snow::memory_bytes),
                Simulation::F64(world) => world.snow().map_or(0, Snow::memory_bytes),
            },
        }
    }
}

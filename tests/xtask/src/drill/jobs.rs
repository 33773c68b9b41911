//! Jobs of ranks that are killed at random times, from before their greeting on: no process and no file is left.

use std::{
    collections::BTreeSet,
    ffi::OsString,
    fs,
    path::Path,
    process::{Child, Stdio},
    thread,
    time::Duration,
};

use super::{
    job::{Job, OPTIONS, RANKS, SCENE, ranks},
    random::Random,
    server::{Server, signal, until},
};
use crate::shell::Failure;

const JOBS: usize = 50;
/// A job is killed at most so long after its launcher was seen (s): ranks take some tenths of a second to start.
const OLDEST: f64 = 1.5;
const SEED: u64 = 2;
/// Where Linux has files that are memory.
const SHARED_MEMORY: &str = "/dev/shm";

/// What is killed of a job.
#[derive(Clone, Copy, Debug)]
enum Victim {
    Launcher,
    /// One of its ranks; its launcher as long as there are none.
    Rank,
    /// The server that started it.
    Server,
}

/// Of five jobs, what is killed.
const VICTIMS: [Victim; 5] = [Victim::Launcher, Victim::Rank, Victim::Launcher, Victim::Rank, Victim::Server];

/// Kills jobs one after the other.
pub(super) fn run(target: &Path) -> Result<(), Failure> {
    let before = shared_memory();
    let mut random = Random::new(SEED);
    let mut server = Server::start(target, &OPTIONS)?;
    for number in 0..JOBS {
        let victim = VICTIMS[number % VICTIMS.len()];
        let age = Duration::from_secs_f64(OLDEST * random.share());
        println!("job {number}: {victim:?} after {:.2} s", age.as_secs_f64());
        let (job, mut creates) = begin(&server, &format!("killed-{number}"))?;
        thread::sleep(age);
        kill(victim, &job, &mut server, &mut random);

        creates.wait().map_err(|error| Failure(format!("nappe create: {error}")))?;
        until("nothing of the job is left", || Ok(job.is_gone()))?;
        until("nothing is left among temporary files", || server.has_left_nothing())?;
        if matches!(victim, Victim::Server) {
            server = Server::start(target, &OPTIONS)?;
        } else {
            // It is there if it was made in time.
            let _ = server.call(&["delete", &format!("killed-{number}")]);
        }
    }
    server.end()?;
    // Jobs of others come and go.
    let left: Vec<OsString> = shared_memory().difference(&before).cloned().collect();
    until("nothing of the jobs is left in /dev/shm", || {
        Ok(!left.iter().any(|name| Path::new(SHARED_MEMORY).join(name).exists()))
    })?;
    println!("{JOBS} jobs were killed, and nothing is left of them");
    Ok(())
}

/// Has a session with ranks made, and waits for its launcher; with who makes it.
fn begin(server: &Server, id: &str) -> Result<(Job, Child), Failure> {
    let scene = server.write_scene(SCENE)?;
    let mut creates = server.command(&["create", &scene, "--id", id, "--ranks", RANKS]);
    creates.stdout(Stdio::null()).stderr(Stdio::null());
    let creates = creates.spawn().map_err(|error| Failure(format!("nappe create: {error}")))?;
    let mut job = None;
    until("the server starts a launcher", || {
        job = Job::below(server.id());
        Ok(job.is_some())
    })?;
    let job = job.ok_or_else(|| Failure("the server started no launcher".to_owned()))?;
    Ok((job, creates))
}

fn kill(victim: Victim, job: &Job, server: &mut Server, random: &mut Random) {
    let ranks = ranks(server.id());
    match victim {
        Victim::Server => server.kill(),
        Victim::Rank if !ranks.is_empty() => signal("KILL", ranks[random.below(ranks.len())]),
        Victim::Rank | Victim::Launcher => signal("KILL", job.launcher),
    }
}

fn shared_memory() -> BTreeSet<OsString> {
    let files = fs::read_dir(SHARED_MEMORY).into_iter().flatten();
    files.filter_map(|entry| Some(entry.ok()?.file_name())).collect()
}

//! Stops of a server, of a launcher and of its ranks, as by Ctrl-Z or a debugger, each alone: their session has the bits of an
//! undisturbed one.

use std::{path::Path, thread, time::Duration};

use super::{
    job::{Job, OPTIONS, RANKS, SCENE, ranks},
    random::Random,
    server::{Server, hash, signal, step, until},
};
use crate::shell::Failure;

const STOPS: usize = 40;
/// The shortest stop (s), and how many times as long the longest is: 10 s.
const SHORTEST: f64 = 0.05;
const RANGE: f64 = 200.0;
const SEED: u64 = 1;

/// Stops processes of a server one after the other.
pub(super) fn run(target: &Path) -> Result<(), Failure> {
    let server = Server::start(target, &OPTIONS)?;
    let drilled = drill(&server);
    let ended = server.end();
    drilled.and(ended)
}

fn drill(server: &Server) -> Result<(), Failure> {
    let scene = server.write_scene(SCENE)?;
    server.call(&["create", &scene, "--id", "stopped", "--ranks", RANKS])?;
    // At the pace of a clock, so that it can be repeated in less time.
    server.call(&["play", "stopped", "--real-time-factor", "1"])?;
    let job = Job::below(server.id()).ok_or_else(|| Failure("the server started no launcher".to_owned()))?;
    let processes = [vec![server.id(), job.launcher], ranks(server.id())].concat();
    if processes.len() != 5 {
        return Err(Failure(format!("not a server, a launcher and {RANKS} ranks: {processes:?}")));
    }
    let mut random = Random::new(SEED);
    for number in 0..STOPS {
        let process = processes[number % processes.len()];
        let seconds = SHORTEST * RANGE.powf(random.share());
        println!("stop {number}: process {process}, {seconds:.2} s");
        signal("STOP", process);
        thread::sleep(Duration::from_secs_f64(seconds));
        signal("CONT", process);
        goes_on(server)?;
    }
    server.call(&["pause", "stopped"])?;
    let stopped = server.call(&["step", "stopped", "1", "--json"])?;
    compare(server, &scene, &stopped)?;
    server.call(&["delete", "stopped"])?;
    until("nothing of the job is left", || Ok(job.is_gone()))
}

/// Waits until the only session takes steps.
fn goes_on(server: &Server) -> Result<(), Failure> {
    let before = taken(server)?;
    until("the session goes on", || Ok(taken(server)? > before))
}

/// The steps that the only session has taken, while it plays.
fn taken(server: &Server) -> Result<u64, Failure> {
    let said = server.call(&["list", "--json"])?;
    let is_playing = said.contains("\"state\":\"playing\"");
    step(&said).filter(|_| is_playing).ok_or_else(|| Failure(format!("the session does not play: {said}")))
}

/// Compares what a session said after its last step with an undisturbed one, which the server steps by itself.
fn compare(server: &Server, scene: &str, stopped: &str) -> Result<(), Failure> {
    let steps = step(stopped).ok_or_else(|| Failure(format!("a session says no step: {stopped}")))?;
    server.call(&["create", scene, "--id", "undisturbed"])?;
    let undisturbed = server.call(&["step", "undisturbed", &steps.to_string(), "--json"])?;
    if step(&undisturbed) != Some(steps) || hash(stopped).is_none() || hash(stopped) != hash(&undisturbed) {
        return Err(Failure(format!("another hash after stops than without: {stopped}, {undisturbed}")));
    }
    println!("{STOPS} stops, {steps} steps, the same bits");
    Ok(())
}

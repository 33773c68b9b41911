//! Servers, launchers and ranks that are stopped for a while, as by Ctrl-Z or a debugger: sessions go on with the same bits.

use std::{thread, time::Duration};

use serde_json::Value;

use crate::{
    ranks::{LAUNCHER, has_ranks},
    ranks_lost::{processes, send},
    support::{SMALL_SCENE, Server, folder, until, write_scene},
};

/// Stops a process for so long (ms).
fn stop(id: u32, time: u64) {
    send("STOP", id);
    thread::sleep(Duration::from_millis(time));
    send("CONT", id);
}

/// The step at which the only session stands, while it plays.
fn step(server: &Server) -> u64 {
    let all = server.nappe(&["list"]).ok().json();
    let session: &Value = &all[0];
    assert_eq!(session["state"], "playing", "{session}");
    session["step"].as_u64().expect("a number")
}

#[test]
fn a_session_has_the_bits_of_an_undisturbed_one_after_stops_of_its_server_its_launcher_and_its_ranks() {
    if !has_ranks() {
        return;
    }
    let folder = folder();
    let text = SMALL_SCENE.replace("steps = 40", "steps = 0").replace("[12, 12]", "[30, 30]");
    let scene = write_scene(folder.path(), &text);
    let server = Server::with(&["--launcher", LAUNCHER, "--max-ranks", "3", "--rank-silence", "5"]);
    server.nappe(&["create", &scene, "--id", "stopped", "--ranks", "3"]).ok();
    server.nappe(&["play", "stopped"]).ok();
    let mut job = processes(server.id(), "mpirun");
    job.extend(processes(server.id(), "nappe-rank"));
    assert_eq!(job.len(), 4);

    // The server is stopped for longer than ranks may be silent, too.
    let stops = [50, 200].into_iter().flat_map(|time| job.iter().map(move |id| (*id, time)));
    let of_server = [50, 200, 6000].map(|time| (server.id(), time));
    for (id, time) in stops.chain(of_server) {
        stop(id, time);
        let before = step(&server);
        until("it goes on", || step(&server) > before);
    }
    server.nappe(&["pause", "stopped"]).ok();
    let stopped = server.nappe(&["step", "stopped", "1"]).ok().json();

    server.nappe(&["create", &scene, "--id", "undisturbed"]).ok();
    let steps = stopped["step"].to_string();
    let undisturbed = server.nappe(&["step", "undisturbed", &steps]).ok().json();
    assert_eq!(stopped["step"], undisturbed["step"]);
    assert!(stopped["state_hash"].is_string(), "{stopped}");
    assert_eq!(stopped["state_hash"], undisturbed["state_hash"]);
}

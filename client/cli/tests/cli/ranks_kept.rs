//! Sessions of ranks outlive their server: they come back with ranks, or are stepped by the server itself, with the same bits.

use std::fs;

use crate::{
    ranks::{LAUNCHER, has_ranks},
    support::{SMALL_SCENE, Server, folder, until, write_scene},
};

#[test]
fn a_session_of_ranks_goes_on_after_a_kill_with_ranks_and_without() {
    if !has_ranks() {
        return;
    }
    let here = folder();
    let scene = write_scene(here.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let states = here.path().join("states").to_str().expect("UTF-8").to_owned();
    let kept =
        ["--state-dir", states.as_str(), "--checkpoint-seconds", "0.05", "--max-ranks", "2", "--launcher"];
    let with = |launcher: &str, log: &str| {
        Server::logging(&[&kept[..], &[launcher]].concat(), &here.path().join(log))
    };
    let alone = Server::start();
    alone.nappe(&["create", &scene, "--id", "alone"]).ok();

    let mut server = with(LAUNCHER, "first.log");
    server.nappe(&["create", &scene, "--id", "kept", "--ranks", "2", "--threads", "1"]).ok();
    let mut steps = 0;
    for (launcher, ranks, log) in [(LAUNCHER, 2, "second.log"), ("false {ranks} {program}", 0, "third.log")] {
        steps += 20;
        let to = steps.to_string();
        let expected = alone.nappe(&["step", "alone", "--to", &to]).ok().json()["state_hash"].clone();
        let before = server.nappe(&["step", "kept", "--to", &to]).ok().json();
        assert_eq!(before["state_hash"], expected, "step {steps}");
        server.end_by("KILL");

        server = with(launcher, log);
        let mut again = before.clone();
        until("the session stands where it stood", || {
            again = server.nappe(&["list"]).ok().json()[0].clone();
            again["step"] == before["step"] && again["state"] == "paused"
        });
        assert_eq!((&again["uid"], &again["frame"]), (&before["uid"], &before["frame"]));
        let counted = again["ranks"]["rank_count"].as_u64().unwrap_or(0);
        assert_eq!(counted, ranks, "with the launcher {launcher}");
    }
    let expected = alone.nappe(&["step", "alone", "--to", "60"]).ok().json()["state_hash"].clone();
    let last = server.nappe(&["step", "kept", "--to", "60"]).ok().json();
    assert_eq!(last["state_hash"], expected, "the server steps it itself");
    let log = fs::read_to_string(here.path().join("third.log")).expect("a log");
    assert!(log.contains("the server steps it itself, without ranks"), "{log}");
}

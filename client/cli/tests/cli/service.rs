//! A server in a process of its own and every verb that talks to it.

use std::{fs, process::Stdio};

use serde_json::Value;

use crate::support::{
    Lines, SMALL_SCENE, Server, command, end_by, folder, hears_of_hangups, nappe, until, write_scene,
};

/// Creates a session of the small scene, which ends after `steps` steps (0: never).
fn create(server: &Server, id: &str, steps: u64) -> Value {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", &format!("steps = {steps}")));
    server.nappe(&["create", &scene, "--id", id]).ok().json()
}

#[test]
fn a_session_lives_from_create_to_delete() {
    let server = Server::start();
    let made = create(&server, "first", 40);
    assert_eq!(
        (&made["session_id"], &made["state"], &made["step"]),
        (&"first".into(), &"paused".into(), &0.into())
    );
    assert_eq!(made["particle_count"], 144);

    let stepped = server.nappe(&["step", "first", "10"]).ok().json();
    assert_eq!((&stepped["step"], &stepped["state"]), (&10.into(), &"paused".into()));
    assert!(stepped["state_hash"].is_string());

    let listed = server.nappe(&["list"]).ok().json();
    let ids: Vec<&str> =
        listed.as_array().expect("an array").iter().filter_map(|s| s["session_id"].as_str()).collect();
    assert_eq!(ids, ["first"]);

    server.nappe(&["play", "first"]).ok();
    let finished = wait_for(&server, "first", "finished");
    assert_eq!(finished["step"], 40);

    server.nappe(&["delete", "first"]).ok();
    assert_eq!(server.nappe(&["list"]).ok().json(), serde_json::json!([]));
}

#[test]
fn no_steps_mean_that_a_session_never_ends_for_create_as_for_fork() {
    let server = Server::start();
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let made = server.nappe(&["create", &scene, "--id", "endless", "--steps", "0"]).ok().json();
    assert_eq!(made["step_limit"], 0, "{made}");
    let stepped = server.nappe(&["step", "endless", "50"]).ok().json();
    assert_eq!((&stepped["step"], &stepped["state"]), (&50.into(), &"paused".into()), "the scene has 40");
    let copy = server.nappe(&["fork", "endless", "--id", "copy", "--steps", "60"]).ok().json();
    assert_eq!(copy["step_limit"], 60, "{copy}");
    let copy = server.nappe(&["fork", "copy", "--id", "again", "--steps", "0"]).ok().json();
    assert_eq!(copy["step_limit"], 0, "{copy}");
}

#[test]
fn a_session_that_was_saved_goes_on_from_its_file() {
    let server = Server::start();
    let here = folder();
    create(&server, "first", 0);
    server.nappe(&["step", "first", "10"]).ok();
    let file = here.path().join("first.session");
    let path = file.to_str().expect("a path");
    let saved = server.nappe(&["save", "first", path]).ok().json();
    let bytes = fs::metadata(&file).expect("it is there").len();
    assert_eq!((&saved["session_id"], &saved["bytes"]), (&"first".into(), &bytes.into()), "{saved}");
    let kept = server.nappe(&["save", "first", path]);
    assert!(kept.code == Some(1) && kept.stderr.contains("--force"), "{kept:?}");

    let again = server.nappe(&["create", "--from", path, "--id", "again"]).ok().json();
    assert_eq!((&again["session_id"], &again["step"]), (&"again".into(), &10.into()), "{again}");
    let hashes = ["first", "again"]
        .map(|id| server.nappe(&["step", id, "30"]).ok().json()["state_hash"].as_str().map(str::to_owned));
    assert!(hashes[0].is_some() && hashes[0] == hashes[1], "{hashes:?}");

    let mut altered = fs::read(&file).expect("it is there");
    let last = altered.len() - 1;
    altered[last] ^= 1;
    fs::write(&file, altered).expect("it is written");
    let refused = server.nappe(&["create", "--from", path]);
    assert!(refused.code == Some(5) && refused.stderr.contains("section 'colors'"), "{refused:?}");
    let both = server.nappe(&["create", "demo", "--from", path]);
    assert_eq!(both.code, Some(2), "{both:?}");
    assert_eq!(server.nappe(&["create"]).code, Some(2));
}

#[test]
fn a_session_goes_on_from_what_another_server_keeps_of_it() {
    let here = folder();
    let state = here.path().join("state");
    let server = Server::with(&["--state-dir", state.to_str().expect("a path")]);
    let made = create(&server, "first", 0);
    let stepped = server.nappe(&["step", "first", "10"]).ok().json();
    assert_eq!(stepped["durability"]["problem"], "", "{stepped}");
    assert_eq!(server.end_by("TERM"), Some(0));

    let left = state.join("sessions").join(made["uid"].as_str().expect("a uid"));
    let path = left.to_str().expect("a path");
    let other = Server::start();
    let again = other.nappe(&["create", "--from", path, "--id", "again"]).ok().json();
    assert_eq!((&again["step"], &again["state_hash"]), (&10.into(), &stepped["state_hash"]), "{again}");
    assert_ne!(again["uid"], made["uid"]);
    let refused = other.nappe(&["create", "--from", here.path().to_str().expect("a path")]);
    assert!(refused.code == Some(1) && refused.stderr.contains("DIR/sessions/UID"), "{refused:?}");
}

/// Asks until the session is in this state.
pub(crate) fn wait_for(server: &Server, id: &str, state: &str) -> Value {
    let mut found = None;
    until(&format!("session {id} is {state}"), || {
        let sessions = server.nappe(&["list"]).ok().json();
        let session = sessions.as_array().expect("an array").iter().find(|s| s["session_id"] == id).cloned();
        found = session.filter(|session| session["state"] == state);
        found.is_some()
    });
    found.expect("it was found")
}

#[test]
fn the_same_scene_has_the_same_hash_on_a_server_and_in_the_command() {
    let server = Server::start();
    create(&server, "there", 40);
    let there = server.nappe(&["step", "there", "40"]).ok().json();
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let here = crate::support::nappe(&["run", &scene, "--json"]).ok().json();
    assert_eq!(here["state_hash"], there["state_hash"]);
    // `run --server` leaves the server as it was.
    let remote = server.nappe(&["run", &scene]).ok().json();
    assert_eq!(remote["state_hash"], here["state_hash"]);
    assert_eq!(server.nappe(&["list"]).ok().json().as_array().map(Vec::len), Some(1));
}

#[test]
fn play_pause_stop_and_update_do_what_they_say() {
    let server = Server::start();
    create(&server, "endless", 0);
    assert_eq!(server.nappe(&["play", "endless", "--real-time-factor", "1"]).ok().json()["state"], "playing");
    assert_eq!(server.nappe(&["pause", "endless"]).ok().json()["state"], "paused");
    let changed =
        server.nappe(&["update", "endless", "--gravity", "0,-1.62,0", "--wind", "1,0,0"]).ok().json();
    assert!(changed["effective_step"].is_u64(), "{changed}");
    let later = server
        .nappe(&[
            "update",
            "endless",
            "--at-step",
            "100000",
            "--stiffness",
            "stretch=150",
            "--damping",
            "0.02",
            "--drag",
            "0.001",
            "--pin",
            "0=0,0.5,0:1",
        ])
        .ok()
        .json();
    assert_eq!(later["effective_step"], 100_000);
    let waiting = server.nappe(&["changes", "endless"]).ok().json();
    assert_eq!(
        (&waiting[1]["order"], &waiting[1]["effective_step"]),
        (&later["order"], &100_000.into()),
        "{waiting}"
    );
    assert_eq!(waiting[1]["sets"], serde_json::json!(["drag 0.001", "springs (2)", "pins (1)"]));
    let order = later["order"].to_string();
    assert_eq!(server.nappe(&["changes", "endless", "--drop", &order]).ok().json()["dropped_count"], 1);
    a_pin_without_a_time_goes_at_a_walk(&server);
    let refused = server.nappe(&["update", "endless", "--pin", "50=0,0,0"]);
    assert_eq!(refused.code, Some(5), "{refused:?}");
    assert!(refused.stderr.contains("50") && refused.stderr.contains("INVALID_CHANGE"), "{}", refused.stderr);
    assert_eq!(server.nappe(&["stop", "endless"]).ok().json()["state"], "finished");
}

/// It goes at 1 m/s from where it stands, which is the origin, and how long that takes is said.
fn a_pin_without_a_time_goes_at_a_walk(server: &Server) {
    let update = |pin: &str| server.nappe(&["update", "endless", "--pin", pin]).ok().json();
    for (pin, seconds) in [("0=0.3,0.4,0", 0.5), ("top_left=0,0,-2", 2.0), ("sheet:0=0,1,0:0.25", 0.25)] {
        let told = update(pin);
        let said = told["pins"][0]["seconds"].as_f64().expect("a time");
        assert!((said - seconds).abs() < 1e-6, "{pin}: {told}");
        assert_eq!(told["pins"][0]["particle"], 0, "{pin}: {told}");
    }
    for (pin, words) in [
        ("sheet:top_left=0,0.5,0", "; pin sheet:top_left gets there in 0.500 s"),
        ("0=0,0,0", "; pin 0 gets there in one step"),
    ] {
        let told = nappe(&["update", "endless", "--pin", pin, "--server", &server.url]).ok();
        assert!(told.stdout.trim_end().ends_with(words), "{told:?}");
    }
}

#[test]
fn forces_and_air_are_set_and_a_session_is_put_back_to_its_start() {
    let server = Server::start();
    let here = folder();
    let scene = SMALL_SCENE
        .replace("steps = 40", "steps = 0")
        .replace("[body.springs]", "[body.air]\n\n[body.springs]");
    let scene = write_scene(here.path(), &scene);
    server.nappe(&["create", &scene, "--id", "pulled"]).ok();
    let name = scene_body(&scene);
    let start = server.nappe(&["list"]).ok().json()[0]["state_hash"].clone();
    let (one, all) = (format!("{name}:20=0,0.1,0"), format!("{name}:all=0,0,0"));
    let args =
        ["update", "pulled", "--force", &one, "--air", "density=2", "--air", "lift=0.5", "--at-step", "5"];
    server.nappe(&args).ok();
    server.nappe(&["update", "pulled", "--force", &all, "--at-step", "9"]).ok();
    let waiting = server.nappe(&["changes", "pulled"]).ok().json();
    assert_eq!(waiting[0]["sets"], serde_json::json!(["air (1)", "forces (1)"]));
    let stepped = server.nappe(&["step", "pulled", "12"]).ok().json();
    assert_ne!(stepped["diagnostics"]["external_work"], 0.0, "{stepped}");
    let reset = server.nappe(&["reset", "pulled"]).ok().json();
    assert_eq!(reset["effective_step"], 12);
    let again = server.nappe(&["step", "pulled", "1"]).ok().json();
    assert_eq!(again["step"], 13);
    assert_ne!(again["state_hash"], start);
    for (wrong, told) in [(format!("{name}:500=0,0,0"), "500"), ("sail:0=0,0,0".to_owned(), "sail")] {
        let refused = server.nappe(&["update", "pulled", "--force", &wrong]);
        assert_eq!(refused.code, Some(5), "{refused:?}");
        assert!(
            refused.stderr.contains(told) && refused.stderr.contains("INVALID_CHANGE"),
            "{}",
            refused.stderr
        );
    }
    let refused = server.nappe(&["update", "pulled", "--force", "sail=0,0,0"]);
    assert!(refused.stderr.contains("BODY:PARTICLE=X,Y,Z"), "{}", refused.stderr);
    assert_eq!(server.nappe(&["reset", "nobody"]).code, Some(5));
}

/// The name of the body of a scene file.
fn scene_body(path: &str) -> String {
    let text = std::fs::read_to_string(path).expect("a scene");
    let name = text.lines().find_map(|line| line.strip_prefix("name = \"")).expect("a body has a name");
    name.trim_end_matches('"').to_owned()
}

#[test]
fn an_old_name_of_an_option_works_and_says_its_new_one() {
    let server = Server::start();
    create(&server, "slow", 0);
    let played = server.nappe(&["play", "slow", "--pace", "1e-6"]).ok();
    assert_eq!(played.json()["state"], "playing");
    assert_eq!(played.stderr.trim_end(), "warning: the option --pace is now called --real-time-factor");
    // At this factor, the first step of 5 ms would be taken after 5000 s.
    assert_eq!(server.nappe(&["pause", "slow"]).ok().json()["step"], 0);
    let played = server.nappe(&["play", "slow", "--real-time-factor", "1e-6"]).ok();
    assert_eq!(played.stderr, "");
    assert_eq!(server.nappe(&["pause", "slow"]).ok().json()["step"], 0);
}

#[test]
fn watching_prints_diagnostics_and_saves_frames() {
    let server = Server::start();
    create(&server, "watched", 0);
    server.nappe(&["play", "watched", "--real-time-factor", "1"]).ok();
    let lines = server.nappe(&["watch", "watched", "--rate", "50", "--count", "5"]).ok().stdout;
    let steps: Vec<u64> = lines
        .lines()
        .map(|line| {
            serde_json::from_str::<Value>(line).expect("a JSON object per line")["step"]
                .as_u64()
                .expect("a step")
        })
        .collect();
    assert_eq!(steps.len(), 5);
    assert!(steps.windows(2).all(|pair| pair[0] < pair[1]), "{steps:?}");

    let folder = folder();
    let frames = folder.path().join("frames");
    let path = frames.to_str().expect("a UTF-8 path");
    let saved = server.nappe(&["watch", "watched", "--save", path, "--count", "6"]).ok().json();
    assert_eq!(saved["frames"], 6);
    assert_eq!(std::fs::read_dir(&frames).expect("the folder").count(), 6);
}

#[test]
fn a_refusal_ends_with_5_and_its_reason() {
    let server = Server::start();
    let unknown = server.nappe(&["step", "nobody"]);
    assert_eq!(unknown.code, Some(5), "{unknown:?}");
    assert!(unknown.stderr.contains("SESSION_NOT_FOUND"), "{}", unknown.stderr);
    let scene = server.nappe(&["create", "dmo"]);
    assert_eq!(scene.code, Some(5), "{scene:?}");
    for part in ["SCENE_NOT_FOUND", "no scene is named 'dmo'; did you mean 'demo'?"] {
        assert!(scene.stderr.contains(part), "'{part}' is missing in: {}", scene.stderr);
    }
    create(&server, "twice", 1);
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let again = server.nappe(&["create", &scene, "--id", "twice"]);
    assert_eq!(again.code, Some(5), "{again:?}");
    assert!(again.stderr.contains("SESSION_EXISTS"), "{}", again.stderr);
}

#[test]
fn ctrl_c_sigterm_and_a_terminal_that_closes_end_a_server_under_a_watcher() {
    let signals: &[&str] = if hears_of_hangups() { &["INT", "TERM", "HUP"] } else { &["INT", "TERM"] };
    for signal in signals {
        let server = Server::start();
        create(&server, "endless", 0);
        server.nappe(&["play", "endless"]).ok();
        let mut watcher = command()
            .args(["watch", "endless", "--json", "--server", &server.url])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("the watcher starts");
        let lines = Lines::of(watcher.stdout.take().expect("a pipe"));
        lines.next().expect("it watches");
        assert_eq!(
            server.end_by(signal),
            Some(0),
            "SIG{signal}: a server that is asked to end has ended well"
        );
        // The watcher ends too, or is ended here.
        if watcher.try_wait().expect("the watcher can be asked").is_none() {
            end_by(&mut watcher, "INT");
        }
    }
}

#[test]
fn a_server_that_nohup_started_outlives_its_terminal() {
    let server = Server::by_nohup();
    server.signal("HUP");
    create(&server, "still-there", 40);
    assert_eq!(server.nappe(&["step", "still-there", "10"]).ok().json()["step"], 10);
    assert_eq!(server.end_by("TERM"), Some(0));
}

#[test]
fn an_address_in_use_is_said_plainly() {
    let server = Server::start();
    let address = server.url.trim_start_matches("http://");
    let done = crate::support::nappe(&["serve", "--address", address]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stderr.contains(address), "{}", done.stderr);
}

#[test]
fn an_address_that_others_can_reach_needs_a_flag() {
    let done = crate::support::nappe(&["serve", "--address", "0.0.0.0:0"]);
    assert_ne!(done.code, Some(0));
    assert!(done.stderr.contains("--allow-remote"), "{}", done.stderr);
}

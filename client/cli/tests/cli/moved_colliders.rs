//! Colliders that `nappe update` sends somewhere.

use serde_json::{Value, json};

use crate::support::{SMALL_SCENE, Server, folder, nappe, write_scene};

const COLLIDERS: &str = r#"
[[collider]]
name = "lid"
box = { center = [0, -2, 0], size = [1, 0.1, 1] }

[[collider]]
name = "floor"
plane = { point = [0, -3, 0], normal = [0, 1, 0] }
"#;

/// Whether the collider of a session is there, and turned so.
#[track_caller]
fn is_at(session: &Value, name: &str, position: [f64; 3], turn: [f64; 4]) {
    let poses = session["parameters"]["collider_poses"].as_array().expect("poses");
    let pose = poses.iter().find(|pose| pose["name"] == name).expect("the collider");
    for (told, expected) in [(&pose["position"], &position[..]), (&pose["turn"], &turn[..])] {
        let numbers = told.as_array().expect("numbers");
        assert_eq!(numbers.len(), expected.len(), "{pose}");
        for (number, expected) in numbers.iter().zip(expected) {
            assert!((number.as_f64().expect("a number") - expected).abs() < 1e-9, "{pose}");
        }
    }
}

#[test]
fn a_collider_goes_where_it_is_sent_and_its_pose_is_told() {
    let (server, here) = (Server::start(), folder());
    let scene = SMALL_SCENE.replace("steps = 40", "steps = 0") + COLLIDERS;
    let scene = write_scene(here.path(), &scene);
    let made = server.nappe(&["create", &scene, "--id", "moved"]).ok().json();
    is_at(&made, "lid", [0.0, -2.0, 0.0], [0.0, 0.0, 0.0, 1.0]);
    is_at(&made, "floor", [0.0, -3.0, 0.0], [0.0, 0.0, 0.0, 1.0]);

    // Ten steps of 5 ms.
    let args = "update moved --collider lid --to -1,-2.5,0 --turn 0,0.6,0,0.8 --in 0.05 --at-step 2";
    let args: Vec<_> = args.split(' ').collect();
    assert_eq!(server.nappe(&args).ok().json()["effective_step"], 2);
    let waiting = server.nappe(&["changes", "moved"]).ok().json();
    assert_eq!(waiting[0]["sets"], json!(["colliders (1)"]));
    let halfway = server.nappe(&["step", "moved", "7"]).ok().json();
    is_at(&halfway, "lid", [-0.5, -2.25, 0.0], [0.0, 0.1_f64.sqrt(), 0.0, 0.9_f64.sqrt()]);
    let there = server.nappe(&["step", "moved", "8"]).ok().json();
    is_at(&there, "lid", [-1.0, -2.5, 0.0], [0.0, 0.6, 0.0, 0.8]);
    is_at(&there, "floor", [0.0, -3.0, 0.0], [0.0, 0.0, 0.0, 1.0]);

    // Without a time, within one step.
    server.nappe(&["update", "moved", "--collider", "lid", "--turn", "0,0,0,1"]).ok();
    let back = server.nappe(&["step", "moved", "1"]).ok().json();
    is_at(&back, "lid", [-1.0, -2.5, 0.0], [0.0, 0.0, 0.0, 1.0]);

    for (wrong, parts) in [
        ("--collider ldi --to 0,0,0", &["ldi", "lid, floor"][..]),
        ("--collider lid --turn 0,0,0,1.1", &["lid", "length"]),
        ("--collider lid --to 0,2e6,0", &["position", "1000000"]),
    ] {
        let args: Vec<_> = ["update", "moved"].into_iter().chain(wrong.split(' ')).collect();
        let refused = server.nappe(&args);
        assert_eq!(refused.code, Some(5), "{refused:?}");
        assert!(refused.stderr.contains("INVALID_CHANGE"), "{}", refused.stderr);
        for part in parts {
            assert!(refused.stderr.contains(part), "'{part}' is missing: {}", refused.stderr);
        }
    }
}

#[test]
fn options_of_a_collider_go_together() {
    for (wrong, told) in [
        ("--collider lid", "--collider lid needs --to, --turn or both"),
        ("--collider lid --in 2", "--collider lid needs --to, --turn or both"),
        ("--to 0,0,0", "--collider"),
        ("--turn 0,0,0,1", "--collider"),
        ("--in 2 --wind 1,0,0", "--collider"),
        ("--collider lid --to 0,0", "a vector has three"),
        ("--collider lid --turn 0,0,1", "a turn has four"),
        ("--collider lid --to 0,0,0 --in -1", "a number of seconds from 0 is needed"),
    ] {
        let args: Vec<_> = ["update", "some"].into_iter().chain(wrong.split(' ')).collect();
        let done = nappe(&args);
        assert_eq!(done.code, Some(2), "{wrong}: {done:?}");
        assert!(done.stderr.contains(told), "'{told}' is missing after {wrong}: {}", done.stderr);
    }
}

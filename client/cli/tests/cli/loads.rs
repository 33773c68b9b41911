//! What colliders feel, as sessions and watchers tell it in JSON.

use serde_json::Value;

use crate::support::{SMALL_SCENE, Server, folder, nappe_in, write_scene};

/// Below the sheet at a height of its margin, and far away.
const COLLIDERS: &str = r#"
[[collider]]
name = "floor"
plane = { point = [0, -0.01, 0], normal = [0, 1, 0] }
margin = 0.01
friction = 0.5

[[collider]]
name = "lid"
box = { center = [0, 5, 0], size = [1, 0.1, 1] }
"#;

/// Moves the lid, in place of where it stands.
const KEYS: &str = r"
[[collider.key]]
time = 0
position = [0, 5, 0]

[[collider.key]]
time = 0.02
position = [0, 6, 0]
turn = [0, 1, 0, 0]
";

/// Force and torque of a load.
fn numbers(load: &Value) -> [f64; 6] {
    let all = [&load["force"], &load["torque"]].map(|vector| vector.as_array().expect("numbers"));
    let all: Vec<f64> = all.into_iter().flatten().filter_map(Value::as_f64).collect();
    all.try_into().expect("three numbers each")
}

#[test]
fn a_session_tells_what_its_colliders_feel() {
    let (server, here) = (Server::start(), folder());
    let scene =
        SMALL_SCENE.replace("steps = 40", "steps = 0").replace("pins = [\"top_left\", \"top_right\"]", "");
    let scene = write_scene(here.path(), &(scene + COLLIDERS));
    let made = server.nappe(&["create", &scene, "--id", "lies"]).ok().json();
    assert_eq!(made["diagnostics"]["loads"], serde_json::json!([]), "no step was taken");

    let told = server.nappe(&["step", "lies", "4"]).ok().json();
    let loads = told["diagnostics"]["loads"].as_array().expect("loads");
    let names: Vec<_> = loads.iter().map(|load| load["name"].as_str().expect("a name")).collect();
    assert_eq!(names, ["floor", "lid"]);
    assert!(loads[0]["contacts"].as_u64() >= Some(144), "{loads:?}");

    // 144 particles of 0.01 kg, the middle of them 0.275 m from the plane's point along x and z.
    let weight = 1.44 * 9.81;
    let expected = [0.0, -weight, 0.0, 0.275 * weight, 0.0, -0.275 * weight];
    let found = numbers(&loads[0]);
    let off = found.iter().zip(expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert!(off < 1e-3 * weight, "{found:?}, not {expected:?}");
    assert_eq!((numbers(&loads[1]), &loads[1]["contacts"]), ([0.0; 6], &0.into()));
}

#[test]
fn a_run_tells_what_its_colliders_feel_and_where_they_are() {
    let folder = folder();
    let scene = SMALL_SCENE.replace("pins = [\"top_left\", \"top_right\"]", "");
    let scene = write_scene(folder.path(), &(scene + COLLIDERS + KEYS));
    let told = nappe_in(folder.path(), &["run", &scene, "--steps", "4", "--json"]).ok().json();

    let weight = 1.44 * 9.81;
    let off = (numbers(&told["loads_at_end"][0])[1] + weight).abs();
    assert!(off < 1e-3 * weight, "{}", told["loads_at_end"]);
    assert_eq!(
        (&told["loads_at_end"][0]["name"], &told["loads_at_end"][1]["name"]),
        (&"floor".into(), &"lid".into())
    );
    let expected = serde_json::json!([
        { "name": "floor", "position": [0.0, -0.01, 0.0], "turn": [0.0, 0.0, 0.0, 1.0] },
        { "name": "lid", "position": [0.0, 6.0, 0.0], "turn": [0.0, 1.0, 0.0, 0.0] },
    ]);
    assert_eq!(told["poses_at_end"], expected);
}

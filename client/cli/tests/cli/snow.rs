//! Snow through the command: diagnostics in words and JSON, arrays and nodes of the grid in PLY files, what is asked
//! for in the wrong place.

use std::{fs, path::Path};

use serde_json::Value;

use crate::support::{Server, folder, nappe, nappe_in, write_scene};

/// A block of 216 particles that falls on a floor.
pub(crate) const SNOW_SCENE: &str = r#"
version = 1
title = "a little snow"
dt = 0.01
steps = 12
frame_interval = 4

[snow]
cell = 0.1

[[snow.object]]
name = "block"
box = { center = [0, 0.22, 0], size = [0.3, 0.3, 0.3] }
particles = 216
velocity = [0, -2, 0]

[[collider]]
name = "floor"
plane = { point = [0, 0, 0], normal = [0, 1, 0] }
"#;

/// The header of a PLY file, and the bytes after it.
fn ply(path: &Path) -> (Vec<String>, Vec<u8>) {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
    let header = String::from_utf8(bytes[..at].to_vec()).expect("a header is ASCII");
    (header.lines().map(str::to_owned).collect(), bytes[at..].to_vec())
}

/// Names of a vertex's numbers, and the numbers of each vertex.
fn vertices(path: &Path) -> (Vec<String>, Vec<Vec<f32>>) {
    let (header, data) = ply(path);
    let names: Vec<String> =
        header.iter().filter_map(|line| Some(line.strip_prefix("property float ")?.to_owned())).collect();
    let (numbers, _) = data.as_chunks::<4>();
    let numbers: Vec<f32> = numbers.iter().map(|&bytes| f32::from_le_bytes(bytes)).collect();
    (names.clone(), numbers.chunks_exact(names.len()).map(<[f32]>::to_vec).collect())
}

#[test]
fn a_run_of_snow_tells_of_its_steps_and_its_packing() {
    let folder = folder();
    let scene = write_scene(folder.path(), SNOW_SCENE);
    let result = nappe(&["run", &scene, "--json"]).ok().json();
    assert_eq!(
        (&result["particles"], &result["springs"], &result["steps"]),
        (&216.into(), &0.into(), &12.into())
    );
    let snow = &result["snow_at_end"];
    assert!(snow["substeps"].as_u64().is_some_and(|count| count > 0), "{result}");
    assert!(snow["bound"].as_str().is_some_and(|bound| bound != "unknown"), "{result}");
    // 27 cells at 400 kg/m³.
    assert!(snow["mass"].as_f64().is_some_and(|mass| (mass - 10.8).abs() < 1e-6), "{result}");
    assert!(snow["grid_mass_error"].as_f64().is_some_and(|error| error.abs() < 1e-5), "{result}");
    assert!(snow["min_plastic_ratio"].as_f64().is_some_and(|ratio| (0.5..=1.0).contains(&ratio)), "{result}");
    let text = nappe(&["run", &scene]).ok().stdout;
    assert!(text.contains("last step of snow") && text.contains("J_P"), "{text}");
    assert!(!text.contains("max stretch"), "no springs, no stretch: {text}");
    let sheet = nappe(&["run", "drap10", "--steps", "2", "--json"]).ok().json();
    assert!(sheet["snow_at_end"].is_null(), "{sheet}");
}

#[test]
fn a_folder_gets_the_arrays_and_the_nodes_that_were_asked_for() {
    let folder = folder();
    let scene = write_scene(folder.path(), SNOW_SCENE);
    let asked = ["--fields", "velocity,plastic_ratio,stress,force,acceleration", "--grid", "smoke"];
    let args = [&["run", &scene, "--json", "--save", "frames"][..], &asked].concat();
    assert_eq!(nappe_in(folder.path(), &args).ok().json()["frames"], 4);
    let frames = folder.path().join("frames");
    let (names, first) = vertices(&frames.join("frame-000000.ply"));
    assert_eq!(names[..8], ["x", "y", "z", "vx", "vy", "vz", "plastic_ratio", "stress_norm"]);
    assert_eq!(names[8..], ["fx", "fy", "fz", "ax", "ay", "az"]);
    assert_eq!(first.len(), 216);
    assert!(first.iter().all(|row| row[3..8] == [0.0, -2.0, 0.0, 1.0, 0.0]), "as it starts: {:?}", first[0]);
    // It falls freely: 0.05 kg a particle.
    let is_falling = |row: &Vec<f32>| (row[9] + 0.05 * 9.81).abs() < 1e-4 && (row[12] + 9.81).abs() < 1e-4;
    assert!(first.iter().all(is_falling), "as it starts: {:?}", first[0]);
    let (_, last) = vertices(&frames.join("frame-000003.ply"));
    assert!(last.iter().flatten().all(|number| number.is_finite()));
    assert!(last.iter().any(|row| row[7] > 0.0), "it hit the floor");
    let (names, nodes) = vertices(&frames.join("grid-000003.ply"));
    assert_eq!(names, ["x", "y", "z", "mass", "vx", "vy", "vz", "fx", "fy", "fz"]);
    let mass: f32 = nodes.iter().map(|node| node[3]).sum();
    assert!((mass / 10.8 - 1.0).abs() < 1e-4, "{mass} kg on {} nodes", nodes.len());
}

#[test]
fn a_slice_is_a_plane_of_nodes_and_changes_no_bit() {
    let folder = folder();
    let scene = write_scene(folder.path(), SNOW_SCENE);
    let plain = nappe(&["run", &scene, "--json"]).ok().json();
    let asked = ["--grid", "slice:y=0.12", "--grid-nodes", "9"];
    let args = [&["run", &scene, "--json", "--save", "frames"][..], &asked].concat();
    let saved = nappe_in(folder.path(), &args).ok().json();
    assert_eq!(plain["state_hash"], saved["state_hash"]);
    let (_, nodes) = vertices(&folder.path().join("frames/grid-000001.ply"));
    assert!(!nodes.is_empty() && nodes.len() <= 9, "{} nodes", nodes.len());
    assert!(nodes.iter().all(|node| (node[1] - 0.1).abs() < 1e-6), "{nodes:?}");
}

#[test]
fn a_watcher_saves_arrays_and_follows_diagnostics_of_snow() {
    let folder = folder();
    let scene = write_scene(folder.path(), SNOW_SCENE);
    let server = Server::start();
    server.nappe(&["create", &scene, "--id", "snow"]).ok();
    let watcher = ["watch", "snow", "--save", "frames", "--from", "0", "--count", "1", "--fields", "stress"];
    let args = [&watcher[..], &["--server", &server.url, "--json"]].concat();
    assert_eq!(nappe_in(folder.path(), &args).ok().json()["frames"], 1);
    let (names, _) = vertices(&folder.path().join("frames/frame-000000.ply"));
    assert_eq!(names, ["x", "y", "z", "stress_norm"]);
    let session = server.nappe(&["step", "snow", "8"]).ok().json();
    assert!(session["diagnostics"]["snow"]["substeps"].as_u64() > Some(0), "{session}");
    let diagnostics: Value = server.nappe(&["watch", "snow", "--count", "1"]).ok().json();
    assert!(diagnostics["snow"]["bound"].is_string(), "{diagnostics}");
}

#[test]
fn what_is_kept_needs_a_place_and_a_known_name() {
    for (args, part) in [
        (&["run", "drap10", "--fields", "velocity"][..], "--save"),
        (&["run", "drap10", "--grid", "smoke"], "--save"),
        (&["run", "drap10", "--save", "folder", "--color", "speed"], "recording"),
        (&["run", "drap10", "--save", "folder", "--fields", "mass"], "plastic_ratio"),
        (&["run", "drap10", "--save", "folder", "--grid", "slice:w=1"], "slice:y=0.5"),
        (&["run", "drap10", "--save", "folder", "--grid-nodes", "9"], "--grid"),
        (&["watch", "some", "--fields", "velocity"], "--save"),
    ] {
        let done = nappe_in(folder().path(), args);
        assert_eq!(done.code, Some(2), "{args:?}: {done:?}");
        assert!(done.stderr.contains(part), "'{part}' is missing in: {}", done.stderr);
    }
}

#[test]
fn a_fixed_step_above_the_bound_is_refused_with_the_bound() {
    let folder = folder();
    let scene = write_scene(folder.path(), &SNOW_SCENE.replace("cell = 0.1", "cell = 0.1\nsubstep = 0.01"));
    let done = nappe(&["run", &scene, "--json"]);
    assert_eq!(done.code, Some(5), "{done:?}");
    assert!(done.stderr.contains("'isolated_particle' of 3.5857e-3 s"), "{}", done.stderr);
}

#[test]
fn snow_that_needs_too_many_steps_ends_with_3_and_says_so() {
    let folder = folder();
    let scene = write_scene(folder.path(), &SNOW_SCENE.replace("cell = 0.1", "cell = 0.1\nmax_substeps = 1"));
    let done = nappe(&["run", &scene, "--json"]);
    assert_eq!(done.code, Some(3), "{done:?}");
    assert_eq!(done.json()["diverged"]["cause"], "SUBSTEP_LIMIT");
}

//! Saved frames that a run cannot go on from, and folders that none goes on in: each is refused by what is wrong with it.

use std::{fs, path::Path};

use crate::{
    going_on::timed,
    support::{Done, Folder, SMALL_SCENE, folder, nappe_in, write_scene},
};

/// The small scene, and frames of its first 20 steps in the folder `frames`.
fn saved() -> (Folder, String) {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let run = ["run", &scene, "--save", "frames", "--steps", "20", "--fields", "velocity"];
    nappe_in(here.path(), &run).ok();
    (here, scene)
}

/// Puts a text in the place of another one in the header of a file.
fn edit(path: &Path, from: &str, to: &str) {
    let bytes = fs::read(path).expect("a frame");
    let at = bytes.windows(from.len()).position(|window| window == from.as_bytes());
    let at = at.unwrap_or_else(|| panic!("{} has no '{from}'", path.display()));
    let edited = [&bytes[..at], to.as_bytes(), &bytes[at + from.len()..]].concat();
    fs::write(path, edited).expect("written");
}

/// The text behind the first comment of a key, and the line.
fn comment(path: &Path, key: &str) -> String {
    let bytes = fs::read(path).expect("a frame");
    let text = String::from_utf8_lossy(&bytes);
    let line = text.lines().find(|line| line.starts_with(&format!("comment {key} ")));
    line.unwrap_or_else(|| panic!("no comment {key}")).to_owned()
}

/// A run that is refused, with what it says.
#[track_caller]
fn refused(done: &Done, parts: &[&str]) {
    assert_eq!(done.code, Some(1), "{done:?}");
    for part in parts {
        assert!(done.stderr.contains(part), "'{part}' is missing in: {}", done.stderr);
    }
}

#[test]
fn frames_that_do_not_fit_a_run_are_refused_by_name() {
    let (here, scene) = saved();
    let frame = here.path().join("frames/frame-000004.ply");
    let start = |more: &[&str]| {
        let run = ["run", &scene, "--start", "frames/frame-000004.ply"];
        nappe_in(here.path(), &[&run[..], more].concat())
    };
    refused(&start(&["--precision", "f64"]), &["is in f32, and the run is to be in f64", "--precision f32"]);
    refused(&start(&["--steps", "8"]), &["frame-000004.ply: is 8, and the session ends after 8 steps"]);
    let other = write_scene(here.path(), &SMALL_SCENE.replace("[12, 12]", "[12, 13]"));
    refused(
        &nappe_in(here.path(), &["run", &other, "--start", "frames"]),
        &["frame-000010.ply: has 144 particles, and the scene has 156 (sheet 156)"],
    );
    write_scene(here.path(), &SMALL_SCENE.replace("dt = 0.005", "dt = 0.0025"));
    refused(
        &start(&[]),
        &["frame-000004.ply: is 0.04, and step 8 of the scene, whose dt is 0.0025 s, is at 0.02 s"],
    );
    write_scene(here.path(), SMALL_SCENE);

    let whole = fs::read(&frame).expect("a frame");
    edit(&frame, &comment(&frame, "nappe"), "comment nappe 99.0.0");
    refused(&start(&[]), &["frame-000004.ply was saved by nappe 99.0.0"]);
    fs::write(&frame, &whole).expect("written");
    edit(&frame, &comment(&frame, "carried"), "comment carried luck");
    refused(&start(&[]), &["frame-000004.ply: the numbers are none that this version tells"]);
    fs::write(&frame, &whole[..whole.len() / 2]).expect("written");
    refused(&start(&[]), &["frame-000004.ply"]);
    fs::write(&frame, &whole[..100]).expect("written");
    refused(&start(&[]), &["frame-000004.ply", "ends within its header"]);
    fs::write(&frame, &whole).expect("written");

    nappe_in(here.path(), &["run", &scene, "--save", "plain", "--steps", "2"]).ok();
    let plain = nappe_in(here.path(), &["run", &scene, "--start", "plain"]);
    refused(&plain, &["has no velocities (vx, vy, vz)", "--fields velocity"]);
    let plain = nappe_in(here.path(), &["run", &scene, "--resume", "plain"]);
    refused(&plain, &["has no velocities (vx, vy, vz)", "--fields velocity"]);
    start(&[]).ok();
}

#[test]
fn a_frame_that_lacks_something_is_begun_at_with_a_warning() {
    let (here, scene) = saved();
    let frame = here.path().join("frames/frame-000004.ply");
    let start = || {
        nappe_in(here.path(), &["run", &scene, "--start", "frames/frame-000004.ply", "--quiet", "--json"])
            .ok()
    };
    assert_eq!(start().stderr, "");
    // The scene changed: the run goes on by what it says now.
    write_scene(here.path(), &SMALL_SCENE.replace("stiffness = 200.0", "stiffness = 150.0"));
    let done = start();
    assert!(
        done.stderr.contains("the scene is another one than when frames/frame-000004.ply was saved"),
        "{done:?}"
    );
    assert_eq!(done.json()["steps"], 40);
    write_scene(here.path(), SMALL_SCENE);

    // As a program writes frames that knows of positions and velocities alone.
    while fs::read(&frame).expect("a frame").windows(15).any(|window| window == b"comment carried") {
        edit(&frame, &comment(&frame, "carried"), "comment another");
    }
    let done = start();
    assert!(done.stderr.contains("does not say what steps depend on beside positions"), "{done:?}");
    assert_eq!(done.json()["steps"], 40);
    edit(&frame, &comment(&frame, "step"), "comment number 8");
    let done = start();
    assert!(done.stderr.contains("says no step: the clock of the scene begins at 0"), "{done:?}");
    assert_eq!(done.json()["steps"], 40);

    // The step before, which bdf2 knows of, is in no frame.
    let here = folder();
    let scene = write_scene(here.path(), &timed("drag = 1e-3\nintegrator = \"bdf2\""));
    nappe_in(here.path(), &["run", &scene, "--save", "frames", "--steps", "10", "--fields", "velocity"]).ok();
    let done = nappe_in(here.path(), &["run", &scene, "--resume", "frames", "--json"]).ok();
    assert!(done.stderr.contains("the step before, which bdf2 and implicit_midpoint know of"), "{done:?}");
    assert_eq!(done.json()["steps"], 47);
}

#[test]
fn folders_that_no_run_goes_on_in_are_refused_by_name() {
    let (here, scene) = saved();
    let resume = |folder: &str| nappe_in(here.path(), &["run", &scene, "--resume", folder, "--json"]);
    refused(&resume("nothing"), &["cannot read the folder nothing"]);
    fs::create_dir(here.path().join("empty")).expect("a folder");
    refused(&resume("empty"), &["the folder empty holds no frame"]);
    let both = ["run", &scene, "--resume", "frames", "--save", "other"];
    assert_eq!(nappe_in(here.path(), &both).code, Some(2), "one of them says where");
    let wide = ["run", &scene, "--resume", "frames", "--precision", "f64"];
    refused(&nappe_in(here.path(), &wide), &["is in f32, and the run is to be in f64"]);

    // The scene file changed since.
    write_scene(here.path(), &SMALL_SCENE.replace("stiffness = 200.0", "stiffness = 150.0"));
    refused(&resume("frames"), &["is another one than when frames/frame-000010.ply was saved", "--start"]);
    write_scene(here.path(), SMALL_SCENE);

    // Frames of two runs: of another scene, and one that does not follow the one before.
    let last = here.path().join("frames/frame-000010.ply");
    let whole = fs::read(&last).expect("a frame");
    edit(&last, &comment(&last, "scene"), "comment scene 0123456789abcdef");
    let told = "the folder frames holds frames of two runs (frame-000009.ply and frame-000010.ply)";
    refused(&resume("frames"), &[told]);
    fs::write(&last, &whole).expect("written");
    edit(&last, "comment step 20\n", "comment step 18\n");
    refused(&resume("frames"), &[told]);

    // The last frame was cut off: the run goes on from the one before it, to the same frames.
    fs::write(&last, &whole[..whole.len() - 100]).expect("written");
    let done = resume("frames").ok();
    assert!(done.stderr.contains("a frame is left out that cannot be read"), "{}", done.stderr);
    let run = ["run", &scene, "--save", "whole", "--fields", "velocity", "--json"];
    let end = nappe_in(here.path(), &run).ok().json();
    assert_eq!(done.json()["state_hash"], end["state_hash"]);
    for number in [10, 15, 20] {
        let file = |folder: &str| fs::read(here.path().join(format!("{folder}/frame-{number:06}.ply")));
        assert!(file("frames").expect("a frame") == file("whole").expect("a frame"), "frame {number}");
    }
}

#[test]
fn a_frame_that_was_cut_off_within_its_header_is_left_out() {
    let (here, scene) = saved();
    let last = here.path().join("frames/frame-000010.ply");
    let whole = fs::read(&last).expect("a frame");
    fs::write(&last, &whole[..100]).expect("written");
    let run = ["run", &scene, "--json"];
    let done = nappe_in(here.path(), &[&run[..], &["--resume", "frames"]].concat()).ok();
    assert!(done.stderr.contains("a frame is left out that cannot be read"), "{}", done.stderr);
    let end = nappe_in(here.path(), &run).ok().json();
    assert_eq!(done.json()["state_hash"], end["state_hash"]);
    assert!(fs::read(&last).expect("a frame") == whole, "it is there again");
}

//! The summary of a run: each number is that of the frames, over the run or at its end, as its name says.

use std::path::Path;

use nappe_scene::{NoMeshes, Scene, SceneLimits, mesh::read_ply, shipped_scenes};
use nappe_sim::{
    math::array::{length, minus},
    mesh::TriangleMesh,
    world::WorldSetup,
};
use serde_json::Value;

use crate::{
    going_on::timed,
    support::{SMALL_SCENE, folder, nappe_in, write_scene},
};

/// What of a frame the summary tells.
struct Numbers {
    stretch: f64,
    energy: f64,
}

/// The largest stretch and the energy (J) of a frame, by its positions and velocities.
fn numbers(setup: &WorldSetup, frame: &TriangleMesh) -> Numbers {
    let (mut first, mut stretch, mut energy) = (0, 0.0_f64, 0.0);
    for network in setup.bodies.iter().map(|body| &body.network) {
        let own = first..first + network.x.len();
        first = own.end;
        let (x, v) = (&frame.points[own.clone()], &frame.velocities[own]);
        for spring in &network.springs {
            let [i, j] = spring.particles.map(|particle| particle as usize);
            let long = length(minus(x[i], x[j]));
            stretch = stretch.max(long / spring.rest_length);
            energy += 0.5 * spring.law.stiffness * (long - spring.rest_length).powi(2);
        }
        // A pin goes where it is told to, and has no part in the energy.
        let is_free = |particle: &usize| !network.pins.contains(&(*particle as u32));
        for particle in (0..x.len()).filter(is_free) {
            let (x, v, mass) = (x[particle], v[particle], network.masses[particle]);
            let dot = |a: [f64; 3], b: [f64; 3]| (0..3).map(|c| a[c] * b[c]).sum::<f64>();
            energy += 0.5 * mass * dot(v, v) - mass * dot(setup.gravity, x);
        }
    }
    assert_eq!(first, frame.points.len(), "cloth alone");
    Numbers { stretch, energy }
}

fn bytes(folder: &Path, number: usize) -> Vec<u8> {
    std::fs::read(folder.join(format!("frame-{number:06}.ply"))).expect("a frame")
}

/// The time (s) of a frame.
fn time_of(folder: &Path, number: usize) -> f64 {
    let bytes = bytes(folder, number);
    let text = String::from_utf8_lossy(&bytes);
    let time = text.lines().find_map(|line| line.strip_prefix("comment time_seconds "));
    time.expect("a time").parse().expect("a number")
}

fn read(folder: &Path, number: usize) -> TriangleMesh {
    let bytes = bytes(folder, number);
    read_ply(&bytes, "frame.ply").expect("a frame is a mesh").mesh
}

/// What the summary says of a run in f64 with a frame per step is what its frames say of themselves.
fn check_said(name: &str, told: &Value, folder: &Path, steps: usize) {
    let files = std::fs::read_dir(folder).expect("the folder");
    let names = files.map(|file| file.expect("an entry").file_name().to_string_lossy().into_owned());
    assert_eq!(told["frames"], names.filter(|file| file.starts_with("frame-")).count(), "{name}");
    assert_eq!(told["saved"], "frames", "{name}");
    assert_eq!(told["particles"], read(folder, 0).points.len(), "{name}");
    let header = String::from_utf8_lossy(&bytes(folder, 0)).into_owned();
    assert!(told["precision"] == "f64" && header.contains("property double x\n"), "{name}: {header}");
    for (key, time) in [("dt", time_of(folder, 1)), ("time", time_of(folder, steps))] {
        let off = (told[key].as_f64().expect("a number") - time).abs();
        assert!(off <= 1e-12 * time, "{name}: {key} is {}, not {time}", told[key]);
    }
}

#[test]
fn every_number_is_that_of_the_frames_over_the_run_or_at_its_end() {
    let shipped = |name: &str| {
        let found = shipped_scenes().iter().find(|(known, _)| *known == name);
        found.expect("it is shipped").1.to_owned()
    };
    let timed = timed("drag = 1e-3");
    let mut fallen = 0;
    for (name, text, steps) in [
        ("small", SMALL_SCENE.to_owned(), 40),
        ("timed", timed, 47),
        ("hanging_sheet", shipped("hanging_sheet"), 60),
        ("flag", shipped("flag"), 30),
        ("drap10", shipped("drap10"), 200),
        ("cloth_over_sphere", shipped("cloth_over_sphere"), 90),
    ] {
        let here = folder();
        let scene = write_scene(here.path(), &text);
        let count = steps.to_string();
        let asked =
            ["--steps", &count, "--precision", "f64", "--frame-interval", "1", "--fields", "velocity"];
        let run = ["run", &scene, "--save", "frames", "--json"];
        let told = nappe_in(here.path(), &[&run[..], &asked].concat()).ok().json();
        let number = |key: &str| told[key].as_f64().unwrap_or_else(|| panic!("{key} of {name}: {told}"));

        let parsed = Scene::parse(&text, name).expect("a scene");
        let setup = parsed.build(&NoMeshes, &SceneLimits::default()).expect("it builds").setup;
        let frames: Vec<Numbers> =
            (0..=steps).map(|frame| numbers(&setup, &read(&here.path().join("frames"), frame))).collect();
        let same = |key: &str, expected: f64, share: f64| {
            let off = (number(key) - expected).abs();
            assert!(
                off <= share * expected.abs().max(1e-9),
                "{name}: {key} is {}, not {expected}",
                number(key)
            );
        };

        check_said(name, &told, &here.path().join("frames"), steps);
        assert_eq!((&told["steps"], &told["frames"]), (&steps.into(), &(steps + 1).into()), "{name}");
        let springs: usize = setup.bodies.iter().map(|body| body.network.springs.len()).sum();
        assert_eq!(told["springs"], springs, "{name}");
        let time = |step: usize| step as f64 * setup.dt;
        same("time", time(steps), 1e-12);
        let largest = frames.iter().map(|frame| frame.stretch).fold(0.0, f64::max);
        same("max_stretch", largest, 1e-12);
        // Stretches that differ by rounding alone may be there twice.
        let is_largest = |step: usize| frames[step].stretch >= largest * (1.0 - 1e-12);
        let at = (0..=steps).find(|step| (time(*step) - number("max_stretch_time")).abs() < 1e-9);
        assert!(at.is_some_and(is_largest), "{name}: at {} s", number("max_stretch_time"));
        let scale = frames.iter().map(|frame| frame.energy.abs()).fold(0.0, f64::max);
        let off = (number("energy_at_end") - frames[steps].energy).abs();
        assert!(off <= 1e-9 * scale, "{name}: {} J, not {}", number("energy_at_end"), frames[steps].energy);
        for (collider, pose) in setup.colliders.iter().zip(told["poses_at_end"].as_array().expect("poses")) {
            let position = collider.pose(time(steps)).position;
            assert_eq!(pose["position"], serde_json::json!(position), "{name}");
        }

        let text =
            nappe_in(here.path(), &["run", &scene, "--steps", &count, "--precision", "f64"]).ok().stdout;
        let row =
            format!("{:.4} over the run, at t = {:.3} s", number("max_stretch"), number("max_stretch_time"));
        assert!(text.contains(&row) && text.contains("energy at the end"), "{row}: {text}");
        fallen += usize::from(frames[steps].stretch < largest * (1.0 - 1e-6));
    }
    assert!(fallen > 1, "in some scenes the largest stretch is not the last one");
}

#[test]
fn the_work_of_given_forces_is_that_of_the_last_step() {
    let force = [0.01, 0.02, 0.03];
    let pushed =
        "integrator = \"symplectic_euler\"\nforce = [{ on = \"all\", force = [0.01, 0.02, 0.03] }]\npins = ";
    let dt = 0.001;
    let text = SMALL_SCENE.replace("dt = 0.005", "dt = 0.001").replace("pins = ", pushed);
    let here = folder();
    let scene = write_scene(here.path(), &text);
    let asked = ["--precision", "f64", "--frame-interval", "1", "--fields", "velocity"];
    let run = ["run", &scene, "--save", "frames", "--json"];
    let told = nappe_in(here.path(), &[&run[..], &asked].concat()).ok().json();

    // The force of a kick times the mean of the velocities before it and after it; pins stay where they are.
    let [before, after] = [39, 40].map(|number| read(&here.path().join("frames"), number).velocities);
    let of_particle = |(before, after): (&[f64; 3], &[f64; 3])| {
        (0..3).map(|c| 0.5 * dt * force[c] * (before[c] + after[c])).sum::<f64>()
    };
    let work: f64 = before.iter().zip(&after).map(of_particle).sum();
    let found = told["external_work_at_end"].as_f64().expect("a number");
    assert!(work.abs() > 1e-6 && (found - work).abs() <= 1e-9 * work.abs(), "{found} J, not {work} J");
}

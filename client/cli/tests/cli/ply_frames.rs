//! Frames as PLY files in the precision of their session: those in f64 hold the bits of its state.

use std::{fs, path::Path};

use nappe_scene::{NoMeshes, Scene, SceneLimits, mesh::read_ply};
use nappe_sim::{field::Field, report::NoStopwatch, world::Simulation};

use crate::support::{SMALL_SCENE, Server, folder, nappe_in, write_scene};

/// The small scene in f64.
fn in_f64() -> String {
    SMALL_SCENE.replace("dt = 0.005", "dt = 0.005\nprecision = \"f64\"")
}

/// The bits of the positions in f64 after so many steps of the small scene, computed here.
fn bits_after(steps: u64) -> Vec<u64> {
    let scene = Scene::parse(&in_f64(), "small").expect("a scene");
    let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("it builds");
    let (mut simulation, _) = Simulation::new(&built.setup, scene.precision).expect("it can be computed");
    simulation.apply(&built.initial_changes).expect("it begins");
    for _ in 0..steps {
        simulation.step(&mut NoStopwatch).expect("it holds");
    }
    let mut positions = vec![0.0; Field::Positions.width() * simulation.particle_count()];
    simulation.read(Field::Positions, &mut positions);
    positions.into_iter().map(f64::to_bits).collect()
}

/// The lines of the header that say the types of a file, and the bits of its positions.
fn read(path: &Path) -> (Vec<String>, Vec<u64>) {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let text = String::from_utf8_lossy(&bytes);
    let types = text.lines().take_while(|line| *line != "end_header");
    let types = types.filter_map(|line| line.strip_prefix("property ")).map(str::to_owned).collect();
    let mesh = read_ply(&bytes, "frame.ply").expect("a frame is a mesh").mesh;
    (types, mesh.points.as_flattened().iter().map(|x| x.to_bits()).collect())
}

#[test]
fn frames_of_a_run_in_f64_hold_the_bits_of_its_state() {
    let own = in_f64();
    let asked = ["--precision", "f64"];
    for (text, asked) in [(own.as_str(), &asked[..0]), (SMALL_SCENE, &asked[..])] {
        let here = folder();
        let scene = write_scene(here.path(), text);
        let run = ["run", scene.as_str(), "--steps", "10", "--save", "frames", "--fields", "velocity"];
        nappe_in(here.path(), &[&run[..], asked].concat()).ok();
        for frame in [0_u64, 3, 5] {
            let (types, bits) = read(&here.path().join(format!("frames/frame-{frame:06}.ply")));
            let names = ["double x", "double y", "double z", "double vx", "double vy", "double vz"];
            assert_eq!(types[..6], names, "{asked:?}");
            assert_eq!(bits, bits_after(2 * frame), "frame {frame} {asked:?}");
        }
        // They are no numbers of f32 in a wider type.
        let (_, bits) = read(&here.path().join("frames/frame-000005.ply"));
        assert!(bits.iter().any(|bits| bits % (1 << 29) != 0), "{asked:?}");
    }
}

#[test]
fn frames_of_a_run_in_f32_are_floats() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    nappe_in(here.path(), &["run", &scene, "--steps", "2", "--save", "frames"]).ok();
    let (types, _) = read(&here.path().join("frames/frame-000001.ply"));
    assert_eq!(types, ["float x", "float y", "float z", "list uchar uint vertex_indices"]);
}

#[test]
fn a_watcher_of_a_session_in_f64_saves_the_bits_of_its_state() {
    let here = folder();
    let scene = write_scene(here.path(), &in_f64());
    let server = Server::start();
    server.nappe(&["create", &scene, "--id", "exact"]).ok();
    server.nappe(&["step", "exact", "4"]).ok();
    let watch =
        ["watch", "exact", "--save", "frames", "--from", "2", "--count", "1", "--server", &server.url];
    nappe_in(here.path(), &watch).ok();
    let (types, bits) = read(&here.path().join("frames/frame-000002.ply"));
    assert_eq!((types[0].as_str(), bits), ("double x", bits_after(4)));
}

#[test]
fn the_ends_of_a_sweep_in_f64_hold_the_bits_of_its_runs() {
    let here = folder();
    let scene = write_scene(here.path(), &in_f64());
    let sweep = ["sweep", &scene, "--set", "gravity.1=-9.81", "--steps", "6", "--out", "out", "--save"];
    nappe_in(here.path(), &sweep).ok();
    let (types, bits) = read(&here.path().join("out/run-000000.ply"));
    assert_eq!((types[0].as_str(), bits), ("double x", bits_after(6)));
}

#[test]
fn a_run_starts_from_a_saved_frame_and_goes_on_as_the_whole_run_does() {
    let here = folder();
    let scene = write_scene(here.path(), &in_f64());
    let whole = ["run", scene.as_str(), "--steps", "30", "--save", "whole", "--fields", "velocity"];
    nappe_in(here.path(), &whole).ok();
    let rest = ["run", scene.as_str(), "--steps", "30", "--save", "rest", "--fields", "velocity"];
    let from = ["--start", "whole/frame-000005.ply"];
    nappe_in(here.path(), &[&rest[..], &from].concat()).ok();
    // Frame 0 is the frame that it begins at.
    for frame in [0, 1, 4, 10] {
        let (_, rest) = read(&here.path().join(format!("rest/frame-{frame:06}.ply")));
        let (_, whole) = read(&here.path().join(format!("whole/frame-{:06}.ply", frame + 5)));
        assert_eq!(rest, whole, "frame {frame}");
    }

    for (start, told) in [("whole", None), ("nothing", Some("nothing")), ("scene.toml", Some("scene.toml"))] {
        let done = nappe_in(here.path(), &["run", &scene, "--steps", "31", "--start", start]);
        match told {
            None => drop(done.ok()),
            Some(told) => assert!(done.code == Some(1) && done.stderr.contains(told), "{done:?}"),
        }
    }
    let done = nappe_in(here.path(), &["run", "hanging_sheet", "--steps", "31", "--start", "whole"]);
    assert!(done.stderr.contains("has 144 particles, and the scene has") && done.code == Some(1), "{done:?}");
}

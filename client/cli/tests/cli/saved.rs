//! `--save FILE.pvd`, `FILE.usda` and `FILE.csv`, whatever the scene is and however the run ends: the same bytes again, names of all
//! kinds, and files that are whole or stay as they were.

use std::{fmt::Write as _, fs, path::Path};

use crate::{
    kept::{begun, contents},
    run::DIVERGING_SCENE,
    snow::SNOW_SCENE,
    support::{SMALL_SCENE, end_by, folder, nappe_in, write_scene},
    table,
    usd::{Scene, numbers, samples, value},
    vtk::{Vtp, check_whole, listed},
};

/// Each form, what shows that a run writes it, and what shows it where an earlier run is to be replaced.
const FORMS: [[&str; 3]; 3] = [
    ["run.pvd", "run/frame-000005.vtp", "run/frames.new/frame-000005.vtp"],
    ["run.usda", "run.usda.new.samples", "run.usda.new.samples"],
    ["run.csv", "run.csv.new", "run.csv.new"],
];

/// The frames of a run of a sheet, each of which is whole.
fn frame_count(here: &Path, save: &str) -> usize {
    match save {
        "run.pvd" => check_whole(here, save),
        "run.usda" => {
            let scene = Scene::read(&here.join(save));
            let prim = scene.prim("Mesh", "sheet");
            let arrays = ["point3f[] points", "vector3f[] velocities", "float3[] extent"];
            let [points, velocities, extents] = arrays.map(|array| samples(&prim, array).len());
            assert_eq!([points; 2], [velocities, extents], "every array has all times");
            points
        }
        _ => table::read(&here.join(save)).1.len(),
    }
}

/// A scene without an end.
fn endless(here: &Path) -> String {
    write_scene(here, &SMALL_SCENE.replace("steps = 40", "steps = 0"))
}

#[test]
fn the_same_run_gives_the_same_bytes_on_any_number_of_threads() {
    let fields = ["--fields", "velocity,plastic_ratio,stress"];
    for text in [SMALL_SCENE, SNOW_SCENE] {
        let [one, two] = ["1", "2"].map(|threads| {
            let here = folder();
            let scene = write_scene(here.path(), text);
            for (save, more) in [("run.pvd", &fields[..]), ("run.usda", &fields[..]), ("run.csv", &[][..])] {
                let run = ["run", scene.as_str(), "--steps", "8", "--threads", threads, "--save", save];
                nappe_in(here.path(), &[&run[..], more].concat()).ok();
            }
            let (names, mut rows) = table::read(&here.path().join("run.csv"));
            let clock = names.iter().position(|name| name == "step_seconds").expect("a column");
            for row in &mut rows {
                row.remove(clock);
            }
            let mut files = contents(here.path());
            files.remove("run.csv");
            (files, rows)
        });
        assert!(one.0.len() > 6, "{:?}", one.0.keys());
        assert!(one.0 == two.0, "{:?} and {:?}", one.0.keys(), two.0.keys());
        assert_eq!(one.1, two.1);
    }
}

/// What bodies and colliders are called, and what becomes of it in USD; a body is not called as the camera.
const NAMES: [(&str, &str); 9] = [
    ("12", "_12"),
    ("a \"b\" <&>", "a__b_____"),
    ("a/b", "a_b"),
    ("a-b", "a_b_2"),
    ("a_b", "a_b_3"),
    ("😀", "_"),
    ("é", "__2"),
    ("camera", "camera_2"),
    ("back\\slash", "back_slash"),
];

#[test]
fn bodies_and_colliders_keep_their_names_whatever_these_are() {
    let mut text = "version = 1\ndt = 0.01\nsteps = 2\n".to_owned();
    for (number, (name, _)) in NAMES.iter().enumerate() {
        // Writing into a string does not fail.
        let _ = write!(
            text,
            "[[body]]\nname = {name:?}\nmesh = {{ grid = [3, 3], spacing = 0.1 }}\nmass = {{ particle = 0.01 }}\n\
             springs = {{ stretch = {{ stiffness = 100.0 }} }}\n\
             [[collider]]\nname = {name:?}\nsphere = {{ center = [0, -9, {number}], radius = 0.25 }}\n"
        );
    }
    let here = folder();
    let scene = write_scene(here.path(), &text);
    for save in ["r&d 'x'.pvd", "run.usda", "run.csv"] {
        nappe_in(here.path(), &["run", &scene, "--save", save]).ok();
    }
    let called = NAMES.map(|(name, _)| name);
    let index = fs::read_to_string(here.path().join("r&d 'x'.pvd")).expect("an index");
    assert!(index.contains(" file=\"r&amp;d 'x'/frame-000000.vtp\"/>"), "{index}");
    let file = |name: &str| Vtp::read(&here.path().join("r&d 'x'").join(name));
    assert_eq!(file("frame-000000.vtp").texts("body_names"), called);
    assert_eq!(file("colliders-000000.vtp").texts("collider_names"), called);

    let usd = Scene::read(&here.path().join("run.usda"));
    for (name, prim) in NAMES {
        let quoted = format!("\"{}\"", name.replace('\\', "\\\\").replace('"', "\\\""));
        let of_collider = if prim == "camera_2" { "camera" } else { prim };
        for found in [usd.prim("Mesh", prim), usd.prim("Sphere", of_collider)] {
            assert_eq!(value(&found, "string name"), quoted);
        }
    }
    let rows = fs::read_to_string(here.path().join("run.csv")).expect("a table");
    for column in [
        ",load_12_force_x,",
        ",\"load_a \"\"b\"\" <&>_force_x\",",
        ",load_a/b_torque_z,",
        ",load_😀_contacts,",
    ] {
        assert!(rows.lines().next().is_some_and(|names| names.contains(column)), "{column} in {rows}");
    }
}

#[test]
fn a_single_particle_of_cloth_or_snow_is_a_scene() {
    let alone = "version = 1\ndt = 0.01\nsteps = 2\n[[body]]\nname = \"block\"\n\
                 mesh = { chain = 1, spacing = 0.1 }\nmass = { particle = 0.01 }\n";
    for text in [alone, &SNOW_SCENE.replace("particles = 216", "particles = 1")] {
        let here = folder();
        let scene = write_scene(here.path(), text);
        for [save, ..] in FORMS {
            nappe_in(here.path(), &["run", &scene, "--steps", "2", "--save", save]).ok();
        }
        let (_, file) = listed(&here.path().join("run.pvd"), "particles").pop().expect("a frame");
        let vtp = Vtp::read(&here.path().join(file));
        assert_eq!((vtp.count("NumberOfPoints"), vtp.count("NumberOfVerts")), (1, 1));
        let usd = Scene::read(&here.path().join("run.usda"));
        let prim = usd.prim("Points", "block");
        let (width, _) = value(&prim, "float[] widths").split_once(' ').expect("and what it is of");
        let width = numbers(width)[0];
        assert!(width > 0.0 && width < 1.0, "{width}");
        for ((_, point), (_, extent)) in
            samples(&prim, "point3f[] points").iter().zip(samples(&prim, "float3[] extent"))
        {
            let (point, extent) = (numbers(point), numbers(extent));
            assert_eq!((point.len(), extent.len()), (3, 6));
            assert!((0..3).all(|axis| extent[axis] < point[axis] && point[axis] < extent[axis + 3]));
        }
        assert!(table::read(&here.path().join("run.csv")).1.len() > 1);
    }
}

#[test]
fn a_scene_that_is_twenty_kilometres_away_is_where_it_is() {
    let far = [20_000.0, 0.0, -20_000.0];
    let moved = SMALL_SCENE.replace("pins =", "transform = { translate = [20000, 0, -20000] }\npins =")
        + "[[collider]]\nname = \"ball\"\nsphere = { center = [20000, -2, -20000], radius = 0.5 }\nvelocity = [0, 1, 0]\n";
    let here = folder();
    let scene = write_scene(here.path(), &moved);
    for save in ["run.pvd", "run.usda"] {
        nappe_in(here.path(), &["run", &scene, "--steps", "4", "--precision", "f64", "--save", save]).ok();
    }
    let near = |point: &[f64], reach: f64| (0..3).all(|axis| (point[axis] - far[axis]).abs() < reach);
    for (time, file) in listed(&here.path().join("run.pvd"), "particles") {
        let points = Vtp::read(&here.path().join(file)).points();
        assert!(points.len() == 144 && points.iter().all(|point| near(point, 1.0)), "{time}");
        // Their spacing needs more digits than binary32 has so far away.
        assert!((points[1][0] - points[0][0] - 0.05).abs() < 1e-4, "{time}");
    }
    for (time, file) in listed(&here.path().join("run.pvd"), "colliders") {
        let colliders = Vtp::read(&here.path().join(file));
        assert_eq!(colliders.numbers("collider_position"), [far[0], time - 2.0, far[2]]);
        let middle = [far[0], time - 2.0, far[2]];
        for point in colliders.points() {
            let square: f64 = [0, 1, 2].map(|axis| (point[axis] - middle[axis]).powi(2)).iter().sum();
            assert!((square.sqrt() - 0.5).abs() < 1e-9, "{point:?}");
        }
    }
    let usd = Scene::read(&here.path().join("run.usda"));
    let sheet = usd.prim("Mesh", "sheet");
    for (_, points) in samples(&sheet, "point3f[] points") {
        assert!(numbers(points).as_chunks::<3>().0.iter().all(|point| near(point, 1.0)));
    }
    for (code, matrix) in samples(&usd.prim("Sphere", "ball"), "matrix4d xformOp:transform") {
        let matrix = numbers(matrix);
        assert_eq!([matrix[12], matrix[14]], [far[0], far[2]]);
        assert!((matrix[13] + 2.0 - 0.01 * code).abs() < 1e-12, "{matrix:?}");
    }
    let camera = usd.prim("Camera", "camera");
    assert!(near(&numbers(value(&camera, "matrix4d xformOp:transform"))[12..15], 10.0), "it sees the sheet");
}

#[test]
fn a_run_that_fails_in_its_first_step_leaves_the_frame_before_it() {
    let here = folder();
    let scene = write_scene(here.path(), &format!("{DIVERGING_SCENE}[body.limits]\nmax_stretch = 1.05\n"));
    for [save, ..] in FORMS {
        let done = nappe_in(here.path(), &["run", &scene, "--json", "--save", save]);
        assert_eq!(done.code, Some(3), "{done:?}");
        let told = done.json();
        assert_eq!(told["diverged"]["step"], 0, "{told}");
        let count = frame_count(here.path(), save);
        assert!(count > 0 && told["frames"] == count, "{count} frames, {told}");
    }
    assert!(contents(here.path()).keys().all(|name| !name.contains(".new")));
}

#[test]
fn a_killed_run_leaves_the_earlier_files_whole_and_what_it_left_is_in_nobodys_way() {
    for [save, _, file] in FORMS {
        let here = folder();
        let scene = write_scene(here.path(), SMALL_SCENE);
        nappe_in(here.path(), &["run", &scene, "--steps", "4", "--save", save]).ok();
        endless(here.path());
        let before = contents(here.path());
        let mut run = begun(here.path(), save, file);
        run.kill().expect("it runs");
        run.wait().expect("it ends");
        let mut after = contents(here.path());
        after.retain(|name, _| !name.contains(".new"));
        assert!(after == before, "{save}: {:?} and {:?}", after.keys(), before.keys());
        assert_eq!(frame_count(here.path(), save), 3, "{save}");

        nappe_in(here.path(), &["run", &scene, "--steps", "2", "--force", "--save", save]).ok();
        assert_eq!(frame_count(here.path(), save), 2, "{save}");
        let names = contents(here.path());
        assert!(names.keys().all(|name| !name.contains(".new")), "{save}: {:?}", names.keys());
    }
}

#[cfg(unix)]
#[test]
fn one_run_at_a_time_has_a_name_and_what_the_user_ends_is_whole_up_to_there() {
    for [save, file, _] in FORMS {
        let here = folder();
        let scene = endless(here.path());
        let mut run = begun(here.path(), save, file);
        let other = |more: &[&str]| {
            let second = nappe_in(here.path(), &[&["run", &scene, "--steps", "2"][..], more].concat());
            assert_eq!(second.code, Some(1), "{save} {more:?}: {second:?}");
            second.stderr
        };
        other(&["--save", save]);
        let told = other(&["--force", "--save", save]);
        assert!(told.contains("another run"), "{save}: {told}");
        if save == "run.pvd" {
            let told = other(&["--force", "--save", "run"]);
            assert!(told.contains("another run is writing into the folder run"), "{told}");
        }
        assert_eq!(end_by(&mut run, "INT"), Some(130));
        assert!(frame_count(here.path(), save) > 0, "{save}");
        let names = contents(here.path());
        assert!(names.keys().all(|name| !name.contains(".new")), "{save}: {:?}", names.keys());
    }
}

#[cfg(target_os = "linux")]
#[test]
fn a_disk_that_is_full_is_told_with_the_file_and_the_frame() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    fs::create_dir(here.path().join("run")).expect("a folder");
    for (save, full, told) in [
        ("run.pvd", "run/frame-000001.vtp.new", "cannot write run/frame-000001.vtp: "),
        ("run.usda", "run.usda.new.samples", "frame 0: cannot write run.usda.new.samples: "),
        ("run.csv", "run.csv", "frame 0: cannot write run.csv: "),
        ("full.usda", "full.usda", "full.usda is no plain file"),
        ("full.pvd", "full.pvd", "full.pvd is no plain file"),
    ] {
        std::os::unix::fs::symlink("/dev/full", here.path().join(full)).expect("a link");
        let done = nappe_in(here.path(), &["run", &scene, "--save", save]);
        assert!(done.code == Some(1) && done.stderr.contains(told), "{save}: {done:?}");
        // The others are whole, or nothing has the name.
        if save == "run.pvd" {
            assert_eq!(frame_count(here.path(), save), 1);
        }
        // One that stands for the file itself stays.
        let _ = fs::remove_file(here.path().join(full));
    }
    let names: Vec<String> = contents(here.path()).into_keys().collect();
    assert_eq!(names, ["run", "run.pvd", "run/frame-000000.vtp", "scene.toml"]);
}

#[test]
fn a_place_that_is_none_is_told_before_anything_is_computed() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    for save in ["scene.toml/run.pvd", "scene.toml/run.usda", "scene.toml/run.csv"] {
        let done = nappe_in(here.path(), &["run", &scene, "--save", save]);
        assert_eq!((done.code, done.stdout.as_str()), (Some(1), ""), "{save}: {done:?}");
        assert!(done.stderr.contains("scene.toml/run"), "{save}: {}", done.stderr);
    }
    assert_eq!(contents(here.path()).len(), 1, "the scene alone is there");
}

#[test]
fn a_vector_takes_little_more_than_its_digits_in_a_scene_of_usd() {
    let here = folder();
    nappe_in(here.path(), &["run", "demo", "--steps", "80", "--save", "run.usda"]).ok();
    let file = here.path().join("run.usda");
    let scene = Scene::read(&file);
    let prim = scene.prim("Mesh", "cloth");
    let particles = numbers(samples(&prim, "point3f[] points")[0].1).len() / 3;
    // Two vectors of each particle a frame; triangles, colliders and a camera beside them.
    let vectors = 2 * particles * samples(&prim, "float3[] extent").len();
    let size = fs::metadata(&file).expect("the file").len();
    // A number of binary32 has 8 or 9 digits, a point, half a sign and a comma: 33 bytes for three. Small velocities need an
    // exponent, too.
    assert!(particles == 7744 && size < 36 * vectors as u64, "{size} bytes for {vectors} vectors");
}

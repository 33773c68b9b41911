//! `nappe sweep` and its files: meshes that change, one sweep per folder, pictures, what is left when it is ended.

use std::{
    fs::{self, File},
    path::Path,
    process::Stdio,
};

use serde_json::Value;

use crate::support::{Done, SMALL_SCENE, command, end_by, folder, nappe_in, until, write_scene};

/// A scene whose mesh is in a file.
const MESH_SCENE: &str = r#"
version = 1
dt = 0.005
steps = 4

[[body]]
name = "sheet"
mesh = { file = "m.obj" }
mass = { density = 0.2 }
[body.springs]
stretch = { stiffness = 100.0, damping = 0.02 }
"#;

fn mesh(folder: &Path, grid: &str, file: &str) {
    nappe_in(folder, &["mesh", "grid", grid, "--spacing", "0.1", "--out", file, "--force"]).ok();
}

fn sweep(folder: &Path, args: &[&str]) -> Done {
    nappe_in(folder, &[&["sweep", "scene.toml", "--out", "out"], args].concat())
}

fn text(folder: &Path, file: &str) -> String {
    fs::read_to_string(folder.join(file)).unwrap_or_else(|error| panic!("{file}: {error}"))
}

/// What sweep.json says.
fn description(folder: &Path) -> Value {
    serde_json::from_str(&text(folder, "out/sweep.json")).expect("JSON")
}

/// The files of a description, each with whether it has a hash.
fn files(folder: &Path) -> Vec<(String, bool)> {
    let description = description(folder);
    let files = description["files"].as_array().expect("an array").iter();
    files.map(|file| (file["file"].as_str().expect("a name").to_owned(), file["hash"].is_string())).collect()
}

/// A sweep is refused with these words, and rows that are there stay as they are.
#[track_caller]
fn check_refused(folder: &Path, args: &[&str], words: &[&str]) {
    let before = text(folder, "out/sweep.csv");
    let done = sweep(folder, args);
    assert_eq!(done.code, Some(2), "{done:?}");
    for words in words {
        assert!(done.stderr.contains(words), "{words}: {}", done.stderr);
    }
    assert!(done.stderr.contains("--force begins anew"), "{}", done.stderr);
    assert_eq!(text(folder, "out/sweep.csv"), before);
}

#[test]
fn a_sweep_goes_on_with_the_meshes_and_the_scene_that_it_began_with_and_no_others() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, MESH_SCENE);
    mesh(here, "4x4", "m.obj");
    let args = ["--set", "body.sheet.springs.stretch.stiffness=50,100"];
    sweep(here, &args).ok();
    assert_eq!(files(here), [("m.obj".to_owned(), true)]);
    // As if it had been ended after its first row.
    let whole = text(here, "out/sweep.csv");
    let cut: String = whole.split_inclusive('\n').take(2).collect();
    fs::write(here.join("out/sweep.csv"), &cut).expect("rows");

    fs::rename(here.join("m.obj"), here.join("n.obj")).expect("it is renamed");
    check_refused(here, &args, &["m.obj cannot be read any more"]);
    mesh(here, "3x3", "m.obj");
    check_refused(
        here,
        &args,
        &["m.obj changed since the sweep began: its rows were made with another mesh"],
    );
    fs::rename(here.join("n.obj"), here.join("m.obj")).expect("it is renamed");
    fs::write(here.join("scene.toml"), MESH_SCENE.replace("0.2", "0.3")).expect("a scene");
    check_refused(here, &args, &["scene.toml changed since the sweep began"]);
    fs::write(here.join("scene.toml"), MESH_SCENE).expect("a scene");
    check_refused(here, &[&args[..], &["--steps", "3"]].concat(), &["the arguments are others (--steps)"]);

    sweep(here, &args).ok();
    let without_seconds = |text: &str| {
        let rows = text.lines().map(|line| line.rsplit_once(',').map_or("", |(row, _)| row).to_owned());
        rows.collect::<Vec<_>>()
    };
    assert_eq!(without_seconds(&text(here, "out/sweep.csv")), without_seconds(&whole));
}

#[test]
fn meshes_that_values_name_are_part_of_a_sweep_packed_ones_and_sets_too() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, MESH_SCENE);
    mesh(here, "4x4", "m.obj");
    mesh(here, "3x3", "set");
    let args = ["--set", "body.sheet.mesh.file=set,missing.obj"];
    sweep(here, &args).ok();
    let names: Vec<String> = files(here).into_iter().map(|(name, _)| name).collect();
    assert!(names.iter().all(|name| name != "m.obj"), "no run names it: {names:?}");
    assert!(names.contains(&"set/points.eti".to_owned()), "{names:?}");
    assert!(files(here).contains(&("missing.obj".to_owned(), false)), "{names:?}");
    let rows = text(here, "out/sweep.csv");
    assert!(rows.contains(",ok,,") && rows.contains(",refused,"), "{rows}");

    mesh(here, "3x3", "missing.obj");
    check_refused(here, &args, &["missing.obj could not be read when the sweep began"]);
    fs::remove_file(here.join("missing.obj")).expect("it is there");
    fs::remove_file(here.join("set/faceset.eti")).expect("it is there");
    check_refused(here, &args, &["set/faceset.eti is no longer among its meshes"]);
}

#[test]
fn two_sweeps_do_not_run_in_one_folder() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, SMALL_SCENE);
    fs::create_dir(here.join("out")).expect("a folder");
    let lock = File::create(here.join("out/sweep.lock")).expect("a file");
    lock.try_lock().expect("nobody has it");
    let args = ["--set", "gravity.1=0,-1", "--steps", "2"];
    let done = sweep(here, &args);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("another sweep is running in out"), "{}", done.stderr);
    assert!(!here.join("out/sweep.csv").exists());
    drop(lock);
    sweep(here, &args).ok();
}

#[cfg(feature = "charts")]
#[test]
fn a_sweep_over_one_key_or_two_has_a_picture_and_others_say_why_not() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, SMALL_SCENE);
    let one = ["--set", "body.sheet.drag=0,0.001,0.01", "--steps", "2"];
    let two = [&one[..], &["--set", "body.sheet.integrator=explicit_euler,bdf2", "--force"]].concat();
    for (args, words) in [
        (&one[..], &["body.sheet.drag (N s/m)", "energy_j", "max_stretch"][..]),
        (&two[..], &["body.sheet.drag (N s/m)", "body.sheet.integrator<", "max_stretch"]),
    ] {
        let done = sweep(here, args).ok();
        assert!(done.stdout.contains("out/sweep.svg"), "{}", done.stdout);
        crate::support::check_pictures(&here.join("out"), &["sweep.svg", "sweep.png"]);
        let picture = text(here, "out/sweep.svg");
        for words in words {
            assert!(picture.contains(words), "{words}");
        }
    }
    for (set, why) in [
        (
            &["gravity.1=0", "wind.0=1,2", "wind.1=1,2"][..],
            "no picture: it shows one key or two, and there are 3",
        ),
        (&["gravity.1=0"], "no picture: it compares runs, and there is one"),
    ] {
        let sets = set.iter().flat_map(|set| ["--set", set]);
        let args: Vec<&str> = sets.chain(["--steps", "2", "--force"]).collect();
        let done = sweep(here, &args).ok();
        assert!(done.stderr.contains(why), "{}", done.stderr);
        assert!(!here.join("out/sweep.svg").exists(), "that of another sweep");
    }
}

#[test]
fn what_ends_a_sweep_leaves_its_rows_and_says_that_they_are_not_all() {
    for signal in ["INT", "TERM"] {
        let folder = folder();
        let here = folder.path();
        write_scene(here, SMALL_SCENE);
        // The second run has no end that anybody would see.
        let mut process = command();
        let args = ["sweep", "scene.toml", "--out", "out", "--threads", "1", "--set", "steps=2,1000000000"];
        process.current_dir(here).args(args).stdout(Stdio::null()).stderr(Stdio::null());
        let mut process = process.spawn().expect("it starts");
        let table = here.join("out/sweep.csv");
        until("a row", || fs::read_to_string(&table).is_ok_and(|text| text.lines().count() == 2));
        assert_eq!(description(here)["complete"], false);
        assert_eq!(end_by(&mut process, signal), Some(130), "SIG{signal}");
        assert_eq!(description(here)["complete"], false);
        let rows = text(here, "out/sweep.csv");
        assert!(rows.lines().count() == 2 && rows.contains(",ok,,"), "{rows}");
    }
}

#[cfg(target_os = "linux")]
#[test]
fn on_a_full_disk_a_sweep_keeps_its_rows_and_names_the_file() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, SMALL_SCENE);
    let args = ["--set", "gravity.1=0,-1", "--steps", "2"];
    let said = sweep(here, &[&args[..], &["--json"]].concat()).ok().json();
    assert_eq!((said["complete"].as_bool(), said["rows"].as_u64()), (Some(true), Some(2)));
    assert_eq!(description(here)["complete"], true);
    let whole = text(here, "out/sweep.csv");
    std::os::unix::fs::symlink("/dev/full", here.join("out/sweep.csv.new")).expect("a link");
    let done = sweep(here, &args);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stderr.contains("cannot write out/sweep.csv: "), "{}", done.stderr);
    assert_eq!(text(here, "out/sweep.csv"), whole);
    assert!(fs::symlink_metadata(here.join("out/sweep.csv.new")).is_err(), "it is gone");
    sweep(here, &args).ok();
}

#[test]
fn a_table_with_other_columns_is_not_overwritten() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, SMALL_SCENE);
    let args = ["--set", "gravity.1=0,-1", "--steps", "2"];
    sweep(here, &args).ok();
    fs::write(here.join("out/sweep.csv"), "a,b\n1,2\n").expect("a table");
    check_refused(here, &args, &["out/sweep.csv does not begin with the columns of this sweep"]);
}

#[test]
fn a_folder_is_made_with_those_that_it_is_in_and_a_file_is_none() {
    let folder = folder();
    let here = folder.path();
    write_scene(here, SMALL_SCENE);
    let args = ["sweep", "scene.toml", "--set", "gravity.1=0,-1", "--steps", "2", "--out"];
    nappe_in(here, &[&args[..], &["deep/er/out"]].concat()).ok();
    assert!(here.join("deep/er/out/sweep.csv").exists());
    let done = nappe_in(here, &[&args[..], &["scene.toml"]].concat());
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("scene.toml: is a file; a folder is needed"), "{}", done.stderr);
    let done = nappe_in(here, &[&args[..], &["scene.toml/out"]].concat());
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stderr.contains("scene.toml/out"), "{}", done.stderr);
}

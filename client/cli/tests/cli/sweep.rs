//! `nappe sweep`: rows in order, the same after it was killed, and what it refuses before anything runs.

use std::{fs, path::Path, process::Stdio};

use serde_json::Value;

use crate::support::{SMALL_SCENE, command, folder, nappe_in, until, write_scene};

const HEADER: &str = "run,body.sheet.springs.bend.stiffness,gravity.1,steps,time_s,energy_j,max_stretch,state_hash,outcome,cause,seconds";

/// Rows without their seconds.
fn rows(folder: &Path) -> Vec<String> {
    let table = fs::read_to_string(folder.join("sweep.csv")).expect("sweep.csv");
    table.lines().map(|line| line.rsplit_once(',').map_or("", |(row, _)| row).to_owned()).collect()
}

#[test]
fn a_row_per_combination_and_each_is_the_run_of_that_scene() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let sets = ["--set", "body.sheet.springs.bend.stiffness=5,20", "--set", "gravity.1=-9.81,-1,0"];
    let args = [&["sweep", &scene, "--out", "out", "--save", "--json"], &sets[..]].concat();
    let said = nappe_in(folder.path(), &args).ok().json();
    assert_eq!(
        (said["runs"].as_u64(), said["rows"].as_u64(), said["ok"].as_u64()),
        (Some(6), Some(6), Some(6))
    );
    let out = folder.path().join("out");
    let found = rows(&out);
    assert_eq!(format!("{},seconds", found[0]), HEADER);
    let starts: Vec<String> =
        (0..6).map(|run| found[run + 1].split(',').take(3).collect::<Vec<_>>().join(",")).collect();
    assert_eq!(starts, ["0,5,-9.81", "1,5,-1", "2,5,0", "3,20,-9.81", "4,20,-1", "5,20,0"]);
    assert!((0..6).all(|run| out.join(format!("run-{run:06}.ply")).exists()));

    // The scene as it is written has a bend of 20 N/m.
    let whole = nappe_in(folder.path(), &["run", &scene, "--json"]).ok();
    let whole: Value = serde_json::from_str(whole.stdout.lines().last().expect("a line")).expect("JSON");
    let hash = whole["state_hash"].as_str().expect("a hash");
    assert!(found[4].contains(hash) && !found[1].contains(hash), "{hash} in {found:?}");

    // Once more it does nothing, on another number of threads; with others it refuses the folder.
    let again = [&args[..], &["--threads", "1"]].concat();
    nappe_in(folder.path(), &again).ok();
    assert_eq!(rows(&out), found);
    let other = nappe_in(folder.path(), &["sweep", &scene, "--out", "out", "--set", "gravity.1=0"]);
    assert_eq!(other.code, Some(2), "{other:?}");
    assert!(other.stderr.contains("holds another sweep"), "{}", other.stderr);
    let forced = ["sweep", &scene, "--out", "out", "--set", "gravity.1=0", "--force"];
    nappe_in(folder.path(), &forced).ok();
    assert_eq!(rows(&out).len(), 2, "a header and a row: nothing is left of the other sweep");
    assert!(!out.join("run-000000.ply").exists(), "nor of its ends");
}

#[test]
fn a_sweep_that_was_killed_and_started_again_has_the_rows_of_one_that_was_not() {
    let folder = folder();
    let args = |out: &str| {
        let sample = ["sweep", "hanging_sheet", "--set", "body.sheet.drag=0.0001..0.01", "--sample", "12"];
        [&sample[..], &["--seed", "3", "--steps", "60", "--out", out]]
            .concat()
            .iter()
            .map(|s| (*s).to_owned())
            .collect::<Vec<_>>()
    };
    let run = |out: &str| {
        let args = args(out);
        nappe_in(folder.path(), &args.iter().map(String::as_str).collect::<Vec<_>>()).ok()
    };
    run("whole");
    let mut process = command();
    let mut process = process
        .current_dir(folder.path())
        .args(args("cut"))
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    let table = folder.path().join("cut/sweep.csv");
    until("a row", || fs::read_to_string(&table).is_ok_and(|text| text.lines().count() > 2));
    process.kill().expect("it is killed");
    process.wait().expect("it ends");
    // And a line that was cut off.
    let text = fs::read_to_string(&table).expect("rows");
    fs::write(&table, format!("{text}11,0.0")).expect("a line");
    run("cut");
    let [whole, cut] = ["whole", "cut"].map(|name| rows(&folder.path().join(name)));
    assert_eq!(whole.len(), 13);
    assert_eq!(whole, cut);
}

#[test]
fn a_run_that_fails_is_a_row_with_its_cause() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    // Explicit Euler without damping takes no step.
    let set = ["--set", "body.sheet.integrator=explicit_euler,implicit_euler"];
    nappe_in(folder.path(), &[&["sweep", &scene, "--out", "out"], &set[..]].concat()).ok();
    let found = rows(&folder.path().join("out"));
    assert!(found[1].contains(",refused,") || found[1].contains(",failed,"), "{found:?}");
    assert!(found[2].ends_with(",ok,"), "{found:?}");
}

#[test]
fn what_cannot_be_swept_is_refused_before_anything_runs() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let many = (0..400).map(|i| i.to_string()).collect::<Vec<_>>().join(",");
    let many = [format!("gravity.0={many}"), format!("gravity.1={many}")];
    for (sets, part) in [
        (&["body.sheet.springs.bend.stifness=1"][..], "did you mean 'body.sheet.springs.bend.stiffness'?"),
        (&["body.sheet.springs=1"], "is a table or an array"),
        (&["body.sheet.drag=1,-1,-2"], "body.sheet.drag = -2"),
        (&["dt=0.01", "dt=0.02"], "the key is set twice"),
        (&["dt=0.01..0.02"], "--sample N"),
        (&["dt"], "is no KEY=V,V,..."),
        (&[&many[0], &many[1]], "more than 100000 combinations"),
    ] {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let done = nappe_in(folder.path(), &[&["sweep", &scene, "--out", "out"], &sets[..]].concat());
        assert_eq!(done.code, Some(2), "{sets:?}: {done:?}");
        assert!(done.stderr.contains(part), "{sets:?}: {}", done.stderr);
    }
    assert!(!folder.path().join("out").exists(), "nothing was run");
}

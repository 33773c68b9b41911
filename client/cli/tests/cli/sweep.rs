//! `nappe sweep`: rows in order, the same after it was killed, and what it refuses before anything runs.

use std::{fs, path::Path, process::Stdio};

use nappe_scene::mesh::read_ply;
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
    assert!(other.stderr.contains("holds another sweep: the arguments are others"), "{}", other.stderr);
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
        (&["dt=0.01,0.02,0.01"], "the value 0.01 is there twice"),
        (&["wind=[1,0,0],[2,0"], "ends before ]"),
        (&["wind=1,[2,0,0]"], "such as wind.0"),
        (&["wind=[1,0]"], "wind = [1,0]"),
        (&[&many[0], &many[1]], "more than 100000 combinations"),
    ] {
        let sets: Vec<&str> = sets.iter().flat_map(|set| ["--set", set]).collect();
        let done = nappe_in(folder.path(), &[&["sweep", &scene, "--out", "out"], &sets[..]].concat());
        assert_eq!(done.code, Some(2), "{sets:?}: {done:?}");
        assert!(done.stderr.contains(part), "{sets:?}: {}", done.stderr);
    }
    assert!(!folder.path().join("out").exists(), "nothing was run");
}

/// The fields of a row that has no quotes.
fn fields(row: &str) -> Vec<&str> {
    row.split(',').collect()
}

#[test]
fn lists_are_values_of_keys_that_lead_to_lists() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let run = |out: &str, sets: &[&str]| {
        let sets = sets.iter().flat_map(|set| ["--set", set]);
        let args = ["sweep", &scene, "--steps", "3", "--out", out];
        nappe_in(folder.path(), &args.into_iter().chain(sets).collect::<Vec<_>>()).ok();
        rows(&folder.path().join(out))
    };
    let lists = run(
        "lists",
        &["wind=[1,0,0],[2,0,0]", "body.sheet.pins=[\"top_left\"],[\"top_left\", \"top_right\"]"],
    );
    assert_eq!(lists.len(), 5);
    assert!(lists[1].starts_with("0,\"[1,0,0]\",\"[\"\"top_left\"\"]\","), "{lists:?}");
    assert!(lists[1..].iter().all(|row| row.ends_with(",ok,")), "{lists:?}");
    // The scene has both pins.
    let single = run("single", &["wind.0=2"]);
    let hash = fields(&single[1])[6];
    assert!(lists[4].contains(hash) && !lists[3].contains(hash), "{hash} in {lists:?}");
}

#[test]
fn runs_with_other_steps_end_at_the_same_time_or_are_refused() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    // The scene ends at 0.2 s.
    for (name, asked, ends) in [
        ("until", &["--until", "0.1"][..], [("20", 0.1), ("10", 0.1)]),
        ("own", &[], [("40", 0.2), ("20", 0.2)]),
    ] {
        let args = ["sweep", &scene, "--set", "dt=0.005,0.01,0.03", "--out", name];
        nappe_in(folder.path(), &[&args[..], asked].concat()).ok();
        let found = rows(&folder.path().join(name));
        for (row, (steps, time)) in found[1..].iter().zip(ends) {
            let row = fields(row);
            assert_eq!(row[2], steps, "{found:?}");
            assert!((row[3].parse::<f64>().expect("a time") - time).abs() < 1e-12, "{found:?}");
        }
        assert!(found[3].contains("refused") && found[3].contains("is no multiple"), "{found:?}");
        assert!(found[3].contains("the nearest are "), "{found:?}");
    }
    let own = ["sweep", &scene, "--set", "steps=2,3", "--out", "steps"];
    nappe_in(folder.path(), &own).ok();
    let found = rows(&folder.path().join("steps"));
    assert_eq!([fields(&found[1])[2], fields(&found[2])[2]], ["2", "3"]);
    for wrong in [&["--until", "1", "--steps", "3"][..], &["--until", "0"]] {
        let args = ["sweep", &scene, "--set", "dt=0.005,0.01", "--out", "wrong"];
        let done = nappe_in(folder.path(), &[&args[..], wrong].concat());
        assert_eq!(done.code, Some(2), "{done:?}");
    }
}

/// The small scene in f64, with an object of snow beside it.
fn with_snow() -> String {
    let scene = SMALL_SCENE.replace("dt = 0.005", "dt = 0.005\nprecision = \"f64\"");
    scene
        + "\n[snow]\ncell = 0.1\n[[snow.object]]\nname = \"ball\"\nbox = { center = [3, 0, 0], size = [0.3, 0.3, 0.3] }\n\
           particles = 100\nmaterial = { young = 1.4e5, poisson = 0.2, density = 400 }\n"
}

#[test]
fn measures_are_those_of_the_end_that_is_kept() {
    let folder = folder();
    let scene = write_scene(folder.path(), &with_snow());
    let measures = [
        "body.sheet.lowest",
        "body.sheet.highest",
        "body.sheet.centre.x",
        "body.sheet.centre.y",
        "body.sheet.particle.17.y",
        "snow.ball.lowest",
        "snow.ball.particle.3.z",
        "snow.ball.fastest",
    ];
    let (first, others) = (measures[0], measures[1..].join(","));
    let args = ["sweep", &scene, "--set", "gravity.1=-9.81,-1", "--steps", "4", "--out", "out", "--save"];
    let asked = ["--measure", first, "--measure", &others];
    nappe_in(folder.path(), &[&args[..], &asked].concat()).ok();
    let out = folder.path().join("out");
    let found = rows(&out);
    let columns = fields(&found[0]);
    let before = columns.iter().position(|name| *name == "max_stretch").expect("a column");
    assert_eq!(columns[before + 1..before + 1 + measures.len()], measures);
    for (run, gravity) in [9.81, 1.0].into_iter().enumerate() {
        let bytes = fs::read(out.join(format!("run-{run:06}.ply"))).expect("an end");
        let points = read_ply(&bytes, "end.ply").expect("a mesh").mesh.points;
        let (sheet, snow) = points.split_at(144);
        assert_eq!(snow.len(), 100);
        let heights = |points: &[[f64; 3]]| points.iter().map(|point| point[1]).collect::<Vec<_>>();
        let least = |points: &[[f64; 3]]| heights(points).into_iter().fold(f64::INFINITY, f64::min);
        let most = |points: &[[f64; 3]]| heights(points).into_iter().fold(f64::NEG_INFINITY, f64::max);
        // All of its particles have one mass.
        let mean = |axis: usize| sheet.iter().map(|point| point[axis]).sum::<f64>() / 144.0;
        // Snow falls freely for four steps of 5 ms.
        let speed = gravity * 0.02;
        let exact = |value: f64| (value, 0.0);
        let expected = [
            exact(least(sheet)),
            exact(most(sheet)),
            (mean(0), 1e-12),
            (mean(1), 1e-12),
            exact(sheet[17][1]),
            exact(least(snow)),
            exact(snow[3][2]),
            (speed, 1e-6),
        ];
        let row = fields(&found[run + 1]);
        for (place, (value, tolerance)) in expected.into_iter().enumerate() {
            let measured: f64 = row[before + 1 + place].parse().expect("a number");
            assert!((measured - value).abs() <= tolerance, "{}: {measured} {value}", measures[place]);
        }
    }
    let described = fs::read_to_string(out.join("sweep.json")).expect("sweep.json");
    let described: Value = serde_json::from_str(&described).expect("JSON");
    assert_eq!(described["measures"].as_array().map(Vec::len), Some(measures.len()));
}

/// Below the sheet at a height of its margin, and far away.
const COLLIDERS: &str = r#"
[[collider]]
name = "floor"
plane = { point = [0, -0.01, 0], normal = [0, 1, 0] }
margin = 0.01

[[collider]]
name = "lid"
box = { center = [0, 5, 0], size = [1, 0.1, 1] }
"#;

#[test]
fn a_force_on_a_collider_is_a_column_of_its_own() {
    let folder = folder();
    let lies = SMALL_SCENE.replace("pins = [\"top_left\", \"top_right\"]", "") + COLLIDERS;
    let scene = write_scene(folder.path(), &lies);
    let forces = ["x", "y", "mean", "greatest"].map(|what| format!("collider.floor.force.{what}"));
    let measures = [&forces[..], &["collider.lid.force.greatest".to_owned()]].concat();
    let asked = measures.join(",");
    let set = ["--set", "gravity.1=-9.81,-1", "--steps", "4", "--measure", &asked];
    nappe_in(folder.path(), &[&["sweep", &scene, "--out", "out"], &set[..]].concat()).ok();
    let found = rows(&folder.path().join("out"));
    let columns = fields(&found[0]);
    let first = columns.iter().position(|name| *name == measures[0]).expect("a column");
    assert_eq!(columns[first..first + measures.len()], measures);
    for (row, gravity) in found[1..].iter().zip([9.81, 1.0]) {
        let row = fields(row);
        // 144 particles of 0.01 kg lie on it from the start.
        let weight = 1.44 * gravity;
        let expected = [0.0, -weight, weight, weight, 0.0];
        for (place, expected) in expected.into_iter().enumerate() {
            let measured: f64 = row[first + place].parse().expect("a number");
            let off = (measured - expected).abs();
            assert!(off < 1e-3 * weight, "{}: {measured}, not {expected}", measures[place]);
        }
    }
    let args =
        ["sweep", &scene, "--set", "gravity.1=0,-1", "--out", "no", "--measure", "collider.table.force.y"];
    let done = nappe_in(folder.path(), &args);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("no collider 'table'; allowed: floor, lid"), "{}", done.stderr);
}

#[test]
fn what_cannot_be_measured_is_refused_before_anything_runs() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    for (measure, part) in [
        ("body.shet.lowest", "the scene has no body 'shet'; did you mean 'sheet'?"),
        ("body.sheet.lowst", "did you mean 'lowest'?"),
        ("body.sheet.particle.144.x", "the particle of body 'sheet' is 144; allowed: 0 to 143"),
        ("body.sheet.particle.topleft.x", "did you mean 'top_left'?"),
        ("body.sheet.particle.first.x", "the particle of body 'sheet' is 'first'; allowed: top_left, "),
        ("body.sheet.particle.top.x", "'top' means 12 particles; one is measured"),
        ("snow.ball.lowest", "the scene has no object of snow"),
        ("collider.floor.force.y", "the scene has no collider"),
        ("body.sheet.lowest,body.sheet.lowest", "is asked for twice"),
    ] {
        let args = ["sweep", &scene, "--set", "gravity.1=0,-1", "--out", "out", "--measure", measure];
        let done = nappe_in(folder.path(), &args);
        assert_eq!(done.code, Some(2), "{measure}: {done:?}");
        assert!(done.stderr.contains(part), "{measure}: {}", done.stderr);
    }
    assert!(!folder.path().join("out").exists(), "nothing was run");
    // A run whose body has fewer particles is refused; others run.
    let sets = ["--set", "body.sheet.mesh.grid.0=12,6", "--measure", "body.sheet.particle.100.y"];
    let args = [&["sweep", &scene, "--steps", "2", "--out", "out"], &sets[..]].concat();
    nappe_in(folder.path(), &args).ok();
    let found = rows(&folder.path().join("out"));
    assert!(found[1].ends_with(",ok,"), "{found:?}");
    assert!(found[2].contains("refused") && found[2].contains("allowed: 0 to 71"), "{found:?}");
}

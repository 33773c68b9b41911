//! `nappe plan`: its answer, its files, the scene that it writes, and what it refuses before anything is computed.

use std::{fs, path::Path};

use nappe_scene::{NoMeshes, SceneLimits, files};
use nappe_sim::{report::NoStopwatch, world::Simulation};
use serde_json::Value;

use crate::support::{SMALL_SCENE, check_kept, check_pictures, folder, nappe, nappe_in, write_scene};

/// A chain of stiff and soft springs that is let go.
const CHAIN: &str = "version = 1\ndt = 0.01\nsteps = 100\nprecision = \"f64\"\n[[body]]\nname = \"chain\"\n\
    mesh = { chain = 12, spacing = 0.05 }\nmass = { particle = 0.01 }\npins = [\"first\"]\ndrag = 0.001\n\
    springs = { stretch = { stiffness = 400, damping = 0.02 }, bend = { stiffness = 5, damping = 0.001 } }\n";
/// A block of snow that falls freely.
const SNOW: &str = "version = 1\ndt = 0.01\nsteps = 6\n[snow]\ncell = 0.1\ntransfer = \"pic_flip\"\n[[snow.object]]\n\
    name = \"block\"\nbox = { min = [0, 1, 0], max = [0.1, 1.1, 0.1] }\nsampling = \"lattice\"\nparticles = 8\n\
    stiffness_noise = 0.1\n";

/// Runs a scene that was written to its end; the hash of its state at a time (s).
fn run_whole(path: &Path, until: f64) -> String {
    let scene = files::load_scene(path).unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (mut simulation, _) = Simulation::new(&built.setup, scene.precision).expect("a scene");
    let mut hash = None;
    for step in 1..=scene.steps {
        let taken = simulation.step(&mut NoStopwatch);
        taken.unwrap_or_else(|error| panic!("step {step} of {}: {error}", scene.steps));
        if step == (until / scene.dt).round() as u64 {
            hash = Some(format!("{:016x}", simulation.state_hash()));
        }
    }
    hash.expect("a window that ends at a step of the scene")
}

/// The first fields of an answer, in their order.
const FIRST: [&str; 8] =
    ["scene", "tolerance_m", "met", "method", "precision", "dt", "error_m", "seconds_per_simulated_second"];

#[test]
fn a_plan_has_an_answer_files_and_a_scene_that_runs_as_it_says() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let args = ["plan", &scene, "--tolerance", "1mm", "--out", "out", "--budget", "60s", "--until", "0.1"];
    let done = nappe_in(folder.path(), &[&args[..], &["--write", "planned.toml", "--json"]].concat()).ok();
    let line = done.stdout.lines().last().expect("a line");
    let said: Value = serde_json::from_str(line).expect("JSON");
    let places: Vec<_> =
        FIRST.iter().map(|name| line.find(&format!("\"{name}\":")).expect("a field")).collect();
    assert!(places.is_sorted(), "{line}");
    assert_eq!((&said["scene"], &said["met"]), (&"scene".into(), &true.into()), "{said}");

    let read = |name: &str| {
        fs::read_to_string(folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let document: Value = serde_json::from_str(&read("out/plan.json")).expect("JSON");
    for name in FIRST {
        assert_eq!(document[name], said[name], "{name}");
    }
    assert!(document["verified"]["error_m"].as_f64().is_some_and(|error| error <= 1e-3), "{document}");
    assert!(document["candidates"].as_array().is_some_and(|all| all.len() > 30), "{document}");
    assert!(read("out/plan.csv").lines().count() > 10);
    let files: Vec<&str> =
        said["files"].as_array().expect("files").iter().filter_map(Value::as_str).collect();
    assert_eq!(files.len(), 7, "{files:?}");
    check_pictures(folder.path(), &files);
    check_kept(folder.path(), &files, &["plan", &scene, "--tolerance", "1mm", "--budget", "1s"]);

    let compared = &document["compared"];
    assert_eq!((&compared["measure"], &compared["times"]), (&"motion".into(), &20.into()), "{document}");
    assert_eq!((&compared["until_s"], &compared["of_s"]), (&0.1.into(), &0.2.into()), "{document}");
    let summary = document["summary"].as_str().expect("words");
    assert!(summary.starts_with("Only until 0.100 s of 0.200 s: "), "{summary}");

    // The scene says what it is, and makes the steps of the plan.
    let planned = read("planned.toml");
    assert!(
        planned.lines().next().is_some_and(|line| line.ends_with(" until 0.100 s of 0.200 s.")),
        "{planned}"
    );
    assert!(planned.starts_with("# Method, steps and precision by `nappe plan scene`"), "{planned}");
    let done = nappe_in(folder.path(), &["run", "planned.toml", "--steps", "20", "--json"]).ok();
    let run: Value = serde_json::from_str(done.stdout.lines().last().expect("a line")).expect("JSON");
    assert_eq!(run["precision"], said["precision"], "{run}");
    assert_eq!(
        (&document["compared_at"], &document["runs_end"]),
        (&20.into(), &"scene".into()),
        "{document}"
    );
    assert_eq!(document["runs_steps"], 40, "{document}");
    // Twenty steps of 5 ms: the end of the window.
    assert_eq!((&document["until_s"], &run["state_hash"]), (&0.1.into(), &document["state_hash"]), "{run}");
    let terms = document["terms"].as_array().expect("terms");
    assert!(terms.len() >= 3, "{document}");
    assert_eq!(terms.last().map(|term| &term["name"]), Some(&"particles: a quarter".into()), "{document}");

    let again = [&args[..], &["--write", "planned.toml"]].concat();
    let refused = nappe_in(folder.path(), &again);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(
        refused.stderr.contains("planned.toml is there already: --force overwrites it"),
        "{}",
        refused.stderr
    );
}

#[test]
fn a_scene_whose_bending_does_nothing_is_written_without_it_and_says_so() {
    let folder = folder();
    let read = |name: &str| {
        fs::read_to_string(folder.path().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
    };
    let weak = write_scene(folder.path(), &SMALL_SCENE.replace("20.0", "1e-6"));
    let weak = [
        "plan",
        &weak,
        "--tolerance",
        "1mm",
        "--out",
        "weak",
        "--until",
        "0.1",
        "--write",
        "weak.toml",
        "--leave-out",
    ];
    let done = nappe_in(folder.path(), &weak).ok();
    assert!(done.stdout.contains("springs of bend"), "{}", done.stdout);
    let left = read("weak.toml");
    assert!(
        left.lines()
            .nth(1)
            .is_some_and(|line| line.starts_with("# Left out: ") && line.contains("springs of bend")),
        "{left}"
    );
    assert!(!left.contains("[body.springs.bend]"), "{left}");
    let document: Value = serde_json::from_str(&read("weak/plan.json")).expect("JSON");
    assert_eq!(document["state_hash"], run_whole(&folder.path().join("weak.toml"), 0.1), "{document}");
    assert!(document["together_change_m"].as_f64().is_some_and(|change| change < 1e-3), "{document}");
    assert!(document["error_m"].as_f64().is_some_and(|error| error <= 1e-3), "{document}");
}

#[test]
fn the_end_of_a_scene_is_planned_and_written() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let args = ["plan", &scene, "--tolerance", "1mm", "--out", "out", "--write", "planned.toml"];
    let asked = ["--measure", "particle.bottom_left.y", "--method", "velocity_verlet_pc", "--json"];
    let said = nappe_in(folder.path(), &[&args[..], &asked].concat()).ok().json();
    assert_eq!(said["met"], true, "{said}");
    let compared = &said["compared"];
    assert_eq!(
        (&compared["measure"], &compared["times"]),
        (&"particle.bottom_left.y".into(), &40.into()),
        "{said}"
    );
    assert_eq!(compared["until_s"], compared["of_s"], "{said}");
    let document = fs::read_to_string(folder.path().join("out/plan.json")).expect("a plan");
    let document: Value = serde_json::from_str(&document).expect("JSON");
    assert_eq!(document["compared"], *compared);
    let summary = document["summary"].as_str().expect("words");
    assert!(
        summary.starts_with("Take ") && summary.contains(" off in y of particle bottom_left until 0.200 s"),
        "{summary}"
    );
    let planned = fs::read_to_string(folder.path().join("planned.toml")).expect("a scene");
    assert!(planned.contains("m in y of particle bottom_left until 0.200 s.\n"), "{planned}");
}

#[test]
fn a_scene_that_is_written_runs_to_its_end_and_has_the_state_that_the_plan_says() {
    for (text, tolerance, method) in [(CHAIN, "1mm", None), (SNOW, "5mm", Some("pic_flip_quadratic"))] {
        for leave_out in [None, Some("--leave-out")] {
            let folder = folder();
            let scene = write_scene(folder.path(), text);
            let mut args =
                vec!["plan", &scene, "--tolerance", tolerance, "--out", "out", "--write", "planned.toml"];
            args.extend(method.iter().flat_map(|method| ["--method", *method]));
            args.extend(leave_out);
            nappe_in(folder.path(), &args).ok();
            let document = fs::read_to_string(folder.path().join("out/plan.json")).expect("a plan");
            let document: Value = serde_json::from_str(&document).expect("JSON");
            assert_eq!(document["met"], true, "{document}");
            let half = &document["verified"]["half_step_error_m"];
            assert!(half.as_f64().is_some(), "{document}");
            let until = document["until_s"].as_f64().expect("a time");
            let steps = until / 0.01;
            assert!((steps - steps.round()).abs() < 1e-9 && steps >= 1.0, "{until} s");
            let path = folder.path().join("planned.toml");
            assert_eq!(document["state_hash"], run_whole(&path, until), "{leave_out:?}: {document}");
            let written = files::load_scene(&path).unwrap_or_else(|error| panic!("{error}"));
            assert_eq!(document["runs_steps"], written.steps);
        }
    }
}

#[test]
fn what_cannot_be_planned_is_refused_before_anything_is_computed() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let refused = |args: &[&str], part: &str| {
        let done = nappe_in(folder.path(), &[&["plan", "--out", "out"], args].concat());
        assert_eq!(done.code, Some(2), "{args:?}: {done:?}");
        assert!(done.stderr.contains(part), "{args:?}: {}", done.stderr);
        assert!(done.stdout.is_empty(), "{done:?}");
    };
    refused(&[&scene], "--tolerance <LENGTH>");
    refused(&[&scene, "--tolerance", "0mm"], "'0mm' is not a length above 0");
    refused(
        &[&scene, "--tolerance", "1mm", "--method", "velocity_verlett"],
        "did you mean 'velocity_verlet'?",
    );
    refused(&[&scene, "--tolerance", "1mm", "--until=-1"], "a number of seconds above 0 is needed");
    refused(
        &[&scene, "--tolerance", "1mm", "--measure", "end", "--until", "0.0123"],
        "the nearest are 0.01 s and 0.015 s",
    );
    refused(
        &[&scene, "--tolerance", "1mm", "--measure", "heat"],
        "there is no such measure; allowed: motion",
    );
    refused(&[&scene, "--tolerance", "1mm", "--leave-out"], "--write <FILE>");
    refused(
        &[&scene, "--tolerance", "1mm", "--write", "missing/x.toml"],
        "there is no folder missing; make it first",
    );
    refused(&[&scene, "--tolerance", "1mm", "--write", "out"], "is a folder; the name of a file is needed");
    refused(
        &[&scene, "--tolerance", "1e300"],
        "any answer would be within it, since the scene is 778 mm long",
    );
    refused(&[&scene, "--tolerance", "1e-300"], "allowed: 1e-12 m and more");
    assert!(!folder.path().join("out/plan.csv").exists(), "nothing was computed");
}

#[test]
fn a_plan_of_snow_says_no_and_what_it_would_take() {
    let folder = folder();
    let out = folder.path().join("out");
    let args = ["plan", "brasseur", "--tolerance", "1e-5", "--out", out.to_str().expect("UTF-8")];
    let done = nappe(&[&args[..], &["--until", "0.05", "--budget", "20s"]].concat()).ok();
    assert!(done.stderr.contains("without a unit it is metres"), "{}", done.stderr);
    for words in ["Nothing that was tried is within 0.01 mm", "A plan promises nothing after that"] {
        assert!(done.stdout.contains(words), "{words}: {}", done.stdout);
    }
    // Cells that are near enough to what was run to be told, or that they are not.
    let needed = ["It would take cells of", "How small cells must be cannot be told from what was run"];
    assert!(needed.iter().any(|words| done.stdout.contains(words)), "{}", done.stdout);
}

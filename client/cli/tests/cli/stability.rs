//! `nappe stability`: its files, what it refuses before anything is computed, and how it ends early.

use std::{
    fs,
    path::Path,
    process::Stdio,
    time::{Duration, Instant},
};

use serde_json::Value;

use crate::support::{
    Lines, SMALL_SCENE, check_kept, check_pictures, command, end_by, folder, nappe, nappe_in, until,
    write_scene,
};

/// What scripts read, in its order.
const COLUMNS: &str = "scene,method,x_axis,x,y_axis,y,outcome,cause,energy_growth,limit_s,theory_s,stepping,step,particle,bound_s,right_s,cut_reason";

/// The files of a study are whole, also where there are few rows.
fn check_files(folder: &Path) -> (Vec<String>, Value) {
    let read =
        |name: &str| fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"));
    let table = read("stability.csv");
    let mut lines = table.lines().map(str::to_owned);
    assert_eq!(lines.next().as_deref(), Some(COLUMNS));
    assert!(table.ends_with('\n'));
    (lines.collect(), serde_json::from_str(&read("stability.json")).expect("JSON"))
}

#[test]
fn a_study_has_limits_runs_maps_and_pictures() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let args = ["stability", &scene, "--out", "out", "--budget", "60s", "--threads", "2", "--json"];
    let small = ["--until", "0.03", "--cells", "3"];
    let done = nappe_in(folder.path(), &[&args[..], &small].concat()).ok();
    let said = done.json();
    let (rows, document) = check_files(&folder.path().join("out"));
    assert_eq!(said["rows"].as_u64(), Some(rows.len() as u64));
    for axis in [",dt_at_rest,", ",dt_under_load,", ",certified,", ",damping_factor,", ",compression,"] {
        assert!(rows.iter().any(|row| row.starts_with("scene,") && row.contains(axis)), "{axis}");
    }
    let limits = &document["limits"];
    for over in ["at_rest", "under_load"] {
        assert_eq!(limits[over].as_array().map(Vec::len), Some(16), "{over} in {limits}");
    }
    let limit = limits["at_rest"][1]["limit_s"].as_f64().expect("that of symplectic Euler");
    let bound = limits["at_rest"][1]["bound_s"].as_f64().expect("its bound");
    assert!(limit > bound && limit < 1.4 * bound, "{limit} s, certified {bound} s");
    assert_eq!(document["machine"]["threads"], 2);

    let files: Vec<&str> =
        said["files"].as_array().expect("files").iter().filter_map(Value::as_str).collect();
    assert_eq!(files.len(), 8, "{files:?}");
    check_pictures(folder.path(), &files);
    check_kept(folder.path(), &files, &["stability", &scene, "--budget", "1s"]);
}

#[test]
fn what_does_not_exist_is_refused_before_anything_is_computed() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    fs::write(folder.path().join("file"), "").expect("a file");
    let refused = |args: &[&str], exit: i32, part: &str| {
        let done = nappe_in(folder.path(), &[&["stability", "--out", "out"], args].concat());
        assert_eq!(done.code, Some(exit), "{args:?}: {done:?}");
        assert!(done.stderr.contains(part), "{args:?}: {}", done.stderr);
        assert!(done.stdout.is_empty(), "{done:?}");
    };
    refused(&["brasseur"], 1, "brasseur has no cloth; methods of cloth are studied, of snow see --gallery");
    refused(&["nothing"], 1, "no scene 'nothing' comes with nappe");
    refused(&[&scene, "--method", "velocity_verlett"], 2, "did you mean 'velocity_verlet'?");
    refused(&[&scene, "--tolerance", "1e300"], 2, "since the scene is 778 mm long; a smaller one is needed");
    refused(&[&scene, "--tolerance", "1e-300"], 2, "allowed: 1e-12 m and more");
    refused(&[&scene, "--map", "stiffness"], 2, "invalid value 'stiffness'");
    refused(&[&scene, "--cells", "1"], 2, "a whole number from 2 to 64 is needed");
    refused(&[&scene, "--until", "0"], 2, "a number of seconds above 0 is needed");
    let pinned = SMALL_SCENE
        .replace("[12, 12]", "[2, 2]")
        .replace("\"top_right\"]", "\"top_right\", \"bottom_left\", \"bottom_right\"]");
    refused(
        &[&write_scene(folder.path(), &pinned)],
        1,
        "nothing can move in scene: every particle is pinned",
    );
    let loose =
        ["200.0", "100.0", "20.0"].iter().fold(SMALL_SCENE.to_owned(), |text, k| text.replace(k, "0.0"));
    let loose = write_scene(folder.path(), &loose);
    refused(&[&loose, "--map", "damping"], 2, "--map damping: the scene has no springs to be damped");
    let endless = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    refused(&[&endless], 2, "say until when with --until S");
    let done = nappe_in(folder.path(), &["stability", &endless, "--until", "0.1", "--out", "file"]);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("is a file; a folder is needed"), "{}", done.stderr);
    assert!(!folder.path().join("out/stability.csv").exists(), "nothing was computed");
}

#[test]
fn limits_of_cloth_with_a_thickness_are_not_known_and_the_reason_is_said() {
    let folder = folder();
    let scene = SMALL_SCENE.replace("[12, 12]", "[5, 5]").replace("mass =", "thickness = 0.004\nmass =");
    let scene = write_scene(folder.path(), &scene);
    let args = ["stability", &scene, "--out", "out", "--until", "0.05", "--effort", "0"];
    let methods = ["--method", "velocity_verlet,implicit_euler_absolute"];
    let done = nappe_in(folder.path(), &[&args[..], &methods].concat()).ok();
    for part in ["not known: refused", "thickness is 0.004 m", "4 limits"] {
        assert!(done.stdout.contains(part), "{part}: {}", done.stdout);
    }
    assert!(!done.stdout.contains("none holds"), "{}", done.stdout);
    let (rows, document) = check_files(&folder.path().join("out"));
    for over in ["at_rest", "under_load"] {
        let limits = document["limits"][over].as_array().expect("limits");
        assert_eq!(limits.len(), 2, "{over}: {document}");
        for limit in limits {
            assert_eq!(limit["outcome"], "refused", "{limit}");
            assert!(limit["limit_s"].is_null(), "{limit}");
            assert!(limit["cause"].as_str().is_some_and(|cause| cause.contains("thickness")), "{limit}");
        }
    }
    let as_run: Vec<_> = rows.iter().filter(|row| row.contains(",certified,")).collect();
    assert_eq!(as_run.len(), 8, "{as_run:?}");
    assert!(
        as_run
            .iter()
            .any(|row| row.contains("implicit_euler_absolute,dt,0.005,,,") && !row.contains("refused"))
    );
}

#[test]
fn springs_without_damping_are_damped_by_shares_of_the_critical_one_and_that_is_said() {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("damping = 0.01", "damping = 0"));
    let args = ["stability", &scene, "--map", "damping", "--cells", "3", "--out", "out"];
    let limited = ["--method", "symplectic_euler,velocity_verlet", "--budget", "20s"];
    let done = nappe_in(folder.path(), &[&args[..], &limited].concat()).ok();
    assert!(done.stderr.contains("as a share of what is critical"), "{}", done.stderr);
    let (rows, _) = check_files(&folder.path().join("out"));
    let cells: Vec<_> = rows.iter().filter(|row| row.contains(",damping_ratio,")).collect();
    assert!(cells.len() >= 9 && cells.len().is_multiple_of(9), "{} cells", cells.len());
}

#[test]
fn budgets_are_kept_and_files_are_complete() {
    let folder = folder();
    for (name, seconds) in [("small", 0.05), ("five", 5.0)] {
        let out = folder.path().join(name);
        let begin = Instant::now();
        let budget = format!("{seconds}s");
        let args = ["stability", "flag", "--budget", &budget, "--out", out.to_str().expect("UTF-8")];
        let done = nappe(&args).ok();
        // A busy machine takes longer to write what it has; without a budget it takes minutes.
        assert!(begin.elapsed() < Duration::from_secs_f64(seconds + 30.0), "{:?}", begin.elapsed());
        let (_, document) = check_files(&out);
        assert_eq!(document["cut"], true, "{document}");
        let stated = ["Nothing is known: out of time.", "a larger --budget goes further"];
        assert!(stated.iter().any(|part| done.stdout.contains(part)), "{}", done.stdout);
    }
}

#[test]
fn ctrl_c_ends_a_study_with_what_was_found() {
    let folder = folder();
    let out = folder.path().join("out");
    let mut study = command();
    study.args(["stability", "hanging_sheet", "--budget", "10min", "--json", "--out"]).arg(&out);
    let mut process = study.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
    // The folder is there before anything is computed.
    until("the folder", || out.is_dir());
    std::thread::sleep(Duration::from_millis(300));
    let stdout = Lines::of(process.stdout.take().expect("a pipe"));
    assert_eq!(end_by(&mut process, "INT"), Some(130));
    let said: Value = serde_json::from_str(stdout.rest().last().expect("a line")).expect("JSON");
    assert_eq!(said["interrupted"], true);
    check_files(&out);
}

#[test]
fn the_gallery_is_a_row_per_scene_and_method_and_none_is_lost() {
    let folder = folder();
    let done = nappe_in(folder.path(), &["stability", "--gallery", "--out", "out", "--json"]).ok();
    let said = done.json();
    let table = fs::read_to_string(folder.path().join("out/gallery.csv")).expect("gallery.csv");
    let mut rows = table.lines();
    assert_eq!(rows.next(), Some("number,scene,method,verdict,detail"));
    let of = |name: &str| rows.clone().filter(|row| row.contains(&format!(",{name},"))).count();
    let counts = ["survived", "recovered", "detected", "wrong", "warned", "lost"]
        .map(|name| (said[name].as_u64(), of(name)));
    for (told, counted) in counts {
        assert_eq!(told, Some(counted as u64), "{said}");
    }
    assert_eq!(of("lost"), 0, "{table}");
    assert_eq!(said["rows"].as_u64(), Some(rows.clone().count() as u64));
    for scene in
        ["3,an undamped spring,explicit_euler,detected", "36,one lone particle that falls,mls_cubic,survived"]
    {
        assert!(rows.clone().any(|row| row.starts_with(scene)), "{scene}");
    }
    let files: Vec<&str> =
        said["files"].as_array().expect("files").iter().filter_map(Value::as_str).collect();
    assert_eq!(files.len(), 3, "{files:?}");
    check_pictures(folder.path(), &files);

    let refused = nappe(&["stability", "--gallery", "drap10"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("cannot be used with"), "{}", refused.stderr);
}

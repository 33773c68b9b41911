//! `nappe chart`: its files, what it refuses before anything is computed, and how it ends early.

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

/// What scripts read: the first columns, in their order.
const COLUMNS: &str = "scene,method,precision,threads,dt,tolerance,rms_error_m,seconds_per_simulated_second,\
    force_evaluations,matrix_products,outcome,step_tolerance_m,centre_error_m,minimum_seconds,energy_drift_j,max_stretch,\
    cause,failed_at_s,particle,below_floor,front,own,cell_m,cut_reason";

fn read(folder: &Path, name: &str) -> String {
    fs::read_to_string(folder.join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// The files of a chart are whole, also where there are no rows.
fn check_files(folder: &Path) -> (Vec<String>, Value) {
    let table = read(folder, "chart.csv");
    let mut lines = table.lines().map(str::to_owned);
    assert_eq!(lines.next().as_deref(), Some(COLUMNS));
    assert!(table.ends_with('\n'));
    let document = serde_json::from_str(&read(folder, "chart.json")).expect("JSON");
    (lines.collect(), document)
}

#[test]
fn a_chart_has_rows_a_document_and_pictures() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let args = ["chart", &scene, "--out", "out", "--budget", "60s", "--threads", "2", "--json"];
    let done = nappe_in(folder.path(), &args).ok();
    let said = done.json();
    let (rows, document) = check_files(&folder.path().join("out"));
    assert_eq!(said["rows"].as_u64(), Some(rows.len() as u64));
    assert!(rows.len() > 30 && rows.iter().all(|row| row.starts_with("scene,")), "{} rows", rows.len());
    assert_eq!(
        rows.iter().filter(|row| row.ends_with(",true,,")).count(),
        1,
        "one row is the scene as written"
    );
    for outcome in [",ok,", ",diverged,"] {
        assert!(rows.iter().any(|row| row.contains(outcome)), "{outcome}");
    }

    assert_eq!(document["machine"]["threads"], 2);
    assert!(document["effort"].as_u64().is_some_and(|class| class <= 9), "{document}");
    assert_eq!(said["effort"], document["effort"]);
    assert_eq!(document["compared"]["measure"], "motion");
    assert_eq!(said["compared"], document["compared"]);
    assert_eq!(document["tolerance_m"], 1e-3);
    for key in ["until_s", "floor_m", "reference_error_m"] {
        assert!(document[key].as_f64().is_some_and(|number| number > 0.0), "{key} in {document}");
    }
    assert!(document["front"].as_array().is_some_and(|front| !front.is_empty()));
    assert_eq!(document["scene_hash"].as_str().map(str::len), Some(16));

    let files: Vec<&str> =
        said["files"].as_array().expect("files").iter().filter_map(Value::as_str).collect();
    assert_eq!(files.len(), 8, "{files:?}");
    check_pictures(folder.path(), &files);
    check_kept(folder.path(), &files, &["chart", &scene, "--budget", "1s"]);
}

#[test]
fn a_coarser_copy_has_rows_of_its_own_after_those_of_the_scene() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let args = ["chart", &scene, "--coarser", "--method", "velocity_verlet", "--out", "out", "--json"];
    let done = nappe_in(folder.path(), &args).ok();
    let said = done.json();
    let (rows, document) = check_files(&folder.path().join("out"));
    let of_copy: Vec<bool> = rows.iter().map(|row| row.starts_with("scene coarser by 2,")).collect();
    let first = of_copy.iter().position(|is_of_copy| *is_of_copy).expect("a row of the copy");
    assert!(of_copy.is_sorted() && said["rows"].as_u64() == Some(first as u64), "{rows:?}");
    assert_eq!(document["coarser"]["name"], "scene coarser by 2");
    let known = document["coarser"]["rows"].as_array().expect("rows");
    assert_eq!(known.len(), rows.len() - first);
    assert!(
        known.iter().any(|row| row["rms_error_m"].as_f64().is_some_and(|error| error > 0.0)),
        "{document}"
    );
    assert!(document["summary"].as_str().is_some_and(|text| text.contains("The copy scene coarser by 2")));
    let files: Vec<&str> =
        said["files"].as_array().expect("files").iter().filter_map(Value::as_str).collect();
    check_pictures(folder.path(), &files);
}

#[test]
fn what_does_not_exist_is_refused_before_anything_is_computed() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    fs::write(folder.path().join("file"), "").expect("a file");
    let refused = |args: &[&str], exit: i32, part: &str| {
        let done = nappe_in(folder.path(), &[&["chart", "--out", "out"], args].concat());
        assert_eq!(done.code, Some(exit), "{args:?}: {done:?}");
        assert!(done.stderr.contains(part), "{args:?}: {}", done.stderr);
        assert!(done.stdout.is_empty(), "{done:?}");
    };
    refused(&["brasseur", "--method", "velocity_verlet"], 2, "there is no such method");
    refused(&["nothing"], 1, "no scene 'nothing' comes with nappe");
    refused(&[&scene, "--until", "0.0123"], 2, "the nearest are 0.01 s and 0.015 s");
    refused(&[&scene, "--times", "0.1,0.0512"], 2, "--times: 0.0512 s is no multiple of the time step");
    refused(&[&scene, "--method", "velocity_verlett"], 2, "did you mean 'velocity_verlet'?");
    refused(&[&scene, "--tolerance", "0mm"], 2, "'0mm' is not a length above 0");
    refused(&[&scene, "--tolerance", "1e300"], 2, "since the scene is 778 mm long; a smaller one is needed");
    refused(&[&scene, "--tolerance", "1e-300"], 2, "allowed: 1e-12 m and more");
    refused(&[&scene, "--budget", "0s"], 2, "not a time above 0");
    refused(&[&scene, "--measure", "heat"], 2, "allowed: motion, end, energy, sag, particle.NAME.x");
    refused(&[&scene, "--measure", "particle.top_lft.y"], 2, "did you mean 'top_left'?");
    refused(&[&scene, "--measure", "end", "--times", "0.1"], 2, "are compared at one time");
    refused(&[&scene, "--effort", "99"], 2, "years on a fast machine; allowed: 0 to 9");
    refused(&[&scene, "--effort", "much"], 2, "'much' is not a class of effort");
    refused(&[&scene, "--coarser=5"], 2, "of which 5 divides neither");
    refused(&[&scene, "--coarser=5"], 2, "allowed: 2, 3, 4");
    refused(&["drap10", "--coarser"], 2, "is a course_grid");
    let endless = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    refused(&[&endless], 2, "say until when with --until S");
    let done = nappe_in(folder.path(), &["chart", &endless, "--until", "0.1", "--out", "file"]);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("is a file; a folder is needed"), "{}", done.stderr);
    assert!(!folder.path().join("out/chart.csv").exists(), "nothing was computed");
}

#[test]
fn a_budget_that_is_too_small_leaves_files_and_says_what_it_would_take() {
    let folder = folder();
    let out = folder.path().join("out");
    let begin = Instant::now();
    let done = nappe(&["chart", "flag", "--budget", "10ms", "--out", out.to_str().expect("UTF-8")]).ok();
    // Without it a minute is used.
    assert!(begin.elapsed() < Duration::from_secs(40), "{:?}", begin.elapsed());
    let (rows, document) = check_files(&out);
    assert!(rows.is_empty() && document["cut"] == true, "{document}");
    assert!(done.stdout.contains("--budget"), "{}", done.stdout);
}

#[test]
fn ctrl_c_ends_a_chart_with_what_was_found() {
    let folder = folder();
    let out = folder.path().join("out");
    let mut chart = command();
    chart.args(["chart", "hanging_sheet", "--budget", "10min", "--json", "--out"]).arg(&out);
    let mut process = chart.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("it starts");
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
fn snow_beside_cloth_is_left_out_with_a_warning() {
    let folder = folder();
    let snow = "\n[snow]\ncell = 0.1\n[[snow.object]]\nname = \"ball\"\nbox = { center = [3, 0, 0], size = [0.3, 0.3, 0.3] }\n\
        particles = 100\nmaterial = { young = 1.4e5, poisson = 0.2, density = 400 }\n";
    let scene = write_scene(folder.path(), &(SMALL_SCENE.to_owned() + snow));
    let args = [
        "chart",
        &scene,
        "--until",
        "0.02",
        "--method",
        "symplectic_euler",
        "--budget",
        "2s",
        "--out",
        "out",
    ];
    let done = nappe_in(folder.path(), &args).ok();
    assert!(done.stderr.contains("snow is left out"), "{}", done.stderr);
    assert!(!check_files(&folder.path().join("out")).0.is_empty());
}

#[test]
fn a_chart_of_snow_tells_what_its_cells_leave_open() {
    let folder = folder();
    let out = folder.path().join("out");
    let args = ["chart", "brasseur", "--out", out.to_str().expect("UTF-8"), "--budget", "60s"];
    let short = ["--until", "0.0416667", "--method", "mls_quadratic"];
    let done = nappe(&[&args[..], &short].concat()).ok();
    let (rows, document) = check_files(&out);
    assert!(rows.len() == 9 && rows.iter().all(|row| row.starts_with("brasseur,")), "{} rows", rows.len());
    // As written, and cells as written and twice as long.
    assert!(
        rows[0].ends_with(",true,0.1,") && rows.iter().any(|row| row.ends_with(",false,0.2,")),
        "{rows:?}"
    );
    let reference = &document["reference"];
    assert_eq!(reference["method"], "pic_flip_cubic");
    assert!(reference["cell_m"].as_f64().is_some_and(|cell| cell <= 0.05), "{reference}");
    assert!(document["floor_m"].as_f64().is_some_and(|floor| floor > 0.0), "{document}");
    for words in ["Your cells of 100 mm leave", "from its reference on cells of", "marked below_floor"] {
        assert!(done.stdout.contains(words), "{words}: {}", done.stdout);
    }
    for picture in ["work_precision.svg", "window.png"] {
        assert!(out.join(picture).exists(), "{picture}");
    }
    let refused = nappe(&["chart", "brasseur", "--method", "mls_quadratik"]);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("did you mean 'mls_quadratic'?"), "{}", refused.stderr);
}

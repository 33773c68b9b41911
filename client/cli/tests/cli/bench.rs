//! `nappe bench`: the contracts of its rows, on sizes small enough for a test.

use serde_json::Value;

use crate::support::nappe;

fn check_row(row: &Value) {
    for key in ["name", "precision", "unit"] {
        assert!(row[key].is_string(), "{key} in {row}");
    }
    for key in ["particles", "threads"] {
        assert!(row[key].as_u64().is_some_and(|count| count > 0), "{key} in {row}");
    }
    let seconds = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"));
    assert!(seconds("min_seconds") > 0.0 && seconds("min_seconds") <= seconds("median_seconds"), "{row}");
    assert!((seconds("rate") * seconds("median_seconds") - 1.0).abs() < 1e-9, "{row}");
}

fn rows(args: &[&str]) -> Vec<Value> {
    let json = nappe(args).ok().json();
    let rows = json.as_array().expect("one array").clone();
    rows.iter().for_each(check_row);
    rows
}

#[test]
fn zara_times_both_schemes_on_one_thread_and_more() {
    let rows = rows(&["bench", "zara", "--sizes", "64,2500", "--threads", "2", "--json"]);
    let kinds: Vec<(&str, u64, u64)> = rows
        .iter()
        .map(|row| {
            let count = |key: &str| row[key].as_u64().expect("a count");
            (row["name"].as_str().expect("a name"), count("particles"), count("threads"))
        })
        .collect();
    let expected: Vec<(&str, u64, u64)> = [64, 2500]
        .into_iter()
        .flat_map(|n| {
            [
                ("zara/explicit", n, 1),
                ("zara/explicit", n, 2),
                ("zara/implicit", n, 1),
                ("zara/implicit", n, 2),
            ]
        })
        .collect();
    assert_eq!(kinds, expected);
    for row in &rows {
        let task = |task: &str| row["tasks"][task].as_f64();
        for done in ["force", "acceleration", "velocity", "position"] {
            assert!(task(done).is_some_and(|s| s > 0.0), "{done} in {row}");
        }
        // The matrix is a difference of two times, either of which something else may disturb.
        let is_implicit = row["name"] == "zara/implicit";
        assert_eq!(task("matrix").is_some(), is_implicit, "{row}");
        assert_eq!(task("solve").is_some_and(|s| s > 0.0), is_implicit, "{row}");
        let stages = row["stages"].as_object().expect("stages by name");
        assert!(stages.values().all(|seconds| seconds.as_f64().is_some_and(|s| s > 0.0)), "{row}");
    }
    let implicit = rows.iter().find(|row| row["name"] == "zara/implicit" && row["particles"] == 2500);
    let paper = &implicit.expect("the row of the paper's smallest sheet")["paper"];
    assert_eq!(paper[0], serde_json::json!({ "machine": "one_processor", "seconds": 2.70 }));
    assert_eq!(paper[1], serde_json::json!({ "machine": "ten_processor_cluster", "seconds": 2.75 }));
}

#[test]
fn zara_also_speaks_to_spreadsheets() {
    let csv = nappe(&["bench", "zara", "--sizes", "64", "--threads", "1", "--csv"]).ok().stdout;
    let lines: Vec<&str> = csv.lines().collect();
    assert_eq!(lines.len(), 3, "{csv}");
    assert!(lines[0].starts_with("name,particles,"), "{csv}");
    assert!(
        lines[0].contains("force_seconds,acceleration_seconds,velocity_seconds,position_seconds"),
        "{csv}"
    );
    assert!(lines[0].contains("matrix_seconds,solve_seconds"), "{csv}");
    let columns = lines[0].split(',').count();
    assert!(lines.iter().all(|line| line.split(',').count() == columns), "{csv}");
}

#[test]
fn a_sheet_that_is_no_square_is_refused() {
    let done = nappe(&["bench", "zara", "--sizes", "2501"]);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("2501"), "{}", done.stderr);
}

#[test]
fn cloth_is_timed_in_both_precisions_with_its_speed_up() {
    let rows = rows(&["bench", "cloth", "--side", "16", "--repetitions", "3", "--threads", "2", "--json"]);
    assert_eq!(rows.len(), 16);
    for row in &rows {
        // Bytes are counted of springs alone.
        let is_fabric = row["name"] == "cloth/membrane_plate";
        let has_bytes = row["name"].as_str().is_some_and(|name| name.contains("implicit"));
        let is_implicit = has_bytes || is_fabric;
        assert_eq!(row["springs"] == 0, is_fabric, "{row}");
        for number in ["bytes_per_iteration", "bandwidth_share"] {
            assert_eq!(row[number].as_f64().is_some_and(|n| n > 0.0), has_bytes, "{number} in {row}");
        }
        assert_eq!(row["stages"]["solve"].as_f64().is_some_and(|s| s > 0.0), is_implicit, "{row}");
        assert!(row["stages"]["force"].as_f64().is_some_and(|s| s > 0.0), "{row}");
        assert!(row["speedup"].as_f64().is_some_and(|speedup| speedup > 0.0), "{row}");
        if row["threads"] == 1 {
            assert_eq!(row["speedup"], 1.0);
        }
    }
    let hashes: Vec<&Value> = rows.iter().map(|row| &row["state_hash"]).collect();
    assert!(hashes.chunks(2).all(|pair| pair[0] == pair[1]), "one hash whatever the threads: {hashes:?}");
}

#[test]
fn frames_a_second_are_counted_and_none_is_lost() {
    let rows = rows(&["bench", "stream", "--sizes", "1000", "--json"]);
    assert_eq!(rows.len(), 1);
    assert_eq!(rows[0]["frame_bytes"], 12_000);
    assert!(rows[0]["megabytes_per_second"].as_f64().is_some_and(|rate| rate > 0.0));
}

#[test]
fn snow_counts_particle_steps_in_both_precisions_with_its_stages_and_memory() {
    let args = ["bench", "snow", "--particles", "4000", "--repetitions", "3", "--threads", "2", "--json"];
    let json = nappe(&args).ok().json();
    let rows = json.as_array().expect("one array");
    assert_eq!(rows.len(), 4);
    for row in rows {
        let number = |key: &str| row[key].as_f64().unwrap_or_else(|| panic!("{key} in {row}"));
        assert_eq!((&row["name"], &row["unit"]), (&"snow/mls_quadratic".into(), &"particle-steps/s".into()));
        assert!((number("rate") * number("median_seconds") / 4000.0 - 1.0).abs() < 1e-9, "{row}");
        assert!(number("best_rate") >= number("rate") && number("substeps") >= 3.0, "{row}");
        let stages =
            ["sort", "particles_to_grid", "grid_update", "grid_to_particles", "diagnose"].map(|stage| {
                row["stage_nanoseconds"][stage].as_f64().unwrap_or_else(|| panic!("{stage}: {row}"))
            });
        assert!(stages.iter().sum::<f64>() > 0.0, "{row}");
        assert!(number("bytes_per_particle") > 0.0 && number("speedup") > 0.0, "{row}");
        let bytes = if row["precision"] == "f32" { 388.0 } else { 748.0 };
        assert!((number("bytes_per_step") - 4000.0 * bytes).abs() < 1e-6, "{row}");
        assert!(number("bandwidth_share") > 0.0, "{row}");
    }
    let hashes: Vec<&Value> = rows.iter().map(|row| &row["state_hash"]).collect();
    assert!(hashes.chunks(2).all(|pair| pair[0] == pair[1]), "one hash whatever the threads: {hashes:?}");
    let f32_only = nappe(&[
        "bench",
        "snow",
        "--particles",
        "1000",
        "--repetitions",
        "1",
        "--threads",
        "1",
        "--precision",
        "f32",
        "--json",
    ]);
    assert_eq!(f32_only.ok().json().as_array().map(Vec::len), Some(1));
}

#[test]
fn the_snowball_of_the_paper_is_timed_by_the_frame() {
    let args = ["bench", "stomakhin", "--particles", "2000", "--frames", "2", "--json"];
    let json = nappe(&args).ok().json();
    let row = &json[0];
    check_row(row);
    assert_eq!((&row["name"], &row["unit"]), (&"snow/stomakhin".into(), &"frames/s".into()));
    let substeps = row["frame_substeps"].as_array().expect("one per frame");
    // A frame of 1/24 s at the bound of the elastic wave on cells of 5 mm: over a hundred steps.
    assert!(substeps.len() == 2 && substeps.iter().all(|count| count.as_u64() > Some(50)), "{row}");
    assert!(row["published_seconds"].is_null(), "2000 particles are not the paper's");
}

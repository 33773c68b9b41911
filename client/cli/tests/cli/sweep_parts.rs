//! Parts of a sweep, as jobs of a cluster compute them, and `nappe sweep join`, which puts them together.

use std::{fs, path::Path};

use serde_json::Value;

use crate::support::{Done, Folder, SMALL_SCENE, folder, nappe_in, write_scene};

/// A folder with the small scene.
fn with_scene() -> Folder {
    let folder = folder();
    write_scene(folder.path(), SMALL_SCENE);
    folder
}

/// Sweeps five values over a few steps.
fn sweep(folder: &Path, options: &[&str]) -> Done {
    let args = ["sweep", "scene.toml", "--set", "gravity.1=-9,-7,-5,-3,-1", "--steps", "3", "--save"];
    nappe_in(folder, &[&args[..], options].concat())
}

/// The rows of a table without their seconds, below its header.
fn rows(folder: &Path) -> Vec<String> {
    let table = fs::read_to_string(folder.join("sweep.csv")).expect("sweep.csv");
    table.lines().map(|line| line.rsplit_once(',').map_or("", |(row, _)| row).to_owned()).collect()
}

/// The names of files of a folder that begin so.
fn names(folder: &Path, begin: &str) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name().to_string_lossy().into_owned());
    let mut names: Vec<String> = names.filter(|name| name.starts_with(begin)).collect();
    names.sort();
    names
}

#[test]
fn parts_that_are_joined_are_the_whole_sweep() {
    let folder = with_scene();
    let here = folder.path();
    sweep(here, &["--out", "whole"]).ok();
    for (part, out, expected) in [("1/3", "a", 2), ("2/3", "b", 2), ("3/3", "c", 1)] {
        let said = sweep(here, &["--part", part, "--out", out, "--json"]).ok().json();
        assert_eq!((&said["runs"], &said["rows"]), (&expected.into(), &expected.into()), "{said}");
        assert_eq!((&said["part"], &said["complete"]), (&part.into(), &true.into()), "{said}");
        assert!(names(&here.join(out), "sweep.svg").is_empty(), "nothing is drawn of a part");
    }
    // Rows have the numbers of the whole sweep.
    let numbers = |out: &str| -> Vec<String> {
        let rows = rows(&here.join(out));
        rows.iter().skip(1).map(|row| row.split(',').next().unwrap_or_default().to_owned()).collect()
    };
    assert_eq!([numbers("a"), numbers("b")], [["0", "3"], ["1", "4"]]);
    assert_eq!(numbers("c"), ["2"]);

    let said = nappe_in(here, &["sweep", "join", "c", "a", "b", "--out", "joined", "--json"]).ok().json();
    assert_eq!((&said["runs"], &said["ok"]), (&5.into(), &5.into()), "{said}");
    let [whole, joined] = ["whole", "joined"].map(|name| here.join(name));
    assert_eq!(rows(&joined), rows(&whole));
    for begin in ["run-", "sweep.svg", "sweep.png"] {
        assert_eq!(names(&joined, begin), names(&whole, begin));
    }
    for name in names(&whole, "run-") {
        let [whole, joined] = [&whole, &joined].map(|folder| fs::read(folder.join(&name)).expect("an end"));
        assert!(whole == joined, "{name}");
    }
    let [whole, joined] = [&whole, &joined].map(|folder| -> Value {
        let text = fs::read_to_string(folder.join("sweep.json")).expect("sweep.json");
        serde_json::from_str(&text).expect("JSON")
    });
    assert_eq!(joined, whole);
}

#[test]
fn a_part_that_lacks_rows_is_named_and_the_whole_sweep_computes_them() {
    let folder = with_scene();
    let here = folder.path();
    sweep(here, &["--part", "2/2", "--out", "b"]).ok();
    let join = |force: &[&str]| nappe_in(here, &[&["sweep", "join", "b", "--out", "joined"], force].concat());
    let joined = join(&[]);
    assert_eq!(joined.code, Some(1), "{joined:?}");
    let told = "sweep.csv has 2 of 5 runs; parts that lack some: 1/2";
    assert!(joined.stderr.contains(told), "{}", joined.stderr);
    // It may be joined again, and goes on as any sweep.
    assert_eq!(join(&[]).code, Some(1));
    let said = sweep(here, &["--out", "joined", "--json"]).ok().json();
    assert_eq!((&said["rows"], &said["part"]), (&5.into(), &Value::Null), "{said}");
    assert!(join(&[]).ok().stdout.contains("5 of 5 runs finished"));
}

#[test]
fn what_is_no_part_of_one_sweep_is_refused_by_name() {
    let folder = with_scene();
    let here = folder.path();
    for wrong in ["0/3", "4/3", "3", "a/b"] {
        let done = sweep(here, &["--part", wrong, "--out", "x"]);
        assert_eq!(done.code, Some(2), "{done:?}");
        assert!(done.stderr.contains("is no part; allowed: K/N"), "{}", done.stderr);
    }
    sweep(here, &["--part", "1/2", "--out", "a"]).ok();
    sweep(here, &["--part", "1/2", "--out", "again"]).ok();
    sweep(here, &["--part", "2/3", "--out", "third"]).ok();
    sweep(here, &["--out", "whole"]).ok();
    sweep(here, &["--part", "2/2", "--out", "other", "--measure", "body.sheet.lowest"]).ok();
    // Two parts have no place in one folder.
    let other = sweep(here, &["--part", "2/2", "--out", "a"]);
    assert!(other.stderr.contains("the arguments are others (--part)"), "{other:?}");
    fs::create_dir(here.join("empty")).expect("a folder");
    for (parts, code, told) in [
        (&["a", "again"][..], 2, "part 1/2 is there twice"),
        (
            &["a", "third"],
            2,
            "third holds a part of another sweep than a: it is one of 3 parts, and not of 2",
        ),
        (
            &["a", "other"],
            2,
            "other holds a part of another sweep than a: the arguments are others (--measure)",
        ),
        (&["a", "whole"], 2, "whole holds a sweep, and no part of one"),
        (&["a", "empty"], 1, "sweep.json"),
    ] {
        let done = nappe_in(here, &[&["sweep", "join"], parts, &["--out", "joined"]].concat());
        assert_eq!(done.code, Some(code), "{parts:?}: {done:?}");
        assert!(done.stderr.contains(told), "{parts:?}: {}", done.stderr);
    }
    let own = nappe_in(here, &["sweep", "join", "a", "--out", "a", "--force"]);
    assert_eq!(own.code, Some(2), "{own:?}");
    assert!(own.stderr.contains("--out a: is the folder of part 1/2"), "{}", own.stderr);
    assert_eq!(rows(&here.join("a")).len(), 4, "its rows stay");
    assert_eq!(nappe_in(here, &["sweep"]).code, Some(2));
    assert_eq!(nappe_in(here, &["sweep", "join", "--out", "joined"]).code, Some(2));
}

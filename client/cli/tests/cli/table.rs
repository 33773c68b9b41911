//! `--save FILE.csv` and `--table`: a row per frame, with the columns that the documents list and the numbers that other files have.

use std::{fs, path::Path};

use crate::{
    snow::SNOW_SCENE,
    support::{SMALL_SCENE, folder, nappe_in, write_scene},
    vtk::{Vtp, listed},
};

/// The names in the first column of the tables of a section.
fn listed_in(page: &str, title: &str) -> Vec<String> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs").join(page);
    let page = fs::read_to_string(&path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let (level, _) = title.split_once(' ').expect("a title");
    let (_, section) = page.split_once(&format!("\n{title}\n")).expect("a section");
    let section = section.split(&format!("\n{level} ")).next().expect("a section");
    let cells = section.lines().filter_map(|line| line.strip_prefix("| `")?.split('|').next());
    cells
        .flat_map(|cell| cell.split([',', '`', ' ']).filter(|word| !word.is_empty()).map(str::to_owned))
        .collect()
}

/// The columns that `docs/command.md` lists: in place of `surface_*` those numbers that the page of surfaces lists.
fn documented() -> Vec<String> {
    let columns = listed_in("command.md", "### The table").into_iter();
    let of_surfaces = listed_in("laws/surfaces.md", "## What a step tells");
    let each = |column: String| {
        let told =
            |prefix: &str| of_surfaces.iter().map(|number| format!("{prefix}{number}")).collect::<Vec<_>>();
        column.strip_suffix('*').map_or_else(|| vec![column.clone()], told)
    };
    columns.flat_map(each).collect()
}

/// The names of the columns, and the fields of each row; no field here has a comma.
pub(crate) fn read(path: &Path) -> (Vec<String>, Vec<Vec<String>>) {
    let text = fs::read_to_string(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    assert!(text.ends_with('\n'), "its last line is whole");
    let mut lines = text.lines().map(|line| line.split(',').map(str::to_owned).collect::<Vec<_>>());
    let names = lines.next().expect("names of columns");
    let rows: Vec<Vec<String>> = lines.collect();
    assert!(rows.iter().all(|row| row.len() == names.len()), "a field for each column");
    (names, rows)
}

#[test]
fn a_table_has_the_columns_that_the_documents_list_and_those_of_its_colliders() {
    let here = folder();
    let felt = ["force_x", "force_y", "force_z", "torque_x", "torque_y", "torque_z", "contacts"];
    let felt = felt.map(|part| format!("load_floor_{part}"));
    for (text, loads) in [(SMALL_SCENE, &[][..]), (SNOW_SCENE, &felt[..])] {
        let scene = write_scene(here.path(), text);
        let run = ["run", &scene, "--steps", "8", "--json", "--force", "--save", "run.csv"];
        let told = nappe_in(here.path(), &run).ok().json();
        let (names, rows) = read(&here.path().join("run.csv"));
        assert_eq!(names, [documented().as_slice(), loads].concat());
        assert_eq!(told["frames"], rows.len());
        let field = |row: &[String], name: &str| {
            row[names.iter().position(|known| known == name).expect("a column")].clone()
        };
        let last = rows.last().expect("a row");
        assert_eq!(field(last, "step"), "8");
        assert_eq!(told["state_hash"], field(last, "state_hash"));
        // Cloth has no snow, and snow no cloth.
        let (there, absent) = if loads.is_empty() { ("cloth", "snow") } else { ("snow", "cloth") };
        assert!(!field(last, &format!("{there}_bound")).is_empty());
        let of_absent = names.iter().filter(|name| name.starts_with(&format!("{absent}_")));
        assert!(of_absent.clone().count() > 9);
        assert!(of_absent.clone().all(|name| field(last, name).is_empty()), "{last:?}");
    }
}

#[test]
fn a_table_beside_other_files_has_their_numbers_to_the_last_bit() {
    let here = folder();
    let scene = write_scene(here.path(), SNOW_SCENE);
    nappe_in(here.path(), &["run", &scene, "--save", "run.pvd", "--table", "beside.csv"]).ok();
    let (names, rows) = read(&here.path().join("beside.csv"));
    let column = |name: &str| names.iter().position(|known| known == name).expect("a column");
    let files = listed(&here.path().join("run.pvd"), "particles");
    assert_eq!(files.len(), rows.len());
    for (row, (time, file)) in rows.iter().zip(&files) {
        let vtp = Vtp::read(&here.path().join(file));
        let number = |name: &str| -> f64 { row[column(name)].parse().expect("a number") };
        assert_eq!(number("time_seconds"), *time);
        for name in ["step", "frame"] {
            assert_eq!(vtp.numbers(name), [number(name)]);
        }
    }
    let (row, (_, file)) = (rows.last().expect("a row"), files.last().expect("a file"));
    let (vtp, number) = (Vtp::read(&here.path().join(file)), |name: &str| row[column(name)].parse::<f64>());
    for name in ["kinetic_energy", "elastic_energy", "gravitational_energy", "contact_count"] {
        assert_eq!(vtp.numbers(name).first().copied(), number(name).ok(), "{name}");
    }
    let force = ["x", "y", "z"].map(|axis| number(&format!("load_floor_force_{axis}")).expect("a number"));
    assert_eq!(vtp.numbers("load_force"), force);

    // A page gets one too, and a table alone needs no other file.
    let [page, alone] = [&["--save", "page.html", "--table", "a.csv"][..], &["--table", "b.csv"]];
    for more in [page, alone] {
        nappe_in(here.path(), &[&["run", scene.as_str()][..], more].concat()).ok();
    }
    assert!(here.path().join("page.html").is_file());
    for name in ["a.csv", "b.csv"] {
        let (own, of_own) = read(&here.path().join(name));
        assert_eq!((own, of_own.len()), (names.clone(), rows.len()), "{name}");
        let hash = column("state_hash");
        assert_eq!(of_own.last().expect("a row")[hash], rows.last().expect("a row")[hash]);
    }
}

#[test]
fn what_a_table_cannot_be_is_told_and_an_earlier_one_stays() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    fs::write(here.path().join("mine.csv"), "mine").expect("a file");
    for (args, code, part) in [
        (&["--save", "mine.csv"][..], 1, "mine.csv is there already"),
        (&["--save", "new.html", "--table", "mine.csv"], 1, "mine.csv is there already"),
        (&["--table", "run.txt"], 2, "--table run.txt: a table is a file whose name ends in .csv"),
        (&["--save", "run.csv", "--table", "run.csv"], 2, "two files have two names"),
        (&["--save", "run.csv", "--fields", "velocity"], 2, "--fields belongs to"),
        (&["--save", "run.csv", "--color", "speed"], 2, "--color belongs to"),
        (&["--resume", "frames", "--table", "run.csv"], 2, "--table"),
    ] {
        let done = nappe_in(here.path(), &[&["run", scene.as_str()][..], args].concat());
        assert!(done.code == Some(code) && done.stderr.contains(part), "{args:?}: {done:?}");
    }
    assert_eq!(fs::read(here.path().join("mine.csv")).expect("it is there"), b"mine");
    assert_eq!(fs::read_dir(here.path()).expect("a folder").count(), 2, "nothing else is there");
}

#[cfg(target_os = "linux")]
#[test]
fn a_full_disk_is_told_with_the_name_of_the_table() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    std::os::unix::fs::symlink("/dev/full", here.path().join("full.csv")).expect("a link");
    let done = nappe_in(here.path(), &["run", &scene, "--save", "full.csv"]);
    assert!(done.code == Some(1) && done.stderr.contains("cannot write full.csv"), "{done:?}");
}

//! Springs of a table beside a scene: read by the command, sent with the mesh, and refused with file, line and column.

use std::fs;

use crate::support::{Folder, Server, folder, nappe_in};

/// A square of two triangles.
const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 0 1\nv 0 0 1\nf 1 2 3\nf 1 3 4\n";
/// The edges of its triangles.
const TABLE: &str =
    "particle_a,particle_b,stiffness,damping\n0,1,10,0.1\n0,2,10,0.1\n0,3,10,0.1\n1,2,10,0.1\n2,3,10,0.1\n";

fn scene(springs: &str) -> String {
    format!(
        "version = 1\ndt = 0.01\nsteps = 20\n[[body]]\nname = \"a\"\nmesh = {{ file = \"a.obj\" }}\n\
         mass = {{ particle = 0.1 }}\npins = [0]\nsprings = {{ {springs} }}\n"
    )
}

/// A folder with the square, its springs, a scene that takes them, and one with the same by a law.
fn written() -> Folder {
    let here = folder();
    let write = |name: &str, text: &str| fs::write(here.path().join(name), text).expect("written");
    write("a.obj", SQUARE);
    write("springs.csv", TABLE);
    write("table.toml", &scene("file = \"springs.csv\""));
    write("law.toml", &scene("stretch = { stiffness = 10, damping = 0.1 }"));
    here
}

#[test]
fn springs_of_a_table_are_those_of_the_body_here_and_on_a_server() {
    let (here, server) = (written(), Server::start());
    let hash = |scene: &str| {
        let ran = nappe_in(here.path(), &["run", scene, "--json"]).ok().json();
        ran["state_hash"].clone()
    };
    assert_eq!(hash("table.toml"), hash("law.toml"), "the same springs, by a table and by a law");
    let path = here.path().join("table.toml").display().to_string();
    assert_eq!(server.nappe(&["run", &path]).ok().json()["state_hash"], hash("law.toml"));

    let checked = nappe_in(here.path(), &["check", "table.toml", "--json"]).ok().json();
    assert_eq!((&checked["particles"], &checked["springs"]), (&4.into(), &5.into()), "{checked}");

    // Stiffer springs are others.
    fs::write(here.path().join("springs.csv"), TABLE.replace(",10,", ",20,")).expect("written");
    assert_ne!(hash("table.toml"), hash("law.toml"));
}

#[test]
fn a_sweep_knows_a_table_by_its_hash() {
    let here = written();
    let args = ["sweep", "table.toml", "--set", "gravity.1=-9,-10", "--steps", "5", "--out", "swept"];
    nappe_in(here.path(), &args).ok();
    fs::write(here.path().join("springs.csv"), TABLE.replace(",10,", ",20,")).expect("written");
    let refused = nappe_in(here.path(), &args);
    assert_eq!(refused.code, Some(2), "{refused:?}");
    assert!(refused.stderr.contains("springs.csv changed since the sweep began"), "{}", refused.stderr);
}

#[test]
fn what_is_wrong_with_a_table_is_told_with_its_file_line_and_column() {
    let here = written();
    for (table, told) in [
        (TABLE.replace("2,3,10", "2,4,10"), "springs.csv:6:3: names point '4'; allowed: 0 to 3"),
        (
            TABLE.replace("2,3,10", "2,3,-10"),
            "springs.csv:6:5: has the stiffness -10; allowed: a finite number",
        ),
        (TABLE.replace(',', ";"), "springs.csv:1:1: has other marks than commas"),
    ] {
        fs::write(here.path().join("springs.csv"), table).expect("written");
        for verb in ["run", "check"] {
            let refused = nappe_in(here.path(), &[verb, "table.toml"]);
            assert_eq!(refused.code, Some(1), "{refused:?}");
            assert!(refused.stderr.contains(told), "{verb}: {}, not {told}", refused.stderr);
        }
    }
    fs::remove_file(here.path().join("springs.csv")).expect("it was just written");
    let refused = nappe_in(here.path(), &["run", "table.toml"]);
    let told = "body[0].springs.file: names ";
    assert!(refused.code == Some(1) && refused.stderr.contains("table.toml:9:"), "{refused:?}");
    assert!(refused.stderr.contains(told) && refused.stderr.contains("springs.csv"), "{}", refused.stderr);
}

//! `nappe scenes coarser`: copies that run, and what has none.

use std::{fs, path::Path};

use serde_json::json;

use crate::support::{SMALL_SCENE, folder, nappe, nappe_in, write_scene};

#[test]
fn a_coarser_copy_is_printed_or_written_and_runs() {
    let folder = folder();
    let text = nappe(&["scenes", "coarser", "hanging_sheet", "--by", "2"]).ok().stdout;
    let first = "# A copy of hanging_sheet, coarser by 2: sheet has 20 x 20 particles in place of 40 x 40.\n";
    assert!(text.starts_with(first), "{text}");
    for part in [
        "# A sheet hangs by its two upper corners",
        "grid = [20, 20]",
        "pins = [\"top_left\", \"top_right\"]",
    ] {
        assert!(text.contains(part), "'{part}' is missing in {text}");
    }

    let args = ["scenes", "coarser", "two_snowballs", "--by", "3", "--write", "coarse.toml"];
    let written = nappe_in(folder.path(), &[&args[..], &["--json"]].concat()).ok().json();
    let changes = json!(["cells of snow have sides of 0.09 m in place of 0.03 m"]);
    assert_eq!((&written["changes"], &written["written"]), (&changes, &json!("coarse.toml")), "{written}");
    let stays = nappe_in(folder.path(), &args);
    assert_eq!(stays.code, Some(1), "{stays:?}");
    assert!(stays.stderr.contains("coarse.toml is there already: --force overwrites it"), "{}", stays.stderr);
    let again = nappe_in(folder.path(), &[&args[..], &["--force"]].concat()).ok().stdout;
    assert_eq!(again.trim_end(), "coarse.toml: cells of snow have sides of 0.09 m in place of 0.03 m");
    let ran = nappe_in(folder.path(), &["run", "coarse.toml", "--json"]).ok().json();
    assert_eq!(ran["steps"], json!(72), "{ran}");
}

#[test]
fn a_copy_is_written_where_the_meshes_of_the_scene_are() {
    let here = folder();
    let inner = here.path().join("inner");
    fs::create_dir(&inner).expect("a folder");
    let tip = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
    fs::write(here.path().join("tip.obj"), tip).expect("a mesh");
    let collider = "[[collider]]\nname = \"tip\"\nmesh = { file = \"tip.obj\", transform = { translate = [0, -3, 0] } }\n";
    let scene = write_scene(here.path(), &format!("{SMALL_SCENE}\n{collider}"));
    let write = |to: &str| nappe_in(here.path(), &["scenes", "coarser", &scene, "--by", "2", "--write", to]);
    let refused = write("inner/coarse.toml");
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("there is no tip.obj beside it"), "{}", refused.stderr);
    assert!(!inner.join("coarse.toml").exists());
    write("coarse.toml").ok();
    let checked = nappe_in(here.path(), &["check", "coarse.toml", "--json"]).ok().json();
    assert_eq!(checked["particles"], json!(36), "{checked}");
}

#[test]
fn what_has_no_coarser_copy_says_what_works() {
    let here = folder();
    let refused = |scene: &str, by: &str, code: i32, parts: &[&str]| {
        let done = nappe_in(here.path(), &["scenes", "coarser", scene, "--by", by]);
        assert_eq!((done.code, done.stdout.as_str()), (Some(code), ""), "{done:?}");
        assert!(parts.iter().all(|part| done.stderr.contains(part)), "{}", done.stderr);
    };
    refused("flag", "3", 1, &["flag:12:8: body[0].mesh: has 60 x 40 particles", "allowed: 2, 4, 5, 10, 20"]);
    refused("drap10", "2", 1, &["is a course_grid", "grid = [10, 10]"]);
    refused("flga", "2", 1, &["no scene 'flga' comes with nappe; did you mean 'flag'?"]);
    refused("flag", "1", 2, &["--by"]);
    refused("flag", "1.5", 2, &["--by"]);
    let mesh = SMALL_SCENE.replace("{ grid = [12, 12], spacing = 0.05 }", "{ file = \"cow.obj\" }");
    let scene = write_scene(here.path(), &mesh);
    let name = Path::new(&scene).file_name().and_then(|name| name.to_str()).expect("a name");
    refused(name, "2", 1, &["scene.toml:10:8: body[0].mesh: is a file, and no grid", "and of snow"]);
}

#[test]
fn the_springs_of_a_scene_are_written_as_a_table() {
    let here = folder();
    let args = ["scenes", "drap10", "--springs", "springs.csv"];
    let written = nappe_in(here.path(), &[&args[..], &["--json"]].concat()).ok().json();
    // The edges of 9 x 9 cells of two triangles.
    assert_eq!(written, json!({ "scene": "drap10", "springs": 261, "written": "springs.csv" }));
    let text = fs::read_to_string(here.path().join("springs.csv")).expect("the table");
    let mut lines = text.lines();
    assert_eq!(lines.next(), Some("particle_a,particle_b,stiffness,damping,rest_length,kind"));
    let lengths = lines.map(|line| {
        let values: Vec<&str> = line.split(',').collect();
        assert_eq!(
            (values.len(), &values[2..4], values[5]),
            (6, &["15000", "0.01"][..], "stretch"),
            "{line}"
        );
        values[4].parse::<f64>().expect("a length")
    });
    let lengths: Vec<f64> = lengths.collect();
    assert!(lengths.len() == 261 && lengths.iter().all(|length| (0.09..0.3).contains(length)), "{text}");

    let stays = nappe_in(here.path(), &args);
    assert!(stays.code == Some(1) && stays.stderr.contains("is there already"), "{stays:?}");
    for (name, part) in [("five_sheets", "5 bodies"), ("brasseur", "0 bodies")] {
        let refused = nappe_in(here.path(), &["scenes", name, "--springs", "other.csv"]);
        assert!(refused.code == Some(1) && refused.stderr.contains(part), "{}", refused.stderr);
    }
    let alone = nappe_in(here.path(), &["scenes", "--springs", "other.csv"]);
    assert_eq!(alone.code, Some(2), "{alone:?}");
}

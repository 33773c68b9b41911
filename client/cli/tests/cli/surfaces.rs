//! What keeps surfaces of cloth apart, as `nappe run` and `nappe check` tell it.

use std::fs;

use serde_json::{Value, json};

use crate::support::{SMALL_SCENE, folder, nappe, write_scene};

/// Two triangles that go through each other: an edge of each crosses the other.
const CROSSED: &str =
    "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0.2 0.25 -0.5\nv 0.2 0.25 0.5\nv 5 5.1 0.1\nf 1 2 3\nf 4 5 6\n";

#[test]
fn a_run_tells_what_kept_surfaces_apart_and_counts_crossings_where_that_is_asked_for() {
    let here = folder();
    let plain = write_scene(here.path(), SMALL_SCENE);
    assert_eq!(nappe(&["run", &plain, "--json"]).ok().json()["surface_at_end"], Value::Null);
    assert!(!nappe(&["run", &plain]).ok().stdout.contains("surfaces in the last step"));

    let counted = SMALL_SCENE.replace("steps = 40", "steps = 40\ncontact = { surface = \"count\" }");
    let counted = write_scene(here.path(), &counted);
    let told = nappe(&["run", &counted, "--json"]).ok().json();
    assert_eq!(
        (&told["surface_at_end"]["crossings"], &told["surface_at_end"]["pairs"]),
        (&json!(0), &json!(0)),
        "{told}"
    );
    assert_eq!(told["surface_at_end"]["least_gap_m"], Value::Null, "{told}");

    let thick = SMALL_SCENE.replace("mass =", "thickness = 0.01\nmass =");
    let thick = write_scene(here.path(), &thick);
    let told = nappe(&["run", &thick, "--json"]).ok().json();
    let surface = &told["surface_at_end"];
    for number in ["pairs", "active", "rounds"] {
        assert!(surface[number].is_u64(), "{number}: {surface}");
    }
    assert_eq!((&surface["failed"], &surface["crossings"]), (&json!(0), &Value::Null), "{surface}");
    let text = nappe(&["run", &thick]).ok().stdout;
    assert!(text.contains("surfaces in the last step") && text.contains(" pairs push"), "{text}");
}

#[test]
fn a_check_tells_where_surfaces_cross_and_refuses_that_with_a_thickness() {
    let here = folder();
    fs::write(here.path().join("crossed.obj"), CROSSED).expect("a mesh");
    let scene = |keys: &str| {
        let text = "version = 1\ndt = 0.005\n\n[[body]]\nname = \"two\"\nmesh = { file = \"crossed.obj\" }\n\
            mass = { particle = 0.01 }\nsprings = { stretch = { stiffness = 10 } }\n";
        write_scene(here.path(), &format!("{text}{keys}"))
    };
    let free = scene("");
    let checked = nappe(&["check", &free, "--json"]).ok().json();
    let crossing = &checked["crossings"][0];
    assert_eq!((&crossing["body"], &crossing["count"]), (&json!("two"), &json!(2)), "{checked}");
    let pairs = [(json!([0, 1, 2]), json!([3, 4])), (json!([3, 4, 5]), json!([1, 2]))];
    let found = (crossing["triangle"].clone(), crossing["edge"].clone());
    assert!(pairs.contains(&found), "{checked}");
    let text = nappe(&["check", &free]).ok().stdout;
    assert!(
        text.contains("body 'two': 2 times an edge crosses a triangle, first that of particles"),
        "{text}"
    );

    let done = nappe(&["check", &scene("thickness = 0.001\n")]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(
        done.stderr.contains("body 'two'") && done.stderr.contains("2 times an edge crosses"),
        "{done:?}"
    );

    let plain = nappe(&["check", "flag", "--json"]).ok().json();
    assert_eq!(plain["crossings"], json!([]));
}

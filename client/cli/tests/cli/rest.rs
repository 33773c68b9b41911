//! How still cloth lies, as `nappe run` and `nappe check` tell it.

use std::fs;

use serde_json::{Value, json};

use crate::support::{SMALL_SCENE, folder, nappe, write_scene};

#[test]
fn a_run_tells_how_much_lies_still_where_that_is_asked_for() {
    let here = folder();
    let plain = write_scene(here.path(), SMALL_SCENE);
    assert_eq!(nappe(&["run", &plain, "--json"]).ok().json()["rest_at_end"], Value::Null);
    assert!(!nappe(&["run", &plain]).ok().stdout.contains("at rest"));

    let watched = SMALL_SCENE.replace("steps = 40", "steps = 40\nrest = { error = 1e-3 }");
    let watched = write_scene(here.path(), &watched);
    let told = nappe(&["run", &watched, "--json"]).ok().json();
    let rest = &told["rest_at_end"];
    assert_eq!((&rest["pieces"], &rest["calm_pieces"]), (&json!(1), &json!(0)), "{told}");
    assert_eq!(rest["calm_share"], json!(0.0), "{told}");
    assert!(rest["way_m"].as_f64() > Some(0.0) && rest["change_m"].as_f64() > Some(0.0), "{told}");
    let text = nappe(&["run", &watched]).ok().stdout;
    assert!(text.contains("at rest") && text.contains("0 of 1 pieces are calm, 0.0 %"), "{text}");
}

#[test]
fn a_check_refuses_an_error_that_rounding_hides() {
    let here = folder();
    let scene = |error: &str, precision: &str| {
        let keys = format!("steps = 40\nprecision = \"{precision}\"\nrest = {{ error = {error} }}");
        let path = here.path().join(format!("{precision}.toml"));
        fs::write(&path, SMALL_SCENE.replace("steps = 40", &keys)).expect("a scene");
        path.to_str().expect("a path of letters").to_owned()
    };
    let refused = nappe(&["check", &scene("1e-7", "f32")]);
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("the error of rest is 1e-7 m: at least "), "{refused:?}");
    nappe(&["check", &scene("1e-7", "f64")]).ok();
}

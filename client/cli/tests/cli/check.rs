//! `nappe check`, and scenes whose colliders are meshes in files beside them.

use std::{fs, path::Path};

use serde_json::json;

use crate::support::{SMALL_SCENE, Server, course, folder, nappe, nappe_in, write_scene};

/// A tetrahedron without one of its faces.
const OPEN: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\n";

/// Writes the small scene with a collider of a file beside it, whose tip is below the sheet; the path of the scene.
fn scene(folder: &Path, keys: &str) -> String {
    fs::write(folder.join("tip.obj"), OPEN).expect("a mesh");
    let collider = format!(
        "[[collider]]\nname = \"tip\"\nmesh = {{ file = \"tip.obj\", transform = {{ scale = 0.5, translate = [0.3, -0.55, 0.3] }}{keys} }}\n"
    );
    write_scene(folder, &format!("{SMALL_SCENE}\n{collider}"))
}

#[test]
fn a_scene_is_checked_with_the_meshes_of_its_colliders() {
    let folder = folder();
    let scene = scene(folder.path(), ", close_holes = true");
    let done = nappe(&["check", &scene, "--json"]).ok();
    let checked = done.json();
    assert_eq!((&checked["scene"], &checked["particles"]), (&json!(scene), &json!(144)), "{checked}");
    let collider = &checked["colliders"][0];
    assert_eq!(
        (&collider["name"], &collider["triangles"], &collider["holes_closed"]),
        (&json!("tip"), &json!(4), &json!(1)),
        "{checked}"
    );
    assert_eq!(
        (&collider["crossings"]["count"], &collider["crossings"]["triangles"]),
        (&json!(0), &json!(null))
    );
    let volume = collider["volume"].as_f64().expect("a number");
    assert!((volume - 1.0 / 48.0).abs() < 1e-12, "{volume}");
    let told = "collider 'tip': 1 hole is filled (close_holes = true)";
    assert_eq!(checked["warnings"], json!([told]));
    assert!(done.stderr.contains(told), "{}", done.stderr);

    let text = nappe(&["check", &scene]).ok().stdout;
    for part in ["no errors; 144 particles", "tip", "holes closed", "crossings", "0.02083 m^3"] {
        assert!(text.contains(part), "'{part}' is missing in {text}");
    }
}

#[test]
fn a_body_that_bends_as_a_plate_is_told_with_what_its_mesh_makes_of_that() {
    let folder = folder();
    let law = "[[body.law]]\nname = \"plate\"\nstiffness = 1e-4\n";
    let scene = write_scene(folder.path(), &format!("{SMALL_SCENE}\n{law}"));
    let done = nappe(&["check", &scene, "--json"]).ok();
    let checked = done.json();
    let told = &checked["bending"][0];
    assert_eq!((&told["body"], &told["dropped"]), (&json!("sheet"), &json!(0)), "{checked}");
    // The diagonals of a grid run one way.
    let factor = told["factor"].as_f64().expect("a number");
    let poisson = told["poisson"].as_f64().expect("a number");
    assert!((factor - 1.0).abs() < 1e-9 && poisson.abs() < 1e-9, "{checked}");
    assert!(told["measured_triangles"].as_u64().is_some_and(|count| count > 60), "{checked}");

    let text = nappe(&["check", &scene]).ok().stdout;
    for part in ["bend with 1 of the stiffness of plate", "Poisson's ratio 0.00"] {
        assert!(text.contains(part), "'{part}' is missing in {text}");
    }
    let without = nappe(&["check", &write_scene(folder.path(), SMALL_SCENE), "--json"]).ok();
    assert_eq!(without.json()["bending"], json!([]));
}

#[test]
fn a_fabric_is_told_with_the_length_of_its_folds_and_the_bound_of_explicit_steps() {
    let folder = folder();
    let body = "[[body]]\nname = \"sheet\"\nmesh = { grid = [9, 9], spacing = 0.01 }\nmaterial = { preset = \"denim\" }\n";
    let fine = format!("version = 1\ndt = 0.005\nsteps = 4\n{body}pins = [\"top\"]\n");
    let checked = nappe(&["check", &write_scene(folder.path(), &fine), "--json"]).ok().json();
    let told = &checked["fabric"][0];
    assert_eq!((&told["body"], &told["preset"]), (&json!("sheet"), &json!("denim")), "{checked}");
    // (D / (9.81 m))^(1/3), and a diagonal.
    let [fold, edge] = ["fold_length_m", "longest_edge_m"].map(|key| told[key].as_f64().expect("a number"));
    assert!((fold - 0.02706).abs() < 1e-5 && (edge - 0.01 * 2.0_f64.sqrt()).abs() < 1e-9, "{checked}");
    let bound = checked["bound"][0]["seconds"].as_f64().expect("a number");
    assert!((1e-6..1e-3).contains(&bound), "{checked}");
    assert_eq!(checked["warnings"], json!([]), "{checked}");

    // Its steps would be refused unless they are unchecked: nothing but damping bounds them.
    let euler = fine.replace("pins = ", "integrator = \"explicit_euler\"\nunchecked = true\npins = ");
    let done = nappe(&["check", &write_scene(folder.path(), &euler), "--json"]).ok();
    assert_eq!(done.json()["bound"], json!([]), "{}", done.stdout);

    let coarse = write_scene(folder.path(), &fine.replace("spacing = 0.01", "spacing = 0.03"));
    let done = nappe(&["check", &coarse]).ok();
    assert!(done.stdout.contains("body 'sheet': denim, which folds at 0.02706 m"), "{}", done.stdout);
    assert!(done.stderr.contains("more than the 0.02706 m at which it folds"), "{}", done.stderr);
}

#[test]
fn errors_of_a_scene_are_all_told_and_nothing_else() {
    let folder = folder();
    let scene = scene(folder.path(), "");
    let done = nappe(&["check", &scene, "--json"]);
    assert_eq!((done.code, done.stdout.as_str()), (Some(1), ""), "{done:?}");
    assert!(
        done.stderr.contains("collider[0].mesh: is not closed: the edge from point 1"),
        "{}",
        done.stderr
    );
    assert!(done.stderr.contains("close_holes = true fills holes"), "{}", done.stderr);
    let twice = SMALL_SCENE.replace("dt = 0.005", "dt = 5").replace("stiffness = 100.0", "stiffness = -1");
    let done = nappe(&["check", &write_scene(folder.path(), &twice)]);
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stderr.contains("dt: is 5") && done.stderr.contains("stiffness: is -1"), "{}", done.stderr);
    // A step that is too long is known once the simulation is there.
    let long = SMALL_SCENE.replace("pins = ", "integrator = \"symplectic_euler\"\nsubsteps = 1\npins = ");
    let long = long.replace("dt = 0.005", "dt = 0.5");
    let done = nappe(&["check", &write_scene(folder.path(), &long)]);
    assert_eq!(done.code, Some(1), "{done:?}");
}

#[test]
fn a_mesh_file_that_is_missing_is_told_in_the_line_that_names_it() {
    let folder = folder();
    let scene = scene(folder.path(), ", close_holes = true");
    fs::remove_file(folder.path().join("tip.obj")).expect("it is there");
    let line = SMALL_SCENE.lines().count() + 4;
    for verb in ["check", "run"] {
        let done = nappe(&[verb, &scene]);
        assert_eq!(done.code, Some(1), "{done:?}");
        let place = format!("scene.toml:{line}:");
        assert!(done.stderr.contains(&place), "{place}: {}", done.stderr);
        assert!(done.stderr.contains("collider[0].mesh.file: names "), "{}", done.stderr);
        assert!(done.stderr.contains("tip.obj, which cannot be read: "), "{}", done.stderr);
    }
}

#[test]
fn shipped_scenes_are_checked_by_name() {
    let plain = nappe(&["check", "flag", "--json"]).ok().json();
    assert_eq!(plain["colliders"], json!([]));
    let torus = nappe(&["check", "cloth_on_torus", "--json"]).ok().json();
    assert_eq!(
        (&torus["particles"], &torus["colliders"][0]["triangles"], &torus["colliders"][0]["holes_closed"]),
        (&json!(4900), &json!(1024), &json!(0))
    );
    let walker = nappe(&["check", "walker", "--json"]).ok().json();
    let figure = json!({
        "name": "walker", "corners": 2579, "triangles": 5118, "frames": 151, "seconds": 5.0, "bytes": 4_673_148,
    });
    assert_eq!((&plain["figures"], &walker["figures"]), (&json!([]), &json!([figure])));
    let told = nappe(&["check", "walker"]).ok().stdout;
    assert!(told.contains("figure 'walker': 2 579 corners"), "{told}");
    assert_eq!(nappe(&["check", "flga"]).code, Some(1));
}

#[test]
fn a_server_gets_the_mesh_of_a_collider_with_the_scene() {
    let (folder, server) = (folder(), Server::start());
    let scene = scene(folder.path(), ", close_holes = true");
    let here = nappe_in(folder.path(), &["run", &scene, "--json"]).ok();
    let told = "collider 'tip' (tip.obj): 1 hole is filled (close_holes = true)";
    assert!(here.stderr.contains(told), "{}", here.stderr);
    let there = server.nappe(&["run", &scene]).ok().json();
    assert_eq!(here.json()["state_hash"], there["state_hash"]);
    // What is wrong with it stands in the line of the file.
    let open = self::scene(folder.path(), "");
    let refused = server.nappe(&["run", &open]);
    assert_eq!(refused.code, Some(5), "{refused:?}");
    let line = SMALL_SCENE.lines().count() + 4;
    let place = format!("scene.toml:{line}:8: collider[0].mesh: is not closed");
    assert!(refused.stderr.contains(&place), "{place}: {}", refused.stderr);
}

#[test]
fn the_solids_of_the_course_are_colliders() {
    let Some(course) = course() else { return };
    let folder = folder();
    for (name, keys, triangles, holes) in
        [("sphere", "", 320, 0), ("vache", "", 8626, 0), ("bunny", ", close_holes = true", 866, 5)]
    {
        let path = course.join("data").join(name);
        let path = path.to_str().expect("a UTF-8 path");
        let collider = format!("[[collider]]\nname = \"c\"\nmesh = {{ file = '{path}'{keys} }}\n");
        let scene = write_scene(folder.path(), &format!("{SMALL_SCENE}\n{collider}"));
        let checked = nappe(&["check", &scene, "--json"]).ok().json();
        let collider = &checked["colliders"][0];
        assert_eq!(
            (&collider["triangles"], &collider["holes_closed"]),
            (&json!(triangles), &json!(holes)),
            "{name}: {checked}"
        );
        assert!(collider["volume"].as_f64().is_some_and(|volume| volume > 0.0), "{name}: {checked}");
    }
}

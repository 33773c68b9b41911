//! Meshes from outside as bodies: triangles that are there twice, points without triangles, points that are to be one; units.

use std::sync::Arc;

use nappe_scene::{Built, Scene, SceneErrors, SceneLimits, mesh::read_obj};
use nappe_sim::{mesh::TriangleMesh, world::Change};

use crate::{SMALL, Uploaded, message, parse};

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n";
const FLAT_SHADED: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 4 5 6\n";
/// The square with a point far away that no triangle names.
const UNUSED: &str = "v 5 5 5\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4 5\n";

const LAWS: &str = "[body.springs]\nstretch = { stiffness = 10 }\nshear = { stiffness = 5 }\nbend = { stiffness = 1 }\n\
    [[body.law]]\nname = \"quadratic_bending\"\nstiffness = 1e-3\n";

fn text(keys: &str, lines: &str) -> String {
    format!(
        "version = 1\ndt = 0.01\n[[body]]\nname = \"b\"\nmesh = {{ upload = \"m\"{keys} }}\n{lines}\n{LAWS}"
    )
}

fn build(obj: &str, keys: &str, lines: &str) -> Result<Built, SceneErrors> {
    let mesh = read_obj(obj, "mesh.obj").unwrap_or_else(|error| panic!("{error}")).mesh;
    Scene::parse(&text(keys, lines), "scene.toml")?.build(&Uploaded(Arc::new(mesh)), &SceneLimits::default())
}

fn built(obj: &str, keys: &str, lines: &str) -> Built {
    build(obj, keys, lines).unwrap_or_else(|error| panic!("{error}"))
}

fn mass(built: &Built) -> f64 {
    built.setup.bodies[0].network.masses.iter().sum()
}

#[test]
fn a_triangle_that_is_there_twice_counts_once() {
    let density = "mass = { density = 0.2 }";
    let plain = built(SQUARE, "", density);
    assert!((mass(&plain) - 0.2).abs() < 1e-15 && plain.warnings.is_empty(), "{:?}", plain.warnings);

    let twice = built(&format!("{SQUARE}f 3 1 2\n"), "", density);
    assert_eq!(twice.setup, plain.setup);
    assert_eq!(twice.warnings, ["body 'b': 1 repeated triangles, the first is 2: each counts once"]);

    let two_sided = built(&format!("{SQUARE}f 3 2 1\nf 1 4 3\n"), "", density);
    assert_eq!(two_sided.setup, plain.setup);
    assert_eq!(
        two_sided.warnings,
        [
            "body 'b': 2 repeated triangles, the first is 2: each counts once; 2 of them run the other way round, as on a \
          sheet with two sides"
        ]
    );
}

#[test]
fn a_plate_is_refused_where_three_triangles_share_an_edge() {
    let plate = text("", "mass = { density = 1 }").replace("quadratic_bending", "plate");
    let build = |obj: &str| {
        let mesh = read_obj(obj, "mesh.obj").unwrap_or_else(|error| panic!("{error}")).mesh;
        let scene = Scene::parse(&plate, "scene.toml").unwrap_or_else(|error| panic!("{error}"));
        scene.build(&Uploaded(Arc::new(mesh)), &SceneLimits::default())
    };
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0.5 0.5 1\n";
    let error = build(&format!("{points}f 1 2 3\nf 1 3 4\nf 1 3 5\n")).unwrap_err().to_string();
    let told = "law[0].name: is plate, which bends edges between two triangles: more than two share the edge from point 0 to 2; \
                allowed: one or two at each edge";
    assert!(error.ends_with(told), "{error}");

    // One that is there twice counts once.
    let twice = build(&format!("{SQUARE}f 3 1 2\n")).unwrap_or_else(|error| panic!("{error}"));
    let network = &twice.setup.bodies[0].network;
    assert_eq!(network.elements[0].corner_count(), 12, "both triangles bend, each with six particles");
}

#[test]
fn weld_makes_one_part_of_a_flat_shaded_mesh_with_its_springs() {
    let density = "mass = { density = 1 }\npins = [3]";
    let apart = built(FLAT_SHADED, "", density);
    let hint = "body 'b': no two of the 2 triangles share a point, so that a cloth of them falls apart: weld = 1e-6 in the \
                body's mesh joins points at the same place";
    assert_eq!((apart.warnings[0].as_str(), apart.setup.bodies[0].network.springs.len()), (hint, 6));

    let welded = built(FLAT_SHADED, ", weld = 1e-6", density);
    assert_eq!(welded.warnings, ["body 'b': weld = 1e-6 joins 2 points to earlier ones, 4 are left"]);
    let plain = built(SQUARE, "", density);
    assert_eq!(welded.setup, plain.setup, "5 edges, and the diagonal across two triangles");
    let network = &welded.setup.bodies[0].network;
    let mesh = TriangleMesh {
        points: network.x.clone(),
        triangles: network.triangles.clone(),
        ..TriangleMesh::default()
    };
    assert_eq!((mesh.points.len(), mesh.triangles.len(), mesh.survey().parts), (4, 2, 1));
    assert_eq!((network.springs.len(), network.elements.len()), (6, 1));
    assert!((mass(&welded) - 1.0).abs() < 1e-15);

    let none = built(SQUARE, ", weld = 1e-6", density);
    assert_eq!(none.warnings, ["body 'b': weld = 1e-6 joins no points: no two are that near to each other"]);
    let error = build(FLAT_SHADED, ", weld = 1e-6", "mass = { density = 1 }\npins = [4]").unwrap_err();
    assert!(
        error.to_string().ends_with("pins[0]: is 4; allowed: 0 to 3, the particles of this body"),
        "{error}"
    );
    let error = build(FLAT_SHADED, ", weld = 0.5", density).unwrap_err();
    assert_eq!(
        error.to_string(),
        "scene.toml:5:31: body[0].mesh.weld: points cannot be joined over 0.5 m; allowed for this mesh: 1e-12 to 0.1 m, \
         a tenth of its median edge"
    );
}

#[test]
fn points_without_triangles_are_left_out_before_anything_else() {
    let density = "mass = { density = 1 }\npins = [0]";
    let error = build(UNUSED, "", density).unwrap_err();
    assert_eq!(
        error.to_string(),
        "scene.toml:6:8: body[0].mass: gives particle 0 the mass 0: no triangle names it; allowed here: unused = \"drop\" in \
         its mesh, which leaves such points out, { particle = kg } or { total = kg }"
    );
    let kept = built(UNUSED, "", "mass = { particle = 1 }");
    assert_eq!(
        kept.warnings,
        [
            "body 'b': 1 isolated points, the first is 0: no triangle names them, so they fall freely; unused = \"drop\" in \
          the body's mesh leaves them out"
        ]
    );

    let chain = "[[body]]\nname = \"c\"\nmesh = { chain = 3, spacing = 0.1 }\nmass = { particle = 1 }\npins = [\"last\"]\n\
                 [[body.moving_pin]]\npin = \"last\"\noffset = [0, 0, 1]\nduration = 1\n";
    let mesh = read_obj(UNUSED, "mesh.obj").unwrap().mesh;
    let scene = parse(&format!("{}{chain}", text(", unused = \"drop\"", density))).unwrap();
    let dropped = scene.build(&Uploaded(Arc::new(mesh)), &SceneLimits::default()).unwrap();
    assert_eq!(dropped.setup.bodies[0], built(SQUARE, "", density).setup.bodies[0]);
    assert!((mass(&dropped) - 1.0).abs() < 1e-15);
    assert_eq!(
        dropped.warnings[0],
        "body 'b': unused = \"drop\" leaves out 1 point, which no triangle names"
    );
    let [Change::Pin { particle, .. }] = dropped.initial_changes[..] else { panic!("one pin moves") };
    assert_eq!(particle, 4 + 2, "the particles that are left are counted");

    let error = build("v 0 0 0\nv 1 0 0\n", ", unused = \"drop\"", density).unwrap_err().to_string();
    assert!(error.contains("body[0].mesh.unused: is \"drop\", and no triangle names any point"), "{error}");
}

#[test]
fn what_is_put_in_order_survives_a_round_trip_and_is_for_meshes_from_outside() {
    let scene = parse(&text(", unused = \"drop\", weld = 1", "mass = { total = 1 }")).unwrap();
    assert_eq!(parse(&scene.to_toml()).unwrap(), scene);
    let plain = parse(&text(", unused = \"keep\", weld = 0", "mass = { total = 1 }")).unwrap();
    assert_eq!(plain, parse(&text("", "mass = { total = 1 }")).unwrap());
    assert_eq!(
        message(&SMALL.replace("spacing = 0.1", "spacing = 0.1, weld = 1e-6")),
        "scene.toml:6:47: body[0].mesh.weld: does not go with 'grid'"
    );
}

#[test]
fn sizes_and_densities_that_look_like_other_units_are_asked_about() {
    let asked = |mesh: &str, mass: &str| {
        let scene = SMALL.replace("spacing = 0.1 }", mesh).replace("particle = 0.01", mass);
        crate::build(&scene).unwrap_or_else(|error| panic!("{error}")).warnings
    };
    // A sheet of 2 by 1 times the spacing.
    assert!(asked("spacing = 447 }", "density = 999").is_empty());
    assert_eq!(
        asked("spacing = 448 }", "density = 1000"),
        [
            "body 'cloth': the box around it has a diagonal of 1002 m: is it meant to be so large? Lengths are metres: \
          transform.scale = 0.001 reads millimetres",
            "body 'cloth': its density is 1000 kg/m^2: is it meant to be so heavy? Densities are kilograms per square metre: \
          cloths have 0.05 to 1"
        ]
    );
    assert!(asked("spacing = 448 }\ntransform = { scale = 0.001 }", "total = 1000").is_empty());
}

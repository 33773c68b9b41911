//! Membranes and fabrics in scene files: three stiffnesses and a warp, presets, and what is refused.

use std::sync::Arc;

use nappe_scene::{Fabric, NoMeshes, Removal, Scene, SceneLimits, mesh::read_obj};
use nappe_sim::cloth::{ElementKind, Warp};

use crate::{Uploaded, message};

const MEMBRANE: &str = "version = 1\ndt = 0.01\n[[body]]\nname = \"b\"\nmesh = { grid = [4, 3], spacing = 0.1 }\n\
    mass = { density = 0.2 }\n[[body.law]]\nname = \"membrane\"\nstiffness = [600, 1000, 50]\ndamping = 2\nwarp = \"uv\"\n";

#[test]
fn a_membrane_has_its_stiffness_along_warp_and_weft_and_against_shear() {
    let scene = Scene::parse(MEMBRANE, "scene.toml").unwrap();
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap();
    let [list] = &built.setup.bodies[0].network.elements[..] else { panic!("one law") };
    assert_eq!((list.kind, list.corner_count()), (ElementKind::Membrane, 36));
    assert_eq!((list.law.stiffness, list.law.damping), (1000.0, 2.0));
    let threads = list.threads().unwrap();
    assert_eq!((threads.warp, threads.shares), (Warp::Uv, [0.6, 1.0, 0.05]));
    assert_eq!(Scene::parse(&scene.to_toml(), "again.toml").unwrap().bodies, scene.bodies);

    let along = MEMBRANE.replace("\"uv\"", "[1, 0, 0]");
    let scene = Scene::parse(&along, "scene.toml").unwrap();
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap();
    let threads = built.setup.bodies[0].network.elements[0].threads().unwrap();
    assert_eq!(threads.warp, Warp::Along([1.0, 0.0, 0.0]));
    assert_eq!(Scene::parse(&scene.to_toml(), "again.toml").unwrap().bodies, scene.bodies);
}

#[test]
fn what_is_no_membrane_is_refused_with_what_is_allowed() {
    let bends = "name = \"plate\"\nstiffness = 1e-5\ndamping = 2\nwarp = \"uv\"";
    let cases = [
        (
            MEMBRANE
                .replace("grid = [4, 3]", "chain = 4")
                .replace("mass = { density = 0.2 }", "mass = { total = 1 }"),
            "law[0].name: is membrane, which stretches triangles, and the mesh has none: a chain is stretched by \
             springs.stretch",
        ),
        (
            MEMBRANE.replace("[600, 1000, 50]", "[600, 1000]"),
            "law[0].stiffness: is an array of 2; allowed: a number or three numbers, each 0 to 1000000000000",
        ),
        (
            MEMBRANE.replace("[600, 1000, 50]", "600"),
            "law[0].stiffness: is one number, and membrane has three: along the warp, along the weft and against shear",
        ),
        (
            MEMBRANE.replace("warp = \"uv\"\n", ""),
            "law[0].name: is membrane, which needs a warp; allowed: warp = \"uv\", or a direction such as [1, 0, 0]",
        ),
        (MEMBRANE.replace("\"uv\"", "[0, 0, 0]"), "law[0].warp: is [0, 0, 0], which is no direction"),
        (
            MEMBRANE.replace("\"uv\"", "[0, 1, 0.1]"),
            "law[0].warp: gives no warp: it is within 30 degrees of the normal of the triangle of points 0, 1 and 4, and of \
             those of all triangles that it hangs together with",
        ),
        (
            MEMBRANE.replace(
                "name = \"membrane\"\nstiffness = [600, 1000, 50]\ndamping = 2\nwarp = \"uv\"",
                bends,
            ),
            "law[0].warp: does not go with plate, which has no threads",
        ),
        (
            MEMBRANE.replace("\"membrane\"", "\"quadratic_bending\"").replace("warp = \"uv\"\n", ""),
            "law[0].stiffness: is three numbers, and quadratic_bending has one stiffness",
        ),
    ];
    for (text, told) in cases {
        let error = message(&text);
        assert!(error.ends_with(told), "{error}");
    }
    assert!(message(&MEMBRANE.replace("\"uv\"", "\"uw\"")).contains("law[0].warp: is 'uw'; "));
}

#[test]
fn a_warp_by_texture_coordinates_needs_them_in_every_triangle() {
    let text = MEMBRANE.replace("grid = [4, 3], spacing = 0.1", "upload = \"m\"");
    let refused = |obj: &str| {
        let mesh = read_obj(obj, "mesh.obj").unwrap_or_else(|error| panic!("{error}")).mesh;
        let scene = Scene::parse(&text, "scene.toml").unwrap();
        scene
            .build(&Uploaded(Arc::new(mesh)), &SceneLimits::default())
            .expect_err("it is refused")
            .to_string()
    };
    let points = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
    let told =
        "law[0].warp: is uv, and the mesh has no texture coordinates; allowed: a direction such as [1, 0, 0]";
    let error = refused(&format!("{points}f 1 2 3\nf 1 3 4\n"));
    assert!(error.ends_with(told), "{error}");

    let flat = "vt 0 0\nvt 1 0\nvt 1 1\nvt 2 2\nf 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    let told = "law[0].warp: is uv, and the triangle of points 0, 2 and 3 has no area in texture coordinates; allowed: a \
                direction such as [1, 0, 0]";
    let error = refused(&format!("{points}{flat}"));
    assert!(error.ends_with(told), "{error}");
}

const SILK: &str = "version = 1\ndt = 0.01\n[[body]]\nname = \"b\"\nmesh = { grid = [5, 4], spacing = 0.01 }\n\
    material = { preset = \"silk\", bending = 3e-6 }\n";

#[test]
fn a_fabric_is_its_mass_a_membrane_and_a_plate() {
    for Fabric { name, density, stretch, shear, bending, .. } in Fabric::ALL {
        let text = SILK.replace("\"silk\", bending = 3e-6", &format!("\"{name}\""));
        let built =
            Scene::parse(&text, "scene.toml").unwrap().build(&NoMeshes, &SceneLimits::default()).unwrap();
        let network = &built.setup.bodies[0].network;
        let mass: f64 = network.masses.iter().sum();
        assert!((mass / (density * 0.04 * 0.03) - 1.0).abs() < 1e-12, "{name}: {mass} kg");
        let [membrane, plate] = &network.elements[..] else { panic!("{name}: two laws") };
        let threads = membrane.threads().unwrap();
        let found = threads.shares.map(|share| share * membrane.law.stiffness);
        for (found, expected) in found.into_iter().zip([stretch[0], stretch[1], shear]) {
            assert!((found / expected - 1.0).abs() < 1e-12, "{name}: {found} N/m");
        }
        assert_eq!((threads.warp, plate.kind, plate.law.stiffness), (Warp::Uv, ElementKind::Plate, bending));
        assert!(network.springs.is_empty() && built.warnings.is_empty(), "{name}: {:?}", built.warnings);
    }
}

#[test]
fn what_differs_from_a_fabric_is_said_and_its_damping_is_a_term() {
    let scene = Scene::parse(SILK, "scene.toml").unwrap();
    assert_eq!(Scene::parse(&scene.to_toml(), "again.toml").unwrap().bodies, scene.bodies);
    let bending = |scene: &Scene| {
        let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap();
        let law = built.setup.bodies[0].network.elements[1].law;
        (law.stiffness, law.damping)
    };
    assert_eq!(bending(&scene), (3e-6, 0.01 * 3e-6));
    let names: Vec<String> = scene.terms().into_iter().map(|term| term.name).collect();
    assert_eq!(names, ["damping of material of b"]);
    assert_eq!(bending(&scene.without(&[Removal::FabricDamping(0)])), (3e-6, 0.0));
}

#[test]
fn a_fabric_says_all_that_it_says_alone() {
    let cases = [
        (SILK.replace("material", "mass = { total = 1 }\nmaterial"), "mass"),
        (SILK.replace("material", "springs = { stretch = { stiffness = 1 } }\nmaterial"), "springs"),
        (SILK.replace("material", "law = [{ name = \"plate\", stiffness = 1 }]\nmaterial"), "law"),
    ];
    for (text, key) in cases {
        let told = format!("body[0].{key}: does not go with material, which says it by the name of a fabric");
        let error = message(&text);
        assert!(error.ends_with(&told), "{error}");
    }
    let chain = message(&SILK.replace("grid = [5, 4]", "chain = 4"));
    assert!(chain.contains("body[0].material: is a fabric, which is made of triangles"), "{chain}");
    let unknown = message(&SILK.replace("\"silk\"", "\"denin\""));
    assert!(unknown.contains("material.preset: is 'denin'; ") && unknown.contains("denim"), "{unknown}");

    let text = SILK.replace("grid = [5, 4], spacing = 0.01", "upload = \"m\"");
    let mesh = read_obj("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 1 2 3\nf 1 3 4\n", "mesh.obj").unwrap().mesh;
    let meshes = Uploaded(Arc::new(mesh));
    let build =
        |text: &str| Scene::parse(text, "scene.toml").unwrap().build(&meshes, &SceneLimits::default());
    let error = build(&text).expect_err("it is refused").to_string();
    let told = "body[0].material: needs a warp, for the mesh has no texture coordinates; allowed: warp = [1, 0, 0], or another \
                direction";
    assert!(error.ends_with(told), "{error}");
    let along = build(&text.replace("bending", "warp = [1, 0, 0], bending")).unwrap();
    assert_eq!(along.setup.bodies[0].network.elements.len(), 2);
}

#[test]
fn a_point_without_a_mass_is_told_with_what_a_fabric_allows() {
    let text = SILK
        .replace("grid = [5, 4], spacing = 0.01", "upload = \"m\"")
        .replace("bending", "warp = [1, 0, 0], bending");
    let square = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 2 0 0\n";
    let cases = [
        (
            "f 1 2 3\nf 1 3 4\n",
            "no triangle names it; allowed here: unused = \"drop\" in its mesh, which leaves such points out",
        ),
        (
            "f 1 2 3\nf 1 3 4\nf 1 2 5\n",
            "its triangles have no area; allowed here: a mesh whose points are all corners of triangles with an area",
        ),
    ];
    for (faces, told) in cases {
        let mesh =
            read_obj(&format!("{square}{faces}"), "mesh.obj").unwrap_or_else(|error| panic!("{error}")).mesh;
        let scene = Scene::parse(&text, "scene.toml").unwrap();
        let error = scene
            .build(&Uploaded(Arc::new(mesh)), &SceneLimits::default())
            .expect_err("it is refused")
            .to_string();
        assert!(
            error.ends_with(&format!("body[0].material: gives particle 4 the mass 0: {told}")),
            "{error}"
        );
    }
}

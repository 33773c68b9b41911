//! Thickness of bodies and `[contact]`, as scenes write them, and what of them is refused.

use std::sync::Arc;

use nappe_scene::{Built, MeshSource, NoMeshes, Scene, SceneError, SceneErrors, SceneLimits};
use nappe_sim::{
    cloth::{SurfaceCheck, SurfaceSettings},
    math::Precision,
    mesh::TriangleMesh,
    world::Simulation,
};

const SHEET: &str = "version = 1\ndt = 0.01\nROOT\n[[body]]\nname = \"sheet\"\nmesh = { grid = [3, 3], spacing = 0.1 }\n\
    mass = { particle = 0.01 }\nBODY\n";

fn text(root: &str, body: &str) -> String {
    SHEET.replace("ROOT", root).replace("BODY", body)
}

fn build(text: &str) -> Result<Built, SceneErrors> {
    Scene::parse(text, "scene.toml")?.build(&NoMeshes, &SceneLimits::default())
}

/// Why no simulation can be made of a scene that can be built.
fn refused(built: &Built) -> String {
    match Simulation::new(&built.setup, Precision::F64) {
        Ok(_) => panic!("it is refused"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn a_thickness_and_how_surfaces_meet_are_read_with_their_defaults() {
    let plain = Scene::parse(&text("", ""), "scene.toml").expect("a scene");
    let default = SurfaceSettings { friction: 0.3, recovery: 0.1, surface: SurfaceCheck::Off };
    assert_eq!((plain.bodies[0].thickness, plain.contact), (0.0, None));
    let setup = plain.build(&NoMeshes, &SceneLimits::default()).expect("it can be built").setup;
    assert_eq!(setup.bodies[0].settings.contact, default);
    assert!(!plain.to_toml().contains("contact") && !plain.to_toml().contains("thickness"));

    let root = "contact = { surface = \"count\" }";
    let scene = Scene::parse(&text(root, "thickness = 0.002"), "scene.toml").expect("a scene");
    let counted = SurfaceSettings { surface: SurfaceCheck::Count, ..default };
    assert_eq!(scene.contact, Some(counted));
    let again = Scene::parse(&scene.to_toml(), "again.toml").expect("a scene");
    assert_eq!((again.contact, again.bodies), (scene.contact, scene.bodies.clone()));
    let setup = scene.build(&NoMeshes, &SceneLimits::default()).expect("it can be built").setup;
    assert_eq!((setup.bodies[0].network.thickness, setup.bodies[0].settings.contact), (0.002, counted));

    let value = ("contact.friction".to_owned(), "0.7".to_owned());
    let edited = scene.with_values(&[value]).expect("the scene has that key");
    assert_eq!(edited.contact, Some(SurfaceSettings { friction: 0.7, ..counted }));
}

#[test]
fn what_cannot_be_kept_apart_is_refused_with_its_key() {
    for (root, body, told) in [
        ("", "thickness = -1", "body[0].thickness: is -1"),
        (
            "",
            "thickness = 0.06",
            "body[0].thickness: is 0.06 m, above half of the shortest edge, which is 0.1 m long",
        ),
        (
            "",
            "thickness = 0.01\nintegrator = \"bdf2\"",
            "body[0].thickness: is 0.01 m, and the integrator is bdf2: surfaces are kept apart by implicit_euler alone",
        ),
        (
            "",
            "thickness = 0.01\nminimizer = \"newton\"",
            "body[0].thickness: is 0.01 m, and the minimizer is newton: surfaces are kept apart by one_step alone",
        ),
        ("", "thickness = 0.01\nunchecked = true", "body[0].thickness: is 0.01 m, and steps are unchecked"),
        (
            "",
            "thickness = 0.01\nsolver = { operator = \"assembled\" }",
            "body[0].thickness: is 0.01 m, and the operator is assembled",
        ),
        (
            "",
            "thickness = 0.01\nsolver = { preconditioner = \"patches\" }",
            "body[0].thickness: is 0.01 m, and the preconditioner is patches",
        ),
        ("contact = { friction = -0.1 }", "", "contact.friction: is -0.1"),
        ("contact = { surface = \"never\" }", "", "contact.surface"),
        ("contact = { thickness = 0.1 }", "", "contact.thickness"),
    ] {
        let error = build(&text(root, body)).expect_err("refused").first().to_string();
        assert!(error.contains(told), "{error}, not {told}");
    }
    let chain = text("", "thickness = 0.01").replace("grid = [3, 3]", "chain = 3");
    let error = build(&chain).expect_err("no surface").first().to_string();
    assert!(error.contains("body[0].thickness: is 0.01 m, and there are no triangles"), "{error}");
}

#[test]
fn snow_has_no_thickness() {
    let snow = "version = 1\ndt = 0.01\n[snow]\ncell = 0.1\n[[snow.object]]\nname = \"ball\"\nthickness = 0.01\n\
        sphere = { center = [0, 1, 0], radius = 0.2 }\n";
    let error = build(snow).expect_err("an unknown key").first().to_string();
    assert!(error.contains("snow.object[0].thickness"), "{error}");
}

#[test]
fn bodies_with_a_thickness_must_be_stepped_alike_and_ranks_do_not_step_them() {
    let one = text("", "thickness = 0.01");
    let (_, body) = one.split_once("[[body]]").expect("a body");
    let both = |keys: &str| {
        let above = body.replace("\"sheet\"", "\"other\"");
        let text = format!("{one}[[body]]{above}transform = {{ translate = [0.01, 0.1, 0.02] }}\n{keys}\n");
        build(&text).expect("it can be built")
    };
    Simulation::new(&both("").setup, Precision::F64).expect("bodies with a thickness meet each other");
    for (keys, what, values) in [
        ("drag = 0.5", "drag", ["is 0.5 N s/m", "is 0 N s/m"]),
        ("air = {}", "air", ["is 1.2 kg/m³ with", "is none"]),
        ("tolerance = 0.25", "tolerance", ["is 0.25 m", "is none"]),
        ("block_size = 64", "block_size", ["64", "256"]),
        ("substeps = 2", "time step", ["is 0.005 s", "of what is certified"]),
        ("solver = { max_iterations = 77 }", "solver", ["77", "200"]),
    ] {
        let error = refused(&both(keys));
        let told = ["'other'", "'sheet'", what, values[0], values[1]];
        assert!(told.iter().all(|word| error.contains(word)), "{error}, not {told:?}");
        assert!(!error.contains(['{', '(']) || what == "air", "{error}");
    }

    let built = build(&one).expect("it can be built");
    let error =
        built.setup.check_for_ranks().expect_err("ranks do not see each other's surfaces").to_string();
    assert!(error.contains("'sheet'") && error.contains("thickness"), "{error}");
}

#[test]
fn a_thin_margin_and_a_friction_of_nothing_are_told() {
    let warned = |root: &str, body: &str, margin: &str| {
        let ball = format!(
            "[[collider]]\nname = \"ball\"\nsphere = {{ center = [0, -2, 0], radius = 1 }}\nmargin = {margin}\n"
        );
        build(&(text(root, body) + &ball)).expect("it can be built").warnings.join("; ")
    };
    let thin = warned("", "thickness = 0.01", "0.004");
    assert!(thin.contains("body 'sheet'") && thin.contains("collider 'ball' is 0.004 m"), "{thin}");
    assert!(!warned("", "thickness = 0.01", "0.005").contains("margin"));
    assert!(!warned("", "", "0").contains("margin"));
    assert!(warned("contact = { friction = 0.5 }", "", "0").contains("contact.friction has no effect"));
    assert!(!warned("contact = { friction = 0.5 }", "thickness = 0.01", "0.1").contains("no effect"));
}

#[test]
fn triangles_that_are_kept_apart_count_in_the_size_of_a_scene() {
    let apart = |root: &str, body: &str| {
        let scene = Scene::parse(&text(root, body), "scene.toml").expect("a scene");
        scene.size(&NoMeshes).triangles_apart
    };
    assert_eq!(apart("", ""), 0);
    assert_eq!(apart("", "thickness = 0.01"), 8);
    assert_eq!(apart("contact = { surface = \"count\" }", ""), 8);
}

#[test]
fn bodies_that_are_stepped_together_may_have_a_coarse_space_where_each_is_small() {
    let stiff = "springs = { stretch = { stiffness = 1e9 } }";
    let blocks = |body: &str| {
        let one = text("", &format!("{stiff}\n{body}"));
        let (_, body) = one.split_once("[[body]]").expect("a body");
        let second = body.replace("\"sheet\"", "\"other\"");
        let scene = Scene::parse(&format!("{one}[[body]]{second}"), "scene.toml").expect("a scene");
        scene.size(&NoMeshes).coarse_blocks
    };
    assert_eq!((blocks(""), blocks("thickness = 0.01")), (0, 2));
}

/// One mesh under every id.
struct One(Arc<TriangleMesh>);

impl MeshSource for One {
    fn upload(&self, _: &str) -> Option<Arc<TriangleMesh>> {
        Some(Arc::clone(&self.0))
    }

    fn file(&self, _: &str) -> Result<TriangleMesh, SceneError> {
        Ok((*self.0).clone())
    }
}

#[test]
fn a_surface_that_crosses_itself_at_the_start_is_refused_with_the_first_pair() {
    // The edge from 3 to 4 goes through the first triangle, and that from 1 to 2 through the second one.
    let points = vec![
        [0.0, 0.0, 0.0],
        [1.0, 0.0, 0.0],
        [0.0, 1.0, 0.0],
        [0.2, 0.25, -0.5],
        [0.2, 0.25, 0.5],
        [5.0, 5.1, 0.1],
    ];
    let mesh = TriangleMesh { points, triangles: vec![[0, 1, 2], [3, 4, 5]], ..TriangleMesh::default() };
    let meshes = One(Arc::new(mesh));
    let built = |body: &str| {
        let text = text("", body).replace("grid = [3, 3], spacing = 0.1", "upload = \"m\"");
        let scene = Scene::parse(&text, "scene.toml").expect("a scene");
        scene.build(&meshes, &SceneLimits::default()).expect("it can be built")
    };
    let error = refused(&built("thickness = 0.001"));
    let pairs = [
        "particles 3 and 4 crosses the triangle of 0, 1 and 2",
        "particles 1 and 2 crosses the triangle of 3, 4 and 5",
    ];
    assert!(error.contains("at least 1") && pairs.iter().any(|pair| error.contains(pair)), "{error}");

    let without = built("");
    assert_eq!(without.setup.bodies[0].network.crossed().map(|crossed| crossed.count), Some(2));
    Simulation::new(&without.setup, Precision::F64).expect("it may cross itself");
}

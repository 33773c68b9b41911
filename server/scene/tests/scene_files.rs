//! Scenes from text: every shipped one builds, every message says what, where and what is allowed.

use std::sync::Arc;

use nappe_scene::{
    ErrorKind, Mesh, MeshSource, NoMeshes, Scene, SceneError, SceneErrors, SceneLimits, shipped_scenes,
};
use nappe_sim::mesh::TriangleMesh;

const SMALL: &str = r#"version = 1
dt = 0.01

[[body]]
name = "cloth"
mesh = { grid = [3, 2], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 10 } }
"#;

fn parse(text: &str) -> Result<Scene, SceneErrors> {
    Scene::parse(text, "scene.toml")
}

fn build(text: &str) -> Result<nappe_scene::Built, SceneErrors> {
    parse(text)?.build(&NoMeshes, &SceneLimits::default())
}

fn message(text: &str) -> String {
    build(text).expect_err("the scene has an error").to_string()
}

#[test]
fn every_shipped_scene_parses_builds_and_survives_a_round_trip() {
    for (name, text) in shipped_scenes() {
        let scene = Scene::parse(text, name).unwrap_or_else(|e| panic!("{e}"));
        let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|e| panic!("{e}"));
        assert!(!built.setup.bodies.is_empty() || built.setup.snow.is_some(), "{name}");
        assert!(built.setup.bodies.iter().all(|body| !body.network.springs.is_empty()), "{name}");
        assert!(scene.steps > 0, "{name} ends by itself");
        let again =
            Scene::parse(&scene.to_toml(), name).unwrap_or_else(|e| panic!("{e}\n{}", scene.to_toml()));
        assert_eq!(again, scene, "{name}");
    }
}

#[test]
fn every_file_in_the_scenes_folder_is_shipped() {
    let folder = concat!(env!("CARGO_MANIFEST_DIR"), "/../scenes");
    let mut files: Vec<String> = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path().file_stem().unwrap().to_string_lossy().into_owned())
        .collect();
    let mut shipped: Vec<&str> = shipped_scenes().iter().map(|(name, _)| *name).collect();
    files.sort_unstable();
    shipped.sort_unstable();
    assert_eq!(files, shipped);
}

/// What is replaced in the small scene, by what, and how the message then begins.
const ERRORS: &[(&str, &str, &str)] = &[
    ("dt = 0.01", "dt = 2", "scene.toml:2:6: dt: is 2; allowed: a number, 1e-9 to 1"),
    ("dt = 0.01", "dt = nan", "scene.toml:2:6: dt: is nan; allowed: a number, 1e-9 to 1"),
    ("dt = 0.01", "dt = \"x\"", "scene.toml:2:6: dt: is 'x'; allowed: a number, 1e-9 to 1"),
    ("dt = 0.01", "", "scene.toml:1:1: dt: is missing: time step of the scene's clock (a number, 1e-9 to 1)"),
    ("version = 1", "version = 2", "scene.toml:1:11: version: is 2; allowed: 1"),
    (
        "dt = 0.01",
        "dt = 0.01\ngravty = [0, 0, 0]",
        "scene.toml:3:1: gravty: scene has no key 'gravty'; did you mean 'gravity'?",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\ngravity = [0, 0]",
        "scene.toml:3:11: gravity: is an array of 2; allowed: three numbers, each at most 10000 in size",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\ngravity = [0, true, 0]",
        "scene.toml:3:15: gravity[1]: is true; allowed: a number, -10000 to 10000",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\nprecision = \"f16\"",
        "scene.toml:3:13: precision: is 'f16'; allowed: f32, f64",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nintegrator = \"implicit_eular\"",
        "scene.toml:8:14: body[0].integrator: is 'implicit_eular'; did you mean 'implicit_euler'?",
    ),
    (
        "dt = 0.01",
        "dt = 0.01\nsteps = -1",
        "scene.toml:3:9: steps: is -1; allowed: a whole number, 0 to 1000000000000",
    ),
    ("dt = 0.01", "dt = = 1", "scene.toml:2:6: is not TOML: "),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { grid = [3, 2] }",
        "scene.toml:6:8: body[0].mesh.spacing: is missing: it is needed with 'grid'",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { grid = [3, 2], chain = 4, spacing = 0.1 }",
        "scene.toml:6:8: body[0].mesh: has grid and chain of grid, chain, course_grid, upload, file: exactly one is needed",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { spacing = 0.1 }",
        "scene.toml:6:8: body[0].mesh: has none of grid, chain, course_grid, upload, file: exactly one is needed",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { course_grid = 4, spacing = 0.1 }",
        "scene.toml:6:37: body[0].mesh.spacing: does not go with 'course_grid'",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { upload = \"m1\" }",
        "scene.toml:6:19: body[0].mesh.upload: no mesh with the id 'm1' was uploaded, or it is no longer kept",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { file = \"a.obj\" }",
        "a.obj: scenes may not name files here: upload the mesh",
    ),
    (
        "mesh = { grid = [3, 2], spacing = 0.1 }",
        "mesh = { grid = [100000, 100000], spacing = 0.1 }",
        "scene.toml:6:8: body[0].mesh: this body has 10000000000 particles; allowed: at most 4000000",
    ),
    (
        "stiffness = 10",
        "stifness = 10",
        "scene.toml:8:25: body[0].springs.stretch.stifness: body.springs.stretch, .shear, .bend has no key 'stifness'; did you mean 'stiffness'?",
    ),
    (
        "mass = { particle = 0.01 }",
        "",
        "scene.toml:4:1: body[0].mass: is missing: this mesh carries no masses; allowed: { particle = kg }, { total = kg } or { density = kg/m^2 }",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\npins = [6]",
        "scene.toml:8:9: body[0].pins[0]: is 6; allowed: 0 to 5, the particles of this body",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\npins = [\"top_leftt\"]",
        "scene.toml:8:9: body[0].pins[0]: is 'top_leftt'; did you mean 'top_left'?",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\npins = [\"middle of nowhere\"]",
        "scene.toml:8:9: body[0].pins[0]: is 'middle of nowhere'; allowed: top_left, top_right, bottom_left, bottom_right, top, bottom, left, right",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\ngrain = 100",
        "scene.toml:8:9: body[0].grain: is 100; allowed: a power of two, 32 to 4096",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nsolver = { fixed_iterations = 3, tolerance = 0.1 }",
        "scene.toml:8:46: body[0].solver.tolerance: does not go with fixed_iterations",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\nsolver = { fixed_iterations = 3, max_iterations = 1 }",
        "scene.toml:8:51: body[0].solver.max_iterations: does not go with fixed_iterations",
    ),
    (
        "mass = { particle = 0.01 }",
        "mass = { particle = 0.01 }\ntransform = { rotate = { axis = [0, 0, 0], degrees = 1 } }",
        "scene.toml:8:33: body[0].transform.rotate.axis: is zero: an axis needs a direction",
    ),
    ("name = \"cloth\"", "name = \" \"", "scene.toml:5:8: body[0].name: is empty: a name is needed"),
    ("[[body]]", "body = 1", "scene.toml:4:8: body: is 1; allowed: an array of tables, at most 1000"),
];

#[test]
fn a_message_names_file_line_column_field_finding_and_range() {
    for (old, new, wanted) in ERRORS {
        let text = SMALL.replace(old, new);
        assert_ne!(&text, SMALL, "the case changes the scene: {old}");
        let found = message(&text);
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn every_error_of_a_scene_is_named_in_the_order_of_the_text() {
    let text = SMALL
        .replace("dt = 0.01", "dt = 2\ngravty = [0, 0, 0]")
        .replace("particle = 0.01", "particle = true")
        .replace("stiffness = 10", "stiffness = -1, dampng = 1");
    let errors = parse(&text).expect_err("the scene has five errors");
    let found: Vec<_> = errors.iter().map(|error| (error.line, error.key.as_str(), error.kind)).collect();
    assert_eq!(
        found,
        [
            (2, "dt", ErrorKind::OutOfRange),
            (3, "gravty", ErrorKind::UnknownField),
            (8, "body[0].mass.particle", ErrorKind::WrongType),
            (9, "body[0].springs.stretch.stiffness", ErrorKind::OutOfRange),
            (9, "body[0].springs.stretch.dampng", ErrorKind::UnknownField),
        ]
    );
    let message = errors.to_string();
    assert_eq!(message.lines().count(), 5, "one line per error:\n{message}");
    assert!(message.starts_with("scene.toml:2:6: dt: is 2; allowed: a number, 1e-9 to 1\n"), "{message}");
    assert!(message.ends_with("has no key 'dampng'; did you mean 'damping'?"), "{message}");
}

#[test]
fn errors_of_several_bodies_and_colliders_are_named_together() {
    let second = SMALL[SMALL.find("[[body]]").unwrap()..].replace("\"cloth\"", "\"other\"");
    let text = format!(
        "{SMALL}pins = [6]\n{second}transform = {{ rotate = {{ axis = [0, 0, 0], degrees = 1 }} }}\n[[collider]]\nname = \"\"\nplane = {{ point = [0, 0, 0], normal = [0, 0, 0] }}\n"
    );
    let keys: Vec<_> = build(&text).expect_err("four errors").iter().map(|e| e.key.clone()).collect();
    assert_eq!(
        keys,
        ["body[0].pins[0]", "body[1].transform.rotate.axis", "collider[0].name", "collider[0].plane.normal"]
    );
}

#[test]
fn a_misspelt_key_is_not_also_missing() {
    let errors = parse(&SMALL.replace("stretch =", "strech =")).expect_err("one error");
    assert_eq!(errors.iter().count(), 1, "{errors}");
    let errors = parse(&SMALL.replace("grid =", "gird =")).expect_err("one error");
    assert_eq!(errors.iter().count(), 1, "{errors}");
}

#[test]
fn of_many_errors_the_first_are_named_and_the_others_counted() {
    let many = (0..50).map(|i| format!("unknown_{i:02} = 1\n")).collect::<Vec<_>>().concat();
    let errors = parse(&SMALL.replace("dt = 0.01\n", &format!("dt = 0.01\n{many}"))).expect_err("50 errors");
    assert_eq!((errors.iter().count(), errors.omitted()), (SceneErrors::LIMIT, 50 - SceneErrors::LIMIT));
    assert!(errors.iter().zip(3..).all(|(error, line)| error.line == line), "{errors}");
    assert!(errors.to_string().ends_with("\n30 more"), "{errors}");
}

#[test]
fn errors_between_bodies_and_colliders_are_named() {
    let other = &SMALL[SMALL.find("[[body]]").unwrap()..];
    let twice = format!("{SMALL}\n{other}");
    assert_eq!(
        message(&twice),
        "scene.toml:11:8: body[1].name: 'cloth' is the name of another body: names are unique"
    );
    let flat =
        format!("{SMALL}\n[[collider]]\nname = \"f\"\nplane = {{ point = [0, 0, 0], normal = [0, 0, 0] }}");
    assert_eq!(
        message(&flat),
        "scene.toml:12:39: collider[0].plane.normal: is zero: a normal needs a direction"
    );
    let both = format!(
        "{SMALL}\n[[collider]]\nname = \"f\"\nplane = {{ point = [0, 0, 0], normal = [0, 1, 0] }}\nsphere = {{ center = [0, 0, 0], radius = 1 }}"
    );
    assert_eq!(
        message(&both),
        "scene.toml:10:1: collider[0]: has plane and sphere of plane, sphere, capsule, box, cylinder, half_pipe: exactly one is needed"
    );
}

#[test]
fn chains_lattices_and_moving_pins_are_checked_against_each_other() {
    let chain = SMALL.replace("grid = [3, 2]", "chain = 5");
    let shear = chain.replace("springs = { ", "springs = { shear = { stiffness = 1 }, ");
    assert_eq!(
        message(&shear),
        "scene.toml:8:21: body[0].springs.shear: does not go with a chain: it has no cells; allowed: stretch and bend"
    );
    let lattice = chain.replace("springs = { ", "springs = { pattern = \"lattice\", ");
    assert_eq!(
        message(&lattice),
        "scene.toml:8:23: body[0].springs.pattern: is 'lattice': only grids have rows and columns; allowed here: edges"
    );
    let loose = format!("{SMALL}\n[[body.moving_pin]]\npin = 0\ntarget = [0, 0, 0]\nduration = 1\n");
    assert_eq!(
        message(&loose),
        "scene.toml:11:7: body[0].moving_pin[0].pin: particle 0 is not pinned: list it in pins"
    );
    let row = loose.replace("pin = 0", "pin = \"top\"");
    assert_eq!(
        message(&row),
        "scene.toml:12:10: body[0].moving_pin[0].target: sends 3 particles to one point; allowed for several: offset"
    );
    let no_area = chain.replace("particle = 0.01", "density = 0.01");
    assert_eq!(
        message(&no_area),
        "scene.toml:7:8: body[0].mass: gives particle 0 the mass 0: its triangles have no area; allowed here: { particle = kg } or { total = kg }"
    );
}

#[test]
fn limits_hold_over_all_bodies_before_memory_is_taken() {
    let scene = parse(SMALL).unwrap();
    let limits = SceneLimits { max_particles: 5, max_springs: 100 };
    let error = scene.build(&NoMeshes, &limits).unwrap_err();
    assert_eq!(error.first().kind, ErrorKind::TooLarge);
    assert_eq!(error.first().line, 6);
    let limits = SceneLimits { max_particles: 6, max_springs: 6 };
    let error = scene.build(&NoMeshes, &limits).unwrap_err();
    assert_eq!(
        error.to_string(),
        "scene.toml:8:11: body[0].springs: this body has 7 springs; allowed: at most 6"
    );
    assert!(scene.build(&NoMeshes, &SceneLimits { max_particles: 6, max_springs: 7 }).is_ok());
    let mut two = scene.clone();
    two.bodies.push(nappe_scene::Body { name: "second".to_owned(), ..scene.bodies[0].clone() });
    let error = two.build(&NoMeshes, &SceneLimits { max_particles: 11, max_springs: 100 }).unwrap_err();
    assert!(error.first().message.contains("6 particles, 12 with the bodies before it"), "{error}");
}

#[test]
fn a_scene_changed_by_a_program_is_checked_like_a_text() {
    let mut scene = parse(SMALL).unwrap();
    scene.dt = f64::NAN;
    let error = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_err();
    assert_eq!(error.to_string(), "scene.toml: dt: is nan; allowed: a number, 1e-9 to 1");
    scene.dt = 0.01;
    scene.steps = u64::MAX;
    let error = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_err();
    assert_eq!(
        error.to_string(),
        "scene.toml: steps: is 9223372036854775807; allowed: a whole number, 0 to 1000000000000"
    );
    scene.steps = 0;
    scene.bodies[0].mesh = Mesh::Chain { chain: 0, spacing: 0.1 };
    let error = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_err();
    assert_eq!(error.first().key, "body[0].mesh.chain");
}

#[test]
fn pins_moves_masses_and_transforms_come_out_as_written() {
    let text = r#"
version = 1
dt = 0.01
[[body]]
name = "a"
mesh = { chain = 3, spacing = 0.5 }
mass = { total = 3 }
springs = { stretch = { stiffness = 10 }, bend = { stiffness = 2, damping = 1 } }
pins = ["first"]
[[body]]
name = "b"
mesh = { grid = [3, 3], spacing = 0.5 }
mass = { density = 2 }
springs = { stretch = { stiffness = 10 }, shear = { stiffness = 5 }, bend = { stiffness = 2 } }
pins = ["top", 8]
velocity = [0, 1, 0]
transform = { scale = 2, rotate = { axis = [5, 0, 0], degrees = 90 }, translate = [0, 1, 0] }
[[body.moving_pin]]
pin = "top_right"
offset = [0, 0, 1]
duration = 2
"#;
    let scene = parse(text).unwrap();
    assert_eq!(parse(&scene.to_toml()).unwrap(), scene);
    let built = build(text).unwrap();
    let [a, b] = &built.setup.bodies[..] else { panic!("two bodies") };
    assert_eq!(a.network.masses, [1.0; 3]);
    assert_eq!(a.network.springs.len(), 3);
    assert_eq!(a.network.pins, [0]);
    // Upright by an exact quarter turn: (x, y, z) -> (x, -z, y), scaled by 2, up by 1.
    assert_eq!(b.network.x[0], [0.0, 1.0, 0.0]);
    assert_eq!(b.network.x[8], [2.0, -1.0, 0.0]);
    assert_eq!(b.network.pins, [0, 1, 2, 8]);
    assert_eq!((b.network.v[0], b.network.v[4]), ([0.0; 3], [0.0, 1.0, 0.0]));
    let mass: f64 = b.network.masses.iter().sum();
    assert!((mass - 2.0 * 4.0).abs() < 1e-12, "density times the transformed area: {mass}");
    // 12 stretch, 8 shear, 6 bend.
    assert_eq!(b.network.springs.len(), 26);
    let wanted = nappe_sim::world::Change::Pin { particle: 3 + 2, target: [2.0, 1.0, 1.0], duration: 2.0 };
    assert_eq!(built.initial_changes, [wanted]);
    assert!(built.warnings.is_empty(), "{:?}", built.warnings);
}

/// One uploaded mesh, `m`.
struct Uploaded(Arc<TriangleMesh>);

impl MeshSource for Uploaded {
    fn upload(&self, id: &str) -> Option<Arc<TriangleMesh>> {
        (id == "m").then(|| Arc::clone(&self.0))
    }
    fn file(&self, path: &str) -> Result<TriangleMesh, SceneError> {
        NoMeshes.file(path)
    }
}

#[test]
fn an_uploaded_mesh_keeps_its_pins_and_its_errors_are_named() {
    let text = SMALL.replace("grid = [3, 2], spacing = 0.1", "upload = \"m\"");
    let mut mesh = TriangleMesh::grid(3, 2, 0.1);
    mesh.masses = vec![0.0, 1.0, 2.0, 1.0, 1.0, 1.0];
    mesh.points.push([5.0; 3]);
    mesh.masses.push(1.0);
    mesh.uv.clear();
    let build = |mesh: &TriangleMesh, text: &str| {
        parse(text)?.build(&Uploaded(Arc::new(mesh.clone())), &SceneLimits::default())
    };
    let built = build(&mesh, &text).unwrap();
    let network = &built.setup.bodies[0].network;
    assert_eq!((&network.pins[..], &network.masses[..]), (&[0u32][..], &[0.01; 7][..]));
    // Without a lattice, the springs are the edges of the triangles: 2 rows, 3 columns, 2 diagonals.
    assert_eq!(network.springs.len(), 4 + 3 + 2);
    assert!(
        built.warnings[0].starts_with("body 'cloth': 1 isolated points, the first is 6"),
        "{:?}",
        built.warnings
    );
    let own = text.replace("mass = { particle = 0.01 }\n", "");
    assert_eq!(build(&mesh, &own).unwrap().setup.bodies[0].network.masses, mesh.masses);
    let named = text.replace("mass =", "pins = [\"top\"]\nmass =");
    let error = build(&mesh, &named).unwrap_err().to_string();
    assert_eq!(
        error,
        "scene.toml:7:9: body[0].pins[0]: is 'top': names are for grids and chains; allowed here: an index"
    );
    mesh.triangles[0][1] = 7;
    let error = build(&mesh, &text).unwrap_err();
    assert_eq!(error.first().kind, ErrorKind::BadMesh);
    assert!(
        error.to_string().starts_with("scene.toml:6:8: body[0].mesh: triangle 0 names point 7"),
        "{error}"
    );
}

#[test]
fn what_is_odd_gives_a_warning() {
    let text = r#"
version = 1
dt = 0.01
[[body]]
name = "dust"
mesh = { course_grid = 2 }
"#;
    let built = build(text).unwrap();
    assert_eq!(built.warnings, ["body 'dust': there are no springs: the particles are free of each other"]);
    let pinned = text.replace("mesh = { course_grid = 2 }", "mesh = { course_grid = 2 }\npins = [2, 3]");
    assert!(
        build(&pinned).unwrap().warnings[1].ends_with("every particle is pinned: nothing moves by itself")
    );
}

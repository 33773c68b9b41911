//! Scenes from text: every shipped one builds, every message says what, where and what is allowed.

mod messages;
mod starts;
mod ways;
mod acting;
mod outside;
mod membranes;
mod overlap;
mod surfaces;
mod rest;
mod figures;

use std::sync::Arc;

use nappe_scene::{
    ErrorKind, Mesh, MeshSource, NoMeshes, Scene, SceneError, SceneErrors, SceneLimits, shipped_scenes,
};
use nappe_sim::{
    cloth::{Minimizer, NewtonSettings},
    mesh::TriangleMesh,
    time_step::TimeStep,
    world::BodySetup,
};

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
        let has_springs = |body: &BodySetup| body.network.is_figure() || !body.network.springs.is_empty();
        assert!(built.setup.bodies.iter().all(has_springs), "{name}");
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

#[test]
fn errors_between_bodies_and_colliders_are_named() {
    let other = &SMALL[SMALL.find("[[body]]").unwrap()..];
    let twice = format!("{SMALL}\n{other}");
    assert_eq!(
        message(&twice),
        "scene.toml:11:8: body[1].name: 'cloth' is the name of another body: a name may be used once"
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
        "scene.toml:10:1: collider[0]: has plane and sphere of plane, sphere, capsule, box, cylinder, half_pipe, mesh: exactly one is needed"
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
    let plate = format!("{chain}\n[[body.law]]\nname = \"plate\"\nstiffness = 1e-4\n");
    assert_eq!(
        message(&plate),
        "scene.toml:11:8: body[0].law[0].name: is plate, which bends triangles, and the mesh has none: a chain folds by springs.bend"
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

#[test]
fn integers_where_numbers_are_wanted_and_a_last_line_without_an_end_are_read() {
    let of = |one: &str, half: &str| {
        let text = format!(
            "version = 1\ndt = {one}\ngravity = [0, {half}, 0]\nwind = [{one}, {one}, {one}]\n[[body]]\nname = \"a\"\n\
             mesh = {{ grid = [3, 2], spacing = {one} }}\nmass = {{ particle = {one} }}\nvelocity = [0, {half}, {one}]\n\
             transform = {{ scale = {one}, rotate = {{ axis = [0, {one}, 0], degrees = {one} }}, translate = [{one}, {half}, 0] }}\n\
             springs = {{ stretch = {{ stiffness = {one}, damping = {one} }} }}\npins = [0]\nlimits = {{ max_stretch = {one} }}\n\
             [[body.moving_pin]]\npin = 0\noffset = [{one}, 0, {half}]\nduration = {one}\n\
             [snow]\ncell = {one}\n[[snow.object]]\nname = \"s\"\nsphere = {{ center = [0, {half}, {one}], radius = {one} }}\n\
             material = {{ young = {one}, density = {one}, plastic_ratio_range = [{half}, {one}] }}\n\
             [[collider]]\nname = \"c\"\nplane = {{ point = [0, {half}, 0], normal = [0, {one}, 0] }}\nfriction = {one}"
        );
        parse(&text).unwrap_or_else(|error| panic!("{error}"))
    };
    let scene = of("1", "0.5");
    assert_eq!(scene, of("1.0", "5e-1"));
    assert_eq!(scene.bodies[0].velocity, [0.0, 0.5, 1.0]);
    assert_eq!(parse(&SMALL.replace("stiffness = 10", "stiffness = 1_0")).unwrap(), parse(SMALL).unwrap());
    assert_eq!(parse(SMALL.trim_end()).unwrap(), parse(SMALL).unwrap());
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

#[test]
fn a_key_under_its_old_name_is_read_and_told_its_new_one() {
    let with = |block_size: &str, plastic_ratio_range: &str| {
        format!(
            "{SMALL}{block_size} = 64\n[snow]\ncell = 0.1\n[[snow.object]]\nname = \"ball\"\nsphere = {{ center = [0, 1, 0], radius = 0.3 }}\nmaterial = {{ {plastic_ratio_range} = [0.5, 2] }}\n"
        )
    };
    let (old, new) = (with("grain", "jp_range"), with("block_size", "plastic_ratio_range"));
    let scene = parse(&old).unwrap();
    assert_eq!(scene, parse(&new).unwrap());
    assert_eq!(scene.bodies[0].block_size, 64);
    let snow = scene.snow.as_ref().unwrap();
    assert_eq!(snow.objects[0].material.plastic_ratio_range, Some([0.5, 2.0]));
    assert!(parse(&scene.to_toml()).unwrap().warnings().is_empty(), "it is written with the new names");

    let (old, new) = (build(&old).unwrap(), build(&new).unwrap());
    assert_eq!(old.setup, new.setup);
    let uncoupled = "cloth and snow pass through each other: they are not coupled yet";
    assert_eq!(new.warnings, [uncoupled]);
    assert_eq!(
        old.warnings,
        [
            "scene.toml:9:1: body[0].grain: the key is now called 'block_size'",
            "scene.toml:15:14: snow.object[0].material.jp_range: the key is now called 'plastic_ratio_range'",
            uncoupled,
        ]
    );
}

#[test]
fn sub_steps_of_cloth_come_out_as_written() {
    let with = |lines: &str| SMALL.replace("name = \"cloth\"", &format!("name = \"cloth\"\n{lines}"));
    let of = |lines: &str| {
        let built = build(&with(lines)).unwrap_or_else(|error| panic!("{error}"));
        built.setup.bodies[0].settings
    };
    assert_eq!(of("").time_step, TimeStep::Certified { safety: 0.9 });
    assert_eq!(of("safety = 0.5").time_step, TimeStep::Certified { safety: 0.5 });
    assert_eq!(of("substeps = 4").time_step, TimeStep::Fixed(0.01 / 4.0));
    assert_eq!(of("substep = 1e-3").time_step, TimeStep::Fixed(1e-3));
    assert_eq!(of("unchecked = true").time_step, TimeStep::Unchecked(0.01));
    assert_eq!(of("substeps = 4\nunchecked = true").time_step, TimeStep::Unchecked(0.01 / 4.0));
    assert_eq!((of("").tolerance, of("tolerance = 1e-4").tolerance), (None, Some(1e-4)));

    let newton = |tolerance, max_iterations| Minimizer::Newton(NewtonSettings { tolerance, max_iterations });
    let auto = |accuracy| Minimizer::Auto { accuracy };
    assert_eq!((of("").minimizer, Minimizer::default()), (auto(0.002), auto(0.002)));
    assert_eq!(of("minimizer = \"auto\"\naccuracy = 1e-4").minimizer, auto(1e-4));
    assert_eq!(of("minimizer = \"one_step\"").minimizer, Minimizer::OneStep);
    assert_eq!(of("minimizer = \"newton\"").minimizer, newton(0.01, 50));
    let both = "minimizer = \"newton\"\nnewton_tolerance = 1e-6\nnewton_iterations = 7";
    assert_eq!(of(both).minimizer, newton(1e-6, 7));
    let descent = |sweeps| Minimizer::VertexBlockDescent { sweeps };
    assert_eq!(of("minimizer = \"vertex_block_descent\"").minimizer, descent(20));
    assert_eq!(of("minimizer = \"vertex_block_descent\"\nsweeps = 7").minimizer, descent(7));
    for (lines, key, says) in [
        (
            "minimizer = \"newton\"\nintegrator = \"velocity_verlet\"",
            "minimizer",
            "'velocity_verlet' is explicit",
        ),
        ("accuracy = 1e-3\nminimizer = \"one_step\"", "accuracy", "minimizer = \"auto\""),
        ("accuracy = 1e-3\nintegrator = \"velocity_verlet\"", "accuracy", "'velocity_verlet' is explicit"),
        ("accuracy = 0.0", "accuracy", "allowed"),
        ("newton_tolerance = 1e-6", "newton_tolerance", "minimizer = \"newton\""),
        ("newton_iterations = 7", "newton_iterations", "minimizer = \"newton\""),
        ("sweeps = 7", "sweeps", "minimizer = \"vertex_block_descent\""),
        ("minimizer = \"newton\"\nnewton_tolerance = 0.0", "newton_tolerance", "allowed"),
    ] {
        let text = message(&with(lines));
        assert!(text.contains(&format!("body[0].{key}: ")) && text.contains(says), "{lines}: {text}");
    }

    for (lines, key) in [
        ("substeps = 2\nsubstep = 1e-3", "substep"),
        ("substeps = 2\nsafety = 0.5", "safety"),
        ("unchecked = true\nsafety = 0.5", "safety"),
        ("unchecked = true\ntolerance = 1e-3", "tolerance"),
        ("unchecked = true\naccuracy = 1e-3", "accuracy"),
        ("thickness = 0.01\naccuracy = 1e-3", "accuracy"),
    ] {
        let text = message(&with(lines));
        assert!(
            text.contains(&format!("body[0].{key}: ")) && text.contains("not go with"),
            "{lines}: {text}"
        );
    }
}

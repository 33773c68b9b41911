//! Snow in scene files: what comes out as written, and what each contradiction is called.

use std::sync::Arc;

use nappe_scene::{Built, ErrorKind, MeshSource, NoMeshes, Scene, SceneError, SceneErrors, SceneLimits};
use nappe_sim::{
    collide::{
        Contact, Shape,
        shape::{Cuboid, HalfPipe},
    },
    linalg::Stop,
    mesh::TriangleMesh,
    snow::{Advection, Blend, Integration, Kernel, Law, SnowObject, Transfer},
    time_step::TimeStep,
    world::WorldSetup,
};

const SMALL: &str = r#"version = 1
dt = 0.01

[snow]
cell = 0.1

[[snow.object]]
name = "ball"
sphere = { center = [0, 1, 0], radius = 0.3 }
"#;

fn parse(text: &str) -> Result<Scene, SceneErrors> {
    Scene::parse(text, "scene.toml")
}

fn build(text: &str) -> Result<Built, SceneErrors> {
    parse(text)?.build(&NoMeshes, &SceneLimits::default())
}

fn world(text: &str) -> WorldSetup {
    build(text).unwrap_or_else(|error| panic!("{error}")).setup
}

fn object(text: &str) -> SnowObject {
    world(text).snow.expect("snow").objects.remove(0)
}

/// The small scene with lines of the object's added.
fn with(lines: &str) -> String {
    format!("{SMALL}{lines}\n")
}

#[test]
fn settings_come_out_as_written() {
    let of = |lines: &str| {
        let text = SMALL.replace("cell = 0.1", &format!("cell = 0.1\n{lines}"));
        world(&text).snow.expect("snow").settings
    };
    let plain = of("");
    assert_eq!(plain, nappe_sim::snow::SnowSettings::new(0.1));
    let flip = of("transfer = \"pic_flip\"\nkernel = \"cubic\"");
    assert_eq!(flip.transfer, Transfer::PicFlip(Blend::PerStep(0.95)));
    assert_eq!(flip.kernel, Kernel::Cubic);
    let grid = of("transfer = \"pic_flip\"\nadvection = \"grid\"");
    assert_eq!((flip.advection, grid.advection), (Advection::Particle, Advection::Grid));
    let timed = of("transfer = \"pic_flip\"\nflip_time = 0.02\nkernel = \"linear\"");
    assert_eq!(timed.transfer, Transfer::PicFlip(Blend::TimeConstant(0.02)));
    assert_eq!(of("transfer = \"apic\"").transfer, Transfer::Apic);
    assert_eq!(of("safety = 0.5").time_step, TimeStep::Certified { safety: 0.5 });
    assert_eq!(of("substep = 1e-4").time_step, TimeStep::Fixed(1e-4));
    assert_eq!(of("substep = 1e-4\nunchecked = true").time_step, TimeStep::Unchecked(1e-4));
    let implicit = of("beta = 0.5\nsolver = { tolerance = 1e-7 }");
    let stop = Stop::Residual { tolerance: 1e-7, max_iterations: 500 };
    assert_eq!(implicit.integration, Integration::SemiImplicit { beta: 0.5, stop });
    let rest = of("max_substeps = 7\nballistic_below = 0.1\nmax_energy = 5");
    assert_eq!((rest.max_substeps, rest.ballistic_below, rest.max_energy), (7, 0.1, Some(5.0)));
    assert_eq!((of("drag = 2.5").drag, of("drag = 1e9").drag), (2.5, 1e9));
    for drag in ["-1", "1.1e9"] {
        let text = SMALL.replace("cell = 0.1", &format!("cell = 0.1\ndrag = {drag}"));
        let error = parse(&text).expect_err("out of range").to_string();
        assert!(error.contains("snow.drag") && error.contains("0 to 1000000000"), "{error}");
    }
}

#[test]
fn materials_are_presets_with_what_the_scene_says() {
    let of = |fields: &str| object(&with(&format!("material = {{ {fields} }}"))).material;
    let plain = object(SMALL).material;
    assert_eq!((plain.law, plain.young, plain.poisson), (Law::FixedCorotated, 1.4e5, 0.2));
    let own = of(
        "preset = \"taichi_snow\", law = \"neo_hookean\", young = 2e5, poisson = 0.3, hardening = 4, plastic_ratio_range = [0.7, 3]",
    );
    let yields = own.plasticity.expect("a yield");
    assert_eq!((own.law, own.young, own.poisson), (Law::NeoHookean, 2e5, 0.3));
    assert_eq!(
        (yields.critical_stretch, yields.hardening, yields.plastic_ratio_range),
        (4.5e-3, 4.0, [0.7, 3.0])
    );
    assert_eq!(of("plastic = false").plasticity, None);
    assert_eq!(of("preset = \"brasseur_neo_hookean\"").plasticity, None);
}

fn total(values: &[f64]) -> f64 {
    values.iter().sum()
}

#[test]
fn mass_is_density_times_volume_whatever_the_sampling_and_the_noise() {
    let ball = 4.0 / 3.0 * std::f64::consts::PI * 0.3_f64.powi(3);
    for sampling in ["jittered", "lattice", "poisson"] {
        for noise in ["", "density_noise = 0.5", "density_noise = 0.5\nnoise_length = 0.2"] {
            let lines = format!("sampling = \"{sampling}\"\n{noise}\nmaterial = {{ density = 150 }}");
            let round = object(&with(&lines));
            assert!((total(&round.mass) / (150.0 * ball) - 1.0).abs() < 1e-12, "{lines}");
            assert!((total(&round.volume) / ball - 1.0).abs() < 1e-12, "{lines}");
            let square = with(&lines).replace(
                "sphere = { center = [0, 1, 0], radius = 0.3 }",
                "box = { min = [-1, 0, 0], max = [0, 0.55, 0.31] }",
            );
            let square = object(&square);
            assert!((total(&square.mass) / (150.0 * 0.55 * 0.31) - 1.0).abs() < 1e-12, "{lines}");
            let spread = square.mass.iter().fold(0.0_f64, |s, m| s.max((m / square.mass[0] - 1.0).abs()));
            assert_eq!(spread > 0.0, !noise.is_empty(), "{lines}");
        }
    }
    assert!(object(&with("volume = \"grid\"")).volume.is_empty());
    let stiff = object(&with("stiffness_noise = 0.2")).stiffness;
    assert!(stiff.iter().all(|f| (0.8..=1.2).contains(f)) && stiff[0] != stiff[1]);
}

#[test]
fn a_spinning_object_turns_about_its_centre() {
    let spun = object(&with("velocity = [1, 0, 0]\nangular_velocity = [0, 0, 2]"));
    assert_eq!(spun.angular_velocity, [0.0, 0.0, 2.0], "its affine velocity");
    for (x, v) in spun.x.iter().zip(&spun.v) {
        assert_eq!(*v, [1.0 - 2.0 * (x[1] - 1.0), 2.0 * x[0], 0.0]);
    }
}

#[test]
fn a_transform_moves_the_box_and_its_lattice() {
    let text = with("sampling = \"lattice\"").replace(
        "sphere = { center = [0, 1, 0], radius = 0.3 }",
        "box = { center = [1, 0, 0], size = [0.2, 0.1, 0.1] }\ntransform = { scale = 2, rotate = { axis = [0, 0, 1], degrees = 90 }, translate = [0, 0, 5] }",
    );
    let moved = object(&text);
    // Twice the edges, upright: 0.2 along x, 0.4 along y, about (0, 2, 5); 8 particles in 0.1³.
    assert_eq!(moved.x.len(), 8 * 4 * 4);
    let (low, high) = moved.x.iter().fold(([f64::MAX; 3], [f64::MIN; 3]), |(l, h), x| {
        ([0, 1, 2].map(|c| l[c].min(x[c])), [0, 1, 2].map(|c| h[c].max(x[c])))
    });
    for (found, wanted) in low.into_iter().chain(high).zip([-0.075, 1.825, 4.925, 0.075, 2.175, 5.075]) {
        assert!((found - wanted).abs() < 1e-12, "{found} {wanted}");
    }
}

/// The small scene with four colliders.
fn with_colliders() -> String {
    format!(
        r#"{SMALL}
[[collider]]
name = "rod"
capsule = {{ start = [0, 0, 0], end = [1, 0, 0], radius = 0.1 }}
contact = "sticky"
[[collider]]
name = "crate"
box = {{ center = [0, 0, 0], size = [2, 4, 6], rotate = {{ axis = [0, 0, 3], degrees = 90 }} }}
contact = "slip"
[[collider]]
name = "drum"
cylinder = {{ start = [0, 0, 0], end = [0, 1, 0], radius = 0.1 }}
[[collider]]
name = "pipe"
half_pipe = {{ point = [0, 1, 0], axis = [2, 0, 0], up = [7, 3, 0], radius = 2 }}
"#
    )
}

#[test]
fn shapes_and_contact_of_colliders_come_out_as_written() {
    let text = with_colliders();
    let scene = parse(&text).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(parse(&scene.to_toml()).unwrap_or_else(|error| panic!("{error}")), scene);
    let colliders = world(&text).colliders;
    assert!(colliders.iter().all(|collider| collider.invalid().is_none()));
    assert_eq!(
        colliders.iter().map(|collider| collider.contact).collect::<Vec<_>>(),
        [Contact::Sticky, Contact::Slip, Contact::Separating, Contact::Separating]
    );
    let axes = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]];
    assert_eq!(
        colliders[1].shape,
        Shape::Box(Cuboid { center: [0.0; 3], half_extent: [1.0, 2.0, 3.0], axes })
    );
    let (axis, up) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    assert_eq!(
        colliders[3].shape,
        Shape::HalfPipe(HalfPipe { point: [0.0, 1.0, 0.0], axis, up, radius: 2.0 })
    );
}

#[test]
fn a_collider_that_makes_no_shape_is_named() {
    let text = with_colliders();
    for (old, new, wanted) in [
        (
            "end = [1, 0, 0]",
            "end = [0, 0, 0]",
            "scene.toml:13:38: collider[0].capsule.end: is the same point as start; allowed: another point, or a sphere instead",
        ),
        (
            "up = [7, 3, 0]",
            "up = [7, 0, 0]",
            "scene.toml:24:57: collider[3].half_pipe.up: runs along the axis; allowed: a direction across it, that of the opening",
        ),
        (
            "up = [7, 3, 0]",
            "up = [0, 0, 0]",
            "scene.toml:24:57: collider[3].half_pipe.up: is zero: a direction needs a length above 0",
        ),
        (
            "axis = [0, 0, 3]",
            "axis = [0, 0, 0]",
            "scene.toml:17:65: collider[1].box.rotate.axis: is zero: an axis needs a direction",
        ),
        (
            "\"slip\"",
            "\"slippy\"",
            "scene.toml:18:11: collider[1].contact: is 'slippy'; did you mean 'slip'?",
        ),
        (
            "size = [2, 4, 6]",
            "size = [2, 0, 6]",
            "scene.toml:17:40: collider[1].box.size[1]: is 0; allowed: a number, 1e-6 to 1000000",
        ),
    ] {
        let error = build(&text.replace(old, new)).expect_err("an error").to_string();
        assert_eq!(error, wanted);
    }
}

#[test]
fn a_full_object_survives_a_round_trip() {
    let text = with(
        r#"transform = { scale = 2, rotate = { axis = [0, 0, 1], degrees = 90 }, translate = [0, 0, 5] }
sampling = "poisson"
particles = 500
seed = 4294967295
velocity = [0, 1, 0]
angular_velocity = [0, 1, 0]
density_noise = 0.1
stiffness_noise = 0.2
noise_length = 0.3
volume = "grid"
[snow.object.material]
preset = "genesis_snow"
law = "neo_hookean"
young = 1e5
plastic = true
plastic_ratio_range = [0.5, 3]
"#,
    );
    let text = text.replace(
        "cell = 0.1",
        "cell = 0.1\ntransfer = \"pic_flip\"\nflip_time = 0.1\nadvection = \"grid\"\nsubstep = 1e-3\nunchecked = true\nbeta = 1\nsolver = { max_iterations = 9 }",
    );
    let scene = parse(&text).unwrap_or_else(|error| panic!("{error}"));
    let again = parse(&scene.to_toml()).unwrap_or_else(|error| panic!("{error}\n{}", scene.to_toml()));
    assert_eq!(again, scene);
    assert_eq!(object(&text).x.len(), 500);
}

#[test]
fn particles_are_held_against_the_limit_together_with_those_before() {
    let scene =
        parse(&format!("{SMALL}particles = 100\n[[body]]\nname = \"a\"\nmesh = {{ course_grid = 3 }}\n"))
            .unwrap_or_else(|error| panic!("{error}"));
    let limits = |max_particles| SceneLimits { max_particles, ..SceneLimits::default() };
    let built = scene.build(&NoMeshes, &limits(109)).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(
        built.warnings.last().map(String::as_str),
        Some("cloth and snow pass through each other: they are not coupled yet")
    );
    let error = scene.build(&NoMeshes, &limits(108)).expect_err("one too many");
    assert_eq!(error.first().kind, ErrorKind::TooLarge);
    assert_eq!(
        error.first().message,
        "this object has 100 particles, 109 with the bodies and objects before it; allowed: at most 108"
    );
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
fn a_closed_mesh_is_filled_and_an_open_one_named() {
    let text = SMALL.replace("sphere = { center = [0, 1, 0], radius = 0.3 }", "mesh = { upload = \"m\" }");
    let tetrahedron = TriangleMesh {
        points: vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]],
        triangles: vec![[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]],
        ..TriangleMesh::default()
    };
    let build =
        |mesh: &TriangleMesh| parse(&text)?.build(&Uploaded(Arc::new(mesh.clone())), &SceneLimits::default());
    let built = build(&tetrahedron).unwrap_or_else(|error| panic!("{error}"));
    assert!(built.warnings.is_empty(), "{:?}", built.warnings);
    let object = &built.setup.snow.as_ref().expect("snow").objects[0];
    assert!((total(&object.mass) / (400.0 / 6.0) - 1.0).abs() < 1e-12);
    assert!(object.x.iter().all(|x| x.iter().all(|c| *c >= 0.0) && total(x) <= 1.0 + 1e-12));
    // An eighth of a cell each.
    assert!((object.x.len() as f64 / (1000.0 * 8.0 / 6.0) - 1.0).abs() < 0.05, "{}", object.x.len());
    let mut open = tetrahedron;
    open.triangles.pop();
    let error = build(&open).expect_err("a face is missing");
    assert_eq!(error.first().kind, ErrorKind::BadMesh);
    assert_eq!(
        error.to_string(),
        "scene.toml:9:8: snow.object[0].mesh: is not closed: the edge from point 1 at (1, 0, 0) to point 2 at (0, 1, 0) has 1 triangle, and each edge of a closed surface has two; 2 other edges are open too"
    );
}

#[test]
fn an_object_is_attached_to_a_sticky_collider_that_stands_or_an_error_says_what_is_needed() {
    let scene = |attach: &str, preset: &str, collider: &str| {
        format!(
            "version = 1\ndt = 0.01\n\n[snow]\ncell = 0.1\n\n[[snow.object]]\nname = \"bar\"\nattach = \"{attach}\"\n\
             box = {{ min = [0, -1, 0], max = [0.4, 0, 0.4] }}\nmaterial = {{ preset = \"{preset}\" }}\n\n\
             [[collider]]\nname = \"ceiling\"\nplane = {{ point = [0, 0, 0], normal = [0, -1, 0] }}\n{collider}\n"
        )
    };
    let sticky = "contact = \"sticky\"";
    let built = world(&scene("ceiling", "elastic", sticky));
    assert_eq!(built.snow.expect("snow").objects[0].attach.as_deref(), Some("ceiling"));

    let moving = format!("{sticky}\nvelocity = [0, 1, 0]");
    for (text, part) in [
        (scene("ceilin", "elastic", sticky), "did you mean 'ceiling'?"),
        (scene("ceiling", "elastic", ""), "needs contact = \"sticky\""),
        (scene("ceiling", "elastic", &moving), "needs a collider that stands"),
        (scene("ceiling", "stomakhin", sticky), "cannot yield"),
        (scene("ceiling", "elastic", sticky).replace("[0, 0, 0]", "[0, 1, 0]"), "within half a cell"),
    ] {
        let errors = build(&text).expect_err("it cannot be attached");
        let error = errors.first();
        assert_eq!(error.line, 9, "{error}");
        assert!(error.to_string().contains(part), "{error}");
    }
}

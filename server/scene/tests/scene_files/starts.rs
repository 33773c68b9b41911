//! Cloth and snow that begin inside a collider of any shape are told, refused, or taken out.

use nappe_scene::{Built, ErrorKind};
use nappe_sim::{
    collide::Collider, math::Precision, mesh::TriangleMesh, report::NoStopwatch, snow::SnowObject,
    world::Simulation,
};

use crate::{build, message};

const SHEET: &str = r#"version = 1
dt = 0.001
precision = "f64"

[[body]]
name = "b"
mesh = { grid = [3, 3], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 100, damping = 0.1 }, shear = { stiffness = 100 } }
"#;

/// Shapes that the sheet lies in; the particle that is deepest, and how deep it is (m).
const AROUND: [(&str, usize, &str); 6] = [
    ("plane = { point = [0, 0.5, 0], normal = [0, 1, 0] }", 0, "0.5"),
    ("sphere = { center = [0.1, 0, 0.1], radius = 1 }", 4, "1"),
    ("capsule = { start = [0.1, 0, -1], end = [0.1, 0, 1], radius = 0.5 }", 1, "0.5"),
    ("box = { center = [0.1, 0, 0.1], size = [1, 0.4, 1] }", 0, "0.2"),
    ("cylinder = { start = [0.1, -0.3, 0.1], end = [0.1, 0.3, 0.1], radius = 1 }", 0, "0.3"),
    ("half_pipe = { point = [0.1, 0.5, 0.1], axis = [0, 0, 1], up = [0, 1, 0], radius = 0.2 }", 0, "0.31"),
];

const SNOW: &str = r#"version = 1
dt = 0.001
precision = "f64"

[snow]
cell = 0.05

[[snow.object]]
name = "pack"
box = { min = [-0.2, -0.2, -0.2], max = [0.2, 0.2, 0.2] }
sampling = "lattice"
particles_per_cell = 1
"#;

/// Shapes that hold a part of the snow.
const WITHIN: [&str; 6] = [
    FLOOR,
    "sphere = { center = [0, -0.2, 0], radius = 0.3 }",
    "capsule = { start = [-1, -0.2, 0], end = [1, -0.2, 0], radius = 0.25 }",
    "box = { center = [0, -0.2, 0], size = [1, 0.4, 1] }",
    "cylinder = { start = [0, -0.4, 0], end = [0, 0, 0], radius = 0.5 }",
    "half_pipe = { point = [0, 0.1, 0], axis = [0, 0, 1], up = [0, 1, 0], radius = 0.15 }",
];

const FLOOR: &str = "plane = { point = [0, 0, 0], normal = [0, 1, 0] }";
const BALL: &str = AROUND[1].0;
const LIFT: &str = "on_start_inside = \"lift\"";
const REFUSE: &str = "on_start_inside = \"refuse\"";

/// A scene with a collider more: four lines.
fn with(scene: &str, name: &str, shape: &str, key: &str) -> String {
    format!("{scene}[[collider]]\nname = \"{name}\"\n{shape}\n{key}\n")
}

fn built(text: &str) -> Built {
    build(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// Signed distance (m) of a place from a collider at the start.
fn distance(collider: &Collider, place: [f64; 3]) -> f64 {
    collider.distance(place, 0.0).0
}

fn length([a, b]: [[f64; 3]; 2]) -> f64 {
    (0..3).map(|c| (a[c] - b[c]).powi(2)).sum::<f64>().sqrt()
}

fn pack(built: &Built) -> &SnowObject {
    &built.setup.snow.as_ref().expect("snow").objects[0]
}

#[test]
fn cloth_that_begins_in_any_shape_is_told() {
    for (shape, particle, depth) in AROUND {
        let built = built(&with(SHEET, "it", shape, ""));
        let told = format!(
            "body 'b': 9 of its 9 particles begin inside collider 'it', particle {particle} deepest, by {depth} m: what is \
             inside is pushed out at 1 m/s (recovery); on_start_inside = \"lift\" moves it out before the first step, \
             \"refuse\" ends here"
        );
        assert_eq!(built.warnings, [told]);
        assert_eq!(built.setup.bodies[0].network.x, TriangleMesh::grid(3, 3, 0.1).points, "it stays there");
    }
}

#[test]
fn cloth_that_begins_in_any_shape_is_refused_where_its_collider_says_so() {
    for (shape, particle, depth) in AROUND {
        let error = build(&with(SHEET, "it", shape, REFUSE)).expect_err("it begins inside");
        assert_eq!(error.first().kind, ErrorKind::Inconsistent);
        let told = format!(
            "scene.toml:13:19: collider[0].on_start_inside: is \"refuse\", and 9 of the 9 particles of body 'b' begin inside \
             collider 'it', particle {particle} deepest, by {depth} m; allowed: a body that begins outside, or \"lift\", which \
             moves it out before the first step, or \"warn\""
        );
        assert_eq!(error.to_string(), told);
    }
}

#[test]
fn cloth_that_is_lifted_out_of_any_shape_lies_on_its_margin_at_rest_and_gains_no_energy() {
    for (shape, ..) in AROUND {
        let built = built(&with(SHEET, "it", shape, &format!("margin = 0.01\n{LIFT}")));
        let told = "body 'b': 9 of its 9 particles begin inside collider 'it' and are lifted out before the first step, ";
        assert_eq!(built.warnings.len(), 1, "{shape}: {:?}", built.warnings);
        assert!(built.warnings[0].starts_with(told), "{shape}: {:?}", built.warnings);

        let (collider, network) = (&built.setup.colliders[0], &built.setup.bodies[0].network);
        for place in &network.x {
            let off = distance(collider, *place) - 0.01;
            assert!(off.abs() < 1e-9, "{shape}: {place:?} is {off:e} m off");
        }
        for spring in &network.springs {
            let stretch = length(spring.particles.map(|i| network.x[i as usize])) - spring.rest_length;
            assert!(stretch.abs() < 1e-12, "{shape}: {spring:?} is {stretch:e} m too long");
        }

        let (mut simulation, _) = Simulation::new(&built.setup, Precision::F64).expect("a world");
        let before = simulation.diagnose();
        assert!(before.elastic_energy < 1e-20, "{shape}: {before:?}");
        let after = simulation.step(&mut NoStopwatch).expect("a step").diagnostics;
        let gain = after.total_energy() - before.total_energy();
        assert!(gain < 1e-6, "{shape}: {gain:e} J from nothing");
    }
}

#[test]
fn a_lift_tells_how_far_it_moved_the_cloth() {
    assert_eq!(
        built(&with(SHEET, "it", BALL, LIFT)).warnings,
        [
            "body 'b': 9 of its 9 particles begin inside collider 'it' and are lifted out before the first step, particle 4 \
          farthest, by 1 m: springs are at rest as they lie now (on_start_inside = \"lift\")"
        ]
    );
}

#[test]
fn pins_in_a_collider_are_neither_told_nor_moved() {
    let pinned = format!("{SHEET}pins = [\"top\", 4]\n");
    let told = &built(&with(&pinned, "it", BALL, "")).warnings[0];
    let begin = "body 'b': 5 of its 9 particles begin inside collider 'it', particle ";
    assert!(told.starts_with(begin), "{told}");

    let lifted = built(&with(&pinned, "it", BALL, LIFT));
    let sheet = TriangleMesh::grid(3, 3, 0.1).points;
    for (i, place) in lifted.setup.bodies[0].network.x.iter().enumerate() {
        let is_pin = i < 3 || i == 4;
        assert_eq!(*place == sheet[i], is_pin, "particle {i} at {place:?}");
    }

    let all = format!("{SHEET}pins = [\"top\", 3, 4, 5, \"bottom\"]\n");
    let warnings = built(&with(&all, "it", BALL, REFUSE)).warnings;
    assert_eq!(warnings, ["body 'b': every particle is pinned: nothing moves by itself"]);
}

#[test]
fn a_body_that_rejects_passages_is_told_that_its_start_is_none() {
    let told =
        &built(&with(&format!("{SHEET}on_pass = \"reject\"\n"), "it", BALL, "recovery = 0.5")).warnings[0];
    let said = ": what is inside is pushed out at 0.5 m/s (recovery) and does not count as passed for on_pass = \"reject\"; ";
    assert!(told.contains(said), "{told}");
}

#[test]
fn what_lies_between_a_surface_and_its_margin_is_not_inside() {
    let floor = "plane = { point = [0, -0.005, 0], normal = [0, 1, 0] }\nmargin = 0.01";
    for key in ["", REFUSE, LIFT] {
        let built = built(&with(SHEET, "it", floor, key));
        assert_eq!(built.warnings, [""; 0]);
        assert_eq!(built.setup.bodies[0].network.x, TriangleMesh::grid(3, 3, 0.1).points);
    }
}

#[test]
fn several_colliders_are_told_in_one_sentence_and_left_one_after_the_other() {
    let ground = AROUND[0].0;
    let both = |key: &str| with(&with(SHEET, "it", BALL, key), "ground", ground, key);
    let told = &built(&both("")).warnings[..];
    assert_eq!(told.len(), 1, "{told:?}");
    let said = "body 'b': 9 of its 9 particles begin inside 2 colliders, particle 4 deepest, by 1 m in collider 'it': ";
    assert!(told[0].starts_with(said), "{told:?}");

    let lifted = built(&both(LIFT)).setup;
    for place in &lifted.bodies[0].network.x {
        let least =
            lifted.colliders.iter().map(|collider| distance(collider, *place)).fold(f64::INFINITY, f64::min);
        assert!(least > -1e-8, "{place:?} is {least:e} m inside");
    }

    // No place is outside of both.
    let roof = "plane = { point = [0, 0.4, 0], normal = [0, -1, 0] }";
    assert_eq!(
        message(&with(&with(SHEET, "ground", ground, LIFT), "roof", roof, LIFT)),
        "scene.toml:17:19: collider[1].on_start_inside: is \"lift\", and particle 0 of body 'b' does not come out within 16 \
         rounds over all colliders: they overlap there, or meet in a narrow gap; allowed: a body that begins outside, or \
         \"warn\""
    );
}

#[test]
fn a_recovery_or_an_answer_to_starts_that_there_is_not_is_refused() {
    for (key, said) in [
        ("recovery = 0", "scene.toml:13:12: collider[0].recovery: is 0; allowed: a number, 1e-6 to 1000"),
        ("recovery = -1", "scene.toml:13:12: collider[0].recovery: is -1; allowed: a number, 1e-6 to 1000"),
        ("recovery = inf", "scene.toml:13:12: collider[0].recovery: is inf; allowed: a number, 1e-6 to 1000"),
        (
            "on_start_inside = \"push\"",
            "scene.toml:13:19: collider[0].on_start_inside: is 'push'; allowed: warn, refuse, lift",
        ),
        (
            "on_start_inside = true",
            "scene.toml:13:19: collider[0].on_start_inside: is true; allowed: warn, refuse, lift",
        ),
    ] {
        assert_eq!(message(&with(SHEET, "it", BALL, key)), said);
    }
}

#[test]
fn snow_that_begins_below_a_floor_is_told_refused_or_left_out_with_its_mass() {
    let told = "snow 'pack': 192 of its 512 particles begin inside collider 'it' by more than a cell (0.05 m), particle 0 \
                deepest, by 0.175 m: snow stays inside, since recovery is for cloth alone; on_start_inside = \"lift\" leaves it \
                out, \"refuse\" ends here";
    assert_eq!(built(&with(SNOW, "it", FLOOR, "contact = \"slip\"")).warnings, [told]);
    assert_eq!(
        message(&with(SNOW, "it", FLOOR, REFUSE)),
        "scene.toml:16:19: collider[0].on_start_inside: is \"refuse\", and 192 of the 512 particles of snow 'pack' begin inside \
         collider 'it' by more than a cell (0.05 m), particle 0 deepest, by 0.175 m; allowed: snow that begins outside, or \
         \"lift\", which leaves out what begins inside, or \"warn\""
    );

    let lifted = built(&with(SNOW, "it", FLOOR, LIFT));
    let told = "snow 'pack': 256 of its 512 particles begin inside collider 'it' and are left out before the first step, \
                12.8 kg of 25.6 kg (on_start_inside = \"lift\")";
    assert_eq!(lifted.warnings, [told]);
    let SnowObject { x, v, mass, volume, stiffness, .. } = pack(&lifted);
    assert_eq!([x.len(), v.len(), mass.len(), volume.len(), stiffness.len()], [256, 256, 256, 256, 0]);
    assert!(x.iter().all(|place| place[1] > 0.0));
    assert!((mass.iter().sum::<f64>() - 12.8).abs() < 1e-12);

    let above = FLOOR.replace("[0, 0, 0]", "[0, 1, 0]");
    assert_eq!(
        message(&with(SNOW, "it", &above, LIFT)),
        "scene.toml:16:19: collider[0].on_start_inside: is \"lift\", and all 512 particles of snow 'pack' begin inside collider \
         'it': none would be left; allowed: snow that begins outside, or \"warn\""
    );
}

#[test]
fn snow_that_begins_in_any_shape_is_told_refused_or_left_out() {
    for shape in WITHIN {
        let told = built(&with(SNOW, "it", shape, ""));
        let depths: Vec<f64> =
            pack(&told).x.iter().map(|x| -distance(&told.setup.colliders[0], *x)).collect();
        let deep = depths.iter().filter(|depth| **depth > 0.05).count();
        let inside = depths.iter().filter(|depth| **depth > 1e-8).count();
        assert!(deep > 0 && inside > deep && inside < 512, "{shape}: {deep} of {inside}");
        let said = format!(
            "snow 'pack': {deep} of its 512 particles begin inside collider 'it' by more than a cell"
        );
        assert!(
            told.warnings.len() == 1 && told.warnings[0].starts_with(&said),
            "{shape}: {:?}",
            told.warnings
        );

        let refused = message(&with(SNOW, "it", shape, REFUSE));
        let said = format!(
            "and {deep} of the 512 particles of snow 'pack' begin inside collider 'it' by more than a cell"
        );
        assert!(refused.contains(&said), "{shape}: {refused}");

        let lifted = built(&with(SNOW, "it", shape, LIFT));
        assert_eq!(pack(&lifted).x.len(), 512 - inside, "{shape}: {:?}", lifted.warnings);
        let said =
            format!("snow 'pack': {inside} of its 512 particles begin inside collider 'it' and are left out");
        assert!(lifted.warnings[0].starts_with(&said), "{shape}: {:?}", lifted.warnings);
    }
}

#[test]
fn snow_no_deeper_than_a_cell_begins_as_snow_does() {
    let shallow = FLOOR.replace("[0, 0, 0]", "[0, -0.16, 0]");
    for key in ["", REFUSE] {
        let built = built(&with(SNOW, "it", &shallow, key));
        assert_eq!(built.warnings, [""; 0]);
        assert_eq!(pack(&built).x.len(), 512);
    }
}

#[test]
fn particles_that_are_put_in_place_of_others_are_not_refused_for_being_inside() {
    let below = FLOOR.replace("[0, 0, 0]", "[0, -0.3, 0]");
    let built = built(&with(SNOW, "it", &below, REFUSE));
    let (mut simulation, _) = Simulation::new(&built.setup, Precision::F64).expect("a world");
    let mut particles = simulation.snow_particles();
    for particle in &mut particles {
        particle.x[1] -= 0.4;
    }
    simulation.restore_snow(&particles);
    simulation.step(&mut NoStopwatch).expect("a step");
    let lowest =
        simulation.snow_particles().iter().map(|particle| particle.x[1]).fold(f64::INFINITY, f64::min);
    assert!(lowest < -0.5, "they are where they were put: {lowest} m");
}

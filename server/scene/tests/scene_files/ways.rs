//! Colliders with keys: what comes out as written, what is refused and where, and what begins inside at time 0.

use nappe_scene::{Built, ColliderKey, ErrorKind, NoMeshes, Scene, SceneLimits, SceneSize};
use nappe_sim::{
    collide::{Collider, PoseKey, Way},
    mesh::TriangleMesh,
};

use crate::{build, message, parse};

/// A sheet at y = 0, from (0, 0, 0) to (0.2, 0, 0.2), in nine lines.
const SHEET: &str = r#"version = 1
dt = 0.001
precision = "f64"

[[body]]
name = "b"
mesh = { grid = [3, 3], spacing = 0.1 }
mass = { particle = 0.01 }
springs = { stretch = { stiffness = 100, damping = 0.1 }, shear = { stiffness = 100 } }
"#;

const BALL: &str = "sphere = { center = [0.1, 50, 0.1], radius = 1 }";

/// The keys of a collider, from line 13 on.
const KEYS: &str = "[[collider.key]]\ntime = 0\nposition = [0.1, 50, 0.1]\n\
    [[collider.key]]\ntime = 2\nposition = [0, 48, 0]\nturn = [0, 0, 3, 4]\n";

/// The sheet, and a collider called `it` with more keys and tables.
fn with(shape: &str, more: &str) -> String {
    format!("{SHEET}[[collider]]\nname = \"it\"\n{shape}\n{more}")
}

fn key(time: f64, position: [f64; 3], turn: [f64; 4]) -> String {
    format!("[[collider.key]]\ntime = {time:?}\nposition = {position:?}\nturn = {turn:?}\n")
}

fn scene(text: &str) -> Scene {
    parse(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

fn built(text: &str) -> Built {
    build(text).unwrap_or_else(|error| panic!("{error}\n{text}"))
}

/// The collider of a scene with one.
fn collider(text: &str) -> Collider {
    let mut colliders = built(text).setup.colliders;
    assert_eq!(colliders.len(), 1, "{text}");
    colliders.remove(0)
}

/// Times, positions and turns of a way.
fn numbers(way: &Way) -> Vec<(f64, [f64; 3], [f64; 4])> {
    way.keys.iter().map(|key| (key.time, key.pose.position, key.pose.turn)).collect()
}

const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

#[test]
fn keys_come_out_as_written_with_turns_of_length_1_and_survive_a_round_trip() {
    let text = with(BALL, KEYS);
    let read = scene(&text);
    let written = [
        ColliderKey { time: 0.0, position: [0.1, 50.0, 0.1], turn: NO_TURN },
        ColliderKey { time: 2.0, position: [0.0, 48.0, 0.0], turn: [0.0, 0.0, 3.0, 4.0] },
    ];
    assert_eq!(read.colliders[0].keys, written);
    assert_eq!(scene(&read.to_toml()), read, "{}", read.to_toml());

    let way = collider(&text).way.expect("it has keys");
    let turned = [0.0, 0.0, 3.0 / 4.0 / 1.25, 1.0 / 1.25];
    assert_eq!(numbers(&way), [(0.0, [0.1, 50.0, 0.1], NO_TURN), (2.0, [0.0, 48.0, 0.0], turned)]);

    // A list in one line is the same.
    let inline = "key = [{ time = 0, position = [0.1, 50, 0.1] }, \
                  { time = 2, position = [0, 48, 0], turn = [0, 0, 3, 4] }]\n";
    assert_eq!(scene(&with(BALL, inline)).colliders, read.colliders);
}

#[test]
fn a_turn_is_made_of_length_1_however_long_it_is_and_keeps_its_bits_if_it_has_it() {
    let turn_of = |turn: [f64; 4]| {
        let way = collider(&with(BALL, &key(0.0, [0.0, 50.0, 0.0], turn))).way.expect("it has a key");
        way.keys[0].pose.turn
    };
    assert_eq!(turn_of([0.0, -1e-200, 0.0, 0.0]), [0.0, -1.0, 0.0, 0.0]);
    assert_eq!(turn_of([0.0, 0.0, 0.0, 1e6]), NO_TURN);
    let half = turn_of([1.0, 1.0, -1.0, 1.0]);
    assert_eq!(half, [0.5, 0.5, -0.5, 0.5]);

    let unit = [0.36, -0.48, 0.0, 0.8];
    assert_eq!(turn_of(unit).map(f64::to_bits), unit.map(f64::to_bits));
    let long = turn_of(unit.map(|c| 7.0 * c));
    for c in 0..4 {
        assert!((long[c] - unit[c]).abs() < 1e-15, "{long:?}, not {unit:?}");
    }
}

#[test]
fn a_collider_without_keys_has_no_way_and_is_written_without_any() {
    for more in ["velocity = [0, 0, 1]\n", "key = []\n", "velocity = [0, 0, 1]\nkey = []\n"] {
        let text = with(BALL, more);
        assert_eq!(collider(&text).way, None);
        assert!(!scene(&text).to_toml().contains("key"), "{}", scene(&text).to_toml());
    }
    // A velocity of 0 is none.
    let text = with(BALL, &format!("velocity = [0, 0, 0]\n{KEYS}"));
    assert_eq!(collider(&text).way.map(|way| way.keys.len()), Some(2));
}

/// What is replaced in the scene, by what, and how the message then begins.
const ERRORS: &[(&str, &str, &str)] = &[
    (
        "time = 2",
        "time = 0",
        "scene.toml:17:8: collider[0].key[1].time: is 0: times grow, and the key before it is at 0 s",
    ),
    (
        "time = 0",
        "time = 2.5",
        "scene.toml:17:8: collider[0].key[1].time: is 2: times grow, and the key before it is at 2.5 s",
    ),
    ("time = 2", "time = -1", "scene.toml:17:8: collider[0].key[1].time: is -1; allowed: a number, 0 to "),
    ("time = 2", "time = nan", "scene.toml:17:8: collider[0].key[1].time: is nan; allowed: a number, 0 to "),
    ("time = 2\n", "", "scene.toml:16:1: collider[0].key[1].time: is missing: "),
    ("position = [0, 48, 0]\n", "", "scene.toml:16:1: collider[0].key[1].position: is missing: "),
    (
        "position = [0, 48, 0]",
        "position = [0, 1000001, 0]",
        "scene.toml:18:16: collider[0].key[1].position[1]: is 1000001; allowed: a number, ",
    ),
    (
        "position = [0, 48, 0]",
        "position = [inf, 48, 0]",
        "scene.toml:18:13: collider[0].key[1].position[0]: is inf; allowed: a number, ",
    ),
    (
        "position = [0, 48, 0]",
        "position = [0, 48]",
        "scene.toml:18:12: collider[0].key[1].position: is an array of 2; allowed: three numbers, each at most ",
    ),
    (
        "position = [0, 48, 0]",
        "position = [0.1, 30050, 0.1]",
        "scene.toml:18:12: collider[0].key[1].position: is reached at 15000 m/s from the key before it; allowed: at most \
         10000 m/s",
    ),
    (
        "turn = [0, 0, 3, 4]",
        "turn = [0, 0, 0, 0]",
        "scene.toml:19:8: collider[0].key[1].turn: is zero: a turn needs a length above 0",
    ),
    (
        "turn = [0, 0, 3, 4]",
        "turn = [0, 0, 3]",
        "scene.toml:19:8: collider[0].key[1].turn: is an array of 3; allowed: four numbers, each at most ",
    ),
    (
        "turn = [0, 0, 3, 4]",
        "turn = [0, 0, nan, 4]",
        "scene.toml:19:15: collider[0].key[1].turn[2]: is nan; allowed: a number, ",
    ),
    (
        "turn = [0, 0, 3, 4]",
        "turn = 90",
        "scene.toml:19:8: collider[0].key[1].turn: is 90; allowed: four numbers, ",
    ),
    (
        "turn = [0, 0, 3, 4]",
        "tern = [0, 0, 3, 4]",
        "scene.toml:19:1: collider[0].key[1].tern: collider.key has no key 'tern'; did you mean 'turn'?",
    ),
    (
        "[[collider.key]]\ntime = 0",
        "velocity = [0, 0, 1]\n[[collider.key]]\ntime = 0",
        "scene.toml:13:12: collider[0].velocity: does not go with key, which says where the collider is at all times",
    ),
    (
        "[[collider.key]]\ntime = 0\nposition = [0.1, 50, 0.1]\n[[collider.key]]",
        "[collider.key]",
        "scene.toml:13:1: collider[0].key: is a table; allowed: an array of tables, at most 10000: write [[collider.key]], in \
         double brackets",
    ),
];

#[test]
fn keys_that_do_not_fit_are_refused_where_they_stand() {
    let text = with(BALL, KEYS);
    for (old, new, wanted) in ERRORS {
        let spoilt = text.replace(old, new);
        assert_ne!(spoilt, text, "the case changes the scene: {old}");
        let found = message(&spoilt);
        assert!(found.starts_with(wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn a_surface_that_particles_can_meet_too_fast_is_refused() {
    let plane = "plane = { point = [0.1, -1, 0.1], normal = [0, 1, 0] }";
    let ball = "sphere = { center = [0.1, -1, 0.1], radius = 0.5 }";
    // A quarter turn about z within so many seconds, and a way along y. The corners of the sheet are 1.00995 m from where it
    // begins.
    let moved = |shape: &str, seconds: f64, along: f64| {
        let turn = [0.0, 0.0, 1.0, 1.0];
        with(shape, &(key(0.0, [0.1, -1.0, 0.1], NO_TURN) + &key(seconds, [0.1, along - 1.0, 0.1], turn)))
    };
    for (shape, good, bad, told) in [
        (plane, (1.60e-4, 0.0), (1.57e-4, 0.0), "10100"),
        (ball, (7.9e-5, 0.0), (7.8e-5, 0.0), "10070"),
        (ball, (1.57e-4, 0.78), (1.57e-4, 0.79), "10030"),
    ] {
        built(&moved(shape, good.0, good.1));
        let wanted = format!(
            "scene.toml:20:8: collider[0].key[1].turn: from key 0 to key 1 the surface of collider 'it' has up to {told} m/s \
             where particles can meet it; allowed: at most 10000 m/s"
        );
        let found = message(&moved(shape, bad.0, bad.1));
        assert!(found.starts_with(&wanted), "\nwanted {wanted}\nfound  {found}");
    }
}

#[test]
fn a_scene_made_by_a_program_is_checked_too() {
    let refused = |spoil: fn(&mut ColliderKey)| {
        let mut scene = scene(&with(BALL, KEYS));
        spoil(&mut scene.colliders[0].keys[1]);
        scene.build(&NoMeshes, &SceneLimits::default()).expect_err("it does not fit").to_string()
    };
    assert!(refused(|key| key.position[2] = f64::NAN).contains("collider[0].key[1].position[2]: is nan"));
    assert!(refused(|key| key.turn[0] = f64::INFINITY).contains("collider[0].key[1].turn[0]: is inf"));
    assert!(refused(|key| key.turn = [0.0; 4]).contains("collider[0].key[1].turn: is zero"));
    assert!(refused(|key| key.time = 0.0).contains("collider[0].key[1].time: is 0: times grow"));
}

#[test]
fn as_many_keys_as_are_allowed_are_read_and_one_more_is_refused() {
    let keys = |count: usize| {
        let keys: Vec<String> = (0..count).map(|i| key(i as f64, [0.0, 50.0, 0.0], NO_TURN)).collect();
        with(BALL, &keys.concat())
    };
    let most = ColliderKey::MOST;
    assert_eq!(collider(&keys(most)).way.map(|way| way.keys.len()), Some(most));
    let errors = build(&keys(most + 1)).expect_err("one too many");
    assert_eq!(errors.first().kind, ErrorKind::OutOfRange);
    let wanted =
        format!("collider[0].key: is {} tables; allowed: an array of tables, at most {most}", most + 1);
    assert!(errors.to_string().contains(&wanted), "{errors}");
}

#[test]
fn keys_count_in_the_size_of_a_scene() {
    let size = |text: &str| scene(text).size(&NoMeshes);
    let (none, two) = (size(&with(BALL, "")), size(&with(BALL, KEYS)));
    let keys = two.collider_bytes - none.collider_bytes;
    assert!(keys >= 2 * size_of::<PoseKey>() as u64, "{keys} bytes");
    assert_eq!(SceneSize { collider_bytes: none.collider_bytes, ..two }, none);
}

#[test]
fn a_value_of_a_key_is_put_where_its_name_leads() {
    let read = scene(&with(BALL, KEYS));
    let put = |name: &str, value: &str| {
        read.with_values(&[(name.to_owned(), value.to_owned())]).map_err(|error| error.to_string())
    };
    let edited = put("collider.it.key.1.position.1", "47.5").expect("a value");
    assert_eq!(edited.colliders[0].keys[1].position, [0.0, 47.5, 0.0]);
    assert_eq!(
        put("collider.it.key.0.turn", "[0, 1, 0, 0]").expect("an array").colliders[0].keys[0].turn[1],
        1.0
    );
    let one = put("collider.it.key", "[{ time = 1, position = [0, 50, 0] }]").expect("a list");
    assert_eq!(one.colliders[0].keys, [ColliderKey { time: 1.0, position: [0.0, 50.0, 0.0], turn: NO_TURN }]);
    let error = put("collider.it.key.0.turn", "[0, 0, 1]").expect_err("three numbers");
    assert!(error.contains("four numbers"), "{error}");
}

/// Shapes far above the sheet, and the point (m) by which a key places each.
const REFERENCES: [(&str, [f64; 3]); 7] = [
    ("sphere = { center = [1, 50, -2], radius = 0.5 }", [1.0, 50.0, -2.0]),
    (
        "box = { center = [1, 50, -2], size = [1, 2, 3], rotate = { axis = [1, 1, 0], degrees = 40 } }",
        [1.0, 50.0, -2.0],
    ),
    ("capsule = { start = [0, 50, 1], end = [2, 52, -1], radius = 0.5 }", [1.0, 51.0, 0.0]),
    ("cylinder = { start = [0, 50, 1], end = [2, 52, -1], radius = 0.5 }", [1.0, 51.0, 0.0]),
    ("plane = { point = [3, 50, 1], normal = [1, -2, 0.5] }", [3.0, 50.0, 1.0]),
    ("half_pipe = { point = [3, -60, 1], axis = [0, 0, 1], up = [0, 1, 0], radius = 2 }", [3.0, -60.0, 1.0]),
    (
        "mesh = { upload = \"torus\", transform = { scale = 2, rotate = { axis = [1, 0, 2], degrees = 30 }, \
         translate = [1, 50, -2] } }",
        [1.0, 50.0, -2.0],
    ),
];

#[test]
fn a_key_places_the_point_of_reference_of_every_shape_and_turns_about_it() {
    // A third of a turn about (1, 1, 1): x becomes y, y becomes z, z becomes x.
    let (shift, turn) = ([0.25, -1.5, 3.0], [0.5, 0.5, 0.5, 0.5]);
    for (shape, reference) in REFERENCES {
        let plain = collider(&with(shape, ""));
        let place = [0, 1, 2].map(|c| reference[c] + shift[c]);
        let moved = collider(&with(shape, &key(0.0, place, turn)));
        for from in [[0.3, 0.1, -0.7], [1.5, -2.0, 0.25], [-4.0, 3.0, 9.0], [0.01, 0.2, 0.0]] {
            let turned = [from[2], from[0], from[1]];
            let [before, after] = [
                plain.distance([0, 1, 2].map(|c| reference[c] + from[c]), 0.0),
                moved.distance([0, 1, 2].map(|c| place[c] + turned[c]), 0.0),
            ];
            assert!((before.0 - after.0).abs() < 1e-12, "{shape} {from:?}: {} and {}", before.0, after.0);
            let normal = [before.1[2], before.1[0], before.1[1]];
            for c in 0..3 {
                assert!(
                    (normal[c] - after.1[c]).abs() < 1e-9,
                    "{shape} {from:?}: {normal:?} and {:?}",
                    after.1
                );
            }
        }
    }
}

#[test]
fn what_begins_inside_is_seen_where_the_keys_have_the_collider_at_time_0() {
    // Far above as it is written, and around the sheet by its first key, before which it rests.
    let around = key(1.0, [0.1, 0.0, 0.1], NO_TURN) + &key(2.0, [0.1, 50.0, 0.1], NO_TURN);
    let told = built(&with(BALL, &around)).warnings;
    assert_eq!(told.len(), 1, "{told:?}");
    let wanted = "body 'b': 9 of its 9 particles begin inside collider 'it', particle 4 deepest, by 1 m: ";
    assert!(told[0].starts_with(wanted), "{told:?}");

    // The other way round nothing is inside.
    let near = BALL.replace("50", "0");
    assert_eq!(built(&with(&near, "")).warnings.len(), 1);
    let away = key(0.0, [0.1, 50.0, 0.1], NO_TURN) + &key(1.0, [0.1, 0.0, 0.1], NO_TURN);
    assert!(built(&with(&near, &away)).warnings.is_empty());
}

#[test]
fn cloth_is_lifted_out_of_a_box_as_its_key_turns_it() {
    // A bar along x, which lies along z after a quarter turn about y.
    let bar = "box = { center = [0.1, 50, 0.1], size = [1, 0.04, 0.1] }\non_start_inside = \"lift\"";
    let flat = TriangleMesh::grid(3, 3, 0.1).points;
    for (turn, inside) in [(NO_TURN, [3, 4, 5]), ([0.0, 1.0, 0.0, 1.0], [1, 4, 7])] {
        let built = built(&with(bar, &key(0.0, [0.1, 0.0, 0.1], turn)));
        assert!(built.warnings[0].contains("3 of its 9 particles begin inside"), "{:?}", built.warnings);
        for (i, place) in built.setup.bodies[0].network.x.iter().enumerate() {
            let way = [0, 1, 2].map(|c| (place[c] - flat[i][c]).abs());
            let height = if inside.contains(&i) { 0.02 } else { 0.0 };
            assert!((way[1] - height).abs() < 1e-9, "particle {i} turned by {turn:?}: {place:?}");
            assert!(way[0] < 1e-9 && way[2] < 1e-9, "particle {i} turned by {turn:?}: {place:?}");
        }
    }
}

#[test]
fn snow_is_left_out_where_the_keys_have_the_collider_at_time_0() {
    let snow = "version = 1\ndt = 0.001\n[snow]\ncell = 0.05\n[[snow.object]]\nname = \"pack\"\n\
        box = { min = [-0.2, -0.2, -0.2], max = [0.2, 0.2, 0.2] }\nsampling = \"lattice\"\nparticles_per_cell = 1\n";
    let floor = "[[collider]]\nname = \"it\"\nplane = { point = [0, -9, 0], normal = [0, 1, 0] }\non_start_inside = \"lift\"\n";
    let heights = |keys: &str| {
        let snow = built(&format!("{snow}{floor}{keys}")).setup.snow.expect("snow");
        snow.objects[0].x.iter().map(|place| place[1]).collect::<Vec<f64>>()
    };
    let (all, upper) = (heights(""), heights(&key(0.0, [0.0; 3], NO_TURN)));
    assert_eq!(upper.len(), all.len() / 2);
    assert!(upper.iter().all(|y| *y > 0.0));
    // Upside down the ground is above.
    let lower = heights(&key(0.0, [0.0; 3], [1.0, 0.0, 0.0, 0.0]));
    assert_eq!(lower.len(), all.len() / 2);
    assert!(lower.iter().all(|y| *y < 0.0));
}

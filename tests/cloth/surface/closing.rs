//! A box of pins that closes further than cloth yields ends with CONTACT, and leaves the state as it was.

use nappe_sim::{cloth::Network, math::Precision, report::StepFailure, world::Change};
use nappe_tests::{
    meshes::box12,
    networks::particles,
    scene::positions,
    sheets::{Sheet, together},
    surface::{DT, Watched, scene},
};

/// Particles along a side of the sheet, and from one to the next (m).
const SIDE: usize = 10;
const SPACING: f64 = 0.02;

/// Half of an edge (m) of the box at its start.
const HALF: f64 = 0.12;

/// Steps in which it closes to a point, if it may.
const STEPS: u64 = 200;

/// A sheet with a box of pins around it: its last eight particles.
fn boxed() -> Network {
    let surface = box12([0.0; 3], [HALF; 3]);
    let mut walls = particles(&surface.points, 1.0);
    walls.triangles.clone_from(&surface.triangles);
    walls.pins = (0..surface.points.len() as u32).collect();
    let sheet = Sheet { ripple: 5e-4, ..Sheet::level(SIDE, SPACING, [0.0; 3], 0.1) };
    together(&[sheet.network(), walls])
}

/// Sends the corners of the box to so many times where they were at the start, within a time (s).
fn send(watched: &mut Watched, network: &Network, scale: f64, duration: f64) {
    let changes: Vec<Change> = network
        .pins
        .iter()
        .map(|pin| {
            let target = network.x[*pin as usize].map(|x| scale * x);
            Change::Pin { particle: *pin, target, duration }
        })
        .collect();
    watched.simulation.apply(&changes).unwrap_or_else(|error| panic!("refused: {error}"));
}

/// Half of an edge (m) of the box now, and the largest coordinate (m) of the sheet.
fn sizes(watched: &Watched) -> [f64; 2] {
    let x = positions(&watched.simulation);
    let largest = |part: &[[f64; 3]]| part.as_flattened().iter().fold(0.0_f64, |most, c| most.max(c.abs()));
    let (sheet, walls) = x.split_at(SIDE * SIDE);
    [largest(walls), largest(sheet)]
}

#[test]
fn a_box_of_pins_that_closes_too_far_ends_with_contact_and_leaves_the_state_as_it_was() {
    for precision in Precision::ALL {
        let network = boxed();
        let scene = scene(network.clone(), 2e-3, 0.0).under([0.0; 3]);
        let mut watched = Watched::new(&scene, precision);
        send(&mut watched, &network, 0.0, STEPS as f64 * DT);
        let (before, error) = loop {
            assert!(watched.tally.steps < STEPS, "{precision}: the box closed: {:?}", watched.tally);
            let before = (watched.simulation.state_hash(), positions(&watched.simulation));
            if let Err(error) = watched.step() {
                break (before, error);
            }
        };

        assert_eq!(error.failure.reason(), "CONTACT");
        let count = network.x.len() as u64;
        match error.failure {
            StepFailure::Contact { particles: [first, second], gap, driven } => {
                let is_of_box = |pin: u64| (count - 8..count).contains(&pin);
                assert!(driven.is_some_and(is_of_box), "{precision}: {error}");
                assert!(first < count && second < count && first != second, "{precision}: {error}");
                assert!((0.0..2e-3).contains(&gap), "{precision}: {gap} m");
            }
            StepFailure::Crowded { particle, .. } => assert!(particle < count, "{precision}: {error}"),
            _ => panic!("{precision}: {error}"),
        }
        let after = (watched.simulation.state_hash(), positions(&watched.simulation));
        assert_eq!(after, before, "{precision}: {error}");
        let tally = watched.tally;
        assert_eq!([tally.crossings, tally.seen], [0, 0], "{precision}: {tally:?}");

        // The sheet was wider than the box is now: it had to yield, and is inside.
        let [walls, sheet] = sizes(&watched);
        assert!(walls < 0.45 * SPACING * SIDE as f64, "{precision}: {walls} m");
        assert!(sheet < walls, "{precision}: the sheet reaches to {sheet} m of {walls} m");

        send(&mut watched, &network, 1.0, 0.5);
        watched.go(20);
        assert_eq!([watched.tally.crossings, watched.tally.seen], [0, 0], "{precision}, after it opens");
    }
}

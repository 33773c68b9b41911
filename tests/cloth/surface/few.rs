//! A few particles, which one rule each of the contact of cloth keeps where they belong.

use nappe_sim::{
    cloth::{Network, SurfaceSettings},
    linalg::Stop,
    math::Precision,
    report::StepFailure,
    world::Change,
};
use nappe_tests::{
    Scene,
    networks::{particles, spring},
    scene::{advance, positions, try_advance},
    sheets::{Sheet, together},
    surface::{DT, GRAVITY, scene},
};

/// What surfaces keep (m).
const THICKNESS: f64 = 2e-3;

/// A scene without gravity and friction.
fn weightless(network: Network) -> Scene {
    scene(network, THICKNESS, 0.0).under([0.0; 3])
}

/// A triangle of particles of 0.1 g that no spring joins.
fn triangle(corners: [[f64; 3]; 3]) -> Network {
    Network { triangles: vec![[0, 1, 2]], ..particles(&corners, 1e-4) }
}

/// The same with all particles pinned.
fn pinned(mut network: Network) -> Network {
    network.pins = (0..network.x.len() as u32).collect();
    network
}

/// A level triangle at a height (m) over the middle of a level sheet of pins, its particles the first three; all is so far (m)
/// from the origin.
fn over_pins(height: f64, away: f64) -> Network {
    let corners = [[-0.013, -0.011], [0.018, -0.009], [0.001, 0.019]];
    let upper = triangle(corners.map(|[x, z]| [away + x, height, z]));
    together(&[upper, pinned(Sheet::level(8, 0.02, [away, 0.0, 0.0], 0.0).network())])
}

#[test]
fn what_rounding_cannot_tell_apart_is_refused_before_it_moves() {
    // A kilometre away 64 roundings are 3.8 mm in binary32, and nothing in binary64.
    for (precision, is_told) in [(Precision::F32, false), (Precision::F64, true)] {
        let mut simulation = weightless(over_pins(1.5e-3, 1e3)).simulate(precision);
        let before = positions(&simulation);
        match try_advance(&mut simulation, 1) {
            Ok(_) => assert!(is_told, "{precision}: it is nearer than that"),
            Err(error) => {
                assert!(!is_told && error.failure.reason() == "CONTACT", "{precision}: {error}");
                assert_eq!(positions(&simulation), before, "{precision}");
            }
        }
    }
}

#[test]
fn what_springs_pull_where_no_pair_was_looked_for_does_not_pass_a_sheet() {
    // It stands, so that nothing is near its expected way; the springs lead 19 mm down within a step.
    let mut network = over_pins(5e-3, 0.0);
    let first = network.x.len() as u32;
    let anchors: Vec<[f64; 3]> = network.x[..3].iter().map(|[x, _, z]| [*x, -0.02, *z]).collect();
    network = together(&[network, pinned(particles(&anchors, 1e-4))]);
    network.springs.extend((0..3).map(|i| spring([i, first + i], 1e-3, 16.0, 0.0)));
    let scene = weightless(network);
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        for step in 1..=10 {
            advance(&mut simulation, 1);
            let x = positions(&simulation);
            assert!(x[..3].iter().all(|x| x[1] > 0.0), "{precision}, step {step}: {:?}", &x[..3]);
        }
    }
}

#[test]
fn a_corner_that_folds_onto_the_triangle_beside_it_does_not_pass_it() {
    let spacing = 0.02;
    let corners = [[0.0; 3], [spacing, 0.0, 0.0], [0.0, 0.0, spacing], [spacing, 0.0, spacing]];
    let mut flat = particles(&corners, 1e-4);
    flat.triangles = vec![[0, 1, 2], [1, 3, 2]];
    flat.pins = vec![1, 2, 3];
    let scene = weightless(flat.clone());
    let mut folded = flat.x;
    folded[0] = [0.8 * spacing, 3e-3, 0.8 * spacing];
    let mut v = vec![[0.0; 3]; 4];
    // As slowly as this no corner goes farther beside another than triangles lie apart on a flat sheet.
    v[0] = [0.0, -0.3, 0.0];
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        let state = Change::State {
            body: "body".to_owned(),
            positions: folded.clone().into(),
            velocities: Some(v.clone().into()),
        };
        simulation.apply(&[state]).expect("a fair state");
        for step in 1..=10 {
            advance(&mut simulation, 1);
            let height = positions(&simulation)[0][1];
            assert!(height > 0.5 * THICKNESS, "{precision}, step {step}: {height} m");
        }
    }
}

/// A pinned triangle with one corner at a place (m) over a level one, or below it, and its others 3 cm farther away.
fn spike([x, y, z]: [f64; 3]) -> Network {
    let far = y + 0.03 * y.signum();
    pinned(triangle([[x, y, z], [x - 4e-3, far, z], [x + 4e-3, far, z]]))
}

#[test]
fn pairs_that_take_turns_at_pushing_settle_and_none_pulls_what_it_should_push() {
    let side = 0.06;
    let mut plate = triangle([[0.0; 3], [side, 0.0, 0.0], [0.0, 0.0, side]]);
    plate.masses = vec![2e-3, 1e-4, 5e-4];
    // Ways of a step, and gaps, as shares of the thickness.
    for (v, share) in plate.v.iter_mut().zip([0.4, -0.1, -0.1]) {
        v[1] = share * THICKNESS / DT;
    }
    let mut parts = vec![plate];
    let spikes = [([0.7, 0.15], 0.95), ([0.3, 0.4], 0.8), ([0.15, 0.6], -0.8), ([0.15, 0.35], 0.9)];
    for ([along, across], gap) in spikes {
        parts.push(spike([along * side, gap * THICKNESS, across * side]));
    }
    let mut scene = weightless(together(&parts));
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 3000 };

    // The second spike and the last one take turns: whichever pushes makes the other one pull. A pair that is left to pull presses the plate
    // onto the others, by seven times the energy that it has.
    let mut simulation = scene.simulate(Precision::F64);
    let start = simulation.diagnose().total_energy();
    let report = advance(&mut simulation, 1);
    assert_eq!(report.cloth.expect("there is cloth").rejected, 0);
    let told = report.surface.expect("it has a thickness");
    assert!(told.least_gap > 0.6 * THICKNESS, "{told:?}");
    // What is given back of the thickness goes at its own pace.
    let mass: f64 = scene.network.masses[..3].iter().sum();
    let given = 0.5 * mass * SurfaceSettings::DEFAULT_RECOVERY.powi(2);
    let energy = simulation.diagnose().total_energy();
    assert!(energy < start + given, "{energy} J after {start} J");
}

#[test]
fn a_corner_between_pins_does_not_fly_off_to_give_back_what_only_they_could() {
    // The spike stands over the edge of pins, where the third corner has a hundredth of the weight.
    let side = 0.01;
    let mut plate = triangle([[0.0; 3], [side, 0.0, 0.0], [0.0, 0.0, side]]);
    plate.pins = vec![0, 1];
    let gap = 0.5 * THICKNESS;
    let scene = weightless(together(&[plate, spike([0.5 * side, gap, 0.01 * side])]));
    for precision in Precision::ALL {
        let mut simulation = scene.simulate(precision);
        let told = advance(&mut simulation, 1).surface.expect("it has a thickness");
        assert_eq!(told.pairs, 1, "{precision}: {told:?}");
        let way = -positions(&simulation)[2][1];
        // Three times what may be given back in the step; a hundred times would be alone.
        let most = 3.0 * SurfaceSettings::DEFAULT_RECOVERY * DT;
        assert!(way > 0.1 * most && way < 1.01 * most, "{precision}: {way} m down, at most {most} m");
    }
}

#[test]
fn a_pair_at_rest_lies_as_deep_as_what_it_carries_over_its_stiffness() {
    // A corner that hangs on nothing, over a triangle of pins.
    let mut tip = triangle([[1e-3, THICKNESS, 2e-3], [0.0, 0.03, 0.0], [4e-3, 0.03, 0.0]]);
    tip.pins = vec![1, 2];
    let table = pinned(triangle([[-0.04, 0.0, -0.03], [0.04, 0.0, -0.03], [0.0, 0.0, 0.04]]));
    let network = together(&[tip, table]);
    for dt in [0.02, 5e-3, 1e-3] {
        let mut scene = scene(network.clone(), THICKNESS, 0.0);
        scene.dt = dt;
        let mut simulation = scene.simulate(Precision::F64);
        let told = advance(&mut simulation, 50).surface.expect("it has a thickness");
        let lost = THICKNESS - positions(&simulation)[0][1];
        let expected = GRAVITY * dt * dt / 100.0;
        assert!((lost / expected - 1.0).abs() < 1e-6, "steps of {dt} s: {lost} m, not {expected}");
        let weight = 1e-4 * GRAVITY;
        assert!((told.largest_push / weight - 1.0).abs() < 1e-5, "steps of {dt} s: {told:?}, not {weight} N");
    }
}

#[test]
fn too_many_pairs_at_one_place_are_told_as_such() {
    // All lie within one thickness: each triangle meets parts of a hundred sheets.
    let thickness = 4e-3;
    let sheet = |layer: u32| Sheet::level(5, 0.01, [0.0, 4e-5 * f64::from(layer), 0.0], 0.0).network();
    let sheets: Vec<Network> = (0..100).map(sheet).collect();
    let mut simulation = scene(together(&sheets), thickness, 0.0).under([0.0; 3]).simulate(Precision::F64);
    let before = simulation.state_hash();
    let error = try_advance(&mut simulation, 1).expect_err("they are too many");
    let StepFailure::Crowded { particle, limit } = error.failure else { panic!("{error}") };
    assert!(particle < 2500 && limit > 0, "{error}");
    assert_eq!((error.failure.reason(), error.failure.value()), ("CONTACT", None));
    assert!(!error.to_string().contains("come to"), "{error}");
    assert_eq!(simulation.state_hash(), before);
}

//! Calls that name one of several bodies with a thickness change that one alone.

use nappe_sim::{
    cloth::{Air, Network, SpringKind},
    linalg::Stop,
    math::Precision,
    world::{BodySetup, Change, ChangeError, Forces, Simulation, SpringRange, TimedForce, WorldSetup},
};
use nappe_tests::{
    scene::{advance, max_distance, positions, velocities},
    sheets::Sheet,
    surface::{DT, built, of_bodies, scene},
};

/// Particles of a body, and of the one between that has no thickness.
const COUNT: usize = 25;

/// Three sheets a metre apart without gravity, solved to rounding: the second one has no thickness, the others have pins in a
/// corner.
fn apart() -> WorldSetup {
    let mut scene = scene(Network::default(), 0.0, 0.3).under([0.0; 3]);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 3000 };
    let sheet = |x: f64| {
        let mut network = Sheet::level(5, 0.02, [x, 0.0, 0.0], 0.0).network();
        network.pins = vec![0];
        network
    };
    of_bodies(&scene, vec![("one", sheet(0.0), 2e-3), ("thin", sheet(1.0), 0.0), ("other", sheet(2.0), 2e-3)])
}

fn simulation() -> Simulation {
    built(&apart(), Precision::F64)
}

/// The first particle of the last body.
const OTHER: usize = 2 * COUNT;

/// How far (m) particles of each body are from where they began, at most.
fn moved(simulation: &Simulation) -> [f64; 3] {
    let (now, start) = (positions(simulation), positions(&self::simulation()));
    [0, 1, 2].map(|body: usize| {
        let own = body * COUNT..(body + 1) * COUNT;
        max_distance(&now[own.clone()], &start[own])
    })
}

#[test]
fn springs_of_one_body_change_alone_and_a_kind_alone() {
    let mut simulation = simulation();
    let before = simulation.parameters();
    let change = |body: Option<&str>, kind, stiffness| Change::Springs {
        body: body.map(str::to_owned),
        kind,
        stiffness: Some(stiffness),
        damping: None,
    };
    simulation.apply(&[change(Some("other"), Some(SpringKind::Shear), 17.0)]).expect("fair springs");
    let after = simulation.parameters();
    assert_eq!(after.cloths[..2], before.cloths[..2]);
    let stiffness = |range: &SpringRange| (range.kind, range.stiffness);
    let found: Vec<_> = after.cloths[2].springs.iter().map(stiffness).collect();
    let expected =
        [(SpringKind::Stretch, [250.0; 2]), (SpringKind::Shear, [17.0; 2]), (SpringKind::Bend, [6.0; 2])];
    assert_eq!(found, expected);

    simulation.apply(&[change(None, None, 3.0)]).expect("fair springs");
    let all = simulation.parameters().cloths;
    assert!(all.iter().flat_map(|cloth| &cloth.springs).all(|range| range.stiffness == [3.0; 2]), "{all:?}");
}

#[test]
fn springs_that_changed_act_as_springs_that_were_always_so() {
    let mut setup = apart();
    setup.gravity = [0.0, -9.81, 0.0];
    let mut changed = built(&setup, Precision::F64);
    let softer =
        Change::Springs { body: Some("other".to_owned()), kind: None, stiffness: Some(20.0), damping: None };
    changed.apply(&[softer]).expect("fair springs");
    for spring in &mut setup.bodies[2].network.springs {
        spring.law.stiffness = 20.0;
    }
    let mut always = built(&setup, Precision::F64);
    advance(&mut changed, 30);
    advance(&mut always, 30);
    let distance = max_distance(&positions(&changed), &positions(&always));
    assert!(distance < 1e-9, "{distance:e} m");
}

#[test]
fn forces_act_on_the_body_that_they_name() {
    let call = |particles: &[u32], forces: Forces| Change::Force {
        body: "other".to_owned(),
        particles: particles.into(),
        forces,
    };
    let each: Vec<[f64; 3]> = (0..COUNT).map(|i| [0.0, 1e-5 * i as f64, 0.0]).collect();
    for change in [call(&[24], Forces::One([0.0, 1e-3, 0.0])), call(&[], Forces::Each(each.into()))] {
        let mut simulation = simulation();
        simulation.apply(&[change]).expect("fair forces");
        advance(&mut simulation, 1);
        let v = velocities(&simulation);
        assert!(v[OTHER + 24][1] > 1e-3, "{:?}", v[OTHER + 24]);
        assert_eq!(v[OTHER], [0.0; 3], "it is pinned");
        advance(&mut simulation, 19);
        let moved = moved(&simulation);
        assert!(moved[0] < 1e-9 && moved[1] < 1e-9 && moved[2] > 1e-3, "{moved:?}");
    }
    let mut refusing = simulation();
    let pinned = refusing.apply(&[call(&[0], Forces::One([1.0; 3]))]);
    assert!(matches!(pinned, Err(ChangeError::ForceOnPin { particle: 0, .. })), "{pinned:?}");
}

#[test]
fn forces_of_a_scene_act_on_their_body() {
    let force = TimedForce { particles: vec![24], force: [0.0, 1e-3, 0.0], from: 0.0, until: f64::INFINITY };
    let with = |force: TimedForce| {
        let mut setup = apart();
        let body = setup.bodies[2].clone();
        setup.bodies[2] = BodySetup { forces: vec![force], ..body };
        setup
    };
    let mut simulation = built(&with(force.clone()), Precision::F64);
    advance(&mut simulation, 20);
    let moved = moved(&simulation);
    assert!(moved[0] < 1e-9 && moved[1] < 1e-9 && moved[2] > 1e-3, "{moved:?}");

    for (particles, told) in
        [(vec![0], "pinned"), (vec![25], "there are 25"), (vec![u32::MAX], "there are 25")]
    {
        let wrong = TimedForce { particles, ..force.clone() };
        let error = Simulation::new(&with(wrong), Precision::F64).expect_err("refused").to_string();
        assert!(error.contains("'other'") && error.contains(told), "{error}");
    }
}

#[test]
fn a_state_of_one_body_leaves_the_others_and_their_pins_on_their_way() {
    let mut simulation = simulation();
    let to = |particle: u32, target: [f64; 3]| Change::Pin { particle, target, duration: 20.0 * DT };
    let start = positions(&simulation);
    let target = [0, OTHER].map(|pin| {
        let [x, y, z] = start[pin];
        [x, y + 0.01, z]
    });
    simulation.apply(&[to(0, target[0]), to(OTHER as u32, target[1])]).expect("both are pins");
    advance(&mut simulation, 10);

    let (x, v) = (positions(&simulation), velocities(&simulation));
    let placed: Vec<[f64; 3]> = start[OTHER..].iter().map(|[x, y, z]| [*x, y + 0.5, *z]).collect();
    let thrown = vec![[0.0, 0.25, 0.0]; COUNT];
    let state = Change::State {
        body: "other".to_owned(),
        positions: placed.clone().into(),
        velocities: Some(thrown.clone().into()),
    };
    simulation.apply(&[state]).expect("a fair state");
    let (after, speeds) = (positions(&simulation), velocities(&simulation));
    assert_eq!(after[..OTHER], x[..OTHER]);
    assert_eq!(speeds[..OTHER], v[..OTHER]);
    assert_eq!(after[OTHER..], placed);
    assert_eq!(speeds[OTHER + 1..], thrown[1..]);
    assert_eq!(speeds[OTHER], [0.0; 3], "it is pinned");

    advance(&mut simulation, 15);
    let end = positions(&simulation);
    assert!(max_distance(&end[..1], &target[..1]) < 1e-12, "{:?}, not {:?}", end[0], target[0]);
    assert_eq!(end[OTHER], placed[0], "its way is forgotten");

    simulation.apply(&[Change::Reset]).expect("a reset");
    assert_eq!(positions(&simulation), start);
}

#[test]
fn a_pin_is_named_by_its_number_over_all_bodies() {
    let mut simulation = simulation();
    let to = |particle: usize| Change::Pin { particle: particle as u32, target: [0.1; 3], duration: DT };
    for free in [1, COUNT + 1, OTHER + 1, OTHER + COUNT - 1] {
        let refused = simulation.apply(&[to(free)]);
        assert!(matches!(refused, Err(ChangeError::NotPinned { .. })), "{refused:?}");
    }
    for (number, pin) in [0, COUNT, OTHER].into_iter().enumerate() {
        let mut simulation = self::simulation();
        let [x, y, z] = positions(&simulation)[pin];
        let target = [x, y + 5e-3, z];
        let sent = Change::Pin { particle: pin as u32, target, duration: 20.0 * DT };
        simulation.apply(&[sent]).expect("a pin");
        advance(&mut simulation, 20);
        assert_eq!(positions(&simulation)[pin], target);
        for (body, moved) in moved(&simulation).into_iter().enumerate() {
            assert_eq!(moved > 1e-9, body == number, "pin {pin}: body {body} moves by {moved} m");
        }
    }
}

#[test]
fn bodies_share_their_air() {
    let mut setup = apart();
    for body in &mut setup.bodies {
        body.network.air = Some(Air::default());
    }
    let mut simulation = built(&setup, Precision::F64);
    let denser = |body: Option<&str>| Change::Air {
        body: body.map(str::to_owned),
        density: Some(2.5),
        normal: None,
        lift: None,
        tangential: None,
    };
    let refused = simulation.apply(&[denser(Some("other"))]).expect_err("it shares its air");
    let told = ChangeError::SharedAir { body: "other".to_owned(), others: "one".to_owned() };
    assert_eq!(refused, told);
    simulation.apply(&[denser(Some("thin"))]).expect("it has air of its own");
    let densities = |simulation: &Simulation| {
        let cloths = simulation.parameters().cloths;
        cloths.iter().map(|cloth| cloth.air.expect("all feel it").density).collect::<Vec<_>>()
    };
    let still = Air::default().density;
    assert_eq!(densities(&simulation), [still, 2.5, still]);
    simulation.apply(&[denser(None)]).expect("all of them");
    assert_eq!(densities(&simulation), [2.5; 3]);
}

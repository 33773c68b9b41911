//! Several bodies with a thickness meet each other, as sheets of one mesh do, and keep their numbers.

use nappe_sim::{
    cloth::Network,
    linalg::Stop,
    math::Precision,
    report::StepFailure,
    world::{Change, Simulation, WorldSetup},
};
use nappe_tests::{
    Scene,
    meshes::box12,
    networks::particles,
    scene::{advance, difference, momenta, norm, positions, velocities},
    sheets::{Sheet, together},
    surface::{Case, DT, Watched, bodies_on_a_ball, built, floor, of_bodies, scene},
};

const SIDE: usize = 12;

/// Speed (m/s) at which one body comes to the other.
const SPEED: f64 = 5.0;

/// A sheet at a height (m), which no other one lies exactly above.
fn level(side: usize, height: f64) -> Network {
    let middle = [0.05 * height, height, 0.03 * height];
    Sheet { ripple: 2e-4, ..Sheet::level(side, 0.02, middle, 3.0 * height) }.network()
}

/// A scene without a body, with so much friction of cloth.
fn empty(friction: f64) -> Scene {
    scene(Network::default(), 0.0, friction)
}

#[test]
fn two_bodies_that_meet_keep_their_momentum_and_do_not_cross() {
    let mut scene = empty(0.0).under([0.0; 3]);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 3000 };
    let sheet = |middle: [f64; 3], turn: f64| {
        Sheet { ripple: 2e-4, ..Sheet::level(SIDE, 0.02, middle, turn) }.network()
    };
    let [mut flying, standing] = [sheet([0.0; 3], 0.0), sheet([0.003, 0.06, 0.002], 0.2)];
    flying.v.fill([0.0, SPEED, 0.0]);
    let masses = [&flying.masses[..], &standing.masses[..]].concat();
    let setup = of_bodies(&scene, vec![("flying", flying, 2e-3), ("standing", standing, 2e-3)]);
    let mut watched = Watched::of_world(&setup, Precision::F64);
    let start = watched.simulation.diagnose().total_energy();
    let (before, _) = momenta(&watched.simulation, &masses);
    for step in 1..=40 {
        watched.go(1);
        let (after, _) = momenta(&watched.simulation, &masses);
        let off = norm(difference(after, before)) / norm(before);
        assert!(off < 1e-10, "step {step}: off by {off:e} of the momentum");
    }
    assert_eq!(watched.tally.complaint(), None);
    assert!(watched.tally.energy < 1.001 * start, "{} J of {start} J", watched.tally.energy);
    let v = velocities(&watched.simulation);
    let upward = v[SIDE * SIDE..].iter().map(|v| v[1]).sum::<f64>() / (SIDE * SIDE) as f64;
    assert!(upward > 0.4 * SPEED, "the standing body goes at {upward} m/s");
}

#[test]
fn bodies_without_a_thickness_pass_through_those_that_have_one() {
    let [mut flying, standing] = [level(6, 0.0), level(6, 0.02)];
    flying.v.fill([0.0, SPEED, 0.0]);
    let setup =
        of_bodies(&empty(0.0).under([0.0; 3]), vec![("thick", flying, 2e-3), ("thin", standing, 0.0)]);
    let mut simulation = built(&setup, Precision::F64);
    advance(&mut simulation, 10);
    let x = positions(&simulation);
    assert!(x[36..].iter().all(|thin| thin[1] < 0.03) && x[..36].iter().all(|thick| thick[1] > 0.2), "{x:?}");
}

/// Particles of a sheet with springs that are so much stiffer.
fn stiffer(mut network: Network, times: f64) -> Network {
    network.springs.iter_mut().for_each(|spring| spring.law.stiffness *= times);
    network
}

#[test]
fn bodies_have_the_bits_of_their_sheets_in_one_mesh() {
    for precision in Precision::ALL {
        // Laws of the second one come after those of the first one in the order of either.
        let sheets = [level(10, 2e-3), stiffer(level(8, 6e-3), 2.0)];
        let mut mesh = scene(together(&sheets), 2e-3, 0.3);
        mesh.colliders = vec![floor(0.0, 0.3, 1e-3)];
        let [one, other] = sheets;
        let mut bodies =
            built(&of_bodies(&mesh, vec![("one", one, 2e-3), ("other", other, 2e-3)]), precision);
        let mut mesh = mesh.simulate(precision);
        let mut most = 0;
        for step in 1..=60 {
            let reports = [advance(&mut bodies, 1), advance(&mut mesh, 1)];
            let [told, expected] = reports.map(|report| report.surface);
            assert_eq!(told, expected, "{precision}, step {step}");
            most = told.map_or(0, |told| told.active).max(most);
        }
        assert!(most > 10, "{precision}: {most} pairs pushed at most");
        assert!(positions(&bodies) == positions(&mesh), "{precision}: other positions");
        assert!(velocities(&bodies) == velocities(&mesh), "{precision}: other velocities");
    }
}

/// Two bodies with a thickness, of which one falls on the other on a floor, and a body without one that hangs aside between them
/// in the list.
fn with_one_between() -> WorldSetup {
    let mut scene = empty(0.3);
    scene.colliders = vec![floor(0.0, 0.3, 1e-3)];
    let mut aside = Sheet { origin: [3.0, 1.0, 0.0], ..Sheet::upright(5, 0.02) }.network();
    aside.pins = vec![0, 4];
    let mut upper = level(8, 0.006);
    upper.pins = vec![7];
    of_bodies(&scene, vec![("lower", level(10, 2e-3), 2e-3), ("aside", aside, 0.0), ("upper", upper, 2e-3)])
}

/// The first particle of each body of that world, and one more.
const FIRST: [usize; 4] = [0, 100, 125, 189];

#[test]
fn a_thick_body_does_not_make_more_pairs_in_a_thin_one() {
    for precision in Precision::ALL {
        let thin = Sheet { origin: [0.0, 1.0, 0.0], ..Sheet::upright(20, 0.005) }.network();
        let thick = Sheet { origin: [1.0, 1.0, 0.0], ..Sheet::upright(3, 0.1) }.network();
        let setup = of_bodies(&empty(0.3), vec![("thin", thin, 2e-3), ("thick", thick, 0.04)]);
        let mut both = built(&setup, precision);
        for _ in 0..5 {
            let told = advance(&mut both, 1).surface.expect("they have a thickness");
            assert_eq!(told.pairs, 0, "{precision}");
        }
    }
}

#[test]
fn a_body_between_those_that_meet_keeps_its_numbers_and_so_do_they() {
    for precision in Precision::ALL {
        let setup = with_one_between();
        let mut all = built(&setup, precision);
        let topology = all.topology();
        assert_eq!(topology.len(), 3);
        for (number, (told, body)) in topology.iter().zip(&setup.bodies).enumerate() {
            let range = FIRST[number] as u32..FIRST[number + 1] as u32;
            assert_eq!((&told.name, told.first_particle), (&body.name, range.start));
            assert_eq!(told.particle_count, range.end - range.start, "{}", body.name);
            let corners = told.triangles.as_flattened().iter().chain(told.springs.as_flattened());
            assert!(corners.chain(&told.pins).all(|particle| range.contains(particle)), "{}", body.name);
            let network = &body.network;
            assert_eq!(told.triangles.len(), network.triangles.len(), "{}", body.name);
            assert_eq!(told.springs.len(), network.springs.len(), "{}", body.name);
            assert_eq!(told.pins.len(), network.pins.len(), "{}", body.name);
        }
        let names: Vec<_> = all.parameters().cloths.into_iter().map(|cloth| cloth.name).collect();
        assert_eq!(names, ["lower", "aside", "upper"]);

        let mut alone = setup.clone();
        let aside = alone.bodies.remove(1);
        let mut alone = built(&alone, precision);
        let mut thin = built(&WorldSetup { bodies: vec![aside], ..setup }, precision);
        for _ in 0..50 {
            for simulation in [&mut all, &mut alone, &mut thin] {
                let told = advance(simulation, 1).cloth.expect("there is cloth");
                assert_eq!((told.substeps, told.rejected), (1, 0), "{precision}: they share their sub-steps");
            }
        }
        for read in [positions, velocities] {
            let [all, alone, thin] = [&all, &alone, &thin].map(read);
            assert!(all[FIRST[1]..FIRST[2]] == thin[..], "{precision}: the body aside goes elsewhere");
            let others = [&all[..FIRST[1]], &all[FIRST[2]..]].concat();
            assert!(others == alone, "{precision}: those that meet go elsewhere");
        }
    }
}

/// What is refused of a world.
fn refused(setup: &WorldSetup) -> String {
    match Simulation::new(setup, Precision::F64) {
        Ok(_) => panic!("it is refused"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn bodies_that_begin_crossed_are_refused_with_both_names() {
    let upright = |depth: f64| {
        let sheet = Sheet::upright(3, 0.05);
        Sheet { origin: [sheet.origin[0] + 0.017, 0.1 - depth, 0.023], ..sheet }.network()
    };
    let level = || Sheet::level(4, 0.1, [0.0; 3], 0.0).network();
    let world = |depth: f64, thickness: f64| {
        let bodies =
            vec![("level", level(), 1e-3), ("between", level(), 0.0), ("upright", upright(depth), thickness)];
        of_bodies(&empty(0.0), bodies)
    };
    let error = refused(&world(1e-9, 1e-3));
    assert!(error.contains("'level'") && error.contains("'upright'") && error.contains("crosses"), "{error}");
    assert!(!error.contains("'between'"), "{error}");
    for fair in [world(-1e-9, 1e-3), world(1e-9, 0.0)] {
        built(&fair, Precision::F64);
    }

    let crossed = together(&[level(), upright(1e-9)]);
    let away = Sheet { origin: [5.0, 0.0, 0.0], ..Sheet::upright(3, 0.05) }.network();
    let error = refused(&of_bodies(&empty(0.0), vec![("away", away, 1e-3), ("crossed", crossed, 1e-3)]));
    assert!(error.contains("'crossed'") && error.contains("itself") && !error.contains("'away'"), "{error}");
}

#[test]
fn bodies_of_different_thickness_keep_the_mean_of_both() {
    let mut scene = empty(0.3);
    scene.colliders = vec![floor(0.0, 0.3, 0.5e-3)];
    let sheet = |height: f64, turn: f64| Sheet::level(10, 0.02, [0.0, height, 0.0], turn).network();
    let bodies = vec![("thin", sheet(0.6e-3, 0.0), 1e-3), ("thick", sheet(4.2e-3, 0.1), 5e-3)];
    let mut watched = Watched::of_world(&of_bodies(&scene, bodies), Precision::F64);
    watched.go(150);
    assert_eq!(watched.tally.complaint(), None);
    let x = positions(&watched.simulation);
    let thin = x[..100].iter().map(|x| x[1]).sum::<f64>() / 100.0;
    for (row, x) in x.iter().enumerate().skip(100) {
        let gap = x[1] - thin;
        assert!((2.8e-3..3.0e-3).contains(&gap), "particle {row} is {gap} m above the thin sheet, of 3 mm");
    }
}

#[test]
fn a_failure_names_particles_and_bodies_where_others_stand_between() {
    let surface = box12([0.0; 3], [0.12; 3]);
    let mut walls = particles(&surface.points, 1.0);
    walls.triangles.clone_from(&surface.triangles);
    walls.pins = (0..surface.points.len() as u32).collect();
    let corners = walls.pins.len() as u32;
    let aside = Sheet { origin: [3.0, 0.0, 0.0], ..Sheet::upright(5, 0.02) }.network();
    let sheet = Sheet { ripple: 5e-4, ..Sheet::level(10, 0.02, [0.0; 3], 0.1) }.network();
    let bodies = vec![("sheet", sheet, 2e-3), ("aside", aside, 0.0), ("walls", walls, 2e-3)];
    let setup = of_bodies(&empty(0.0).under([0.0; 3]), bodies);
    let mut watched = Watched::of_world(&setup, Precision::F64);
    let close = |pin| Change::Pin { particle: pin, target: [0.0; 3], duration: 200.0 * DT };
    let changes: Vec<Change> = (125..125 + corners).map(close).collect();
    watched.simulation.apply(&changes).expect("pins of the walls");
    let error = loop {
        assert!(watched.tally.steps < 200, "the box closed: {:?}", watched.tally);
        let before = watched.simulation.state_hash();
        if let Err(error) = watched.step() {
            assert_eq!(watched.simulation.state_hash(), before, "{error}");
            break error;
        }
    };

    let particles = match error.failure {
        StepFailure::Contact { particles, .. } => particles,
        StepFailure::Crowded { particle, .. } => [particle; 2],
        _ => panic!("{error}"),
    };
    let names = particles.map(|particle| match particle {
        0..100 => "sheet",
        100..125 => "aside",
        _ => "walls",
    });
    assert!(!names.contains(&"aside") && names[0] == error.body, "{error}: {names:?}");
    assert!(particles.iter().all(|particle| *particle < u64::from(125 + corners)), "{error}");
    assert_eq!([watched.tally.crossings, watched.tally.seen], [0, 0], "{:?}", watched.tally);
}

#[test]
fn three_bodies_that_fall_on_a_ball_cross_nowhere() {
    for case in Case::SMOOTH {
        let setup = bodies_on_a_ball(13, [0.03, 0.1], 4e-3, &case);
        let mut watched = Watched::of_world(&setup, case.precision);
        watched.go(250);
        assert_eq!(watched.tally.complaint(), None, "{case:?}");
    }
}

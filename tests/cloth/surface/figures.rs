//! Figures: frames lead their corners, cloth with a thickness meets them, and nothing else moves them.

use std::slice::from_ref;

use nappe_sim::{
    cloth::{Network, Repeat},
    math::Precision,
    mesh::TriangleMesh,
    time_step::TimeStep,
    world::{Beginning, BodyRole, Change, ChangeError, Forces, Pull, Simulation, WorldSetup},
};
use nappe_tests::{
    Scene,
    meshes::box12,
    scene::{advance, difference, norm, positions, velocities},
    sheets::{Sheet, together},
    surface::{DT, RISE, THICKNESS, Watched, built, figure, giving_way, of_bodies, scene, sheet_on_a_plate},
};

/// A scene without a body, with friction.
fn empty() -> Scene {
    scene(Network::default(), 0.0, 0.3)
}

/// A sheet of nine particles about a place (m), far from all that moves here.
fn aside() -> Network {
    Sheet::level(3, 0.05, [5.0, 0.0, 0.0], 0.0).network()
}

/// Frames of a box that turns about the vertical and goes along x.
fn walk() -> (Vec<[u32; 3]>, Vec<Vec<[f64; 3]>>) {
    let solid = box12([0.1, 0.3, 0.2], [0.2, 0.4, 0.3]);
    let frame = |number: u32| {
        let angle = 0.2 * f64::from(number);
        let (sin, cos) = angle.sin_cos();
        let turned = |[x, y, z]: &[f64; 3]| {
            let [x, y, z] = [cos * x + sin * z + 0.03 * f64::from(number), *y, cos * z - sin * x];
            // As frames have them.
            [x, y, z].map(|c| f64::from(c as f32))
        };
        solid.points.iter().map(turned).collect::<Vec<[f64; 3]>>()
    };
    let frames: Vec<Vec<[f64; 3]>> = (0..8).map(frame).collect();
    (solid.triangles, frames)
}

/// Frames in a second of a walk.
const RATE: f64 = 30.0;

/// How far (m) corners are at most from where frames have them after so many frames.
fn off(corners: &[[f64; 3]], frames: &[Vec<[f64; 3]>], passed: f64, repeat: Repeat) -> f64 {
    let count = frames.len();
    let passed = match repeat {
        Repeat::Hold => passed.min((count - 1) as f64),
        Repeat::Loop => passed - (passed / count as f64).floor() * count as f64,
    };
    let from = (passed.floor() as usize).min(count - 1);
    let to = if from + 1 < count { from + 1 } else { 0 };
    let share = passed - from as f64;
    let ways = corners.iter().enumerate().map(|(corner, place)| {
        let there =
            [0, 1, 2].map(|c| (1.0 - share) * frames[from][corner][c] + share * frames[to][corner][c]);
        norm(difference(*place, there))
    });
    ways.fold(0.0, f64::max)
}

#[test]
fn corners_are_on_their_frame_after_each_step_whatever_sub_steps_there_are() {
    let (triangles, frames) = walk();
    for precision in Precision::ALL {
        for (repeat, parts, firmness) in [
            (Repeat::Hold, 1.0, None),
            (Repeat::Loop, 1.0, None),
            (Repeat::Loop, 3.0, None),
            (Repeat::Hold, 1.0, Some(1e6)),
            (Repeat::Loop, 3.0, Some(1e3)),
        ] {
            let mut scene = empty();
            scene.settings.time_step = TimeStep::Fixed(DT / parts);
            let walker = figure(&triangles, &frames, RATE, repeat);
            let setup = of_bodies(&scene, vec![("aside", aside(), THICKNESS), ("walker", walker, THICKNESS)]);
            let setup = match firmness {
                Some(firmness) => giving_way(setup, firmness),
                None => setup,
            };
            let mut simulation = built(&setup, precision);
            let allowed = match precision {
                Precision::F64 => 1e-12,
                Precision::F32 => 1e-6,
            };
            for step in 1..=120 {
                advance(&mut simulation, 1);
                let passed = RATE * DT * f64::from(step);
                let off = off(&positions(&simulation)[9..], &frames, passed, repeat);
                assert!(off < allowed, "{precision}, {repeat:?}, step {step}: off by {off:e} m");
            }
            assert_eq!(simulation.time(), 120.0 * DT);
        }
    }
}

#[test]
fn a_figure_stands_behind_the_bodies_and_is_told_as_one() {
    let (triangles, frames) = walk();
    let walker = figure(&triangles, &frames, RATE, Repeat::Hold);
    let setup = of_bodies(&empty(), vec![("aside", aside(), THICKNESS), ("walker", walker, THICKNESS)]);
    let simulation = built(&setup, Precision::F32);
    let topology = simulation.topology();
    let told: Vec<_> =
        topology.iter().map(|body| (body.name.as_str(), body.role, body.first_particle)).collect();
    assert_eq!(told, [("aside", BodyRole::Cloth, 0), ("walker", BodyRole::Figure, 9)]);
    assert_eq!(topology[1].triangles[0], triangles[0].map(|corner| corner + 9));
    assert!(topology[1].pins.is_empty() && topology[1].masses == [0.0; 8]);
}

#[test]
fn corners_count_in_no_energy() {
    let (triangles, frames) = walk();
    let mut flying = aside();
    flying.v.fill([0.3, 2.0, 0.1]);
    let walker = figure(&triangles, &frames, RATE, Repeat::Loop);
    let both = of_bodies(&empty(), vec![("flying", flying, THICKNESS), ("walker", walker, THICKNESS)]);
    let mut alone = both.clone();
    alone.bodies.truncate(1);
    let [with, without] = [both, alone].map(|setup| {
        let mut simulation = built(&setup, Precision::F64);
        advance(&mut simulation, 5);
        simulation.diagnose()
    });
    for [with, without] in [
        [with.kinetic_energy, without.kinetic_energy],
        [with.gravitational_energy, without.gravitational_energy],
    ] {
        let off = (with - without).abs() / without.abs();
        assert!(off < 1e-9, "{with} J with a figure, {without} J without");
    }
}

#[test]
fn a_sheet_that_lies_on_a_plate_rises_with_it_and_crosses_nothing() {
    for precision in Precision::ALL {
        let mut watched = Watched::of_world(&sheet_on_a_plate(&empty()), precision);
        watched.go(200);
        assert_eq!(watched.tally.complaint(), None, "{precision}");
        let x = positions(&watched.simulation);
        for (particle, [_, height, _]) in x[..100].iter().enumerate() {
            let gap = height - RISE;
            let allowed = 0.7 * THICKNESS..1.3 * THICKNESS;
            assert!(allowed.contains(&gap), "{precision}: particle {particle} is {gap} m above the plate");
        }
    }
}

#[test]
fn a_sheet_that_falls_on_a_pyramid_crosses_none_of_its_edges() {
    let points =
        [[-0.15, 0.0, -0.15], [0.15, 0.0, -0.15], [0.15, 0.0, 0.15], [-0.15, 0.0, 0.15], [0.0, 0.12, 0.0]];
    let triangles = [[0, 4, 1], [1, 4, 2], [2, 4, 3], [3, 4, 0], [0, 1, 2], [0, 2, 3]];
    for precision in Precision::ALL {
        let pyramid = figure(&triangles, &[points.to_vec()], 1.0, Repeat::Hold);
        let sheet = Sheet::level(12, 0.05, [0.013, 0.16, 0.007], 0.3).network();
        let bodies = vec![("sheet", sheet, 4e-3), ("pyramid", pyramid, 4e-3)];
        let mut watched = Watched::of_world(&of_bodies(&empty(), bodies), precision);
        watched.go(100);
        let tally = watched.tally;
        assert_eq!([tally.crossings, tally.seen], [0, 0], "{precision}: {tally:?}");
        assert!(tally.active > 0 && tally.told == tally.steps, "{precision}: {tally:?}");
        // It hangs over the apex.
        let highest = positions(&watched.simulation)[..144].iter().map(|x| x[1]).fold(f64::MIN, f64::max);
        assert!(highest > 0.06, "{precision}: the sheet is at {highest} m at most");
    }
}

#[test]
fn figures_may_cross_themselves_and_each_other_and_no_cloth_may_cross_them_at_the_start() {
    let (triangles, frames) = walk();
    // Two boxes of one figure that go through each other, and another figure through both.
    let shifted: Vec<[f64; 3]> = frames[0].iter().map(|[x, y, z]| [x + 0.05, y + 0.07, z + 0.03]).collect();
    let double =
        [&triangles[..], &triangles.iter().map(|t| t.map(|corner| corner + 8)).collect::<Vec<_>>()].concat();
    let both = [&frames[0][..], &shifted].concat();
    let world = |sheet: Network| {
        let one = figure(&double, from_ref(&both), RATE, Repeat::Hold);
        let other = figure(&triangles, from_ref(&shifted), RATE, Repeat::Hold);
        let bodies = vec![("sheet", sheet, THICKNESS), ("one", one, THICKNESS), ("other", other, THICKNESS)];
        of_bodies(&empty(), bodies)
    };
    let setup = world(aside());
    assert!(
        together(from_ref(&setup.bodies[1].network)).crossed().is_some()
            && setup.bodies[1].network.crossed().is_none()
    );
    let mut simulation = built(&setup, Precision::F64);
    let told = advance(&mut simulation, 3).surface.expect("there is a thickness");
    assert_eq!(
        (told.crossings, told.pairs),
        (Some(0), 0),
        "what figures do among themselves is nobody's matter"
    );

    let through = Sheet::level(3, 0.2, [0.15, 0.35, 0.25], 0.1).network();
    let error = match Simulation::new(&world(through), Precision::F64) {
        Ok(_) => panic!("it is refused"),
        Err(error) => error.to_string(),
    };
    assert!(error.contains("'sheet'") && error.contains("crosses"), "{error}");
}

#[test]
fn calls_move_no_figure() {
    let (triangles, frames) = walk();
    let walker = figure(&triangles, &frames, RATE, Repeat::Hold);
    let setup = of_bodies(&empty(), vec![("aside", aside(), THICKNESS), ("walker", walker, THICKNESS)]);
    let mut simulation = built(&setup, Precision::F64);
    let body = || "walker".to_owned();
    let pull = Pull {
        body: body(),
        particles: [].into(),
        points: vec![[0.0; 3]; 8].into(),
        frequency: 1.0,
        most: 1.0,
        seconds: 1.0,
    };
    let before = simulation.state_hash();
    for change in [
        Change::State { body: body(), positions: frames[0].clone().into(), velocities: None },
        Change::Force { body: body(), particles: [].into(), forces: Forces::One([1.0; 3]) },
        Change::Pull(pull),
        Change::Pin { particle: 9, target: [0.0; 3], duration: 1.0 },
        Change::PinPath { particle: 16, points: [(1.0, [0.0; 3])].into() },
    ] {
        let error = simulation.apply(from_ref(&change)).expect_err("it is refused");
        assert!(matches!(&error, ChangeError::OnFigure { figure, .. } if figure == "walker"), "{error}");
        assert!(error.to_string().contains("'walker' is a figure"), "{error}");
        assert_eq!(simulation.state_hash(), before, "{error}");
    }
    let push =
        Change::Force { body: "aside".to_owned(), particles: [].into(), forces: Forces::One([1.0; 3]) };
    simulation.apply(&[push]).expect("forces act on cloth");
}

#[test]
fn frames_begin_again_at_a_reset() {
    for precision in Precision::ALL {
        let setup = sheet_on_a_plate(&empty());
        let [mut fresh, mut reset] = [(); 2].map(|()| built(&setup, precision));
        advance(&mut reset, 50);
        reset.apply(&[Change::Reset]).unwrap_or_else(|error| panic!("{precision}: {error}"));
        assert_eq!(positions(&reset), positions(&fresh), "{precision}");
        // Times are off by their rounding, by which a solve may end an iteration earlier or later.
        for step in 1..=60 {
            for simulation in [&mut fresh, &mut reset] {
                advance(simulation, 1);
            }
            let [here, there] = [&reset, &fresh].map(positions);
            let off = here.iter().zip(&there).map(|(one, other)| norm(difference(*one, *other)));
            let off = off.fold(0.0, f64::max);
            assert!(off < 1e-4, "{precision}, step {step}: off by {off:e} m");
        }

        // What a saved frame says of it lets another simulation go on.
        let frame = Beginning {
            step: reset.step_count(),
            positions: positions(&reset).into(),
            velocities: velocities(&reset).into(),
            numbers: Some(reset.carried().numbers),
        };
        let mut begun = built(&setup, precision);
        begun.begin(&frame).unwrap_or_else(|error| panic!("{precision}: {error}"));
        for simulation in [&mut begun, &mut reset] {
            advance(simulation, 20);
        }
        assert_eq!(begun.state_hash(), reset.state_hash(), "{precision}");
    }
}

#[test]
fn a_simulation_that_begins_in_mid_walk_goes_on_with_the_same_bits() {
    for precision in Precision::ALL {
        let setup = sheet_on_a_plate(&empty());
        let mut whole = built(&setup, precision);
        advance(&mut whole, 33);
        let frame = Beginning {
            step: whole.step_count(),
            positions: positions(&whole).into(),
            velocities: velocities(&whole).into(),
            numbers: Some(whole.carried().numbers),
        };
        let mut begun = built(&setup, precision);
        begun.begin(&frame).unwrap_or_else(|error| panic!("{precision}: {error}"));
        assert_eq!(begun.state_hash(), whole.state_hash(), "{precision}");
        for simulation in [&mut begun, &mut whole] {
            advance(simulation, 20);
        }
        assert_eq!(begun.state_hash(), whole.state_hash(), "{precision}");
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
fn figures_that_cannot_be_led_or_met_are_refused_by_name() {
    let mesh = TriangleMesh::grid(2, 2, 0.1);
    let plain = || figure(&mesh.triangles, from_ref(&mesh.points), 1.0, Repeat::Hold);
    let world = |sheet: f64, change: fn(&mut Network), thickness: f64| {
        let mut walker = plain();
        change(&mut walker);
        refused(&of_bodies(&empty(), vec![("aside", aside(), sheet), ("walker", walker, thickness)]))
    };
    let frames = |change: fn(&mut nappe_sim::cloth::Frames)| {
        let mut walker = plain();
        walker.frames.iter_mut().for_each(change);
        refused(&of_bodies(&empty(), vec![("aside", aside(), THICKNESS), ("walker", walker, THICKNESS)]))
    };
    for (told, words) in [
        (world(0.0, |_| {}, THICKNESS), "no body has a thickness"),
        (world(THICKNESS, |_| {}, 0.0), "has no thickness"),
        (world(THICKNESS, |walker| walker.masses[0] = 1.0, THICKNESS), "has a mass"),
        (frames(|frames| frames.corners = 3), "have 3 points each, and the mesh has 4"),
        (frames(|frames| frames.rate = 0.0), "a rate of 0 1/s"),
        (
            frames(|frames| frames.places = [[0.0; 3], [f32::NAN; 3], [0.0; 3], [0.0; 3]].into()),
            "frame 0, point 1",
        ),
    ] {
        assert!(told.contains("'walker'") && told.contains(words), "{told}, not {words}");
    }
}

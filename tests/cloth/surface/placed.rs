//! States that calls put: where surfaces with a thickness would cross or touch, a list of changes is refused and changes nothing.

use nappe_sim::{
    cloth::Network,
    math::Precision,
    world::{Change, ChangeError, Simulation, WorldSetup},
};
use nappe_tests::{
    crossings::crossings,
    scene::{advance, positions},
    sheets::Sheet,
    surface::{DT, built, of_bodies, scene},
};

/// Particles in a row, and distance between neighbours (m).
const SIDE: usize = 6;
const SPACING: f64 = 0.02;
/// Particles of a body.
const COUNT: usize = SIDE * SIDE;
/// What surfaces keep (m).
const THICKNESS: f64 = 2e-3;

/// A level sheet about a place (m).
fn level(middle: [f64; 3]) -> Network {
    Sheet::level(SIDE, SPACING, middle, middle[1]).network()
}

/// A level sheet and another one above it, which keep these thicknesses (m).
fn two([one, other]: [f64; 2]) -> WorldSetup {
    let scene = scene(Network::default(), 0.0, 0.3);
    of_bodies(&scene, vec![("one", level([0.0; 3]), one), ("other", level([0.003, 0.05, 0.002]), other)])
}

fn put(body: &str, places: &[[f64; 3]]) -> Change {
    Change::State { body: body.to_owned(), positions: places.to_vec().into(), velocities: None }
}

/// Where an upright sheet is that goes through the lower one.
fn through() -> Vec<[f64; 3]> {
    let upright = Sheet::upright(SIDE, SPACING);
    let [x, ..] = upright.origin;
    Sheet { origin: [x + 0.003, 0.05, 0.002], ..upright }.network().x
}

/// How many edges cross triangles with the second body at these places (m), by other arithmetic than the program's.
fn counted(setup: &WorldSetup, places: &[[f64; 3]]) -> u64 {
    let [one, other] = [0, 1].map(|body: usize| &setup.bodies[body].network);
    let moved = other.triangles.iter().map(|corners| corners.map(|corner| corner + COUNT as u32));
    let triangles: Vec<[u32; 3]> = one.triangles.iter().copied().chain(moved).collect();
    crossings(&triangles, &[&one.x[..], places].concat())
}

/// Applies changes that are refused, and gives the names of the bodies that meet, in order, and what is told.
fn refused(simulation: &mut Simulation, changes: &[Change]) -> ([String; 2], String) {
    let before = simulation.state_hash();
    let error = simulation.apply(changes).expect_err("they meet");
    assert_eq!(simulation.check(changes), Err(error.clone()));
    assert_eq!(simulation.state_hash(), before, "{error}");
    let told = error.to_string();
    let ChangeError::NotApart { bodies: [body, other], .. } = error else { panic!("{told}") };
    let mut names = [body, other];
    names.sort();
    (names, told)
}

#[test]
fn a_sheet_that_is_put_through_another_is_refused_with_both_and_nothing_has_changed() {
    let setup = two([THICKNESS; 2]);
    let count = counted(&setup, &through());
    assert!(count > 10, "{count}");
    for precision in Precision::ALL {
        let mut simulation = built(&setup, precision);
        let first = simulation.fork();
        let (names, told) = refused(&mut simulation, &[put("other", &through())]);
        assert_eq!(names, ["one", "other"], "{told}");
        assert!(told.contains("after the change") && told.contains("of particles"), "{told}");
        assert!(told.contains("(at least 1 pair"), "{precision}: {told}");
        assert_eq!(simulation.state_hash(), first.state_hash());

        // In a list with others, and on the way: the lower sheet has fallen by a little, and is crossed still.
        advance(&mut simulation, 4);
        let mut undisturbed = simulation.fork();
        refused(&mut simulation, &[Change::Gravity([0.0; 3]), put("other", &through())]);
        advance(&mut simulation, 10);
        advance(&mut undisturbed, 10);
        assert_eq!(simulation.state_hash(), undisturbed.state_hash(), "{precision}");
    }
}

#[test]
fn a_sheet_that_is_put_clear_of_the_others_goes_on_from_there() {
    let mut simulation = built(&two([THICKNESS; 2]), Precision::F64);
    advance(&mut simulation, 3);
    let mut moved = through();
    for x in &mut moved {
        x[0] += 1.0;
    }
    simulation.apply(&[put("other", &moved)]).expect("nothing is near");
    assert_eq!(positions(&simulation)[COUNT..], moved);
    advance(&mut simulation, 5);

    // Just where the lower one is it has no side to be kept on.
    let lower = positions(&simulation)[..COUNT].to_vec();
    let (_, told) = refused(&mut simulation, &[put("other", &lower)]);
    assert!(told.contains("touches that of body"), "{told}");
    let above: Vec<[f64; 3]> = lower.iter().map(|[x, y, z]| [*x, y + 1e-6, *z]).collect();
    simulation.apply(&[put("other", &above)]).expect("it is above");
}

#[test]
fn bodies_that_change_places_in_one_list_are_taken_and_one_alone_is_not() {
    let mut simulation = built(&two([THICKNESS; 2]), Precision::F64);
    let start = positions(&simulation);
    let (lower, upper) = start.split_at(COUNT);
    let [one, other] = [put("one", upper), put("other", lower)];
    for alone in [&one, &other] {
        refused(&mut simulation, std::slice::from_ref(alone));
    }
    simulation.apply(&[other.clone(), one.clone()]).expect("they change places");
    assert_eq!(positions(&simulation), [upper, lower].concat());
    advance(&mut simulation, 5);

    // A reset brings all back, and what follows it counts from there.
    simulation.apply(&[put("other", &through()), Change::Reset]).expect("the start");
    assert_eq!(positions(&simulation), start);
    simulation.apply(&[other, one.clone()]).expect("they change places");
    refused(&mut simulation, &[Change::Reset, one]);
}

#[test]
fn a_sheet_that_is_folded_through_itself_is_refused() {
    let flat = level([0.0; 3]);
    let mut simulation = scene(flat.clone(), THICKNESS, 0.3).simulate(Precision::F64);
    // One half goes back over the other: clear of it, and down through it.
    let folded = |lift: f64, slope: f64| -> Vec<[f64; 3]> {
        let fold = |[x, y, z]: &[f64; 3]| {
            if *x > 0.0 { [-x, y + lift - slope * x, z + 0.003] } else { [*x, *y, *z] }
        };
        flat.x.iter().map(fold).collect()
    };
    let (names, told) = refused(&mut simulation, &[put("body", &folded(0.02, 1.0))]);
    assert_eq!(names, ["body", "body"]);
    assert!(told.contains("its surface crosses itself after the change"), "{told}");
    simulation.apply(&[put("body", &folded(0.02, 0.0))]).expect("it is folded over");
}

#[test]
fn bodies_without_a_thickness_are_put_anywhere() {
    for thicknesses in [[0.0; 2], [THICKNESS, 0.0], [0.0, THICKNESS]] {
        let mut simulation = built(&two(thicknesses), Precision::F64);
        simulation.apply(&[put("other", &through())]).expect("it passes through the other");
        assert_eq!(positions(&simulation)[COUNT..], through());
    }
}

#[test]
fn pins_that_a_scene_has_moved_through_each_other_hinder_no_other_body() {
    let scene = scene(Network::default(), 0.0, 0.3).under([0.0; 3]);
    let pinned = |network: Network| Network { pins: (0..COUNT as u32).collect(), ..network };
    let [one, other] = [level([0.0; 3]), level([0.003, 0.05, 0.002])].map(pinned);
    let third = level([1.0, 0.0, 0.0]);
    let bodies = vec![("one", one, THICKNESS), ("other", other, THICKNESS), ("third", third, THICKNESS)];
    let mut simulation = built(&of_bodies(&scene, bodies), Precision::F64);
    let start = positions(&simulation);
    let down = |(i, [x, y, z]): (usize, &[f64; 3])| Change::Pin {
        particle: (COUNT + i) as u32,
        // In the end it is tilted, and half of it is below the lower sheet.
        target: [*x, y - 0.04 - 0.02 * (i / SIDE) as f64 / (SIDE - 1) as f64, *z],
        duration: 10.0 * DT,
    };
    let changes: Vec<Change> = start[COUNT..2 * COUNT].iter().enumerate().map(down).collect();
    simulation.apply(&changes).expect("they are pins");
    let report = advance(&mut simulation, 10);
    assert!(report.surface.and_then(|surface| surface.crossings) > Some(0), "{:?}", report.surface);

    let crossed = positions(&simulation);
    let states = [put("one", &crossed[..COUNT]), put("other", &crossed[COUNT..2 * COUNT])];
    simulation.apply(&states).expect("as they are");
    let beside: Vec<[f64; 3]> = start[2 * COUNT..].iter().map(|[x, y, z]| [*x, y + 0.3, *z]).collect();
    simulation.apply(&[put("third", &beside)]).expect("nothing is near");
    let (names, _) = refused(&mut simulation, &[put("third", &through())]);
    assert_eq!(names[1], "third");
}

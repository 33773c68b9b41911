//! What a scene can do without: changes against ordinary runs, what can go, and what cannot go together.

use nappe_sim::{
    cloth::{ClothSettings, Integrator, Network, SpringKind, SpringLaw, SpringRules},
    math::Precision,
    time_step::TimeStep,
    world::{BodySetup, Simulation, WorldSetup},
};
use nappe_study::{Budget, Case, Plan, Removal, Request, Setting, Stepped, Steps, Term, plan, without};
use nappe_tests::{
    networks::{scatter, sheet},
    scene::{advance, positions},
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.01;
const END: f64 = 0.2;

/// A sheet that hangs at two corners, with bending springs of a stiffness (N/m) and a drag (N s/m).
fn hanging(bend: f64, drag: f64) -> Network {
    let law = |stiffness: f64, damping: f64| SpringLaw { stiffness, damping };
    let rules =
        SpringRules { stretch: law(100.0, 0.0), shear: Some(law(50.0, 0.0)), bend: Some(law(bend, 0.0)) };
    let mut network = sheet(6, 0.05, &rules, 0.005);
    network.drag = drag;
    for (i, x) in network.x.iter_mut().enumerate().skip(6) {
        x[1] += 2e-3 * scatter(i);
    }
    network
}

fn setup(network: Network) -> WorldSetup {
    let body = BodySetup { name: "cloth".to_owned(), network, settings: ClothSettings::default() };
    let (wind, colliders) = ([1.0, 0.0, 0.5], Vec::new());
    WorldSetup { dt: DT, gravity: GRAVITY, wind, colliders, bodies: vec![body], snow: None }
}

fn planned(setup: &WorldSetup, tolerance: f64) -> Plan {
    let case = Case::new("sheet", setup.clone(), Vec::new(), Precision::F64).expect("a cloth");
    let methods = vec!["velocity_verlet".to_owned()];
    let request = Request { tolerance, end: END, times: None, methods, precisions: vec![Precision::F64] };
    plan(&case, &request, &Budget::new(None), &|_| ())
}

fn term(plan: &Plan, removal: Removal) -> &Term {
    plan.terms
        .iter()
        .find(|term| term.removal == removal)
        .unwrap_or_else(|| panic!("{removal:?}: {:?}", plan.terms))
}

/// Where particles are after each step of the scene.
fn ordinary(setup: &WorldSetup, parts: u32, steps: u64) -> Vec<Vec<[f64; 3]>> {
    let mut setup = setup.clone();
    let settings = &mut setup.bodies[0].settings;
    settings.integrator = Integrator::VelocityVerlet;
    settings.time_step = TimeStep::Fixed(DT / f64::from(parts));
    let (mut simulation, _) = Simulation::new(&setup, Precision::F64).expect("a scene");
    (0..steps)
        .map(|_| {
            advance(&mut simulation, 1);
            positions(&simulation)
        })
        .collect()
}

#[test]
fn a_change_is_the_distance_of_two_ordinary_runs() {
    let whole = setup(hanging(2.0, 1e-3));
    let found = planned(&whole, 1e-3);
    let Some(Stepped::Cloth(Setting { steps: Steps::Fixed(parts), .. })) =
        found.row.as_ref().map(|row| row.stepped)
    else {
        panic!("{:?}", found.row)
    };
    let mut edited = whole.clone();
    edited.bodies[0].network.springs.retain(|spring| spring.kind != SpringKind::Bend);
    let mut calm = whole.clone();
    calm.wind = [0.0; 3];
    let steps = (found.chart.until() / DT).round() as u64;
    let before = ordinary(&whole, parts, steps);
    let case = Case::new("sheet", whole, Vec::new(), Precision::F64).expect("a cloth");
    for (edited, removal) in [(edited, Removal::Springs(SpringKind::Bend)), (calm, Removal::Wind)] {
        let after = ordinary(&edited, parts, steps);
        let pairs = before.iter().zip(&after);
        let distance = pairs.map(|(a, b)| case.rms(a.as_flattened(), b.as_flattened())).fold(0.0, f64::max);
        let change = term(&found, removal).change.expect("it ran");
        assert!((change / distance - 1.0).abs() < 1e-6, "{removal:?}: {change:e} m, not {distance:e} m");
    }
}

#[test]
fn a_bend_and_a_drag_that_do_nothing_can_go_and_nothing_else() {
    let found = planned(&setup(hanging(1e-6, 1e-12)), 1e-3);
    let gone: Vec<Removal> =
        found.terms.iter().filter(|term| term.is_left_out).map(|term| term.removal).collect();
    assert!(
        found.is_met && gone.contains(&Removal::Springs(SpringKind::Bend)) && gone.contains(&Removal::Drag)
    );
    for needed in [Removal::Springs(SpringKind::Shear), Removal::Digits] {
        assert_eq!(gone.contains(&needed), !term(&found, needed).is_needed, "{:?}", found.terms);
    }
    assert!(term(&found, Removal::Springs(SpringKind::Shear)).is_needed, "{:?}", found.terms);
}

#[test]
fn a_sheet_that_needs_its_bending_keeps_it() {
    let found = planned(&setup(hanging(30.0, 0.0)), 1e-3);
    let bend = term(&found, Removal::Springs(SpringKind::Bend));
    assert!(
        bend.is_needed && !bend.is_left_out && bend.change.is_some_and(|change| change > 1e-3),
        "{bend:?}"
    );
}

#[test]
fn terms_that_are_small_alone_and_large_together_do_not_both_go() {
    let mut network = hanging(0.0, 0.0);
    network.springs.retain(|spring| spring.kind != SpringKind::Bend);
    for spring in &mut network.springs {
        spring.law.damping = if spring.kind == SpringKind::Stretch { 4e-3 } else { 2e-3 };
    }
    let whole = setup(network);
    let both = [Removal::Damping(SpringKind::Stretch), Removal::Damping(SpringKind::Shear)];
    let largest = |plan: &Plan| {
        let changes = both.map(|removal| term(plan, removal).change.expect("it ran"));
        assert!((0.3..3.0).contains(&(changes[0] / changes[1])), "{changes:?}");
        changes[0].max(changes[1])
    };
    let change = largest(&planned(&whole, 1e-4));
    // Both move the answer the same way, by nearly as much: a tolerance that leaves room for each of them, and not for both.
    let tolerances = (10..80).map(|tenths| 0.1 * f64::from(tenths) * change);
    let found = tolerances.map(|tolerance| planned(&whole, tolerance)).find(|found| {
        let allowed = found.chart.tolerance - found.verified.expect("verified").error;
        (1.02..1.2).contains(&(allowed / largest(found)))
    });
    let found = found.expect("a tolerance between");
    let gone = both.map(|removal| term(&found, removal).is_left_out);
    assert!(both.iter().all(|removal| !term(&found, *removal).is_needed), "{:?}", found.terms);
    assert_eq!(gone.iter().filter(|gone| **gone).count(), 1, "{:?}", found.terms);
}

#[test]
fn what_is_removed_costs_nothing_any_more() {
    let whole = setup(hanging(2.0, 1e-3));
    let springs = |setup: &WorldSetup, kind: SpringKind| {
        setup.bodies[0].network.springs.iter().filter(|spring| spring.kind == kind).count()
    };
    assert!(springs(&whole, SpringKind::Bend) > 0);
    let left = without(&whole, &[Removal::Springs(SpringKind::Bend), Removal::Drag]);
    assert_eq!((springs(&left, SpringKind::Bend), left.bodies[0].network.drag), (0, 0.0));
    for kind in [SpringKind::Stretch, SpringKind::Shear] {
        assert_eq!(springs(&left, kind), springs(&whole, kind));
    }
    assert_eq!(without(&whole, &[]), whole);
}

//! Plans: accurate enough by an independent method, about as cheap as the cheapest row of a whole chart, run to the end of the scene, and
//! honest where nothing is.

use std::time::Duration;

use nappe_sim::{
    cloth::{ClothSettings, Hessian, Integrator, Network, StateLimits},
    math::Precision,
    world::{BodySetup, WorldSetup},
};
use nappe_study::{
    Budget, Case, Dropped, End, Method, NEWTON, Plan, Request, Row, SceneTerms, Setting, Stepped, Steps,
    Times, chart, run,
};
use nappe_tests::{
    networks::{chain, sheet, sheet_rules},
    threads::with_threads,
};

use crate::support::case;

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.01;

/// Of a scene of 30 steps.
fn request(tolerance: f64) -> Request {
    Request {
        tolerance,
        end: 30.0 * DT,
        scene_steps: 30,
        times: None,
        methods: Vec::new(),
        precisions: Precision::ALL.to_vec(),
        effort: None,
    }
}

/// A plan of a case of which no term is looked at.
fn plan(case: &Case, request: &Request, budget: &Budget) -> Plan {
    nappe_study::plan(case, request, &SceneTerms::NONE, budget, &|_| ())
}

fn planned(case: &Case, tolerance: f64) -> Plan {
    plan(case, &request(tolerance), &Budget::new(None))
}

/// Every step of a scene until a time (s).
fn every_step(until: f64) -> Times {
    let times: Vec<f64> = (1..=(until / DT).round() as u32).map(|step| f64::from(step) * DT).collect();
    Times::at(&times, DT).expect("the ends of steps")
}

/// A chain that hangs at its left end and swings down.
fn swinging() -> Network {
    let x: Vec<_> = (0..9).map(|i| [0.1 * f64::from(i), 0.0, 0.01 * f64::from(i % 2)]).collect();
    let mut network = chain(&x, 0.1, 300.0, 0.02, 0.02);
    network.pins = vec![0];
    network
}

/// The rms error (m) of a row over the window, against implicit midpoint by Newton's method at a fine step.
fn independent_error(case: &Case, row: &Row, until: f64) -> f64 {
    let budget = Budget::new(None);
    let method = Method { minimizer: NEWTON, ..Method::new(Integrator::ImplicitMidpoint, Hessian::Absolute) };
    let fine = Setting::new(method, Precision::F64, Steps::Divided(12)).good_to(1e-6);
    let times = every_step(until);
    let truth = run(case, &fine, &times, &budget.until(1.0));
    let found = run(case, row.stepped, &times, &budget.until(1.0));
    assert_eq!((truth.states.len(), found.states.len()), (times.marks.len(), times.marks.len()));
    let pairs = truth.states.iter().zip(&found.states);
    pairs.map(|(truth, found)| case.rms(truth, found)).fold(0.0, f64::max)
}

#[test]
fn what_is_recommended_is_right_enough_by_another_family_of_methods() {
    let case = case(swinging(), GRAVITY, DT);
    let methods = ["symplectic_euler", "velocity_verlet_pc", "implicit_midpoint_absolute"].map(str::to_owned);
    let request = Request { methods: methods.to_vec(), ..request(1e-4) };
    let found = plan(&case, &request, &Budget::new(None));
    let row = found.row.as_ref().expect("a row");
    assert!(
        found.is_met
            && found.chart.rows.iter().filter(|row| row.front).eq([&Row { front: true, ..row.clone() }])
    );
    let verified = found.verified.expect("it was verified");
    assert!(verified.error <= 0.8e-4 && verified.is_asymptotic, "{verified:?}");
    assert!(verified.half_step_error.is_some_and(|half| half < 0.7 * verified.error), "{verified:?}");
    let until = found.chart.until();
    let error = independent_error(&case, row, until);
    assert!(error <= 1e-4, "{} in steps of {} s: {error:e} m", row.stepped.name(), row.dt);
    // The reference of the plan knows as much.
    assert!((error - verified.error).abs() < 0.1 * verified.error, "{error:e} m, not {:e} m", verified.error);
    assert_eq!(found.met_until, until);
    // It was compared at every step of the scene, and run to the end of it.
    assert_eq!((found.compared_at(), (until / DT).round() as usize), (30, 30));
    let reach = found.reach.expect("it was run as a scene");
    assert_eq!((reach.steps, reach.end), (30, End::Reached));
}

#[test]
fn the_error_is_the_largest_over_every_step_of_the_scene() {
    let case = case(swinging(), GRAVITY, DT);
    let found = planned(&case, 1e-3);
    let row = found.row.as_ref().filter(|_| found.is_met).expect("a row");
    let reference = found.chart.reference.as_ref().expect("a reference");
    let times = every_step(found.chart.until());
    assert_eq!(reference.times, times);
    let made = run(&case, row.stepped, &times, &Budget::new(None).until(1.0));
    let mut largest: f64 = 0.0;
    for (found, known) in made.states.iter().zip(&reference.states) {
        let squares: f64 = found.iter().zip(known).map(|(a, b)| (a - b) * (a - b)).sum();
        // All but the pin are free.
        largest = largest.max((squares / (case.particle_count() - 1) as f64).sqrt());
    }
    let said = row.error().expect("an error");
    assert!((largest / said - 1.0).abs() < 1e-9, "{largest:e} m, not {said:e} m");
    assert_eq!(made.state_hash, row.state_hash);
}

#[test]
fn a_window_ends_at_a_step_of_the_scene_and_what_is_met_was_verified_and_run_on() {
    let case = case(swinging(), GRAVITY, DT);
    for (end, steps) in [(0.145, 14), (0.15, 15), (DT, 1)] {
        let request = Request { end, ..request(1e-3) };
        let found = plan(&case, &request, &Budget::new(None));
        assert!(
            (found.chart.until() / DT - f64::from(steps)).abs() < 1e-9,
            "{end} s: {}",
            found.chart.until()
        );
        assert!(found.is_met, "{end} s");
        assert_eq!((found.met_until, found.compared_at()), (found.chart.until(), steps as usize));
        assert!(found.verified.is_some_and(|verified| verified.half_step_error.is_some()));
        // A shorter window is no shorter run.
        assert_eq!(found.reach.map(|reach| reach.steps), Some(30), "{end} s");
    }
    // A scene without an end is run until what was asked for.
    let endless = Request { end: 0.2, scene_steps: 0, ..request(1e-3) };
    assert_eq!(plan(&case, &endless, &Budget::new(None)).reach.map(|reach| reach.steps), Some(20));
}

#[test]
fn a_plan_says_until_when_a_scene_runs_that_ends_by_a_limit_of_its_own() {
    let free = case(swinging(), GRAVITY, DT);
    let stretch = |end: f64| {
        let method = Method::new(Integrator::VelocityVerletPredicted, Hessian::Absolute);
        let fine = Setting::new(method, Precision::F64, Steps::Divided(6));
        run(&free, &fine, &every_step(end), &Budget::new(None).until(1.0)).max_stretch
    };
    let [early, late] = [0.2, 0.3].map(stretch);
    assert!(late > early + 0.01, "{early}, {late}");
    let limits = StateLimits { max_stretch: Some(f64::midpoint(early, late)), max_energy: None };
    let settings = ClothSettings { limits, ..ClothSettings::default() };
    let body = BodySetup { name: "cloth".to_owned(), network: swinging(), settings, forces: Vec::new() };
    let (wind, colliders) = ([0.0; 3], Vec::new());
    let setup = WorldSetup {
        dt: DT,
        gravity: GRAVITY,
        wind_at: Vec::new(),
        wind,
        colliders,
        bodies: vec![body],
        snow: None,
    };
    let limited = Case::new("cloth", setup, Vec::new(), Precision::F64).expect("a cloth");
    let methods = ["symplectic_euler", "velocity_verlet_pc"].map(str::to_owned).to_vec();
    let found = plan(&limited, &Request { end: 0.15, methods, ..request(1e-3) }, &Budget::new(None));
    let reach = found.reach.as_ref().expect("it was run as a scene");
    assert!(found.is_met && (20..30).contains(&reach.steps), "{reach:?}");
    assert!(reach.end.failure().is_some_and(|failure| !failure.cause.is_empty()), "{reach:?}");
    assert!((reach.until - DT * reach.steps as f64).abs() < 1e-12);
}

#[test]
fn nothing_is_met_that_there_was_no_time_to_verify() {
    let case = case(sheet(6, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, DT);
    for milliseconds in [1, 20, 100, 200] {
        let budget = Budget::new(Some(Duration::from_millis(milliseconds)));
        let found = plan(&case, &request(1e-3), &budget);
        let half = found.verified.and_then(|verified| verified.half_step_error);
        assert!(!found.is_met || half.is_some(), "{milliseconds} ms: {:?}", found.verified);
        let is_run = found.reach.as_ref().is_some_and(|reach| reach.until >= found.chart.until() - 1e-9);
        assert!(!found.is_met || is_run, "{milliseconds} ms: {:?}", found.reach);
        // What is accurate enough and not met was cut, and says so.
        let is_cut = found.verified.is_some_and(|verified| verified.is_cut);
        assert!(
            found.is_met || found.verified.is_none() || is_cut || !is_run,
            "{milliseconds} ms: {found:?}"
        );
    }
}

#[test]
fn scenes_of_one_particle_of_no_springs_and_of_odd_tolerances_have_an_answer() {
    let particles = |x: &[[f64; 3]]| Network {
        x: x.to_vec(),
        v: vec![[0.0; 3]; x.len()],
        masses: vec![0.1; x.len()],
        ..Network::default()
    };
    for network in [particles(&[[0.0; 3]]), particles(&[[0.0; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])] {
        let found = planned(&case(network, GRAVITY, DT), 1e-3);
        let row = found.row.as_ref().filter(|_| found.is_met).expect("a row");
        assert!(row.error().is_some_and(|error| error <= 1e-3), "{:?}", row.error());
        assert!(found.verified.is_some_and(|verified| verified.is_asymptotic), "{:?}", found.verified);
    }
    let mut pinned = particles(&[[0.0; 3]]);
    pinned.pins = vec![0];
    assert!(planned(&case(pinned, GRAVITY, DT), 1e-3).is_met);
    let swinging = case(swinging(), GRAVITY, DT);
    assert!(planned(&swinging, 1e300).verified.is_some_and(|verified| verified.error.is_finite()));
    for small in [1e-300, 1e-12] {
        let found = planned(&swinging, small);
        assert!(!found.is_met && found.row.is_none() && found.chart.until() == 0.0, "{small} m");
    }
}

#[test]
fn a_plan_takes_about_as_little_as_the_cheapest_row_of_a_whole_chart() {
    let mut stiff = sheet(5, 0.1, &sheet_rules(2000.0, 0.05), 0.02);
    stiff.drag = 0.01;
    let scenes = [
        ("a chain", swinging()),
        ("a sheet", sheet(6, 0.05, &sheet_rules(100.0, 0.01), 0.005)),
        ("a stiff sheet", stiff),
        ("two particles", {
            let mut pair = chain(&[[0.0; 3], [0.3, 0.0, 0.0]], 0.3, 50.0, 0.1, 0.5);
            pair.pins = vec![0];
            pair
        }),
        ("an undamped sheet", sheet(4, 0.1, &sheet_rules(50.0, 0.0), 0.01)),
    ];
    for (name, network) in scenes {
        let case = case(network, GRAVITY, DT);
        for tolerance in [1e-3, 1e-4] {
            let found = planned(&case, tolerance);
            let row = found.row.as_ref().filter(|_| found.is_met);
            let row = row.unwrap_or_else(|| panic!("{name} to {tolerance} m: nothing"));
            assert!(row.error().is_some_and(|error| error <= tolerance), "{name} to {tolerance} m");
            // Every run of the plan stays as a row, those with half the step too.
            assert!(found.chart.rows.len() > found.searched, "{name} to {tolerance} m");
            let whole = chart(&case, &request(tolerance), &Budget::new(None), &|_| ());
            let times = whole.reference.as_ref().expect("a reference").times.end();
            // That of a plan ends at a step of the scene.
            let shorter = times - found.chart.until();
            assert!(shorter > -1e-9 && shorter < DT, "{name}: both windows");
            let good = whole.rows.iter().filter(|row| row.error().is_some_and(|error| error <= tolerance));
            let least = good.map(Row::count).min().expect("a row that is accurate enough");
            // A step is halved where the error of the longer one does not fall by its order yet.
            let verified = found.verified.expect("it was verified");
            let limit = 1.5 * f64::from(verified.halvings).exp2();
            let ratio = row.count() as f64 / least as f64;
            assert!(
                ratio <= limit,
                "{name} to {tolerance} m: {ratio:.2} times {least}, {:?}",
                found.verified
            );
        }
    }
}

#[test]
fn what_was_tried_is_the_same_on_any_number_of_threads() {
    let case = case(sheet(6, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, DT);
    let run = |threads| with_threads(threads, || planned(&case, 1e-3));
    // Those that verify what is recommended, and that itself, too: no choice is made by seconds.
    let rows = |plan: &Plan| {
        let plain = |row: &Row| Row { seconds: None, minimum_seconds: None, ..row.clone() };
        plan.chart.rows.iter().map(plain).collect::<Vec<_>>()
    };
    let [one, two] = [1, 2].map(run);
    assert_eq!(rows(&one), rows(&two));
    assert_eq!((&one.tried, &one.reach, one.verified), (&two.tried, &two.reach, two.verified));
    let costly = |row: &&Row| row.end == End::Costly;
    assert!(one.chart.rows.iter().filter(costly).all(|row| row.error().is_none() && row.seconds.is_none()));
    assert!(one.tried.iter().any(|one| one.dropped == Some(Dropped::Costly)), "{:?}", one.tried);
    // Nothing that was tried takes more than the cheapest, but where no other was right yet.
    let right = |row: &&Row| row.error().is_some_and(|error| error <= 0.7e-3);
    assert!(one.chart.rows.iter().filter(right).count() < one.tried.len());
}

#[test]
fn steps_are_those_that_a_scene_can_ask_for() {
    let case = case(swinging(), GRAVITY, DT);
    for row in planned(&case, 1e-3).chart.rows {
        let Stepped::Cloth(setting) = row.stepped else { panic!("{:?}", row.stepped) };
        match setting.steps {
            Steps::Fixed(parts) => {
                // Accepted ones are divided further where they must be.
                let asked = DT / f64::from(parts);
                assert!(row.error().is_none() || row.dt <= asked * (1.0 + 1e-9), "{} s, {asked} s", row.dt);
            }
            Steps::Controlled(tolerance) => assert!(tolerance <= 1e-4),
            other => panic!("{other:?}"),
        }
    }
}

#[test]
fn where_nothing_is_right_enough_it_says_what_it_would_take() {
    let case = case(swinging(), GRAVITY, DT);
    // In f32 alone, to less than it can tell.
    let request = Request { precisions: vec![Precision::F32], ..request(1e-7) };
    let found = plan(&case, &request, &Budget::new(None));
    let row = found.row.as_ref().expect("the nearest");
    let error = row.error().expect("it held");
    assert!(!found.is_met && error > 1e-7 && found.verified.is_none(), "{error:e} m");
    // No farther from what was run than four halvings.
    if let Some(needed) = found.needed {
        assert!(needed.dt < row.dt && 17.0 * needed.dt > row.dt && needed.cell.is_none(), "{needed:?}");
        assert!(row.seconds.is_some_and(|seconds| seconds < needed.seconds), "{needed:?}");
    }
    assert!(found.met_until < found.chart.until());
    assert!(found.tried.iter().all(|one| one.dropped.is_some()), "{:?}", found.tried);
}

//! Plans: right enough by an independent method, about as cheap as the cheapest row of a whole chart, and honest where nothing is.

use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    math::Precision,
};
use nappe_study::{
    Budget, Case, Dropped, Method, NEWTON, Plan, Request, Row, Setting, Stepped, Steps, Times, chart, plan,
    run,
};
use nappe_tests::{
    networks::{chain, sheet, sheet_rules},
    threads::with_threads,
};

use crate::support::case;

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.01;

fn request(tolerance: f64) -> Request {
    Request { tolerance, end: 0.3, times: None, methods: Vec::new(), precisions: Precision::ALL.to_vec() }
}

fn planned(case: &Case, tolerance: f64) -> Plan {
    plan(case, &request(tolerance), &Budget::new(None), &|_| ())
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
    let times = Times::until(until, DT).expect("the end of a step");
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
    let found = plan(&case, &request, &Budget::new(None), &|_| ());
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
            assert!((times - found.chart.until()).abs() < 1e-9, "{name}: both windows");
            let good = whole.rows.iter().filter(|row| row.error().is_some_and(|error| error <= tolerance));
            let least = good.map(Row::count).min().expect("a row that is right enough");
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
    // But for those that verify what seconds choose.
    let rows = |plan: &Plan| {
        let plain = |row: &Row| Row { seconds: None, minimum_seconds: None, front: false, ..row.clone() };
        plan.chart.rows[..plan.searched].iter().map(plain).collect::<Vec<_>>()
    };
    let [one, two] = [1, 2].map(run);
    assert_eq!(rows(&one), rows(&two));
    assert_eq!(one.tried, two.tried);
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
    let found = plan(&case, &request, &Budget::new(None), &|_| ());
    let row = found.row.as_ref().expect("the nearest");
    let error = row.error().expect("it held");
    assert!(!found.is_met && error > 1e-7 && found.verified.is_none(), "{error:e} m");
    let needed = found.needed.expect("what it would take");
    assert!(needed.dt < row.dt && needed.cell.is_none(), "{needed:?}");
    assert!(row.seconds.is_some_and(|seconds| seconds < needed.seconds), "{needed:?}");
    assert!(found.met_until < found.chart.until());
    assert!(found.tried.iter().all(|one| one.dropped.is_some()), "{:?}", found.tried);
}

//! What is compared beside the motion: the end of a scene that comes to rest, and numbers of it, against closed forms, although its
//! motion cannot be predicted.

use nappe_sim::math::Precision;
use nappe_study::{
    Budget, Case, Chart, Measure, NoMeasure, Plan, Request, Row, SceneTerms, Times, chart, plan,
};
use nappe_tests::networks::chain;

use crate::support::case;

const GRAVITY: f64 = 9.81;
const DT: f64 = 0.01;
const STEPS: u64 = 1000;
const END: f64 = DT * STEPS as f64;
const TOLERANCE: f64 = 1e-3;
/// Length (m), stiffness (N/m) and mass (kg) of the pendulum.
const LENGTH: f64 = 0.3;
const STIFFNESS: f64 = 300.0;
const MASS: f64 = 0.02;
/// How far (m) its spring is stretched at rest.
const STRETCHED: f64 = MASS * GRAVITY / STIFFNESS;

/// A pendulum that stands on its head, 1e-7 m beside its balance: what starts 1e-8 m away falls a 40th of a second sooner or later,
/// so that 1e-8 m become centimetres. After 4 s it has fallen, and after 10 s drag has brought it to rest.
fn pendulum() -> Case {
    let mut network = chain(&[[0.0; 3], [1e-7, LENGTH, 0.0]], LENGTH, STIFFNESS, 0.05, MASS);
    network.pins = vec![0];
    network.drag = 0.08;
    case(network, [0.0, -GRAVITY, 0.0], DT)
}

fn measuring(measure: Measure) -> Case {
    pendulum().measuring(measure).expect("it has a weight and two particles")
}

fn bob(axis: usize) -> Measure {
    Measure::Coordinate { name: "last".to_owned(), particle: 1, axis }
}

/// Of explicit methods alone: those that look for a minimum leave the balance later, as they may.
fn request(times: Option<Times>) -> Request {
    Request {
        tolerance: TOLERANCE,
        end: END,
        scene_steps: STEPS,
        times,
        methods: ["symplectic_euler", "velocity_verlet_pc"].map(str::to_owned).to_vec(),
        precisions: vec![Precision::F64],
        effort: None,
    }
}

fn planned(measure: Measure) -> Plan {
    let times = match &measure {
        Measure::Motion => None,
        other => Some(other.times(END, DT).expect("the end")),
    };
    plan(&measuring(measure), &request(times), &SceneTerms::NONE, &Budget::new(None), &|_| ())
}

fn charted(measure: Measure, times: &[f64]) -> Chart {
    let times = Times::at(times, DT).expect("steps of the scene");
    chart(&measuring(measure), &request(Some(times)), &Budget::new(None), &|_| ())
}

#[test]
fn the_end_of_a_motion_that_cannot_be_predicted_is_planned() {
    let motion = planned(Measure::Motion);
    let until = motion.chart.until();
    assert!(until > 0.0 && until < 0.5 * END, "{until} s");
    assert!(!motion.chart.is_whole());
    assert_eq!(motion.chart.compared(), format!("until {until:.3} s of 10.000 s"));

    let end = planned(Measure::End);
    assert!(end.is_met && end.chart.is_whole(), "{:?}", end.chart.limit);
    assert_eq!((end.compared_at(), end.chart.compared().as_str()), (1, "at the end, 10.000 s"));
    assert!(end.chart.growth_rate().is_none());
    let reference = end.chart.reference.as_ref().expect("a reference");
    let hanging = [0.0, -(LENGTH + STRETCHED), 0.0];
    for (found, known) in reference.states[0][3..].iter().zip(hanging) {
        assert!((found - known).abs() < 1e-5 + end.chart.floor, "{found} m, not {known} m");
    }
    // What it is known to is small, and the plan takes it into account.
    assert!(end.chart.floor > 0.0 && end.chart.floor <= 0.25 * TOLERANCE, "{:e} m", end.chart.floor);
    assert!(end.row.as_ref().and_then(Row::error).is_some_and(|error| error < 1e-4));
    assert_eq!(end.reach.map(|reach| reach.steps), Some(STEPS));
}

#[test]
fn numbers_of_what_rests_have_the_limits_of_statics() {
    let lowest = LENGTH + STRETCHED;
    // m g y and half of m g times what the spring is stretched by, over m g.
    let energy = -lowest + 0.5 * STRETCHED;
    for (measure, known) in
        [(Measure::Sag, lowest), (Measure::Energy, energy), (bob(1), -lowest), (bob(0), 0.0)]
    {
        let found = charted(measure.clone(), &[9.0, END]);
        let reference = found.reference.as_ref().expect("a reference");
        assert_eq!(reference.states.len(), 2, "{measure:?}");
        let number = reference.states[1][0];
        assert!((number - known).abs() < 1e-5 + found.floor, "{measure:?}: {number} m, not {known} m");
        assert!(found.floor < 1e-4, "{measure:?}: {:e} m", found.floor);
        // The scene as it is written is stepped by an implicit method.
        let held: Vec<_> = found.rows.iter().filter(|row| !row.own && row.error().is_some()).collect();
        assert!(!held.is_empty(), "{measure:?}");
        for row in held {
            assert!(row.told().is_some_and(|error| error < 2e-4), "{measure:?}: {row:?}");
            assert_eq!(row.centre_error, None);
        }
    }
}

#[test]
fn a_number_that_is_not_known_on_its_way_is_no_plan_and_a_rough_chart() {
    let sag = planned(Measure::Sag);
    assert!(sag.chart.whole.is_some() && sag.chart.reference.is_none() && sag.row.is_none());
    assert!(sag.chart.floor > 0.25 * TOLERANCE, "{:e} m", sag.chart.floor);

    let rough = chart(
        &measuring(Measure::Sag),
        &request(Some(Measure::Sag.times(END, DT).expect("the end"))),
        &Budget::new(None),
        &|_| (),
    );
    assert!(
        rough.floor > TOLERANCE && rough.compared() == "in the sag until 10.000 s",
        "{:e} m",
        rough.floor
    );
    // Of an error below that nothing is said but what it is at most.
    assert!(rough.rows.iter().filter_map(Row::told).all(|error| error >= rough.floor));
}

#[test]
fn what_a_case_does_not_have_is_not_measured() {
    let count = 2;
    let beyond = |particle: usize, axis: usize| {
        pendulum().measuring(Measure::Coordinate { name: "far".to_owned(), particle, axis }).map(|_| ())
    };
    assert_eq!(beyond(2, 0), Err(NoMeasure::NoCoordinate { particle: 2, axis: 0, count }));
    assert_eq!(beyond(1, 3), Err(NoMeasure::NoCoordinate { particle: 1, axis: 3, count }));
    assert_eq!(beyond(1, 2), Ok(()));
    let network = chain(&[[0.0; 3], [LENGTH, 0.0, 0.0]], LENGTH, STIFFNESS, 0.05, MASS);
    let floating = case(network, [0.0; 3], DT);
    for measure in [Measure::Sag, Measure::Energy] {
        assert_eq!(floating.clone().measuring(measure).map(|_| ()), Err(NoMeasure::NoWeight));
    }
    assert!(floating.measuring(Measure::End).is_ok());
}

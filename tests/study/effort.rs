//! Classes of effort: what a class finds is the same on any budget, what a smaller one claims holds by a larger one, and what is too
//! much is said before it begins.

use std::time::Duration;

use nappe_sim::math::Precision;
use nappe_study::{Budget, Case, Chart, Effort, End, NoReference, Request, Row, Times, chart};
use nappe_tests::networks::{sheet, sheet_rules};

use crate::support::case;

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.02;

/// So many particles that the first class pays few steps.
fn large() -> Case {
    case(sheet(60, 0.02, &sheet_rules(200.0, 0.01), 0.001), GRAVITY, DT)
}

fn class(number: u8) -> Effort {
    Effort::new(number).expect("a class")
}

/// Until an end (s) of the scene, or until a time (s) that is asked for.
fn request(end: f64, until: Option<f64>, effort: Option<Effort>) -> Request {
    Request {
        tolerance: 1e-3,
        end,
        scene_steps: 0,
        times: until.map(|until| Times::until(until, DT).expect("a multiple")),
        methods: ["velocity_verlet", "velocity_verlet_pc"].map(str::to_owned).to_vec(),
        precisions: vec![Precision::F64],
        effort,
    }
}

fn charted(case: &Case, request: &Request, seconds: Option<f64>) -> Chart {
    chart(case, request, &Budget::new(seconds.map(Duration::from_secs_f64)), &|_| ())
}

/// Rows without what a clock says.
fn without_seconds(chart: &Chart) -> Vec<Row> {
    let plain = |row: &Row| Row { seconds: None, minimum_seconds: None, front: false, ..row.clone() };
    chart.rows.iter().map(plain).collect()
}

#[test]
fn a_class_finds_the_same_on_any_budget() {
    let case = case(sheet(12, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, DT);
    let request = request(0.4, None, Some(class(0)));
    let endless = charted(&case, &request, None);
    let limited = charted(&case, &request, Some(3600.0));
    assert_eq!((endless.effort, limited.effort), (Some(class(0)), Some(class(0))));
    assert_eq!((endless.floor, &endless.whole), (limited.floor, &limited.whole));
    assert!(!endless.rows.is_empty());
    assert_eq!(without_seconds(&endless), without_seconds(&limited));
}

#[test]
fn without_a_limit_of_time_the_default_class_is_taken() {
    let case = case(sheet(5, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, DT);
    let [chosen, default] =
        [None, Some(Effort::DEFAULT)].map(|effort| charted(&case, &request(0.2, None, effort), None));
    assert_eq!(chosen.effort, Some(Effort::DEFAULT));
    assert_eq!(chosen.whole, default.whole);
}

#[test]
fn what_a_smaller_class_claims_holds_by_a_larger_one() {
    let case = large();
    let [small, fine] =
        [0, 1].map(|number| charted(&case, &request(0.2, Some(0.2), Some(class(number))), None));
    let references = [&small, &fine].map(|chart| chart.reference.as_ref().expect("a reference"));
    assert!(references[0].work.force_evaluations < references[1].work.force_evaluations);
    assert!(small.floor >= fine.floor, "{} m, {} m", small.floor, fine.floor);
    for (i, (rough, known)) in references[0].states.iter().zip(&references[1].states).enumerate() {
        let claimed = references.map(|reference| reference.own_error[i]).iter().sum::<f64>();
        let distance = case.rms(rough, known);
        assert!(distance <= claimed, "{distance:e} m apart, {claimed:e} m claimed");
    }

    let mut compared = 0;
    for row in &small.rows {
        let same = fine.rows.iter().find(|other| other.stepped == row.stepped);
        let Some((own, better)) = row.error().zip(same.and_then(Row::error)) else { continue };
        compared += 1;
        assert_eq!(row.below_floor, own < small.floor, "{row:?}");
        assert_eq!(row.at_most, row.below_floor.then_some(own + small.floor), "{row:?}");
        assert_eq!(row.told(), Some(row.at_most.unwrap_or(own)), "{row:?}");
        assert!((own - better).abs() <= small.floor + fine.floor, "{own:e} m, by more effort {better:e} m");
    }
    assert!(compared >= 2, "{compared} rows");
}

#[test]
fn a_window_is_as_long_as_the_work_of_its_class_allows() {
    let case = large();
    let reached = |chart: &Chart| chart.scan.spacing * chart.scan.spread.len() as f64;
    let [small, fine] = [0, 1].map(|number| charted(&case, &request(20.0, None, Some(class(number))), None));
    assert_eq!(small.scan.end, End::Costly);
    assert!(reached(&small) < reached(&fine), "{} s, {} s", reached(&small), reached(&fine));
    for chart in [&small, &fine] {
        assert!(chart.until() > 0.0 && !chart.is_cut, "{:?}", chart.missing);
        assert!(chart.rows.iter().any(|row| row.told().is_some()), "{:?}", chart.limit);
    }
}

#[test]
fn what_takes_too_long_is_said_before_it_begins() {
    let found = charted(&large(), &request(100.0, Some(100.0), None), Some(1.0));
    assert!(matches!(found.missing, Some(NoReference::Time(needed)) if needed > 0.7), "{:?}", found.missing);
    assert!(found.is_cut && found.rows.is_empty() && found.scan.spread.is_empty());
    // A machine that is busy has no time for a single step.
    assert!(found.fits.is_none_or(|fits| (DT - 1e-9..100.0).contains(&fits)), "{:?}", found.fits);
}

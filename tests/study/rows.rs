//! Rows of a chart.

use std::{
    cell::Cell,
    time::{Duration, Instant},
};

use nappe_sim::{math::Precision, world::Change};
use nappe_study::{
    Budget, Chart, End, Limit, Method, NoReference, Request, Row, Setting, Stepped, Steps, Times, chart,
    line_names,
};
use nappe_tests::{
    networks::{chain, sheet, sheet_rules},
    threads::with_threads,
};

use crate::support::{case, case_with};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

fn request(times: Option<Times>, methods: &[&str]) -> Request {
    Request {
        tolerance: 1e-3,
        end: 0.4,
        scene_steps: 0,
        times,
        methods: methods.iter().map(|&name| name.to_owned()).collect(),
        precisions: vec![Precision::F64],
        effort: None,
    }
}

/// Rows without what a clock says.
fn without_seconds(chart: &Chart) -> Vec<Row> {
    let plain = |row: &Row| Row { seconds: None, minimum_seconds: None, front: false, ..row.clone() };
    chart.rows.iter().map(plain).collect()
}

#[test]
fn all_but_seconds_is_the_same_on_any_number_of_threads_and_in_a_second_run() {
    let case = case(sheet(12, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, 0.02);
    let request = Request { precisions: Precision::ALL.to_vec(), ..request(None, &[]) };
    let run = |threads| with_threads(threads, || chart(&case, &request, &Budget::new(None), &|_| {}));
    let first = run(1);
    assert!(!first.is_cut && !first.is_stopped);
    assert!(first.rows.len() > 50, "{} rows", first.rows.len());
    for threads in [2, 1] {
        let again = run(threads);
        assert_eq!((again.floor, &again.whole), (first.floor, &first.whole), "{threads} threads");
        assert_eq!(without_seconds(&again), without_seconds(&first), "{threads} threads");
    }
}

/// The slope of a line through points, by least squares.
fn slope(points: &[[f64; 2]]) -> f64 {
    let count = points.len() as f64;
    let mean = |axis: usize| points.iter().map(|point| point[axis]).sum::<f64>() / count;
    let [x, y] = [mean(0), mean(1)];
    let product = |axis: usize, middle: f64| {
        points.iter().map(|point| (point[0] - x) * (point[axis] - middle)).sum::<f64>()
    };
    product(1, y) / product(0, x)
}

#[test]
fn slopes_of_a_chain_are_the_orders_of_its_methods() {
    let x: Vec<_> = (0..13).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 1500.0, 0.0, 1.0);
    network.pins = vec![0];
    let dt = 0.4 / 63.0;
    let case = case(network, GRAVITY, dt);
    let times = Times::at(&[0.4], dt).expect("63 steps");
    let request = Request { tolerance: 1e-7, ..request(Some(times), &[]) };
    let chart = chart(&case, &request, &Budget::new(None), &|_| {});
    for method in Method::all() {
        let is_one = |row: &&Row| row.stepped.name() == method.name() && row.stepped.is_even() && !row.own;
        let held =
            chart.rows.iter().filter(is_one).filter_map(|row| Some([row.dt.log2(), row.error()?.log2()]));
        let held: Vec<_> = held.collect();
        assert!(held.len() >= 4, "{}: {} rows", method.name(), held.len());
        let (found, order) = (slope(&held), method.order(0.0));
        assert!((found - order).abs() < 0.15, "{}: a slope of {found}, not {order}: {held:?}", method.name());
    }
}

#[test]
fn every_row_stays_also_those_that_failed() {
    // Steps begin at the comparison interval, far above what explicit methods bear.
    let case = case(sheet(8, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, 0.02);
    let request = request(None, &[]);
    let chart = chart(&case, &request, &Budget::new(None), &|_| {});
    let interval = chart.reference.as_ref().expect("a reference").times.interval;
    let mut failed = 0;
    for name in line_names(&case) {
        let of_line = |row: &&Row| row.stepped.name() == name && !row.own;
        let rows: Vec<_> = chart.rows.iter().filter(of_line).collect();
        for (i, row) in rows.iter().enumerate() {
            match row.stepped {
                Stepped::Cloth(Setting { steps: Steps::Divided(level), .. }) => {
                    assert_eq!((level as usize, row.dt), (i, interval / f64::from(level).exp2()), "{name}");
                }
                Stepped::Cloth(Setting { steps: Steps::Controlled(tolerance), .. }) => {
                    assert_eq!(tolerance, 10_f64.powi(-3 - i as i32), "{name}");
                }
                other => panic!("{name}: {other:?}"),
            }
            assert!(row.dt > 0.0 && row.seconds.is_some_and(|seconds| seconds > 0.0), "{row:?}");
            assert_eq!(row.end == End::Reached, row.error().is_some(), "{row:?}");
            failed += usize::from(row.end.name() == "diverged");
        }
        assert!(!rows.is_empty(), "{name}");
    }
    let explicit = chart.rows.iter().find(|row| row.stepped.name() == "symplectic_euler").expect("a row");
    assert_eq!((explicit.end.name(), explicit.dt, explicit.error()), ("diverged", interval, None));
    assert!(failed >= 4, "{failed} failed");
    assert_eq!(chart.rows.iter().filter(|row| row.own).count(), 1);
}

#[test]
fn a_budget_is_kept_and_what_was_found_in_it_stands() {
    let case = case(sheet(60, 0.02, &sheet_rules(200.0, 0.01), 0.001), GRAVITY, 0.02);
    for seconds in [0.02, 1.0] {
        let limit = Duration::from_secs_f64(seconds);
        let begin = Instant::now();
        let chart = chart(&case, &request(None, &[]), &Budget::new(Some(limit)), &|_| {});
        // An idle machine ends 0.2 s after it; without a budget this takes minutes.
        assert!(begin.elapsed() < limit + Duration::from_secs(20), "{:?}", begin.elapsed());
        assert!(chart.is_cut && !chart.is_stopped);
        if chart.reference.is_none() {
            let is_told = matches!(chart.missing, Some(NoReference::Time(_)));
            assert!(is_told && chart.rows.is_empty(), "{:?}, {:?}", chart.missing, chart.limit);
        }
    }
}

#[test]
fn a_chart_that_is_stopped_keeps_its_rows() {
    let case = case(sheet(16, 0.02, &sheet_rules(200.0, 0.01), 0.001), GRAVITY, 0.02);
    let budget = Budget::new(None);
    let (stop, told) = (budget.stop(), Cell::new(0));
    let tell = move |_: &str| {
        told.set(told.get() + 1);
        if told.get() == 40 {
            stop.stop();
        }
    };
    let chart = chart(&case, &request(None, &[]), &budget, &tell);
    assert!(chart.is_stopped);
    // The scan, the reference and the scene as it is written were told of too, and the last row had no time.
    assert!((30..=40).contains(&chart.rows.len()), "{} rows", chart.rows.len());
}

#[test]
fn where_a_scene_leaves_its_answer_open_at_once_there_is_no_window() {
    // A stiff sheet under a load that it buckles under, looked at so closely that nothing is determined.
    let case = case(sheet(8, 0.05, &sheet_rules(100.0, 0.0), 0.005), GRAVITY, 0.02);
    let request = Request { tolerance: 1e-9, ..request(None, &[]) };
    let chart = chart(&case, &request, &Budget::new(None), &|_| {});
    assert_eq!((chart.limit.clone(), chart.until(), chart.rows.len()), (Limit::Spread, 0.0, 0));
    assert_eq!(chart.scan.spread.len(), 1);
}

#[test]
fn where_pins_move_steps_of_the_world_are_those_of_the_scene() {
    let network = sheet(8, 0.05, &sheet_rules(100.0, 0.01), 0.005);
    let target = [-0.1, 0.05, 0.02];
    let change = Change::Pin { particle: 0, target, duration: 0.1 };
    let case = case_with(network, GRAVITY, 0.02, vec![change]);
    assert!(case.has_moving_pins());
    let names = ["symplectic_euler", "velocity_verlet_pc", "bdf2_absolute", "velocity_verlet_pc_controlled"];
    let chart = chart(&case, &request(None, &names), &Budget::new(None), &|_| {});
    let reference = chart.reference.as_ref().expect("a reference");
    assert!(reference.times.interval >= 0.02 && chart.until() > 0.1, "{:?}", reference.times);
    for (mark, state) in reference.times.marks.iter().zip(&reference.states) {
        let share = (reference.times.time(*mark) / 0.1).min(1.0);
        for c in 0..3 {
            assert!((state[c] - share * target[c]).abs() < 1e-12, "{mark}: {:?}", &state[..3]);
        }
    }
    for row in &chart.rows {
        assert!(row.dt <= 0.02 * (1.0 + 1e-12), "{row:?}");
    }
    // A pin that went elsewhere would draw the sheet away.
    let best = chart.rows.iter().filter_map(Row::error).fold(f64::INFINITY, f64::min);
    assert!(best < 1e-4, "{best} m");
}

//! What a budget cuts is not known, and what is known does not depend on it: charts and studies of stability.

use std::time::{Duration, Instant};

use nappe_sim::math::Precision;
use nappe_study::{
    Budget, Case, Chart, Effort, Map, NoReference, Over, Request, Row, Stability, StabilityRequest,
    StabilityRow, Stepping, Verdict, chart, stability,
};
use nappe_tests::{
    networks::{sheet, sheet_rules},
    threads::with_threads,
};

use crate::support::case;

const GRAVITY: [f64; 3] = [0.0, -9.8, 0.0];

fn small() -> Case {
    case(sheet(5, 0.05, &sheet_rules(100.0, 0.01), 0.005), GRAVITY, 0.01)
}

/// A whole study, and others with shares of the seconds that it took: on any machine some of them are cut somewhere.
fn with_shares<T>(make: &dyn Fn(&Budget) -> T) -> (T, Vec<T>) {
    let begin = Instant::now();
    let whole = make(&Budget::new(None));
    let seconds = begin.elapsed().as_secs_f64();
    let share = |share: f64| make(&Budget::new(Some(Duration::from_secs_f64(1e-4 + share * seconds))));
    (whole, [0.0, 0.02, 0.1, 0.3, 0.6].map(share).into())
}

fn studied(budget: &Budget) -> Stability {
    let methods = ["explicit_euler", "symplectic_euler", "velocity_verlet", "implicit_euler_absolute"];
    let request = StabilityRequest {
        tolerance: 1e-3,
        end: 0.5,
        methods: methods.map(str::to_owned).to_vec(),
        maps: Map::ALL.to_vec(),
        cells: 6,
        effort: Some(Effort::DEFAULT),
    };
    with_threads(2, || stability(&small(), &request, budget, &|_| {}))
}

/// Whether two rows are of the same run, or limits of the same method.
fn is_same(a: &StabilityRow, b: &StabilityRow) -> bool {
    let key = |row: &StabilityRow| (row.over, row.across, row.is_limit, row.stepping);
    a.method == b.method && key(a) == key(b) && (a.is_limit || a.dt == b.dt)
}

#[test]
fn what_a_cut_study_of_stability_knows_is_what_a_whole_one_knows() {
    let (whole, cut) = with_shares(&studied);
    assert!(
        !whole.is_cut && whole.rows.iter().all(|row| row.verdict != Verdict::NotKnown),
        "{:?}",
        whole.missing
    );
    let mut unknown = 0;
    for study in cut {
        if study.missing.is_some() {
            assert!(
                matches!(study.missing, Some(NoReference::Time(_))) && study.is_cut,
                "{:?}",
                study.missing
            );
            assert!(study.rows.iter().all(|row| row.verdict == Verdict::NotKnown && row.limit.is_none()));
        } else {
            assert_eq!((study.window, study.growth_rate), (whole.window, whole.growth_rate));
        }
        assert_eq!(study.is_cut, study.rows.iter().any(|row| row.cut.is_some()));
        // Each method has both limits, known or not.
        for over in [Over::Rest, Over::Load] {
            assert_eq!(study.limits(over).count(), whole.limits(over).count());
        }
        for row in &study.rows {
            let same = whole.rows.iter().find(|known| is_same(known, row));
            if row.verdict == Verdict::NotKnown {
                unknown += 1;
                assert!(row.cause.is_some() && row.limit.is_none() && row.growth.is_none(), "{row:?}");
                continue;
            }
            let Some(same) = same else {
                // A map takes the best of the explicit methods whose limits are known.
                let is_mapped =
                    whole.rows.iter().any(|other| other.across.is_some() && other.method == row.method);
                assert!(row.across.is_some() && !is_mapped, "the whole study lacks {row:?}");
                continue;
            };
            let known = StabilityRow { right: same.right, cut: None, ..row.clone() };
            assert_eq!(&known, same);
            assert!(row.right.is_none() || row.right == same.right, "{row:?}, {same:?}");
        }
    }
    assert!(unknown > 0);
}

#[test]
fn a_cell_of_a_map_holds_where_its_step_is_within_the_limit_of_its_column() {
    let study = studied(&Budget::new(None));
    let mut compared = 0;
    for limit in study.limits(Over::Load) {
        let Some(longest) = limit.limit.filter(|longest| *longest > 0.0) else { continue };
        // The column of the scene as it is: nothing is pressed together, or damping is once that of the scene.
        let is_of_scene = |row: &&StabilityRow| {
            row.method == limit.method
                && row.across.is_some_and(|(across, value)| {
                    value == if across == nappe_study::Across::Compression { 0.0 } else { 1.0 }
                })
        };
        for cell in study.rows.iter().filter(is_of_scene) {
            compared += 1;
            assert_eq!(cell.verdict.holds(), cell.dt <= 1.002 * longest, "{cell:?}, limit {longest} s");
        }
    }
    assert!(compared >= 6, "{compared} cells");
}

fn charted(budget: &Budget) -> Chart {
    let methods = ["velocity_verlet_pc", "bdf2_absolute", "implicit_euler_absolute_controlled"];
    let request = Request {
        tolerance: 1e-3,
        end: 0.5,
        scene_steps: 50,
        times: None,
        methods: methods.map(str::to_owned).to_vec(),
        precisions: vec![Precision::F64],
        effort: Some(Effort::DEFAULT),
    };
    chart(&small(), &request, budget, &|_| ())
}

#[test]
fn what_a_cut_chart_knows_is_what_a_whole_one_knows() {
    let (whole, cut) = with_shares(&charted);
    assert!(!whole.is_cut && whole.rows.len() > 10, "{:?}", whole.missing);
    for found in cut {
        let Some(reference) = &found.reference else {
            assert!(
                matches!(found.missing, Some(NoReference::Time(_))) && found.is_cut && found.rows.is_empty()
            );
            continue;
        };
        assert_eq!(Some(reference), whole.reference.as_ref());
        for row in &found.rows {
            if row.end.cut().is_some() {
                assert!(found.is_cut && row.error().is_none() && !row.front, "{row:?}");
                continue;
            }
            let plain = |row: &Row| Row { seconds: None, minimum_seconds: None, front: false, ..row.clone() };
            let same = whole.rows.iter().find(|known| known.stepped == row.stepped).expect("the same run");
            assert_eq!(plain(row), plain(same));
        }
    }
}

#[test]
fn a_study_of_a_scene_that_no_run_can_begin_says_why_and_judges_what_is_at_rest() {
    let mut network = sheet(4, 0.05, &sheet_rules(100.0, 0.01), 0.005);
    // So fast that the first step leads to what is no state.
    network.v = vec![[1e300, 0.0, 0.0]; network.x.len()];
    let request = StabilityRequest {
        tolerance: 1e-3,
        end: 0.5,
        methods: vec!["symplectic_euler".to_owned()],
        maps: Map::ALL.to_vec(),
        cells: 4,
        effort: None,
    };
    let study = stability(&case(network, GRAVITY, 0.01), &request, &Budget::new(None), &|_| {});
    assert!(matches!(study.missing, Some(NoReference::Failed(_))) && !study.is_cut, "{:?}", study.missing);
    assert_eq!((study.limits(Over::Load).count(), study.limits(Over::Rest).count()), (0, 1));
    assert!(study.rows.iter().all(|row| row.across.is_none() && row.stepping == Stepping::Raw));
}

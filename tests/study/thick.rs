//! Bodies with a thickness, which implicit Euler alone keeps apart: a reference by its own halving, rows at several steps and tolerances,
//! a plan, and limits that are not known.

use nappe_sim::{cloth::Network, math::Precision};
use nappe_study::{
    Budget, Case, Chart, Effort, Over, Plan, Request, Row, SceneTerms, StabilityRequest, Stepped, Stepping,
    Times, Verdict, chart, plan, stability,
};
use nappe_tests::networks::{sheet, sheet_rules};

use crate::support::case;

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];
const DT: f64 = 0.005;
/// Steps until which the sheet swings down and touches nothing.
const STEPS: u64 = 32;
const END: f64 = 32.0 * DT;

/// A sheet that swings down from two corners, with a thickness (m).
fn swinging(thickness: f64) -> Case {
    let network = sheet(5, 0.05, &sheet_rules(100.0, 0.01), 0.005);
    case(Network { thickness, ..network }, GRAVITY, DT)
}

fn request(tolerance: f64, times: Option<Times>) -> Request {
    Request {
        tolerance,
        end: END,
        scene_steps: STEPS,
        times,
        methods: Vec::new(),
        precisions: vec![Precision::F64],
        effort: Effort::new(1),
    }
}

fn charted(case: &Case, methods: &[&str]) -> Chart {
    // An interval of two steps of the scene.
    let times = Times::until(END, DT).expect("a multiple");
    let methods = methods.iter().map(|&name| name.to_owned()).collect();
    let request = Request { methods, ..request(0.05, Some(times)) };
    chart(case, &request, &Budget::new(None), &|_| ())
}

fn integrator(row: &Row) -> &'static str {
    match row.stepped {
        Stepped::Cloth(setting) => setting.method.integrator.name(),
        Stepped::Snow(_) => "none",
    }
}

#[test]
fn where_nothing_touches_a_reference_of_thick_cloth_is_that_of_the_same_cloth_without_a_thickness() {
    let [thick, thin] = [swinging(0.004), swinging(0.0)];
    let [of_thick, of_thin] = [&thick, &thin].map(|case| charted(case, &["velocity_verlet"]));
    let references = [&of_thick, &of_thin].map(|chart| chart.reference.as_ref().expect("a reference"));
    assert_eq!(references[0].times, references[1].times);
    assert_eq!(references[0].stepped.name(), "implicit_euler_absolute");
    assert_eq!(references[1].stepped.name(), "velocity_verlet_pc");
    assert!(references[0].error() < 1e-3, "{} m", references[0].error());
    for (i, (found, known)) in references[0].states.iter().zip(&references[1].states).enumerate() {
        let claimed = references.map(|reference| reference.own_error[i]).iter().sum::<f64>();
        let distance = thick.rms(found, known);
        assert!(distance <= 2.0 * claimed, "{distance:e} m apart, {claimed:e} m claimed");
    }
    // What was asked for by its name is tried, and says why it is refused.
    assert!(of_thin.rows.iter().any(|row| row.error().is_some()));
    let refused = of_thick.rows.iter().filter(|row| !row.own);
    let causes: Vec<_> = refused.map(|row| row.end.failure().map(|failure| failure.cause.clone())).collect();
    assert!(!causes.is_empty());
    for cause in causes {
        assert!(cause.as_ref().is_some_and(|cause| cause.contains("thickness")), "{cause:?}");
    }
}

#[test]
fn a_chart_of_thick_cloth_compares_implicit_euler_at_several_steps_and_tolerances() {
    let found = charted(&swinging(0.004), &[]);
    assert!(found.missing.is_none() && !found.is_cut, "{:?}", found.missing);
    assert!(found.other_family().is_none(), "rows are of the family of the reference");
    let rows = || found.rows.iter().filter(|row| !row.own);
    assert!(rows().all(|row| integrator(row) == "implicit_euler"));
    let even = rows().filter(|row| row.stepped.is_even() && row.stepped.name() == "implicit_euler_absolute");
    let errors: Vec<f64> = even.filter_map(Row::error).collect();
    assert!(errors.len() >= 3, "{errors:?}");
    assert!(errors.windows(2).all(|pair| pair[1] < pair[0]), "{errors:?}");
    let controlled = rows().filter(|row| row.stepped.step_tolerance().is_some());
    assert!(controlled.filter(|row| row.error().is_some()).count() >= 2);
}

#[test]
fn a_plan_of_thick_cloth_finds_steps_that_are_accurate_enough() {
    let request = request(2e-3, None);
    let found: Plan = plan(&swinging(0.004), &request, &SceneTerms::NONE, &Budget::new(None), &|_| ());
    assert!(found.is_met, "{:?}", found.chart.limit);
    let row = found.row.as_ref().expect("a row");
    assert_eq!(integrator(row), "implicit_euler");
    assert!(row.error().is_some_and(|error| error <= 2e-3), "{row:?}");
}

#[test]
fn limits_of_thick_cloth_are_not_known_and_what_it_can_be_stepped_by_is_run() {
    let names = ["velocity_verlet", "bdf2_newton", "implicit_euler_absolute"];
    let request = StabilityRequest {
        tolerance: 1e-2,
        end: END,
        methods: names.map(str::to_owned).to_vec(),
        maps: Vec::new(),
        cells: 2,
        effort: Effort::new(1),
    };
    let found = stability(&swinging(0.004), &request, &Budget::new(None), &|_| ());
    assert!(found.missing.is_none() && !found.is_cut, "{:?}", found.missing);
    for over in [Over::Rest, Over::Load] {
        let limits: Vec<_> = found.limits(over).collect();
        assert_eq!(limits.len(), names.len(), "{over:?}");
        for limit in limits {
            assert!(limit.is_refused() && limit.limit.is_none(), "{limit:?}");
            assert!(limit.cause.as_ref().is_some_and(|cause| cause.contains("thickness")), "{limit:?}");
        }
    }
    let as_run = found.rows.iter().filter(|row| row.stepping == Stepping::Certified);
    let [mut refused, mut made] = [0; 2];
    for row in as_run {
        if row.method.name() == "implicit_euler_absolute" {
            made += 1;
            assert!(row.verdict != Verdict::Refused && row.verdict != Verdict::Lost, "{row:?}");
        } else {
            refused += 1;
            assert!(row.is_refused(), "{row:?}");
        }
    }
    assert_eq!([refused, made], [8, 4]);
}

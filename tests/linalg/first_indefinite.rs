//! The first indefinite matrix of real runs: found at the step that eigenvalues name, not before.

use nappe_sim::{linalg::Outcome, math::Precision};
use nappe_tests::{
    Method, Scene,
    golden::{self, Transient, document},
    scene::{advance, max_distance, positions, velocities},
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Runs {
    rows: Vec<Run>,
}

#[derive(Deserialize)]
struct Run {
    network: String,
    h: f64,
    first_indefinite_step: Option<u64>,
    x: Option<Vec<[f64; 3]>>,
    v: Option<Vec<[f64; 3]>>,
}

fn is_indefinite(outcome: Outcome) -> bool {
    matches!(outcome, Outcome::NegativeCurvature { .. } | Outcome::ZeroCurvature { .. })
}

impl Run {
    fn all() -> Vec<Self> {
        document::<Runs>("linalg/first_indefinite.json").rows
    }

    fn scene(&self, name: &str) -> Scene {
        let motion = Transient::named(&self.network);
        let method = golden::method(name).expect("an integrator of the program");
        Scene::new(motion.network.network(), self.h).by(method).under(motion.network.gravity_m_s2)
    }
}

#[test]
fn the_first_indefinite_matrix_of_a_run_is_found_at_its_step() {
    for run in Run::all() {
        let mut simulation = run.scene("implicit_euler").simulate(Precision::F64);
        for step in 0..run.first_indefinite_step.unwrap_or(40) {
            let outcome = advance(&mut simulation, 1).solve.expect("an implicit step solves").outcome;
            assert!(!is_indefinite(outcome), "{}, dt {}: {outcome:?} at step {step}", run.network, run.h);
        }

        let Some(step) = run.first_indefinite_step else { continue };
        let expected = [run.x.as_ref(), run.v.as_ref()].map(|state| state.expect("the state is on record"));
        let distances = [
            max_distance(&positions(&simulation), expected[0]),
            max_distance(&velocities(&simulation), expected[1]),
        ];
        assert!(distances[0] < 1e-10 && distances[1] < 1e-8, "{}, dt {}: {distances:?}", run.network, run.h);
        let outcome = advance(&mut simulation, 1).solve.expect("an implicit step solves").outcome;
        assert!(is_indefinite(outcome), "{}, dt {}: {outcome:?} at step {step}", run.network, run.h);
    }
}

#[test]
fn the_safe_hessians_never_meet_a_curvature_that_is_not_positive() {
    for run in Run::all() {
        for method in Method::all().into_iter().filter(|m| m.integrator.is_implicit()) {
            if method.hessian == nappe_sim::cloth::Hessian::Full {
                continue;
            }

            let mut simulation = run.scene("implicit_euler").by(method).simulate(Precision::F64);
            for step in 0..60 {
                let outcome = advance(&mut simulation, 1).solve.expect("an implicit step solves").outcome;
                assert!(
                    !is_indefinite(outcome),
                    "{} by {}: {outcome:?} at {step}",
                    run.network,
                    method.name()
                );
            }
        }
    }
}

//! References and errors against golden data.

use nappe_sim::math::Precision;
use nappe_study::{Budget, Effort, End, Reference, Setting, Steps, Times, reference, run};
use nappe_tests::golden::{self, Transient, table};

use crate::support::case;

/// Error that matters (m).
const TOLERANCE: f64 = 1e-7;

/// Scenes of the table, with the longest step of their rows (s).
const SCENES: [(&str, f64); 3] =
    [("chain20 nu=0.5", 0.016), ("cloth10 nu=0.1", 0.02), ("drap10 nu=0.01", 0.008)];

fn reference_at(motion: &Transient, times: &Times) -> Reference {
    let case = case(motion.network.network(), motion.network.gravity_m_s2, times.interval);
    let budget = Budget::new(None);
    reference(&case, times, 1e-3, 1e-4 * TOLERANCE, Effort::DEFAULT, &budget.until(1.0)).expect("a reference")
}

fn check_states(name: &str, dt: f64) {
    let motion = Transient::named(name);
    let states: Vec<_> = motion.states.iter().filter(|state| state.t > 0.0 && state.t <= 0.4).collect();
    let times: Vec<f64> = states.iter().map(|state| state.t).collect();
    let times = Times::at(&times, dt).expect("multiples");
    let found = reference_at(&motion, &times);
    // By the right order it comes there in few halvings.
    assert!(found.orders.iter().all(|order| *order == 2.0), "{name}: {:?}", found.orders);
    assert!(found.step > 1e-5, "{name}: down to {} s", found.step);
    let case = case(motion.network.network(), motion.network.gravity_m_s2, dt);
    for (i, state) in states.iter().enumerate() {
        let distance = case.rms(&found.states[i], state.x.as_flattened());
        let own = found.own_error[i];
        assert!(distance < 1e-10, "{name}, {} s: {distance:e} m off", state.t);
        assert!(own >= 0.5 * distance, "{name}, {} s: it says {own:e} m and is {distance:e} m off", state.t);
    }
}

#[test]
fn the_reference_is_where_golden_states_are_and_knows_how_near() {
    check_states("chain20 nu=0.5", 1e-3);
    check_states("chain20 nu=0", 1e-3);
    check_states("cloth10 nu=0.1", 1e-3);
    check_states("cloth10 nu=0", 1e-3);
    check_states("drap10 nu=0.01", 1e-3);
}

#[test]
fn errors_are_those_of_the_golden_table() {
    let rows = table("spring_mass/expected_convergence.csv");
    for (name, longest) in SCENES {
        let motion = Transient::named(name);
        let of_scene: Vec<_> = rows.iter().filter(|row| row.text("scene") == name).collect();
        let times = Times::at(&[of_scene[0].number("T_s")], longest).expect("a multiple");
        let reference = reference_at(&motion, &times);
        let case = case(motion.network.network(), motion.network.gravity_m_s2, longest);
        let budget = Budget::new(None);
        let mut compared = 0;
        for row in of_scene {
            let expected = row.number("rms_position_error_m");
            if expected >= 1e-2 {
                continue;
            }
            let method = golden::method(row.text("integrator")).expect("an integrator of the program");
            let level = (times.interval / row.number("h_s")).log2().round() as u32;
            let setting = Setting::new(method, Precision::F64, Steps::Divided(level)).good_to(TOLERANCE);
            let found = run(&case, &setting, &times, &budget.until(1.0));
            let label = format!("{name}, {}, dt {} s", setting.name(), row.text("h_s"));
            assert_eq!(found.end, End::Reached, "{label}");
            assert_eq!(found.dt, row.number("h_s"), "{label}");
            let error = case.rms(&found.states[0], &reference.states[0]);
            assert!((error / expected - 1.0).abs() < 0.01, "{label}: {error:e} m, not {expected:e} m");
            compared += 1;
        }
        assert!(compared >= 20, "{name}: only {compared} rows compared");
    }
}

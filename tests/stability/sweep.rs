//! The course's cloth over steps from half to one and a half of the critical one.

use nappe_sim::{cloth::Network, linalg::Outcome, math::Precision, report::StepReport};
use nappe_tests::{
    Scene,
    golden::{self, Row, table},
    networks::{DrapSprings, drap},
    scene::try_advance,
};

use crate::bounds::network;

const STEPS: u64 = 200;

fn scene_of(row: &Row) -> Option<Scene> {
    let method = golden::method(row.text("integrator"))?;
    let network = network(row.text("network"), row.number("nu"));
    Some(Scene::new(network, row.number("dt_s")).by(method))
}

/// The probe of the linear sweep: small velocities of the free particles.
fn probe(network: &mut Network) {
    for i in 0..network.v.len() {
        if !network.pins.contains(&(i as u32)) {
            let n = i as f64;
            network.v[i] =
                [0.0, 1.0, 2.0].map(|d| 1e-4 * (1.3 * n * n + 2.7 * (d + 1.0) * n + 0.9 * d).sin());
        }
    }
}

/// Kinetic and elastic energy at the end and at most, over the start's; infinite if a step fails.
fn energy_ratios(scene: &Scene) -> [f64; 2] {
    let mut simulation = scene.simulate(Precision::F64);
    let mechanical =
        |report: &StepReport| report.diagnostics.kinetic_energy + report.diagnostics.elastic_energy;
    let start = {
        let diagnostics = simulation.diagnose();
        diagnostics.kinetic_energy + diagnostics.elastic_energy
    };

    let (mut last, mut largest) = (start, start);
    for _ in 0..STEPS {
        match try_advance(&mut simulation, 1) {
            Ok(report) => last = mechanical(&report),
            Err(_) => return [f64::INFINITY; 2],
        }
        largest = largest.max(last);
    }

    [last / start, largest / start]
}

fn check_linear(prefix: &str) {
    let rows = table("stability/dt_sweep_linear.csv");
    let mut compared = 0;
    for row in rows.iter().filter(|row| row.text("network").starts_with(prefix)) {
        let mut scene = scene_of(row).expect("an integrator of the program");
        probe(&mut scene.network);
        let [last, largest] = energy_ratios(&scene);
        let [expected_last, expected_largest] = ["E200_over_E0", "max_E_over_E0"].map(|c| row.number(c));
        match row.text("verdict") {
            "damped" | "bounded" => {
                compared += 1;

                // Six digits in the table; near the edge a run amplifies rounding a little.
                let error = (last / expected_last - 1.0).abs().max((largest / expected_largest - 1.0).abs());
                assert!(error < 1e-3, "{row:?}: E/E0 {last}, at most {largest}");
            }
            "growing" => assert!(last > 10.0, "{row:?}: E/E0 {last}"),
            "blow-up" => assert!(largest > 1e3, "{row:?}: E/E0 at most {largest}"),
            other => panic!("no verdict is named {other}"),
        }
    }

    assert!(compared > 20, "{prefix}: only {compared} stable runs compared");
}

#[test]
fn a_small_motion_of_the_course_cloth_is_stable_just_where_theory_says() {
    check_linear("drap10/faces");
}

#[test]
fn a_small_motion_of_the_full_course_cloth_is_stable_just_where_theory_says() {
    check_linear("drap10/full");
}

#[test]
fn a_small_motion_of_the_large_course_cloth_is_stable_just_where_theory_says() {
    check_linear("drap70/faces");
}

/// What the table tells of a run.
struct Fall {
    /// Largest gain of energy over the weight times the height of the sheet.
    gain: f64,
    /// Largest stretch of the last state.
    stretch: f64,
    /// Whether a solve met a curvature that is not positive.
    indefinite: bool,
}

/// The course's scene, 1 kg per particle; `None` if a step fails.
fn fall(scene: &Scene) -> Option<Fall> {
    let network = &scene.network;
    let weight = 9.8 * (network.masses.iter().sum::<f64>() - network.pins.len() as f64);
    let height = network.x.iter().map(|x| -x[1]).fold(0.0, f64::max);
    let mut simulation = scene.simulate(Precision::F64);
    let start = simulation.diagnose().total_energy();
    let mut fall = Fall { gain: 0.0, stretch: simulation.diagnose().max_stretch, indefinite: false };
    for _ in 0..STEPS {
        let report = try_advance(&mut simulation, 1).ok()?;
        let diagnostics = report.diagnostics;
        fall.indefinite |= report.solve.is_some_and(|solve| solve.outcome != Outcome::Converged);
        fall.gain = fall.gain.max((diagnostics.total_energy() - start) / (weight * height));
        fall.stretch = diagnostics.max_stretch;
    }

    Some(fall)
}

fn check_scene(prefix: &str) {
    let rows = table("stability/dt_sweep_scene.csv");
    let [mut compared, mut growing] = [0; 2];
    for row in rows.iter().filter(|row| row.text("network").starts_with(prefix)) {
        let scene = scene_of(row).expect("an integrator of the program").under([0.0, -9.8, 0.0]);
        let (gain, stretch) = (row.number("max_energy_gain_over_scale"), row.number("max_stretch_l_over_l0"));
        let found = fall(&scene);
        if gain < 0.1 {
            compared += 1;
            let found = found.unwrap_or_else(|| panic!("{row:?}: the run failed"));
            assert!(found.gain < 0.1, "{row:?}: gain {}", found.gain);

            // A run that flings springs about amplifies its rounding: no two programs agree on it.
            if stretch < 1.5 {
                assert!((found.gain - gain).abs() < 1e-5 + 1e-3 * gain, "{row:?}: gain {}", found.gain);
                assert!((found.stretch / stretch - 1.0).abs() < 1e-3, "{row:?}: stretch {}", found.stretch);
            }
        } else if gain > 1e3 {
            // The table's direct solver follows an indefinite matrix; ours stops there and says so.
            let lost = found.is_none_or(|fall| fall.gain > 1e3 || fall.indefinite);
            assert!(lost, "{row:?}: the run stayed");
        } else {
            growing += 1;

            // Just beyond the edge: it gains energy, and has not blown up after 200 steps.
            let found = found.unwrap_or_else(|| panic!("{row:?}: the run failed"));
            assert!((0.1..1e3).contains(&found.gain), "{row:?}: gain {}", found.gain);
        }
    }

    assert!(growing >= 2, "{prefix}: only {growing} runs just beyond the edge");
    assert!(compared >= 15, "{prefix}: only {compared} stable runs compared");
}

#[test]
fn the_course_scene_is_stable_just_where_it_was_measured() {
    check_scene("drap10/faces");
}

#[test]
fn the_large_course_scene_is_stable_just_where_it_was_measured() {
    check_scene("drap70/faces");
}

#[test]
fn the_course_default_step_is_stable_and_four_times_it_is_not() {
    let run = |dt: f64| {
        let scene = Scene::new(drap(70, DrapSprings::Faces, 0.01), dt)
            .by(golden::method("symplectic_euler").expect("an integrator of the program"))
            .under([0.0, -9.8, 0.0]);
        fall(&scene)
    };

    assert!(run(2.5e-3).is_some_and(|fall| fall.gain < 0.1));
    assert!(run(0.01).is_none_or(|fall| fall.gain > 1e3));
}

//! States after n steps of each integrator, as two independent programs computed them.

use nappe_sim::{
    linalg::Stop,
    math::{Precision, Real},
};
use nappe_tests::{
    Scene,
    golden::{self, Transient, document},
    scene::{advance, max_distance, positions, velocities},
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Goldens {
    cases: Vec<Golden>,
}

#[derive(Deserialize)]
struct Golden {
    network: String,
    integrator: String,
    h: f64,
    n_steps: u64,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    #[serde(rename = "total_J")]
    total: f64,
}

impl Golden {
    fn all() -> Vec<Self> {
        document::<Goldens>("spring_mass/discrete_goldens.json").cases
    }

    fn name(&self) -> String {
        format!("{} by {}, {} steps of {} s", self.network, self.integrator, self.n_steps, self.h)
    }

    fn scene(&self) -> Scene {
        let motion = match self.network.as_str() {
            "cloth10" => Transient::named("cloth10 nu=0.1"),
            "drap10" => Transient::named("drap10 nu=0.01"),
            other => panic!("no network on record is named {other}"),
        };
        let method = golden::method(&self.integrator).expect("an integrator of the program");
        Scene::new(motion.network.network(), self.h).by(method).under(motion.network.gravity_m_s2)
    }
}

#[test]
fn every_integrator_reaches_the_state_of_its_definition() {
    for golden in Golden::all() {
        let mut simulation = golden.scene().simulate(Precision::F64);
        let report = advance(&mut simulation, golden.n_steps);
        let x_error = max_distance(&positions(&simulation), &golden.x);
        assert!(x_error < 1e-12, "{}: {x_error:e} m", golden.name());
        let v_error = max_distance(&velocities(&simulation), &golden.v);
        assert!(v_error < 1e-10, "{}: {v_error:e} m/s", golden.name());
        let energy_error = (report.diagnostics.total_energy() - golden.total).abs();

        // The energy varies with x and v as force and momentum: some 1e4 N and 1e2 kg m/s at most.
        assert!(energy_error < 1e-10 * golden.total.abs().max(1.0), "{}: {energy_error:e} J", golden.name());
    }
}

#[test]
fn every_integrator_reaches_it_in_binary32_up_to_rounding() {
    for golden in Golden::all() {
        let mut scene = golden.scene();
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-6, max_iterations: 300 };
        let mut simulation = scene.simulate(Precision::F32);
        advance(&mut simulation, golden.n_steps);

        // A step rounds coordinates of at most 1.3 m, and its force acts as if they were rounded
        // once more; a perturbation grows at most twofold within these runs.
        let tolerance = 2.0 * 2.0 * 1.3 * f32::ROUNDING * golden.n_steps as f64;
        let error = max_distance(&positions(&simulation), &golden.x);
        assert!(error < tolerance, "{}: {error:e} m, allowed {tolerance:e}", golden.name());
    }
}

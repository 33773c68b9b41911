//! Two particles on a spring in free flight: motion, momenta, energies.

use nappe_sim::{cloth::Network, math::Precision};
use nappe_tests::{
    Method, Scene,
    golden::{self, document},
    networks::spring,
    scene::{advance, difference, max_distance, momenta, norm, positions, velocities},
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Flights {
    cases: Vec<Flight>,
}

#[derive(Deserialize)]
struct Flight {
    case: String,
    mass_kg: [f64; 2],
    k: f64,
    l0: f64,
    nu: f64,
    x0: [[f64; 3]; 2],
    v0: [[f64; 3]; 2],
    states: Vec<State>,
}

#[derive(Deserialize)]
struct State {
    t: f64,
    x: Vec<[f64; 3]>,
    v: Vec<[f64; 3]>,
    momentum: [f64; 3],
    angular_momentum_about_origin: [f64; 3],
    #[serde(rename = "kinetic_J")]
    kinetic: f64,
    #[serde(rename = "elastic_J")]
    elastic: f64,
}

impl Flight {
    fn all() -> Vec<Self> {
        document::<Flights>("spring_mass/two_particles.json").cases
    }

    fn scene(&self, method: Method, dt: f64) -> Scene {
        let network = Network {
            x: self.x0.to_vec(),
            v: self.v0.to_vec(),
            masses: self.mass_kg.to_vec(),
            springs: vec![spring([0, 1], self.l0, self.k, self.nu)],
            ..Network::default()
        };
        Scene::new(network, dt).by(method)
    }
}

#[test]
fn two_joined_particles_fly_as_the_reference_does() {
    let method = golden::method("velocity_verlet_pc").expect("an integrator of the program");
    for flight in Flight::all() {
        let runs = [2e-4, 1e-4].map(|dt| {
            let mut simulation = flight.scene(method, dt).simulate(Precision::F64);
            let sample = |state: &State| {
                let missing = (state.t / dt).round() as u64 - simulation.step_count();
                advance(&mut simulation, missing);
                let diagnostics = simulation.diagnose();
                (positions(&simulation), velocities(&simulation), diagnostics)
            };

            flight.states.iter().map(sample).collect::<Vec<_>>()
        });

        for (i, state) in flight.states.iter().enumerate() {
            let (coarse, fine) = (&runs[0][i], &runs[1][i]);
            let extrapolate = |c: &[[f64; 3]], f: &[[f64; 3]]| -> Vec<[f64; 3]> {
                c.iter().zip(f).map(|(c, f)| [0, 1, 2].map(|i| (4.0 * f[i] - c[i]) / 3.0)).collect()
            };

            let label = format!("{} at {} s", flight.case, state.t);

            // (ω dt)^4 is 1e-11, the run some tens of radians.
            let x_error = max_distance(&extrapolate(&coarse.0, &fine.0), &state.x);
            assert!(x_error < 1e-9, "{label}: {x_error:e} m");
            let v_error = max_distance(&extrapolate(&coarse.1, &fine.1), &state.v);
            assert!(v_error < 1e-8, "{label}: {v_error:e} m/s");
            for (found, expected) in
                [(fine.2.kinetic_energy, state.kinetic), (fine.2.elastic_energy, state.elastic)]
            {
                assert!((found - expected).abs() < 1e-4, "{label}: {found} J, not {expected}");
            }
        }
    }
}

#[test]
fn every_integrator_keeps_the_momentum_of_free_flight() {
    for flight in Flight::all() {
        for method in Method::all() {
            let mut simulation = flight.scene(method, 1e-3).simulate(Precision::F64);
            let report = advance(&mut simulation, 1000);
            let expected = flight.states[0].momentum;
            let error = norm(difference(report.diagnostics.momentum, expected)) / norm(expected);
            assert!(error < 1e-13, "{} by {}: {error:e}", flight.case, method.name());
        }
    }
}

#[test]
fn kicks_and_drifts_keep_the_angular_momentum_of_free_flight() {
    for flight in Flight::all() {
        for name in ["symplectic_euler", "velocity_verlet", "velocity_verlet_pc"] {
            let method = golden::method(name).expect("an integrator of the program");
            let mut simulation = flight.scene(method, 1e-3).simulate(Precision::F64);
            advance(&mut simulation, 1000);
            let expected = flight.states[0].angular_momentum_about_origin;
            let (_, found) = momenta(&simulation, &flight.mass_kg);
            let error = norm(difference(found, expected)) / norm(expected);
            assert!(error < 1e-12, "{} by {name}: {error:e}", flight.case);
        }
    }
}

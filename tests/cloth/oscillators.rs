//! A particle on an anchored spring: exact states of each integrator, the closed form, orders,
//! and the damping and frequency of implicit Euler.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
    math::Real,
    world::Simulation,
};
use nappe_tests::{
    Method, Oscillator, ScalarLaw, Scene,
    golden::{self, Row, table},
    networks::chain,
    scene::{advance, positions, velocities},
};

/// A particle below an anchor at the origin, gravity down.
#[derive(Clone, Copy, Debug)]
struct Case {
    name: &'static str,
    mass: f64,
    stiffness: f64,
    damping: f64,
    rest_length: f64,
    gravity: f64,
    y: f64,
    v: f64,
}

/// The cases of the golden tables, as their headers state them.
const CASES: [Case; 5] = [
    hung("undamped", 0.0),
    hung("underdamped", 2.0),
    hung("critical", 20.0),
    hung("overdamped", 50.0),
    Case {
        name: "course_stiff",
        mass: 1.0,
        stiffness: 15_000.0,
        damping: 0.01,
        rest_length: 0.1,
        gravity: 9.8,
        y: -0.110_653_333_333_333_34,
        v: 0.0,
    },
];

const fn hung(name: &'static str, damping: f64) -> Case {
    Case { name, mass: 1.0, stiffness: 100.0, damping, rest_length: 1.0, gravity: 9.81, y: -1.1981, v: 0.3 }
}

impl Case {
    fn of(row: &Row) -> Self {
        let found = CASES.into_iter().find(|case| case.name == row.text("case"));
        found.unwrap_or_else(|| panic!("no case is named {}", row.text("case")))
    }

    fn simulate(&self, method: Method, dt: f64, precision: Precision) -> Simulation {
        let x = [[0.0; 3], [0.0, self.y, 0.0]];
        let mut network = chain(&x, self.rest_length, self.stiffness, self.damping, self.mass);
        network.v[1] = [0.0, self.v, 0.0];
        network.pins = vec![0];
        Scene::new(network, dt).by(method).under([0.0, -self.gravity, 0.0]).simulate(precision)
    }

    /// Height (m) and vertical velocity (m/s) after `count` steps.
    fn run(&self, method: Method, dt: f64, count: u64) -> [f64; 2] {
        let mut simulation = self.simulate(method, dt, Precision::F64);
        advance(&mut simulation, count);
        state(&simulation)
    }

    /// The motion about the equilibrium as a scalar law; the force includes the rest length.
    fn law(&self) -> ScalarLaw {
        ScalarLaw {
            stiffness: self.stiffness / self.mass,
            damping: self.damping / self.mass,
            force: -self.gravity - self.stiffness / self.mass * self.rest_length,
        }
    }

    fn omega(&self) -> f64 {
        (self.stiffness / self.mass).sqrt()
    }
}

fn state(simulation: &Simulation) -> [f64; 2] {
    [positions(simulation)[1][1], velocities(simulation)[1][1]]
}

/// Distance of two states, velocities weighed by 1/ω, over the larger one.
fn relative(found: [f64; 2], expected: [f64; 2], omega: f64) -> f64 {
    let size = |y: f64, v: f64| y.hypot(v / omega);
    size(found[0] - expected[0], found[1] - expected[1]) / size(expected[0], expected[1])
}

#[test]
fn every_integrator_gives_the_exact_states_of_its_definition() {
    let rows = table("spring_mass/oscillator_discrete.csv");
    let mut compared = 0;
    for row in &rows {
        let Ok(golden) = golden::method(row.text("integrator")).ok_or("not an integrator of ours") else {
            continue;
        };

        let case = Case::of(row);
        let expected = [row.number("y_m"), row.number("vy_m_s")];

        // Along a line all treatments of the Hessian agree.
        for method in Method::all().into_iter().filter(|m| m.integrator == golden.integrator) {
            let found = case.run(method, row.number("h_s"), row.count("n_steps"));
            let error = relative(found, expected, case.omega());
            assert!(error < 1e-12, "{} by {}, {row:?}: {error:e}", case.name, method.name());
            compared += 1;
        }
    }

    assert!(compared > 150, "only {compared} states compared");
}

#[test]
fn every_integrator_follows_its_scalar_definition() {
    for case in CASES {
        for method in Method::all() {
            let dt = 0.1 / (case.omega() + case.damping / case.mass);
            let expected = case.law().run(method.integrator, dt, [case.y, case.v], 50);

            let error = relative(case.run(method, dt, 50), expected, case.omega());
            assert!(error < 1e-12, "{} by {}: {error:e}", case.name, method.name());
        }
    }
}

#[test]
fn every_integrator_follows_its_definition_in_binary32_up_to_rounding() {
    for case in CASES {
        for method in Method::all() {
            let (dt, count) = (0.1 / (case.omega() + case.damping / case.mass), 50);
            let mut simulation = case.simulate(method, dt, Precision::F32);
            advance(&mut simulation, count);
            let expected = case.law().run(method.integrator, dt, [case.y, case.v], count);

            let error = relative(state(&simulation), expected, case.omega());

            // A few roundings per step, none of which grows in a stable run.
            let tolerance = 4.0 * f32::ROUNDING * count as f64;
            assert!(error < tolerance, "{} by {}: {error:e}", case.name, method.name());
        }
    }
}

#[test]
fn the_motion_is_that_of_the_closed_form() {
    let rows = table("spring_mass/oscillator.csv");
    let method = golden::method("velocity_verlet_pc").expect("an integrator of the program");
    for case in CASES {
        let rows: Vec<&Row> = rows.iter().filter(|row| row.text("case") == case.name).collect();
        let interval = rows[1].number("t_s") - rows[0].number("t_s");
        let steps = (interval * (case.omega() + case.damping / case.mass) / 2e-3).ceil() as u64;
        let mut runs = [1, 2].map(|k| case.simulate(method, interval / (k * steps) as f64, Precision::F64));
        for (i, row) in rows.iter().enumerate() {
            if i > 0 {
                advance(&mut runs[0], steps);
                advance(&mut runs[1], 2 * steps);
            }

            let (coarse, fine) = (state(&runs[0]), state(&runs[1]));
            let found = [0, 1].map(|c| (4.0 * fine[c] - coarse[c]) / 3.0);
            let error = relative(found, [row.number("y_m"), row.number("vy_m_s")], case.omega());

            // What is left after extrapolation: (ω dt)^4 ω t / 100, rounding of the steps.
            assert!(error < 1e-9, "{} at {} s: {error:e}", case.name, row.text("t_s"));
        }
    }
}

#[test]
fn halving_dt_divides_the_error_by_two_to_the_order() {
    let rows = table("spring_mass/oscillator.csv");
    for case in &CASES[..3] {
        let row = rows.iter().find(|row| row.text("case") == case.name && row.text("t_s") == "1.0");
        let row = row.expect("a state at 1 s");
        let expected = [row.number("y_m"), row.number("vy_m_s")];
        for method in Method::all() {
            let error =
                |count: u64| relative(case.run(method, 1.0 / count as f64, count), expected, case.omega());
            let order = (error(4_000) / error(8_000)).log2();
            let wanted = method.order(case.damping);
            assert!((order - wanted).abs() < 0.05, "{} by {}: order {order:.3}", case.name, method.name());
        }
    }
}

#[test]
fn every_integrator_has_its_order_on_an_undamped_spring() {
    let spring = Oscillator { omega: 2.0, amplitude: 0.1 };
    for integrator in Integrator::ALL {
        let [coarse, fine] = [1000, 2000].map(|count| spring.error(integrator, 1.3, count));
        let order = (coarse / fine).log2();
        assert!((order - f64::from(integrator.order())).abs() < 0.05, "{integrator:?}: {order:.2}");
    }
}

/// What a step does to the phase of the undamped oscillator (rad), and to its amplitude, at y = dt w: positions about the
/// equilibrium obey x'' = tr x' - det x.
fn amplification(integrator: Integrator, y: f64, warm_up: u64) -> [f64; 2] {
    let case = CASES[0];
    let method = Method::new(integrator, Hessian::Absolute);
    let rest = case.law().force / case.law().stiffness;
    let mut simulation = case.simulate(method, y / case.omega(), Precision::F64);
    advance(&mut simulation, warm_up);
    let mut x = [0.0; 4];
    for x in &mut x {
        *x = state(&simulation)[0] - rest;
        advance(&mut simulation, 1);
    }
    let pivot = x[1] * x[1] - x[0] * x[2];
    let trace = (x[1] * x[2] - x[0] * x[3]) / pivot;
    let determinant = (x[2] * x[2] - x[1] * x[3]) / pivot;
    [(trace / (2.0 * determinant.sqrt())).acos(), determinant.sqrt()]
}

#[test]
fn implicit_euler_damps_and_slows_as_its_formula_says() {
    for y in [0.1, 0.5, 1.0, 2.0_f64] {
        let [angle, size] = amplification(Integrator::ImplicitEuler, y, 0);
        let ratio = -size.ln() / angle;
        assert!((angle - y.atan()).abs() < 1e-10, "y = {y}: frequency {angle}");
        assert!((ratio - (1.0 + y * y).ln() / (2.0 * y.atan())).abs() < 1e-10, "y = {y}: damping {ratio}");
    }
}

#[test]
fn the_implicit_midpoint_damps_nothing_and_slows_as_its_formula_says() {
    for y in [0.1, 0.5, 1.0, 2.0, 10.0_f64] {
        let [angle, size] = amplification(Integrator::ImplicitMidpoint, y, 0);
        assert!((size - 1.0).abs() < 1e-9, "y = {y}: |z| = {size}");
        assert!((angle - 2.0 * (y / 2.0).atan()).abs() < 1e-9, "y = {y}: frequency {angle}");
    }
}

/// The roots z of (1 + 2 i y / 3) z² - 4 z / 3 + 1 / 3 = 0, BDF2 of x' = -i w x: that of the motion, as phase and modulus.
fn backward_difference_root(y: f64) -> [f64; 2] {
    // 4 / 9 - (1 + 2 i y / 3) / 3, the quarter of the discriminant, and its principal root.
    let (re, im) = (1.0 / 9.0, -2.0 * y / 9.0);
    let size = f64::hypot(re, im);
    let root = [f64::midpoint(size, re).sqrt(), -f64::midpoint(size, -re).sqrt()];
    let top = [2.0 / 3.0 + root[0], root[1]];
    let [angle, modulus] = [root_angle(top), f64::hypot(top[0], top[1])];
    let bottom = [1.0, 2.0 * y / 3.0];
    [root_angle(bottom) - angle, modulus / f64::hypot(bottom[0], bottom[1])]
}

fn root_angle([re, im]: [f64; 2]) -> f64 {
    im.atan2(re)
}

#[test]
fn bdf2_damps_and_slows_as_its_formula_says() {
    for y in [0.1, 0.2, 0.5, 1.0] {
        // The other root, of a modulus below one half, is gone after so many steps.
        let [angle, size] = amplification(Integrator::Bdf2, y, 60);
        let expected = backward_difference_root(y);
        assert!((angle - expected[0]).abs() < 1e-9, "y = {y}: frequency {angle}, not {}", expected[0]);
        assert!((size - expected[1]).abs() < 1e-9, "y = {y}: |z| = {size}, not {}", expected[1]);
    }
    let lost = 1.0 - backward_difference_root(0.1)[1];
    assert!(
        (lost / (0.1_f64.powi(4) / 4.0) - 1.0).abs() < 0.03,
        "y^4 / 4 per step, to leading order: {lost:e}"
    );
}

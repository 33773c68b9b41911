//! Errors of each integrator against its step: not merely the slope, the numbers.

use nappe_sim::math::Precision;
use nappe_tests::{
    Method, Scene,
    golden::{self, Row, Transient, table},
    scene::{difference, norm, positions, try_advance, velocities},
};

/// Root mean square and largest distance over the free particles.
fn distances(found: &[[f64; 3]], reference: &[[f64; 3]], free: &[usize]) -> [f64; 2] {
    let squares = free.iter().map(|&i| norm(difference(found[i], reference[i])).powi(2));
    let (sum, largest) = squares.fold((0.0, 0.0), |(sum, max), d| (sum + d, f64::max(max, d)));
    [(sum / free.len() as f64).sqrt(), f64::sqrt(largest)]
}

/// Position errors (rms, largest) and velocity error (rms) of a row's run; infinite if it fails.
fn errors(row: &Row, motion: &Transient, method: Method) -> [f64; 3] {
    let network = motion.network.network();
    let free: Vec<usize> = (0..network.x.len()).filter(|&i| !network.pins.contains(&(i as u32))).collect();
    let scene = Scene::new(network, row.number("h_s")).by(method).under(motion.network.gravity_m_s2);
    let mut simulation = scene.simulate(Precision::F64);
    if try_advance(&mut simulation, row.count("n_steps")).is_err() {
        return [f64::INFINITY; 3];
    }

    let reference = motion.at(row.number("T_s"));
    let [rms, largest] = distances(&positions(&simulation), &reference.x, &free);
    [rms, largest, distances(&velocities(&simulation), &reference.v, &free)[0]]
}

fn check_scene(name: &str) {
    let motion = Transient::named(name);
    let rows = table("spring_mass/expected_convergence.csv");
    let mut compared = 0;
    for row in rows.iter().filter(|row| row.text("scene") == name) {
        let method = golden::method(row.text("integrator")).expect("an integrator of the program");
        let found = errors(row, &motion, method);
        let columns = ["rms_position_error_m", "max_position_error_m", "rms_velocity_error_m_s"];
        let expected = columns.map(|column| row.number(column));
        let label = format!("{name}, {}, dt {} s", method.name(), row.text("h_s"));
        if expected[0] < 1e-2 {
            compared += 1;
            for i in 0..3 {
                let ratio = found[i] / expected[i];
                assert!(
                    (ratio - 1.0).abs() < 0.01,
                    "{label}: {} is {:e}, not {:e}",
                    columns[i],
                    found[i],
                    expected[i]
                );
            }
        } else {
            // An unstable run's size is not reproducible, but that it is lost is.
            assert!(found[0] > 1e-2 * 0.99, "{label}: {:e} where {:e} was expected", found[0], expected[0]);
        }
    }

    assert!(compared >= 20, "{name}: only {compared} rows compared");
}

#[test]
fn a_chain_has_the_errors_that_each_integrator_must_show() {
    check_scene("chain20 nu=0.5");
}

#[test]
fn a_cloth_has_the_errors_that_each_integrator_must_show() {
    check_scene("cloth10 nu=0.1");
}

#[test]
fn the_course_cloth_has_the_errors_that_each_integrator_must_show() {
    check_scene("drap10 nu=0.01");
}

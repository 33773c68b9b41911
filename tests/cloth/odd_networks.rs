//! Odd networks: what they do is defined and finite, and a warning says that they are odd.

use nappe_sim::{
    cloth::Network,
    math::Precision,
    world::{SetupError, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{chain, particles, sheet, sheet_rules, spring},
    scene::{advance, difference, max_distance, norm, positions, velocities},
};

const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

/// Runs a network by every method in both precisions; all must stay finite. Gives the f64 ends.
fn run_all(network: &Network) -> Vec<(Method, Simulation)> {
    let mut ends = Vec::new();
    for method in Method::all() {
        for precision in Precision::ALL {
            let scene = Scene::new(network.clone(), 1e-3).by(method).under(GRAVITY);
            let mut simulation = scene.simulate(precision);
            advance(&mut simulation, 50);
            let finite = positions(&simulation).iter().flatten().all(|c| c.is_finite());
            assert!(finite, "{} in {precision}", method.name());
            if precision == Precision::F64 {
                ends.push((method, simulation));
            }
        }
    }

    ends
}

fn warnings(network: &Network) -> Vec<String> {
    Simulation::new(&Scene::new(network.clone(), 1e-3).setup(), Precision::F64).expect("it is defined").1
}

/// Speed of a particle that has fallen for 50 ms.
const FALLEN: f64 = -9.81 * 0.05;

#[test]
fn a_spring_of_no_length_between_particles_in_one_place_pulls_nowhere() {
    let mut network = particles(&[[0.1, 0.2, 0.3], [0.1, 0.2, 0.3]], 1.0);
    network.springs = vec![spring([0, 1], 0.0, 100.0, 1.0)];
    assert!(!warnings(&network).is_empty());
    for (method, simulation) in run_all(&network) {
        for v in velocities(&simulation) {
            assert!(norm(difference(v, [0.0, FALLEN, 0.0])) < 1e-12, "{}: {v:?}", method.name());
        }
    }
}

#[test]
fn a_spring_of_no_rest_length_pulls_in_proportion_to_its_length() {
    // Both ends swing about the middle: cos(sqrt(2 k / m) t).
    let mut network = particles(&[[-0.5, 0.0, 0.0], [0.5, 0.0, 0.0]], 1.0);
    network.springs = vec![spring([0, 1], 0.0, 100.0, 0.0)];
    for (method, simulation) in run_all(&network) {
        let expected = 0.5 * (200.0_f64.sqrt() * 0.05).cos();
        let found = positions(&simulation)[1][0];
        let tolerance = if method.order(0.0) > 1.0 { 1e-4 } else { 1e-2 };
        assert!((found - expected).abs() < tolerance, "{}: {found} m, not {expected}", method.name());
    }
}

#[test]
fn a_spring_whose_ends_coincide_does_not_push_in_a_direction_of_its_own() {
    let mut network = particles(&[[0.0; 3], [0.0; 3]], 1.0);
    network.springs = vec![spring([0, 1], 0.5, 100.0, 0.0)];
    // Where particles move one by one the first to move has a direction.
    for (method, simulation) in run_all(&network).into_iter().filter(|(method, _)| !method.is_by_sweeps()) {
        let x = positions(&simulation);
        assert_eq!(x[0], x[1], "{}", method.name());
    }
}

#[test]
fn particles_without_springs_fall_freely_beside_a_cloth() {
    let mut network = sheet(4, 0.1, &sheet_rules(100.0, 0.0), 0.01);
    network.x.push([5.0, 5.0, 5.0]);
    network.v.push([0.0; 3]);
    network.masses.push(0.02);
    assert!(!warnings(&network).is_empty());
    for (method, simulation) in run_all(&network) {
        let v = velocities(&simulation)[16];
        assert!(norm(difference(v, [0.0, FALLEN, 0.0])) < 1e-12, "{}: {v:?}", method.name());
    }
}

#[test]
fn two_springs_on_one_pair_act_as_one_of_both_their_stiffnesses() {
    let x = [[0.0; 3], [0.3, 0.1, 0.0], [0.7, -0.1, 0.2]];
    let mut twice = chain(&x, 0.25, 40.0, 0.1, 0.5);
    let repeated = twice.springs.clone();
    twice.springs.extend(repeated.iter().map(|s| spring([s.particles[1], s.particles[0]], 0.25, 40.0, 0.1)));
    assert!(!warnings(&twice).is_empty());
    let once = chain(&x, 0.25, 80.0, 0.2, 0.5);
    for ((method, a), (_, b)) in run_all(&twice).iter().zip(run_all(&once)) {
        let distance = max_distance(&positions(a), &positions(&b));
        assert!(distance < 1e-13, "{}: {distance:e} m", method.name());
    }
}

#[test]
fn a_spring_from_a_particle_to_itself_is_left_out_with_a_warning() {
    let mut network = chain(&[[0.0; 3], [0.3, 0.0, 0.0]], 0.3, 40.0, 0.1, 0.5);
    let plain = run_all(&network);
    network.springs.push(spring([1, 1], 0.2, 40.0, 0.1));
    assert!(!warnings(&network).is_empty());
    for ((method, a), (_, b)) in run_all(&network).iter().zip(plain) {
        assert_eq!(positions(a), positions(&b), "{}", method.name());
    }
}

#[test]
fn one_particle_alone_falls() {
    for (method, simulation) in run_all(&particles(&[[1.0, 2.0, 3.0]], 0.5)) {
        let v = velocities(&simulation)[0];
        assert!(norm(difference(v, [0.0, FALLEN, 0.0])) < 1e-12, "{}: {v:?}", method.name());
        assert_eq!(simulation.diagnose().max_stretch, 0.0, "{}", method.name());
        assert!(simulation.step_bounds()[0].dt.is_infinite(), "{}", method.name());
    }
}

#[test]
fn a_network_all_pinned_stays() {
    let mut network = sheet(5, 0.1, &sheet_rules(100.0, 0.1), 0.01);
    network.masses.fill(0.0);
    let before = network.x.clone();
    for (method, simulation) in run_all(&network) {
        assert_eq!(positions(&simulation), before, "{}", method.name());
        assert_eq!(simulation.diagnose().kinetic_energy, 0.0, "{}", method.name());
    }
}

#[test]
fn positions_that_their_precision_resolves_too_coarsely_are_warned_of() {
    let at = |far: f64| {
        let mut network = sheet(4, 0.1, &sheet_rules(100.0, 0.1), 0.01);
        network.x.iter_mut().for_each(|x| x[2] -= far);
        network
    };
    let warned = |far, precision| {
        let built = Simulation::new(&Scene::new(at(far), 1e-3).setup(), precision).expect("it is defined");
        built.1.iter().any(|warning| warning.contains("from the origin"))
    };
    // Neighbouring numbers of binary32 are 1.2e-7 of themselves apart, and the particles 0.1 m.
    assert!(!warned(80.0, Precision::F32) && warned(90.0, Precision::F32));
    assert!(!warned(4e10, Precision::F64) && warned(5e10, Precision::F64));
}

type Spoil = fn(&mut Network);

#[test]
fn a_network_that_means_nothing_is_refused() {
    let good = sheet(3, 0.1, &sheet_rules(100.0, 0.1), 0.01);
    let broken: [(&str, Spoil); 8] = [
        ("no particles", |n| *n = Network::default()),
        ("a position that is not finite", |n| n.x[2][1] = f64::NAN),
        ("a velocity that is not finite", |n| n.v[2][1] = f64::INFINITY),
        ("a mass below 0", |n| n.masses[1] = -1.0),
        ("too few masses", |n| n.masses.truncate(2)),
        ("a pin that is no particle", |n| n.pins.push(9)),
        ("a spring to no particle", |n| n.springs[0].particles[1] = 9),
        ("a stiffness below 0", |n| n.springs[0].law.stiffness = -1.0),
    ];
    for (what, spoil) in broken {
        let mut network = good.clone();
        spoil(&mut network);
        let refused = Simulation::new(&Scene::new(network, 1e-3).setup(), Precision::F64);
        assert!(matches!(refused, Err(SetupError::Body { .. })), "{what}: {refused:?}");
    }

    for dt in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let refused = Simulation::new(&Scene::new(good.clone(), dt).setup(), Precision::F64);
        assert!(matches!(refused, Err(SetupError::BadTimeStep(_))), "dt {dt}: {refused:?}");
    }
}

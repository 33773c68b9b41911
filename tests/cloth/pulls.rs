//! Pulls: forces that follow a point, renewed from the state before each step.

use nappe_scene::{Built, NoMeshes, Scene as SceneText, SceneLimits, shipped_scenes};
use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    math::Precision,
    mesh::TriangleMesh,
    time_step::TimeStep,
    world::{Change, Forces, Pull, Simulation},
};
use nappe_tests::{
    Method, Scene,
    networks::{particles, sheet_rules},
    scene::{advance, max_distance, positions, velocities},
};

use crate::hands::random_pulls_fail_nothing;

/// How a pull draws: frequency (1/s), and the acceleration at most (m/s²).
type How = (f64, f64);

fn pull(body: &str, particles: &[u32], points: &[[f64; 3]], (frequency, most): How, seconds: f64) -> Change {
    let (particles, points) = (particles.into(), points.into());
    Change::Pull(Pull { body: body.to_owned(), particles, points, frequency, most, seconds })
}

fn let_go(body: &str, particles: &[u32]) -> Change {
    pull(body, particles, &[], (0.0, 0.0), 0.0)
}

/// The force (N) that draws a particle to a point (m), as a client makes it.
fn force([p, x, v]: [[f64; 3]; 3], mass: f64, (w, most): How) -> [f64; 3] {
    let a = [0, 1, 2].map(|c| w * w * (p[c] - x[c]) - 2.0 * w * v[c]);
    let size = (a[0] * a[0] + a[1] * a[1] + a[2] * a[2]).sqrt();
    let share = if size > most { most / size } else { 1.0 };
    a.map(|c| mass * (share * c))
}

fn shipped(name: &str) -> Built {
    let (_, text) = shipped_scenes().iter().find(|(n, _)| *n == name).expect("a scene of that name");
    let scene = SceneText::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
    scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"))
}

/// Forces of a client in place of pulls, from the state as it is.
fn by_client(
    simulation: &Simulation,
    body: &str,
    drawn: &[(u32, [f64; 3])],
    masses: &[f64],
    how: How,
) -> Change {
    let (x, v) = (positions(simulation), velocities(simulation));
    let forces = drawn.iter().map(|(particle, point)| {
        let at = *particle as usize;
        force([*point, x[at], v[at]], masses[at], how)
    });
    let forces = Forces::Each(forces.collect());
    Change::Force {
        body: body.to_owned(),
        particles: drawn.iter().map(|(particle, _)| *particle).collect(),
        forces,
    }
}

#[test]
fn pulls_have_the_bits_of_forces_that_a_client_makes_from_each_frame() {
    let built = shipped("hanging_sheet");
    let masses = &built.setup.bodies[0].network.masses;
    let new = || Simulation::new(&built.setup, Precision::F64).expect("a scene that is shipped").0;
    let (mut pulled, mut forced, mut free) = (new(), new(), new());
    let patch = [780, 819, 820, 821, 860];
    let (start, how) = (positions(&pulled), (30.0, 2000.0));
    let mut drawn = Vec::new();
    for step in 0..200 {
        if step % 10 == 0 {
            let along = 2e-3 * f64::from(step);
            let point = |at: u32| {
                let [x, y, z] = start[at as usize];
                (at, [x + 0.1 * along, y + 0.3 * along, z - along])
            };
            drawn = patch.map(point).to_vec();
            let points: Vec<_> = drawn.iter().map(|(_, point)| *point).collect();
            pulled.apply(&[pull("sheet", &patch, &points, how, 0.5)]).expect("a fair pull");
        }
        forced.apply(&[by_client(&forced, "sheet", &drawn, masses, how)]).expect("fair forces");
        advance(&mut pulled, 1);
        advance(&mut forced, 1);
        assert_eq!(positions(&pulled), positions(&forced), "after step {step}");
        assert_eq!(velocities(&pulled), velocities(&forced), "after step {step}");
    }
    advance(&mut free, 200);
    assert!(max_distance(&positions(&pulled), &positions(&free)) > 0.05, "they were drawn");
    pulled.apply(&[let_go("sheet", &[])]).expect("they are let go");
    let none = Forces::One([0.0; 3]);
    let none = Change::Force { body: "sheet".to_owned(), particles: [].into(), forces: none };
    forced.apply(&[none]).expect("no force");
    assert_eq!(pulled.state_hash(), forced.state_hash());
}

/// A sheet of 12 x 12 particles that hangs by two corners.
fn hung() -> Scene {
    let mut mesh = TriangleMesh::grid(12, 12, 0.05);
    mesh.points.iter_mut().for_each(|point| *point = [point[0], -point[2], 0.0]);
    let rules = sheet_rules(100.0, 0.01);
    let mut network = Network::from_lattice(&mesh, [12, 12], &rules, 0.002);
    network.pins = vec![0, 11];
    Scene::new(network, 5e-3).under([0.0, -9.81, 0.0]).certified()
}

#[test]
fn every_method_takes_a_pull_as_it_takes_forces() {
    let how = (40.0, 60.0);
    let drawn: Vec<(u32, [f64; 3])> =
        [66, 5, 77].map(|at| (at, [0.3 + 0.01 * f64::from(at % 7), -0.2, 0.15])).to_vec();
    let (named, points): (Vec<u32>, Vec<[f64; 3]>) = drawn.iter().copied().unzip();
    for method in Method::all() {
        // One is not stable here, and a force by call has another begin anew in each step.
        if matches!(method.integrator, Integrator::ExplicitEuler | Integrator::Bdf2) {
            continue;
        }
        let scene = hung().by(method);
        let (mut pulled, mut forced) = (scene.simulate(Precision::F64), scene.simulate(Precision::F64));
        pulled.apply(&[pull("body", &named, &points, how, 0.15)]).expect("a fair pull");
        for _ in 0..30 {
            let masses = &scene.network.masses;
            forced.apply(&[by_client(&forced, "body", &drawn, masses, how)]).expect("fair forces");
            advance(&mut forced, 1);
        }
        advance(&mut pulled, 30);
        let none =
            Change::Force { body: "body".to_owned(), particles: [].into(), forces: Forces::One([0.0; 3]) };
        forced.apply(&[none]).expect("no force");
        // The pull has ended by itself.
        assert_eq!(pulled.parameters().cloths[0].pull_count, 0);
        assert_eq!(pulled.state_hash(), forced.state_hash(), "{}", method.name());
    }
}

#[test]
fn a_particle_comes_to_rest_where_the_pull_carries_its_weight() {
    let (dt, w, point) = (0.01, 50.0, [0.3, -0.1, 0.2]);
    for method in Method::all() {
        let scene = Scene::new(particles(&[[0.0; 3]], 0.7), dt).by(method).under([0.0, -9.81, 0.0]);
        let mut simulation = scene.simulate(Precision::F64);
        // The largest frequency that is allowed.
        assert_eq!(Pull::frequencies(dt)[1], w);
        simulation.apply(&[pull("body", &[], &[point], (w, 1e6), 10.0)]).expect("a fair pull");
        let rest = [point[0], point[1] - 9.81 / (w * w), point[2]];
        let far = |simulation: &Simulation| max_distance(&positions(simulation), &[rest]);
        let begin = far(&simulation);
        advance(&mut simulation, 40);
        assert!(far(&simulation) < 1e-4 * begin, "{}: {:e} m", method.name(), far(&simulation));
        advance(&mut simulation, 160);
        assert!(far(&simulation) < 1e-9, "{}: {:e} m", method.name(), far(&simulation));
    }
}

#[test]
fn the_work_of_a_pull_is_the_energy_that_it_gives_and_it_pulls_no_harder_than_it_may() {
    for integrator in [Integrator::SymplecticEuler, Integrator::VelocityVerlet] {
        let scene = Scene::new(particles(&[[0.0; 3]], 2.0), 0.01);
        let mut simulation = scene.by(Method::new(integrator, Hessian::Absolute)).simulate(Precision::F64);
        let change = pull("body", &[0], &[[0.0, 3.0, 4.0]], (20.0, 5.0), 0.5);
        simulation.apply(&[change]).expect("a fair pull");
        let first = advance(&mut simulation, 1).diagnostics;
        let [_, y, z] = velocities(&simulation)[0];
        assert!((y - 0.6 * 0.05).abs() < 1e-15 && (z - 0.8 * 0.05).abs() < 1e-15, "{y}, {z} m/s");
        let mut work = first.external_work;
        for _ in 0..99 {
            work += advance(&mut simulation, 1).diagnostics.external_work;
        }
        let kinetic = simulation.diagnose().kinetic_energy;
        assert!((work - kinetic).abs() < 1e-12 * kinetic, "{}: {work} J, {kinetic} J", integrator.name());
    }
}

#[test]
fn pulls_are_state_that_is_taken_forked_and_reset_and_ends_by_itself() {
    for method in Method::all().into_iter().filter(|method| method.integrator != Integrator::ExplicitEuler) {
        let scene = hung().by(method);
        let new = || scene.simulate(Precision::F32);
        let mut first = new();
        advance(&mut first, 3);
        let before = first.state_hash();
        let change = pull("body", &[70, 5], &[[0.3, -0.2, 0.1]; 2], (50.0, 40.0), 0.1);
        first.apply(&[change]).expect("a fair pull");
        assert_ne!(first.state_hash(), before);
        assert_eq!(first.parameters().cloths[0].pull_count, 2);
        advance(&mut first, 8);
        let mut second = new();
        second.put(&first.take());
        let mut third = first.fork();
        for simulation in [&mut first, &mut second, &mut third] {
            advance(simulation, 11);
            assert_eq!(simulation.parameters().cloths[0].pull_count, 2);
            advance(simulation, 12);
            assert_eq!(simulation.parameters().cloths[0].pull_count, 0);
        }
        assert_eq!(first.state_hash(), second.state_hash(), "{}", method.name());
        assert_eq!(first.state_hash(), third.state_hash(), "{}", method.name());
    }
}

#[test]
fn a_history_is_forgotten_where_a_pull_begins_or_ends_and_not_in_between() {
    let method = Method::new(Integrator::Bdf2, Hessian::Absolute);
    let mut scene = hung().by(method);
    scene.settings.time_step = TimeStep::Unchecked(f64::INFINITY);
    let mut simulation = scene.simulate(Precision::F64);
    let without = |simulation: &mut Simulation, steps: u64| {
        let each = (0..steps).map(|_| advance(simulation, 1).cloth.expect("a cloth").without_history);
        each.collect::<Vec<_>>()
    };
    let draw = |z: f64| pull("body", &[70], &[[0.3, -0.2, z]], (50.0, 10.0), 0.02);
    assert_eq!(without(&mut simulation, 3), [1, 0, 0]);
    simulation.apply(&[draw(0.05)]).expect("a fair pull");
    assert_eq!(without(&mut simulation, 2), [1, 0]);
    // Another point, and another time: the pull goes on for four steps, and the fifth is without it.
    simulation.apply(&[draw(0.06)]).expect("a fair pull");
    assert_eq!(without(&mut simulation, 6), [0, 0, 0, 0, 1, 0]);
}

#[test]
fn a_reset_ends_pulls_and_a_hash_knows_them_only_while_they_last() {
    let network = particles(&[[0.0; 3], [1.0, 0.0, 0.0]], 1.0);
    let scene = Scene::new(network, 0.01).by(Method::new(Integrator::SymplecticEuler, Hessian::Absolute));
    let (mut pulled, mut free) = (scene.simulate(Precision::F64), scene.simulate(Precision::F64));
    // To where they are: without a force.
    let stay = pull("body", &[], &positions(&free), (10.0, 1.0), 0.03);
    pulled.apply(std::slice::from_ref(&stay)).expect("a fair pull");
    for left in [2, 1, 0] {
        advance(&mut pulled, 1);
        advance(&mut free, 1);
        assert_eq!(pulled.state_hash() == free.state_hash(), left == 0, "{left} steps left");
    }
    free.apply(&[Change::Reset]).expect("a reset");
    for end in [Change::Reset, let_go("body", &[]), let_go("body", &[1, 0])] {
        pulled.apply(std::slice::from_ref(&stay)).expect("a fair pull");
        assert!(pulled.changed_memory_bytes() > 0);
        pulled.apply(&[end]).expect("an end");
        assert_eq!((pulled.state_hash(), pulled.changed_memory_bytes()), (free.state_hash(), 0));
    }
}

#[test]
fn pulls_that_do_not_fit_are_refused_and_change_nothing() {
    let mut simulation = hung().simulate(Precision::F64);
    let hash = simulation.state_hash();
    let (how, point) = ((50.0, 10.0), [0.0, 0.1, 0.0]);
    let of = |particles: &[u32], count: usize| pull("body", particles, &vec![point; count], how, 0.1);
    let by = |how: How, seconds: f64| pull("body", &[5], &[point], how, seconds);
    for (change, told) in [
        (of(&[5, 6], 1), "body: 1 points for 2 particles: one for each is needed"),
        (of(&[], 143), "body: 143 points for 144 particles"),
        (of(&[5, 144], 2), "there is no particle 144 to pull: the body has 144, from 0"),
        (of(&[5, 11], 2), "particle 11 is pinned, and follows no pull"),
        (let_go("body", &[144]), "there is no particle 144"),
        (pull("sail", &[5], &[point], how, 0.1), "no body is named 'sail'; there are: body"),
        (pull("body", &[5], &[[0.0, 2e6, 0.0]], how, 0.1), "points is 2000000: allowed are"),
        (pull("body", &[5], &[[f64::NAN, 0.0, 0.0]], how, 0.1), "points is NaN"),
        (by((100.1, 10.0), 0.1), "frequency is 100.1: allowed are 1e-9 to 100"),
        (by((0.0, 10.0), 0.1), "frequency is 0"),
        (by((f64::NAN, 10.0), 0.1), "frequency is NaN"),
        (by((50.0, 0.0), 0.1), "most is 0"),
        (by((50.0, 1e300), 0.1), "most is"),
        (by(how, 0.0), "seconds is 0"),
        (by(how, 1e9), "seconds is 1000000000: allowed are 1e-9 to 10"),
    ] {
        let error = simulation.apply(&[Change::Gravity([1.0; 3]), change]).expect_err("refused").to_string();
        assert!(error.contains(told), "{error}, not {told}");
        assert_eq!(simulation.state_hash(), hash);
    }
    let rules = simulation.rules().with_most_pulled(3);
    rules.check(&[of(&[5, 6], 2), of(&[5], 1), let_go("body", &[])]).expect("three");
    let error = rules.check(&[of(&[5, 6], 2), of(&[5, 7], 2)]).expect_err("four").to_string();
    assert_eq!(error, "the call pulls at 4 particles: allowed are 3");
}

#[test]
fn a_hand_that_pulls_at_random_fails_nothing() {
    random_pulls_fail_nothing("hanging_sheet", 3);
}

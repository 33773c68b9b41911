//! Judges of steps of cloth: what is right goes on, what gains energy does not, from wherever it is seen.

use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_sim::{
    cloth::{Integrator, Minimizer},
    linalg::Stop,
    math::{Precision, array::dot},
    report::Diagnostics,
    world::Change,
};
use nappe_tests::{
    Method, Random,
    at_random::{Frame, Run, World},
    networks::{particles, sheet, sheet_rules, spring},
    scene::Scene as One,
};

use crate::{
    boost::{boosted, compare, tight},
    law::Verdict,
};

/// The world of a scene's text.
fn world(text: &str) -> World {
    let scene = Scene::parse(text, "scene.toml").expect("a scene");
    let built = scene.build(&NoMeshes, &SceneLimits::default()).expect("a scene");
    World {
        setup: built.setup,
        changes: built.initial_changes,
        precision: scene.precision,
        steps: scene.steps,
    }
}

fn of(scene: &One, steps: u64) -> World {
    World { setup: scene.setup(), changes: Vec::new(), precision: Precision::F64, steps }
}

fn run(world: &World) -> Run {
    world.run().unwrap_or_else(|refused| panic!("{refused}"))
}

fn moved(frame: &Frame) -> f64 {
    let Diagnostics { kinetic_energy, elastic_energy, .. } = frame.report.diagnostics;
    kinetic_energy + elastic_energy
}

/// Kinetic and elastic energy (J) seen from the middle of a body of a mass (kg).
fn inner(frame: &Frame, mass: f64) -> f64 {
    let momentum = frame.report.diagnostics.momentum;
    moved(frame) - 0.5 * dot(momentum, momentum) / mass
}

/// The same seen from what goes along at a velocity (m/s).
fn seen_from(frame: &Frame, mass: f64, velocity: [f64; 3]) -> f64 {
    moved(frame) - dot(velocity, frame.report.diagnostics.momentum) + 0.5 * mass * dot(velocity, velocity)
}

/// A free sheet of 9 x 9 particles of 10 g whose velocities are random.
fn shaken_sheet(speed: f64) -> One {
    let mut network = sheet(9, 0.05, &sheet_rules(1000.0, 0.0), 0.01);
    network.pins.clear();
    let mut random = Random::seeded(5);
    network.v.iter_mut().for_each(|v| *v = random.vector().map(|c| speed * c));
    One::new(network, 0.02).certified()
}

fn implicit() -> impl Iterator<Item = Method> {
    Method::all().into_iter().filter(|method| method.integrator.is_implicit())
}

#[test]
fn a_ball_that_comes_to_a_sheet_does_what_a_sheet_does_that_comes_to_a_ball() {
    let text = "version = 1\ndt = 0.01\nsteps = 20\nprecision = \"f64\"\ngravity = [0, 0, 0]\n[[body]]\nname = \"s\"
        mesh = { grid = [15, 15], spacing = 0.02 }\ntransform = { translate = [-0.14, 0, -0.14] }\nmass = { density = 0.2 }
        springs = { stretch = { stiffness = 400, damping = 0.02 }, shear = { stiffness = 120, damping = 0.01 }, bend = { stiffness = 2, damping = 0.002 } }
        [[collider]]\nname = \"c\"\nsphere = { center = [0.01, -0.06, 0.02], radius = 0.05 }\nmargin = 0.004\nvelocity = [0, 1, 0]\n";
    for method in Method::all() {
        for dt in [0.01, 0.02] {
            let mut world = world(text);
            world.setup.dt = dt;
            let settings = &mut world.setup.bodies[0].settings;
            (settings.integrator, settings.minimizer, settings.hessian) =
                (method.integrator, method.minimizer, method.hessian);
            if method.integrator == Integrator::ExplicitEuler {
                continue;
            }
            let world = tight(&world);
            let ball = run(&world);
            let sheet = run(&boosted(&world, [0.0, -1.0, 0.0]));
            let label = format!("{}, dt {dt}", method.name());
            assert_eq!(ball.reason(), sheet.reason(), "{label}");
            let mass: f64 = world.setup.bodies[0].network.masses.iter().sum();
            let came = 0.5 * mass;
            assert_eq!(compare(&world, [0.0, -1.0, 0.0]), Ok(Verdict::Holds), "{label}");
            for (step, (a, b)) in ball.frames.iter().zip(&sheet.frames).enumerate() {
                let most = seen_from(a, mass, [0.0, 1.0, 0.0]).max(moved(b));
                assert!(most < 1.1 * came, "{label}, step {step}: {most} of {came} J");
            }
        }
    }
}

#[test]
fn a_free_sheet_has_the_same_inner_energy_whatever_it_flies_at() {
    for method in Method::all() {
        for gravity in [[0.0; 3], [0.0, -9.81, 0.0]] {
            if method.integrator == Integrator::ExplicitEuler {
                continue;
            }
            let still = tight(&of(&shaken_sheet(2.0).by(method).under(gravity), 20));
            let mass = 0.81;
            let first = run(&still);
            for speed in [10.0, 100.0, 300.0] {
                let other = run(&boosted(&still, [0.0, 0.6 * speed, 0.8 * speed]));
                let label = format!("{}, {gravity:?}, {speed} m/s", method.name());
                assert_eq!(first.reason(), other.reason(), "{label}");
                for (step, (a, b)) in first.frames.iter().zip(&other.frames).enumerate() {
                    let [a, b] = [inner(a, mass), inner(b, mass)];
                    assert!(
                        (a - b).abs() < 1e-6 * first_energy(&first, mass),
                        "{label}, step {step}: {a} and {b} J"
                    );
                }
            }
        }
    }
}

fn first_energy(run: &Run, mass: f64) -> f64 {
    inner(&run.frames[0], mass)
}

#[test]
fn what_pins_carry_does_what_it_does_at_rest() {
    for method in Method::all().into_iter().filter(|method| method.integrator != Integrator::ExplicitEuler) {
        let mut scene = shaken_sheet(1.0).by(method).under([0.0, -9.81, 0.0]);
        scene.network.pins = vec![0, 8];
        let still = tight(&of(&scene, 30));
        let first = run(&still);
        let mass = 0.79;
        for speed in [1.0, 30.0, 300.0] {
            let train = [0.8 * speed, 0.6 * speed, 0.0];
            let other = run(&boosted(&still, train));
            let label = format!("{}, {speed} m/s", method.name());
            assert_eq!(first.reason(), other.reason(), "{label}");
            for (step, (a, b)) in first.frames.iter().zip(&other.frames).enumerate() {
                let [a, b] = [moved(a), seen_from(b, mass, train)];
                assert!((a - b).abs() < 1e-6 * (1.0 + a), "{label}, step {step}: {a} and {b} J");
            }
        }
    }
}

#[test]
fn a_force_on_a_free_chain_gives_it_its_impulse_in_each_step() {
    for precision in Precision::ALL {
        for stiffness in [1e3, 1e4, 1e5] {
            for method in implicit() {
                let network = particles(&[[0.0; 3], [0.1, 0.0, 0.0], [0.2, 0.0, 0.0]], 0.01);
                let mut scene = One::new(network, 0.01).by(method).certified();
                scene.network.springs =
                    vec![spring([0, 1], 0.1, stiffness, 0.0), spring([1, 2], 0.1, stiffness, 0.0)];
                let mut world = of(&scene, 6);
                world.precision = precision;
                world.setup.bodies[0].forces.push(nappe_sim::world::TimedForce {
                    particles: vec![1],
                    force: [0.0, 10.0, 0.0],
                    from: 0.0,
                    until: f64::INFINITY,
                });
                let found = run(&world);
                assert_eq!(found.reason(), "ran", "{}", method.name());
                let allowed = if precision == Precision::F64 { 1e-12 } else { 1e-5 };
                for (step, frame) in found.frames.iter().enumerate() {
                    let momentum = frame.report.diagnostics.momentum[1];
                    let given = 0.1 * step as f64;
                    let off = (momentum - given).abs();
                    assert!(
                        off <= allowed * given,
                        "{}, {stiffness} N/m, step {step}: {momentum} N s",
                        method.name()
                    );
                }
            }
        }
    }
}

#[test]
fn a_heavy_neighbour_in_the_same_body_gives_nothing() {
    for method in implicit() {
        for speed in [0.0, 30.0] {
            let mut scene = shaken_sheet(5.0).by(method);
            let heavy = particles(&[[5.0, 0.0, 0.0], [5.1, 0.0, 0.0]], 15.0);
            let first = scene.network.x.len() as u32;
            scene.network.x.extend(heavy.x);
            scene.network.v.extend([[0.0, speed, 0.0]; 2]);
            scene.network.masses.extend(heavy.masses);
            scene.network.springs.push(spring([first, first + 1], 0.1, 1e4, 0.0));
            let found = run(&of(&scene, 30));
            let alone = shaken_sheet(5.0).network.v.iter().map(|v| 0.005 * dot(*v, *v)).sum::<f64>();
            for (step, frame) in found.frames.iter().enumerate() {
                let light = moved(frame) - 15.0 * speed * speed;
                assert!(
                    light < 1.2 * alone,
                    "{}, {speed} m/s, step {step}: {light} J of {alone} J",
                    method.name()
                );
            }
        }
    }
}

#[test]
fn an_oscillator_within_its_bound_runs_from_every_phase() {
    for integrator in
        [Integrator::SymplecticEuler, Integrator::VelocityVerlet, Integrator::VelocityVerletPredicted]
    {
        for share in [0.1, 0.37, 0.5, 0.8, 0.99] {
            for phase in 0..8 {
                let mut network = particles(&[[0.0; 3], [0.1, 0.0, 0.0]], 0.01);
                network.springs = vec![spring([0, 1], 0.1, 100.0, 0.0)];
                network.pins = vec![0];
                let angle = f64::from(phase) * std::f64::consts::FRAC_PI_4;
                // The bound is that of a spring between two free ends: the frequency here is 100 / s.
                network.x[1][0] += 1e-3 * angle.cos();
                network.v[1][0] = 0.1 * angle.sin();
                let mut scene = One::new(network, share * 0.02);
                scene.settings.integrator = integrator;
                let mut world = of(&scene.certified(), 300);
                world.setup.bodies[0].settings.integrator = integrator;
                assert_eq!(
                    run(&world).reason(),
                    "ran",
                    "{integrator:?}, {share} of the bound, phase {phase}"
                );
            }
        }
    }
}

#[test]
fn a_stiff_sheet_that_falls_ends_alike_with_a_stranger_and_without() {
    let text = "version = 1\ndt = 0.03\nsteps = 83\nprecision = \"f64\"\n[[body]]\nname = \"s\"
        mesh = { grid = [8, 6], spacing = 0.05, ripple = 0.01 }
        transform = { translate = [0, 0.6, 0], rotate = { axis = [1, 0.2, 0.4], degrees = 35 } }
        mass = { density = 0.3 }\nintegrator = \"implicit_euler\"\nminimizer = \"newton\"
        springs = { stretch = { stiffness = 50000 }, shear = { stiffness = 20000 }, bend = { stiffness = 1500 } }
        [[collider]]\nname = \"f\"\nplane = { point = [0, 0, 0], normal = [0, 1, 0] }\n";
    let stranger = "[[collider]]\nname = \"far\"\nsphere = { center = [900, 0, 0], radius = 0.1 }\nvelocity = [0, 0.001, 0]\n";
    for (minimizer, dt) in [(None, 0.02), (None, 0.03), (Some(()), 0.03), (Some(()), 0.01)] {
        let worlds = [text.to_owned(), format!("{text}{stranger}")].map(|text| {
            let mut world = world(&text);
            world.setup.dt = dt;
            if minimizer.is_none() {
                world.setup.bodies[0].settings.minimizer = Minimizer::OneStep;
                world.setup.bodies[0].settings.solver.stop =
                    Stop::Residual { tolerance: 1e-4, max_iterations: 200 };
            }
            world
        });
        let [alone, with] = [run(&worlds[0]), run(&worlds[1])];
        assert_eq!((alone.reason(), alone.frames.len()), (with.reason(), with.frames.len()), "{dt} s");
        let start = alone.frames[0].report.diagnostics.total_energy();
        for (a, b) in alone.frames.iter().zip(&with.frames) {
            assert_eq!(a.x, b.x);
            assert!(a.report.diagnostics.total_energy() < 1.1 * start, "{dt} s");
        }
    }
}

#[test]
fn a_pin_arrives_in_time_whatever_another_body_takes_again() {
    // The first body is stepped again and again; the pin belongs to the second one.
    let mut network = particles(&[[3.0, 0.0, 0.0], [3.1, 0.0, 0.0]], 0.01);
    network.springs = vec![spring([0, 1], 0.1, 10.0, 0.01)];
    network.pins = vec![0];
    let mut second = One::new(network, 0.02).certified();
    second.settings.integrator = Integrator::VelocityVerlet;
    let is_midpoint = |method: &Method| {
        (method.integrator, method.minimizer) == (Integrator::ImplicitMidpoint, Minimizer::OneStep)
    };
    let first = shaken_sheet(5.0).by(implicit().find(is_midpoint).expect("the midpoint"));
    let mut world = of(&first, 10);
    let mut other = second.setup().bodies.remove(0);
    other.name = "other".to_owned();
    world.setup.bodies.push(other);
    let target = [3.0, 0.4, 0.0];
    world.changes = vec![Change::Pin { particle: 81, target, duration: 0.2 }];
    let found = run(&world);
    let again: usize = found.frames.iter().map(|frame| frame.report.rejections.len()).sum();
    assert!(again > 3, "{again}");
    for (step, frame) in found.frames.iter().enumerate() {
        let off = (frame.x[81][1] - 0.04 * step as f64).abs();
        assert!(off < 1e-12, "step {step}: {off:e} m off its way");
    }
}

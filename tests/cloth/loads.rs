//! Loads of colliders: what they feel is minus the change that contact makes of the cloth's momentum.

use nappe_sim::{
    cloth::{Hessian, Integrator, Spring},
    collide::{
        Collider, Contact, Pose, PoseKey, Shape, StartInside, Way,
        shape::{Cuboid, Plane, Sphere},
    },
    linalg::Stop,
    math::Precision,
    report::{Load, StepReport},
    world::Simulation,
};
use nappe_tests::{
    Method, Scene,
    networks::{scatter, sheet, sheet_rules},
    ranks::on_ranks,
    scene::{advance, cross, difference, norm, positions, velocities},
    threads::with_threads,
};

const GRAVITY: f64 = 9.81;
const MARGIN: f64 = 0.005;
/// Where the reference points of the colliders below are, but for their heights (m).
const AT: [f64; 3] = [0.1, 0.0, 0.2];

fn collider(shape: Shape) -> Collider {
    Collider {
        name: "collider".to_owned(),
        shape,
        velocity: [0.0; 3],
        way: None,
        friction: 0.5,
        restitution: 0.0,
        margin: MARGIN,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

fn floor() -> Collider {
    collider(Shape::Plane(Plane { point: AT, normal: [0.0, 1.0, 0.0] }))
}

/// Boxes with their upper side at height 0: one as it is, one turned by 90 degrees about z.
fn boxes() -> [Collider; 2] {
    let center = [AT[0], -0.3, AT[2]];
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let of = |half_extent| collider(Shape::Box(Cuboid { center, half_extent, axes }));
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let pose = Pose { position: center, turn: [0.0, 0.0, half, half] };
    let way = Some(Way { keys: vec![PoseKey { time: 0.0, pose }] });
    [of([2.0, 0.3, 2.0]), Collider { way, ..of([0.3, 2.0, 2.0]) }]
}

/// A sheet of 16 particles that lies on colliders.
fn lying(collider: Collider, method: Method, dt: f64) -> Scene {
    let mut network = sheet(4, 0.1, &sheet_rules(100.0, 0.02), 0.01);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| x[1] = MARGIN);
    let mut scene = Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.colliders = vec![collider];
    scene
}

fn mass(scene: &Scene) -> f64 {
    scene.network.masses.iter().sum()
}

fn only(report: &StepReport) -> Load {
    let [load] = report.loads[..] else { panic!("one load: {:?}", report.loads) };
    load
}

/// Those of which each step ends at rest.
fn at_rest() -> [Method; 2] {
    [Integrator::ImplicitEuler, Integrator::SymplecticEuler]
        .map(|integrator| Method::new(integrator, Hessian::Absolute))
}

#[test]
fn a_sheet_at_rest_loads_what_it_lies_on_with_its_weight() {
    for method in at_rest() {
        for collider in [floor()].into_iter().chain(boxes()) {
            let label = format!("{} on {:?}", method.name(), collider.shape);
            let reference = collider.pose(0.0).position;
            let scene = lying(collider, method, 1e-3);
            let weight = [0.0, -mass(&scene) * GRAVITY, 0.0];
            let mut simulation = scene.simulate(Precision::F64);
            for step in 0..20 {
                let load = only(&advance(&mut simulation, 1));
                let x = positions(&simulation);
                let center = [0, 1, 2].map(|c| x.iter().map(|x| x[c]).sum::<f64>() / x.len() as f64);
                let torque = cross(difference(center, reference), weight);
                let off = norm(difference(load.force, weight)) / norm(weight);
                assert!(off < 1e-6 && load.contacts == 16, "{label}, step {step}: {load:?}");
                let off = norm(difference(load.torque, torque)) / norm(weight);
                assert!(off < 1e-6 && norm(torque) > 1e-3, "{label}, step {step}: {load:?}, not {torque:?}");
            }
        }
    }
}

#[test]
fn what_hops_weighs_the_same_on_average() {
    for method in Method::all() {
        let scene = lying(floor(), method, 1e-4);
        let weight = mass(&scene) * GRAVITY;
        let mut simulation = scene.simulate(Precision::F64);
        let count = 5000;
        let (mut mean, mut turning) = (0.0, [0.0; 3]);
        for _ in 0..count {
            let load = only(&advance(&mut simulation, 1));
            mean += load.force[1] / f64::from(count);
            turning = [0, 1, 2].map(|c| turning[c] + load.torque[c] / f64::from(count));
        }
        assert!((mean / weight + 1.0).abs() < 1e-3, "{}: {mean} N, not {weight} N", method.name());
        let x = positions(&simulation);
        let center = [0, 1, 2].map(|c| x.iter().map(|x| x[c]).sum::<f64>() / x.len() as f64);
        let torque = cross(difference(center, AT), [0.0, -weight, 0.0]);
        // The particles are up to 0.25 m from the reference point.
        let off = norm(difference(turning, torque)) / weight;
        assert!(off < 2.5e-4, "{}: {turning:?} N m, not {torque:?}", method.name());
    }
}

#[test]
fn friction_is_part_of_the_load_as_far_as_it_goes() {
    for method in at_rest() {
        for pull in [0.4, 0.6] {
            let scene = lying(floor(), method, 1e-3).under([pull * GRAVITY, -GRAVITY, 0.0]);
            let weight = mass(&scene) * GRAVITY;
            let expected = [f64::min(pull, 0.5) * weight, -weight, 0.0];
            let mut simulation = scene.simulate(Precision::F64);
            for step in 0..20 {
                let load = only(&advance(&mut simulation, 1));
                let off = norm(difference(load.force, expected)) / weight;
                assert!(off < 1e-6, "{}, pulled by {pull}, step {step}: {load:?}", method.name());
            }
        }
    }
}

/// A sheet that is thrown onto a ball and a floor.
fn thrown(side: usize, method: Method) -> Scene {
    let mut network = sheet(side, 0.8 / side as f64, &sheet_rules(200.0, 0.02), 0.01);
    network.pins.clear();
    for i in 0..network.x.len() {
        for c in 0..3 {
            network.x[i][c] += 0.002 * scatter(3 * i + c);
            network.v[i][c] = [0.5, -3.0, 0.3][c] + 0.1 * scatter(7 * i + c);
        }
    }
    let ball = Shape::Sphere(Sphere { center: [0.3, -0.15, 0.4], radius: 0.12 });
    let ground = Shape::Plane(Plane { point: [0.0, -0.15, 0.0], normal: [0.0, 1.0, 0.0] });
    let mut scene = Scene::new(network, 5e-4).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.settings.block_size = 32;
    scene.colliders = vec![
        Collider { restitution: 0.4, velocity: [0.2, 0.1, 0.0], ..collider(ball) },
        Collider { restitution: 0.7, friction: 0.3, ..collider(ground) },
    ];
    scene
}

/// The force (N) that springs to pins and the medium give to all free particles together, in a state.
fn from_outside(Scene { network, wind, .. }: &Scene, simulation: &Simulation) -> [f64; 3] {
    let (x, v) = (positions(simulation), velocities(simulation));
    let is_pin = |particle: u32| network.pins.contains(&particle);
    let mut sum = [0.0; 3];
    for v in (0_u32..).zip(&v).filter(|(particle, _)| !is_pin(*particle)).map(|(_, v)| v) {
        sum = [0, 1, 2].map(|c| sum[c] + network.drag * (wind[c] - v[c]));
    }
    for Spring { particles: [i, j], rest_length, law, .. } in &network.springs {
        let (free, pin) = match [*i, *j].map(is_pin) {
            [false, true] => (*i as usize, *j as usize),
            [true, false] => (*j as usize, *i as usize),
            _ => continue,
        };
        let (out, apart) = (difference(x[free], x[pin]), difference(v[free], v[pin]));
        let length = norm(out);
        let rate = [0, 1, 2].map(|c| apart[c] * out[c]).iter().sum::<f64>() / length;
        let pull = law.stiffness * (length - rest_length) + law.damping * rate;
        sum = [0, 1, 2].map(|c| sum[c] - pull * out[c] / length);
    }
    sum
}

/// Takes steps, over each of which gravity, loads, and what pins and the medium give at its start must make the change of the
/// momentum; gives contacts of each collider, and rejected sub-steps.
fn conserves(scene: &Scene, steps: u32, label: &str) -> (Vec<u64>, usize) {
    let mut simulation = scene.simulate(Precision::F64);
    let pinned: f64 = scene.network.pins.iter().map(|pin| scene.network.masses[*pin as usize]).sum();
    let (mut before, mass) = (simulation.diagnose().momentum, mass(scene) - pinned);
    let (mut contacts, mut rejected) = (vec![0; scene.colliders.len()], 0);
    for step in 0..steps {
        let outside = from_outside(scene, &simulation);
        let report = advance(&mut simulation, 1);
        let after = report.diagnostics.momentum;
        let felt = [0, 1, 2].map(|c| report.loads.iter().map(|load| load.force[c]).sum::<f64>());
        let force = [0, 1, 2].map(|c| mass * scene.gravity[c] + outside[c] - felt[c]);
        let expected = [0, 1, 2].map(|c| before[c] + force[c] * scene.dt);
        let off = norm(difference(after, expected)) / (mass * GRAVITY * scene.dt);
        assert!(off < 1e-10, "{label}, step {step}: off by {off:e} of m g dt");
        before = after;
        contacts.iter_mut().zip(&report.loads[..]).for_each(|(sum, load)| *sum += load.contacts);
        rejected += report.rejections.len();
    }
    (contacts, rejected)
}

#[test]
fn gravity_and_loads_are_all_that_changes_the_momentum() {
    for method in Method::all() {
        let (contacts, _) = conserves(&thrown(8, method), 200, &method.name());
        assert!(contacts.iter().all(|contacts| *contacts > 5), "{}: {contacts:?}", method.name());
    }
}

#[test]
fn what_pins_and_the_medium_give_is_no_load() {
    // Its forces are those of the state that a step begins with.
    let mut scene = thrown(8, Method::new(Integrator::SymplecticEuler, Hessian::Absolute));
    scene.network.pins = vec![0, 7];
    for pin in [0, 7] {
        scene.network.v[pin] = [0.0; 3];
    }
    (scene.network.drag, scene.wind) = (0.02, [2.0, 0.5, -1.0]);
    let (contacts, _) = conserves(&scene, 200, "pinned, in the wind");
    assert!(contacts.iter().all(|contacts| *contacts > 5), "{contacts:?}");
}

#[test]
fn sub_steps_that_are_rejected_load_nothing() {
    let mut all = 0;
    for integrator in [Integrator::ImplicitEuler, Integrator::VelocityVerlet] {
        let method = Method::new(integrator, Hessian::Absolute);
        let mut scene = thrown(8, method).certified();
        (scene.dt, scene.settings.tolerance) = (0.01, Some(1e-5));
        let (contacts, rejected) = conserves(&scene, 10, &method.name());
        assert!(contacts.iter().all(|contacts| *contacts > 5), "{}: {contacts:?}", method.name());
        all += rejected;
    }
    assert!(all > 0, "some are rejected");
}

#[test]
fn loads_have_the_same_bits_on_any_number_of_threads_and_ranks() {
    let method = Method::new(Integrator::ImplicitEuler, Hessian::Absolute);
    let mut scene = thrown(20, method);
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 50 };
    let run = |simulation: &mut Simulation| -> Vec<Load> {
        (0..120).flat_map(|_| advance(simulation, 1).loads.to_vec()).collect()
    };
    let alone = run(&mut scene.simulate(Precision::F32));
    assert!(alone.iter().filter(|load| load.contacts > 0).count() > 40);
    for threads in 2..=4 {
        let found = with_threads(threads, || run(&mut scene.simulate(Precision::F32)));
        assert!(found == alone, "{threads} threads");
    }
    let setup = scene.setup();
    for size in 2..=3 {
        let over = on_ranks(size, 1, |ranks| {
            let (mut simulation, _) =
                Simulation::over(&setup, Precision::F32, ranks).expect("the scene is accepted");
            run(&mut simulation)
        });
        assert!(over.iter().all(|(found, _)| *found == alone), "{size} ranks");
    }
}

#[test]
fn without_colliders_there_are_no_loads() {
    let mut scene = lying(floor(), at_rest()[0], 1e-3);
    scene.colliders.clear();
    assert!(advance(&mut scene.simulate(Precision::F64), 2).loads.is_empty());
}

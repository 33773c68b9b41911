//! Springs whose ends nearly meet: no number leaves its range, by any method.

use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer, Network, NewtonSettings, spring_jacobian_x},
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Cuboid, Plane},
    },
    linalg::{PreconditionerKind, SolverSettings, Stop},
    math::{Precision, Real, Vec3, vec3},
    report::StepFailure,
    world::Simulation,
};
use nappe_tests::{
    Method, Random, Scene,
    networks::{chain, particles, sheet, sheet_rules, spring},
    scene::{positions, try_advance, velocities},
};

/// Pairs of particles of 10 g whose springs are from 0 to 1e-3 m long, and mostly longer at rest.
fn pairs(count: u32) -> Network {
    let mut random = Random::seeded(48);
    let mut power = |low: f64, high: f64| 10_f64.powf(random.between(low, high));
    let (mut x, mut v, mut springs) = (Vec::new(), Vec::new(), Vec::new());
    for pair in 0..count {
        let length = if pair % 50 == 0 { 0.0 } else { power(-24.0, -3.0) };
        let way = [power(-3.0, 0.0), power(-3.0, 0.0), power(-3.0, 0.0)];
        // About the origin, where numbers are that small.
        x.extend([[0.0; 3], way.map(|c| c * length)]);
        v.extend([[0.0; 3], way.map(|c| 0.1 * c)]);
        let rest_length = if pair % 20 == 0 { 0.0 } else { power(-6.0, 0.0) };
        let damping = if pair % 3 == 0 { 0.0 } else { power(-4.0, 0.0) };
        springs.push(spring([2 * pair, 2 * pair + 1], rest_length, power(0.0, 4.0), damping));
    }
    // One law each would be as many laws as pairs: 64 of them.
    for i in 0..springs.len() {
        springs[i].law = springs[i % 64].law;
    }
    Network { v, springs, ..particles(&x, 0.01) }
}

/// Whether all is finite, or a step was refused for another reason than that it is not.
fn stays_in_range(simulation: &mut Simulation, steps: u64) -> Result<(), String> {
    let is_lost = |failure: &StepFailure| {
        use StepFailure::{Collapsed, NotFinite, Solver};
        matches!(failure, NotFinite { .. } | Collapsed { .. } | Solver { .. })
    };
    let lost = try_advance(simulation, steps).err().filter(|error| is_lost(&error.failure));
    if let Some(error) = lost {
        return Err(error.to_string());
    }
    let numbers = [positions(simulation), velocities(simulation)];
    let is_finite = numbers.iter().flatten().flatten().all(|c| c.is_finite());
    is_finite.then_some(()).ok_or_else(|| "a number that is not finite".to_owned())
}

/// Every integrator, with every treatment of the Hessian, and every way of solving.
fn methods() -> Vec<Method> {
    let newton = NewtonSettings { tolerance: 0.01, max_iterations: 4 };
    let ways = [Minimizer::OneStep, Minimizer::Newton(newton), Minimizer::VertexBlockDescent { sweeps: 4 }];
    let (implicit, explicit): (Vec<_>, Vec<_>) =
        Integrator::ALL.into_iter().partition(|integrator| integrator.is_implicit());
    let mut methods: Vec<_> =
        explicit.into_iter().map(|integrator| Method::new(integrator, Hessian::Absolute)).collect();
    for integrator in implicit {
        for hessian in Hessian::ALL {
            methods.extend(ways.map(|minimizer| Method { minimizer, ..Method::new(integrator, hessian) }));
        }
    }
    methods
}

#[test]
fn ten_thousand_pairs_that_nearly_meet_keep_their_numbers_in_range() {
    let [many, some] = [10_000, 500].map(pairs);
    for method in methods() {
        for precision in Precision::ALL {
            let network = if method.minimizer == Minimizer::OneStep { &many } else { &some };
            let mut scene = Scene::new(network.clone(), 0.01).by(method).under([0.0, -9.81, 0.0]);
            let stop = Stop::Residual { tolerance: 1e-4, max_iterations: 30 };
            let preconditioner = PreconditionerKind::BlockJacobi;
            scene.settings.solver = SolverSettings { stop, preconditioner, ..SolverSettings::default() };
            let end = stays_in_range(&mut scene.simulate(precision), 2);
            assert_eq!(end, Ok(()), "{} in {precision}", method.name());
        }
    }
}

/// The stiffness along a spring by its block, over what it is, at the worst of random lengths.
fn worst_stiffness_along<R: Real>(hessian: Hessian) -> f64 {
    let mut random = Random::seeded(7);
    let mut worst: f64 = 0.0;
    for _ in 0..10_000 {
        let length = 10_f64.powf(random.between(R::SMALLEST.log10() + 1.0, 1.0));
        let d: Vec3<R> = vec3(random.vector().map(|c| c * length));
        let (rest_length, stiffness) = (10_f64.powf(random.between(-6.0, 0.0)), 100.0);
        let jacobian = spring_jacobian_x(&d, R::of(rest_length), R::of(stiffness), hessian);
        let (wide, u) = (jacobian.map(R::to_f64), d.map(R::to_f64).normalize());
        worst = worst.max((-u.dot(&(wide * u)) / stiffness - 1.0).abs());
    }
    worst
}

#[test]
fn the_stiffness_along_a_spring_is_known_however_short_it_is() {
    // A block a I + b d dᵀ whose a is up to 2^12 or 2^26 times as large as what is left along d, by a few roundings.
    for hessian in Hessian::ALL {
        let single = worst_stiffness_along::<f32>(hessian);
        assert!(single < 16.0 * 4096.0 * f32::ROUNDING, "{hessian:?} in f32: {single:e}");
        let double = worst_stiffness_along::<f64>(hessian);
        assert!(double < 16.0 * 67_108_864.0 * f64::ROUNDING, "{hessian:?} in f64: {double:e}");
    }
}

fn solid(shape: Shape, margin: f64) -> Collider {
    Collider {
        name: "solid".to_owned(),
        shape,
        velocity: [0.0; 3],
        way: None,
        friction: 0.0,
        restitution: 0.0,
        margin,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

#[test]
fn a_particle_that_a_plane_holds_next_to_a_pin_stays_in_range() {
    let x: Vec<_> = (0..3).map(|i| [0.1 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.1, 10.0, 0.0, 0.1);
    network.springs.push(spring([0, 2], 0.2, 1.0, 0.0));
    network.pins = vec![0];
    let plane = Plane { point: [1e-10, 0.0, 0.0], normal: [-1.0, 0.0, 0.0] };
    for method in methods() {
        for precision in Precision::ALL {
            let mut scene = Scene::new(network.clone(), 0.01).by(method);
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 200 };
            scene.colliders = vec![solid(Shape::Plane(plane), 0.0)];
            let end = stays_in_range(&mut scene.simulate(precision), 20);
            assert_eq!(end, Ok(()), "{} in {precision}", method.name());
        }
    }
}

#[test]
fn a_sheet_whose_middle_starts_inside_a_box_stays_in_range() {
    let mut network = sheet(21, 0.05, &sheet_rules(100.0, 0.02), 5e-4);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - 0.5, x[1], x[2] - 0.5]);
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let cuboid = Cuboid { center: [0.0; 3], half_extent: [0.2; 3], axes };
    for hessian in Hessian::ALL {
        for precision in Precision::ALL {
            let method = Method::new(Integrator::ImplicitEuler, hessian);
            let mut scene = Scene::new(network.clone(), 5e-3).by(method).under([0.0, -9.81, 0.0]);
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 200 };
            scene.colliders = vec![solid(Shape::Box(cuboid), 0.005)];
            let end = stays_in_range(&mut scene.simulate(precision), 5);
            assert_eq!(end, Ok(()), "{hessian:?} in {precision}");
        }
    }
}

#[test]
fn a_spring_whose_ends_nearly_meet_is_named_where_numbers_leave_their_range() {
    // So stiff that its force is out of the range of binary32, as is what it moves.
    let mut network = chain(&[[0.0; 3], [1e-4, 0.0, 0.0], [2.0, 0.0, 0.0]], 1.0, 1e38, 0.0, 1e-3);
    network.springs[1].law.stiffness = 1.0;
    let mut simulation = Scene::new(network, 1.0).certified().simulate(Precision::F32);
    let error = try_advance(&mut simulation, 1).expect_err("no number");
    let StepFailure::Collapsed { particle, other, value, rest_length } = error.failure else {
        panic!("{error}")
    };
    assert_eq!((particle, other, rest_length), (0, 1, 1.0));
    assert!((value / 1e-4 - 1.0).abs() < 1e-6, "{value} m");
    assert!(error.to_string().contains("from particle 0 to 1 is 1.0000e-4 m long"), "{error}");
}

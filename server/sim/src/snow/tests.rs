//! Bits that do not depend on company: on which particles a thread works at a time, sixteen by sixteen.

use super::{Blend, Preset, Snow, SnowObject, SnowSettings, SnowSetup, SnowStep, Transfer, step::sort_anew};
use crate::{
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Plane, Sphere},
    },
    interrupt::Interrupt,
    math::Real,
    parallel::hash_numbers,
    report::NoStopwatch,
    surroundings::Surroundings,
};

/// Side of a cell (m).
const CELL: f64 = 0.05;

/// Number between 0 and 1 without an order.
fn random(i: usize, salt: u64) -> f64 {
    (hash_numbers(salt, [i as f64]) >> 11) as f64 / (1_u64 << 53) as f64
}

fn object(name: &str, x: Vec<[f64; 3]>, v: impl Fn(usize) -> [f64; 3]) -> SnowObject {
    let snow = Preset::from_name("stomakhin").expect("a preset");
    let volume = (0.5 * CELL).powi(3);
    SnowObject {
        name: name.to_owned(),
        v: (0..x.len()).map(v).collect(),
        angular_velocity: [0.0; 3],
        mass: vec![snow.density * volume; x.len()],
        volume: vec![volume; x.len()],
        stiffness: Vec::new(),
        material: snow.material,
        x,
        attach: None,
    }
}

/// A block that falls onto a floor and a ball that moves, and a spray so thin that most blocks of the grid have one particle.
fn setup(transfer: Transfer) -> SnowSetup {
    let lattice =
        (0..9 * 9 * 9).map(|i| [i % 9, i / 9 % 9, i / 81].map(|c| 0.5 * CELL * (f64::from(c) + 0.5)));
    let spray = (0..400).map(|i| [1, 2, 3].map(|salt| 3.0 * random(i, salt) - 1.0)).collect();
    let thrown = |i: usize| [4, 5, 6].map(|salt| 16.0 * random(i, salt) - 8.0);
    let objects =
        vec![object("block", lattice.collect(), |_| [0.0, -4.0, 0.0]), object("spray", spray, thrown)];
    let mut settings = SnowSettings::new(CELL);
    settings.transfer = transfer;
    SnowSetup { objects, settings }
}

fn colliders() -> Vec<Collider> {
    let collider = |name: &str, shape, velocity| Collider {
        name: name.to_owned(),
        shape,
        velocity,
        way: None,
        friction: 0.3,
        restitution: 0.0,
        margin: 0.0,
        contact: Contact::Separating,
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    };
    let floor = Plane { point: [0.0, -0.02, 0.0], normal: [0.0, 1.0, 0.0] };
    let ball = Sphere { center: [0.6, 0.2, 0.2], radius: 0.15 };
    vec![
        collider("floor", Shape::Plane(floor), [0.0; 3]),
        collider("ball", Shape::Sphere(ball), [-3.0, 0.0, 0.0]),
    ]
}

/// What each step tells, and how all particles end: as bits, by the user's numbers.
fn run<R: Real>(transfer: Transfer, seed: Option<u64>) -> (Vec<String>, Vec<Vec<u64>>) {
    let (mut snow, _) = Snow::<R>::new(&setup(transfer)).expect("good snow");
    snow.work.sorter.chunks.seed = seed;
    sort_anew(&snow.model, &snow.state.particles, &mut snow.work);
    let (interrupt, colliders) = (Interrupt::default(), colliders());
    let mut told = Vec::new();
    for step in 0..12 {
        let around = Surroundings {
            dt: 0.004,
            gravity: [0.0, -9.81, 0.0],
            wind: [0.0; 3],
            colliders: &colliders,
            time: 0.004 * f64::from(step),
            steps: 1.0,
            interrupt: &interrupt,
        };
        let step: SnowStep = snow.step(&around, &mut NoStopwatch).expect("a stable step");
        told.push(format!("{step:?} {:?}", snow.work.totals.given.to_bits()));
    }
    let particles = &snow.state.particles;
    let mut ends = vec![Vec::new(); particles.len()];
    for at in 0..particles.len() {
        let numbers =
            particles.x(at).into_iter().chain(particles.v(at)).chain(particles.f_e(at).into_iter().flatten());
        let numbers = numbers.chain(particles.c(at).into_iter().flatten()).chain(particles.v0_tau(at));
        let numbers = numbers.chain([particles.plastic_ratio(at)]);
        ends[particles.id[at] as usize] = numbers.map(|number| number.to_f64().to_bits()).collect();
    }
    (told, ends)
}

#[test]
fn chunks_that_are_cut_anywhere_have_the_same_bits() {
    let flip = Transfer::PicFlip(Blend::PerStep(0.95));
    // Without optimisation a step costs many times as much.
    let transfers =
        if cfg!(debug_assertions) { &[Transfer::Mls][..] } else { &[Transfer::Mls, Transfer::Apic, flip] };
    for &transfer in transfers {
        let expected = run::<f32>(transfer, None);
        for seed in 1..if cfg!(debug_assertions) { 2 } else { 6 } {
            assert!(run::<f32>(transfer, Some(seed)) == expected, "{transfer:?}, {seed}");
        }
    }
    let expected = run::<f64>(Transfer::Mls, None);
    for seed in 1..if cfg!(debug_assertions) { 2 } else { 4 } {
        assert!(run::<f64>(Transfer::Mls, Some(seed)) == expected, "{seed}");
    }
}

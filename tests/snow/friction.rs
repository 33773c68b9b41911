//! A block on an incline, a particle in a half-pipe, a heap.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use nappe_sim::{
    collide::{Collider, Contact, Shape, StartInside, shape::HalfPipe},
    math::Precision,
    snow::{Kernel, Material, ParticleState, Preset, Transfer},
    time_step::TimeStep,
};
use nappe_tests::{
    networks::scatter,
    scene::{advance, norm},
    snow::{SnowScene, Variant, center, elastic, lattice, object, plane, settle},
    threads::with_threads,
};

const DENSITY: f64 = 400.0;
const GRAVITY: f64 = 9.81;
const MLS: Variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };

/// A block of 4 x 4 x 4 cells that lies on a plane, with gravity inclined by `angle` against it.
fn block(young: f64, friction: f64, angle: f64, dt: f64) -> SnowScene {
    let h = 0.1;
    let x = lattice([0.0; 3], [8; 3], [0.5 * h; 3]);
    let body = object("block", x, (0.5 * h).powi(3), DENSITY, elastic(young, 0.2));
    let gravity = [GRAVITY * angle.sin(), -GRAVITY * angle.cos(), 0.0];
    let mut scene = SnowScene::new(vec![body], h, dt).by(MLS).under(gravity);
    scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, friction)];
    scene
}

#[test]
fn a_block_slides_down_an_incline_by_coulombs_law() {
    let (angle, friction) = (24.0_f64.to_radians(), 15.0_f64.to_radians().tan());
    // It slides from the start: a block at rest is first held while its shear builds up.
    let speed = 1.0;
    // As snow, and a hundred times as stiff; symplectic Euler alone adds dt / t.
    for (young, dt, steps) in [(1.4e5, 1e-3, 10), (1.4e7, 1e-4, 100)] {
        let scene = block(young, friction, angle, dt).grouped(steps).moving(|_| [speed, 0.0, 0.0]);
        let (mut simulation, masses) = (scene.simulate(Precision::F64), scene.masses());
        let middle = |particles: &[ParticleState]| center(particles, &masses, |_| true)[0];
        let start = middle(&simulation.snow_particles());
        advance(&mut simulation, 500);
        let (moved, t) = (middle(&simulation.snow_particles()) - start - 5.0 * speed, 5.0);
        let exact = 0.5 * GRAVITY * t * t * (angle.sin() - friction * angle.cos());
        let off = moved / exact - 1.0;
        println!("incline, {young:e} Pa: slid {moved:.4} m further in 5 s, exact {exact:.4} m ({off:+.1e})");
        assert!(off.abs() < 1e-3, "{young:e} Pa: {off:e}");
    }
}

#[test]
fn a_block_that_friction_holds_does_not_move() {
    // A hundred thousand steps of sixty-four particles: no work to share.
    with_threads(1, hold_a_block);
}

fn hold_a_block() {
    let (angle, friction) = (24.0_f64.to_radians(), 30.0_f64.to_radians().tan());
    // As stiff as ice: what is soft takes longer to come to rest.
    let (h, young): (f64, f64) = (0.1, 1.4e9);
    let x = lattice([0.0; 3], [4; 3], [0.5 * h; 3]);
    let body = object("block", x, (0.5 * h).powi(3), DENSITY, elastic(young, 0.2));
    let mut scene = block(young, friction, angle, 3e-5);
    scene.objects = vec![body];
    let mut simulation = scene.simulate(Precision::F64);
    let steps = settle(&mut simulation, 3000, 100_000, |_| {});
    let before = simulation.snow_particles();
    let mut scene = scene.grouped(1000);
    scene.settings.max_substeps = 2000;
    let mut simulation = scene.simulate(Precision::F64);
    simulation.restore_snow(&before);
    advance(&mut simulation, 34);
    let moved =
        before.iter().zip(simulation.snow_particles()).map(|(a, b)| norm([0, 1, 2].map(|i| a.x[i] - b.x[i])));
    let moved = moved.fold(0.0, f64::max);
    println!("incline: held for 1 s, moved {moved:.1e} m (settled in {steps} steps)");
    assert!(moved < 1e-9, "{moved:e} m");
}

#[test]
fn a_particle_in_a_half_pipe_is_as_fast_as_it_fell() {
    let (radius, h): (f64, f64) = (1.0, 0.01);
    for transfer in [Transfer::Mls, Transfer::Apic, Transfer::PicFlip(nappe_sim::snow::Blend::PerStep(1.0))] {
        // Released at the wall, below the rim.
        let slope = 75.0_f64.to_radians();
        let start = [-radius * slope.sin(), -radius * slope.cos(), 0.0];
        let body = object("bead", vec![start], (0.5 * h).powi(3), DENSITY, elastic(1.4e5, 0.2));
        let variant = Variant { kernel: Kernel::Quadratic, transfer };
        let mut scene = SnowScene::new(vec![body], h, 1e-4).by(variant).under([0.0, -GRAVITY, 0.0]);

        // It keeps its affine field, as all do that are not ballistic: those are points.
        scene.settings.ballistic_below = 0.0;
        scene.colliders = vec![Collider {
            name: "pipe".to_owned(),
            shape: Shape::HalfPipe(HalfPipe {
                point: [0.0; 3],
                axis: [0.0, 0.0, 1.0],
                up: [0.0, 1.0, 0.0],
                radius,
            }),
            velocity: [0.0; 3],
            way: None,
            friction: 0.0,
            restitution: 0.0,
            margin: 0.0,
            contact: Contact::Slip,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }];
        let mut simulation = scene.simulate(Precision::F64);
        let mut last = simulation.snow_particles()[0];
        let exact = (2.0 * GRAVITY * (radius + start[1])).sqrt();
        let mut fastest = 0.0_f64;

        while last.x[0] < 0.0 {
            advance(&mut simulation, 1);
            last = simulation.snow_particles()[0];
            fastest = fastest.max(norm(last.v));
            assert!(simulation.time() < 3.0, "{transfer:?}: it stays at {:?}", last.x);
        }

        let off = norm(last.v) / exact - 1.0;
        println!(
            "half-pipe, {transfer:?}: {:.5} m/s at the bottom, exact {exact:.5} ({off:+.1e})",
            norm(last.v)
        );
        if !matches!(transfer, Transfer::PicFlip(_)) {
            assert!(off.abs() < 1e-3, "{transfer:?}: {off:e}");
        }
    }
}

/// Slopes at which heaps of snow come to rest, from grains of 4 to 5 mm to fluffy snow (degrees).
const REPOSE: std::ops::RangeInclusive<f64> = 37.0..=53.0;

/// A column of loose grains, 0.5 m wide and 1.7 m high, after 2.5 s on a rough floor: height of the
/// surface (m) by distance from the axis in rings of a cell, and speed of the fastest particle (m/s).
fn column(h: f64, material: Material) -> (Vec<f64>, f64) {
    // Every place of a lattice with a random shift; six tenths of it are snow.
    let mut x = lattice([-0.25, 0.0, -0.25], [12, 40, 12], [0.5 / 12.0; 3]);
    for (i, x) in x.iter_mut().enumerate() {
        (0..3).for_each(|a| x[a] += 0.01 * scatter(3 * i + a));
        x[1] += h;
    }
    let body = object("snow", x, (0.5 / 12.0_f64).powi(3) * 0.6, DENSITY, material);
    let mut scene = SnowScene::new(vec![body], h, 1.0 / 60.0).by(MLS).under([0.0, -GRAVITY, 0.0]);
    scene.settings.time_step = TimeStep::default();
    scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.6)];
    let mut simulation = scene.simulate(Precision::F32);
    advance(&mut simulation, 150);
    let report = advance(&mut simulation, 1).snow.expect("a report of the snow");
    let mut surface = vec![0.0_f64; 40];

    for p in &simulation.snow_particles() {
        let ring = (p.x[0].hypot(p.x[2]) / h) as usize;
        assert!(ring < surface.len(), "a particle went {:.2} m away", p.x[0].hypot(p.x[2]));
        surface[ring] = surface[ring].max(p.x[1]);
    }

    (surface, report.max_speed)
}

/// Slope (degrees) of a surface by rings, from a fifth to four fifths of its height.
fn slope(surface: &[f64], h: f64) -> f64 {
    let top = surface.iter().copied().fold(0.0, f64::max);
    let reach = |share: f64| surface.iter().rposition(|y| *y > share * top).expect("a heap") as f64 * h;
    (0.6 * top / (reach(0.2) - reach(0.8)).max(h)).atan().to_degrees()
}

/// Brasseur's and Stomakhin's snow is one piece: a column of it settles and stands. Half as stiff, and
/// broken by six tenths of the stretch, it is loose, and comes to rest at a slope of coarse snow: where
/// a column breaks and where it stands lie close together, and this one breaks at any length of the step.
#[test]
fn loose_snow_comes_to_rest_as_a_heap() {
    let h = 0.05;
    let firm = Preset::from_name("stomakhin").expect("a preset").material;
    let mut loose = firm;
    loose.young *= 0.5;
    let plasticity = loose.plasticity.as_mut().expect("snow yields");
    plasticity.critical_stretch = 4.5e-3;
    let found = [firm, loose].map(|material| {
        let (surface, fastest) = column(h, material);
        assert!(fastest < 0.3, "it has come to rest: {fastest} m/s");
        (surface.iter().copied().fold(0.0, f64::max), slope(&surface, h), surface)
    });

    let [(height, angle, _), (heap, repose, surface)] = &found;
    println!("heap: firm {height:.2} m at {angle:.0} degrees, loose {heap:.2} m at {repose:.0} degrees");
    assert!(*height > 1.2 && *angle > 80.0, "firm snow stands: {height} m, {angle} degrees");
    assert!(REPOSE.contains(repose), "{repose} degrees, asked {REPOSE:?}");

    // A heap: no ring stands out above those within it by more than a cell.
    assert!(surface.windows(2).all(|pair| pair[1] < pair[0] + h), "{surface:.2?}");
}

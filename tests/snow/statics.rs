//! Statics: a column under its own weight, the bulk modulus, the oedometer.
#![allow(clippy::print_stdout, reason = "measured values beside the limits")]

use nappe_sim::{
    collide::{Collider, Contact},
    math::Precision,
    snow::{Kernel, ParticleState, Plasticity, Preset, Transfer},
    world::Simulation,
};
use nappe_tests::{
    scene::{advance, norm},
    snow::{SnowScene, Variant, elastic, lattice, object, plane, settle, wave_modulus},
};

const H: f64 = 0.05;
const DENSITY: f64 = 400.0;

const GRAVITY: f64 = 9.81;

/// A column along y, endless across; one particle a cell across, two along.
fn column(variant: Variant, low: f64, cells: usize, h: f64) -> SnowScene {
    let material = elastic(1.4e7, 0.2);
    let x = lattice([0.0, low, 0.0], [4, 2 * cells, 4], [h, 0.5 * h, h]);
    let body = object("column", x, 0.5 * h.powi(3), DENSITY, material);
    let dt = 0.5 * h / (wave_modulus(&material) / DENSITY).sqrt();
    SnowScene::new(vec![body], h, dt).by(variant).periodic([1, 0, 1])
}

/// Displacement (m) at height y of a column of this length that stands on y = 0.
fn sag(scene: &SnowScene, length: f64, y: f64) -> f64 {
    -DENSITY * GRAVITY * (length * y - 0.5 * y * y) / wave_modulus(&scene.objects[0].material)
}

#[test]
fn a_column_sags_under_its_own_weight_by_the_closed_form() {
    let length = 20.0 * H;
    for variant in Variant::affine() {
        // Two columns, foot to foot: the foot stays where it is by symmetry.
        let scene = column(variant, -length, 40, H);
        let (start, dt) = (&scene.objects[0].x, scene.dt);
        let mut simulation = scene.simulate(Precision::F64);
        let steps = settle(&mut simulation, 20, 100_000, |s| {
            s.kick_snow(|i, _, _| [0.0, -GRAVITY * dt * start[i as usize][1].signum(), 0.0]);
        });
        let mut worst = 0.0_f64;

        for (p, x) in simulation.snow_particles().iter().zip(start).filter(|(_, x)| x[1] > 0.0) {
            worst = worst.max((p.x[1] - x[1] - sag(&scene, length, x[1])).abs());
        }
        let off = worst / sag(&scene, length, length).abs();
        println!("column, {}: off by {off:.2e} of the top's, {steps} steps", variant.name());
        assert!(off < 5e-3, "{}: {off:e}", variant.name());
    }
}

/// A wall stops the nodes within it, which is not where a column ends: the column stands as if it
/// went on for a part of a cell, and less so on finer grids.
#[test]
fn a_wall_holds_a_column_within_half_a_cell_of_its_surface() {
    for contact in [Contact::Sticky, Contact::Slip, Contact::Separating] {
        for variant in Variant::affine() {
            let offsets = [20, 40].map(|cells| {
                let (length, h) = (1.0, 1.0 / cells as f64);
                let mut scene = column(variant, 0.0, cells, h).under([0.0, -GRAVITY, 0.0]);
                scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], contact, 0.0)];
                let mut simulation = scene.simulate(Precision::F64);
                settle(&mut simulation, 20, 100_000, |_| {});
                let top =
                    scene.objects[0].x.iter().map(|x| x[1]).enumerate().max_by(|a, b| a.1.total_cmp(&b.1));
                let (index, y) = top.expect("particles");
                let fall = simulation.snow_particles()[index].x[1] - y;

                // Over the strain at the foot: how far the wall seems to be from its place.
                let strain = DENSITY * GRAVITY * length / wave_modulus(&scene.objects[0].material);
                (sag(&scene, length, y) - fall) / strain / h
            });

            println!("column, {} {}: the wall is off by {offsets:.3?} cells", contact.name(), variant.name());

            for offset in offsets {
                assert!(offset.abs() < 0.5, "{} {}: {offset}", contact.name(), variant.name());
            }
        }
    }
}

/// Mean position along an axis of the particles that began at `layer` (m) along it.
fn layer(particles: &[ParticleState], start: &[[f64; 3]], axis: usize, layer: f64, inner: f64) -> f64 {
    let mut sum = [0.0; 2];
    for (p, x) in particles.iter().zip(start) {
        let within = (0..3).filter(|a| *a != axis).all(|a| x[a].abs() < inner);
        if within && (x[axis] - layer).abs() < 1e-9 {
            sum = [sum[0] + p.x[axis], sum[1] + 1.0];
        }
    }
    sum[0] / sum[1]
}

#[test]
fn pressure_over_compaction_is_the_bulk_modulus() {
    for variant in Variant::affine() {
        let material = elastic(1.4e5, 0.2);
        let bulk = material.lambda() + 2.0 / 3.0 * material.mu();
        let speed = (wave_modulus(&material) / DENSITY).sqrt();
        let half = 4.0 * H;
        let x = lattice([-half; 3], [16; 3], [0.5 * H; 3]);
        let body = object("cube", x, (0.5 * H).powi(3), DENSITY, material);
        let mut scene = SnowScene::new(vec![body], H, 0.4 * H / speed).by(variant);

        // Six walls close in at a five thousandth of the speed of sound.
        for axis in 0..3 {
            for side in [-1.0, 1.0] {
                let along = |value: f64| [0, 1, 2].map(|a| if a == axis { value } else { 0.0 });
                let wall = plane(along(side * half), along(-side), Contact::Slip, 0.0);
                scene.colliders.push(Collider { velocity: along(-side * 2e-4 * speed), ..wall });
            }
        }

        let mut simulation = scene.simulate(Precision::F64);
        let (mut ratio, mut compaction) = (0.0, 0.0);
        let (mut sum, inner, at) = ([0.0; 2], 2.0 * H, 1.75 * H);

        for _ in 0..10 {
            advance(&mut simulation, 30);
            let (particles, start) = (simulation.snow_particles(), &scene.objects[0].x);
            let stretch = |a| {
                let [high, low] = [at, -at].map(|place| layer(&particles, start, a, place, inner));
                (high - low) / (2.0 * at)
            };
            compaction = -(stretch(0) * stretch(1) * stretch(2)).ln();
            let inside = particles.iter().zip(start).filter(|(_, x)| x.iter().all(|c| c.abs() < inner));
            let (mut pressure, mut count) = (0.0, 0.0);

            for (p, _) in inside {
                let tau = p.volume_stress.expect("a particle tells its stress");
                let volume = (0.5 * H).powi(3) * determinant(&p.elastic);
                pressure -= (tau[0] + tau[1] + tau[2]) / 3.0 / volume;
                count += 1.0;
            }

            sum = [sum[0] + pressure / count, sum[1] + compaction];
            ratio = sum[0] / sum[1] / bulk;
        }

        println!("bulk modulus, {}: p / (-ln J) is {ratio:.5} K at -ln J = {compaction:.4}", variant.name());
        assert!((0.002..0.05).contains(&compaction), "{}: -ln J = {compaction}", variant.name());
        assert!((ratio - 1.0).abs() < 1e-2, "{}: {ratio}", variant.name());
    }
}

fn determinant(f: &[[f64; 3]; 3]) -> f64 {
    f[0][0] * (f[1][1] * f[2][2] - f[1][2] * f[2][1]) - f[0][1] * (f[1][0] * f[2][2] - f[1][2] * f[2][0])
        + f[0][2] * (f[1][0] * f[2][1] - f[1][1] * f[2][0])
}

/// Axial Cauchy stress (Pa) of snow compressed along one axis from rest to a volume ratio, by
/// integration in small steps: elastic until the critical compression, then hardening.
fn oedometer(preset: &Preset, volume_ratio: f64) -> f64 {
    let (m, count) = (&preset.material, 20_000);
    let Plasticity { critical_compression, hardening, .. } = m.plasticity.expect("snow yields");
    let (mut elastic, mut plastic) = (1.0, 1.0);
    let step = volume_ratio.powf(1.0 / f64::from(count));
    for _ in 0..count {
        let trial = elastic * step;
        elastic = f64::max(trial, 1.0 - critical_compression);
        plastic *= trial / elastic;
    }
    let factor = (hardening * (1.0 - plastic)).exp();
    let tau = 2.0 * m.mu() * (elastic - 1.0) * elastic + m.lambda() * (elastic - 1.0) * elastic;
    factor * tau / (elastic * plastic)
}

/// Axial stress against compaction of a layer in the middle of a column pressed from both ends.
#[test]
fn snow_in_an_oedometer_hardens_as_its_law_says() {
    let preset = Preset::from_name("stomakhin").expect("a preset");
    for kernel in [Kernel::Quadratic, Kernel::Cubic] {
        let variant = Variant { kernel, transfer: Transfer::Mls };
        let speed = (wave_modulus(&preset.material) / preset.density).sqrt();
        let cells = 16;
        let x = lattice([0.0, -8.0 * H, 0.0], [4, 4 * cells, 4], [H, 0.25 * H, H]);
        let body = object("column", x, 0.25 * H.powi(3), preset.density, preset.material);
        let mut scene = SnowScene::new(vec![body], H, 0.08 * H / speed).by(variant).periodic([1, 0, 1]);
        let approach = 0.004 * speed;

        for side in [-1.0, 1.0] {
            let wall = plane([0.0, side * 8.0 * H, 0.0], [0.0, -side, 0.0], Contact::Sticky, 0.0);
            scene.colliders.push(Collider { velocity: [0.0, -side * approach, 0.0], ..wall });
        }
        // Start on the way: no shock from the ends.
        let scene = scene.moving(|x| [0.0, -approach * x[1] / (8.0 * H), 0.0]);
        let mut simulation = scene.simulate(Precision::F64);
        let mut compared = 0;

        for _ in 0..12 {
            advance(&mut simulation, 420);
            compared += usize::from(compare_middle(&simulation, &scene, &preset, variant));
        }
        assert!(compared >= 6, "{}: the snow yields within the test", variant.name());
    }
}

/// Compares the middle half of the column with the law; says whether it has yielded.
fn compare_middle(simulation: &Simulation, scene: &SnowScene, preset: &Preset, variant: Variant) -> bool {
    let (particles, start) = (simulation.snow_particles(), &scene.objects[0].x);
    let at = 1.875 * H;
    let [high, low] = [at, -at].map(|place| layer(&particles, start, 1, place, f64::INFINITY));
    let volume_ratio = (high - low) / (2.0 * at);
    let middle = particles.iter().zip(start).filter(|(_, x)| x[1].abs() < at);
    let (mut stress, mut plastic, mut count) = (0.0, 0.0, 0.0);

    for (p, _) in middle {
        let volume = 0.25 * H.powi(3) * determinant(&p.elastic) * p.plastic_ratio;
        stress += p.volume_stress.expect("a particle tells its stress")[1] / volume;
        plastic += p.plastic_ratio;
        count += 1.0;
    }

    let (stress, plastic) = (stress / count, plastic / count);
    let law = oedometer(preset, volume_ratio);
    let off = stress / law - 1.0;
    println!(
        "oedometer, {}: J = {volume_ratio:.4}, J_P = {plastic:.4}: {stress:.0} Pa, law {law:.0} Pa ({off:+.1e})",
        variant.name()
    );
    assert!(
        norm([0.0, off, 0.0]) < 1e-2,
        "{}: {stress} Pa at J = {volume_ratio}, law {law} Pa",
        variant.name()
    );
    plastic < 0.995
}

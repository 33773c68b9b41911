//! Energy over long runs of certified steps: the length of a step must not follow the motion.
//!
//! Reads scenes that once gained energy without end; the largest energy, and how runs end.

use nappe_sim::{
    cloth::{ClothSettings, Integrator},
    collide::{Collider, Contact, Shape, shape::Plane},
    math::Precision,
    report::StepFailure,
    snow::{Kernel, Transfer},
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    Scene,
    networks::{DrapSprings, drap, sheet, sheet_rules},
    scene::{advance, try_advance},
    snow::{SnowScene, Variant, elastic, object},
};

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;

/// Kinetic energy, that of affine velocities included, and elastic energy (J).
fn energy(simulation: &Simulation, scene: &SnowScene) -> f64 {
    let found = simulation.diagnose();
    let moment = match scene.settings.transfer {
        Transfer::PicFlip(_) => 0.0,
        Transfer::Apic | Transfer::Mls => H * H / scene.settings.kernel.inverse_moment(),
    };
    let of = |c: [[f64; 3]; 3]| c.as_flattened().iter().map(|c| c * c).sum::<f64>();
    let particles = simulation.snow_particles();
    let affine = particles.iter().zip(scene.masses()).map(|(p, m)| 0.5 * m * moment * of(p.affine));
    found.kinetic_energy + found.elastic_energy + affine.sum::<f64>()
}

/// Two to four elastic particles within a cell that meet at a share of the speed of waves, free or near a wall.
fn clump(seed: u64, variant: Variant, share: f64, wall: Option<Contact>) -> SnowScene {
    let mut random = fastrand::Rng::with_seed(seed);
    let mut draw = move || random.f64();
    let material = elastic(1e6, 0.4 * draw());
    let count = 2 + (3.0 * draw()) as usize;
    let corner = [draw(), draw(), draw()].map(|c| c * H);
    let x: Vec<[f64; 3]> = (0..count).map(|_| corner.map(|c| c + 0.8 * H * draw())).collect();
    let center = [0, 1, 2].map(|a| x.iter().map(|x| x[a]).sum::<f64>() / count as f64);
    let wave = ((material.lambda() + 2.0 * material.mu()) / DENSITY).sqrt();
    let mut body = object("clump", x.clone(), (0.5 * H).powi(3), DENSITY, material);
    for (x, v) in x.iter().zip(&mut body.v) {
        let inwards = [0, 1, 2].map(|a| center[a] - x[a]);
        let length = inwards.iter().map(|c| c * c).sum::<f64>().sqrt();
        *v = inwards.map(|c| share * wave * (0.8 * c / length + 0.4 * (draw() - 0.5)));
    }
    // From a step of the world that takes one or two sub-steps to one that takes hundreds.
    let alone = H * (DENSITY / (2.0 * material.mu() + 3.0 * material.lambda())).sqrt();
    let dt = alone * [1.3, 5.0, 40.0, 200.0][seed as usize % 4] * (1.0 + draw());
    let mut scene = SnowScene::new(vec![body], H, dt).by(variant);
    scene.settings.time_step = TimeStep::default();
    scene.colliders = wall.into_iter().map(|contact| near_wall(&x, contact, draw())).collect();
    scene
}

/// A wall that lies up to a fifth of a cell beside particles, slanted or not.
fn near_wall(x: &[[f64; 3]], contact: Contact, place: f64) -> Collider {
    let normal = if place < 0.5 { [0.0, 1.0, 0.0] } else { [0.6, 0.8, 0.0] };
    let height = |x: &[f64; 3]| (0..3).map(|a| x[a] * normal[a]).sum::<f64>();
    let lowest = x.iter().map(height).fold(f64::INFINITY, f64::min) - 0.2 * H * place;
    let shape = Shape::Plane(Plane { point: normal.map(|n| n * lowest), normal });
    let name = "wall".to_owned();
    Collider { name, shape, velocity: [0.0; 3], friction: 0.0, restitution: 0.0, margin: 0.0, contact }
}

/// The largest energy within so many sub-steps over that of the start, or none where the run ended by name.
fn growth(scene: &SnowScene, precision: Precision, substeps: u32) -> Option<f64> {
    let mut simulation = scene.simulate(precision);
    let start = energy(&simulation, scene);
    let (mut largest, mut taken) = (start, 0);
    while taken < substeps {
        match try_advance(&mut simulation, 1) {
            Ok(report) => taken += report.snow.expect("snow").substeps,
            Err(error) => {
                assert!(matches!(error.failure, StepFailure::EnergyGain { .. }), "{error}");
                return None;
            }
        }
        largest = energy(&simulation, scene).max(largest);
    }
    Some(largest / start)
}

/// Clumps of every smooth kernel and transfer, speed, wall and precision in turn: their largest growth.
pub(crate) fn worst_growth(count: u64, substeps: u32) -> f64 {
    let variants: Vec<_> = Variant::all().into_iter().filter(|v| v.kernel != Kernel::Linear).collect();
    let walls = [None, Some(Contact::Slip), Some(Contact::Separating)];
    let mut worst = 0.0_f64;
    for seed in 0..count {
        let variant = variants[seed as usize % variants.len()];
        let nth = seed / variants.len() as u64;
        let (share, wall) = ([0.01, 0.05, 0.1][nth as usize % 3], walls[nth as usize / 3 % 3]);
        let scene = clump(seed, variant, share, wall);
        let precision = if nth.is_multiple_of(2) { Precision::F64 } else { Precision::F32 };
        let found = growth(&scene, precision, substeps).unwrap_or_default();
        assert!(found < 2.5, "clump {seed}, {}: {found} times its energy", variant.name());
        worst = worst.max(found);
    }
    worst
}

#[test]
fn small_clumps_of_snow_never_come_to_more_than_their_energy() {
    // Without held lengths, 15 of these came to up to 1e4 times theirs.
    let worst = worst_growth(72, 5_000);
    assert!(worst < 1.01, "{worst}");
}

#[test]
fn two_particles_that_meet_do_not_come_to_more_energy_than_they_had() {
    // At 0.9 of the bound on linear motion, and steps that followed it: from 0.0125 J to 98 J in 8 s.
    let x = [[0.03, 0.05, 0.05], [0.07, 0.06, 0.07]];
    let mut body = object("two", x.to_vec(), (0.5 * H).powi(3), DENSITY, elastic(1e6, 0.2));
    body.v = vec![[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]];
    let mut scene = SnowScene::new(vec![body], H, 0.04);
    scene.settings.time_step = TimeStep::default();
    let grown = growth(&scene, Precision::F64, 20_000).expect("it does not gain");
    assert!(grown < 1.01, "{grown}");
}

#[test]
fn the_cloth_of_the_course_gains_no_more_than_its_method_swings_by() {
    // Its motion has 193 J. With a length that followed the bound it gained 348 J by velocity Verlet at 10 ms, 1600 J by
    // symplectic Euler.
    for integrator in
        [Integrator::SymplecticEuler, Integrator::VelocityVerlet, Integrator::VelocityVerletPredicted]
    {
        for dt in [2e-3, 3e-3, 5e-3, 7e-3, 0.01, 0.013, 0.017, 0.02, 0.03, 0.04] {
            let mut scene = Scene::new(drap(10, DrapSprings::Faces, 0.0), dt).under([0.0, -9.81, 0.0]);
            scene.settings = ClothSettings { integrator, time_step: TimeStep::default(), ..scene.settings };
            let mut simulation = scene.simulate(Precision::F32);
            let start = simulation.diagnose().total_energy();
            let mut gained = 0.0_f64;
            for _ in 0..(10.0 / dt) as u32 {
                gained = gained.max(advance(&mut simulation, 1).diagnostics.total_energy() - start);
            }
            assert!(gained < 0.1 * 193.0, "{integrator:?}, dt {dt}: {gained} J");
        }
    }
}

#[test]
fn a_damped_fall_by_explicit_euler_is_not_ended_for_the_error_of_its_method() {
    // Nothing moves at the start, and h² g² m / 2 per step is what explicit Euler adds to a fall.
    let mut network = sheet(8, 0.13, &sheet_rules(350.0, 0.4), 0.05);
    network.pins = vec![0, 37];
    network.drag = 0.05;
    let mut scene = Scene::new(network, 2e-4).under([0.0, -9.81, 0.0]);
    scene.wind = [1.5, 0.0, -0.7];
    scene.settings = ClothSettings {
        integrator: Integrator::ExplicitEuler,
        time_step: TimeStep::default(),
        ..scene.settings
    };
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 2_000);

    // Undamped, the same error is growth, and is called so.
    let still = scene.settings.integrator;
    let mut free = Scene::new(drap(10, DrapSprings::Faces, 0.0), 5e-3).under([0.0, -9.81, 0.0]);
    free.settings = ClothSettings { integrator: still, time_step: TimeStep::default(), ..free.settings };
    assert!(Simulation::new(&free.setup(), Precision::F64).is_err(), "no step is stable");
}

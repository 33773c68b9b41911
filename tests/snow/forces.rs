//! Forces of a rotated and sheared block: their power is the loss of elastic energy, they push and
//! turn nothing as a whole, and without stress there is free flight.

use nappe_sim::{
    math::{Mat3, Precision},
    snow::{GridNode, Material, Plasticity, Preset, constitutive_scalar::energy_density},
};
use nappe_tests::{
    Random,
    scene::{cross, norm},
    snow::{SnowScene, Variant, elastic, lattice, object, rework, step_once},
};

use crate::reference::{matrix, nodes_near, rows};

const H: f64 = 0.1;
/// Volume at rest (m³) of a particle: neither that of a cell nor 1.
const VOLUME: f64 = 1.1e-4;
const DENSITY: f64 = 400.0;

/// Forces (N) on the nodes of a block at rest, and its particles: places, F_E, J_P.
struct Probe {
    material: Material,
    variant: Variant,
    forces: Vec<([i32; 3], [f64; 3])>,
    particles: Vec<([f64; 3], Mat3<f64>, f64)>,
}

/// What a step makes of a block at rest: momenta are dt times forces.
fn probe(variant: Variant, material: Material) -> Probe {
    let mut random = Random::seeded(31);
    let x: Vec<_> = lattice([-0.23, 0.11, -0.42], [7, 6, 5], [0.5 * H; 3])
        .into_iter()
        .map(|x| x.map(|c| c + 0.01 * random.number()))
        .collect();
    let body = object("block", x.clone(), VOLUME, DENSITY, material);
    let dt = 1e-6;
    let mut simulation = SnowScene::new(vec![body], H, dt).by(variant).simulate(Precision::F64);
    let turn = random.rotation();
    let shear = Mat3::new(1.0, 0.12, -0.05, 0.0, 0.97, 0.08, 0.0, 0.0, 1.04);
    let mut particles = Vec::new();
    rework(&mut simulation, |i, p| {
        let f = turn * shear * (Mat3::identity() + random.matrix() * 0.02);
        p.elastic = rows(&f);
        if material.plasticity.is_some() {
            p.plastic_ratio = random.between(0.9, 1.05);
        }
        particles.push((x[i], matrix(&p.elastic), p.plastic_ratio));
    });

    step_once(&mut simulation);
    let mut nodes: Vec<GridNode> = Vec::new();
    simulation.grid_nodes(&mut nodes);
    let forces = nodes.iter().map(|n| (n.index, n.velocity.map(|v| n.mass * v / dt))).collect();
    Probe { material, variant, forces, particles }
}

fn materials() -> [Material; 3] {
    let hardening = Preset::from_name("stomakhin").expect("a preset").material;
    // Yield limits play no part in forces: F_E lies beyond them here, as a predictor does.
    let plasticity =
        hardening.plasticity.map(|p| Plasticity { critical_stretch: 0.5, critical_compression: 0.5, ..p });
    let neo_hookean = Preset::from_name("brasseur_neo_hookean").expect("a preset").material;
    [elastic(1.4e5, 0.2), Material { plasticity, ..hardening }, neo_hookean]
}

/// A velocity field that no symmetry favours.
fn field(x: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = x.map(|c| 2.0 * c);
    [0.3 + 0.8 * y - (3.0 * z).sin(), 0.5 * x * z - 0.2, (2.0 * x).cos() + 0.7 * y * y - z]
}

impl Probe {
    /// Elastic energy (J) after the nodes have moved by `time` (s) along the field.
    fn energy(&self, time: f64) -> f64 {
        let of = |(x, f, jp): &([f64; 3], Mat3<f64>, f64)| {
            let mut gradient = Mat3::zeros();
            for near in nodes_near(self.variant, *x, H) {
                let v = field(near.node.map(|c| f64::from(c) * H));
                (0..9).for_each(|k| gradient[(k / 3, k % 3)] += v[k / 3] * near.gradient[k % 3]);
            }
            VOLUME * energy_density(&self.material, &((Mat3::identity() + gradient * time) * f), *jp)
        };
        self.particles.iter().map(of).sum()
    }
}

#[test]
fn the_power_of_forces_is_what_elastic_energy_loses() {
    for variant in Variant::all() {
        for material in materials() {
            let probe = probe(variant, material);
            let power: f64 = (probe.forces.iter())
                .map(|(node, f)| {
                    let v = field(node.map(|c| f64::from(c) * H));
                    f[0] * v[0] + f[1] * v[1] + f[2] * v[2]
                })
                .sum();
            // Central differences of two steps, combined: error of order 4.
            let slope = |step: f64| (probe.energy(step) - probe.energy(-step)) / (2.0 * step);
            let rate = (4.0 * slope(1e-4) - slope(2e-4)) / 3.0;
            let off = (power + rate).abs() / rate.abs();
            assert!(off < 1e-8, "{} {}: off by {off:e}", variant.name(), material.law.name());
        }
    }
}

#[test]
fn forces_push_and_turn_nothing_as_a_whole() {
    for variant in Variant::all() {
        for material in materials() {
            let probe = probe(variant, material);
            let (mut push, mut turn, mut scale) = ([0.0; 3], [0.0; 3], 0.0);
            for (node, f) in &probe.forces {
                let torque = cross(node.map(|c| f64::from(c) * H), *f);
                scale += norm(*f);
                (0..3).for_each(|a| push[a] += f[a]);
                (0..3).for_each(|a| turn[a] += torque[a]);
            }
            let what = format!("{} {}", variant.name(), material.law.name());
            let (push, turn) = (norm(push) / scale, norm(turn) / scale);
            assert!(push < 1e-13, "{what}: forces add up to {push:e}");
            assert!(turn < 1e-13, "{what}: torques add up to {turn:e} m");
        }
    }
}

#[test]
fn forces_of_two_steps_do_not_add_up() {
    // The second step starts from what the first did, so its forces are new ones: those of a run
    // that was put there.
    for variant in Variant::all() {
        let body =
            object("block", lattice([0.03; 3], [5; 3], [0.5 * H; 3]), VOLUME, DENSITY, elastic(1.4e5, 0.2));
        let scene = SnowScene::new(vec![body], H, 1e-5).by(variant);
        let mut first = scene.simulate(Precision::F64);
        let mut random = Random::seeded(41);
        rework(&mut first, |_, p| p.elastic = rows(&(Mat3::identity() + random.matrix() * 0.02)));
        step_once(&mut first);
        let mut second = scene.simulate(Precision::F64);
        second.restore_snow(&first.snow_particles());
        step_once(&mut first);
        step_once(&mut second);

        for (p, q) in first.snow_particles().iter().zip(second.snow_particles()) {
            let off = norm([0, 1, 2].map(|a| p.v[a] - q.v[a])) + norm([0, 1, 2].map(|a| p.x[a] - q.x[a]));
            assert!(off < 1e-15, "{}: off by {off:e}", variant.name());
        }
    }
}

#[test]
fn without_stress_every_step_is_free_flight() {
    for variant in Variant::all() {
        let v = [1.3, -0.4, 0.8];
        let body =
            object("block", lattice([0.03; 3], [6; 3], [0.5 * H; 3]), VOLUME, DENSITY, elastic(1.4e5, 0.2));
        let dt = 1e-3;
        let scene = SnowScene::new(vec![body], H, dt).by(variant).moving(|_| v);
        let mut simulation = scene.simulate(Precision::F64);

        for step in 1..=5 {
            let report = step_once(&mut simulation).snow.expect("there is snow");
            assert!(report.grid_mass_error.abs() < 1e-13, "{}: {:e}", variant.name(), report.grid_mass_error);
            for (p, x) in simulation.snow_particles().iter().zip(&scene.objects[0].x) {
                for a in 0..3 {
                    let off = (p.x[a] - x[a] - v[a] * dt * f64::from(step)).abs();
                    assert!(off < 1e-14, "{} step {step}: off its line by {off:e} m", variant.name());
                    assert!((p.v[a] - v[a]).abs() < 1e-13, "{} step {step}: {:?}", variant.name(), p.v);
                }
            }
        }
    }
}

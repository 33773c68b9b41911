//! Volumes at rest from the density on the grid before the first step.

use nappe_sim::{
    math::Precision,
    snow::{Material, Preset, constitutive_scalar::energy_density},
    world::Simulation,
};
use nappe_tests::{
    Random,
    snow::{SnowScene, Variant, lattice, object, rework},
};

use crate::reference::{free_snow, matrix};

/// Volumes at rest (m³) of chosen particles: what one alone stretched holds, over its energy density.
pub(crate) fn volumes(mut simulation: Simulation, material: &Material, chosen: &[usize]) -> Vec<f64> {
    let stretched = [[1.004, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.99]];
    let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let density = energy_density(material, &matrix(&stretched), 1.0);
    let energy = |chosen: &usize| {
        rework(&mut simulation, |i, p| p.elastic = if i == *chosen { stretched } else { whole });
        simulation.diagnose().elastic_energy
    };
    chosen.iter().map(energy).map(|energy| energy / density).collect()
}

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;

#[test]
fn volumes_of_a_block_are_its_own_and_its_density_that_of_snow() {
    for variant in Variant::all() {
        let low = [-0.3, 0.1, 2.0];
        let x = lattice(low, [12; 3], [0.5 * H; 3]);
        let own = (0.5 * H).powi(3);
        let mut body = object("block", x, own, DENSITY, snow());
        body.volume = Vec::new();
        let scene = SnowScene::new(vec![body], H, 1e-4).by(variant);
        let x = &scene.objects[0].x;
        let chosen = |fits: &dyn Fn(f64) -> bool| -> Vec<usize> {
            let all = |i: &usize| (0..3).all(|a| fits(((x[*i][a] - low[a]) / H - 3.0).abs()));
            (0..x.len()).filter(all).collect()
        };
        let (within, corners) = (chosen(&|cells| cells < 0.5), chosen(&|cells| cells > 2.5));
        assert_eq!((within.len(), corners.len()), (8, 8));
        let found = volumes(scene.simulate(Precision::F64), &free_snow(), &within);
        let sum: f64 = found.iter().sum();
        let off = (sum / (8.0 * own) - 1.0).abs();
        assert!(off < 0.02, "{}: the volume within is off by {off:e}", variant.name());

        for (i, volume) in within.iter().zip(&found) {
            let off = (own / volume - 1.0).abs();
            assert!(off < 0.02, "{}: the density at particle {i} is off by {off:e}", variant.name());
        }
        // At a corner a particle shares its nodes with few: larger than within.
        let found = volumes(scene.simulate(Precision::F64), &free_snow(), &corners);
        assert!(found.iter().all(|v| *v > 1.1 * own && *v < 20.0 * own), "{}: {found:?}", variant.name());
    }
}

#[test]
fn a_particle_alone_has_a_volume() {
    let mut random = Random::seeded(5);
    for variant in Variant::all() {
        for _ in 0..4 {
            let mut body = object("alone", vec![random.vector()], 1.0, 1.0, snow());
            body.volume = Vec::new();
            let scene = SnowScene::new(vec![body], H, 1e-4).by(variant);
            let [volume] = volumes(scene.simulate(Precision::F64), &free_snow(), &[0])[..] else {
                panic!("one particle")
            };

            // Sum of w² over h³: between that of a particle on a node and of one between nodes.
            assert!(
                volume >= H.powi(3) * 0.999_999 && volume < 64.0 * H.powi(3),
                "{}: {volume}",
                variant.name()
            );
        }
    }
}

/// Snow as a world takes it.
fn snow() -> Material {
    Preset::from_name("stomakhin").expect("a preset").material
}

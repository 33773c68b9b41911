//! T6: volumes at rest from the density on the grid before the first step.

use nappe_sim::{
    math::Precision,
    snow::{Material, constitutive::energy_density},
    world::Simulation,
};
use nappe_tests::snow::{SnowScene, Variant, lattice, object, rework};

use crate::own::{Random, free_snow, matrix};

/// Volume at rest (m³) of every particle: what one alone stretched holds, over its energy density.
pub(crate) fn volumes(mut simulation: Simulation, material: &Material) -> Vec<f64> {
    let stretched = [[1.004, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.99]];
    let whole = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let density = energy_density(material, &matrix(&stretched), 1.0);
    let count = simulation.snow_particles().len();
    let energy = |chosen| {
        rework(&mut simulation, |i, p| p.elastic = if i == chosen { stretched } else { whole });
        simulation.diagnose().elastic_energy
    };
    (0..count).map(energy).map(|energy| energy / density).collect()
}

const H: f64 = 0.1;
const DENSITY: f64 = 400.0;

#[test]
fn t6_volumes_of_a_block_are_its_own_and_its_density_that_of_snow() {
    for variant in Variant::all() {
        let cells = 6;
        let x = lattice([-0.3, 0.1, 2.0], [2 * cells; 3], [0.5 * H; 3]);
        let inside = |x: [f64; 3]| (0..3).all(|a| (x[a] - [0.0, 0.4, 2.3][a]).abs() < 0.1);
        let own = (0.5 * H).powi(3);
        let mut body = object("block", x, own, DENSITY, free_of_range());
        body.volume = Vec::new();
        let scene = SnowScene::new(vec![body], H, 1e-4).by(variant);
        let found = volumes(scene.simulate(Precision::F64), &free_snow());
        let chosen: Vec<usize> = (0..found.len()).filter(|i| inside(scene.objects[0].x[*i])).collect();
        assert_eq!(chosen.len(), 64, "two cells each way");
        let sum: f64 = chosen.iter().map(|i| found[*i]).sum();
        let off = (sum / (chosen.len() as f64 * own) - 1.0).abs();
        assert!(off < 0.02, "{}: the volume within is off by {off:e}", variant.name());
        for i in chosen {
            let off = (own * DENSITY / found[i] / DENSITY - 1.0).abs();
            assert!(off < 0.02, "{}: the density at particle {i} is off by {off:e}", variant.name());
        }
        // At the surface a particle shares nodes with nothing: it is larger, never smaller than within.
        assert!(found.iter().all(|v| *v > 0.98 * own && *v < 20.0 * own), "{}", variant.name());
    }
}

#[test]
fn t6_a_particle_alone_has_a_volume() {
    let mut random = Random(5);
    for variant in Variant::all() {
        for _ in 0..4 {
            let mut body = object("alone", vec![random.vector()], 1.0, 1.0, free_of_range());
            body.volume = Vec::new();
            let scene = SnowScene::new(vec![body], H, 1e-4).by(variant);
            let [volume] = volumes(scene.simulate(Precision::F64), &free_snow())[..] else {
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
fn free_of_range() -> Material {
    nappe_sim::snow::Preset::from_name("stomakhin").expect("a preset").material
}

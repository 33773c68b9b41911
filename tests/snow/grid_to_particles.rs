//! What particles gather from nodes, through whole steps, in metres and seconds, for
//! every kernel, transfer and size of cell.

use nappe_sim::{
    math::{Mat3, Precision},
    snow::{Blend, GridNode, Transfer},
};
use nappe_tests::{
    Random,
    snow::{SnowScene, Variant, elastic, lattice, object, rework, step_once},
};
use std::collections::BTreeMap;

use crate::reference::{matrix, nodes_near, relative, rows};

/// Cells in metres, centimetres, and in a wrong unit: a slope without 1 / h fits one of them.
const CELLS: [f64; 4] = [1.0, 0.1, 0.025, 40.0];

/// An affine field that is neither symmetric nor without divergence.
fn field() -> (Mat3<f64>, [f64; 3]) {
    (Mat3::new(0.3, -1.2, 0.7, 2.1, 0.4, -0.9, -0.5, 1.6, -0.8), [3.0, -1.0, 0.5])
}

/// Deformations that commute with no such field.
fn sheared() -> Mat3<f64> {
    Mat3::new(1.1, 0.3, -0.2, 0.0, 0.9, 0.15, 0.05, -0.1, 1.05)
}

#[test]
fn an_affine_field_gives_its_own_velocity_and_gradient() {
    let (a, b) = field();
    for h in CELLS {
        for variant in Variant::all() {
            // A lattice that lies evenly about the nodes: on those within, velocities alone are affine.
            let x = lattice([-4.0 * h; 3], [16; 3], [0.5 * h; 3]);
            let within = |x: [f64; 3]| x.iter().all(|c| c.abs() < 1.2 * h);
            let body = object("block", x, (0.5 * h).powi(3), 400.0, elastic(1.0, 0.2));
            let at = |x: [f64; 3]| {
                let v = a * nappe_sim::math::vec3::<f64>(x);
                [0, 1, 2].map(|k| v[k] / h + b[k])
            };
            let (gradient, dt) = (a / h, 1e-4 * h);
            let mut scene = SnowScene::new(vec![body], h, dt).by(variant).moving(at);
            if matches!(variant.transfer, Transfer::PicFlip(_)) {
                scene.settings.transfer = Transfer::PicFlip(Blend::PerStep(0.0));
            }
            let mut simulation = scene.simulate(Precision::F64);

            // No stress: velocities on the nodes are those of the particles.
            let whole = Mat3::identity();
            rework(&mut simulation, |_, p| p.affine = rows(&gradient));
            let before = simulation.snow_particles();
            step_once(&mut simulation);
            let mut seen = 0;

            for (old, new) in before.iter().zip(simulation.snow_particles()).filter(|(p, _)| within(p.x)) {
                let what = format!("{}, h = {h} m", variant.name());
                for k in 0..3 {
                    let off = (new.v[k] - at(old.x)[k]).abs();
                    assert!(off < 1e-13 * 10.0, "{what}: velocity off by {off:e}");
                }
                let off = relative(&matrix(&new.affine), &gradient, 0.0);
                assert!(off < 1e-13 * 4.0, "{what}: gradient off by {off:e}");
                let off = relative(&matrix(&new.elastic), &((whole + gradient * dt) * whole), 0.0);
                assert!(off < 1e-13, "{what}: F off by {off:e}");
                seen += 1;
            }

            assert!(seen >= 64, "{seen} particles within");
        }
    }
}

#[test]
fn deformation_grows_from_the_left() {
    let mut random = Random::seeded(11);
    for variant in Variant::affine() {
        for h in CELLS {
            // Each alone: the field on its nodes is its own, and its own stress makes none where
            // the material is as soft as this.
            let x: Vec<_> = (0..27)
                .map(|i| {
                    [i / 9, i / 3 % 3, i % 3].map(|c| 9.0 * h * f64::from(c) + 0.4 * h * random.number())
                })
                .collect();
            let body = object("alone", x, h.powi(3), 1e6, elastic(1e-6, 0.2));
            let dt = 1e-3;
            let mut simulation = SnowScene::new(vec![body], h, dt).by(variant).simulate(Precision::F64);
            let (mut fields, mut shapes) = (Vec::new(), Vec::new());
            rework(&mut simulation, |_, p| {
                fields.push(random.matrix() * 100.0);
                shapes.push(random.rotation() * sheared());
                p.affine = rows(fields.last().expect("it was pushed"));
                p.elastic = rows(shapes.last().expect("it was pushed"));
            });

            step_once(&mut simulation);

            for (i, p) in simulation.snow_particles().iter().enumerate() {
                let golden = (Mat3::identity() + fields[i] * dt) * shapes[i];
                let off = relative(&matrix(&p.elastic), &golden, 0.0);
                assert!(off < 1e-13, "{}, h = {h} m: F off by {off:e}", variant.name());
            }
        }
    }
}

#[test]
fn particles_gather_by_the_slopes_of_the_splines() {
    for h in CELLS {
        for variant in Variant::all() {
            let mut random = Random::seeded(23);
            let x: Vec<_> = (0..300).map(|_| random.vector().map(|c| 2.0 * h * c)).collect();
            let v: Vec<_> = x.iter().map(|_| random.vector()).collect();
            let mut body = object("cloud", x.clone(), h.powi(3), 100.0, elastic(1e-3, 0.2));
            body.v.clone_from(&v);
            let dt = 1e-3 * h;
            let mut simulation = SnowScene::new(vec![body], h, dt).by(variant).simulate(Precision::F64);
            rework(&mut simulation, |_, p| p.elastic = rows(&sheared()));
            step_once(&mut simulation);
            let mut nodes: Vec<GridNode> = Vec::new();
            simulation.grid_nodes(&mut nodes);
            let nodes: BTreeMap<_, _> = nodes.iter().map(|n| (n.index, n.velocity)).collect();

            for (p, x) in simulation.snow_particles().iter().zip(&x) {
                let (mut velocity, mut gradient) = ([0.0; 3], Mat3::zeros());
                for near in nodes_near(variant, *x, h) {
                    let Some(node) = nodes.get(&near.node) else { continue };
                    for k in 0..3 {
                        velocity[k] += near.weight * node[k];
                        (0..3).for_each(|a| gradient[(k, a)] += node[k] * near.gradient[a]);
                    }
                }

                let what = format!("{}, h = {h} m", variant.name());
                if !matches!(variant.transfer, Transfer::PicFlip(_)) {
                    for k in 0..3 {
                        let off = (p.v[k] - velocity[k]).abs();
                        assert!(off < 1e-12, "{what}: velocity off by {off:e}");
                    }
                }

                let golden = (Mat3::identity() + gradient * dt) * sheared();
                let off = relative(&matrix(&p.elastic), &golden, 0.0);

                // dt grad v is near 1e-3: to 1e-12 of F is 1e-9 of the gradient.
                assert!(off < 1e-14 * 20.0, "{what}: F off by {off:e}");
            }
        }
    }
}

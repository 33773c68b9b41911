//! Snow between two surfaces, or three: it slides along them and falls into them without a gain, and no
//! node enters one.

use nappe_sim::{
    collide::{Collider, Contact},
    linalg::Stop,
    math::Precision,
    snow::{GridNode, Integration, Kernel, Transfer},
    time_step::TimeStep,
};
use nappe_tests::{
    scene::norm,
    snow::{SnowScene, Variant, elastic, lattice, object, plane, step_once},
};

const H: f64 = 0.02;
const DENSITY: f64 = 400.0;
const GRAVITY: f64 = 9.81;
const MLS: Variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
const APIC: Variant = Variant { kernel: Kernel::Cubic, transfer: Transfer::Apic };
/// As scenes have it.
const BACKWARD_EULER: Integration =
    Integration::SemiImplicit { beta: 1.0, stop: Stop::Residual { tolerance: 1e-4, max_iterations: 500 } };

/// Three directions, at right angles, along which a scene is laid.
type Frame = [[f64; 3]; 3];

const ALONG_AXES: Frame = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
/// Turned about z, and about no axis.
const TURNED: [Frame; 2] = [
    [[0.8, 0.6, 0.0], [-0.6, 0.8, 0.0], [0.0, 0.0, 1.0]],
    [
        [2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0],
        [-2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0],
        [-1.0 / 3.0, -2.0 / 3.0, 2.0 / 3.0],
    ],
];

/// A vector from its parts along the directions of a frame.
fn laid(frame: &Frame, x: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|c| x[0] * frame[0][c] + x[1] * frame[1][c] + x[2] * frame[2][c])
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn unit(a: [f64; 3]) -> [f64; 3] {
    a.map(|c| c / norm(a))
}

/// Surfaces through the origin, in a frame.
fn surfaces(frame: &Frame, normals: &[[f64; 3]], contact: Contact, friction: f64) -> Vec<Collider> {
    normals.iter().map(|n| plane([0.0; 3], unit(laid(frame, *n)), contact, friction)).collect()
}

/// Snow that fills what lies before all surfaces through the origin, within some cells of it.
fn filling(frame: &Frame, normals: &[[f64; 3]], low: [i32; 3], counts: [usize; 3]) -> SnowScene {
    let spacing = 0.5 * H;
    let mut x = lattice(low.map(|cells| f64::from(cells) * H), counts.map(|cells| 2 * cells), [spacing; 3]);
    // Half a spacing away from each, but for rounding.
    x.retain(|x| normals.iter().all(|n| dot(unit(*n), *x) > 0.499 * spacing));
    let x = x.into_iter().map(|x| laid(frame, x)).collect();
    SnowScene::new(vec![object("snow", x, spacing.powi(3), DENSITY, elastic(1.4e5, 0.2))], H, 8e-3)
}

/// Normals in the plane of the first and the third direction, an angle (degrees) apart.
fn wedge(degrees: f64) -> [[f64; 3]; 2] {
    let (sin, cos) = degrees.to_radians().sin_cos();
    [[1.0, 0.0, 0.0], [cos, 0.0, sin]]
}

#[test]
fn a_block_that_slides_along_two_surfaces_keeps_its_energy() {
    // At ten times what elastic waves allow an explicit step: a free direction that is left out of the solve
    // grows from rounding to any size within these steps.
    for frame in [ALONG_AXES, TURNED[0], TURNED[1]] {
        for degrees in [90.0, 60.0, 120.0] {
            for variant in [MLS, APIC] {
                let normals = wedge(degrees);
                let mut scene = filling(&frame, &normals, [0, 0, -2], [3, 3, 5]).by(variant);
                scene = scene.moving(|_| frame[1]);
                scene.colliders = surfaces(&frame, &normals, Contact::Slip, 0.0);
                scene.settings.integration = BACKWARD_EULER;
                let mut simulation = scene.simulate(Precision::F64);
                let start = 0.5 * scene.masses().iter().sum::<f64>();
                for step in 0..25 {
                    let energy = step_once(&mut simulation).diagnostics.total_energy();
                    let off = energy / start - 1.0;
                    let what = format!("{}, {degrees} degrees, {frame:?}", variant.name());
                    assert!(off.abs() < 1e-6, "{what}, step {step}: {energy} J, not {start} J ({off:e})");
                }
            }
        }
    }
}

/// Greatest rise of the energy above that of the start while snow falls into surfaces, over m g h.
fn rise(mut scene: SnowScene, colliders: Vec<Collider>, down: [f64; 3]) -> f64 {
    scene = scene.under(down.map(|c| GRAVITY * c));
    scene.colliders = colliders;
    scene.dt = 0.02;
    scene.settings.time_step = TimeStep::default();
    scene.settings.integration = BACKWARD_EULER;
    let mut simulation = scene.simulate(Precision::F64);
    let start = simulation.diagnose().total_energy();
    let scale = scene.masses().iter().sum::<f64>() * GRAVITY * 3.0 * H;
    let rises = (0..30).map(|_| (step_once(&mut simulation).diagnostics.total_energy() - start) / scale);
    rises.fold(f64::NEG_INFINITY, f64::max)
}

#[test]
fn snow_that_falls_in_a_box_of_floor_and_walls_gains_no_energy() {
    for frame in [ALONG_AXES, TURNED[1]] {
        for variant in [MLS, APIC] {
            let [x, y, z] = frame;
            let near = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
            let scene = filling(&frame, &near, [0; 3], [3; 3]).by(variant);

            // A floor and four walls, which the block touches.
            let mut colliders = surfaces(&frame, &near, Contact::Slip, 0.0);
            for way in [x, z] {
                let far = way.map(|c| 3.0 * H * c);
                colliders.push(plane(far, way.map(|c| -c), Contact::Slip, 0.0));
            }

            let rise = rise(scene, colliders, y.map(|c| -c));
            assert!(rise < 1e-6, "{}, {frame:?}: {rise:e} of m g h", variant.name());
        }
    }
}

#[test]
fn snow_that_falls_into_a_groove_gains_no_energy() {
    for frame in [ALONG_AXES, TURNED[1]] {
        for degrees in [60.0, 120.0] {
            let normals = wedge(degrees);
            let scene = filling(&frame, &normals, [0, 0, -2], [3, 3, 5]).by(MLS);
            let colliders = surfaces(&frame, &normals, Contact::Slip, 0.0);

            // Into the groove, and along it.
            let into = unit([0, 1, 2].map(|c| -normals[0][c] - normals[1][c]));
            let down = laid(&frame, unit([into[0], -0.5, into[2]]));
            let rise = rise(scene, colliders, down);
            assert!(rise < 1e-6, "{degrees} degrees, {frame:?}: {rise:e} of m g h");
        }
    }
}

#[test]
fn no_node_in_a_corner_enters_a_surface() {
    let normals = [[1.0, 0.0, 0.0], [-0.5, 0.1, 0.8], [0.2, 0.9, 0.3]];
    let into = unit([0, 1, 2].map(|c| -normals.iter().map(|n| unit(*n)[c]).sum::<f64>()));
    for (contact, friction, integration) in [
        (Contact::Slip, 0.0, Integration::Explicit),
        (Contact::Slip, 0.3, Integration::Explicit),
        (Contact::Separating, 0.3, Integration::Explicit),
        (Contact::Slip, 0.3, BACKWARD_EULER),
    ] {
        let mut scene = filling(&ALONG_AXES, &normals, [0, -3, 0], [3, 6, 4]).by(MLS).moving(|_| into);
        scene.dt = 3e-4;
        scene.settings.time_step = TimeStep::Unchecked(scene.dt);
        scene.settings.integration = integration;
        scene.colliders = surfaces(&ALONG_AXES, &normals, contact, friction);
        let mut simulation = scene.simulate(Precision::F64);

        let (mut nodes, mut within): (Vec<GridNode>, [u32; 4]) = (Vec::new(), [0; 4]);
        for step in 0..30 {
            step_once(&mut simulation);
            simulation.grid_nodes(&mut nodes);
            for node in &nodes {
                let place = node.index.map(|i| f64::from(i) * H);
                let at = |c: &&Collider| c.distance(place, 0.0).0 <= 0.0;
                let touched: Vec<&Collider> = scene.colliders.iter().filter(at).collect();
                within[touched.len()] += 1;
                for collider in touched {
                    let leaving = dot(node.velocity, collider.distance(place, 0.0).1);
                    let off = if contact == Contact::Slip { leaving.abs() } else { -leaving };
                    let what =
                        format!("{contact:?}, friction {friction}, step {step}, node {:?}", node.index);
                    // Rounding of speeds that were at most some hundred m/s before they answered.
                    assert!(off < 1e-12, "{what}: {off:e} m/s");
                }
            }
        }
        assert!(within[2] > 0 && within[3] > 0, "nodes in two and in three of them: {within:?}");
    }
}

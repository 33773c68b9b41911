//! Pieces of snow whose motion is what fails: two particles that meet, a block between two planes, one that spins.

use nappe_sim::{
    collide::{Collider, Contact, Shape, StartInside, shape::Plane},
    linalg::Stop,
    snow::{Integration, Kernel},
    time_step::TimeStep,
};

use super::{
    blocks::run,
    finding::Finding,
    row::Row,
    snow::{SnowScene, elastic, lattice, object},
};
use crate::method::Variant;

/// Scenes over every transfer with the kernels that go with it; of semi-implicit steps those with a smooth kernel.
pub(super) const SCENES: [Row<Variant>; 3] = [
    Row { number: 38, what: "two elastic particles that meet, 8 s", run: meeting },
    Row { number: 39, what: "a block along two slip planes, semi-implicit: energy to 1e-6", run: corner },
    Row { number: 40, what: "a block that spins freely, semi-implicit with beta = 0.5, 4 s", run: spinning },
];

fn meeting(variant: Variant) -> Finding {
    let x = [[0.03, 0.05, 0.05], [0.07, 0.06, 0.07]];
    let mut body = object("two", x.to_vec(), 1.25e-4, 400.0, elastic(1e6, 0.2));
    body.v = vec![[0.5, 0.0, 0.0], [-0.5, 0.0, 0.0]];
    let mut scene = SnowScene::new(vec![body], 0.1, 0.04).by(variant);
    scene.settings.time_step = TimeStep::default();
    run(&scene, 200, |_, _| {}).0
}

/// A block of 51.2 g, 2 x 4 x 2 cells of 2 cm, in steps of 20 ms that are solved for.
fn block(variant: Variant, beta: f64) -> Option<SnowScene> {
    let x = lattice([0.0; 3], [4, 8, 4], [0.01; 3]);
    let mut scene = SnowScene::new(vec![object("block", x, 1e-6, 400.0, elastic(1.4e5, 0.2))], 0.02, 0.02);
    scene = scene.by(variant);
    scene.settings.time_step = TimeStep::default();
    let stop = Stop::Residual { tolerance: 1e-8, max_iterations: 1000 };
    scene.settings.integration = Integration::SemiImplicit { beta, stop };
    (variant.kernel != Kernel::Linear).then_some(scene)
}

fn corner(variant: Variant) -> Finding {
    let Some(scene) = block(variant, 1.0) else { return Finding::NONE };
    let mut scene = scene.moving(|_| [0.0, 1.0, 0.0]);
    scene.colliders = [[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]].map(slip_plane).to_vec();
    let (finding, simulation) = run(&scene, 60, |_, _| {});
    let Some(simulation) = simulation else { return finding };
    // It keeps its 25.6 mJ.
    let off = simulation.diagnose().kinetic_energy / 0.0256 - 1.0;
    finding.right_if(|| off.abs() < 1e-6)
}

fn slip_plane(normal: [f64; 3]) -> Collider {
    Collider {
        name: format!("{normal:?}"),
        shape: Shape::Plane(Plane { point: [0.0; 3], normal }),
        velocity: [0.0; 3],
        way: None,
        friction: 0.0,
        restitution: 0.0,
        margin: 0.0,
        contact: Contact::Slip,
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

fn spinning(variant: Variant) -> Finding {
    let Some(scene) = block(variant, 0.5) else { return Finding::NONE };
    let mut scene = scene.moving(|x| [-2.0 * (x[1] - 0.04), 2.0 * (x[0] - 0.02), 0.0]);
    scene.objects[0].angular_velocity = [0.0, 0.0, 2.0];
    run(&scene, 200, |_, _| {}).0
}

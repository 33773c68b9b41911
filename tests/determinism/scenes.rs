//! Scenes of several blocks, small enough for a debug build, that between them use every kernel.

use nappe_sim::{
    cloth::{
        Air, ElementKind, ElementList, Integrator, Minimizer, Network, NewtonSettings, SpringKind, SpringLaw,
        Threads, Warp,
    },
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Plane, Sphere},
    },
    linalg::{PreconditionerKind, SolverSettings},
    math::Precision,
    mesh::TriangleMesh,
    world::{Change, Forces, Simulation},
};
use nappe_tests::{
    Method, Scene,
    meshes::{TRAY_HALF, tray},
    networks::{DrapSprings, chain, drap, scatter, sheet, sheet_rules},
    scene::advance,
};

/// Steps of every scene.
pub(crate) const STEPS: u64 = 15;

/// Names of the scenes.
pub(crate) const NAMES: [&str; 9] = [
    "hung_sheet",
    "course_cloth",
    "sheet_on_sphere",
    "carried_chain",
    "coarse_spaces",
    "soft_functions",
    "sheet_in_air",
    "sheet_in_tray",
    "fabric",
];

/// The methods that step a scene: explicit ones solve nothing with a coarse space, and iterates are solved for as a step
/// from the state is.
pub(crate) fn methods(name: &str) -> impl Iterator<Item = Method> {
    let iterates_too = ["hung_sheet", "sheet_on_sphere", "sheet_in_air", "fabric"].contains(&name);
    let coarse_alone = ["coarse_spaces", "soft_functions"].contains(&name);
    Method::all().into_iter().filter(move |method| {
        let is_plain =
            method.integrator == Integrator::ImplicitEuler && method.minimizer == Minimizer::OneStep;
        is_plain || !coarse_alone && (iterates_too || method.minimizer == Minimizer::OneStep)
    })
}

/// A scene by name.
pub(crate) fn scene(name: &str, method: Method) -> Scene {
    let gravity = [0.0, -9.81, 0.0];
    let mut scene = match name {
        "hung_sheet" => {
            let mut network = sheet(20, 0.05, &sheet_rules(100.0, 0.02), 0.005);
            network.drag = 0.003;
            let mut scene = Scene::new(network, 1e-3).under(gravity);
            scene.wind = [2.0, 0.3, -1.0];
            scene
        }
        "course_cloth" => Scene::new(drap(14, DrapSprings::Full, 0.01), 2.5e-3).under(gravity),
        "sheet_on_sphere" => sheet_on_sphere().under(gravity),
        "sheet_in_tray" => sheet_in_tray(),
        "fabric" => Scene::new(fabric(), 1e-3).under(gravity),
        "carried_chain" => {
            let x: Vec<_> =
                (0..150).map(|i| [0.02 * f64::from(i), 0.01 * scatter(i as usize), 0.0]).collect();
            let mut network = chain(&x, 0.02, 50.0, 0.01, 0.002);
            network.pins = vec![0, 70, 149];
            Scene::new(network, 2e-3).under(gravity)
        }
        "sheet_in_air" => {
            let mut network = sheet(20, 0.05, &sheet_rules(100.0, 0.02), 0.005);
            // Triangles across blocks that no spring joins along their diagonals.
            network.springs.retain(|spring| spring.kind != SpringKind::Shear);
            for (i, v) in network.v.iter_mut().enumerate() {
                *v = [0.3 * scatter(i), 0.0, 0.3 * scatter(i + 1000)];
            }
            network.air = Some(Air { tangential: 0.1, ..Air::default() });
            let mut scene = Scene::new(network, 1e-3).under(gravity);
            scene.wind = [2.0, -4.0, -1.0];
            scene
        }
        "coarse_spaces" | "soft_functions" => Scene::new(folded_sheet(), 4e-4).under(gravity),
        other => panic!("no scene is named {other}"),
    }
    .by(method.with(NewtonSettings { tolerance: 1e-3, max_iterations: 5 }, 5));
    scene.settings.block_size = 64;
    scene.settings.solver = SolverSettings::default();
    let coarse = match name {
        "coarse_spaces" => Some(PreconditionerKind::TwoLevel),
        "soft_functions" => Some(PreconditionerKind::Patches),
        _ => None,
    };
    if let Some(preconditioner) = coarse {
        scene.settings.block_size = 32;
        scene.settings.solver.preconditioner = preconditioner;
    }
    scene
}

/// A sheet laid double, with elements: blocks for several levels, some of them of several parts, the first level cut
/// between threads.
fn folded_sheet() -> Network {
    let mut network = sheet(40, 0.01, &sheet_rules(100.0, 0.002), 1e-4);
    let law = SpringLaw { stiffness: 1e-6, damping: 1e-8 };
    let mesh = TriangleMesh::grid(40, 40, 0.01);
    network.elements = vec![ElementList::new(ElementKind::QuadraticBending, law, &mesh)];
    network.pins.extend([700, 1301]);
    for [x, y, _] in &mut network.x {
        if *x > 0.195 {
            (*x, *y) = (0.39 - *x, 0.004);
        }
    }
    network
}

/// A membrane with a plate and no springs, whose warp runs askew, pulled and sheared at random.
fn fabric() -> Network {
    let mut network = sheet(20, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.springs.clear();
    let mesh = TriangleMesh::grid(20, 20, 0.05);
    let threads = Threads { warp: Warp::Along([0.8, 0.0, 0.6]), shares: [1.0, 0.6, 0.1] };
    let stretch = SpringLaw { stiffness: 100.0, damping: 0.02 };
    let bending = SpringLaw { stiffness: 1e-3, damping: 1e-5 };
    network.elements = vec![
        ElementList::membrane(stretch, threads, &mesh).expect("a warp within the plane"),
        ElementList::new(ElementKind::Plate, bending, &mesh),
    ];
    for (i, v) in network.v.iter_mut().enumerate() {
        *v = [0.3 * scatter(i), 0.3 * scatter(i + 500), 0.3 * scatter(i + 1000)];
    }
    network
}

fn sheet_on_sphere() -> Scene {
    let mut network = sheet(18, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    for (i, v) in network.v.iter_mut().enumerate() {
        *v = [0.3 * scatter(i), -1.0, 0.3 * scatter(i + 1000)];
    }
    let collider = |name: &str, shape| Collider {
        name: name.to_owned(),
        shape,
        velocity: [0.1, 0.0, 0.0],
        way: None,
        friction: 0.4,
        restitution: 0.2,
        margin: 0.004,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    };
    let mut scene = Scene::new(network, 2e-3).in_substeps(2);
    scene.colliders = vec![
        collider("ball", Shape::Sphere(Sphere { center: [0.45, -0.21, 0.4], radius: 0.2 })),
        collider("floor", Shape::Plane(Plane { point: [0.0, -0.012, 0.0], normal: [0.0, 1.0, 0.0] })),
    ];
    scene
}

/// A sheet that slides over the floor of a moving tray of triangles, and is pressed with its edge into the crease below a wall
/// that leans over it.
fn sheet_in_tray() -> Scene {
    let mut network = sheet(13, 0.01, &sheet_rules(100.0, 0.02), 2e-3);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] + TRAY_HALF - 0.14, 0.0045, x[2] - 0.06]);
    for (i, v) in network.v.iter_mut().enumerate() {
        *v = [2.0, -0.5 + 0.3 * scatter(i), 0.3 * scatter(i + 1000)];
    }
    let tray = tray(60.0).collider(0.4, 0.004);
    let mut scene = Scene::new(network, 1e-3).in_substeps(2).under([40.0, -25.0, 0.0]);
    scene.colliders = vec![Collider { velocity: [0.1, 0.0, 0.0], restitution: 0.2, ..tray }];
    scene
}

/// The simulation of a scene with what happens to it on the way, after all its steps.
pub(crate) fn run(name: &str, method: Method, precision: Precision) -> Simulation {
    let mut simulation = scene(name, method).simulate(precision);
    simulation.apply(&changes(name)).expect("a pin may move");
    advance(&mut simulation, STEPS);
    simulation
}

/// What happens to a scene before its first step.
pub(crate) fn changes(name: &str) -> Vec<Change> {
    let carried = Change::Pin { particle: 70, target: [0.1, 0.05, -0.02], duration: 0.02 };
    let pulled = Change::Force {
        body: "body".to_owned(),
        particles: [5, 210, 399].into(),
        forces: Forces::One([0.02, -0.01, 0.03]),
    };
    match name {
        "carried_chain" => vec![carried],
        "sheet_in_air" => vec![pulled],
        _ => Vec::new(),
    }
}

//! Bodies at random: what they are made of, what acts on them, and how they are stepped.

use nappe_scene::{
    Body, ElementLaw, ForceText, GridPlane, Mass, Mesh, MovingPin, Pin, Rotate, SpringLaw, Springs,
    Stiffness, Transform,
};
use nappe_sim::{
    cloth::{Air, ElementKind, Hessian, Integrator, MinimizerKind},
    linalg::PreconditionerKind,
    mesh::TriangleMesh,
};

use super::Case;
use crate::Random;

/// What all bodies of a scene share: the length (m) of an edge, the step (s).
#[derive(Clone, Copy, Debug)]
pub(super) struct Scale {
    /// Distance between particles (m).
    pub(super) spacing: f64,
    /// Step of the scene (s).
    pub(super) dt: f64,
}

/// Adds a body to a scene.
pub(super) fn add(random: &mut Random, case: &mut Case, scale: Scale, number: usize) {
    let name = format!("b{number}");
    let (mesh, count, has_triangles) = mesh(random, case, scale, &name);
    let mut body = Body::new(name, mesh);
    let mass = random.decades(1e-4, 1.0);
    body.mass = Some(Mass::Particle(mass));
    body.transform = Transform {
        rotate: random
            .chance(0.7)
            .then(|| Rotate { axis: random.direction(), degrees: random.between(-180.0, 180.0) }),
        translate: random.vector().map(|c| 4.0 * scale.spacing * c),
        ..Transform::default()
    };
    let speed = if random.chance(0.3) { 0.0 } else { random.decades(0.01, 20.0) };
    body.velocity = random.direction().map(|c| speed * c);
    method(random, &mut body);
    springs(random, &mut body, (mass, scale.dt));
    if random.chance(0.5) {
        pins(random, &mut body, count, scale);
    }
    // Explicit Euler takes steps in damped motion alone.
    if random.chance(0.2) || body.integrator == Integrator::ExplicitEuler {
        body.drag = mass / scale.dt * random.decades(1e-4, 0.3);
    }
    if has_triangles && random.chance(0.15) {
        body.air = Some(Air { density: random.decades(0.1, 10.0), ..Air::default() });
    }
    if has_triangles && random.chance(0.15) {
        let stiffness = mass * (scale.spacing / scale.dt).powi(2) * random.decades(1e-4, 1.0);
        let damping = if random.chance(0.5) { 0.0 } else { scale.dt * random.decades(1e-3, 0.3) };
        let (name, stiffness) = (ElementKind::QuadraticBending, Stiffness::One(stiffness));
        body.laws = vec![ElementLaw { name, stiffness, damping, warp: None }];
    }
    if random.chance(0.15) {
        let on = Pin::Index(random.whole(0, count - 1));
        let force = random.direction().map(|c| 9.81 * mass * random.decades(0.1, 30.0) * c);
        body.forces = vec![ForceText { on, force, from: 0.0, until: None }];
    }
    case.scene.bodies.push(body);
}

/// Where its particles are, how many they are, and whether there are triangles.
fn mesh(random: &mut Random, case: &mut Case, scale: Scale, name: &str) -> (Mesh, u32, bool) {
    let spacing = scale.spacing;
    let most = random.pick(&[4, 4, 8, 14]);
    let [columns, rows] = [random.whole(2, most), random.whole(2, most)];
    match random.whole(0, 3) {
        0 => {
            let chain = random.whole(2, 20);
            (Mesh::Chain { chain, spacing }, chain, false)
        }
        1 => {
            let grid =
                Mesh::Grid { grid: [columns, rows], spacing, plane: GridPlane::Horizontal, ripple: 0.0 };
            (grid, columns * rows, true)
        }
        _ => {
            let file = format!("{name}.ply");
            case.meshes.insert(file.clone(), sheet(random, [columns, rows], scale));
            (Mesh::file(file), columns * rows, true)
        }
    }
}

/// A sheet of triangles whose points and velocities are shaken.
fn sheet(random: &mut Random, [columns, rows]: [u32; 2], Scale { spacing, dt }: Scale) -> TriangleMesh {
    let (shake, speed) = (random.between(0.0, 0.3) * spacing, random.decades(1e-3, 0.5) * spacing / dt);
    let speed = speed.min(20.0);
    let mut mesh = TriangleMesh::default();
    for row in 0..rows {
        for column in 0..columns {
            let at = [f64::from(column), 0.0, f64::from(row)].map(|c| c * spacing);
            let off = random.vector();
            mesh.points.push([0, 1, 2].map(|c| at[c] + shake * off[c]));
            mesh.velocities.push(random.vector().map(|c| speed * c));
        }
    }
    for row in 1..rows {
        for column in 1..columns {
            let at = |row: u32, column: u32| row * columns + column;
            let [a, b, c, d] =
                [at(row - 1, column - 1), at(row - 1, column), at(row, column), at(row, column - 1)];
            let halves = if random.chance(0.5) { [[a, c, b], [a, d, c]] } else { [[a, d, b], [b, d, c]] };
            mesh.triangles.extend(halves);
        }
    }
    mesh
}

/// How it is stepped.
fn method(random: &mut Random, body: &mut Body) {
    body.integrator = random.pick(&Integrator::ALL);
    if body.integrator == Integrator::ExplicitEuler && random.chance(0.7) {
        body.integrator = Integrator::SymplecticEuler;
    }
    if !body.integrator.is_implicit() {
        return;
    }
    body.minimizer = random.pick(&MinimizerKind::ALL);
    if body.minimizer != MinimizerKind::VertexBlockDescent {
        body.hessian = random.pick(&[Hessian::Absolute, Hessian::Absolute, Hessian::Clamped]);
        let kinds = [
            PreconditionerKind::Identity,
            PreconditionerKind::Diagonal,
            PreconditionerKind::BlockJacobi,
            PreconditionerKind::TwoLevel,
            PreconditionerKind::Auto,
        ];
        body.solver.preconditioner = random.pick(&kinds);
        if random.chance(0.2) {
            body.solver.fixed_iterations = Some(random.whole(2, 20));
        }
        body.solver.warm_start = random.chance(0.2);
    }
}

/// Springs whose fastest mode is within reach of its method.
fn springs(random: &mut Random, body: &mut Body, (mass, dt): (f64, f64)) {
    let most: f64 = if body.integrator.is_implicit() { 1e4 } else { 30.0 };
    let stiffness = mass / (dt * dt) * random.decades(1e-4 * most.min(100.0), most);
    let damped = random.chance(0.5) || body.integrator == Integrator::ExplicitEuler;
    let damping = if damped { (stiffness * mass).sqrt() * random.decades(1e-3, 0.3) } else { 0.0 };
    let law = |share: f64| SpringLaw { stiffness: share * stiffness, damping: share * damping };
    let is_chain = matches!(body.mesh, Mesh::Chain { .. });
    let shear = (!is_chain && random.chance(0.7)).then(|| law(random.decades(0.05, 1.0)));
    let bend = random.chance(0.4).then(|| law(random.decades(0.001, 0.3)));
    body.springs = Some(Springs { file: None, pattern: None, stretch: Some(law(1.0)), shear, bend });
}

/// Pins, some of which move.
fn pins(random: &mut Random, body: &mut Body, count: u32, scale: Scale) {
    let mut pins: Vec<_> = (0..random.whole(1, 3)).map(|_| random.whole(0, count - 1)).collect();
    pins.sort_unstable();
    pins.dedup();
    if pins.len() as u32 == count {
        return;
    }
    body.pins = pins.iter().map(|pin| Pin::Index(*pin)).collect();
    if random.chance(0.4) {
        let speed = random.decades(0.01, 5.0);
        let duration = scale.dt * f64::from(random.whole(1, 40));
        let along = random.direction().map(|c| speed * duration * c);
        let all_alike = random.chance(0.5);
        for pin in &pins {
            let along = if all_alike { along } else { random.direction().map(|c| speed * duration * c) };
            let pin = Pin::Index(*pin);
            body.moving_pins.push(MovingPin { pin, target: None, offset: Some(along), duration });
        }
    }
}

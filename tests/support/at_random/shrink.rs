//! A smaller scene that still fails: bodies, colliders, terms, particles and steps are left out one after the other.

use nappe_scene::{Body, ColliderText, Mesh, Solver};
use nappe_sim::mesh::TriangleMesh;

use super::Case;

/// Rounds of leaving out, at most.
const ROUNDS: usize = 8;

/// What leaves something out.
type Change = Box<dyn Fn(&mut Case)>;

/// The smallest scene found that `fails`, from one that does.
pub fn smallest(case: &Case, fails: impl Fn(&Case) -> bool) -> Case {
    let mut least = case.clone();
    for _ in 0..ROUNDS {
        let mut is_smaller = false;
        for change in changes(&least) {
            let mut smaller = least.clone();
            change(&mut smaller);
            forget_meshes(&mut smaller);
            if weight(&smaller) < weight(&least) && fails(&smaller) {
                least = smaller;
                is_smaller = true;
            }
        }
        if !is_smaller {
            break;
        }
    }
    least
}

/// How much there is to a scene.
fn weight(case: &Case) -> usize {
    let points: usize = case.meshes.values().map(|mesh| mesh.points.len()).sum();
    case.scene.to_toml().len() + 100 * points + case.scene.steps as usize
}

/// Leaves out the files that nothing names.
fn forget_meshes(case: &mut Case) {
    let names = |mesh: &Mesh, file: &str| matches!(mesh, Mesh::File { file: named, .. } if named == file);
    let Case { scene, meshes } = case;
    meshes.retain(|file, _| scene.meshes().any(|mesh| names(mesh, file)));
}

/// All that can be left out of a scene.
fn changes(case: &Case) -> Vec<Change> {
    let steps = case.scene.steps;
    let mut all: Vec<Change> = vec![
        Box::new(move |case| case.scene.steps = (steps / 2).max(1)),
        Box::new(move |case| case.scene.steps = (steps - 1).max(1)),
        Box::new(|case| case.scene.gravity = [0.0; 3]),
        Box::new(|case| case.scene.wind = [0.0; 3]),
        Box::new(|case| case.scene.wind_at.clear()),
    ];
    for i in 0..case.scene.bodies.len() {
        all.push(Box::new(move |case| {
            if i < case.scene.bodies.len() {
                case.scene.bodies.remove(i);
            }
        }));
        all.extend(of_body().into_iter().map(|change| {
            let change: Change =
                Box::new(move |case| case.scene.bodies.get_mut(i).into_iter().for_each(change));
            change
        }));
        all.push(Box::new(move |case| halve(case, i)));
    }
    for i in 0..case.scene.colliders.len() {
        all.push(Box::new(move |case| {
            if i < case.scene.colliders.len() {
                case.scene.colliders.remove(i);
            }
        }));
        all.extend(of_collider().into_iter().map(|change| {
            let change: Change =
                Box::new(move |case| case.scene.colliders.get_mut(i).into_iter().for_each(change));
            change
        }));
    }
    for i in 0..case.scene.snow.as_ref().map_or(0, |snow| snow.objects.len()) {
        all.push(Box::new(move |case| {
            let objects = case.scene.snow.as_mut().map(|snow| &mut snow.objects);
            if let Some(objects) = objects.filter(|objects| i < objects.len()) {
                objects.remove(i);
            }
        }));
    }
    all
}

/// What can be left out of a body.
fn of_body() -> [fn(&mut Body); 10] {
    [
        |body| body.drag = 0.0,
        |body| body.air = None,
        |body| body.laws.clear(),
        |body| body.forces.clear(),
        |body| body.moving_pins.clear(),
        |body| {
            body.moving_pins.clear();
            body.pins.clear();
        },
        |body| body.velocity = [0.0; 3],
        |body| body.transform.rotate = None,
        |body| body.springs.iter_mut().for_each(|springs| (springs.bend, springs.shear) = (None, None)),
        |body| body.solver = Solver::default(),
    ]
}

/// What can be left out of a collider.
fn of_collider() -> [fn(&mut ColliderText); 5] {
    [
        |collider| collider.keys.clear(),
        |collider| collider.velocity = [0.0; 3],
        |collider| collider.friction = 0.0,
        |collider| collider.restitution = 0.0,
        |collider| collider.margin = 0.0,
    ]
}

/// Leaves half of the particles of a body.
fn halve(case: &mut Case, number: usize) {
    let Case { scene, meshes } = case;
    let Some(body) = scene.bodies.get_mut(number) else { return };
    match &mut body.mesh {
        Mesh::Grid { grid, .. } => *grid = grid.map(|side| (side / 2).max(2)),
        Mesh::Chain { chain, .. } => *chain = (*chain / 2).max(2),
        Mesh::File { file, .. } => meshes.get_mut(file).into_iter().for_each(halve_mesh),
        _ => {}
    }
}

fn halve_mesh(mesh: &mut TriangleMesh) {
    let kept = (mesh.points.len() / 2).max(3).min(mesh.points.len());
    mesh.points.truncate(kept);
    mesh.velocities.truncate(kept);
    mesh.triangles.retain(|corners| corners.iter().all(|corner| (*corner as usize) < kept));
}

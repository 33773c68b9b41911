//! A body of a scene to particles, springs and settings.

use std::sync::Arc;

use nappe_sim::{
    cloth::{ClothSettings, Network, Spring, SpringKind, SpringLaw, SpringRules, StateLimits},
    linalg::{SolverSettings, Stop},
    mesh::TriangleMesh,
    world::BodySetup,
};

use super::{
    MeshSource, mass, pins, size,
    size::{Owner, Size},
    transform,
};
use crate::{
    body::{Body, Law, Mesh, Pattern, Plane, Springs},
    error::{Fault, SceneError},
    mesh::course_grid,
    source::{Path, Source},
};

/// A body with its place in the scene, for messages.
pub(super) struct Context<'a> {
    pub(super) body: &'a Body,
    pub(super) path: Path,
    pub(super) source: &'a Source,
}

impl Context<'_> {
    /// The body, where its size is held against limits.
    fn owner(&self) -> Owner<'_> {
        Owner { path: &self.path, source: self.source, noun: "body" }
    }
}

/// How particles are numbered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Layout {
    /// Row by row.
    Grid { columns: u32, rows: u32 },
    /// One after the other.
    Chain,
    /// As a file has them.
    Free,
}

/// A body made.
pub(super) struct Made {
    pub(super) setup: BodySetup,
    pub(super) layout: Layout,
    pub(super) remarks: Vec<String>,
}

pub(super) fn build(
    context: &Context<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<Made, SceneError> {
    let body = context.body;
    let (mut mesh, layout) = make_mesh(context, meshes, size)?;
    let mut remarks = check(context, &mesh, layout)?;
    transform::apply(context, &mut mesh)?;
    let mut pinned = mass::apply(context, &mut mesh)?;
    let mut network = make_network(context, &mesh, layout, size)?;
    if network.springs.is_empty() {
        remarks.push("there are no springs: the particles are free of each other".to_owned());
    }
    pinned.extend(pins::particles(context, layout, mesh.points.len())?);
    pinned.sort_unstable();
    pinned.dedup();
    let is_free = |i: usize| network.masses[i] != 0.0 && pinned.binary_search(&(i as u32)).is_err();
    let free: Vec<bool> = (0..network.x.len()).map(is_free).collect();
    if !free.contains(&true) {
        remarks.push("every particle is pinned: nothing moves by itself".to_owned());
    }
    for (v, free) in network.v.iter_mut().zip(free) {
        *v = if free { body.velocity } else { [0.0; 3] };
    }
    network.pins = pinned;
    network.drag = body.drag;
    let setup = BodySetup { name: body.name.clone(), network, settings: settings(context)? };
    Ok(Made { setup, layout, remarks })
}

/// What is odd about a mesh that came from outside; formulas give sound ones.
fn check(context: &Context<'_>, mesh: &TriangleMesh, layout: Layout) -> Result<Vec<String>, SceneError> {
    if layout != Layout::Free {
        return Ok(Vec::new());
    }
    let bad = |error: nappe_sim::mesh::MeshError| {
        context.source.error(Fault::BadMesh, &context.path.key("mesh"), error.to_string())
    };
    Ok(mesh.check().map_err(bad)?.iter().map(ToString::to_string).collect())
}

fn make_mesh(
    context: &Context<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<(TriangleMesh, Layout), SceneError> {
    let mesh = match &context.body.mesh {
        &Mesh::Grid { grid: [columns, rows], spacing, plane, ripple } => {
            size.add_particles(&context.owner(), "mesh", u64::from(columns) * u64::from(rows))?;
            let mesh = grid([columns, rows], spacing, plane, ripple);
            return Ok((mesh, Layout::Grid { columns, rows }));
        }
        &Mesh::CourseGrid { course_grid: side } => {
            size.add_particles(&context.owner(), "mesh", u64::from(side).pow(2))?;
            let mesh = course_grid(side as usize, side as usize, 0.1);
            return Ok((mesh, Layout::Grid { columns: side, rows: side }));
        }
        &Mesh::Chain { chain, spacing } => {
            size.add_particles(&context.owner(), "mesh", u64::from(chain))?;
            let points = (0..chain).map(|i| [f64::from(i) * spacing, 0.0, 0.0]).collect();
            return Ok((TriangleMesh { points, ..TriangleMesh::default() }, Layout::Chain));
        }
        Mesh::Upload { .. } | Mesh::File { .. } => {
            let mesh = load(&context.body.mesh, meshes, &context.path.key("mesh"), context.source)?;
            size.add_particles(&context.owner(), "mesh", mesh.points.len() as u64)?;
            Arc::unwrap_or_clone(mesh)
        }
    };
    Ok((mesh, Layout::Free))
}

/// A mesh that came from outside; none for one by formula.
pub(super) fn load(
    mesh: &Mesh,
    meshes: &dyn MeshSource,
    path: &Path,
    source: &Source,
) -> Result<Arc<TriangleMesh>, SceneError> {
    match mesh {
        Mesh::Upload { upload } => meshes.upload(upload).ok_or_else(|| {
            let message = format!("no mesh with the id '{upload}' was uploaded, or it is no longer kept");
            source.error(Fault::MeshNotFound, &path.key("upload"), message)
        }),
        Mesh::File { file } => meshes.file(file).map(Arc::new),
        Mesh::Grid { .. } | Mesh::Chain { .. } | Mesh::CourseGrid { .. } => {
            let message = "is a formula; allowed here: { file = \"...\" } or { upload = \"...\" }";
            Err(source.error(Fault::Inconsistent, path, message))
        }
    }
}

fn grid([columns, rows]: [u32; 2], spacing: f64, plane: Plane, ripple: f64) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns as usize, rows as usize, spacing);
    for (i, point) in mesh.points.iter_mut().enumerate() {
        let c = i % columns as usize;
        let height = if ripple == 0.0 { 0.0 } else { ripple * (-2.5 * c as f64).sin() };
        let [x, _, z] = *point;
        *point = match plane {
            Plane::Horizontal => [x, height, z],
            Plane::Upright => [x, -z, height],
        };
    }
    mesh
}

fn make_network(
    context: &Context<'_>,
    mesh: &TriangleMesh,
    layout: Layout,
    size: &mut Size<'_>,
) -> Result<Network, SceneError> {
    let Some(springs) = &context.body.springs else { return Ok(particles(mesh)) };
    let pattern = match (springs.pattern, layout, &context.body.mesh) {
        (Some(Pattern::Lattice), Layout::Chain | Layout::Free, _) => {
            let path = context.path.key("springs").key("pattern");
            let message = "is 'lattice': only grids have rows and columns; allowed here: edges";
            return Err(context.source.error(Fault::Inconsistent, &path, message));
        }
        (Some(pattern), ..) => pattern,
        (None, _, Mesh::Grid { .. }) => Pattern::Lattice,
        (None, ..) => Pattern::Edges,
    };
    let rules = SpringRules {
        stretch: law(springs.stretch),
        shear: springs.shear.map(law),
        bend: springs.bend.map(law),
    };
    match (layout, pattern) {
        (Layout::Chain, _) => chain(context, mesh, springs, size),
        (Layout::Grid { columns, rows }, Pattern::Lattice) => {
            let [stretch, shear, bend] = size::lattice_springs(u64::from(columns), u64::from(rows));
            let wanted = stretch + rules.shear.map_or(0, |_| shear) + rules.bend.map_or(0, |_| bend);
            size.add_springs(&context.owner(), wanted)?;
            // Masses are in the mesh by now: no particle takes the default.
            Ok(Network::from_lattice(mesh, [columns as usize, rows as usize], &rules, 0.0))
        }
        _ => {
            let network = Network::from_mesh(mesh, &rules, 0.0);
            size.add_springs(&context.owner(), network.springs.len() as u64)?;
            Ok(network)
        }
    }
}

fn particles(mesh: &TriangleMesh) -> Network {
    let count = mesh.points.len();
    Network {
        x: mesh.points.clone(),
        v: vec![[0.0; 3]; count],
        masses: mesh.masses.clone(),
        triangles: mesh.triangles.clone(),
        uv: mesh.uv.clone(),
        ..Network::default()
    }
}

/// Springs from each particle to the next, and with `bend` to the one after it.
fn chain(
    context: &Context<'_>,
    mesh: &TriangleMesh,
    springs: &Springs,
    size: &mut Size<'_>,
) -> Result<Network, SceneError> {
    if springs.shear.is_some() {
        let path = context.path.key("springs").key("shear");
        let message = "does not go with a chain: it has no cells; allowed: stretch and bend";
        return Err(context.source.error(Fault::Inconsistent, &path, message));
    }
    let mut network = particles(mesh);
    let count = mesh.points.len() as u32;
    let kinds = [(SpringKind::Stretch, 1, Some(springs.stretch)), (SpringKind::Bend, 2, springs.bend)];
    for (kind, apart, made_of) in kinds {
        let Some(made_of) = made_of else { continue };
        size.add_springs(&context.owner(), u64::from(count.saturating_sub(apart)))?;
        for a in 0..count.saturating_sub(apart) {
            let b = a + apart;
            let (p, q) = (mesh.points[a as usize], mesh.points[b as usize]);
            let rest_length = [0, 1, 2].iter().map(|&i| (q[i] - p[i]).powi(2)).sum::<f64>().sqrt();
            network.springs.push(Spring { particles: [a, b], kind, rest_length, law: law(made_of) });
        }
    }
    Ok(network)
}

fn law(law: Law) -> SpringLaw {
    SpringLaw { stiffness: law.stiffness, damping: law.damping }
}

fn settings(context: &Context<'_>) -> Result<ClothSettings, SceneError> {
    let body = context.body;
    let solver = context.path.key("solver");
    let error = |path: &Path, message: &str| Err(context.source.error(Fault::Inconsistent, path, message));
    let stop = match (body.solver.fixed_iterations, body.solver.tolerance, body.solver.max_iterations) {
        (Some(count), None, None) => Stop::Iterations(count),
        (Some(_), Some(_), _) => {
            return error(&solver.key("tolerance"), "does not go with fixed_iterations");
        }
        (Some(_), _, Some(_)) => {
            return error(&solver.key("max_iterations"), "does not go with fixed_iterations");
        }
        (None, tolerance, cap) => {
            let Stop::Residual { tolerance: default_tolerance, max_iterations } =
                SolverSettings::default().stop
            else {
                return error(&solver, "has no default tolerance");
            };
            Stop::Residual {
                tolerance: tolerance.unwrap_or(default_tolerance),
                max_iterations: cap.unwrap_or(max_iterations),
            }
        }
    };
    if !body.grain.is_power_of_two() {
        let message = format!("is {}; allowed: a power of two, 32 to 4096", body.grain);
        return Err(context.source.error(Fault::OutOfRange, &context.path.key("grain"), message));
    }
    Ok(ClothSettings {
        integrator: body.integrator,
        hessian: body.hessian,
        solver: SolverSettings {
            stop,
            preconditioner: body.solver.preconditioner,
            operator: body.solver.operator,
            warm_start: body.solver.warm_start,
        },
        substeps: body.substeps,
        limits: StateLimits { max_stretch: body.limits.max_stretch, max_energy: body.limits.max_energy },
        grain: body.grain,
    })
}

//! A body of a scene to particles, springs and settings.

use std::sync::Arc;

use nappe_sim::{
    cloth::{RestSettings, SurfaceSettings},
    mesh::TriangleMesh,
    world::{BodySetup, Change},
};

use super::{
    elements::{self, LawsText},
    inside::Solid,
    mass::{self, SaidBy},
    meshes::{MeshSource, load, load_springs},
    pins::{self, Layout},
    repair,
    size::{Owner, Size},
    springs::SpringsText,
    start::ClothStart,
    stepping::settings,
    thickness, units,
};
use crate::{
    body::{Body, GridPlane, Mesh, MeshRepair},
    error::SceneError,
    location::Location,
    mesh::course_grid,
    transform::Transform,
};

/// A body as it is written, and where it stands.
pub(super) struct BodyText<'a> {
    pub(super) body: &'a Body,
    pub(super) at: Location<'a>,
    /// Time step of the scene (s).
    pub(super) dt: f64,
    /// How surfaces of the scene meet each other.
    pub(super) contact: SurfaceSettings,
    /// When its pieces count as calm.
    pub(super) rest: Option<RestSettings>,
    /// The colliders of the scene.
    pub(super) solids: &'a [Solid<'a>],
}

impl BodyText<'_> {
    /// The body, where its size is checked against limits.
    fn owner(&self) -> Owner<'_> {
        Owner { at: &self.at, noun: "body" }
    }
}

/// A body made.
pub(super) struct Made {
    pub(super) setup: BodySetup,
    /// Changes before the first step: moving pins.
    pub(super) changes: Vec<Change>,
    pub(super) warnings: Vec<String>,
}

/// Builds a body; an error stands in the first of its keys that does not fit.
pub(super) fn build(
    text: &BodyText<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<Made, SceneError> {
    let (body, first_particle) = (text.body, size.particles());
    elements::check_material(body, &text.at)?;
    let (mut mesh, layout, mut warnings) = make_mesh(text, meshes, size)?;
    elements::check_triangles(body, &mesh, &text.at)?;
    move_mesh(&mut mesh, &body.transform, &text.at.key("transform"))?;
    let (mass, said_by) =
        (body.mass_of_all(), if body.material.is_some() { SaidBy::Fabric } else { SaidBy::Mass });
    warnings.extend(units::questions(&mesh, mass));
    let mut pinned = mass::apply(mass, &mut mesh, (said_by, &text.at.key(said_by.key())))?;
    pinned.extend(pins::particles(&body.pins, layout, mesh.points.len(), &text.at.key("pins"))?);
    pinned.sort_unstable();
    pinned.dedup();
    let is_free = |i: usize| mesh.masses[i] != 0.0 && pinned.binary_search(&(i as u32)).is_err();
    let free: Vec<bool> = (0..mesh.points.len()).map(is_free).collect();
    let start = ClothStart { name: &body.name, on_pass: body.on_pass, free: &free };
    warnings.extend(start.settle(&mut mesh.points, text.solids)?);

    let springs = SpringsText { springs: body.springs.as_ref(), mesh: &body.mesh, at: &text.at };
    let mut network = springs.network(&mesh, layout, size)?;
    let laws = LawsText { body, at: &text.at };
    network.elements = laws.elements(&mesh, size, &mut warnings)?;
    if network.springs.is_empty() && network.elements.is_empty() {
        warnings.push("there are no springs: the particles are free of each other".to_owned());
    }

    if !free.contains(&true) {
        warnings.push("every particle is pinned: nothing moves by itself".to_owned());
    }

    let forces = pins::forces(&body.forces, layout, &free, &text.at.key("force"))?;
    for (i, (v, free)) in network.v.iter_mut().zip(free).enumerate() {
        let own = mesh.velocities.get(i).copied().unwrap_or_default();
        *v = if free { [0, 1, 2].map(|c| own[c] + body.velocity[c]) } else { [0.0; 3] };
    }
    network.pins = pinned;
    network.drag = body.drag;
    network.air = body.air;
    network.thickness = body.thickness;
    if body.air.is_some() && mesh.triangles.is_empty() {
        let message = "acts on triangles, and the mesh has none: a chain feels drag";
        return text.at.key("air").inconsistent(message);
    }
    let at = text.at.key("moving_pin");
    let settings = settings(body, &text.at, text.dt, text.contact, text.rest)?;
    thickness::check(&network, &settings, &text.at)?;
    let changes = pins::moves(&body.moving_pins, layout, &network, first_particle, &at)?;
    Ok(Made { setup: BodySetup { name: body.name.clone(), network, settings, forces }, changes, warnings })
}

fn move_mesh(mesh: &mut TriangleMesh, transform: &Transform, at: &Location<'_>) -> Result<(), SceneError> {
    if *transform == Transform::default() {
        return Ok(());
    }
    let motion = transform.motion(at)?;
    for point in &mut mesh.points {
        *point = motion.apply(point.map(|c| c * transform.scale));
    }
    for length in mesh.springs.iter_mut().filter_map(|spring| spring.rest_length.as_mut()) {
        *length *= transform.scale;
    }
    let origin = motion.apply([0.0; 3]);
    for velocity in &mut mesh.velocities {
        let turned = motion.apply(*velocity);
        *velocity = [0, 1, 2].map(|c| turned[c] - origin[c]);
    }
    Ok(())
}

/// The mesh, how its points are numbered, and what is odd about one that came from outside; formulas give sound ones.
fn make_mesh(
    text: &BodyText<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<(TriangleMesh, Layout, Vec<String>), SceneError> {
    match &text.body.mesh {
        &Mesh::Grid { grid: [columns, rows], spacing, plane, ripple } => {
            size.add_particles(&text.owner(), "mesh", u64::from(columns) * u64::from(rows))?;
            let mesh = grid([columns, rows], spacing, plane, ripple);
            Ok((mesh, Layout::Grid { columns, rows }, Vec::new()))
        }
        &Mesh::CourseGrid { course_grid: side } => {
            size.add_particles(&text.owner(), "mesh", u64::from(side).pow(2))?;
            let mesh = course_grid(side as usize, side as usize, 0.1);
            Ok((mesh, Layout::Grid { columns: side, rows: side }, Vec::new()))
        }
        &Mesh::Chain { chain, spacing } => {
            size.add_particles(&text.owner(), "mesh", u64::from(chain))?;
            let points = (0..chain).map(|i| [f64::from(i) * spacing, 0.0, 0.0]).collect();
            Ok((TriangleMesh { points, ..TriangleMesh::default() }, Layout::Chain, Vec::new()))
        }
        Mesh::Upload { repair, .. } | Mesh::File { repair, .. } => {
            let at = text.at.key("mesh");
            let mesh = load(&text.body.mesh, meshes, &at)?;
            // A repair may leave fewer points; without one, all of them are about to be copied.
            if *repair == MeshRepair::default() {
                size.check_particles(&text.owner(), "mesh", mesh.points.len() as u64)?;
            }
            let mut mesh = Arc::unwrap_or_clone(mesh);
            if let Some(table) = text.body.springs_file() {
                mesh.springs = load_springs(table, mesh.points.len(), meshes, &text.at.key("springs"))?;
            }
            let told = repair::put_in_order(&mut mesh, *repair, &at)?;
            size.add_particles(&text.owner(), "mesh", mesh.points.len() as u64)?;
            Ok((mesh, Layout::Free, told))
        }
    }
}

fn grid([columns, rows]: [u32; 2], spacing: f64, plane: GridPlane, ripple: f64) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns as usize, rows as usize, spacing);
    for (i, point) in mesh.points.iter_mut().enumerate() {
        let c = i % columns as usize;
        let height = if ripple == 0.0 { 0.0 } else { ripple * (-2.5 * c as f64).sin() };
        let [x, _, z] = *point;
        *point = match plane {
            GridPlane::Horizontal => [x, height, z],
            GridPlane::Upright => [x, -z, height],
        };
    }
    mesh
}

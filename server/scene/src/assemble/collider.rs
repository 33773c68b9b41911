//! A collider of the scene: its mesh, if it has one, is counted, moved and closed before a solid is made of it.

use std::mem;

use nappe_sim::{
    collide::{Collider, shape::MeshSolid},
    mesh::TriangleMesh,
};

use super::{
    meshes::{MeshSource, load},
    repair::weld,
    size::{Owner, Size},
    units,
};
use crate::{
    collider::{ColliderMesh, ColliderText},
    error::{ErrorKind, SceneError},
    location::Location,
    mesh::{Holes, MOST_EDGES, Mended, NotClosed, mend},
    parts::MeshParts,
};

/// What became of the mesh of a collider.
#[derive(Clone, Debug, PartialEq)]
pub struct ColliderSolid {
    /// Name of the collider.
    pub name: String,
    /// Triangles of its surface.
    pub triangles: usize,
    /// Holes that were filled.
    pub holes_closed: usize,
    /// Volume (m³) that it encloses, that which parts share once.
    pub volume: f64,
    /// Its parts, which no edge joins.
    pub parts: MeshParts,
}

/// A collider made.
pub(super) struct Made {
    pub(super) collider: Collider,
    /// What became of its mesh.
    pub(super) solid: Option<ColliderSolid>,
    pub(super) warnings: Vec<String>,
}

/// Builds a collider; `at` is where it stands.
pub(super) fn build(
    text: &ColliderText,
    at: &Location<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<Made, SceneError> {
    let (mut solid, mut warnings) = (None, Vec::new());
    let collider = text.assemble(at, |mesh| {
        let (welded, mut mended) = mended(mesh, at, meshes, size)?;
        let surface = mem::take(&mut mended.surface);
        let made = MeshSolid::new(surface.points, surface.triangles);
        let made = made.map_err(|why| at.key("mesh").error(ErrorKind::BadMesh, why))?;
        warnings.extend(welded);
        warnings.extend(told(&mended));
        let parts = MeshParts::of(&mended, made.crossings());
        warnings.extend(parts.told());
        warnings.extend(units::question_of_solid(made.points(), parts.volume));
        solid = Some(ColliderSolid {
            name: text.name.clone(),
            triangles: made.triangles().len(),
            holes_closed: mended.holes,
            volume: parts.volume,
            parts,
        });
        // The transform takes the origin there.
        Ok(made.with_origin(mesh.transform.translate).into())
    })?;
    Ok(Made { collider, solid, warnings })
}

/// The surface of a mesh where it stands in the world, after what is told of points that were joined.
fn mended(
    text: &ColliderMesh,
    at: &Location<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<(Option<String>, Mended), SceneError> {
    let (owner, key) = (Owner { at, noun: "collider" }, at.key("mesh"));
    let bad = |message: String| key.error(ErrorKind::BadMesh, message);
    let mesh = load(&text.mesh, meshes, &key)?;
    size.check_collider_triangles(&owner, mesh.triangles.len() as u64)?;
    mesh.validate().map_err(|error| bad(error.to_string()))?;

    // Nothing else of it means anything here.
    let (points, triangles) = (mesh.points.clone(), mesh.triangles.clone());
    let mut moved = TriangleMesh { points, triangles, ..TriangleMesh::default() };
    let welded = weld(&mut moved, text.mesh.repair(), &key)?;
    let motion = text.transform.motion(&key.key("transform"))?;
    for point in &mut moved.points {
        *point = motion.apply(point.map(|c| c * text.transform.scale));
    }
    let holes = if text.close_holes { Holes::Filled } else { Holes::Refused };
    let is_welded = welded.is_some();
    let mended = mend(&moved, holes).map_err(|error| {
        let hint = if is_welded { "" } else { weld_hint(&error) };
        bad(format!("{}{hint}", in_words(&error, holes)))
    })?;
    // Triangles that fill holes count too.
    size.add_collider_triangles(&owner, mended.surface.triangles.len() as u64)?;
    Ok((welded, mended))
}

/// Why a mesh encloses no solid, with the key that helps.
fn in_words(error: &NotClosed, holes: Holes) -> String {
    match (error, holes) {
        (NotClosed::Edge { triangles: 1, .. }, Holes::Refused) => {
            format!("{error}; close_holes = true fills holes of at most {MOST_EDGES} edges")
        }
        _ => error.to_string(),
    }
}

/// The key that helps where pieces of a mesh may touch without sharing points.
fn weld_hint(error: &NotClosed) -> &'static str {
    if matches!(error, NotClosed::Edge { triangles: 1, .. }) {
        "; where pieces of it touch and share no points, weld = 1e-6 joins these"
    } else {
        ""
    }
}

/// What was left out of a mesh, and what was added.
fn told(mended: &Mended) -> Vec<String> {
    let repeated = mended.repeated.map(|(count, first)| match count {
        1 => format!("1 repeated triangle, {first}: it counts once"),
        _ => format!("{count} repeated triangles, the first is {first}: each counts once"),
    });
    let filled = match mended.holes {
        0 => None,
        1 => Some("1 hole is filled (close_holes = true)".to_owned()),
        holes => Some(format!("{holes} holes are filled (close_holes = true)")),
    };
    repeated.into_iter().chain(filled).collect()
}

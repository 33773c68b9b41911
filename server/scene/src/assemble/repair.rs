//! A mesh from outside, put in order before a body is made of it: points without triangles, points that are to be one,
//! triangles that are there twice.

use nappe_sim::{
    math::number,
    mesh::{MeshError, TriangleMesh, Welded},
};

use crate::{
    body::{MeshRepair, Unused},
    error::{ErrorKind, SceneError},
    location::Location,
};

/// Checks a mesh and does what its scene asks for; what was done and what is odd are told. `at` is where the mesh stands.
pub(super) fn put_in_order(
    mesh: &mut TriangleMesh,
    repair: MeshRepair,
    at: &Location<'_>,
) -> Result<Vec<String>, SceneError> {
    let bad = |error: MeshError| at.error(ErrorKind::BadMesh, error.to_string());
    mesh.validate().map_err(bad)?;

    let mut told = Vec::new();
    if repair.unused == Unused::Drop {
        let count = mesh.drop_unused();
        if mesh.points.is_empty() {
            let message = "is \"drop\", and no triangle names any point of this mesh: nothing is left; allowed here: keep";
            return at.key("unused").inconsistent(message);
        }
        if count > 0 {
            let points = if count == 1 { "point" } else { "points" };
            told.push(format!("unused = \"drop\" leaves out {count} {points}, which no triangle names"));
        }
    }

    told.extend(weld(mesh, repair, at)?);
    told.extend(mesh.drop_repeated().map(|warning| warning.to_string()));
    let odd = mesh.check().map_err(bad)?;
    told.extend(odd.iter().map(ToString::to_string));
    Ok(told)
}

/// Joins the points of a sound mesh that its scene wants to be one; what was done is told, if anything was asked for.
pub(super) fn weld(
    mesh: &mut TriangleMesh,
    repair: MeshRepair,
    at: &Location<'_>,
) -> Result<Option<String>, SceneError> {
    if repair.weld == 0.0 {
        return Ok(None);
    }
    let out_of_range = |error: MeshError| at.key("weld").error(ErrorKind::OutOfRange, error.to_string());
    let welded = mesh.weld(repair.weld).map_err(out_of_range)?;
    Ok(Some(weld_in_words(repair.weld, welded, mesh.points.len())))
}

fn weld_in_words(distance: f64, Welded { joined, dropped }: Welded, left: usize) -> String {
    let distance = number(distance);
    let flattened = match dropped {
        0 => String::new(),
        1 => "; 1 triangle has two corners at one point then and is left out".to_owned(),
        _ => format!("; {dropped} triangles have two corners at one point then and are left out"),
    };
    match joined {
        0 => format!("weld = {distance} joins no points: no two are that near to each other"),
        1 => format!("weld = {distance} joins 1 point to an earlier one, {left} are left{flattened}"),
        _ => format!("weld = {distance} joins {joined} points to earlier ones, {left} are left{flattened}"),
    }
}

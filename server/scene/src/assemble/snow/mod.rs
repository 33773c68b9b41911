//! The snow of a scene to objects of particles and settings.

use nappe_sim::snow::{SnowObject, SnowSetup};

mod material;
mod settings;
mod object;

use object::Plan;

use super::{
    MeshSource, body,
    size::{Owner, Size},
    transform,
};
use crate::{
    error::SceneError,
    location::Place,
    snow::{Snow, SnowBody},
    source::{Path, Source},
};

/// Builds all objects; the strings are remarks.
pub(super) fn build(
    text: &Snow,
    source: &Source,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<(SnowSetup, Vec<String>), SceneError> {
    let path = Path::default().key("snow");
    let settings = settings::settings(text, &Place { path: path.clone(), source })?;
    let (mut objects, mut remarks) = (Vec::new(), Vec::new());
    for (i, body) in text.objects.iter().enumerate() {
        let place = Place { path: path.key("object").index(i), source };
        let (object, odd) = build_object(body, text.cell, &place, meshes, size)?;
        remarks.extend(odd.iter().map(|remark| format!("snow '{}': {remark}", body.name)));
        objects.push(object);
    }
    Ok((SnowSetup { objects, settings }, remarks))
}

fn build_object(
    text: &SnowBody,
    cell: f64,
    place: &Place<'_>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<(SnowObject, Vec<String>), SceneError> {
    let owner = Owner { path: &place.path, source: place.source, noun: "object" };
    let field = match (text.particles, text.particles_per_cell) {
        (Some(_), _) => "particles",
        (None, Some(_)) => "particles_per_cell",
        (None, None) => text.source_field(),
    };
    let transform = transform::placement(&text.transform, &place.path.key("transform"), place.source)?;
    let load = |mesh| body::load(mesh, meshes, &place.path.key("mesh"), place.source);
    let mesh = text.mesh().map(load).transpose()?;
    let plan = Plan::new(text, place, cell, transform, mesh.as_deref())?;
    // Before memory is taken for them; the number is exact but where a lattice meets a curved
    // surface.
    size.check_particles(&owner, field, plan.estimate())?;
    let (object, remarks) = plan.build()?;
    size.add_particles(&owner, field, object.x.len() as u64)?;
    Ok((object, remarks))
}

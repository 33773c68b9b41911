//! The snow of a scene to objects of particles and settings.

mod settings;
mod material;
mod object;
mod overlap;
mod attach;

use nappe_sim::snow::{SnowObject, SnowSetup};

pub(super) use object::{Plan, particles_per_volume};
pub(super) use settings::settings;

use self::overlap::{EarlierObjects, parts_in_words};
use super::{
    inside::Solid,
    meshes::{MeshSource, load},
    size::{Owner, Size},
    start::settle_snow,
};
use crate::{
    error::{Found, SceneError},
    location::Location,
    snow::{Snow, SnowBody},
};

/// Builds all objects, and keeps the errors of each; the strings are warnings. `at` is where the snow stands.
pub(super) fn build(
    text: &Snow,
    at: &Location<'_>,
    solids: &[Solid<'_>],
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
    found: &mut Found,
) -> Option<(SnowSetup, Vec<String>)> {
    let settings = found.take(settings(text, at));
    let list = at.key("object");
    let places: Vec<Location<'_>> = (0..text.objects.len()).map(|i| list.index(i)).collect();
    let (mut objects, mut warnings, mut earlier) = (Vec::new(), Vec::new(), EarlierObjects::default());
    for (body, at) in text.objects.iter().zip(&places) {
        let built = build_object(body, text.cell, at, &mut earlier, meshes, size).and_then(
            |(mut object, mut odd)| {
                odd.extend(settle_snow(&mut object, text.cell, solids)?);
                attach::check(body, &object, text.cell, solids, at)?;
                Ok((object, odd))
            },
        );
        let Some((object, odd)) = found.take(built) else { continue };
        warnings.extend(odd.iter().map(|warning| format!("snow '{}': {warning}", body.name)));
        objects.push(object);
    }
    Some((SnowSetup { objects, settings: settings? }, warnings))
}

fn build_object<'a>(
    text: &'a SnowBody,
    cell: f64,
    at: &'a Location<'a>,
    earlier: &mut EarlierObjects<'a>,
    meshes: &dyn MeshSource,
    size: &mut Size<'_>,
) -> Result<(SnowObject, Vec<String>), SceneError> {
    let owner = Owner { at, noun: "object" };
    let key = match (text.particles, text.particles_per_cell) {
        (Some(_), _) => "particles",
        (None, Some(_)) => "particles_per_cell",
        (None, None) => text.source_key(),
    };

    let mesh = text.mesh().map(|mesh| load(mesh, meshes, &at.key("mesh"))).transpose()?;
    let plan = Plan::new(text, at, cell, mesh.as_deref())?;
    // Before memory is taken for them; the number is exact but where a lattice meets a curved
    // surface.
    size.check_particles(&owner, key, plan.estimate())?;
    plan.check_crowding(cell)?;
    let (mut object, mut warnings) = plan.build()?;
    if let Some(shared) = plan.shared() {
        let density = object.mass.iter().sum::<f64>() / plan.solid().volume();
        warnings.extend(parts_in_words(shared, text.overlap, density));
    }
    warnings.extend(earlier.compare(&plan, &mut object, at)?);
    if let Some(count) = mesh.as_ref().map(|mesh| mesh.springs.len()).filter(|count| *count > 0) {
        warnings.push(format!("its mesh carries springs ({count}), which snow leaves unused"));
    }
    earlier.add(&plan, at, mesh);
    size.add_particles(&owner, key, object.x.len() as u64)?;
    Ok((object, warnings))
}

//! A scene's text to all that a simulation is made from.
//!
//! Enters: a text, uploaded meshes, limits. Leaves: the scene as read and as built, or the place
//! and kind of each of its errors.

use nappe_scene::{Built, ErrorKind, Scene, SceneErrors, SceneLimits, SceneSize};

use nappe_sim::{linalg::AtCap, math::Precision};

use super::{estimate::Estimate, mesh_store::MeshStore};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
};

/// A scene as read and as built.
#[derive(Debug)]
pub(crate) struct Assembled {
    pub scene: Scene,
    pub built: Built,
    /// The memory of the session, and of the frames that it may keep (bytes), once it is built.
    pub session_bytes: u64,
    /// Those of them that the snow takes.
    pub snow_bytes: u64,
}

/// Who asks for a scene.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Asked<'a> {
    /// The text of the scene.
    pub text: &'a str,
    /// What it is called in messages.
    pub file: &'a str,
    /// None: as the scene says.
    pub precision: Option<Precision>,
    pub thread_count: u32,
}

/// Reads a scene's text and builds what it describes, after its memory was taken from `memory`.
///
/// # Errors
/// What is wrong with the scene, the first error first; or that it takes too much.
pub(crate) fn assemble_scene(
    asked: Asked<'_>,
    meshes: &MeshStore,
    limits: &Limits,
    memory: &Claim,
) -> Result<Assembled, ServiceError> {
    let scene = Scene::parse(asked.text, asked.file).map_err(|error| service_error(&error))?;
    let precision = asked.precision.unwrap_or(scene.precision);
    let size = at_most(scene.size(meshes), limits);
    let estimate = Estimate::of(&size, precision, asked.thread_count);
    estimate.claim(memory, limits)?;
    let patch_bytes = estimate.claim_patches(memory);

    let bounds = SceneLimits { max_particles: limits.max_particles, max_springs: limits.max_springs };
    let mut built = scene.build(meshes, &bounds).map_err(|error| service_error(&error))?;
    if patch_bytes < estimate.patch_bytes {
        go_without_patches(&mut built, estimate.patch_bytes);
    }
    let session_bytes = estimate.session_bytes.saturating_add(limits.history_bytes_per_session);
    let session_bytes = session_bytes.saturating_add(patch_bytes);
    Ok(Assembled { scene, built, session_bytes, snow_bytes: estimate.snow_bytes })
}

/// Lets solves that come to their cap end there, for want of memory.
fn go_without_patches(built: &mut Built, bytes: u64) {
    for body in &mut built.setup.bodies {
        body.settings.solver.at_cap = AtCap::Stop;
    }
    built.warnings.push(format!(
        "solves that come to their cap end there: the {bytes} bytes that the preconditioner patches may take are not left"
    ));
}

/// Counts up to the limits: beyond them, building refuses the scene with the place of what is too much.
fn at_most(size: SceneSize, limits: &Limits) -> SceneSize {
    SceneSize {
        cloth_particles: size.cloth_particles.min(limits.max_particles),
        snow_particles: size.snow_particles.min(limits.max_particles),
        implicit_particles: size.implicit_particles.min(limits.max_particles),
        iterated_particles: size.iterated_particles.min(limits.max_particles),
        tried_particles: size.tried_particles.min(limits.max_particles),
        divided_particles: size.divided_particles.min(limits.max_particles),
        coarse_blocks: size.coarse_blocks.min(limits.max_particles),
        patched_particles: size.patched_particles.min(limits.max_particles),
        switching_particles: size.switching_particles.min(limits.max_particles),
        springs: size.springs.min(limits.max_springs),
        mesh_springs: size.mesh_springs.min(limits.max_springs),
        ..size
    }
}

/// The first error decides the reason and stands in the metadata, where its kind is called `violation`;
/// each error with a key is in `BadRequest` too.
fn service_error(errors: &SceneErrors) -> ServiceError {
    let first = errors.first();
    let reason = match first.kind {
        ErrorKind::TooLarge => Reason::SceneTooLarge,
        ErrorKind::MeshNotFound => Reason::MeshNotFound,
        _ => Reason::InvalidScene,
    };
    let refused = ServiceError::new(reason, errors.to_string()).with("violation", first.kind.reason());
    let refused = if first.line > 0 { refused.with("line", first.line) } else { refused };
    let refused = if first.column > 0 { refused.with("column", first.column) } else { refused };
    let refused = if first.key.is_empty() { refused } else { refused.with("field", &first.key) };

    errors.iter().filter(|error| !error.key.is_empty()).fold(refused, |refused, error| {
        refused.at_field(format!("scene_text: {}", error.key), &error.message)
    })
}

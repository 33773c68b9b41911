//! A scene's text to all that a simulation is made from; and the memory of a session that goes on from a file.
//!
//! Enters: a text, uploaded meshes, limits. Leaves: the scene as read and as built, or the place
//! and kind of each of its errors.

use nappe_scene::{Built, ErrorKind, Scene, SceneErrors, SceneLimits, SceneSize};

use nappe_sim::{linalg::AtCap, math::Precision, world::WorldSetup};

use super::{
    estimate::Estimate,
    held_meshes::{HeldMeshes, Noted},
    mesh_store::MeshStore,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    state::SavedSession,
};

/// Bytes of a body or a collider in the text of a scene at least, beside its name.
const LEAST_BYTES_OF_BODY: usize = 32;

/// A scene as read and as built.
#[derive(Debug)]
pub(crate) struct Assembled {
    pub scene: Scene,
    pub built: Built,
    /// The memory of the session, and of the frames that it may keep (bytes), once it is built.
    pub session_bytes: u64,
    /// Those of them that the snow takes.
    pub snow_bytes: u64,
    /// What it was built from beside its text.
    pub parts: Parts,
}

/// What a scene is built from beside its text, so that the same can be built again.
#[derive(Debug)]
pub(crate) struct Parts {
    meshes: HeldMeshes,
    /// Whether there was memory for patches.
    has_patches: bool,
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
    let meshes = Noted::new(meshes);
    let size = at_most(scene.size(&meshes), limits);
    let estimate = Estimate::of(&size, precision, asked.thread_count);
    estimate.claim(memory, limits)?;
    let patch_bytes = estimate.claim_patches(memory);

    let mut built = scene.build(&meshes, &bounds(limits)).map_err(|error| service_error(&error))?;
    let has_patches = patch_bytes >= estimate.patch_bytes;
    if !has_patches {
        go_without_patches(&mut built, estimate.patch_bytes);
    }
    let session_bytes = estimate.session_bytes.saturating_add(limits.history_bytes_per_session);
    let session_bytes = session_bytes.saturating_add(patch_bytes);
    let parts = Parts { meshes: meshes.into_held(), has_patches };
    Ok(Assembled { scene, built, session_bytes, snow_bytes: estimate.snow_bytes, parts })
}

/// Builds again what a scene's text described, in the same limits, after its memory was taken from `memory`.
///
/// # Errors
/// If there is no memory for it.
pub(super) fn assemble_again(
    (text, file): (&str, &str),
    parts: &Parts,
    limits: &Limits,
    memory: &Claim,
) -> Result<WorldSetup, ServiceError> {
    let scene = Scene::parse(text, file).map_err(|error| service_error(&error))?;
    let size = at_most(scene.size(&parts.meshes), limits);
    memory.grow(Estimate::of(&size, Precision::F64, 0).build_bytes)?;
    let built = scene.build(&parts.meshes, &bounds(limits)).map_err(|error| service_error(&error))?;
    let mut setup = built.setup;
    if !parts.has_patches {
        stop_at_cap(&mut setup);
    }
    Ok(setup)
}

/// What is counted of the memory of a session that goes on from a file (bytes): all of it with the frames that it may keep, once it
/// stands, and of that what its snow takes.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Claimed {
    pub session_bytes: u64,
    pub snow_bytes: u64,
}

/// Takes the memory of a session that goes on from a file from `memory`, before anything of it is built.
///
/// # Errors
/// If it is larger than sessions may be, or takes too much.
pub(crate) fn claim_saved(
    saved: &SavedSession,
    thread_count: u32,
    limits: &Limits,
    memory: &Claim,
) -> Result<Claimed, ServiceError> {
    let size = SceneSize::of_setup(&saved.setup, &saved.initial);
    let particles = size.cloth_particles.saturating_add(size.snow_particles);
    let counts = [
        ("particles", particles, limits.max_particles, "--max-particles"),
        ("springs", size.springs, limits.max_springs, "--max-springs"),
        ("bytes of names", bytes_of_names(saved), limits.max_scene_bytes, "--max-scene-bytes"),
    ];
    if let Some((what, count, allowed, option)) = counts.into_iter().find(|(_, count, most, _)| count > most)
    {
        let message = format!(
            "the session that was saved has {count} {what}; allowed: at most {allowed} ({option} raises the limit)"
        );
        return Err(ServiceError::new(Reason::SceneTooLarge, message)
            .with("value", count)
            .with("allowed", allowed));
    }
    let estimate = Estimate::of(&size, saved.state.precision(), thread_count);
    estimate.claim(memory, limits)?;
    let patch_bytes = estimate.claim_patches(memory);
    if patch_bytes < estimate.patch_bytes {
        // Without them, steps would have other bits.
        let needed = estimate.patch_bytes;
        let message = format!(
            "{needed} bytes are needed for the preconditioner patches, which the session that was saved may use: they are not left"
        );
        return Err(ServiceError::new(Reason::ServerMemoryFull, message).with("needed_bytes", needed));
    }
    let session_bytes = estimate.session_bytes.saturating_add(limits.history_bytes_per_session);
    let session_bytes = session_bytes.saturating_add(patch_bytes);
    Ok(Claimed { session_bytes, snow_bytes: estimate.snow_bytes })
}

/// Bytes that the names in a saved session take in the text of its scene at least: they are told to everybody who lists sessions.
fn bytes_of_names(saved: &SavedSession) -> u64 {
    let title = saved.session.session.as_ref().map_or(0, |session| session.title.len());
    let bodies = saved.setup.bodies.iter().map(|body| &body.name);
    let colliders = saved.setup.colliders.iter().map(|collider| &collider.name);
    let objects = saved.setup.snow.iter().flat_map(|snow| &snow.objects).map(|object| &object.name);
    let names = bodies.chain(colliders).chain(objects).map(|name| name.len() + LEAST_BYTES_OF_BODY);
    (title + names.sum::<usize>()) as u64
}

fn bounds(limits: &Limits) -> SceneLimits {
    SceneLimits { max_particles: limits.max_particles, max_springs: limits.max_springs }
}

/// Lets solves that come to their cap end there, for want of memory.
fn go_without_patches(built: &mut Built, bytes: u64) {
    stop_at_cap(&mut built.setup);
    built.warnings.push(format!(
        "solves that come to their cap end there: the {bytes} bytes that the preconditioner patches may take are not left"
    ));
}

fn stop_at_cap(setup: &mut WorldSetup) {
    for body in &mut setup.bodies {
        body.settings.solver.at_cap = AtCap::Stop;
    }
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
        watched_particles: size.watched_particles.min(limits.max_particles),
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

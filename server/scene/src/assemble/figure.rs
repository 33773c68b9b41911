//! Figures of a scene to bodies that frames lead, and how much they ask for.

use std::sync::Arc;

use nappe_sim::{
    cloth::{Frames, MinimizerKind, Network},
    mesh::MeshError,
    world::BodySetup,
};

use super::{
    estimate::SceneSize,
    meshes::{MeshSource, load, load_frames, uploaded, uploaded_frames},
    size::{Owner, Size},
    thickness,
};
use crate::{
    body::{Body, Mesh},
    error::{ErrorKind, SceneError},
    figure::{Figure, FramesSource},
    location::Location,
    scene::Scene,
    transform::Transform,
};

/// Whether figures can be stepped with what the scene has: with a body that has a thickness. `at` is the first figure.
pub(super) fn check_met(scene: &Scene, at: &Location<'_>) -> Result<(), SceneError> {
    if scene.figures.is_empty() || scene.bodies.iter().any(is_thick) {
        return Ok(());
    }
    at.inconsistent(
        "is a figure, and no body has a thickness: only such bodies meet it; give a body a thickness",
    )
}

fn is_thick(body: &Body) -> bool {
    body.thickness > 0.0
}

/// Builds the figure at `at`, stepped as a body with a thickness is, in steps of the scene of `dt` (s); an error stands in the first of
/// its keys that does not fit.
pub(super) fn build(
    figure: &Figure,
    at: &Location<'_>,
    like: &BodySetup,
    meshes: &dyn MeshSource,
    (size, dt): (&mut Size<'_>, f64),
) -> Result<BodySetup, SceneError> {
    let at_mesh = at.key("mesh");
    let mesh = load(&figure.mesh, meshes, &at_mesh)?;
    size.add_particles(&Owner { at, noun: "figure" }, "mesh", mesh.points.len() as u64)?;
    let bad = |error: MeshError| at_mesh.error(ErrorKind::BadMesh, error.to_string());
    mesh.validate().map_err(bad)?;

    let at_frames = at.key("frames");
    let read = load_frames(&figure.frames.source, meshes, &at_frames)?;
    let places = moved(&read.places, &figure.transform, &at.key("transform"))?;
    let (rate, repeat, start) = (figure.frames.rate, figure.frames.repeat, figure.start);
    let frames = Frames { places, corners: read.points, rate, start, repeat, masses: [].into() };
    if let Some(message) = frames.invalid(mesh.points.len()) {
        return at_frames.inconsistent(message);
    }
    let frames = frames.giving_way(&mesh.triangles, figure.firmness, dt);

    let count = mesh.points.len();
    let network = Network {
        x: frames.frame(0).iter().map(|place| place.map(f64::from)).collect(),
        v: vec![[0.0; 3]; count],
        masses: vec![0.0; count],
        drag: like.network.drag,
        air: like.network.air,
        thickness: figure.thickness,
        triangles: mesh.triangles.clone(),
        uv: mesh.uv.clone(),
        frames: Some(frames),
        ..Network::default()
    };
    thickness::check(&network, &like.settings, at)?;
    Ok(BodySetup { name: figure.name.clone(), network, settings: like.settings, forces: Vec::new() })
}

/// Places of frames (m) moved, in binary32: without a transform those that there are.
fn moved(
    places: &Arc<[[f32; 3]]>,
    transform: &Transform,
    at: &Location<'_>,
) -> Result<Arc<[[f32; 3]]>, SceneError> {
    if *transform == Transform::default() {
        return Ok(Arc::clone(places));
    }
    let motion = transform.motion(at)?;
    let place =
        |place: &[f32; 3]| motion.apply(place.map(|c| f64::from(c) * transform.scale)).map(|c| c as f32);
    Ok(places.iter().map(place).collect())
}

/// What is odd about figures beside the rest of their scene.
pub(super) fn warnings(scene: &Scene) -> Vec<String> {
    let others = [("colliders", !scene.colliders.is_empty()), ("snow", scene.snow.is_some())];
    let met: Vec<&str> = others.iter().filter(|(_, is_there)| *is_there).map(|(what, _)| *what).collect();
    if met.is_empty() {
        return Vec::new();
    }
    let told = |figure: &Figure| {
        format!("figure '{}': it passes through {}, which it does not meet", figure.name, met.join(" and "))
    };
    scene.figures.iter().map(told).collect()
}

impl SceneSize {
    /// Adds what a figure asks for.
    pub(super) fn add_figure(&mut self, figure: &Figure, scene: &Scene, meshes: &dyn MeshSource) {
        let Mesh::Upload { upload, .. } = &figure.mesh else { return };
        let Some(mesh) = uploaded(upload, meshes) else { return };
        let (points, triangles) = (mesh.points.len() as u64, mesh.triangles.len() as u64);
        self.cloth_particles = self.cloth_particles.saturating_add(points);
        self.implicit_particles = self.implicit_particles.saturating_add(points);
        self.divided_particles = self.divided_particles.saturating_add(points);
        if scene
            .bodies
            .iter()
            .find(|body| is_thick(body))
            .is_some_and(|body| body.minimizer == MinimizerKind::Auto)
        {
            self.tried_particles = self.tried_particles.saturating_add(points);
        }
        self.triangles = self.triangles.saturating_add(triangles);
        self.triangles_apart = self.triangles_apart.saturating_add(triangles);
        // Frames that a transform moves are there beside those that were uploaded; those that come with nappe are made for each session.
        if let FramesSource::Upload(id) = &figure.frames.source
            && (figure.transform != Transform::default() || meshes.uploaded_frames(id).is_none())
            && let Some(frames) = uploaded_frames(id, meshes)
        {
            self.frame_bytes = self.frame_bytes.saturating_add(frames.bytes());
        }
    }
}

//! One collider to Rerun: a solid of its shape, or the part of an endless one that the scene needs, moving with
//! its velocity.
//!
//! Enters: `Collider` once, then the time (s) of each frame. Leaves: the shape once, then its position if it moves.

use nappe_client::Collider;

use crate::{
    body::entity_name,
    error::{RerunError, refused},
    extent::Extent,
    geometry::Bounds,
    outline::{Drawing, Outline},
    sdk::{RecordingStream, Transform3D},
};

/// How a collider is drawn.
pub(crate) struct ColliderView {
    path: String,
    outline: Outline,
    /// Its velocity (m/s).
    velocity: [f64; 3],
}

impl ColliderView {
    /// Collider number `index` of a session; none if its shape is newer than this viewer.
    pub(crate) fn new(collider: &Collider, index: usize) -> Option<Self> {
        let path = format!("world/colliders/{}", entity_name(&collider.name, index));
        Some(Self { path, outline: Outline::of(collider.shape.as_ref()?), velocity: collider.velocity })
    }

    /// What it fills.
    pub(crate) fn extent(&self) -> &Extent {
        &self.outline.extent
    }

    /// Grows the bounds of the scene by the foot of bodies that fly freely on a plane, and by where they slide to.
    pub(crate) fn add_foot_to(&self, scene: &mut Bounds, bodies: &Bounds) {
        if let Drawing::Ground(ground) = &self.outline.drawing {
            ground.add_foot_to(scene, bodies, self.origin());
        }
    }

    /// Logs the shape, around its own origin; not a ground that would hide the scene from the eye.
    pub(crate) fn describe(
        &self,
        stream: &RecordingStream,
        scene: &Bounds,
        eye: [f32; 3],
    ) -> Result<(), RerunError> {
        let logged = match &self.outline.drawing {
            Drawing::Solid(solid) => stream.log_static(&*self.path, solid.as_ref()),
            Drawing::Ground(ground) if ground.hides_all_from(eye, self.origin()) => return Ok(()),
            Drawing::Ground(ground) => stream.log_static(&*self.path, &ground.mesh(self.origin(), scene)),
        };
        logged.map_err(refused(&self.path))?;

        if self.moves() {
            return Ok(());
        }
        stream.log_static(&*self.path, &self.transform(0.0)).map_err(refused(&self.path))
    }

    /// Logs the position at `time` (s), if the collider moves.
    pub(crate) fn log(&self, stream: &RecordingStream, time: f64) -> Result<(), RerunError> {
        if !self.moves() {
            return Ok(());
        }
        stream.log(&*self.path, &self.transform(time)).map_err(refused(&self.path))
    }

    fn moves(&self) -> bool {
        self.velocity != [0.0; 3]
    }

    fn origin(&self) -> [f32; 3] {
        self.outline.origin.map(|c| c as f32)
    }

    fn transform(&self, time: f64) -> Transform3D {
        let (Outline { origin, axes, .. }, velocity) = (&self.outline, self.velocity);
        let at: [f32; 3] = std::array::from_fn(|axis| (origin[axis] + time * velocity[axis]) as f32);
        match axes {
            Some(axes) => Transform3D::from_translation_mat3x3(at, *axes),
            None => Transform3D::from_translation(at),
        }
    }
}

//! One collider to Rerun: a solid of its shape, or the part of an endless one that the scene needs, where frames say that it
//! is, or moving with its velocity.
//!
//! Enters: `Collider` once, then frames. Leaves: the shape once, then its place whenever that is another one.

use nappe_client::{Collider, ColliderPose, Frame};

use crate::{
    body::entity_name,
    error::{RerunError, refused},
    extent::Extent,
    geometry::{Bounds, narrow},
    outline::{Drawing, Outline},
    sdk::{RecordingStream, Transform3D},
};

/// The axes of what is not turned.
const WORLD: [[f32; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];

/// How a collider is drawn.
pub(crate) struct ColliderView {
    path: String,
    /// The last part of the path.
    entity: String,
    name: String,
    outline: Outline,
    /// Its reference point at time 0 (m).
    reference: [f64; 3],
    /// Its velocity (m/s).
    velocity: [f64; 3],
    /// Where it was logged last.
    logged: Option<Place>,
}

/// Where a drawing is: its own origin (m), and where its own axes point, one per column; none: along the world's.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Place {
    origin: [f32; 3],
    axes: Option<[[f32; 3]; 3]>,
}

impl ColliderView {
    /// Collider number `index` of a session; none if its shape is newer than this viewer.
    pub(crate) fn new(collider: &Collider, index: usize) -> Option<Self> {
        let entity = entity_name(&collider.name, index);
        Some(Self {
            path: format!("world/colliders/{entity}"),
            entity,
            name: collider.name.clone(),
            outline: Outline::of(collider.shape.as_ref()?),
            reference: collider.reference()?,
            velocity: collider.velocity,
            logged: None,
        })
    }

    /// Its name in the scene.
    pub(crate) fn name(&self) -> &str {
        &self.name
    }

    /// The last part of the paths of what is drawn of it.
    pub(crate) fn entity(&self) -> &str {
        &self.entity
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
        logged.map_err(refused(&self.path))
    }

    /// Logs where the collider is in a frame, unless it is where it was. What does not move may be moved by a call later, so
    /// that nothing is logged for all times.
    pub(crate) fn log(&mut self, stream: &RecordingStream, frame: &Frame) -> Result<(), RerunError> {
        let place = self.place(frame.pose(&self.name), frame.time);
        if self.logged.replace(place) == Some(place) {
            return Ok(());
        }
        let Place { origin, axes } = place;
        let transform = match axes {
            Some(axes) => Transform3D::from_translation_mat3x3(origin, axes),
            None => Transform3D::from_translation(origin),
        };
        stream.log(&*self.path, &transform).map_err(refused(&self.path))
    }

    /// Where an arrow along a unit vector that points at the reference point meets the collider in a frame (m): a little
    /// before it where the solid is round at its ends or lies slantwise. At the reference point if the collider is endless.
    pub(crate) fn pushed_at(&self, frame: &Frame, direction: [f64; 3]) -> [f64; 3] {
        let (at, own) = if let Some(pose) = frame.pose(&self.name) {
            let [x, y, z, w] = pose.turn;
            let back = ColliderPose { turn: [-x, -y, -z, w], ..pose.clone() };
            (pose.position, back.turned(direction))
        } else {
            let moved = |axis: usize| self.reference[axis] + frame.time * self.velocity[axis];
            ([0, 1, 2].map(moved), direction)
        };
        let against = narrow(own).map(|component| -component);
        let reach = f64::from(self.outline.extent.reach(narrow(self.reference), against));
        [0, 1, 2].map(|axis| at[axis] - reach * direction[axis])
    }

    fn origin(&self) -> [f32; 3] {
        narrow(self.outline.origin)
    }

    /// Where it is in its pose, or without one at `time` (s).
    fn place(&self, pose: Option<&ColliderPose>, time: f64) -> Place {
        let (Outline { origin, axes, .. }, velocity) = (&self.outline, self.velocity);
        let Some(pose) = pose else {
            let origin = std::array::from_fn(|axis| (origin[axis] + time * velocity[axis]) as f32);
            return Place { origin, axes: *axes };
        };
        let turned = |axis: [f32; 3]| narrow(pose.turned(axis.map(f64::from)));
        Place {
            origin: narrow(pose.moved(*origin, self.reference)),
            axes: Some(axes.unwrap_or(WORLD).map(turned)),
        }
    }
}

#[cfg(test)]
mod tests {
    use nappe_client::{
        Shape, Vectors,
        v1::{BoxShape, CapsuleShape, Vector3},
    };

    use super::*;

    fn vector([x, y, z]: [f64; 3]) -> Vector3 {
        Vector3 { x, y, z }
    }

    fn view(shape: Shape) -> ColliderView {
        let collider = Collider { name: "it".to_owned(), shape: Some(shape), velocity: [1.0, 0.0, 0.0] };
        ColliderView::new(&collider, 0).expect("a known shape")
    }

    /// A quarter about y, which takes x to -z and z to x.
    fn quarter() -> ColliderPose {
        let half = 0.5_f64.sqrt();
        ColliderPose { name: "it".to_owned(), position: [5.0, 6.0, 7.0], turn: [0.0, half, 0.0, half] }
    }

    fn assert_near(place: Place, origin: [f32; 3], axes: [[f32; 3]; 3]) {
        let found = place.axes.expect("it is turned");
        let pairs =
            place.origin.iter().zip(&origin).chain(found.as_flattened().iter().zip(axes.as_flattened()));
        for (found, expected) in pairs {
            assert!((found - expected).abs() < 1e-6, "{place:?}, not {origin:?} {axes:?}");
        }
    }

    #[test]
    fn a_box_is_at_its_pose_and_its_own_axes_turn_with_it() {
        let (axis_x, axis_y) = (Some(vector([0.0, 1.0, 0.0])), Some(vector([-1.0, 0.0, 0.0])));
        let (center, half_extent) = (Some(vector([1.0, 2.0, 3.0])), Some(vector([1.0; 3])));
        let view = view(Shape::Box(BoxShape { center, half_extent, axis_x, axis_y }));
        let turned = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        assert_near(view.place(Some(&quarter()), 2.0), [5.0, 6.0, 7.0], turned);
        let still = view.place(None, 2.0);
        assert_eq!((still.origin, still.axes), ([3.0, 2.0, 3.0], view.outline.axes));
    }

    #[test]
    fn an_arrow_ends_where_a_turned_box_begins() {
        let (center, half_extent) = (Some(vector([1.0, 2.0, 3.0])), Some(vector([0.1, 0.2, 0.4])));
        let (axis_x, axis_y) = (Some(vector([1.0, 0.0, 0.0])), Some(vector([0.0, 1.0, 0.0])));
        let view = view(Shape::Box(BoxShape { center, half_extent, axis_x, axis_y }));
        let frame = |poses| Frame {
            frame: 0,
            step: 0,
            time: 2.0,
            state_hash: None,
            positions: Vectors::F32(Vec::new()),
            velocities: None,
            plastic_ratios: None,
            stress_norms: None,
            forces: None,
            accelerations: None,
            grid: None,
            dropped_count: 0,
            diagnostics: None,
            poses,
            carried: None,
        };
        // Its z, along which it is longest, points along x.
        let turned = frame(vec![quarter()]);
        for (frame, direction, expected) in [
            (&turned, [1.0, 0.0, 0.0], [4.6, 6.0, 7.0]),
            (&turned, [0.0, -1.0, 0.0], [5.0, 6.2, 7.0]),
            (&turned, [0.0, 0.0, -1.0], [5.0, 6.0, 7.1]),
            (&frame(Vec::new()), [1.0, 0.0, 0.0], [2.9, 2.0, 3.0]),
        ] {
            let tip = view.pushed_at(frame, direction);
            assert!(tip.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-6), "{tip:?}, not {expected:?}");
        }
    }

    #[test]
    fn a_capsule_which_is_drawn_from_its_start_turns_about_its_middle() {
        let (start, end) = (Some(vector([0.0, 0.0, 0.0])), Some(vector([2.0, 0.0, 0.0])));
        let view = view(Shape::Capsule(CapsuleShape { start, end, radius: 0.5 }));
        let axes = view.outline.axes.expect("it has a direction");
        let turned = axes.map(|[x, y, z]| [z, y, -x]);
        // The start is 1 m behind the middle along x, which turns to 1 m along z.
        assert_near(view.place(Some(&quarter()), 0.0), [5.0, 6.0, 8.0], turned);
    }
}

//! The colliders as triangles where they are in a frame.
//!
//! Their VTK file is written whenever one has moved.
//!
//! Enters: colliders, then frames. Leaves: cells, and points in their poses (m).

use std::iter::repeat_n;

use nappe_client::{Collider, ColliderPose, Frame};
use nappe_scene::mesh::{VtpArray, VtpCells, VtpNumbers};

use crate::save::solids::{Scene, Solid};

/// The turn of what is not turned.
const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// The colliders whose shapes are known.
#[derive(Default)]
pub(super) struct Colliders {
    known: Vec<Collider>,
    /// From the first frame on, which says how much of an endless shape is shown.
    surface: Option<Surface>,
    /// The frame whose file has them as they are, and their poses in it.
    written: Option<(u64, Vec<ColliderPose>)>,
}

/// Their surfaces at time 0.
struct Surface {
    solids: Vec<Solid>,
    triangles: VtpCells,
    /// The number of the collider of each triangle.
    cell_data: [VtpArray; 1],
}

/// What a file of them holds.
pub(super) struct Placed<'a> {
    pub(super) points: VtpArray,
    pub(super) triangles: &'a VtpCells,
    pub(super) cell_data: &'a [VtpArray],
}

impl Colliders {
    /// Those of a topology.
    pub(super) fn of(colliders: Vec<Collider>) -> Self {
        let known = colliders.into_iter().filter(|collider| collider.shape.is_some());
        Self { known: known.collect(), ..Self::default() }
    }

    /// Their poses in a frame, if they are others than those that were written last. None if there are no colliders.
    pub(super) fn moved(&self, frame: &Frame) -> Option<Vec<ColliderPose>> {
        let poses: Vec<ColliderPose> = self.known.iter().map(|collider| pose(collider, frame)).collect();
        let is_written = self.written.as_ref().is_some_and(|(_, written)| *written == poses);
        (!is_written && !poses.is_empty()).then_some(poses)
    }

    /// What a file holds that has them in these poses.
    pub(super) fn placed(&mut self, frame: &Frame, poses: &[ColliderPose]) -> Placed<'_> {
        let Self { known: colliders, surface, .. } = self;
        let Surface { solids, triangles, cell_data } =
            surface.get_or_insert_with(|| Surface::of(colliders, &Scene::around(&frame.positions)));
        let mut points = Vec::new();
        for ((collider, solid), pose) in colliders.iter().zip(solids.iter()).zip(poses) {
            let reference = collider.reference().unwrap_or_default();
            points.extend(solid.points.iter().flat_map(|point| pose.moved(*point, reference)));
        }
        Placed { points: VtpArray::new("Points", 3, VtpNumbers::F64(&points)), triangles, cell_data }
    }

    /// Notes that the file of a frame has them in these poses.
    pub(super) fn note(&mut self, frame: u64, poses: Vec<ColliderPose>) {
        self.written = Some((frame, poses));
    }

    /// The frame whose file has them as they are, if there are any.
    pub(super) fn newest(&self) -> Option<u64> {
        self.written.as_ref().map(|(frame, _)| *frame)
    }
}

impl Surface {
    fn of(colliders: &[Collider], scene: &Scene) -> Self {
        let shapes = colliders.iter().filter_map(|collider| collider.shape.as_ref());
        let solids: Vec<Solid> = shapes.map(|shape| Solid::of(shape, scene)).collect();
        let (mut triangles, mut numbers, mut first) = (Vec::new(), Vec::new(), 0);
        for (number, solid) in (0..).zip(&solids) {
            triangles.extend(solid.triangles.iter().map(|corners| corners.map(|point| first + point)));
            numbers.extend(repeat_n(number, solid.triangles.len()));
            first += solid.points.len() as u32;
        }
        Self {
            solids,
            triangles: VtpCells::new(&triangles),
            cell_data: [VtpArray::new("collider", 1, VtpNumbers::I32(&numbers))],
        }
    }
}

/// Where a collider is in a frame: as the frame says, or where its velocity has taken it.
fn pose(collider: &Collider, frame: &Frame) -> ColliderPose {
    if let Some(pose) = frame.pose(&collider.name) {
        return pose.clone();
    }
    let reference = collider.reference().unwrap_or_default();
    let position = [0, 1, 2].map(|axis| reference[axis] + frame.time * collider.velocity[axis]);
    ColliderPose { name: collider.name.clone(), position, turn: NO_TURN }
}

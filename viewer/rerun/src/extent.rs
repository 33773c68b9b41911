//! What a collider fills, as coarsely as the camera needs: how far it reaches, and what it hides.

use crate::geometry::{Bounds, along, dot, length, minus};

/// A solid adds to the bounds of the scene what lies within so many radii of the bodies: the camera need not
/// see the far end of a large floor.
const REACH: f32 = 3.0;
/// Balls along the axis of a round solid, to see whether it hides something.
const BALLS: usize = 9;

/// The space that a shape fills at time 0 (m).
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Extent {
    /// All points within a radius (m).
    Ball { center: [f32; 3], radius: f32 },
    /// All points within a radius of a segment, or a part of them.
    Rod { start: [f32; 3], end: [f32; 3], radius: f32 },
    /// A box with its own axes, one per row.
    Box { center: [f32; 3], half: [f32; 3], axes: [[f32; 3]; 3] },
    /// The ellipsoid in a box along the world's axes, or what reaches as far.
    Ellipsoid(Bounds),
    /// A half-space or the like, which the scene cannot hold.
    Endless,
}

impl Extent {
    /// Grows the bounds of the scene; endless shapes have none.
    pub(crate) fn add_to(&self, scene: &mut Bounds, bodies: &Bounds) {
        let mut add_ball = |center: [f32; 3], reach: f32| {
            for side in [reach, -reach] {
                scene.add(bodies.nearest(along(center, side, [1.0; 3]), REACH));
            }
        };
        match *self {
            Self::Ball { center, radius } => {
                // A ball is all in the picture: bodies fall around it.
                scene.add(along(center, radius, [1.0; 3]));
                scene.add(along(center, -radius, [1.0; 3]));
            }
            Self::Rod { start, end, radius } => {
                add_ball(start, radius);
                add_ball(end, radius);
            }
            Self::Box { center, half, .. } => add_ball(center, length(half)),
            Self::Ellipsoid(held) => {
                let corners = held.corners();
                for corner in [corners[0], corners[7]] {
                    scene.add(bodies.nearest(corner, REACH));
                }
            }
            Self::Endless => {}
        }
    }

    /// How far it reaches from a point along a unit vector (m), at time 0; not below 0. Endless shapes: 0.
    pub(crate) fn reach(&self, from: [f32; 3], direction: [f32; 3]) -> f32 {
        let ahead = |point: [f32; 3]| dot(minus(point, from), direction);
        let reach = match *self {
            Self::Ball { center, radius } => ahead(center) + radius,
            Self::Rod { start, end, radius } => ahead(start).max(ahead(end)) + radius,
            Self::Box { center, half, axes } => {
                let along_axes = axes.map(|axis| dot(axis, direction).abs());
                ahead(center) + dot(half, along_axes)
            }
            Self::Ellipsoid(held) => held.corners().map(ahead).into_iter().fold(0.0, f32::max),
            Self::Endless => 0.0,
        };
        reach.max(0.0)
    }

    /// Whether it stands between the eye and a point that is not in it. Endless shapes hide nothing: they are
    /// drawn only where the eye is on their free side.
    pub(crate) fn hides(&self, eye: [f32; 3], at: [f32; 3]) -> bool {
        match *self {
            Self::Box { center, half, axes } => {
                let local = |point: [f32; 3]| axes.map(|axis| dot(minus(point, center), axis));
                crosses(local(eye), local(at), half)
            }
            Self::Ball { center, radius } => meets_ball(eye, at, center, radius),
            Self::Rod { start, end, radius } => {
                let step = minus(end, start);
                (0..BALLS).any(|ball| {
                    let center = along(start, ball as f32 / (BALLS - 1) as f32, step);
                    meets_ball(eye, at, center, radius)
                })
            }
            Self::Ellipsoid(held) => {
                // As a ball of radius 1.
                let (center, corner) = (held.center(), held.corners()[7]);
                let local = |point: [f32; 3]| {
                    let from_center = minus(point, center);
                    std::array::from_fn(|axis| from_center[axis] / (corner[axis] - center[axis]))
                };
                meets_ball(local(eye), local(at), [0.0; 3], 1.0)
            }
            Self::Endless => false,
        }
    }
}

/// Whether a segment goes through the box of a half extent around the origin, and does not end in it.
fn crosses(from: [f32; 3], to: [f32; 3], half: [f32; 3]) -> bool {
    let (mut enter, mut leave) = (0.0_f32, 1.0_f32);
    for axis in 0..3 {
        let step = to[axis] - from[axis];
        let ends = [-half[axis], half[axis]].map(|side| (side - from[axis]) / step);
        // Along the box's side, a segment is within it or not.
        if step == 0.0 {
            leave = if from[axis].abs() < half[axis] { leave } else { -1.0 };
        } else {
            enter = enter.max(ends[0].min(ends[1]));
            leave = leave.min(ends[0].max(ends[1]));
        }
    }
    enter < leave && leave < 1.0
}

/// Whether a segment goes through a ball, and does not end in it.
fn meets_ball(from: [f32; 3], to: [f32; 3], center: [f32; 3], radius: f32) -> bool {
    let (step, toward) = (minus(to, from), minus(center, from));
    let share = (dot(step, toward) / dot(step, step)).clamp(0.0, 1.0);
    let nearest = along(from, share, step);
    length(minus(center, nearest)) < radius && length(minus(center, to)) > radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_reaches_as_far_as_its_surface_along_a_direction_and_never_backwards() {
        let (x, back, y) = ([1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        let mut held = Bounds::empty();
        held.add([-1.0, 2.0, 0.0]);
        held.add([3.0, 4.0, 1.0]);
        let ball = Extent::Ball { center: [1.0, 0.0, 0.0], radius: 0.5 };
        let rod = Extent::Rod { start: [-1.0, 0.0, 0.0], end: [2.0, 0.0, 0.0], radius: 0.25 };
        let solid = Extent::Box { center: [0.0; 3], half: [0.5, 2.0, 1.0], axes: [y, back, [0.0, 0.0, 1.0]] };
        for (extent, direction, expected) in [
            (ball, x, 1.5),
            (ball, back, 0.0),
            (rod, x, 2.25),
            (rod, back, 1.25),
            (rod, y, 0.25),
            (solid, x, 2.0),
            (solid, y, 0.5),
            (Extent::Ellipsoid(held), x, 3.0),
            (Extent::Ellipsoid(held), [0.0, -1.0, 0.0], 0.0),
            (Extent::Endless, y, 0.0),
        ] {
            let reach = extent.reach([0.0; 3], direction);
            assert!(
                (reach - expected).abs() < 1e-6,
                "{extent:?} along {direction:?}: {reach}, not {expected}"
            );
        }
    }
}

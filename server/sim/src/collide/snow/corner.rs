//! Corners: the velocity of snow inside several colliders at once, which must satisfy them all.
//!
//! Reads colliders, their normals and velocities, and the velocity (m/s) before and after it answered to one after the
//! other. Where normals are oblique, what the second takes may push snow into the first again.

use super::velocity::velocity_after;
use crate::{
    collide::collider::{Collider, Contact},
    math::array::{cross, dot, length, minus},
};

/// Sine of an angle below which two normals hold the same direction: the far side of a slab, or a plane
/// that stands there twice.
pub(crate) const SAME_NORMAL: f64 = 0.01;

/// The most colliders that a corner takes in; those after them have their say in turn alone.
const MOST: usize = 8;

/// A collider that snow is inside of, and its outward normal and velocity (m/s) there.
#[derive(Clone, Copy)]
struct Touch<'a> {
    collider: &'a Collider,
    normal: [f64; 3],
    moving: [f64; 3],
}

/// The colliders that snow is inside of at one place.
#[derive(Clone, Copy, Default)]
pub(crate) struct Corner<'a> {
    touches: [Option<Touch<'a>>; MOST],
    count: usize,
}

impl<'a> Corner<'a> {
    /// Takes in one more, with its outward normal and its velocity (m/s) there.
    pub(crate) fn add(&mut self, collider: &'a Collider, normal: [f64; 3], moving: [f64; 3]) {
        if let Some(touch) = self.touches.get_mut(self.count) {
            *touch = Some(Touch { collider, normal, moving });
            self.count += 1;
        }
    }

    /// How many there are.
    pub(crate) fn count(&self) -> usize {
        self.count
    }

    /// The velocity (m/s) that satisfies all colliders: `after`, which answered to one after the other, if it
    /// does so up to the share `rounding` of the speeds at hand. Else each collider pushes `before` along
    /// its normal by as much as all of them together need, and rubs what slides by its own push. Sticky ones
    /// take all there is, so that the last of them is right as it stands.
    pub(crate) fn velocity(&self, before: [f64; 3], after: [f64; 3], rounding: f64) -> [f64; 3] {
        let mut left = self.touches;
        if left.iter().flatten().any(|touch| touch.collider.contact == Contact::Sticky) {
            return after;
        }

        let speeds = left.iter().flatten().map(|touch| length(touch.moving));
        let spare = rounding * speeds.fold(length(before), f64::max);
        if worst(&left, after, spare).is_none() {
            return after;
        }

        let (mut held, mut v) = (Held::default(), before);
        while let Some(index) = worst(&left, v, spare) {
            if left[index].take().is_some_and(|touch| held.hold(touch)) {
                v = held.velocity(before);
            }
        }

        // Nothing suits surfaces that hold the same direction and differ: the last one wins.
        if worst(&self.touches, v, spare).is_none() || held.count > 1 { v } else { after }
    }
}

/// The touch that a velocity violates most, by more than `spare` (m/s).
fn worst(touches: &[Option<Touch<'_>>], v: [f64; 3], spare: f64) -> Option<usize> {
    let mut most = (spare, None);
    for (index, touch) in touches.iter().enumerate() {
        let Some(Touch { collider, normal, moving }) = touch else { continue };
        let leaving = dot(minus(v, *moving), *normal);
        let violation = if collider.contact == Contact::Separating { -leaving } else { leaving.abs() };
        if violation > most.0 {
            most = (violation, Some(index));
        }
    }

    most.1
}

/// Surfaces that fix a velocity along their normals, in the order in which they were violated; three at most.
#[derive(Clone, Copy, Default)]
struct Held<'a> {
    touches: [Option<Touch<'a>>; 3],
    /// Normals made orthogonal, one after the other, and the velocity along each (m/s).
    axes: [[f64; 3]; 3],
    speeds: [f64; 3],
    count: usize,
}

impl<'a> Held<'a> {
    /// Takes in a surface; says whether it fixes a direction that was free.
    fn hold(&mut self, touch: Touch<'a>) -> bool {
        if self.count == 3 {
            return false;
        }

        let Touch { normal, moving, .. } = touch;
        let (mut axis, mut speed) = (normal, dot(normal, moving));
        for (other, fixed) in self.axes[..self.count].iter().zip(self.speeds) {
            let share = dot(normal, *other);
            axis = [0, 1, 2].map(|c| axis[c] - share * other[c]);
            speed -= share * fixed;
        }
        let sine = length(axis);
        if sine < SAME_NORMAL {
            return false;
        }

        self.touches[self.count] = Some(touch);
        self.axes[self.count] = axis.map(|c| c / sine);
        self.speeds[self.count] = speed / sine;
        self.count += 1;
        true
    }

    /// The velocity (m/s) that the surfaces make of `before`. What they fix is not the difference of greater
    /// numbers, so that snow which is held still has no velocity at all.
    fn velocity(&self, before: [f64; 3]) -> [f64; 3] {
        let along = |k: usize, c: usize| self.speeds[k] * self.axes[k][c];
        match self.touches {
            [None, ..] => before,
            [Some(Touch { collider, normal, moving }), None, _] => {
                velocity_after(collider, moving, before, normal)
            }
            [Some(first), Some(second), None] => {
                let (way, sliding) = self.sliding([first, second], before);
                [0, 1, 2].map(|c| along(0, c) + along(1, c) + sliding * way[c])
            }
            [Some(_), Some(_), Some(_)] => [0, 1, 2].map(|c| along(0, c) + along(1, c) + along(2, c)),
        }
    }

    /// The direction that two surfaces leave free, and the velocity along it (m/s) after both have rubbed,
    /// each by the push that it gave.
    fn sliding(&self, [first, second]: [Touch<'a>; 2], before: [f64; 3]) -> ([f64; 3], f64) {
        let way = cross(self.axes[0], self.axes[1]);
        let size = length(way);
        let way = way.map(|c| c / size);

        // The change of velocity is push_1 n_1 + push_2 n_2, and n_1 is the first axis.
        let change = [0, 1].map(|k| self.speeds[k] - dot(self.axes[k], before));
        let push_2 = change[1] / dot(self.axes[1], second.normal);
        let push_1 = change[0] - push_2 * dot(self.axes[0], second.normal);

        let mut sliding = dot(way, before);
        for (Touch { collider, moving, .. }, push) in [(first, push_1), (second, push_2)] {
            let relative = sliding - dot(way, moving);
            sliding -= (collider.friction * push.max(0.0)).min(relative.abs()).copysign(relative);
        }
        (way, sliding)
    }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the tests, not of a step")]
mod tests {
    use super::Corner;
    use crate::{
        collide::{
            collider::{Collider, Contact, StartInside},
            shape::{Plane, Shape},
            snow::velocity::velocity_after,
        },
        math::array::{cross, dot, length, minus},
    };

    const ROUNDING: f64 = 8.0 * f64::EPSILON;

    fn plane(normal: [f64; 3], contact: Contact, friction: f64, velocity: [f64; 3]) -> Collider {
        let size = length(normal);
        Collider {
            name: "plane".into(),
            shape: Shape::Plane(Plane { point: [0.0; 3], normal: normal.map(|c| c / size) }),
            velocity,
            way: None,
            friction,
            restitution: 0.0,
            margin: 0.0,
            contact,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    fn normal(collider: &Collider) -> [f64; 3] {
        collider.distance([0.0; 3], 0.0).1
    }

    /// What colliders make of a velocity one after the other, and what a corner of them makes of it.
    fn answers(colliders: &[Collider], before: [f64; 3]) -> [[f64; 3]; 2] {
        let (mut after, mut corner) = (before, Corner::default());
        for collider in colliders {
            after = velocity_after(collider, collider.velocity, after, normal(collider));
            corner.add(collider, normal(collider), collider.velocity);
        }
        [after, corner.velocity(before, after, ROUNDING)]
    }

    /// By how much a velocity enters a collider, or leaves one that does not let go (m/s).
    fn violation(collider: &Collider, v: [f64; 3]) -> f64 {
        let leaving = dot(minus(v, collider.velocity), normal(collider));
        if collider.contact == Contact::Separating { (-leaving).max(0.0) } else { leaving.abs() }
    }

    /// Pairs of normals at 30 to 150 degrees, along no axis.
    fn wedges() -> Vec<[[f64; 3]; 2]> {
        let first = [2.0 / 3.0, 1.0 / 3.0, 2.0 / 3.0];
        let across = [-2.0 / 3.0, 2.0 / 3.0, 1.0 / 3.0];
        let at = |degrees: f64| {
            let (sin, cos) = degrees.to_radians().sin_cos();
            [first, [0, 1, 2].map(|c| cos * first[c] + sin * across[c])]
        };
        [30.0, 60.0, 85.0, 95.0, 120.0, 150.0].map(at).to_vec()
    }

    const VELOCITIES: [[f64; 3]; 4] =
        [[1.0, -2.0, 0.5], [-0.3, -0.4, -2.0], [-1.0, 0.2, 0.1], [0.7, -3.0, 1.1]];

    #[test]
    fn a_velocity_in_a_wedge_enters_neither_surface() {
        let mut mended = 0;
        for contact in [Contact::Slip, Contact::Separating] {
            for normals in wedges() {
                for friction in [0.0, 0.3] {
                    for moves in [[0.0; 3], [0.4, -0.1, 0.2]] {
                        let [a, b] = normals;
                        let colliders =
                            [plane(a, contact, friction, [0.0; 3]), plane(b, contact, friction, moves)];
                        for before in VELOCITIES {
                            let [after, v] = answers(&colliders, before);
                            mended += usize::from(after != v);
                            for collider in &colliders {
                                let off = violation(collider, v);
                                assert!(off < 1e-13, "{contact:?} {normals:?} {before:?}: {off:e} m/s");
                            }
                        }
                    }
                }
            }
        }
        assert!(mended > 50, "one after the other is wrong in places: {mended}");
    }

    #[test]
    fn without_friction_a_wedge_that_does_not_let_go_keeps_what_lies_along_it() {
        for normals in wedges() {
            let colliders = normals.map(|normal| plane(normal, Contact::Slip, 0.0, [0.0; 3]));
            let way = cross(normals[0], normals[1]);
            let way = way.map(|c| c / length(way));
            for before in VELOCITIES {
                let [_, v] = answers(&colliders, before);
                let off = length(minus(v, way.map(|c| c * dot(way, before))));
                assert!(off < 1e-13, "{normals:?} {before:?}: {v:?}, off by {off:e}");
            }
        }
    }

    #[test]
    fn snow_in_a_groove_is_slowed_by_the_push_of_both_sides() {
        // Sides at 30 degrees to the vertical: each pushes by w / (2 sin 30°) = w against a weight of w.
        let (sin, cos) = 30.0_f64.to_radians().sin_cos();
        let (friction, weight, speed) = (0.2, 0.5, 3.0);
        for contact in [Contact::Slip, Contact::Separating] {
            let side = |x: f64| plane([x, sin, 0.0], contact, friction, [0.0; 3]);
            let [_, v] = answers(&[side(cos), side(-cos)], [0.0, -weight, speed]);
            let exact = [0.0, 0.0, speed - 2.0 * friction * weight];
            assert!(length(minus(v, exact)) < 1e-14, "{contact:?}: {v:?}, not {exact:?}");

            // A weight of 10 is more than enough to stop it.
            let [_, v] = answers(&[side(cos), side(-cos)], [0.0, -10.0, speed]);
            assert!(length(v) < 1e-14, "{contact:?}: {v:?}");
        }
    }

    #[test]
    fn three_oblique_surfaces_that_do_not_let_go_hold_all() {
        let normals = [[1.0, 0.2, 0.1], [-0.3, 1.0, 0.2], [0.1, 0.4, 1.0]];
        let still = normals.map(|normal| plane(normal, Contact::Slip, 0.2, [0.0; 3]));
        for before in VELOCITIES {
            assert_eq!(answers(&still, before)[1], [0.0; 3], "exactly");
        }

        // All with the same velocity: it is the only one that suits them.
        let velocity = [0.3, -0.2, 0.5];
        let moving = normals.map(|normal| plane(normal, Contact::Slip, 0.2, velocity));
        for before in VELOCITIES {
            let [_, v] = answers(&moving, before);
            assert!(length(minus(v, velocity)) < 1e-14, "{v:?}");
        }
    }

    #[test]
    fn where_normals_are_orthogonal_the_same_or_opposite_not_a_bit_changes() {
        let (x, y) = ([1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
        for contact in Contact::ALL {
            for friction in [0.0, 0.4] {
                for normals in [[x, y], [x, x], [x, [-1.0, 0.0, 0.0]], [y, [1e-4, 1.0, 0.0]]] {
                    let colliders = normals.map(|normal| plane(normal, contact, friction, [0.0; 3]));
                    for before in VELOCITIES {
                        let [after, v] = answers(&colliders, before);
                        assert_eq!(after, v, "{contact:?} {friction} {normals:?} {before:?}");
                    }
                }
            }
        }
    }

    #[test]
    fn friction_of_a_floor_does_not_let_snow_into_a_wall_that_comes() {
        let wall = plane([1.0, 0.0, 0.0], Contact::Separating, 0.0, [2.0, 0.0, 0.0]);
        let floor = plane([0.0, 1.0, 0.0], Contact::Separating, 0.5, [0.0; 3]);
        let [after, v] = answers(&[wall, floor], [0.0, -1.0, 0.0]);
        assert!(after[0] < 1.6, "the floor alone slows it: {after:?}");
        assert!((v[0] - 2.0).abs() < 1e-14 && v[1].abs() < 1e-14, "{v:?}");
    }

    #[test]
    fn a_velocity_that_is_not_finite_is_not_hidden_in_a_corner() {
        let normals = wedges()[1];
        for bad in [f64::NAN, f64::INFINITY] {
            let colliders = normals.map(|normal| plane(normal, Contact::Slip, 0.2, [0.0; 3]));
            let [_, v] = answers(&colliders, [bad, 0.0, 0.0]);
            assert!(v.iter().any(|c| !c.is_finite()), "{bad}: {v:?}");
        }
    }
}

//! What contact does to the velocity of snow, at a node of the grid or at a particle.
//!
//! Reads a velocity (m/s), and the velocity and the outward normal of the collider that it is inside of; writes the
//! velocity after contact (Stomakhin et al. 2013, section 8).

use crate::{
    collide::collider::{Collider, Contact},
    math::array::dot,
};

/// The velocity (m/s) of snow inside a collider, which moves there with `moving` (m/s), after contact with it. With
/// `v_n` the part of the relative velocity along the normal and `v_t` that along the surface,
///
/// - sticky: both become 0,
/// - slip: `v_n` becomes 0, and `v_t` is slowed by friction while `v_n < 0`,
/// - separating: the same while `v_n < 0`, else nothing changes.
///
/// Friction is Coulomb's: `|v_t|` falls by `mu |v_n|`, to 0 at most. Restitution plays no part.
pub(crate) fn velocity_after(
    collider: &Collider,
    moving: [f64; 3],
    v: [f64; 3],
    normal: [f64; 3],
) -> [f64; 3] {
    let relative = [0, 1, 2].map(|c| v[c] - moving[c]);
    let approach = dot(relative, normal);
    let slowed = match collider.contact {
        // 0 times the velocity, so that one which is not finite stays one to be reported.
        Contact::Sticky => return [0, 1, 2].map(|c| moving[c] + 0.0 * v[c]),
        Contact::Separating if approach >= 0.0 => return v,
        Contact::Slip | Contact::Separating => collider.friction * (-approach).max(0.0),
    };

    let sliding = [0, 1, 2].map(|c| relative[c] - approach * normal[c]);
    let speed = dot(sliding, sliding).sqrt();
    let left = if speed > slowed { 1.0 - slowed / speed } else { 0.0 };
    [0, 1, 2].map(|c| moving[c] + left * sliding[c])
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the tests, not of a step")]
mod tests {
    use super::velocity_after;
    use crate::collide::{
        collider::{Collider, Contact, StartInside},
        shape::{Plane, Shape},
    };

    const NORMAL: [f64; 3] = [0.6, 0.0, 0.8];
    /// Directions along the surface.
    const SLOPE: [f64; 3] = [0.8, 0.0, -0.6];
    const ACROSS: [f64; 3] = [0.0, 1.0, 0.0];

    fn collider(contact: Contact, friction: f64, velocity: [f64; 3]) -> Collider {
        Collider {
            name: "ground".into(),
            shape: Shape::Plane(Plane { point: [0.0; 3], normal: NORMAL }),
            velocity,
            way: None,
            friction,
            restitution: 0.7,
            margin: 0.0,
            contact,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// A velocity from its parts along the normal and along the surface.
    fn of(normal: f64, slope: f64, across: f64) -> [f64; 3] {
        [0, 1, 2].map(|c| normal * NORMAL[c] + slope * SLOPE[c] + across * ACROSS[c])
    }

    /// Asserts parts after contact, from parts before, relative to a collider at rest and moving.
    fn expect(contact: Contact, friction: f64, before: [f64; 3], after: [f64; 3]) {
        for velocity in [[0.0; 3], [3.0, -2.0, 0.5]] {
            let start = of(before[0], before[1], before[2]);
            let v = [0, 1, 2].map(|c| start[c] + velocity[c]);
            let found = velocity_after(&collider(contact, friction, velocity), velocity, v, NORMAL);
            let wanted = of(after[0], after[1], after[2]);
            for c in 0..3 {
                let error = (found[c] - velocity[c] - wanted[c]).abs();
                assert!(error < 1e-14, "{contact:?}, mu {friction}, {before:?} {velocity:?}: {found:?}");
            }
        }
    }

    #[test]
    fn sticky_snow_moves_with_the_surface_whichever_way_it_went() {
        for before in [[-1.0, 2.0, 0.5], [1.0, 2.0, 0.5], [0.0; 3]] {
            expect(Contact::Sticky, 0.3, before, [0.0; 3]);
        }
    }

    #[test]
    fn slipping_snow_neither_enters_nor_leaves_and_is_rubbed_while_it_presses() {
        expect(Contact::Slip, 0.0, [-1.0, 3.0, 4.0], [0.0, 3.0, 4.0]);
        expect(Contact::Slip, 0.0, [1.0, 3.0, 4.0], [0.0, 3.0, 4.0]);
        expect(Contact::Slip, 0.5, [1.0, 3.0, 4.0], [0.0, 3.0, 4.0]);

        // mu |v_n| = 1 of a sliding speed of 5.
        expect(Contact::Slip, 0.5, [-2.0, 3.0, 4.0], [0.0, 2.4, 3.2]);
    }

    #[test]
    fn separating_snow_leaves_freely() {
        for before in [[1.0, 3.0, 4.0], [0.0, 3.0, 4.0], [1e-300, 0.0, 1.0]] {
            expect(Contact::Separating, 0.9, before, before);
        }

        // Exactly: not a bit of it is touched.
        let v = [0.1, 0.2, 0.3];
        assert_eq!(velocity_after(&collider(Contact::Separating, 0.5, [0.0; 3]), [0.0; 3], v, NORMAL), v);
    }

    #[test]
    fn pressed_snow_slides_on_with_what_friction_leaves() {
        expect(Contact::Separating, 0.0, [-2.0, 3.0, -4.0], [0.0, 3.0, -4.0]);
        expect(Contact::Separating, 0.5, [-2.0, 3.0, -4.0], [0.0, 2.4, -3.2]);
    }

    #[test]
    fn snow_sticks_when_friction_would_more_than_stop_it() {
        for contact in [Contact::Slip, Contact::Separating] {
            // mu |v_n| = 5: just enough.
            expect(contact, 2.5, [-2.0, 3.0, 4.0], [0.0; 3]);
            expect(contact, 2.5001, [-2.0, 3.0, 4.0], [0.0; 3]);
            expect(contact, f64::MAX, [-2.0, 3.0, 4.0], [0.0; 3]);

            // Just not enough: 1e-3 of a speed of 5 is left.
            expect(contact, 2.4995, [-2.0, 3.0, 4.0], [0.0, 3.0 * 2e-4, 4.0 * 2e-4]);
            expect(contact, 0.3, [-2.0, 0.0, 0.0], [0.0; 3]);
        }
    }

    #[test]
    fn the_threshold_of_sticking_is_that_of_a_slope() {
        // A push of gravity onto a slope of angle a: it slides if and only if tan a > mu.
        for (degrees, slides) in [(14.9_f64, false), (15.1, true)] {
            let (sin, cos) = degrees.to_radians().sin_cos();
            let friction = 15.0_f64.to_radians().tan();
            let ground = collider(Contact::Separating, friction, [0.0; 3]);
            let after = velocity_after(&ground, [0.0; 3], of(-cos, sin, 0.0), NORMAL);
            let speed = after.iter().map(|c| c * c).sum::<f64>().sqrt();
            assert_eq!(speed > 0.0, slides, "{degrees} degrees: {speed}");
            let left = (sin - friction * cos).max(0.0);
            assert!((speed - left).abs() < 1e-14, "{degrees} degrees: {speed}, not {left}");
        }
    }

    #[test]
    fn a_velocity_that_is_not_finite_is_not_hidden() {
        for contact in Contact::ALL {
            for bad in [f64::NAN, f64::INFINITY] {
                let ground = collider(contact, 0.5, [0.0; 3]);
                let after = velocity_after(&ground, [0.0; 3], [bad, 0.0, 0.0], NORMAL);
                assert!(after.iter().any(|c| !c.is_finite()), "{contact:?}, {bad}: {after:?}");
            }
        }
    }
}

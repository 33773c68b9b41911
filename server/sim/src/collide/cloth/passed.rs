//! Passages: whether a particle went through a collider, or into it, on its way within a step.
//!
//! Reads where the way starts and ends (m), and how the collider moves meanwhile.

use super::facing::Facing;
use crate::{
    math::array::{dot, length},
    sub_step::SubStep,
};

/// Steps of a search along the way of a particle, at most.
const SEARCH_STEPS: u32 = 64;

/// Distance from a surface at which a way has come to it, or within it at which it has gone in, over the length of the way.
pub(crate) const REACHED: f64 = 1e-3;

/// Whether a particle went through a collider on its way in a sub-step, which has a start and an end (m). At the start it was
/// outside; at the end it is within, or it came to the surface on its way and the nearest of it looked the other way at the
/// start than at the end. No deeper inside than `spare` (m), it counts as outside.
pub(crate) fn has_passed(
    collider: Facing<'_>,
    sub_step: SubStep,
    [start, end]: [[f64; 3]; 2],
    spare: f64,
) -> bool {
    // As the collider sees it, which stands where it is at the end.
    let way = collider.way_of([start, end], sub_step);
    let length = length(way);
    let at = |share: f64| collider.distance([0, 1, 2].map(|c| end[c] - way[c] * share), sub_step.end);
    let (distance, normal) = at(0.0);
    // No point of the surface is nearer than `distance`.
    if distance >= length || !length.is_finite() {
        return false;
    }

    let within = -REACHED * length - spare;
    let (start, came_from) = at(1.0);
    if start < within {
        return false;
    }
    if distance < within {
        return true;
    }
    if dot(came_from, normal) >= 0.0 {
        return false;
    }

    if collider.shape.has_creases() {
        return first_within(|share| at(share).0, length, -within).is_some();
    }

    // Back from the end, by as much as is free of the surface in every direction.
    let mut gone = distance.max(0.0) / length;
    for _ in 0..SEARCH_STEPS {
        if gone >= 1.0 {
            return false;
        }
        let distance = at(gone).0;
        if distance <= REACHED * length {
            return true;
        }
        gone += distance / length;
    }
    false
}

/// The share of a way, no longer than `length` (m), at which it is first seen within a solid by more than `spare` (m), given the
/// distance (m) at each share: both sides of a crease may be reached from outside.
pub(crate) fn first_within(distance: impl Fn(f64) -> f64, length: f64, spare: f64) -> Option<f64> {
    let mut gone = 0.0;
    while gone < 1.0 {
        let here = distance(gone);
        if here < -spare {
            return Some(gone);
        }
        // A distance that is not finite ends it.
        gone += (here / length).max(REACHED);
    }
    None
}

#[cfg(test)]
mod tests {
    use super::{SubStep, has_passed};
    use crate::collide::{
        collider::{Collider, Contact, StartInside},
        shape::{Cuboid, Plane, Shape, Sphere},
    };

    const TIME: f64 = 0.3;
    const DT: f64 = 0.1;
    const SUB_STEP: SubStep = SubStep { dt: DT, end: TIME };

    /// A collider that stands at `time` [`TIME`] where its shape says.
    fn moving(shape: impl Fn([f64; 3]) -> Shape, velocity: [f64; 3]) -> Collider {
        Collider {
            name: "it".to_owned(),
            shape: shape(velocity.map(|v| -v * TIME)),
            velocity,
            way: None,
            friction: 0.0,
            restitution: 0.0,
            margin: 0.0,
            contact: Contact::default(),
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// A blade 2 mm thick, upright at x = 0 at the end of the step.
    fn blade(velocity: [f64; 3]) -> Collider {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        moving(|center| Cuboid { center, half_extent: [1e-3, 1.0, 1.0], axes }.into(), velocity)
    }

    fn passes(collider: &Collider, from: f64, to: f64) -> bool {
        has_passed(collider.into(), SUB_STEP, [[from, 0.1, 0.2], [to, 0.1, 0.2]], 1e-4)
    }

    #[test]
    fn what_jumps_over_a_blade_or_ends_in_it_has_passed_and_what_stays_in_front_has_not() {
        let still = blade([0.0; 3]);
        for (from, to, expected) in [
            (0.5, -0.5, true),
            (-0.5, 0.5, true),
            (0.5, 0.0, true),
            (0.5, -0.0005, true),
            (0.5, 0.0015, false),
            (0.5, 0.00095, false),
            (0.5, 0.5, false),
            (0.0, -0.5, false),
            (-0.5, -0.6, false),
        ] {
            assert_eq!(passes(&still, from, to), expected, "from {from} to {to}");
        }
    }

    #[test]
    fn a_blade_that_moves_passes_what_stands_and_not_what_goes_with_it() {
        for speed in [10.0, -10.0] {
            let blade = blade([speed, 0.0, 0.0]);
            let ahead = 0.5 * speed * DT;
            assert!(passes(&blade, -ahead, -ahead), "it stood, and the blade went by");
            assert!(!passes(&blade, -0.5 * ahead, 1.5 * ahead), "it kept ahead");
            assert!(!passes(&blade, -3.0 * ahead, -3.0 * ahead), "it was behind");
        }
    }

    #[test]
    fn what_goes_round_a_ball_has_not_passed_and_nothing_comes_out_behind_a_plane() {
        let ball = moving(|center| Sphere { center, radius: 0.1 }.into(), [0.0; 3]);
        let by = |y: f64| has_passed((&ball).into(), SUB_STEP, [[-0.5, y, 0.0], [0.5, y, 0.0]], 1e-4);
        assert!(by(0.05) && !by(0.15), "through it, and past it");
        let floor = moving(|point| Plane { point, normal: [1.0, 0.0, 0.0] }.into(), [0.0; 3]);
        assert!(passes(&floor, 0.5, -0.5) && !passes(&floor, -0.5, -0.7) && !passes(&floor, -0.5, 0.5));
    }

    #[test]
    fn a_way_that_is_not_finite_has_not_passed() {
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(!passes(&blade([0.0; 3]), 0.5, bad) && !passes(&blade([0.0; 3]), bad, -0.5), "{bad}");
        }
    }
}

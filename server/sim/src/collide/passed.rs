//! Whether a particle went through a collider within a step.

use super::Collider;
use crate::math::{Vec3, array3, vec3};

/// Steps of a search along the way of a particle, at most.
const SEARCH_STEPS: u32 = 64;
/// Distance from a surface at which a way has come to it, or within it at which it has gone in, over the length of the way.
pub(super) const REACHED: f64 = 1e-3;

/// Whether a particle went through a collider from `start` to `end`, in `dt` (s) that end at `time` (s). At the start it was
/// outside; at the end it is within, or it came to the surface on its way and the nearest of it looked the other way at the
/// start than at the end. `rounding` (m) is that of positions.
pub(crate) fn has_passed(
    collider: &Collider,
    [time, dt]: [f64; 2],
    [start, end]: [Vec3<f64>; 2],
    rounding: f64,
) -> bool {
    // As the collider sees it, which stands where it is at the end.
    let way = end - start - vec3::<f64>(collider.velocity) * dt;
    let length = way.norm();
    let at = |share: f64| collider.distance(array3(&(end - way * share)), time);
    let (distance, normal) = at(0.0);
    // No point of the surface is nearer than `distance`.
    if distance >= length || !length.is_finite() {
        return false;
    }

    let within = -REACHED * length - rounding;
    let (start, came_from) = at(1.0);
    if start < within {
        return false;
    }
    if distance < within {
        return true;
    }
    if vec3::<f64>(came_from).dot(&vec3(normal)) >= 0.0 {
        return false;
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

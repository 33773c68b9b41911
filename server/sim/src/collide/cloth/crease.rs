//! A particle that touches a collider with creases: where faces meet, it stays out of all of them at once.
//!
//! One nearest place is not enough there: pushed off the wall a particle lies in the floor, and back. So planes are collected,
//! each the nearest one at where those before it put the particle. With one plane this is the rule of every other shape.

use super::{
    flight::Flight,
    passed::has_passed,
    planes::Planes,
    touch::{Answer, Rub, Touch},
};
use crate::math::{Vec3, array3, vec3};

/// Looks for one more plane, at most.
const MOST_LOOKS: usize = 16;
/// How much nearer (m) than its margin a particle may end that is not pinched.
const PINCHED: f64 = 1e-9;

/// A collider with creases that a particle must stay out of at the end of a sub-step.
pub(crate) struct Crease<'a> {
    touch: &'a Touch<'a>,
    /// Distance (m) that the particle keeps from the surface.
    margin: f64,
    /// Rounding (m) of positions.
    rounding: f64,
}

/// The planes around a place, where they put a particle, and how much nearer (m) than it may be it is there.
struct Found {
    planes: Planes,
    shift: Vec3<f64>,
    depth: f64,
}

impl<'a> Crease<'a> {
    /// Of what is touched; `rounding` (m) is that of positions.
    pub(crate) fn new(touch: &'a Touch<'a>, rounding: f64) -> Self {
        Self { touch, margin: touch.collider.margin - touch.allowed, rounding }
    }

    /// Takes the approach away, slows what slides, and puts the particle where it is near none of the faces; whether that
    /// changed anything.
    pub(crate) fn hold(&self, flight: &Flight, felt: f64, end: &mut Answer) -> bool {
        let collider = self.touch.collider;
        let moving = vec3::<f64>(collider.velocity_at(array3(&end.x), self.touch.end_time));
        let mut found = self.look(flight, end);
        let relative = end.v - moving;
        let least = found.planes.least(found.planes.approach(&relative));
        // Where the planes leave no way it stops.
        let push = least.map_or(-relative, |least| least.way);
        let pushed = push.norm();
        let presses = pushed > f64::EPSILON * end.v.amax();
        if presses {
            let sliding = relative + push;
            let speed = sliding.norm();
            let slowed = if speed > 0.0 { (collider.friction * pushed / speed).min(1.0) } else { 0.0 };
            let slowing = -sliding * slowed;
            end.v += push + slowing;
            if let Some(least) = least
                && slowing.norm_squared() > 0.0
            {
                let rests = slowed >= 1.0;
                let rub = Rub { collider, normal: push / pushed, slowing, pushed, rests, felt };
                rub.slow(flight, |v| found.planes.along(&least, v), end);
                found = self.look(flight, end);
                if !self.touch.is_through {
                    let again = found.planes.least(found.planes.approach(&(end.v - moving)));
                    end.v += again.map_or(moving - end.v, |least| least.way);
                }
            }
        }
        end.x += found.shift;
        let way = [flight.x, end.x].map(|x| array3(&x));
        if has_passed(collider, flight.left, way, self.rounding) {
            // Out of one face it would be in front of another, behind a solid: it stays where it met the first.
            end.x = vec3(collider.carried(array3(&flight.x), flight.left));
            found.depth = self.margin - collider.distance(array3(&end.x), self.touch.end_time).0;
        }
        end.is_pinched = found.depth > PINCHED;
        presses || found.shift.norm() > self.touch.spare
    }

    /// The planes at where a particle is.
    fn look(&self, flight: &Flight, end: &Answer) -> Found {
        let Touch { collider, end_time, is_through, normal, .. } = *self.touch;
        let (mut planes, mut shift) = (Planes::default(), Vec3::zeros());
        if is_through {
            planes.add(normal, -flight.way_to(&end.x, collider).dot(&normal), &shift);
            shift = planes.least(planes.bounds).map_or(shift, |least| least.way);
        }
        let mut depth = f64::INFINITY;
        for look in 0..MOST_LOOKS {
            let (distance, here) = collider.distance(array3(&(end.x + shift)), end_time);
            depth = self.margin - distance;
            let is_first = look == 0 && !is_through;
            if !is_first && depth <= self.rounding.min(PINCHED) {
                break;
            }
            if !planes.add(vec3(here), depth, &shift) {
                break;
            }
            let Some(least) = planes.least(planes.bounds) else { break };
            shift = least.way;
        }
        Found { planes, shift, depth }
    }
}

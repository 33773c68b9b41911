//! A particle that touches a collider at the end of its sub-step: it leaves its approach there, is rubbed, and lies on the surface.
//!
//! The impulse along the normal bounds that of friction: `|dv_t| <= friction |dv_n|`.

use super::{facing::Facing, flight::Flight};
use crate::{
    collide::collider::Collider,
    math::{Vec3, array3, vec3},
};

/// Changes of the velocity of a surface that turns, from a sub-step to the next, by which what rests on it may differ from it.
const FOLLOWS: f64 = 2.0;

/// A sub-step of one particle as its method has it, and what contact made of it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Answer {
    /// Position (m) and velocity (m/s) at the end.
    pub(crate) x: Vec3<f64>,
    pub(crate) v: Vec3<f64>,
    /// Energy (J per kg) that bounces add by the method's own difference between its velocities and its way.
    pub(crate) swing: f64,
    /// Whether it was inside a collider at the start.
    pub(crate) was_inside: bool,
    /// Whether it is nearer to a surface with creases than it may be, since they leave no room.
    pub(crate) is_pinched: bool,
}

/// A collider that a particle must stay out of at the end of a sub-step.
pub(crate) struct Touch<'a> {
    pub(crate) collider: Facing<'a>,
    pub(crate) normal: Vec3<f64>,
    /// Whether the nearest side is another one than that at which it came.
    pub(crate) is_through: bool,
    /// How far (m) it is inside, and how far it may be.
    pub(crate) depth: f64,
    pub(crate) allowed: f64,
    /// What is inside by no more than this (m) is on the surface.
    pub(crate) spare: f64,
    pub(crate) end_time: f64,
}

/// What slows a particle along a surface: the change of its velocity (m/s), and the push (m/s) along a normal that allows it.
pub(crate) struct Rub<'a> {
    pub(crate) collider: Facing<'a>,
    pub(crate) normal: Vec3<f64>,
    pub(crate) slowing: Vec3<f64>,
    pub(crate) pushed: f64,
    /// Whether nothing is left of what slid.
    pub(crate) rests: bool,
    /// Share of a change of velocity that the method lets positions feel.
    pub(crate) felt: f64,
}

impl Touch<'_> {
    /// Takes the approach away, slows what slides, and puts the particle on the surface; whether that changed anything.
    pub(crate) fn hold(&self, flight: &Flight, felt: f64, end: &mut Answer) -> bool {
        let Self { collider, ref normal, .. } = *self;
        let moving = vec3::<f64>(collider.velocity_at(array3(&end.x), self.end_time));
        let relative = end.v - moving;
        let approach = -relative.dot(normal);
        let presses = approach > f64::EPSILON * end.v.amax();
        let (mut lift, mut out) = (self.depth - self.allowed, *normal);
        if presses {
            let by = push_and_rub(&collider, &relative, normal, approach);
            end.v += by;
            let slowing = by - normal * approach;
            if slowing.norm_squared() > 0.0 {
                // By friction, and not by what is left: that is rounded, the more the faster all of it goes.
                let sliding = relative + normal * approach;
                let rests = collider.friction * approach >= sliding.norm();
                let rub = Rub { collider, normal: *normal, slowing, pushed: approach, rests, felt };
                rub.slow(flight, |v| v - normal * v.dot(normal), end);
                let (distance, here) = collider.distance(array3(&end.x), self.end_time);
                lift = collider.margin - distance - self.allowed;
                if !self.is_through {
                    out = vec3(here);
                    end.v += out * (moving - end.v).dot(&out).max(0.0);
                }
            }
        }
        if self.is_through {
            lift = -flight.way_to(&end.x, collider).dot(normal);
        }
        if lift > 0.0 {
            end.x += out * lift;
        }
        presses || lift > self.spare
    }
}

impl Rub<'_> {
    /// Takes back the way along the surface that friction takes: what stops the particle as it comes, from then on; what it
    /// takes later, as the method lets positions feel a change of velocity.
    pub(crate) fn slow(&self, flight: &Flight, along: impl Fn(&Vec3<f64>) -> Vec3<f64>, end: &mut Answer) {
        let Self { collider, normal, slowing, pushed, rests, felt } = *self;
        let coming = flight.w - flight.moving(collider);
        let impact = (-coming.dot(&normal)).clamp(0.0, pushed);
        let way = flight.way_to(&end.x, collider);
        // What rests on a surface that turns comes with the velocity that this had before.
        let turning = collider.turning(array3(&flight.x), flight.left.start());
        if rests && along(&coming).norm() <= collider.friction * impact + FOLLOWS * turning {
            end.x -= along(&way);
        } else {
            let share = (impact + (pushed - impact) * felt) / pushed;
            // No farther back than where it met the surface.
            let most = (-way.dot(&slowing) / slowing.norm_squared()).max(0.0);
            end.x += slowing * (flight.left.dt * share).min(most);
        }
    }
}

/// What a collider adds to a velocity relative to it (m/s) by a push along the normal.
pub(crate) fn push_and_rub(
    collider: &Collider,
    relative: &Vec3<f64>,
    normal: &Vec3<f64>,
    push: f64,
) -> Vec3<f64> {
    let sliding = relative - normal * relative.dot(normal);
    let speed = sliding.norm();
    let slowed = if speed > 0.0 { (collider.friction * push / speed).min(1.0) } else { 0.0 };
    normal * push - sliding * slowed
}

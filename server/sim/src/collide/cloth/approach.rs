//! How a particle comes to a collider in a sub-step, for those who push it before it gets there.

use super::{
    answer::SLOWEST,
    flight::{Flight, Meeting},
    passed::REACHED,
};
use crate::{
    collide::collider::Collider,
    math::{Vec3, array3, vec3},
    sub_step::SubStep,
};

/// The way of a particle in a sub-step, and a collider.
pub(crate) struct Approach<'a> {
    pub(crate) collider: &'a Collider,
    /// Positions (m) and velocities (m/s) at both ends.
    pub(crate) x: [Vec3<f64>; 2],
    pub(crate) v: [Vec3<f64>; 2],
    pub(crate) sub_step: SubStep,
}

impl Approach<'_> {
    /// Where it meets the surface from outside, and how it goes there.
    fn meeting(&self) -> Option<(Flight, Meeting)> {
        let Self { collider, x, v, sub_step } = *self;
        let rounding = 4.0 * f64::EPSILON * x[0].amax().max(x[1].amax());
        let flight = Flight::new(x, v, sub_step, rounding);
        let way = collider.way_of(x.map(|x| array3(&x)), sub_step);
        let spare = REACHED * vec3::<f64>(way).norm() + rounding;
        let meeting = flight.meets(collider.into(), spare)?;
        (meeting.depth == 0.0).then_some((flight, meeting))
    }

    /// Whether it comes so fast that it bounces.
    pub(crate) fn bounces(&self) -> bool {
        if self.collider.restitution == 0.0 {
            return false;
        }
        self.meeting().is_some_and(|(mut flight, meeting)| {
            flight.go(meeting.after);
            let relative = flight.w - flight.moving(self.collider.into());
            let approach = -relative.dot(&meeting.normal);
            approach > 0.0 && approach >= SLOWEST * (self.v[1] - self.v[0]).norm()
        })
    }

    /// The normal of the surface where it meets it, and after which share of the sub-step.
    pub(crate) fn meets(&self) -> Option<(Vec3<f64>, f64)> {
        self.meeting().map(|(_, meeting)| (meeting.normal, meeting.after / self.sub_step.dt))
    }
}

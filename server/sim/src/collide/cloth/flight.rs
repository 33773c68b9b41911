//! The way of a particle within a sub-step: the parabola through its ends, and where it meets a surface.
//!
//! A method gives positions x0, x1 (m) and velocities v0, v1 (m/s) at the ends of a sub-step of h seconds. With
//! a = (v1 - v0) / h the one parabola of that acceleration through both positions begins at
//! w = (x1 - x0) / h - h a / 2. Of methods of order 2 that is v0 in free fall; of those that move with an older or a newer
//! velocity it differs from it by half of what the sub-step adds, which is how they keep time. Energy is
//! conserved along it, whatever the method.

use super::{facing::Facing, passed::first_within};
use crate::{
    math::{Vec3, array3, vec3},
    sub_step::SubStep,
};

/// Steps of the search for the place where a way meets a surface, at most.
const SEARCH_STEPS: u32 = 64;
/// Halvings of a way that leaves a surface, at most, to find a place of it that is outside.
const MOST_HALVINGS: u32 = 10;
/// Distance (m) at which a surface is met, over the size of the numbers of which it is made.
const MET: f64 = 4.0 * f64::EPSILON;

/// A particle on its way to the end of a sub-step.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Flight {
    /// Position (m).
    pub(crate) x: Vec3<f64>,
    /// Velocity along the parabola (m/s).
    pub(crate) w: Vec3<f64>,
    /// Acceleration (m/s²).
    pub(crate) a: Vec3<f64>,
    /// What is left of the sub-step.
    pub(crate) left: SubStep,
}

/// Where a way meets a surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Meeting {
    /// Time (s) from now until then.
    pub(crate) after: f64,
    /// Normal of the surface there.
    pub(crate) normal: Vec3<f64>,
    /// How far (m) the particle is inside already, beyond the margin.
    pub(crate) depth: f64,
}

impl Flight {
    /// The way from `x[0]` to `x[1]` (m) in a sub-step, over which the velocity becomes `v[1]` from `v[0]` (m/s).
    /// `rounding` (m) is that of positions.
    pub(crate) fn new(x: [Vec3<f64>; 2], v: [Vec3<f64>; 2], sub_step: SubStep, rounding: f64) -> Self {
        let (change, dt) = (v[1] - v[0], sub_step.dt);
        let w = (x[1] - x[0]) / dt - change * 0.5;
        // What differs by rounding alone is the same.
        let w = if (w - v[0]).amax() * dt <= rounding { v[0] } else { w };
        Self { x: x[0], w, a: change / dt, left: sub_step }
    }

    /// The same up to some seconds from now.
    pub(crate) fn until(&self, after: f64) -> Self {
        Self { left: SubStep { dt: after, end: self.time(after) }, ..*self }
    }

    /// Time (s) some seconds from now.
    fn time(&self, after: f64) -> f64 {
        self.left.end - (self.left.dt - after)
    }

    /// Position (m) after some seconds.
    pub(crate) fn position(&self, after: f64) -> Vec3<f64> {
        self.x + (self.w + self.a * (0.5 * after)) * after
    }

    /// Position (m) at the end of the sub-step.
    pub(crate) fn end(&self) -> Vec3<f64> {
        self.position(self.left.dt)
    }

    /// Velocity (m/s) along the parabola at the end of the sub-step.
    pub(crate) fn end_velocity(&self) -> Vec3<f64> {
        self.w + self.a * self.left.dt
    }

    /// Goes on for some seconds.
    pub(crate) fn go(&mut self, after: f64) {
        let x = self.position(after);
        self.w += self.a * after;
        self.x = x;
        self.left.dt -= after;
    }

    /// Velocity (m/s) of the surface of a collider where the particle is.
    pub(crate) fn moving(&self, collider: Facing<'_>) -> Vec3<f64> {
        vec3(collider.velocity_at(array3(&self.x), self.left.start()))
    }

    /// Its way (m) from here to an end (m), as a collider sees it that stands where it is at the end of the sub-step.
    pub(crate) fn way_to(&self, end: &Vec3<f64>, collider: Facing<'_>) -> Vec3<f64> {
        vec3(collider.way_of([array3(&self.x), array3(end)], self.left))
    }

    /// Distance (m) of a position, after some seconds, from where a particle touches, and the normal there.
    fn gap(&self, collider: Facing<'_>, after: f64) -> (f64, Vec3<f64>) {
        let (distance, normal) = collider.distance(array3(&self.position(after)), self.time(after));
        (distance - collider.margin, vec3(normal))
    }

    /// A time (s) from now at which the way leads through a solid that it ends outside of.
    fn goes_through(&self, collider: Facing<'_>, spare: f64) -> Option<f64> {
        let at_end = vec3::<f64>(collider.velocity_at(array3(&self.end()), self.left.end));
        let speed = (self.w - self.moving(collider)).norm().max((self.w - at_end).norm());
        let speed = speed + self.a.norm() * self.left.dt;
        let distance = |share: f64| self.gap(collider, share * self.left.dt).0 + collider.margin;
        first_within(distance, speed * self.left.dt, spare).map(|share| share * self.left.dt)
    }

    /// Where the particle meets a collider that it ends inside of, or goes through if that has creases; none otherwise. What is inside by no more
    /// than `spare` (m) is on the surface.
    pub(crate) fn meets(&self, collider: Facing<'_>, spare: f64) -> Option<Meeting> {
        let (mut high, (mut end, mut normal_at_end)) = (self.left.dt, self.gap(collider, self.left.dt));
        if end >= 0.0 {
            if !collider.shape.has_creases() {
                return None;
            }
            high = self.goes_through(collider, spare)?;
            (end, normal_at_end) = self.gap(collider, high);
        }

        let (start, normal) = self.gap(collider, 0.0);
        if start < -spare {
            return Some(Meeting { after: 0.0, normal: normal_at_end, depth: -start });
        }
        let met = |after: f64, normal| Some(Meeting { after, normal, depth: 0.0 });
        let (mut low, mut above) = (0.0, start);
        if start <= spare {
            let leaving = (self.w - self.moving(collider)).dot(&normal);
            if leaving <= 0.0 {
                return met(0.0, normal);
            }
            // What leaves the surface comes back after the highest point of its way; in a hollow it may meet the other side.
            let pulled = -self.a.dot(&normal);
            let comes_back = leaving < pulled * high;
            low = if comes_back { leaving / pulled } else { 0.5 * high };
            above = self.gap(collider, low).0;
            for _ in 0..MOST_HALVINGS {
                if above > spare {
                    break;
                }
                low *= 0.5;
                above = self.gap(collider, low).0;
            }
            if above <= spare {
                return met(0.0, normal);
            }
        }
        let after = self.root(collider, [low, high], [above, end]);
        met(after, self.gap(collider, after).1)
    }

    /// The time (s) at which the gap is 0, between one where it is above and one where it is below: by false position, which
    /// halves the weight of an end that stays (Dowell and Jarratt 1971, the Illinois method).
    fn root(
        &self,
        collider: Facing<'_>,
        [mut low, mut high]: [f64; 2],
        [mut above, mut below]: [f64; 2],
    ) -> f64 {
        let size = self.x.amax() + self.w.amax() * self.left.dt + collider.margin;
        let mut stayed = 0;
        for _ in 0..SEARCH_STEPS {
            let after = low + (high - low) * (above / (above - below));
            let (gap, _) = self.gap(collider, after);
            if gap.abs() <= MET * size || after <= low || after >= high {
                return after;
            }
            if gap > 0.0 {
                (low, above) = (after, gap);
                below *= if stayed > 0 { 0.5 } else { 1.0 };
                stayed = 1;
            } else {
                (high, below) = (after, gap);
                above *= if stayed < 0 { 0.5 } else { 1.0 };
                stayed = -1;
            }
        }
        low
    }
}

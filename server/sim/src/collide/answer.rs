//! What a particle of cloth does that meets colliders within a sub-step: it bounces, or stays on the surface.
//!
//! It goes its way up to the surface, and the rest of the sub-step with the velocity that the surface leaves it. What comes
//! fast enough bounces, twice at most; then, and otherwise, it ends on the surface. The impulse along the normal bounds
//! that of friction: `|dv_t| <= friction |dv_n|`.

use super::{
    Collider,
    flight::{Flight, Meeting},
};
use crate::math::{Vec3, array3, vec3};

/// Bounces in a sub-step, at most.
const MOST_BOUNCES: u32 = 2;
/// Speed of approach, over what the sub-step adds to the velocity, below which nothing comes back: what bounces comes to rest.
const SLOWEST: f64 = 2.0;
/// Cosine between the normals at entry and at the end below which the end is nearest to another side.
const SAME_SIDE: f64 = 0.5;
/// Rounds over all colliders that a particle between several is given to satisfy them.
const ROUNDS: u32 = 16;

/// A sub-step of one particle as its method has it, and what contact made of it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Answer {
    /// Position (m) and velocity (m/s) at the end.
    pub(super) x: Vec3<f64>,
    pub(super) v: Vec3<f64>,
    /// Energy (J per kg) that bounces add by the method's own difference between its velocities and its way.
    pub(super) swing: f64,
    /// Whether it was inside a collider at the start.
    pub(super) was_inside: bool,
}

/// A sub-step that ends inside a collider.
#[derive(Clone, Copy, Debug)]
pub(super) struct SubStep<'a> {
    pub(super) colliders: &'a [Collider],
    /// Position (m) at its start and at its end without contact.
    pub(super) x: [Vec3<f64>; 2],
    /// Velocity (m/s) then.
    pub(super) v: [Vec3<f64>; 2],
    /// Its length and the time at its end (s).
    pub(super) dt: f64,
    pub(super) end_time: f64,
    /// What is inside by no more than this (m) is on the surface.
    pub(super) spare: f64,
}

impl SubStep<'_> {
    /// What comes of it.
    pub(super) fn answer(&self) -> Answer {
        let mut flight = Flight::new(self.x, self.v, self.dt, self.end_time);
        let lag = self.v[0] - flight.w;
        let free = flight.end_velocity();
        let slowest = SLOWEST * (self.v[1] - self.v[0]).norm();

        for bounces in 0.. {
            let Some((collider, meeting)) = self.first(&flight) else { break };
            flight.go(meeting.after);
            let relative = flight.w - vec3::<f64>(collider.velocity);
            let approach = -relative.dot(&meeting.normal);
            let is_bounce = collider.restitution > 0.0 && meeting.depth == 0.0 && approach >= slowest;
            if !is_bounce || approach <= 0.0 || bounces == MOST_BOUNCES {
                return self.stay(&flight, lag, (collider, meeting));
            }
            let push = (1.0 + collider.restitution) * approach;
            flight.w += change(collider, &relative, &meeting.normal, push);
        }
        let w = flight.end_velocity();
        Answer { x: flight.end(), v: w + lag, swing: lag.dot(&(w - free)), was_inside: false }
    }

    /// The collider that is met first of those that the way ends inside of.
    fn first(&self, flight: &Flight) -> Option<(&Collider, Meeting)> {
        let mut first: Option<(&Collider, Meeting)> = None;
        for collider in self.colliders {
            let Some(meeting) = flight.meets(collider, self.spare) else { continue };
            if first.is_none_or(|(_, other)| meeting.after < other.after) {
                first = Some((collider, meeting));
            }
        }
        first
    }

    /// Stays on the surface that it met from now on, and out of all others. What began inside comes out at the collider's own
    /// pace, and gets no velocity from it.
    fn stay(&self, flight: &Flight, lag: Vec3<f64>, (met, meeting): (&Collider, Meeting)) -> Answer {
        let mut end = Answer {
            x: flight.end(),
            v: flight.end_velocity() + lag,
            swing: 0.0,
            was_inside: meeting.depth > 0.0,
        };
        let added = self.v[1] - self.v[0];
        let felt = if added == Vec3::zeros() { 0.5 } else { 0.5 - lag.dot(&added) / added.norm_squared() };
        for _ in 0..ROUNDS {
            let mut is_right = true;
            for collider in self.colliders {
                let entry = (meeting.depth == 0.0 && std::ptr::eq(collider, met)).then_some(meeting.normal);
                let Some(touch) = self.touch(collider, &end, entry) else { continue };
                is_right &= !touch.hold(flight, felt.clamp(0.0, 1.0), &mut end);
                end.was_inside |= touch.allowed > 0.0;
            }
            if is_right || self.colliders.len() == 1 {
                break;
            }
        }
        end
    }

    /// How a particle that ends somewhere touches a collider there, if it does. `entry` is the normal where it met it.
    fn touch<'a>(&self, collider: &'a Collider, end: &Answer, entry: Option<Vec3<f64>>) -> Option<Touch<'a>> {
        let (distance, normal) = collider.distance(array3(&end.x), self.end_time);
        let depth = collider.margin - distance;
        if depth < -self.spare {
            return None;
        }
        let (start, _) = collider.distance(array3(&self.x[0]), self.end_time - self.dt);
        let start = collider.margin - start;
        // What is there from the start is taken back little by little.
        let allowed = if start > self.spare { (start - collider.recovery * self.dt).max(0.0) } else { 0.0 };
        let here = vec3::<f64>(normal);
        let through = entry.filter(|entry| entry.dot(&here) < SAME_SIDE);
        let normal = through.unwrap_or(here);
        Some(Touch {
            collider,
            normal,
            is_through: through.is_some(),
            depth,
            allowed,
            spare: self.spare,
            end_time: self.end_time,
        })
    }
}

/// A collider that a particle must stay out of at the end of a sub-step.
struct Touch<'a> {
    collider: &'a Collider,
    normal: Vec3<f64>,
    /// Whether the nearest side is another one than that at which it came.
    is_through: bool,
    /// How far (m) it is inside, and how far it may be.
    depth: f64,
    allowed: f64,
    spare: f64,
    end_time: f64,
}

impl Touch<'_> {
    /// Takes the approach away, slows what slides, and puts the particle on the surface; whether that changed anything.
    fn hold(&self, flight: &Flight, felt: f64, end: &mut Answer) -> bool {
        let Self { collider, normal, .. } = self;
        let moving = vec3::<f64>(collider.velocity);
        let relative = end.v - moving;
        let approach = -relative.dot(normal);
        let presses = approach > f64::EPSILON * end.v.amax();
        if presses {
            let by = change(collider, &relative, normal, approach);
            end.v += by;
            self.slow(flight, felt, &(by - normal * approach), approach, end);
        }

        let mut lift = self.depth - self.allowed;
        if presses || self.is_through {
            let (distance, _) = collider.distance(array3(&end.x), self.end_time);
            lift = collider.margin - distance - self.allowed;
        }
        if self.is_through {
            let way = end.x - flight.x - moving * flight.left;
            lift = -way.dot(normal);
        }
        if lift > 0.0 {
            end.x += normal * lift;
        }
        presses || lift > self.spare
    }

    /// Takes back the way along the surface that friction takes: what stops the particle as it comes, from then on; what it
    /// takes later, as the method lets positions feel a change of velocity.
    fn slow(&self, flight: &Flight, felt: f64, slowing: &Vec3<f64>, pushed: f64, end: &mut Answer) {
        if *slowing == Vec3::zeros() {
            return;
        }
        let Self { collider, normal, .. } = self;
        let moving = vec3::<f64>(collider.velocity);
        let coming = flight.w - moving;
        let impact = (-coming.dot(normal)).clamp(0.0, pushed);
        let sliding = coming - normal * coming.dot(normal);
        let left = end.v - moving;
        let rests = left.norm() <= f64::EPSILON * slowing.norm();
        if rests && sliding.norm() <= collider.friction * impact {
            let way = end.x - flight.x - moving * flight.left;
            end.x -= way - normal * way.dot(normal);
        } else {
            let share = (impact + (pushed - impact) * felt) / pushed;
            end.x += slowing * (flight.left * share);
        }
    }
}

/// What a collider adds to a velocity relative to it (m/s) by a push along the normal.
fn change(collider: &Collider, relative: &Vec3<f64>, normal: &Vec3<f64>, push: f64) -> Vec3<f64> {
    let sliding = relative - normal * relative.dot(normal);
    let speed = sliding.norm();
    let slowed = if speed > 0.0 { (collider.friction * push / speed).min(1.0) } else { 0.0 };
    normal * push - sliding * slowed
}

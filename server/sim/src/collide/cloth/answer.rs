//! What a particle of cloth does that meets colliders within a sub-step: it bounces, or stays on the surface.
//!
//! It goes its way up to the surface, and the rest of the sub-step with the velocity that the surface leaves it. What comes
//! fast enough bounces, twice at most; then, and otherwise, it ends on the surface. The impulse along the normal bounds
//! that of friction: `|dv_t| <= friction |dv_n|`.

use super::{
    crease::Crease,
    facing::{Facing, facing},
    flight::{Flight, Meeting},
    passed::REACHED,
    touch::{Answer, Touch, push_and_rub},
};
use crate::{
    collide::{collider::Collider, load::Giving, shape::Near},
    math::{Vec3, array3, vec3},
    sub_step::SubStep,
};

/// Bounces in a sub-step, at most.
const MOST_BOUNCES: u32 = 2;
/// Speed of approach, over what the sub-step adds to the velocity, below which nothing comes back: what bounces comes to rest.
pub(crate) const SLOWEST: f64 = 2.0;
/// Cosine between the normals at entry and at the end below which the end is nearest to another side.
const SAME_SIDE: f64 = 0.5;
/// Rounds over all colliders that a particle between several is given to satisfy them.
const ROUNDS: usize = 16;

/// A particle in a sub-step, and the colliders that it may meet.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Encounter<'a> {
    pub(crate) colliders: &'a [Collider],
    /// What is known of the meshes among them.
    pub(crate) near: &'a [Near],
    /// Position (m) at the start of the sub-step and at its end without contact.
    pub(crate) x: [Vec3<f64>; 2],
    /// Velocity (m/s) then.
    pub(crate) v: [Vec3<f64>; 2],
    pub(crate) sub_step: SubStep,
    /// Rounding (m) of positions.
    pub(crate) rounding: f64,
}

impl<'a> Encounter<'a> {
    /// What comes of it, and what its particle gives to colliders.
    pub(crate) fn answer(&self, giving: &mut Giving<'_>) -> Answer {
        let mut flight = Flight::new(self.x, self.v, self.sub_step, self.rounding);
        let lag = self.v[0] - flight.w;
        let free = flight.end_velocity();
        let slowest = SLOWEST * (self.v[1] - self.v[0]).norm();

        for bounces in 0.. {
            let Some((collider, meeting)) = self.first(&flight) else { break };
            flight.go(meeting.after);
            let relative = flight.w - flight.moving(collider);
            let approach = -relative.dot(&meeting.normal);
            let is_bounce = collider.restitution > 0.0 && meeting.depth == 0.0 && approach >= slowest;
            if !is_bounce || approach <= 0.0 || bounces == MOST_BOUNCES {
                let end = self.stay(&flight, lag, (collider, meeting), giving);
                return Answer { swing: lag.dot(&(flight.end_velocity() - free)), ..end };
            }
            let push = (1.0 + collider.restitution) * approach;
            let change = push_and_rub(&collider, &relative, &meeting.normal, push);
            flight.w += change;
            giving.touched(&collider, &change, (&flight.x, array3(&flight.moving(collider))));
        }
        let w = flight.end_velocity();
        let swing = lag.dot(&(w - free));
        Answer { x: flight.end(), v: w + lag, swing, was_inside: false, is_pinched: false }
    }

    /// The collider that is met first: of those that the way ends inside of, and those that it passes before.
    fn first(&self, flight: &Flight) -> Option<(Facing<'a>, Meeting)> {
        let (mut way, mut first) = (*flight, None::<(Facing<'_>, Meeting)>);
        for _ in self.colliders {
            let among = facing(self.colliders, self.near);
            let others = among.filter(|other| first.is_none_or(|(found, _)| found != *other));
            let met = others.filter_map(|other| Some((other, way.meets(other, self.spare_of(other))?)));
            let Some((found, meeting)) = met.min_by(|(_, a), (_, b)| a.after.total_cmp(&b.after)) else {
                break;
            };
            if first.is_some_and(|(_, before)| meeting.after >= before.after) {
                break;
            }
            first = Some((found, meeting));
            if meeting.after == 0.0 {
                break;
            }
            way = flight.until(meeting.after);
        }
        first
    }

    /// Stays on the surface that it met from now on, and out of all others. What began inside comes out at the collider's own
    /// pace, and gets no velocity from it.
    fn stay(
        &self,
        flight: &Flight,
        lag: Vec3<f64>,
        (met, meeting): (Facing<'_>, Meeting),
        giving: &mut Giving<'_>,
    ) -> Answer {
        let mut end = Answer {
            x: flight.end(),
            v: flight.end_velocity() + lag,
            swing: 0.0,
            was_inside: meeting.depth > 0.0,
            is_pinched: false,
        };
        let added = self.v[1] - self.v[0];
        let square = added.norm_squared();
        let felt = if square > 0.0 { 0.5 - lag.dot(&added) / square } else { 0.5 };
        // The collider that changed it last: nothing is to be done once all others were looked at since then.
        let (mut last, mut pinching) = (None::<Facing<'_>>, None::<Facing<'_>>);
        let all = facing(self.colliders, self.near);
        for collider in std::iter::repeat_n(all, ROUNDS).flatten() {
            if last == Some(collider) {
                break;
            }
            let is_met = collider == met;
            let Some(touch) = self.touch(collider, flight, &end, is_met.then_some(&meeting)) else {
                continue;
            };
            let (felt, before) = (felt.clamp(0.0, 1.0), end.v);
            let is_changed = if collider.shape.has_creases() {
                let is_changed = Crease::new(&touch, self.rounding).hold(flight, felt, &mut end);
                // Of several, one may pinch that is not looked at again.
                let others = pinching.filter(|other| *other != collider);
                pinching = if end.is_pinched { Some(collider) } else { others };
                end.is_pinched = pinching.is_some();
                is_changed
            } else {
                touch.hold(flight, felt, &mut end)
            };
            let moving = collider.velocity_at(array3(&end.x), self.sub_step.end);
            giving.touched(&collider, &(end.v - before), (&end.x, moving));
            if is_changed || last.is_none() {
                last = Some(collider);
            }
            end.was_inside |= touch.allowed > 0.0;
        }
        end
    }

    /// How a particle that ends somewhere touches a collider there, if it does. `meeting` is where it met it.
    fn touch(
        &self,
        collider: Facing<'a>,
        flight: &Flight,
        end: &Answer,
        meeting: Option<&Meeting>,
    ) -> Option<Touch<'a>> {
        let (distance, normal) = collider.distance(array3(&end.x), self.sub_step.end);
        let depth = collider.margin - distance;
        let here = vec3::<f64>(normal);
        let entry = meeting.filter(|meeting| meeting.depth == 0.0).map(|meeting| meeting.normal);
        let way = flight.way_to(&end.x, collider);
        let through = entry.filter(|entry| entry.dot(&here) < SAME_SIDE && way.dot(entry) <= 0.0);
        let spare = self.spare_of(collider);
        // What went through a solid may be far behind it.
        if depth < -spare && !(through.is_some() && collider.shape.has_creases()) {
            return None;
        }
        let start = meeting.map_or_else(|| self.depth_at_start(collider), |meeting| meeting.depth);
        // What is there from the start is taken back little by little.
        let allowed = if start > 0.0 { (start - collider.recovery * self.sub_step.dt).max(0.0) } else { 0.0 };
        let (normal, is_through) = (through.unwrap_or(here), through.is_some());
        let end_time = self.sub_step.end;
        Some(Touch { collider, normal, is_through, depth, allowed, spare, end_time })
    }

    /// What is inside a collider by no more than this (m) is on its surface: it follows from the way that the collider sees.
    pub(crate) fn spare_of(&self, collider: Facing<'_>) -> f64 {
        let way = collider.way_of(self.x.map(|x| array3(&x)), self.sub_step);
        REACHED * vec3::<f64>(way).norm() + self.rounding
    }

    /// How deep (m) the particle began inside a collider: 0 on its surface.
    fn depth_at_start(&self, collider: Facing<'_>) -> f64 {
        let (distance, _) = collider.distance(array3(&self.x[0]), self.sub_step.start());
        let depth = collider.margin - distance;
        if depth > self.spare_of(collider) { depth } else { 0.0 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::collide::{
        collider::{Contact, StartInside},
        shape::{Cuboid, HalfPipe, Plane, Shape, Sphere},
    };

    const DT: f64 = 0.01;

    fn collider(shape: Shape, restitution: f64, friction: f64) -> Collider {
        Collider {
            name: "thing".into(),
            shape,
            velocity: [0.0; 3],
            way: None,
            friction,
            restitution,
            margin: 0.0,
            contact: Contact::Separating,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// A particle without acceleration, which moves at `v` (m/s) from `x` (m).
    fn answer(colliders: &[Collider], x: [f64; 3], v: [f64; 3]) -> Answer {
        let (x, v) = (vec3::<f64>(x), vec3::<f64>(v));
        let (x, v) = ([x, x + v * DT], [v, v]);
        let sub_step = SubStep { dt: DT, end: 0.3 };
        Encounter { colliders, near: &[], x, v, sub_step, rounding: 1e-15 }
            .answer(&mut Giving::new(colliders, &mut []))
    }

    #[test]
    fn a_particle_that_ends_in_a_shape_is_put_on_its_surface_with_friction_too() {
        let mut random = 1_u64;
        let mut number = || {
            random ^= random << 13;
            random ^= random >> 7;
            random ^= random << 17;
            (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        };
        let hollow = |shape: &Shape| matches!(shape, Shape::HalfPipe(_));
        let (mut met, sub_step) = (0, SubStep { dt: DT, end: 0.0 });
        for shape in Shape::examples().into_iter().filter(|shape| !hollow(shape)) {
            for case in 0..10_000 {
                let mut collider =
                    collider(shape.clone(), f64::from(case % 3) / 2.0, f64::from(case % 4) / 3.0);
                collider.velocity = [number(), number(), number()];
                let [mut x, v, w] = [(); 3].map(|()| Vec3::new(number(), number(), number()));
                x *= 1.5;
                let gap = |x: &Vec3<f64>, time: f64| collider.distance(array3(x), time).0;
                let (v, end) = ([v * 20.0, v * 20.0 + w], x + (v * 20.0 + w * 0.5) * DT);
                if gap(&x, -DT) <= 0.0 || gap(&end, 0.0) >= 0.0 {
                    continue;
                }
                met += 1;
                let colliders = std::slice::from_ref(&collider);
                let encounter = Encounter { colliders, near: &[], x: [x, end], v, sub_step, rounding: 1e-15 };
                let Answer { x: after, was_inside, .. } =
                    encounter.answer(&mut Giving::new(colliders, &mut []));
                let depth = -gap(&after, 0.0);
                assert!(
                    depth < 1e-12 && !was_inside,
                    "{:?}, case {case}: {depth:e} m inside",
                    collider.shape
                );
                let way = (v[0].norm() + v[1].norm() + 2.0 * vec3::<f64>(collider.velocity).norm()) * DT;
                assert!((after - x).norm() < way, "{:?}, case {case}: {after} from {x}", collider.shape);
            }
        }
        assert!(met > 500, "{met}");
    }

    #[test]
    fn what_rubs_on_a_ball_stays_on_it() {
        let ball = Shape::Sphere(Sphere { center: [0.0; 3], radius: 0.1 });
        let end = answer(&[collider(ball, 0.0, 1.0)], [-0.05, 0.1, 0.0], [6.0, -4.0, 0.0]);
        assert!((end.x.norm() - 0.1).abs() < 1e-12 && end.v.dot(&end.x).abs() < 1e-12, "{end:?}");
    }

    #[test]
    fn a_dead_mat_is_met_before_the_floor_below_it() {
        let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let floor = Shape::Plane(Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] });
        let mat = Cuboid { center: [0.0, 0.005, 0.0], half_extent: [1.0, 0.015, 1.0], axes };
        let colliders = [collider(floor, 1.0, 0.0), collider(Shape::Box(mat), 0.0, 0.0)];
        for speed in [4.0, 6.5, 8.0] {
            let end = answer(&colliders, [0.0, 0.05, 0.0], [0.0, -speed, 0.0]);
            assert!((end.x.y - 0.02).abs() < 1e-12 && end.v.norm() < 1e-12, "{speed} m/s: {end:?}");
        }
    }

    #[test]
    fn what_leaves_the_wall_of_a_half_pipe_meets_the_other_wall() {
        let axis = [0.0, 0.0, 1.0];
        let pipe = HalfPipe { point: [0.0; 3], axis, up: [0.0, 1.0, 0.0], radius: 0.1 };
        let at = -0.1 * 0.5_f64.sqrt();
        let end = answer(&[collider(Shape::HalfPipe(pipe), 1.0, 0.0)], [at, at, 0.0], [20.0, 0.0, 0.0]);
        assert!((end.v - Vec3::new(0.0, 20.0, 0.0)).norm() < 1e-9, "{end:?}");
    }
}

//! Colliders that move: where they see a point, and how fast the surface is there.
//!
//! Within a sub-step a point of the surface goes from where it is at the start to where it is at the end, and its velocity is
//! that way over the length. So a sub-step gets copies of the colliders whose ways have two keys, one for either end.
//! What has no way has the velocity of its scene, and the arithmetic of a shape that never turns.

use super::Collider;
use crate::{
    collide::motion::{Motion, Way, pose::Pose},
    math::array::{length, minus},
    sub_step::SubStep,
};

impl Collider {
    /// Where its reference point is at a time (s), and how it is turned.
    pub fn pose(&self, time: f64) -> Pose {
        self.way.as_ref().map_or_else(
            || {
                let start = self.shape.reference();
                let position = [0, 1, 2].map(|c| start[c] + self.velocity[c] * time);
                Pose { position, turn: Pose::NO_TURN }
            },
            |way| way.at(time),
        )
    }

    /// Signed distance (m) of a point from the surface at `time` (s), negative inside, and the
    /// unit outward normal there: the direction in which the distance grows. Where there is none,
    /// as at a sphere's centre, it is one of those beside.
    pub fn distance(&self, point: [f64; 3], time: f64) -> (f64, [f64; 3]) {
        let Some(way) = &self.way else {
            return self.shape.distance(point, self.velocity.map(|v| v * time));
        };
        let pose = way.at(time);
        let start = self.shape.reference();
        if !pose.is_turned() {
            return self.shape.distance(point, minus(pose.position, start));
        }
        let (distance, normal) = self.shape.distance(from_start(pose, start, point), [0.0; 3]);
        (distance, pose.turned(normal))
    }

    /// A point (m) at a time (s), as the shape at time 0 sees it.
    pub(crate) fn place(&self, point: [f64; 3], time: f64) -> [f64; 3] {
        let shift = match &self.way {
            None => self.velocity.map(|v| v * time),
            Some(way) => {
                let (pose, start) = (way.at(time), self.shape.reference());
                if pose.is_turned() {
                    return from_start(pose, start, point);
                }
                minus(pose.position, start)
            }
        };
        minus(minus(point, [0.0; 3]), shift)
    }

    /// A direction of the shape at time 0, as it is turned at a time (s).
    pub(crate) fn outward(&self, normal: [f64; 3], time: f64) -> [f64; 3] {
        match &self.way {
            None => normal,
            Some(way) => {
                let pose = way.at(time);
                if pose.is_turned() { pose.turned(normal) } else { normal }
            }
        }
    }

    /// The velocity (m/s), in this sub-step, of what goes along with it and is at a point (m) at a time (s).
    pub(crate) fn velocity_at(&self, point: [f64; 3], time: f64) -> [f64; 3] {
        let Some(way) = &self.way else { return self.velocity };
        let Some([from, to]) = way.ends() else { return [0.0; 3] };
        let along = minus(to.pose.position, from.pose.position);
        let around = turn_of(way, point, time).unwrap_or_default();
        let dt = to.time - from.time;
        [0, 1, 2].map(|c| (along[c] + around[c]) / dt)
    }

    /// The mean velocity (m/s) between two times (s) of what goes along with it and is at a point (m) at the last of them.
    pub(crate) fn mean_velocity(&self, point: [f64; 3], [start, end]: [f64; 2]) -> [f64; 3] {
        let Some(way) = &self.way else { return self.velocity };
        let [from, to] = [start, end].map(|time| way.at(time));
        let before = from.turned(to.seen(point));
        [0, 1, 2].map(|c| (point[c] - from.position[c] - before[c]) / (end - start))
    }

    /// By how much (m/s) the velocity of the surface at a point (m) is another one from a sub-step to the next because it turns:
    /// what rests on it must follow. 0 of what does not turn.
    pub(crate) fn turning(&self, point: [f64; 3], time: f64) -> f64 {
        let Some(way) = &self.way else { return 0.0 };
        let (Some([from, to]), Some(around)) = (way.ends(), turn_of(way, point, time)) else { return 0.0 };
        let next = to.pose.turned(from.pose.turned_back(around));
        length(minus(next, around)) / (to.time - from.time)
    }

    /// The way (m) of a particle from where a sub-step starts to where it ends, as the collider sees it that stands where it is
    /// at the end.
    pub(crate) fn way_of(&self, [start, end]: [[f64; 3]; 2], sub_step: SubStep) -> [f64; 3] {
        match &self.way {
            None => [0, 1, 2].map(|c| end[c] - start[c] - self.velocity[c] * sub_step.dt),
            Some(_) => minus(end, self.carried(start, sub_step)),
        }
    }

    /// Where (m) at the end of a sub-step what goes along with it is that was at a point (m) at the start.
    pub(crate) fn carried(&self, point: [f64; 3], sub_step: SubStep) -> [f64; 3] {
        let Some(way) = &self.way else {
            return [0, 1, 2].map(|c| point[c] + self.velocity[c] * sub_step.dt);
        };
        let [from, to] = sub_step.times().map(|time| way.at(time));
        if from.turn == to.turn {
            return [0, 1, 2].map(|c| point[c] + (to.position[c] - from.position[c]));
        }
        let turned = to.turned(from.seen(point));
        [0, 1, 2].map(|c| to.position[c] + turned[c])
    }

    /// Whether it moves between two times (s).
    pub(crate) fn moves(&self, times: [f64; 2]) -> bool {
        self.velocity != [0.0; 3] || self.way.as_ref().is_some_and(|way| way.moves(times))
    }

    /// Memory of its way (bytes): its own, and that of the copy which sub-steps look at.
    pub(crate) fn way_bytes(&self) -> usize {
        self.way.as_ref().map_or(0, |way| 2 * size_of_val(way.keys.as_slice()))
    }

    /// How it moves from now on.
    pub(crate) fn motion(&self) -> Motion {
        Motion { velocity: self.velocity, way: self.way.clone() }
    }

    /// Moves so from now on.
    pub(crate) fn put_motion(&mut self, Motion { velocity, way }: &Motion) {
        self.velocity = *velocity;
        self.way.clone_from(way);
    }
}

/// A point (m) as a turned shape sees it, whose reference point is at `start` (m) at time 0.
fn from_start(pose: Pose, start: [f64; 3], point: [f64; 3]) -> [f64; 3] {
    let seen = pose.seen(point);
    [0, 1, 2].map(|c| start[c] + seen[c])
}

/// What the turn adds (m) to the way of what is at a point (m) at a time (s); none where it does not turn.
fn turn_of(way: &Way, point: [f64; 3], time: f64) -> Option<[f64; 3]> {
    let [from, to] = way.ends()?;
    if from.pose.turn == to.pose.turn {
        return None;
    }
    let seen = way.at(time).seen(point);
    Some(minus(to.pose.turned(seen), from.pose.turned(seen)))
}

/// Colliders as one sub-step after the other sees them; without any on a way they are those of the scene.
#[derive(Debug)]
pub(crate) struct Moved(Vec<Collider>);

impl Moved {
    /// Room for copies of those colliders, if one has a way.
    pub(crate) fn of(colliders: &[Collider]) -> Self {
        let has_way = colliders.iter().any(|collider| collider.way.is_some());
        Self(if has_way { colliders.to_vec() } else { Vec::new() })
    }

    /// The colliders that it was made of, in a sub-step.
    pub(crate) fn over<'a>(&'a mut self, colliders: &'a [Collider], sub_step: SubStep) -> &'a [Collider] {
        if self.0.is_empty() {
            return colliders;
        }
        for (moved, collider) in self.0.iter_mut().zip(colliders) {
            if let (Some(moved), Some(way)) = (&mut moved.way, &collider.way) {
                moved.take(way, sub_step.times());
            }
        }
        &self.0
    }
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the tests, not of a step")]
mod tests {
    use super::*;
    use crate::collide::{
        collider::{Contact, StartInside},
        motion::PoseKey,
        shape::Shape,
    };

    const TIMES: [f64; 2] = [0.3, 0.31];
    const SUB_STEP: SubStep = SubStep { dt: TIMES[1] - TIMES[0], end: TIMES[1] };

    fn turned(angle: f64) -> [f64; 4] {
        let (sin, cos) = (0.5 * angle).sin_cos();
        [2.0 / 3.0 * sin, -1.0 / 3.0 * sin, 2.0 / 3.0 * sin, cos]
    }

    fn collider(shape: Shape, keys: Vec<PoseKey>) -> Collider {
        Collider {
            name: "thing".into(),
            shape,
            velocity: [0.0; 3],
            way: (!keys.is_empty()).then_some(Way { keys }),
            friction: 0.0,
            restitution: 0.0,
            margin: 0.01,
            contact: Contact::Separating,
            recovery: Collider::RECOVERY,
            on_start_inside: StartInside::Warn,
        }
    }

    /// Keys that shift a shape by 1 m along x per second, and turn it by `rate` (rad/s).
    fn keys(shape: &Shape, rate: f64) -> Vec<PoseKey> {
        let start = shape.reference();
        let key = |time: f64| {
            let position = [start[0] + time, start[1], start[2]];
            PoseKey { time, pose: Pose { position, turn: turned(rate * time) } }
        };
        vec![key(0.0), key(0.5), key(1.0)]
    }

    fn points() -> impl Iterator<Item = [f64; 3]> {
        (0..125).map(|i| [i % 5, i / 5 % 5, i / 25].map(|c| f64::from(c) * 0.6 - 1.1))
    }

    #[test]
    fn a_shape_that_turns_takes_its_distances_along() {
        for shape in Shape::examples() {
            let keys = keys(&shape, 1.7);
            let still = collider(shape.clone(), Vec::new());
            let moving = collider(shape, keys);
            for point in points() {
                let pose = moving.pose(0.8);
                let seen = minus(point, still.shape.reference());
                let along = pose.turned(seen);
                let there = [0, 1, 2].map(|c| pose.position[c] + along[c]);
                let ((a, n), (b, m)) = (still.distance(point, 0.0), moving.distance(there, 0.8));
                assert!((a - b).abs() < 1e-13, "{:?} {point:?}: {a} {b}", still.shape);
                let off = length(minus(moving.place(there, 0.8), point));
                assert!(off < 1e-14, "{:?} {point:?}: {off:e}", still.shape);
                if a > 1e-3 {
                    assert!(length(minus(pose.turned(n), m)) < 1e-9, "{:?} {point:?}", still.shape);
                }
            }
        }
    }

    #[test]
    fn a_velocity_is_the_way_of_a_sub_step_over_its_length() {
        for shape in Shape::examples() {
            let (rates, dt) = ([0.0, 2.3], SUB_STEP.dt);
            for rate in rates {
                let colliders = [collider(shape.clone(), keys(&shape, rate))];
                let mut moved = Moved::of(&colliders);
                let [moved] = moved.over(&colliders, SUB_STEP) else { panic!("one") };
                for point in points() {
                    let end = moved.carried(point, SUB_STEP);
                    let velocity = [0, 1, 2].map(|c| (end[c] - point[c]) / dt);
                    for (at, time) in [(point, TIMES[0]), (end, TIMES[1])] {
                        let off = length(minus(moved.velocity_at(at, time), velocity));
                        assert!(off < 1e-11, "{rate} rad/s, {point:?}: off by {off:e} m/s");
                    }
                    let way = moved.way_of([point, end], SUB_STEP);
                    assert!(length(way) < 1e-15, "what goes along does not move: {way:?}");
                    // The velocity turns by the rate, and its size is the rate times the distance from the axis.
                    let turning = moved.turning(point, TIMES[0]);
                    let around = length(minus(velocity, [1.0, 0.0, 0.0]));
                    let expected = around * rate * dt;
                    assert!((turning - expected).abs() < 1e-3 * expected + 1e-12, "{turning}, {expected}");
                }
            }
        }
    }

    #[test]
    fn without_a_way_nothing_is_copied_and_the_velocity_is_that_of_the_scene() {
        let mut still = collider(Shape::examples().remove(1), Vec::new());
        still.velocity = [0.1, 0.2, 0.3];
        let colliders = [still];
        let mut moved = Moved::of(&colliders);
        assert!(std::ptr::eq(moved.over(&colliders, SUB_STEP), colliders.as_slice()));
        assert_eq!(colliders[0].velocity_at([9.0; 3], 0.3), [0.1, 0.2, 0.3]);
        assert_eq!(colliders[0].turning([9.0; 3], 0.3), 0.0);
    }
}

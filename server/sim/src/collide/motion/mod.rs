//! Motions: the way that a collider goes, from key to key.
//!
//! Reads keys, each a pose at a time (s); writes the pose at any time. At a key it has the bits of the key.

pub(crate) mod pose;

use serde::{Deserialize, Serialize};

use pose::{Pose, turn_length};

use crate::math::array::{cross, length, minus};

/// The least and the greatest coordinates (m) of places.
pub type Bounds = [[f64; 3]; 2];

/// A time so near to that of a key, over its own size, is the time of the key: whole numbers of steps are rounded.
const SAME_TIME: f64 = 8.0 * f64::EPSILON;
/// How far from 1 the length of a turn may be.
const UNIT: f64 = 1e-9;
/// The fastest that a surface may be between two keys of a way (m/s).
pub(crate) const FASTEST: f64 = 1e4;

/// A pose at a time: a key of a way.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PoseKey {
    /// Time (s).
    pub time: f64,
    /// The pose then.
    pub pose: Pose,
}

/// A way: between keys the position goes straight and the turn by the shorter arc, both at a constant rate. It rests before
/// the first key and after the last.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Way {
    /// Its keys: at least one, times growing.
    pub keys: Vec<PoseKey>,
}

/// How a collider moves: with a velocity (m/s), or on a way.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Motion {
    pub(crate) velocity: [f64; 3],
    pub(crate) way: Option<Way>,
}

impl Way {
    /// The pose at a time (s).
    pub fn at(&self, time: f64) -> Pose {
        let near = SAME_TIME * time.abs();
        let next = self.after(time);
        let before = next.checked_sub(1).and_then(|before| self.keys.get(before));
        match (before, self.keys.get(next)) {
            (Some(from), Some(to)) if time > from.time + near => {
                let share = (time - from.time) / (to.time - from.time);
                from.pose.between(&to.pose, share.min(1.0))
            }
            (Some(key), _) | (None, Some(key)) => key.pose,
            (None, None) => Pose { position: [0.0; 3], turn: Pose::NO_TURN },
        }
    }

    /// The number of the first key that is after a time (s).
    fn after(&self, time: f64) -> usize {
        let near = SAME_TIME * time.abs();
        self.keys.partition_point(|key| key.time <= time + near)
    }

    /// Whether it moves between two times (s).
    pub(crate) fn moves(&self, [from, until]: [f64; 2]) -> bool {
        let start = self.at(from);
        let mut within = self.keys.iter().filter(|key| from < key.time && key.time < until);
        self.at(until) != start || within.any(|key| key.pose != start)
    }

    /// Becomes the part of another way between two times (s), as if it went there directly.
    pub(crate) fn take(&mut self, other: &Self, times: [f64; 2]) {
        self.keys.clear();
        self.keys.extend(times.map(|time| PoseKey { time, pose: other.at(time) }));
    }

    /// The keys at both ends; none where there is one alone.
    pub(crate) fn ends(&self) -> Option<[&PoseKey; 2]> {
        match &self.keys[..] {
            [from, .., to] => Some([from, to]),
            _ => None,
        }
    }

    /// The first key that is reached faster than a surface may be where particles can meet it, and that speed (m/s). The
    /// surface is at most `reach` (m) from its reference point, and the particles are within bounds (m).
    pub(crate) fn too_fast(&self, reach: f64, particles: Bounds) -> Option<(usize, f64)> {
        let pairs = self.keys.iter().zip(self.keys.iter().skip(1));
        (1..).zip(pairs).find_map(|(number, (a, b))| {
            let speed = surface_speed([&a.pose, &b.pose], b.time - a.time, reach, particles);
            (speed > FASTEST).then_some((number, speed))
        })
    }

    /// The greatest speed (m/s) between two times (s) of what goes along within bounds (m).
    pub(crate) fn fastest(&self, [from, until]: [f64; 2], [low, high]: Bounds) -> f64 {
        let mut most = 0.0;
        for (a, b) in self.keys.iter().zip(self.keys.iter().skip(1)) {
            if b.time <= from || a.time >= until {
                continue;
            }
            let duration = b.time - a.time;
            let along = minus(b.pose.position, a.pose.position).map(|c| c / duration);
            let turning = a.pose.angle_to(&b.pose).map(|c| c / duration);
            // The speed is a convex function of the place and of the time between keys: greatest at corners and ends.
            for time in [from.max(a.time), until.min(b.time)] {
                let center = self.at(time).position;
                for corner in 0..8 {
                    let place = [0, 1, 2].map(|c| if corner >> c & 1 == 0 { low[c] } else { high[c] });
                    let around = cross(turning, minus(place, center));
                    most = f64::max(most, length([0, 1, 2].map(|c| along[c] + around[c])));
                }
            }
        }
        most
    }

    /// What steps from a time (s) on depend on, as numbers: the keys between which it is and those after it; of one that rests
    /// for good its pose alone.
    pub(crate) fn numbers(&self, time: f64) -> impl Iterator<Item = f64> {
        let first = self.after(time).saturating_sub(1);
        let left = &self.keys[first.min(self.keys.len())..];
        let is_over = left.len() == 1;
        left.iter().flat_map(move |PoseKey { time, pose: Pose { position, turn } }| {
            let time = (!is_over).then_some(*time);
            time.into_iter().chain(*position).chain(*turn)
        })
    }

    /// Says what is wrong with its keys, if anything.
    pub(crate) fn invalid(&self) -> Option<String> {
        self.unsound().or_else(|| {
            let pairs = self.keys.iter().zip(self.keys.iter().skip(1));
            (1..).zip(pairs).find_map(|(number, (a, b))| {
                let speed = length(minus(b.pose.position, a.pose.position)) / (b.time - a.time);
                (speed > FASTEST).then(|| {
                    format!("key {number} is reached at {speed} m/s: at most {FASTEST} m/s are allowed")
                })
            })
        })
    }

    /// The same, however fast its keys are reached.
    fn unsound(&self) -> Option<String> {
        if self.keys.is_empty() {
            return Some("its way has no keys: one or more are needed".to_owned());
        }
        for (number, PoseKey { time, pose: Pose { position, turn } }) in self.keys.iter().enumerate() {
            if !time.is_finite() || !position.iter().all(|c| c.is_finite()) {
                return Some(format!("key {number} is at {time} s, {position:?}: finite numbers are needed"));
            }
            let length = turn_length(*turn);
            if length.is_nan() || (length - 1.0).abs() > UNIT {
                return Some(format!("the turn of key {number} has length {length}: length 1 is needed"));
            }
        }
        let back = (1..self.keys.len()).find(|key| self.keys[*key].time <= self.keys[key - 1].time)?;
        let (time, after) = (self.keys[back].time, self.keys[back - 1].time);
        Some(format!("key {back} is at {time} s: a time after {after} s is needed"))
    }
}

impl Motion {
    /// Says why no collider moves so, if none does. How fast it is is not looked at: the part of a way that a call gave to a
    /// collider on its way may be faster than others.
    pub(crate) fn unsound(&self) -> Option<String> {
        let Self { velocity, way } = self;
        if !velocity.iter().all(|c| c.is_finite()) {
            return Some(format!("its velocity is not finite: {velocity:?}"));
        }
        if way.is_some() && *velocity != [0.0; 3] {
            return Some("it has both a velocity and a way: one of them is needed".to_owned());
        }
        way.as_ref().and_then(Way::unsound)
    }
}

/// The greatest speed (m/s) that a surface may have where a particle meets it, from one pose to another in `duration` (s): that
/// of the reference point, and that of the turn as far from it as the surface reaches (m), but no farther than the corners of
/// the box of all particles.
pub(crate) fn surface_speed([from, to]: [&Pose; 2], duration: f64, reach: f64, particles: Bounds) -> f64 {
    let along = length(minus(to.position, from.position)) / duration;
    let turning = length(from.angle_to(to)) / duration;
    if turning == 0.0 {
        return along;
    }
    // The farthest corner is a convex function of the place from which it is seen: farthest at an end.
    let away = f64::max(farthest(from.position, particles), farthest(to.position, particles));
    along + turning * away.min(reach)
}

/// How far (m) the farthest corner of bounds (m) is from a place (m).
fn farthest(place: [f64; 3], [low, high]: Bounds) -> f64 {
    length([0, 1, 2].map(|c| f64::max((place[c] - low[c]).abs(), (high[c] - place[c]).abs())))
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the tests, not of a step")]
mod tests {
    use super::*;

    fn key(time: f64, x: f64, angle: f64) -> PoseKey {
        let (sin, cos) = (0.5 * angle).sin_cos();
        PoseKey { time, pose: Pose { position: [x, 0.0, 1.0], turn: [0.0, sin, 0.0, cos] } }
    }

    fn way() -> Way {
        Way { keys: vec![key(1.0, 0.0, 0.0), key(2.0, 3.0, 0.5), key(4.0, 3.0, -1.5)] }
    }

    #[test]
    fn a_way_rests_outside_its_keys_and_is_even_between_them() {
        let way = way();
        for (time, x, angle) in [
            (0.0, 0.0, 0.0),
            (1.0, 0.0, 0.0),
            (1.25, 0.75, 0.125),
            (2.0, 3.0, 0.5),
            (3.0, 3.0, -0.5),
            (9.0, 3.0, -1.5),
        ] {
            let (found, expected) = (way.at(time), key(time, x, angle).pose);
            let off = found.turn.iter().zip(expected.turn).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(found.position == expected.position && off < 1e-14, "at {time} s: {found:?}");
        }
    }

    #[test]
    fn at_a_key_and_within_rounding_of_it_the_pose_has_the_bits_of_the_key() {
        let way = way();
        for PoseKey { time, pose } in &way.keys {
            for time in [*time, time * (1.0 + f64::EPSILON), time * (1.0 - f64::EPSILON)] {
                assert_eq!(way.at(time), *pose, "at {time} s");
            }
        }
    }

    #[test]
    fn the_fastest_point_of_a_box_is_a_corner() {
        // 2 m/s along x, and 3 rad/s about y: at (0, 0, 2) from the reference point that adds 6 m/s.
        let way = Way { keys: vec![key(0.0, 0.0, 0.0), key(0.5, 1.0, 1.5)] };
        let around = |low: f64, high: f64| [[0.0, -1.0, low], [0.0, 1.0, high]];
        let found = way.fastest([0.0, 1e-9], around(0.0, 3.0));
        assert!((found - 8.0).abs() < 1e-6, "{found}");
        assert!((way.fastest([0.0, 1e-9], around(1.0, 1.0)) - 2.0).abs() < 1e-6);
        assert_eq!(way.fastest([0.5, 1.0], around(0.0, 3.0)), 0.0, "it has come");
    }

    #[test]
    fn a_surface_is_as_fast_as_its_farthest_point_that_a_particle_can_meet() {
        // 2 m/s along x, and 3 rad/s about y.
        let [from, to] = [key(0.0, 0.0, 0.0).pose, key(0.5, 1.0, 1.5).pose];
        let still = Pose { turn: from.turn, ..to };
        let around = |half: f64| [[0.5 - half, 0.0, 1.0], [0.5 + half, 0.0, 1.0]];
        for (to, reach, particles, expected) in [
            (to, 4.0, around(1e3), 2.0 + 3.0 * 4.0),
            (to, f64::INFINITY, around(3.0), 2.0 + 3.0 * 3.5),
            (to, 4.0, around(3.0), 2.0 + 3.0 * 3.5),
            (still, f64::INFINITY, around(1e9), 2.0),
        ] {
            let found = surface_speed([&from, &to], 0.5, reach, particles);
            assert!((found - expected).abs() < 1e-12, "{found}, not {expected}");
        }

        // It rests, and then turns by 3 rad/s.
        let way = Way { keys: vec![key(0.0, 0.5, 0.0), key(1.0, 0.5, 0.0), key(1.5, 0.5, 1.5)] };
        assert_eq!(way.too_fast(f64::INFINITY, around(3333.0)), None);
        assert_eq!(way.too_fast(3333.0, around(3334.0)), None);
        let (number, speed) = way.too_fast(f64::INFINITY, around(3334.0)).expect("it is too fast");
        assert!(number == 2 && (speed - 10_002.0).abs() < 1e-8, "{number}, {speed}");
    }

    #[test]
    fn it_moves_where_it_is_elsewhere_or_was_meanwhile() {
        let way = Way { keys: vec![key(1.0, 0.0, 0.0), key(2.0, 1.0, 0.0), key(3.0, 0.0, 0.0)] };
        for (times, expected) in [
            ([0.0, 1.0], false),
            ([0.0, 1.5], true),
            ([1.0, 3.0], true),
            ([3.0, 4.0], false),
            ([2.5, 2.6], true),
        ] {
            assert_eq!(way.moves(times), expected, "{times:?}");
        }
    }

    #[test]
    fn numbers_are_those_on_which_steps_depend() {
        let way = way();
        assert_eq!(way.numbers(0.0).count(), 24);
        assert_eq!(way.numbers(1.5).count(), 24);
        assert_eq!(way.numbers(2.0).count(), 16);
        assert_eq!(way.numbers(4.0).collect::<Vec<_>>(), way.numbers(7.0).collect::<Vec<_>>());
        assert_eq!(way.numbers(4.0).count(), 7);
    }

    #[test]
    fn keys_that_make_no_way_are_named() {
        let with = |keys: Vec<PoseKey>| Way { keys }.invalid();
        assert_eq!(way().invalid(), None);
        let mut bent = key(1.0, 0.0, 0.0);
        bent.pose.turn = [0.0, 0.0, 0.0, 1.1];
        for (keys, named) in [
            (vec![], "no keys"),
            (vec![key(1.0, 0.0, 0.0), key(1.0, 1.0, 0.0)], "after"),
            (vec![key(f64::NAN, 0.0, 0.0)], "finite"),
            (vec![key(0.0, f64::INFINITY, 0.0)], "finite"),
            (vec![bent], "length"),
            (vec![key(0.0, 0.0, 0.0), key(1e-3, 20.0, 0.0)], "m/s"),
        ] {
            let message = with(keys).expect("it is invalid");
            assert!(message.contains(named), "{message}");
        }
    }
}

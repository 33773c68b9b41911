//! Moves of colliders by calls: where one is to be, and when; and why a move is refused.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    collide::{Bounds, FASTEST, Pose, PoseKey, Way, surface_speed, turn_length, unit},
    math::{
        array::{length, minus},
        number,
    },
};

/// How far from 1 the length of a turn may be.
const UNIT: f64 = 1e-6;
/// Share of a step by which a time may miss a whole number of steps.
const ROUNDING: f64 = 1e-9;

/// Moves a collider from where it is, through one pose or several; what was left of its way is forgotten.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColliderMove {
    /// Name of the collider.
    pub collider: String,
    /// Where it is to be, and when: one or more, times growing.
    pub keys: Arc<[MoveKey]>,
}

/// A pose of a move.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct MoveKey {
    /// Time from the change on (s), 0 or more; it takes a step to the first at least, and a step to each other.
    pub time: f64,
    /// Position of its reference point then (m); none: as before.
    pub position: Option<[f64; 3]>,
    /// Its turn then, from how it is at time 0: a quaternion x, y, z, w of length 1; none: as before.
    pub turn: Option<[f64; 4]>,
}

/// From where a collider sets out on a move.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Departure {
    /// At once, from the pose that it has.
    Now(Pose),
    /// Later, from wherever it is then; it has this pose now.
    Later(Pose),
}

/// Which names there are, for the message of one that is none of them.
pub(crate) fn there_are(known: &str) -> String {
    if known.is_empty() { "there are none".to_owned() } else { format!("there are: {known}") }
}

/// A move of a collider that was refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MoveError {
    #[error("no collider is named '{name}'; {}", there_are(known))]
    UnknownCollider { name: String, known: String },
    #[error("collider '{name}' is moved twice: once in a call is allowed")]
    ColliderTwice { name: String },
    #[error("the way of collider '{name}' has no poses: one or more are needed")]
    EmptyWay { name: String },
    #[error(
        "pose {key} of the way of collider '{name}' is at {} s: a time after {} s is needed",
        number(*time),
        number(*after)
    )]
    TimesOfWay { name: String, key: usize, time: f64, after: f64 },
    #[error("turn {key} of collider '{name}' has length {}: length 1 within 1e-6 is needed", number(*length))]
    TurnLength { name: String, key: usize, length: f64 },
    #[error(
        "{} the surface of collider '{name}' has up to {} m/s where particles can meet it: allowed are at most {} m/s",
        leg(*key),
        number(*speed),
        number(FASTEST)
    )]
    SurfaceSpeed { name: String, key: usize, speed: f64 },
}

/// The part of a way that ends at a pose, in words.
fn leg(key: usize) -> String {
    match key {
        0 => "from where it is to pose 0 of its way".to_owned(),
        key => format!("from pose {} to pose {key} of its way", key - 1),
    }
}

impl ColliderMove {
    /// Checks it against the names of the colliders, but for the ranges of its numbers.
    pub(crate) fn check(&self, names: &[String]) -> Result<(), MoveError> {
        let Self { collider, keys } = self;
        let name = || collider.clone();
        if !names.contains(collider) {
            return Err(MoveError::UnknownCollider { name: name(), known: names.join(", ") });
        }
        if keys.is_empty() {
            return Err(MoveError::EmptyWay { name: name() });
        }
        let mut before = None::<&MoveKey>;
        for (key, now) in keys.iter().enumerate() {
            let length = now.turn.map_or(1.0, turn_length);
            if length.is_nan() || (length - 1.0).abs() > UNIT {
                return Err(MoveError::TurnLength { name: name(), key, length });
            }
            if let Some(before) = before {
                let (time, after) = (now.time, before.time);
                if time <= after {
                    return Err(MoveError::TimesOfWay { name: name(), key, time, after });
                }
                let speed = speed(before, now);
                if speed > FASTEST {
                    return Err(MoveError::SurfaceSpeed { name: name(), key, speed });
                }
            }
            before = Some(now);
        }
        Ok(())
    }

    /// Checks how fast its surface is where particles within bounds (m) can meet it, which is at most `reach` (m) from its
    /// reference point, in steps of `dt` (s). The time between two poses is the one that is asked for, or less where whole
    /// steps take less. The part to the first pose is checked where it is known from where the collider sets out.
    pub(crate) fn check_speed(
        &self,
        departure: Departure,
        reach: f64,
        dt: f64,
        particles: Bounds,
    ) -> Result<(), MoveError> {
        let (start, first) = match departure {
            Departure::Now(start) => (start, 0),
            Departure::Later(start) => (start, 1),
        };
        let way = self.way(start, 0, dt);
        let legs = way.keys.iter().zip(way.keys.iter().skip(1)).enumerate();
        for (key, (from, to)) in legs.skip(first) {
            let asked = match key.checked_sub(1) {
                Some(before) => self.keys[key].time - self.keys[before].time,
                None => self.keys[key].time.max(dt),
            };
            let duration = asked.min(to.time - from.time);
            let speed = surface_speed([&from.pose, &to.pose], duration, reach, particles);
            if speed > FASTEST {
                return Err(MoveError::SurfaceSpeed { name: self.collider.clone(), key, speed });
            }
        }
        Ok(())
    }

    /// The way from the pose that it has after a number of steps of `dt` (s). Its keys are at ends of steps.
    pub(crate) fn way(&self, start: Pose, steps: u64, dt: f64) -> Way {
        let time = |steps: u64| steps as f64 * dt;
        let mut keys = Vec::with_capacity(1 + self.keys.len());
        keys.push(PoseKey { time: time(steps), pose: start });
        let (mut pose, mut taken) = (start, 0);
        for MoveKey { time: asked, position, turn } in self.keys.iter() {
            // A time of a whole number of steps stays one when the quotient is rounded.
            let arrival = ((asked / dt - ROUNDING).ceil() as u64).max(taken + 1);
            pose = Pose { position: position.unwrap_or(pose.position), turn: turn.map_or(pose.turn, unit) };
            keys.push(PoseKey { time: time(steps.saturating_add(arrival)), pose });
            taken = arrival;
        }
        Way { keys }
    }
}

/// How fast (m/s) the reference point goes from one pose to the next, where both are told.
fn speed(before: &MoveKey, now: &MoveKey) -> f64 {
    match (before.position, now.position) {
        (Some(from), Some(to)) => length(minus(to, from)) / (now.time - before.time),
        _ => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const START: Pose = Pose { position: [1.0, 2.0, 3.0], turn: Pose::NO_TURN };

    fn key(time: f64, x: f64) -> MoveKey {
        MoveKey { time, position: Some([x, 0.0, 0.0]), turn: None }
    }

    fn to(keys: &[MoveKey]) -> ColliderMove {
        ColliderMove { collider: "box".into(), keys: keys.into() }
    }

    #[test]
    fn a_way_through_poses_is_that_of_moves_from_one_to_the_next() {
        let (dt, turn) = (0.1, [0.0, 0.6, 0.0, 0.8]);
        let turned = MoveKey { turn: Some(turn), position: None, ..key(0.5, 0.0) };
        let way = to(&[key(0.2, 1.0), turned, key(0.55, 2.0)]).way(START, 7, dt);
        let one = to(&[key(0.2, 1.0)]).way(START, 7, dt);
        let two = to(&[MoveKey { time: 0.3, ..turned }]).way(one.at(9.0 * dt), 9, dt);
        let three = to(&[key(0.05, 2.0)]).way(two.at(12.0 * dt), 12, dt);
        assert_eq!(way.keys[..2], one.keys[..]);
        assert_eq!(way.keys[1..3], two.keys[..]);
        assert_eq!(way.keys[2..], three.keys[..]);
        assert_eq!(way.keys[3].pose, Pose { position: [2.0, 0.0, 0.0], turn });
    }

    #[test]
    fn a_move_without_time_takes_a_step() {
        let way = to(&[key(0.0, 1.0)]).way(START, 4, 0.5);
        assert_eq!(way.keys.iter().map(|key| key.time).collect::<Vec<_>>(), [2.0, 2.5]);
    }

    /// Bounds of particles (m): a square of 1 m about the start.
    const AROUND: Bounds = [[0.5, 2.0, 2.5], [1.5, 2.0, 3.5]];

    fn checked(asked: &ColliderMove, departure: Departure, reach: f64) -> Result<(), String> {
        asked.check_speed(departure, reach, 0.001, AROUND).map_err(|error| error.to_string())
    }

    /// A move on the spot, by an angle (rad) about y, within a time (s) from 1 s on.
    #[allow(clippy::disallowed_methods, reason = "an angle of the tests, not of a step")]
    fn turning(angle: f64, duration: f64) -> ColliderMove {
        let (sin, cos) = (0.5 * angle).sin_cos();
        let turn = |time: f64, turn: [f64; 4]| MoveKey { time, position: None, turn: Some(turn) };
        to(&[turn(1.0, Pose::NO_TURN), turn(1.0 + duration, [0.0, sin, 0.0, cos])])
    }

    #[test]
    fn a_surface_that_turns_is_as_fast_as_its_farthest_point_that_particles_can_meet() {
        let now = Departure::Now(START);
        // Corners of the particles are 0.707 m from the reference point. In 0.1 ms it takes 1.414 rad for 10 000 m/s.
        let duration = 1e-4;
        for reach in [f64::INFINITY, 9.0, 0.5_f64.sqrt()] {
            assert_eq!(checked(&turning(1.414, duration), now, reach), Ok(()));
            let message = checked(&turning(1.415, duration), now, reach).expect_err("it is too fast");
            let told = ["from pose 0 to pose 1", "collider 'box'", "has up to 100", "at most 10000 m/s"];
            assert!(told.iter().all(|part| message.contains(part)), "{message}");
        }
        // One that is smaller may turn faster, and one that turns about another place less fast.
        assert_eq!(checked(&turning(1.999, duration), now, 0.5), Ok(()));
        checked(&turning(2.001, duration), now, 0.5).expect_err("it is too fast");
        let away = Departure::Now(Pose { position: [1.0, 12.0, 3.0], ..START });
        assert_eq!(checked(&turning(0.0997, duration), away, f64::INFINITY), Ok(()));
        checked(&turning(0.0999, duration), away, f64::INFINITY).expect_err("it is too fast");
        assert_eq!(checked(&turning(0.0, duration), now, f64::INFINITY), Ok(()));
    }

    #[test]
    fn the_way_to_the_first_pose_takes_a_step_at_least_and_counts_where_its_start_is_known() {
        // It sets out from x = 1 m.
        for (x, is_good) in [(10.999, true), (11.001, false)] {
            let asked = to(&[MoveKey { time: 0.0, position: Some([x, 2.0, 3.0]), turn: None }]);
            let found = checked(&asked, Departure::Now(START), 1.0);
            assert_eq!(found.is_ok(), is_good, "{found:?}");
            assert_eq!(checked(&asked, Departure::Later(START), 1.0), Ok(()));
        }
        let message = checked(&to(&[key(0.0, 99.0)]), Departure::Now(START), 1.0).expect_err("too fast");
        assert!(message.starts_with("from where it is to pose 0 of its way the surface"), "{message}");
    }

    #[test]
    fn whole_steps_that_take_less_than_was_asked_for_count() {
        // 15 m in 1.5 ms, which is a step of 1 ms: poses are at 1 and 2 ms.
        let asked = to(&[key(0.0005, 0.0), key(0.002, 15.0)]);
        checked(&asked, Departure::Later(START), 1.0).expect_err("it is too fast");
        assert_eq!(checked(&to(&[key(0.0005, 0.0), key(0.002, 9.9)]), Departure::Later(START), 1.0), Ok(()));
    }

    #[test]
    fn what_cannot_be_is_refused_by_name() {
        let names = ["floor".to_owned(), "box".to_owned()];
        let turned = |turn: [f64; 4]| MoveKey { turn: Some(turn), ..key(1.0, 0.0) };
        assert_eq!(to(&[key(0.0, 1.0), key(1.0, 2.0)]).check(&names), Ok(()));
        assert_eq!(to(&[turned([0.0, 0.0, 0.0, 1.0 + 1e-7])]).check(&names), Ok(()));
        let other = ColliderMove { collider: "ball".into(), ..to(&[key(1.0, 0.0)]) };
        for (bad, named) in [
            (other, "no collider is named 'ball'; there are: floor, box"),
            (to(&[]), "no poses"),
            (to(&[key(1.0, 0.0), key(1.0, 0.0)]), "a time after 1 s"),
            (to(&[turned([0.0; 4])]), "length 0"),
            (to(&[turned([0.0, 0.0, 0.0, 1.00001])]), "length 1"),
            (to(&[turned([f64::NAN; 4])]), "length NaN"),
            (to(&[key(1.0, 0.0), key(1.001, 100.0)]), "m/s"),
        ] {
            let message = bad.check(&names).expect_err("it is refused").to_string();
            assert!(message.contains(named), "{message}");
        }
        let none = to(&[key(1.0, 0.0)]).check(&[]).expect_err("it is refused").to_string();
        assert!(none.ends_with("; there are none"), "{none}");
    }
}

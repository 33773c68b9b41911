//! Moves of colliders by calls: where one is to be, and when; and why a move is refused.

use std::sync::Arc;

use serde::{Deserialize, Serialize};
use thiserror::Error;

use crate::{
    collide::{FASTEST, Pose, PoseKey, Way, turn_length, unit},
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

/// A move of a collider that was refused.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum MoveError {
    #[error("no collider is named '{name}'; there are: {known}")]
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
        "pose {key} of the way of collider '{name}' is reached at {} m/s: allowed are at most {} m/s",
        number(*speed),
        number(FASTEST)
    )]
    SurfaceSpeed { name: String, key: usize, speed: f64 },
}

impl ColliderMove {
    /// Checks it against the names of the colliders, but for the ranges of its numbers.
    pub(super) fn check(&self, names: &[String]) -> Result<(), MoveError> {
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

    /// The way from the pose that it has after a number of steps of `dt` (s). Its keys are at ends of steps.
    pub(super) fn way(&self, start: Pose, steps: u64, dt: f64) -> Way {
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
    }
}

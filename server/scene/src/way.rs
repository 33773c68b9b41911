//! The way of a collider: how a scene writes its keys, and what the simulation gets.

use nappe_sim::{
    collide::{Pose, PoseKey, Way},
    math::{
        array::{length, minus},
        four_digits, number,
    },
    world::allowed,
};
use serde::{Deserialize, Serialize};

use crate::{
    error::{ErrorKind, SceneError},
    location::Location,
    schema::{Alternatives, DIRECTION, LENGTH, Presence, Range, SPEED, Section, ValueKind, key},
};

use Presence::{Default as Preset, Required};
use ValueKind::{Four, Number, Vector};

/// Bytes of a key: while a session is made it is in the scene, in what a reset begins from, and in the world.
pub(crate) const KEY_BYTES: u64 = 3 * size_of::<PoseKey>() as u64;

/// Where a collider is at a time.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct ColliderKey {
    /// Time (s).
    pub time: f64,
    /// Position of its reference point then (m).
    pub position: [f64; 3],
    /// Its turn about that point, from how its shape is written: a quaternion x, y, z, w of any length but 0.
    #[serde(default = "no_turn")]
    pub turn: [f64; 4],
}

fn no_turn() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

impl ColliderKey {
    /// Keys of one collider, at most.
    pub const MOST: usize = 10_000;
}

#[rustfmt::skip] // one line per key
pub(crate) static KEY: Section = Section {
    name: "collider.key",
    about: "A key of the collider's way: its pose at a time. Between keys its reference point goes straight at constant speed, and it turns about that point by the shorter arc at a constant rate. It rests before the first key and after the last. The reference point is the centre of a sphere or a box, the middle between start and end of a capsule or a cylinder, the point of a plane or a half_pipe, and of a mesh the place to which its transform takes the origin.",
    keys: &[
        key("time", Number(Range::of(allowed::DURATION)), "s", Required, "when, after the key before it"),
        key("position", Vector(LENGTH), "m", Required, "position of its reference point then; the way from the key before it has at most 10000 m/s"),
        key("turn", Four(DIRECTION), "", Preset("[0.0, 0.0, 0.0, 1.0]"), "its turn then, from how its shape is written: a quaternion x, y, z, w, not zero; it is made of length 1"),
    ],
    alternatives: Alternatives::None,
};

/// The way that keys make; none: there are no keys. `at` is the list of them.
pub(crate) fn way(keys: &[ColliderKey], at: &Location<'_>) -> Result<Option<Way>, SceneError> {
    for (i, (before, key)) in (1..).zip(keys.iter().zip(keys.iter().skip(1))) {
        if let Some((name, message)) = out_of_order(before, key) {
            return at.index(i).key(name).inconsistent(message);
        }
    }

    let mut poses = Vec::with_capacity(keys.len());
    for (i, &ColliderKey { time, position, turn }) in keys.iter().enumerate() {
        let Some(turn) = unit(turn) else {
            let message = "is zero: a turn needs a length above 0";
            return Err(at.index(i).key("turn").error(ErrorKind::OutOfRange, message));
        };
        poses.push(PoseKey { time, pose: Pose { position, turn } });
    }
    Ok((!poses.is_empty()).then_some(Way { keys: poses }))
}

/// What is wrong with a key after the one before it: in which of its values, and why.
fn out_of_order(before: &ColliderKey, key: &ColliderKey) -> Option<(&'static str, String)> {
    let duration = key.time - before.time;
    if duration <= 0.0 {
        let (time, before) = (key.time, before.time);
        return Some(("time", format!("is {time}: times grow, and the key before it is at {before} s")));
    }
    let (speed, most) = (length(minus(key.position, before.position)) / duration, SPEED.1);
    (speed > most).then(|| {
        let (speed, most) = (four_digits(speed), number(most));
        ("position", format!("is reached at {speed} m/s from the key before it; allowed: at most {most} m/s"))
    })
}

/// The turn at length 1; none: its length is 0.
fn unit(turn: [f64; 4]) -> Option<[f64; 4]> {
    let length = |q: [f64; 4]| q.iter().map(|c| c * c).sum::<f64>().sqrt();
    // What has length 1 to rounding keeps its bits: a call that gives the same numbers turns alike.
    if (length(turn) - 1.0).abs() <= 4.0 * f64::EPSILON {
        return Some(turn);
    }

    // By the largest first, since squares of small numbers vanish.
    let most = turn.iter().fold(0.0, |most: f64, c| most.max(c.abs()));
    let scaled = turn.map(|c| c / most);
    let length = length(scaled);
    (most > 0.0).then(|| scaled.map(|c| c / length))
}

//! Poses: where the reference point of a shape is, and how the shape is turned about it.
//!
//! Turns are unit quaternions x, y, z, w in binary64. Their angles come from `libm`, so that bits depend on no machine.

use serde::{Deserialize, Serialize};

use crate::math::array::{cross, length, minus};

/// Position (m) of a shape's reference point, and its turn since time 0 (unit quaternion x, y, z, w).
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pose {
    /// Position of the reference point (m).
    pub position: [f64; 3],
    /// Turn about the reference point, from how the shape is at time 0: a quaternion x, y, z, w of length 1.
    pub turn: [f64; 4],
}

impl Pose {
    /// The turn of what is not turned.
    pub const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

    /// Whether it is turned at all.
    pub(crate) fn is_turned(&self) -> bool {
        self.turn != Self::NO_TURN
    }

    /// A vector that goes along with the turn.
    pub(crate) fn turned(&self, v: [f64; 3]) -> [f64; 3] {
        rotate(self.turn, v)
    }

    /// The vector that the turn makes this one of.
    pub(crate) fn turned_back(&self, v: [f64; 3]) -> [f64; 3] {
        rotate(conjugate(self.turn), v)
    }

    /// Where a point (m) is, as seen from the reference point without the turn.
    pub(crate) fn seen(&self, point: [f64; 3]) -> [f64; 3] {
        self.turned_back(minus(point, self.position))
    }

    /// A share, 0 to 1, of the way to another pose: straight, and by the shorter arc.
    pub(crate) fn between(&self, to: &Self, share: f64) -> Self {
        let position = [0, 1, 2].map(|c| self.position[c] + share * (to.position[c] - self.position[c]));
        Self { position, turn: arc(self.turn, to.turn, share) }
    }

    /// The turn that leads to another pose by the shorter arc: its angle (rad) along its axis.
    pub(crate) fn angle_to(&self, to: &Self) -> [f64; 3] {
        let (axis, sine, cosine) = half_turn(self.turn, to.turn);
        if sine == 0.0 {
            return [0.0; 3];
        }
        let angle = 2.0 * libm::atan2(sine, cosine);
        self.turned(axis.map(|c| c * (angle / sine)))
    }
}

/// A quaternion at length 1; one that has it but for rounding keeps its bits.
pub(crate) fn unit(turn: [f64; 4]) -> [f64; 4] {
    let length = turn_length(turn);
    if (length - 1.0).abs() <= 4.0 * f64::EPSILON { turn } else { turn.map(|c| c / length) }
}

/// The length of a quaternion.
pub(crate) fn turn_length([x, y, z, w]: [f64; 4]) -> f64 {
    (x * x + y * y + z * z + w * w).sqrt()
}

fn conjugate([x, y, z, w]: [f64; 4]) -> [f64; 4] {
    [-x, -y, -z, w]
}

/// The second turn, then the first.
fn product([ax, ay, az, aw]: [f64; 4], [bx, by, bz, bw]: [f64; 4]) -> [f64; 4] {
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

fn rotate([x, y, z, w]: [f64; 4], v: [f64; 3]) -> [f64; 3] {
    let axis = [x, y, z];
    let across = cross(axis, v).map(|c| 2.0 * c);
    let inward = cross(axis, across);
    [0, 1, 2].map(|c| v[c] + w * across[c] + inward[c])
}

/// The shorter turn from one to another, as the first is turned: its axis times the sine of half its angle, that sine, and
/// the cosine.
fn half_turn(from: [f64; 4], to: [f64; 4]) -> ([f64; 3], f64, f64) {
    let [x, y, z, w] = product(conjugate(from), to);
    // A quaternion and its negative are the same turn.
    let side = if w < 0.0 { -1.0 } else { 1.0 };
    let axis = [x, y, z].map(|c| side * c);
    (axis, length(axis), side * w)
}

/// A share of the shorter arc between two turns.
fn arc(from: [f64; 4], to: [f64; 4], share: f64) -> [f64; 4] {
    if from == to {
        return from;
    }
    let (axis, sine, cosine) = half_turn(from, to);
    if sine == 0.0 {
        return from;
    }
    let (part, rest) = libm::sincos(share * libm::atan2(sine, cosine));
    let [x, y, z] = axis.map(|c| c * (part / sine));
    unit(product(from, [x, y, z, rest]))
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the tests, not of a step")]
mod tests {
    use super::*;
    use crate::math::array::dot;

    /// The turn by an angle (rad) about an axis of length 1.
    fn about(axis: [f64; 3], angle: f64) -> [f64; 4] {
        let (sin, cos) = (0.5 * angle).sin_cos();
        [axis[0] * sin, axis[1] * sin, axis[2] * sin, cos]
    }

    fn pose(turn: [f64; 4]) -> Pose {
        Pose { position: [0.0; 3], turn }
    }

    /// Rodrigues' formula for the rotation of a vector about an axis by an angle.
    fn rodrigues(axis: [f64; 3], angle: f64, v: [f64; 3]) -> [f64; 3] {
        let (sin, cos) = angle.sin_cos();
        let (across, along) = (cross(axis, v), dot(axis, v) * (1.0 - cos));
        [0, 1, 2].map(|c| v[c] * cos + across[c] * sin + axis[c] * along)
    }

    const AXES: [[f64; 3]; 3] = [[1.0, 0.0, 0.0], [0.0, 0.6, -0.8], [2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0]];
    const V: [f64; 3] = [0.3, -1.7, 0.9];

    #[test]
    fn a_turn_is_that_of_rodrigues_and_goes_back() {
        for axis in AXES {
            for angle in [1e-9, 0.1, 1.0, 3.1, -2.0] {
                let pose = pose(about(axis, angle));
                let off = length(minus(pose.turned(V), rodrigues(axis, angle, V)));
                assert!(off < 1e-14, "{angle} about {axis:?}: off by {off:e}");
                let off = length(minus(pose.turned_back(pose.turned(V)), V));
                assert!(off < 1e-14, "{angle} about {axis:?}, and back: off by {off:e}");
            }
        }
        assert_eq!(pose(Pose::NO_TURN).turned(V), V);
    }

    #[test]
    fn between_two_turns_about_an_axis_angles_are_shares() {
        for axis in AXES {
            for (from, to) in [(0.0, 1.0), (0.4, 0.4 + 1e-7), (-1.0, 2.0), (0.0, 3.1)] {
                for share in [0.0, 0.25, 0.5, 0.9, 1.0] {
                    let found = pose(about(axis, from)).between(&pose(about(axis, to)), share);
                    let expected = rodrigues(axis, from + share * (to - from), V);
                    let off = length(minus(found.turned(V), expected));
                    assert!(off < 4e-14, "{from} to {to}, {share}: off by {off:e}");
                    assert!((turn_length(found.turn) - 1.0).abs() < 1e-15);
                }
            }
        }
    }

    #[test]
    fn the_shorter_arc_is_taken_whichever_sign_a_quaternion_has() {
        let [from, to] = [0.2, 0.8].map(|angle| about(AXES[2], angle));
        let half = pose(about(AXES[2], 0.5)).turned(V);
        for to in [to, to.map(|c| -c)] {
            let off = length(minus(pose(from).between(&pose(to), 0.5).turned(V), half));
            assert!(off < 1e-14, "{to:?}: off by {off:e}");
        }
        // More than half a turn goes the other way round.
        let far = pose(Pose::NO_TURN).between(&pose(about(AXES[0], 4.0)), 0.5);
        let expected = rodrigues(AXES[0], 0.5 * (4.0 - std::f64::consts::TAU), V);
        assert!(length(minus(far.turned(V), expected)) < 1e-14);
    }

    #[test]
    fn the_angle_between_poses_is_along_the_axis_in_the_world() {
        let [from, to] = [0.3, 1.5].map(|angle| pose(about(AXES[1], angle)));
        let angle = from.angle_to(&to);
        let off = length(minus(angle, AXES[1].map(|c| 1.2 * c)));
        assert!(off < 1e-14, "{angle:?}");
        assert_eq!(from.angle_to(&from), [0.0; 3]);
    }
}

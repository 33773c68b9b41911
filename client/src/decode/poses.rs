//! Poses of colliders in a frame.
//!
//! Enters: `v1::ColliderPose`, from a server that is not trusted. Leaves: [`ColliderPose`]s of colliders that are there, each
//! once, with finite positions and turns of length 1.

use std::collections::HashSet;

use nappe_proto::v1;

use super::error::DecodeError;
use crate::{collider::components, pose::ColliderPose};

/// How far the length of a turn may be from 1.
const UNIT_TOLERANCE: f64 = 1e-6;
/// The turn of what is not turned.
const NO_TURN: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

/// Reads the poses of a frame; `known` are the names of colliders, where a topology told them.
pub(super) fn read(
    wire: &[v1::ColliderPose],
    frame: u64,
    known: Option<&HashSet<String>>,
) -> Result<Vec<ColliderPose>, DecodeError> {
    let mut named = HashSet::new();
    let mut poses = Vec::with_capacity(wire.len());
    for v1::ColliderPose { name, position, turn } in wire {
        let (position, turn) = (components(*position), turn.map_or(NO_TURN, Into::into));
        let length = turn.iter().map(|c| c * c).sum::<f64>().sqrt();
        let wrong = if known.is_some_and(|known| !known.contains(name)) {
            Some("no collider has this name")
        } else if !named.insert(name) {
            Some("it comes twice")
        } else if !position.iter().all(|c| c.is_finite()) {
            Some("its position is not finite")
        } else if length.is_nan() || (length - 1.0).abs() > UNIT_TOLERANCE {
            Some("its turn is not of length 1")
        } else {
            None
        };
        if let Some(what) = wrong {
            return Err(DecodeError::Pose { frame, collider: name.clone(), what });
        }
        poses.push(ColliderPose { name: name.clone(), position, turn });
    }
    Ok(poses)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_that_no_collider_can_have_are_refused() {
        let known = HashSet::from(["box".to_owned(), "lid".to_owned()]);
        let pose = |name: &str, x: f64, turn: [f64; 4]| v1::ColliderPose {
            name: name.to_owned(),
            position: Some([x, 2.0, 3.0].into()),
            turn: Some(turn.into()),
        };
        let turn = [0.0, 0.6, 0.0, 0.8];
        let good = [pose("lid", 1.0, turn), pose("box", 1.0, NO_TURN)];
        assert_eq!(read(&good, 3, Some(&known)).map(|poses| poses.len()), Ok(2));
        for (poses, part) in [
            (vec![pose("it", 1.0, turn)], "no collider has this name"),
            (vec![pose("lid", 1.0, turn), pose("lid", 1.0, turn)], "twice"),
            (vec![pose("box", f64::NAN, turn)], "not finite"),
            (vec![pose("box", 1.0, [0.0; 4])], "length 1"),
            (vec![pose("box", 1.0, [0.0, 0.0, 0.0, 1.0 + 2e-6])], "length 1"),
            (vec![pose("box", 1.0, [f64::NAN; 4])], "length 1"),
        ] {
            let refused = read(&poses, 3, Some(&known)).expect_err("it is bad").to_string();
            assert!(refused.contains(part), "{refused}, not {part}");
        }
        assert!(
            read(&[pose("it", 1.0, turn)], 3, None).is_ok(),
            "no topology says which colliders there are"
        );
    }
}

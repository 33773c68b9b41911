//! Where a collider is at the time of a frame, and how it is turned.
//!
//! Enters: nothing. Leaves: [`ColliderPose`], filled by `decode`, which says where points of the collider are.

/// A pose of a collider that keys of the scene or calls move.
#[derive(Debug, Clone, PartialEq)]
pub struct ColliderPose {
    /// The collider's name in the scene.
    pub name: String,
    /// Position of its reference point (m).
    pub position: [f64; 3],
    /// How it is turned since time 0: a quaternion x, y, z, w of length 1.
    pub turn: [f64; 4],
}

impl ColliderPose {
    /// Where a direction of the collider at time 0 points now.
    pub fn turned(&self, direction: [f64; 3]) -> [f64; 3] {
        let [x, y, z, w] = self.turn;
        let across = cross([x, y, z], direction).map(|c| 2.0 * c);
        let inward = cross([x, y, z], across);
        [0, 1, 2].map(|c| direction[c] + w * across[c] + inward[c])
    }

    /// Where a point (m) of the collider at time 0 is now, if its reference point is at `reference` (m) at time 0.
    pub fn moved(&self, point: [f64; 3], reference: [f64; 3]) -> [f64; 3] {
        let turned = self.turned([0, 1, 2].map(|c| point[c] - reference[c]));
        [0, 1, 2].map(|c| self.position[c] + turned[c])
    }
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_point_goes_along_with_the_turn_about_the_reference_point() {
        // A quarter about y takes x to -z.
        let half = 0.5_f64.sqrt();
        let turn = [0.0, half, 0.0, half];
        let pose = ColliderPose { name: "box".to_owned(), position: [5.0, 6.0, 7.0], turn };
        let near = |a: [f64; 3], b: [f64; 3]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-15);
        assert!(near(pose.turned([1.0, 2.0, 0.0]), [0.0, 2.0, -1.0]));
        assert!(near(pose.moved([2.0, 3.0, 1.0], [1.0, 1.0, 1.0]), [5.0, 8.0, 6.0]));
    }
}

//! Turns and matrices as glTF has them: a matrix by its columns, a turn as a quaternion x, y, z, w.

/// A matrix by its four columns.
pub(super) type Matrix = [[f64; 4]; 4];

/// What changes nothing.
pub(super) const IDENTITY: Matrix =
    [[1.0, 0.0, 0.0, 0.0], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0], [0.0, 0.0, 0.0, 1.0]];

/// Where a node is in its parent: it is scaled, then turned, then moved.
#[derive(Clone, Copy, Debug)]
pub(super) struct Parts {
    /// (m)
    pub(super) translation: [f64; 3],
    /// A quaternion, of any length but 0.
    pub(super) rotation: [f64; 4],
    pub(super) scale: [f64; 3],
}

impl Parts {
    /// The matrix that does the same.
    pub(super) fn matrix(&self) -> Matrix {
        let [x, y, z, w] = unit(self.rotation);
        let turn = [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ];
        let column = |c: usize| {
            let [x, y, z] = turn[c].map(|number| number * self.scale[c]);
            [x, y, z, 0.0]
        };
        let [x, y, z] = self.translation;
        [column(0), column(1), column(2), [x, y, z, 1.0]]
    }
}

/// The product of two matrices: what `b` does, and then what `a` does.
pub(super) fn product(a: &Matrix, b: &Matrix) -> Matrix {
    b.map(|column| std::array::from_fn(|row| (0..4).map(|k| a[k][row] * column[k]).sum::<f64>()))
}

/// Where a matrix takes a point.
pub(super) fn place(a: &Matrix, [x, y, z]: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|row| a[0][row] * x + a[1][row] * y + a[2][row] * z + a[3][row])
}

/// Numbers on the straight line from `a` to `b`.
pub(super) fn straight<const N: usize>(a: [f64; N], b: [f64; N], share: f64) -> [f64; N] {
    std::array::from_fn(|c| (1.0 - share) * a[c] + share * b[c])
}

/// A turn on the shortest way from `a` to `b`, at a constant speed.
pub(super) fn turned(a: [f64; 4], b: [f64; 4], share: f64) -> [f64; 4] {
    let (a, mut b) = (unit(a), unit(b));
    if dot(a, b) < 0.0 {
        b = b.map(|c| -c);
    }
    let [apart, along] = [-1.0, 1.0].map(|sign| {
        let sum: [f64; 4] = std::array::from_fn(|c| a[c] + sign * b[c]);
        dot(sum, sum).sqrt()
    });
    let angle = 2.0 * apart.atan2(along);
    if angle < 1e-9 {
        return unit(straight(a, b, share));
    }
    let [of_a, of_b] = [1.0 - share, share].map(|part| (part * angle).sin() / angle.sin());
    std::array::from_fn(|c| of_a * a[c] + of_b * b[c])
}

/// A quaternion of the length 1 in the same direction; no turn where it has none.
fn unit(q: [f64; 4]) -> [f64; 4] {
    let length = dot(q, q).sqrt();
    if length > 0.0 { q.map(|c| c / length) } else { [0.0, 0.0, 0.0, 1.0] }
}

fn dot(a: [f64; 4], b: [f64; 4]) -> f64 {
    a.iter().zip(&b).map(|(a, b)| a * b).sum()
}

#[cfg(test)]
mod tests {
    use std::f64::consts::FRAC_PI_2;

    use super::*;

    /// A turn about an axis of the length 1.
    fn about([x, y, z]: [f64; 3], angle: f64) -> [f64; 4] {
        let (sin, cos) = (0.5 * angle).sin_cos();
        [sin * x, sin * y, sin * z, cos]
    }

    fn assert_near<const N: usize>(found: [f64; N], expected: [f64; N]) {
        for (found_c, expected_c) in found.iter().zip(&expected) {
            assert!((found_c - expected_c).abs() < 1e-14, "{found:?}, not {expected:?}");
        }
    }

    #[test]
    fn a_node_is_scaled_then_turned_then_moved() {
        let rotation = about([0.0, 0.0, 1.0], FRAC_PI_2).map(|c| 3.0 * c);
        let parts = Parts { translation: [1.0, 2.0, 3.0], rotation, scale: [2.0, 3.0, 4.0] };
        let matrix = parts.matrix();
        assert_near(place(&matrix, [1.0, 1.0, 1.0]), [-2.0, 4.0, 7.0]);
        let twice = product(&matrix, &matrix);
        assert_near(place(&twice, [1.0, 1.0, 1.0]), place(&matrix, [-2.0, 4.0, 7.0]));
        assert_near(place(&product(&IDENTITY, &matrix), [0.5, 0.0, 0.0]), place(&matrix, [0.5, 0.0, 0.0]));
    }

    #[test]
    fn a_turn_goes_the_shortest_way_at_a_constant_speed() {
        let axis = [0.6, 0.0, 0.8];
        let (from, to) = (about(axis, 0.2), about(axis, 1.4));
        for share in [0.0, 0.25, 0.5, 1.0] {
            let expected = about(axis, 0.2 + 1.2 * share);
            assert_near(turned(from, to, share), expected);
            assert_near(turned(from, to.map(|c| -c), share), expected);
        }
        assert_near(turned(from, from, 0.5), from);
    }
}

//! Eigenvalues of a real matrix: the QR iteration with the double shifts of Francis on its Hessenberg form.
//!
//! As `hqr` of EISPACK (Martin, Peters and Wilkinson 1970), where shifts enter as differences. The iteration of nalgebra
//! multiplies them out, and never ends where many eigenvalues are equal, as those of particles that the medium drags.

use nalgebra::{DMatrix, Hessenberg};

/// Sweeps for one or two eigenvalues, at most.
const SWEEPS: u32 = 60;
/// After so many without success the shifts are others.
const STUCK: u32 = 10;

/// Eigenvalues of a square matrix, real and imaginary part, as exact as rounding of its norm; none where they are not
/// found.
pub(crate) fn eigenvalues(matrix: DMatrix<f64>) -> Option<Vec<[f64; 2]>> {
    if matrix.is_empty() {
        return Some(Vec::new());
    }
    let mut h = Hessenberg::new(matrix).unpack_h();
    let small = f64::EPSILON * h.norm();
    let mut found = Vec::with_capacity(h.nrows());
    let (mut left, mut taken_off, mut sweeps) = (h.nrows(), 0.0, 0);
    while left > 0 {
        let last = left - 1;
        let first = first_of_block(&mut h, last, small);
        let count = left - first;
        if count > 2 {
            if sweeps == SWEEPS {
                return None;
            }
            let is_stuck = sweeps > 0 && sweeps % STUCK == 0;
            let shifts = if is_stuck { other_shifts(&mut h, last, &mut taken_off) } else { shifts(&h, last) };
            sweep(&mut h, [first, last], shifts);
            sweeps += 1;
            continue;
        }
        if count == 2 {
            found.extend(pair(&h, last).map(|[re, im]| [re + taken_off, im]));
        } else {
            found.push([h[(last, last)] + taken_off, 0.0]);
        }
        (left, sweeps) = (first, 0);
    }
    Some(found)
}

/// Where the block begins that ends with a row, and that no zero below the diagonal divides.
fn first_of_block(h: &mut DMatrix<f64>, last: usize, small: f64) -> usize {
    let mut first = last;
    while first > 0 {
        if h[(first, first - 1)].abs() <= small {
            h[(first, first - 1)] = 0.0;
            break;
        }
        first -= 1;
    }
    first
}

/// The eigenvalues of the two rows that end with `last`.
fn pair(h: &DMatrix<f64>, last: usize) -> [[f64; 2]; 2] {
    let [x, y, product] = shifts(h, last);
    let half = 0.5 * (y - x);
    let square = half * half + product;
    let root = square.abs().sqrt();
    if square < 0.0 {
        return [[x + half, root], [x + half, -root]];
    }
    let far = half + root.copysign(half);
    let near = if far == 0.0 { x } else { x - product / far };
    [[x + far, 0.0], [near, 0.0]]
}

/// What the shifts follow from: the last two numbers of the diagonal, and the product of those beside it.
fn shifts(h: &DMatrix<f64>, last: usize) -> [f64; 3] {
    let product = h[(last, last - 1)] * h[(last - 1, last)];
    [h[(last, last)], h[(last - 1, last - 1)], product]
}

/// Others, where the iteration makes no progress; what they take off the diagonal is kept.
fn other_shifts(h: &mut DMatrix<f64>, last: usize, taken_off: &mut f64) -> [f64; 3] {
    let x = h[(last, last)];
    *taken_off += x;
    for i in 0..=last {
        h[(i, i)] -= x;
    }
    let size = h[(last, last - 1)].abs() + h[(last - 1, last - 2)].abs();
    [0.75 * size, 0.75 * size, -0.4375 * size * size]
}

/// A sweep over the rows of a block, by reflections of three rows and columns at a time.
fn sweep(h: &mut DMatrix<f64>, [first, last]: [usize; 2], shifts: [f64; 3]) {
    let (begin, mut axis) = begin(h, [first, last], shifts);
    for row in begin + 2..=last {
        h[(row, row - 2)] = 0.0;
        if row > begin + 2 {
            h[(row, row - 3)] = 0.0;
        }
    }
    for k in begin..last {
        let mut size = 1.0;
        if k > begin {
            let third = if k + 1 < last { h[(k + 2, k - 1)] } else { 0.0 };
            axis = [h[(k, k - 1)], h[(k + 1, k - 1)], third];
            size = axis.iter().map(|c| c.abs()).sum();
            if size == 0.0 {
                continue;
            }
            axis = axis.map(|c| c / size);
        }
        let length = axis.iter().map(|c| c * c).sum::<f64>().sqrt().copysign(axis[0]);
        if length == 0.0 {
            continue;
        }
        if k > begin {
            h[(k, k - 1)] = -length * size;
        } else if begin > first {
            h[(k, k - 1)] = -h[(k, k - 1)];
        }
        reflect(h, k, [first, last], axis, length);
    }
}

/// The row of a block that a sweep begins with, the last before which what is left out is rounding, and what its first
/// reflection turns.
fn begin(h: &DMatrix<f64>, [first, last]: [usize; 2], [x, y, product]: [f64; 3]) -> (usize, [f64; 3]) {
    let mut row = last - 2;
    loop {
        let own = h[(row, row)];
        let (r, s) = (x - own, y - own);
        let next = h[(row + 1, row + 1)];
        let axis = [
            (r * s - product) / h[(row + 1, row)] + h[(row, row + 1)],
            next - own - r - s,
            h[(row + 2, row + 1)],
        ];
        let size: f64 = axis.iter().map(|c| c.abs()).sum();
        let axis = axis.map(|c| c / size);
        if row == first {
            return (row, axis);
        }
        let left_out = h[(row, row - 1)].abs() * (axis[1].abs() + axis[2].abs());
        let beside = h[(row - 1, row - 1)].abs() + own.abs() + next.abs();
        if left_out <= f64::EPSILON * axis[0].abs() * beside {
            return (row, axis);
        }
        row -= 1;
    }
}

/// Reflects the rows and columns from `k` on, three of them or the last two of a block.
fn reflect(h: &mut DMatrix<f64>, k: usize, [first, last]: [usize; 2], [p, q, r]: [f64; 3], length: f64) {
    let has_third = k + 1 < last;
    let p = p + length;
    let [x, y, z] = [p / length, q / length, r / length];
    let (q, r) = (q / p, r / p);
    for j in k..=last {
        let mut sum = h[(k, j)] + q * h[(k + 1, j)];
        if has_third {
            sum += r * h[(k + 2, j)];
            h[(k + 2, j)] -= sum * z;
        }
        h[(k + 1, j)] -= sum * y;
        h[(k, j)] -= sum * x;
    }
    for i in first..=last.min(k + 3) {
        let mut sum = x * h[(i, k)] + y * h[(i, k + 1)];
        if has_third {
            sum += z * h[(i, k + 2)];
            h[(i, k + 2)] -= sum * r;
        }
        h[(i, k + 1)] -= sum * q;
        h[(i, k)] -= sum;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Asserts that eigenvalues are those expected, in any order, within a distance.
    fn check(matrix: DMatrix<f64>, expected: &[[f64; 2]], within: f64) {
        let mut found = eigenvalues(matrix).expect("they are found");
        assert_eq!(found.len(), expected.len());
        for [re, im] in expected {
            let distance = |[a, b]: [f64; 2]| (a - re).hypot(b - im);
            let nearest = (0..found.len()).min_by(|a, b| distance(found[*a]).total_cmp(&distance(found[*b])));
            let nearest = found.swap_remove(nearest.expect("as many as expected"));
            assert!(distance(nearest) <= within, "{nearest:?} is nearest to {re} {im:+} i");
        }
    }

    #[test]
    fn eigenvalues_of_a_mixed_matrix_are_those_of_its_blocks_however_many_are_equal() {
        // Damped and undamped pairs, twelve equal rates, and rest: as a sheet in a medium has.
        let mut expected = vec![[-0.05, 0.0]; 12];
        expected.extend([[0.0; 2]; 5]);
        let pairs = [[-1e-3, 0.02], [0.0, 0.9], [-0.3, 0.4], [-0.3, 0.4], [0.0, 1e-4]];
        expected.extend(pairs.iter().flat_map(|[re, im]| [[*re, *im], [*re, -im]]));
        let count = expected.len();
        let mut matrix = DMatrix::<f64>::zeros(count, count);
        for (i, [re, im]) in expected.iter().enumerate() {
            matrix[(i, i)] = *re;
            if *im > 0.0 {
                matrix[(i, i + 1)] = *im;
                matrix[(i + 1, i)] = -im;
            }
        }
        let mut rng = fastrand::Rng::with_seed(1);
        for _ in 0..3 {
            let axis = DMatrix::from_fn(count, 1, |_, _| rng.f64() - 0.5);
            let mirror = &axis * axis.transpose() * (2.0 / axis.norm_squared());
            let mirror = DMatrix::<f64>::identity(count, count) - mirror;
            matrix = &mirror * matrix * &mirror;
        }
        check(matrix, &expected, 1e-13);
    }

    #[test]
    fn the_roots_of_a_polynomial_are_the_eigenvalues_of_its_companion_matrix() {
        // (z - 1)(z - 2)(z - 3)(z - 4) = z^4 - 10 z^3 + 35 z^2 - 50 z + 24
        let rows = [10.0, -35.0, 50.0, -24.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0];
        let expected = [[1.0, 0.0], [2.0, 0.0], [3.0, 0.0], [4.0, 0.0]];
        check(DMatrix::from_row_slice(4, 4, &rows), &expected, 1e-11);
    }

    #[test]
    fn a_turn_of_the_axes_has_the_roots_of_one() {
        let turn = DMatrix::from_row_slice(3, 3, &[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]);
        let half = 0.75_f64.sqrt();
        check(turn, &[[1.0, 0.0], [-0.5, half], [-0.5, -half]], 1e-14);
    }
}

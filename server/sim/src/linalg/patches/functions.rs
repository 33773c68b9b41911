//! The soft functions of a patch: what an elimination of its own matrix leaves.
//!
//! N is the matrix of the springs, elements and masses within the patch, D the diagonal blocks of the whole matrix, and
//! S = W N Wᵀ with Wᵀ W = D⁻¹. The largest diagonal entries of S are eliminated while they are at least
//! [`STIFF`]. What is left over are the masters m; T = [I; -S_ee⁻¹ S_em] is what the others e do for each, and P = Wᵀ T are
//! the functions: whatever is at right angles to them costs energy, 1 / [`STIFF`] times less at most than D says.

use super::{choose::MOST, singles::Singles};
use crate::math::{LANES, Pack, WithSimd, dispatch};

/// The least pivot that is eliminated, relative to the diagonal blocks.
const STIFF: f64 = 0.1;
/// Numbers of a patch, at most.
pub(super) const ROWS: usize = 3 * MOST;
/// The same with room for whole packs.
pub(super) const WIDTH: usize = 2 * LANES;

/// A square matrix of the numbers of a patch; 0 beyond them.
pub(super) type Square = [[f64; WIDTH]; ROWS];

/// The soft functions of one patch.
pub(super) struct Soft {
    /// How many numbers the patch has, and how many functions.
    pub(super) rows: usize,
    pub(super) count: usize,
    /// P by rows.
    pub(super) functions: Square,
    /// Pᵀ N P.
    pub(super) within: Square,
}

/// Eliminates N, by rows, of a patch of as many rows as there are roots W; `roots` are those, lower triangles.
pub(super) fn soften(matrix: &[f64], roots: &[[[f64; 3]; 3]], soft: &mut Soft) {
    soft.rows = 3 * roots.len();
    dispatch::<f64, _>(Soften { matrix, roots, soft });
}

struct Soften<'a> {
    matrix: &'a [f64],
    roots: &'a [[[f64; 3]; 3]],
    soft: &'a mut Soft,
}

impl WithSimd<f64> for Soften<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) {
        let Self { matrix, roots, soft } = self;
        let rows = soft.rows;
        let mut s = [[0.0; WIDTH]; ROWS];
        scale(matrix, roots, &mut s);
        let is_left = eliminate(&mut s, rows);

        let mut masters = [0; ROWS];
        let mut count = 0;
        for row in 0..rows {
            if is_left[row] {
                masters[count] = row;
                count += 1;
            }
        }
        soft.count = count;
        soft.functions = [[0.0; WIDTH]; ROWS];
        soft.within = [[0.0; WIDTH]; ROWS];
        // T: eliminated rows now hold S_ee⁻¹ S_em.
        let mut t = [[0.0; WIDTH]; ROWS];
        for k in 0..count {
            for row in 0..rows {
                let of_other = if row == masters[k] { 1.0 } else { 0.0 };
                t[row][k] = if is_left[row] { of_other } else { 0.0 - s[row][masters[k]] };
            }
            for j in 0..=k {
                // Rounding must not make it unsymmetric.
                let entry = s[masters[k]][masters[j]];
                soft.within[k][j] = entry;
                soft.within[j][k] = entry;
            }
        }
        for (member, root) in roots.iter().enumerate() {
            for c in 0..3 {
                for g in c..3 {
                    for k in 0..WIDTH {
                        soft.functions[3 * member + c][k] += root[g][c] * t[3 * member + g][k];
                    }
                }
            }
        }
    }
}

/// S = W N Wᵀ.
#[inline(always)]
fn scale(matrix: &[f64], roots: &[[[f64; 3]; 3]], s: &mut Square) {
    let rows = 3 * roots.len();
    for (member, root) in roots.iter().enumerate() {
        for c in 0..3 {
            let row = 3 * member + c;
            for g in 0..=c {
                let from = &matrix[(3 * member + g) * rows..(3 * member + g + 1) * rows];
                for (to, from) in s[row].iter_mut().zip(from) {
                    *to += root[c][g] * from;
                }
            }
        }
    }
    for row in &mut s[..rows] {
        for (member, root) in roots.iter().enumerate() {
            let [x, y, z] = [row[3 * member], row[3 * member + 1], row[3 * member + 2]];
            for c in 0..3 {
                row[3 * member + c] = root[c][0] * x + root[c][1] * y + root[c][2] * z;
            }
        }
    }
}

/// Eliminates the largest diagonal entries by Gauss and Jordan, of equal ones the first: rows of those that are eliminated
/// then hold S_ee⁻¹ S_em in the columns of the others, and rows of the others what is left of S. Tells who is left.
#[inline(always)]
fn eliminate(s: &mut Square, rows: usize) -> [bool; ROWS] {
    let mut is_left = [true; ROWS];
    loop {
        let (mut pivot, mut largest) = (rows, 0.0);
        for row in 0..rows {
            if is_left[row] && s[row][row] > largest {
                (pivot, largest) = (row, s[row][row]);
            }
        }
        if pivot == rows || largest < STIFF || !largest.is_finite() {
            return is_left;
        }
        is_left[pivot] = false;
        let inverse = 1.0 / largest;
        let mut own = s[pivot];
        for entry in &mut own {
            *entry *= inverse;
        }
        s[pivot] = own;
        for row in 0..rows {
            let factor = s[row][pivot];
            if row != pivot && factor != 0.0 {
                for column in 0..WIDTH {
                    s[row][column] -= factor * own[column];
                }
            }
        }
    }
}

impl Soft {
    /// Room for any patch.
    pub(super) fn new() -> Self {
        let none = [[0.0; WIDTH]; ROWS];
        Self { rows: 0, count: 0, functions: none, within: none }
    }

    /// Adds P_iᵀ A P_j to Pᵀ N P, of two members and a block A between them, by rows.
    pub(super) fn add(&mut self, [i, j]: [usize; 2], a: &[[f64; 3]; 3]) {
        dispatch::<f64, _>(Add { soft: self, ends: [i, j], a });
    }

    /// Scales the functions such that each of them has an energy of 1, where that is a number: else it is left out.
    pub(super) fn normalise(&mut self) {
        let mut scales = [0.0; WIDTH];
        for k in 0..self.count {
            let energy = self.within[k][k];
            scales[k] = if energy > 0.0 && energy.is_finite() { 1.0 / energy.sqrt() } else { 0.0 };
        }
        let finite = |number: f64| if number.is_finite() { number } else { 0.0 };
        for row in &mut self.functions[..self.rows] {
            for k in 0..self.count {
                row[k] = finite(row[k] * scales[k]);
            }
        }
        for i in 0..self.count {
            for k in 0..self.count {
                self.within[i][k] = finite(self.within[i][k] * (scales[i] * scales[k]));
            }
        }
    }

    /// Packs that hold the functions of a number.
    pub(super) fn width(&self) -> usize {
        width(self.count)
    }

    /// Appends the functions, by rows in whole packs.
    pub(super) fn append(&self, to: &mut Vec<Singles>) {
        for row in &self.functions[..self.rows] {
            for pack in 0..self.width() {
                let mut lanes = [0.0; LANES];
                for lane in 0..LANES {
                    lanes[lane] = row[pack * LANES + lane] as f32;
                }
                to.push(Singles(lanes));
            }
        }
    }
}

/// Packs that so many functions take.
pub(super) fn width(count: usize) -> usize {
    count.div_ceil(LANES)
}

struct Add<'a> {
    soft: &'a mut Soft,
    ends: [usize; 2],
    a: &'a [[f64; 3]; 3],
}

impl WithSimd<f64> for Add<'_> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = f64>>(self) {
        let Self { soft, ends: [i, j], a } = self;
        for r in 0..3 {
            let mut pushed = [0.0; WIDTH];
            for c in 0..3 {
                for k in 0..WIDTH {
                    pushed[k] += a[r][c] * soft.functions[3 * j + c][k];
                }
            }
            for k in 0..soft.count {
                let factor = soft.functions[3 * i + r][k];
                for q in 0..WIDTH {
                    soft.within[k][q] += factor * pushed[q];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use nalgebra::DMatrix;

    use super::{STIFF, Soft, soften};

    /// Springs without order between seven members, as a matrix.
    fn matrix(members: usize, mass: f64) -> DMatrix<f64> {
        let rows = 3 * members;
        let number = |i: usize| ((i * i * 7919 + 13 * i) % 1009) as f64 / 504.5 - 1.0;
        let mut a = DMatrix::from_diagonal_element(rows, rows, mass);
        for i in 0..members {
            for j in 0..i {
                let d = [0, 1, 2].map(|c| number(31 * i + 17 * j + 101 * c));
                for r in 0..3 {
                    for c in 0..3 {
                        let block = d[r] * d[c] + if r == c { 0.01 } else { 0.0 };
                        a[(3 * i + r, 3 * i + c)] += block;
                        a[(3 * j + r, 3 * j + c)] += block;
                        a[(3 * i + r, 3 * j + c)] -= block;
                        a[(3 * j + r, 3 * i + c)] -= block;
                    }
                }
            }
        }
        a
    }

    /// W of each member, Wᵀ W the inverse of its block.
    fn roots(a: &DMatrix<f64>) -> Vec<[[f64; 3]; 3]> {
        let of = |i: usize| {
            let block = a.fixed_view::<3, 3>(3 * i, 3 * i).into_owned();
            let w = block.cholesky().expect("positive definite").l().try_inverse().expect("a triangle");
            std::array::from_fn(|r| std::array::from_fn(|c| w[(r, c)]))
        };
        (0..a.nrows() / 3).map(of).collect()
    }

    fn entries(a: &DMatrix<f64>) -> Vec<f64> {
        a.transpose().as_slice().to_vec()
    }

    #[test]
    fn the_energy_of_the_functions_is_what_they_say_and_the_rest_is_stiff() {
        for (members, mass) in [(1, 0.1), (2, 1e-6), (7, 1e-3), (9, 1e-8)] {
            let a = matrix(members, mass);
            let roots = roots(&a);
            let mut soft = Soft::new();
            soften(&entries(&a), &roots, &mut soft);
            let (rows, count) = (3 * members, soft.count);
            assert!(count >= 1 || members == 1, "a soft mode is there: {count}");
            let p = DMatrix::from_fn(rows, count, |r, k| soft.functions[r][k]);
            let expected = p.transpose() * &a * &p;
            for i in 0..count {
                for j in 0..count {
                    let found = soft.within[i][j];
                    assert!((found - expected[(i, j)]).abs() < 1e-11, "{found} {}", expected[(i, j)]);
                    assert_eq!(found.to_bits(), soft.within[j][i].to_bits());
                }
                assert!(soft.within[i][i] < STIFF);
            }
        }
    }

    #[test]
    fn what_has_no_pivot_is_left_out_and_nothing_is_made_of_numbers_that_are_none() {
        let identity = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            let mut entries = vec![0.0; 36];
            (0..6).for_each(|i| entries[7 * i] = if i == 2 { bad } else { 0.05 });
            let mut soft = Soft::new();
            soften(&entries, &[identity; 2], &mut soft);
            soft.normalise();
            let is_zero = |k: usize| (0..6).all(|row| soft.functions[row][k] == 0.0);
            assert_eq!((0..soft.count).filter(|k| is_zero(*k)).count(), 1, "{bad}");
            assert!(soft.functions.iter().chain(&soft.within).flatten().all(|entry| entry.is_finite()));
        }
    }
}

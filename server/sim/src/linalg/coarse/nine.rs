//! The nine unknowns of an aggregate, and the 9 x 9 blocks between them.

use super::affine::Interpolation;
use crate::math::{Bytes, Real};

/// Three components of 1, of u and of v, one after another, each with a fourth number that is 0.
pub(crate) type Unknowns = [f64; 12];

/// A column of a block.
pub(crate) type Column = Unknowns;

/// A 9 x 9 block by columns: column 3 q + t belongs to component t of function q.
pub(crate) type NineByNine = [Column; 9];

/// Where an unknown is: that of component t of function q has column 3 q + t.
pub(super) const fn place(column: usize) -> usize {
    4 * (column / 3) + column % 3
}

/// The nine that are not always 0.
impl Bytes for Unknowns {
    const BYTES: usize = 9 * f64::BYTES;

    fn write(&self, bytes: &mut [u8]) {
        for (column, bytes) in bytes.as_chunks_mut().0.iter_mut().enumerate() {
            *bytes = self[place(column)].to_le_bytes();
        }
    }

    fn read(bytes: &[u8]) -> Self {
        let mut unknowns = [0.0; 12];
        for (column, bytes) in bytes.as_chunks().0.iter().enumerate() {
            unknowns[place(column)] = f64::from_le_bytes(*bytes);
        }
        unknowns
    }
}

impl Bytes for NineByNine {
    const BYTES: usize = 9 * Column::BYTES;

    fn write(&self, bytes: &mut [u8]) {
        for (column, bytes) in self.iter().zip(bytes.chunks_exact_mut(Column::BYTES)) {
            column.write(bytes);
        }
    }

    fn read(bytes: &[u8]) -> Self {
        std::array::from_fn(|column| Column::read(&bytes[column * Column::BYTES..][..Column::BYTES]))
    }
}

/// y += A x.
#[inline(always)]
pub(super) fn add_product(y: &mut Unknowns, a: &NineByNine, x: &Unknowns) {
    for column in 0..9 {
        let factor = x[place(column)];
        for row in 0..12 {
            y[row] += a[column][row] * factor;
        }
    }
}

/// y -= A x.
#[inline(always)]
pub(super) fn subtract_product(y: &mut Unknowns, a: &NineByNine, x: &Unknowns) {
    for column in 0..9 {
        let factor = x[place(column)];
        for row in 0..12 {
            y[row] -= a[column][row] * factor;
        }
    }
}

/// y += T x: what functions of a whole are on a part.
#[inline(always)]
pub(super) fn add_interpolated(y: &mut Unknowns, weights: &Interpolation, x: &Unknowns) {
    for m in 0..3 {
        for q in 0..3 {
            for c in 0..4 {
                y[4 * m + c] += weights[m][q] * x[4 * q + c];
            }
        }
    }
}

/// y += Tᵀ x.
#[inline(always)]
pub(super) fn add_gathered(y: &mut Unknowns, weights: &Interpolation, x: &Unknowns) {
    for m in 0..3 {
        for q in 0..3 {
            for c in 0..4 {
                y[4 * q + c] += weights[m][q] * x[4 * m + c];
            }
        }
    }
}

/// B += Sᵀ A T, with the interpolation S of the rows and T of the columns.
#[inline(always)]
pub(super) fn add_coarsened(
    b: &mut NineByNine,
    rows: &Interpolation,
    a: &NineByNine,
    columns: &Interpolation,
) {
    for q in 0..3 {
        for t in 0..3 {
            let mut column = [0.0; 12];
            for m in 0..3 {
                for row in 0..12 {
                    column[row] += a[3 * m + t][row] * columns[m][q];
                }
            }
            add_gathered(&mut b[3 * q + t], rows, &column);
        }
    }
}

/// A pivot below this part of its diagonal entry is none: its unknown is left at 0.
pub(super) const SMALLEST_PIVOT: f64 = 1e-12;

/// The inverse of a symmetric block, times `scale`. Unknowns without a positive pivot are left out: their rows and columns
/// are 0, and what remains is positive definite.
pub(super) fn scaled_inverse(a: &NineByNine, scale: f64) -> NineByNine {
    // A = L D Lᵀ, W = L⁻¹; both have ones on their diagonals.
    let (mut lower, mut inverse, mut pivots) = ([[0.0; 9]; 9], [[0.0; 9]; 9], [0.0; 9]);
    for j in 0..9 {
        let mut pivot = a[j][place(j)];
        for k in 0..j {
            pivot -= lower[j][k] * lower[j][k] * pivots[k];
        }
        let is_kept = pivot > SMALLEST_PIVOT * a[j][place(j)] && pivot.is_finite();
        if !is_kept {
            continue;
        }
        pivots[j] = pivot;
        inverse[j][j] = 1.0;
        for i in j + 1..9 {
            let mut entry = a[j][place(i)];
            for k in 0..j {
                entry -= lower[i][k] * lower[j][k] * pivots[k];
            }
            lower[i][j] = entry / pivot;
        }
    }
    for j in 0..9 {
        for i in j + 1..9 {
            for k in j..i {
                inverse[i][j] -= lower[i][k] * inverse[k][j];
            }
            if pivots[i] == 0.0 {
                inverse[i][j] = 0.0;
            }
        }
    }

    let mut result = [[0.0; 12]; 9];
    for i in 0..9 {
        for j in 0..=i {
            let mut entry = 0.0;
            for k in i..9 {
                entry += if pivots[k] > 0.0 { inverse[k][i] * inverse[k][j] / pivots[k] } else { 0.0 };
            }
            result[i][place(j)] = scale * entry;
            result[j][place(i)] = scale * entry;
        }
    }
    result
}

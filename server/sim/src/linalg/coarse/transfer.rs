//! Between the rows of a block and the unknowns of its aggregates.

use super::nine::Unknowns;
use crate::{
    linalg::sixteens::add_lanes,
    math::{LANES, Pack, Real, Sixteen, WithSimd, dispatch, three},
};

/// 1, u and v in sixteen rows, each of its own aggregate; 0 in rows that nothing may change.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[repr(C, align(64))]
pub(super) struct RowFunctions {
    functions: [[f32; LANES]; 3],
    /// Which of the block's aggregates each row is in.
    pub(super) parts: [u8; LANES],
}

impl RowFunctions {
    /// Those of one row.
    #[inline(always)]
    pub(super) fn at(&self, lane: usize) -> [f64; 3] {
        let [one, u, v] = &self.functions;
        [f64::from(one[lane]), f64::from(u[lane]), f64::from(v[lane])]
    }

    /// Writes the functions of a row, and its aggregate among those of its block.
    pub(super) fn set(&mut self, lane: usize, functions: [f64; 3], part: u8) {
        for m in 0..3 {
            self.functions[m][lane] = functions[m] as f32;
        }
        self.parts[lane] = part;
    }

    /// The functions of one of `count` aggregates, 0 in rows of the others.
    #[inline(always)]
    fn of_part<P: Pack>(&self, part: usize, count: usize) -> [P; 3] {
        let functions = three!(|m| P::from_singles(&self.functions[m]));
        if count == 1 {
            return functions;
        }
        let mut is_member = [0.0; LANES];
        for lane in 0..LANES {
            is_member[lane] = if usize::from(self.parts[lane]) == part { 1.0 } else { 0.0 };
        }
        let is_member = P::from_singles(&is_member);
        three!(|m| functions[m] * is_member)
    }
}

/// Pᵀ r of the aggregates of a block.
pub(super) fn restrict<R: Real>(rows: &[RowFunctions], r: &[Sixteen<R>], to: &mut [Unknowns]) {
    dispatch(Restrict { rows, r, to });
}

struct Restrict<'a, R> {
    rows: &'a [RowFunctions],
    r: &'a [Sixteen<R>],
    to: &'a mut [Unknowns],
}

impl<R: Real> WithSimd<R> for Restrict<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let count = self.to.len();
        for (part, unknowns) in self.to.iter_mut().enumerate() {
            let mut sums = [[P::zero(); 3]; 3];
            for (rows, r) in self.rows.iter().zip(self.r) {
                let (functions, r) = (rows.of_part::<P>(part, count), r.load::<P>());
                for m in 0..3 {
                    for c in 0..3 {
                        sums[m][c] += r[c] * functions[m];
                    }
                }
            }
            for m in 0..3 {
                for c in 0..3 {
                    unknowns[4 * m + c] = add_lanes(sums[m][c].widen().store());
                }
            }
        }
    }
}

/// z += P c of a block.
pub(super) fn prolong<R: Real>(rows: &[RowFunctions], change: &[Unknowns], z: &mut [Sixteen<R>]) {
    dispatch(Prolong { rows, change, z });
}

struct Prolong<'a, R> {
    rows: &'a [RowFunctions],
    change: &'a [Unknowns],
    z: &'a mut [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for Prolong<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let count = self.change.len();
        for (part, change) in self.change.iter().enumerate() {
            let mut factors = [[P::zero(); 3]; 3];
            for m in 0..3 {
                for c in 0..3 {
                    factors[m][c] = P::of(change[4 * m + c]);
                }
            }
            let [of_one, of_u, of_v] = factors;
            for (rows, z) in self.rows.iter().zip(self.z.iter_mut()) {
                let ([one, u, v], old) = (rows.of_part::<P>(part, count), z.load::<P>());
                z.store(three!(|c| old[c] + one * of_one[c] + u * of_u[c] + v * of_v[c]));
            }
        }
    }
}

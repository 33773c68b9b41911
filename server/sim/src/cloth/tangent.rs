//! The matrix of an implicit step: A = M - h df/dv - h² df/dx, and what goes with it.
//!
//! Reads positions (m) and laws; applies A without storing it, or assembles it; writes the
//! right-hand side h (f + h df/dx v) and the diagonal blocks. Rows of pins are 0: a pin's change
//! of velocity is 0, its velocity is prescribed.

use rayon::prelude::*;

use super::{
    forces::{Transverse, tangent_block, tangent_on},
    model::Model,
    rows::{Edge, LANES, Rows},
    state::{Frozen, State},
};
use crate::{
    linalg::{BlockCsr, LinearOperator, PreconditionerKind, Symmetric3},
    math::{Mat3, Real, Vec3},
    parallel::{Kernel, dispatch},
};

/// The matrix of a step at positions `x`.
#[derive(Clone, Copy)]
pub(super) struct Tangent<'a, R: Real, T> {
    pub(super) model: &'a Model<R>,
    pub(super) frozen: &'a Frozen<R>,
    pub(super) x: &'a [Vec3<R>],
    /// Time step (s).
    pub(super) dt: R,
    pub(super) transverse: T,
}

impl<R: Real, T: Transverse> LinearOperator<R> for Tangent<'_, R, T> {
    fn apply(&self, first_row: usize, p: &[Vec3<R>], out: &mut [Vec3<R>]) {
        dispatch(Product { tangent: *self, first_row, p, out });
    }
}

struct Product<'a, R: Real, T> {
    tangent: Tangent<'a, R, T>,
    first_row: usize,
    p: &'a [Vec3<R>],
    out: &'a mut [Vec3<R>],
}

impl<R: Real, T: Transverse> Kernel for Product<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Tangent { model, frozen, x, dt, transverse } = self.tangent;
        let drag = dt * frozen.drag;
        for rows in Rows::<R>::groups(self.first_row..self.first_row + self.out.len()) {
            let fold = |sum: &mut [R; 3], edge| tangent_on(sum, edge, transverse);
            let fields = [x, self.p];
            let sums =
                model.rows.fold_group(rows.start, fields, &frozen.implicit_laws, Default::default(), fold);
            for (lane, i) in rows.enumerate() {
                let springs = Vec3::new(sums[0][lane], sums[1][lane], sums[2][lane]);
                let free = if model.inv_m[i] > R::zero() { R::one() } else { R::zero() };
                self.out[i - self.first_row] = (springs + self.p[i] * (model.m[i] + drag)) * free;
            }
        }
    }
}

impl<R: Real, T: Transverse> Tangent<'_, R, T> {
    /// b = h (f + m g + h df/dx v), 0 for pins; `f` holds the forces without gravity.
    pub(super) fn right_hand_side(&self, v: &[Vec3<R>], f: &[Vec3<R>], b: &mut [Vec3<R>]) {
        let grain = self.model.grain;
        b.par_chunks_mut(grain).enumerate().for_each(|(block, b)| {
            dispatch(RightHandSide { tangent: *self, first_row: block * grain, v, f, b });
        });
    }

    /// Inverse diagonal blocks for a preconditioner; where a block is not positive definite, the
    /// inverse of its mass alone.
    pub(super) fn invert_diagonal(&self, kind: PreconditionerKind, inverse: &mut [Symmetric3<R>]) {
        let grain = self.model.grain;
        inverse.par_chunks_mut(grain).enumerate().for_each(|(block, inverse)| {
            dispatch(DiagonalBlocks { tangent: *self, first_row: block * grain, out: inverse });
            for (i, block) in (block * grain..).zip(inverse.iter_mut()) {
                let inverted = match kind {
                    PreconditionerKind::BlockJacobi => block.inverse_if_positive(),
                    PreconditionerKind::Diagonal | PreconditionerKind::Identity => block.inverse_diagonal(),
                };
                *block = inverted.unwrap_or_else(|| Symmetric3::scalar(self.model.inv_m[i]));
            }
        });
    }

    /// Writes the matrix into `matrix`, made by [`pattern`].
    pub(super) fn assemble(&self, matrix: &mut BlockCsr<R>) {
        let Self { model, frozen, x, dt, transverse } = *self;
        matrix.fill_rows(&|i, columns, blocks| {
            blocks.fill(Mat3::zeros());
            if model.inv_m[i] == R::zero() {
                return;
            }
            let place = |j: u32| columns.binary_search(&j).expect("the pattern holds every spring");
            let diagonal = place(i as u32);
            blocks[diagonal] += Mat3::identity() * (model.m[i] + dt * frozen.drag);
            for (j, rest_length, law) in model.rows.row(i) {
                let d = x[i] - x[j as usize];
                let law = frozen.implicit_laws[law as usize];
                let edge = Edge { d: [d.x, d.y, d.z], w: [R::zero(); 3], rest_length, law };
                let [a, b] = tangent_block(&edge, transverse);
                let block = Mat3::identity() * a + d * d.transpose() * b;
                blocks[diagonal] += block;
                blocks[place(j)] -= block;
            }
        });
    }
}

/// Room for the matrix of a model.
pub(super) fn pattern<R: Real>(model: &Model<R>) -> BlockCsr<R> {
    BlockCsr::with_pattern((0..model.count).map(|i| model.rows.row(i).map(|(j, _, _)| j).collect()))
}

struct RightHandSide<'a, R: Real, T> {
    tangent: Tangent<'a, R, T>,
    first_row: usize,
    v: &'a [Vec3<R>],
    f: &'a [Vec3<R>],
    b: &'a mut [Vec3<R>],
}

impl<R: Real, T: Transverse> Kernel for RightHandSide<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Tangent { model, frozen, x, dt, transverse } = self.tangent;
        for rows in Rows::<R>::groups(self.first_row..self.first_row + self.b.len()) {
            // h² df/dx v, which leaves the damping out.
            let fold = |sum: &mut [R; 3], mut edge: Edge<R>| {
                edge.law[1] = R::zero();
                tangent_on(sum, edge, transverse);
            };
            let fields = [x, self.v];
            let sums =
                model.rows.fold_group(rows.start, fields, &frozen.implicit_laws, Default::default(), fold);
            for (lane, i) in rows.enumerate() {
                let stiff = Vec3::new(sums[0][lane], sums[1][lane], sums[2][lane]);
                let free = if model.inv_m[i] > R::zero() { R::one() } else { R::zero() };
                let force = self.f[i] + frozen.gravity * model.m[i];
                self.b[i - self.first_row] = (force * dt - stiff) * free;
            }
        }
    }
}

struct DiagonalBlocks<'a, R: Real, T> {
    tangent: Tangent<'a, R, T>,
    first_row: usize,
    out: &'a mut [Symmetric3<R>],
}

impl<R: Real, T: Transverse> Kernel for DiagonalBlocks<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Tangent { model, frozen, x, dt, transverse } = self.tangent;
        for rows in Rows::<R>::groups(self.first_row..self.first_row + self.out.len()) {
            let fold = |sum: &mut [R; 6], edge: Edge<R>| {
                let [a, b] = tangent_block(&edge, transverse);
                let [x, y, z] = edge.d;
                // A lane without a spring has d = 0 but would still add its a: it counts for nothing.
                let a = if x * x + y * y + z * z > R::zero() || edge.rest_length > R::zero() {
                    a
                } else {
                    R::zero()
                };
                let entries = [a + b * x * x, a + b * y * y, a + b * z * z, b * x * y, b * x * z, b * y * z];
                for c in 0..6 {
                    sum[c] += entries[c];
                }
            };
            let start = [[R::zero(); LANES]; 6];
            let sums = model.rows.fold_group(rows.start, [x, x], &frozen.implicit_laws, start, fold);
            for (lane, i) in rows.enumerate() {
                let own = model.m[i] + dt * frozen.drag;
                let [xx, yy, zz, xy, xz, yz] = sums.map(|sum| sum[lane]);
                self.out[i - self.first_row] =
                    Symmetric3 { xx: own + xx, yy: own + yy, zz: own + zz, xy, xz, yz };
            }
        }
    }
}

/// The matrix-free or the assembled operator of a step, and the state that it is of.
pub(super) fn tangent_at<'a, R: Real, T: Transverse>(
    model: &'a Model<R>,
    frozen: &'a Frozen<R>,
    state: &'a State<R>,
    dt: R,
    transverse: T,
) -> Tangent<'a, R, T> {
    Tangent { model, frozen, x: &state.x, dt, transverse }
}

//! The matrix of an implicit step: A = M - h df/dv - h² df/dx, and what goes with it.
//!
//! Reads positions (m) and laws; applies A without storing it, or assembles it; writes the
//! right-hand side h (f + h df/dx v) and the diagonal blocks. Rows of pins are 0: a pin's change
//! of velocity is 0, its velocity is prescribed.

use rayon::prelude::*;

use super::{
    forces::{BlockProduct, DiagonalBlock, ElasticBlockProduct, SpringBlock, Transverse, WithTransverse},
    model::Model,
    sell::{Sell, vectors},
    state::Frozen,
};
use crate::{
    linalg::{BlockCsr, Inverse3, LinearOperator, PreconditionerKind, Symmetric3},
    math::{Mat3, Pack, Padded, Real, Vec3, WithSimd, dispatch},
};

/// The matrix of a step at positions `x`.
#[derive(Clone, Copy)]
pub(super) struct StepOperator<'a, R: Real, T> {
    pub(super) model: &'a Model<R>,
    pub(super) frozen: &'a Frozen<R>,
    pub(super) x: &'a [Padded<R>],
    pub(super) transverse: T,
}

impl<R: Real, T: Transverse> LinearOperator<R> for StepOperator<'_, R, T> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], out: &mut [Vec3<R>]) {
        dispatch(Product { operator: *self, first_row, p, out });
    }
}

struct Product<'a, R: Real, T> {
    operator: StepOperator<'a, R, T>,
    first_row: usize,
    p: &'a [Padded<R>],
    out: &'a mut [Vec3<R>],
}

impl<R: Real, T: Transverse> WithSimd<R> for Product<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let StepOperator { model, frozen, x, transverse } = self.operator;
        let dt = R::of(frozen.dt);
        let (drag, zero) = (dt * frozen.drag, [P::zero(); 3]);
        for rows in Sell::<R>::groups(self.first_row..self.first_row + self.out.len()) {
            let fold = BlockProduct(transverse);
            let sums = model.springs.fold_group(rows.start, [x, self.p], &frozen.implicit_laws, zero, fold);
            for (springs, i) in vectors(sums).into_iter().zip(rows) {
                let free = if model.inv_m[i] > R::zero() { R::one() } else { R::zero() };
                self.out[i - self.first_row] = (springs + self.p[i].vector() * (model.m[i] + drag)) * free;
            }
        }
    }
}

impl<R: Real, T: Transverse> StepOperator<'_, R, T> {
    /// b = h (f + m g + h df/dx v), 0 for pins; `f` holds the forces without gravity.
    pub(super) fn right_hand_side(&self, v: &[Padded<R>], f: &[Vec3<R>], b: &mut [Vec3<R>]) {
        let block_size = self.model.block_size;
        b.par_chunks_mut(block_size).enumerate().for_each(|(block, b)| {
            dispatch(RightHandSide { operator: *self, first_row: block * block_size, v, f, b });
        });
    }

    /// Inverse diagonal blocks for a preconditioner; where a block is not positive definite, the
    /// inverse of its mass alone.
    pub(super) fn invert_diagonal(&self, kind: PreconditionerKind, inverse: &mut [Inverse3<R>]) {
        let (operator, block_size) = (*self, self.model.block_size);
        inverse.par_chunks_mut(block_size).enumerate().for_each(|(block, out)| {
            dispatch(InverseOfBlock { operator, kind, first_row: block * block_size, out });
        });
    }

    /// Writes the matrix into `matrix`, made by [`pattern`].
    pub(super) fn assemble(&self, matrix: &mut BlockCsr<R>) {
        let Self { model, frozen, x, transverse } = *self;
        let dt = R::of(frozen.dt);
        matrix.fill_rows(&|i, columns, blocks| {
            blocks.fill(Mat3::zeros());
            if model.inv_m[i] == R::zero() {
                return;
            }

            let place = |j: u32| columns.binary_search(&j).expect("the pattern holds every spring");
            let diagonal = place(i as u32);
            blocks[diagonal] += Mat3::identity() * (model.m[i] + dt * frozen.drag);

            for (j, rest_length, law) in model.springs.row(i) {
                let d = x[i].vector() - x[j as usize].vector();
                let [a, b] =
                    SpringBlock::new(&d, rest_length, frozen.implicit_laws[law as usize]).run(transverse);
                let block = Mat3::identity() * a + d * d.transpose() * b;
                blocks[diagonal] += block;
                blocks[place(j)] -= block;
            }
        });
    }
}

/// Room for the matrix of a model.
pub(super) fn pattern<R: Real>(model: &Model<R>) -> BlockCsr<R> {
    BlockCsr::with_pattern((0..model.count).map(|i| model.springs.row(i).map(|(j, _, _)| j).collect()))
}

struct RightHandSide<'a, R: Real, T> {
    operator: StepOperator<'a, R, T>,
    first_row: usize,
    v: &'a [Padded<R>],
    f: &'a [Vec3<R>],
    b: &'a mut [Vec3<R>],
}

impl<R: Real, T: Transverse> WithSimd<R> for RightHandSide<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let StepOperator { model, frozen, x, transverse } = self.operator;
        let dt = R::of(frozen.dt);
        let zero = [P::zero(); 3];
        for rows in Sell::<R>::groups(self.first_row..self.first_row + self.b.len()) {
            // -h² df/dx v, which leaves the damping out.
            let fold = ElasticBlockProduct(transverse);
            let sums = model.springs.fold_group(rows.start, [x, self.v], &frozen.implicit_laws, zero, fold);
            for (stiff, i) in vectors(sums).into_iter().zip(rows) {
                let free = if model.inv_m[i] > R::zero() { R::one() } else { R::zero() };
                let force = self.f[i] + frozen.gravity * model.m[i];
                self.b[i - self.first_row] = (force * dt - stiff) * free;
            }
        }
    }
}

struct InverseOfBlock<'a, R: Real, T> {
    operator: StepOperator<'a, R, T>,
    kind: PreconditionerKind,
    first_row: usize,
    out: &'a mut [Inverse3<R>],
}

impl<R: Real, T: Transverse> WithSimd<R> for InverseOfBlock<'_, R, T> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let StepOperator { model, frozen, x, transverse } = self.operator;
        let drag = frozen.dt * frozen.drag.to_f64();
        let zero = [P::Wide::zero(); 6];
        for rows in Sell::<R>::groups(self.first_row..self.first_row + self.out.len()) {
            let fold = DiagonalBlock(transverse);
            let sums =
                model.springs.fold_group::<P, _, 6>(rows.start, [x, x], &frozen.implicit_laws, zero, fold);
            let lanes = sums.map(Pack::store);
            for (lane, i) in rows.enumerate() {
                let own = model.m[i].to_f64() + drag;
                let [xx, yy, zz, xy, xz, yz] = lanes.map(|entry| entry[lane]);
                let block = Symmetric3 { xx: own + xx, yy: own + yy, zz: own + zz, xy, xz, yz };
                let inverse = match self.kind {
                    PreconditionerKind::BlockJacobi => Inverse3::of(&block),
                    PreconditionerKind::Diagonal | PreconditionerKind::Identity => {
                        Inverse3::of_diagonal(&block)
                    }
                };
                self.out[i - self.first_row] = inverse.unwrap_or_else(|| Inverse3::scalar(model.inv_m[i]));
            }
        }
    }
}

//! The matrix of a step in parts: masses, springs and elements, one by one.
//!
//! Springs are handed over with the absolute value of what they have across, so that what is made of them is positive
//! semi-definite whatever the matrix makes of compressed ones.

use super::step_matrix::StepMatrix;
use crate::{
    linalg::{MatrixParts, Symmetric3, TakeParts},
    math::{Mat3, Pack, Real, Vec3, WithSimd, dispatch},
};

impl<R: Real> MatrixParts for StepMatrix<'_, R> {
    fn visit(&self, block: usize, take: &mut dyn TakeParts) {
        let first = block * self.model.block_size;
        for row in first..(first + self.model.block_size).min(self.model.count) {
            if self.model.inv_m[row] > R::zero() {
                take.alone(row, &self.alone(row));
                self.hand_over_springs(row, take);
            }
        }
        if !self.model.elements.is_empty() {
            dispatch::<R, _>(HandOver { matrix: *self, block, take });
        }
    }
}

impl<R: Real> StepMatrix<'_, R> {
    /// Mass, drag and air of a row.
    fn alone(&self, row: usize) -> Symmetric3 {
        let h = R::of(self.numbers.scheme.h);
        let mass = (self.model.m[row] + h * self.numbers.drag).to_f64();
        let own = Symmetric3 { xx: mass, yy: mass, zz: mass, ..Symmetric3::default() };
        let Some(air) = self.numbers.external.air_of(row) else { return own };
        let air: Mat3<f64> = air.map(|entry| (entry * h).to_f64());
        Symmetric3 {
            xx: mass + air[(0, 0)],
            yy: mass + air[(1, 1)],
            zz: mass + air[(2, 2)],
            xy: air[(0, 1)],
            xz: air[(0, 2)],
            yz: air[(1, 2)],
        }
    }

    /// Hands over the springs of a row.
    fn hand_over_springs(&self, row: usize, take: &mut dyn TakeParts) {
        let springs = &self.model.springs;
        for end in springs.row(row) {
            let other = end.other as usize;
            let d: Vec3<f64> = (self.x[row].vector() - self.x[other].vector()).map(R::to_f64);
            let (slot, lane) = end.place;
            let along = self.numbers.along[springs.pattern_of[slot] as usize][lane].to_f64();
            let square = d.norm_squared();
            let frozen = self.tangent[slot][lane].to_f64();
            let across = along - frozen * square;
            let (a, b) =
                if across < 0.0 { (-across, (along + across) / square) } else { (across, frozen) };
            let block = Symmetric3 {
                xx: a + b * d.x * d.x,
                yy: a + b * d.y * d.y,
                zz: a + b * d.z * d.z,
                xy: b * d.x * d.y,
                xz: b * d.x * d.z,
                yz: b * d.y * d.z,
            };
            take.spring(row, other, &block);
        }
    }
}

/// The elements of a block.
struct HandOver<'a, R: Real> {
    matrix: StepMatrix<'a, R>,
    block: usize,
    take: &'a mut dyn TakeParts,
}

impl<R: Real> WithSimd<R> for HandOver<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { matrix, block, take } = self;
        let mut first = 0;
        for (elements, numbers) in matrix.model.elements.iter().zip(&matrix.numbers.elements) {
            let range = elements.frozen(block);
            let frozen = &matrix.frozen[first + range.start..first + range.end];
            elements.hand_over::<P>(block, numbers.matrix.to_f64(), frozen, &mut *take);
            first += elements.frozen_count();
        }
    }
}

//! Preconditioners: none, the inverse diagonal, the inverse 3 x 3 diagonal blocks.

use super::operator::Preconditioner;
use crate::math::{Real, Vec3};

/// No preconditioning: z = r.
#[derive(Clone, Copy, Debug, Default)]
pub struct Identity;

impl<R: Real> Preconditioner<R> for Identity {
    fn apply(&self, _: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]) {
        z.copy_from_slice(r);
    }
}

/// Inverse of the diagonal, one component each.
#[derive(Clone, Copy, Debug)]
pub struct Diagonal<'a, R: Real>(
    /// Inverse diagonal, one entry per row.
    pub &'a [Symmetric3<R>],
);

impl<R: Real> Preconditioner<R> for Diagonal<'_, R> {
    fn apply(&self, first_row: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]) {
        let inverse = &self.0[first_row..first_row + r.len()];
        for ((z, r), m) in z.iter_mut().zip(r).zip(inverse) {
            *z = Vec3::new(m.xx * r.x, m.yy * r.y, m.zz * r.z);
        }
    }
}

/// Inverse of the 3 x 3 diagonal blocks.
#[derive(Clone, Copy, Debug)]
pub struct BlockJacobi<'a, R: Real>(
    /// Inverse blocks, one per row.
    pub &'a [Symmetric3<R>],
);

impl<R: Real> Preconditioner<R> for BlockJacobi<'_, R> {
    fn apply(&self, first_row: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]) {
        let inverse = &self.0[first_row..first_row + r.len()];
        for ((z, r), m) in z.iter_mut().zip(r).zip(inverse) {
            *z = m.times(r);
        }
    }
}

/// A symmetric 3 x 3 matrix.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the entries of a matrix")]
pub struct Symmetric3<R> {
    pub xx: R,
    pub yy: R,
    pub zz: R,
    pub xy: R,
    pub xz: R,
    pub yz: R,
}

impl<R: Real> Symmetric3<R> {
    /// The identity times `s`.
    #[inline(always)]
    pub fn scalar(s: R) -> Self {
        let zero = R::zero();
        Self { xx: s, yy: s, zz: s, xy: zero, xz: zero, yz: zero }
    }

    /// Product with a vector.
    #[inline(always)]
    pub fn times(&self, v: &Vec3<R>) -> Vec3<R> {
        Vec3::new(
            self.xx * v.x + self.xy * v.y + self.xz * v.z,
            self.xy * v.x + self.yy * v.y + self.yz * v.z,
            self.xz * v.x + self.yz * v.y + self.zz * v.z,
        )
    }

    /// The inverse diagonal, or `None` unless all entries are positive.
    pub fn inverse_diagonal(&self) -> Option<Self> {
        let zero = R::zero();
        let positive = self.xx > zero && self.yy > zero && self.zz > zero;
        let one = R::one();
        positive.then(|| Self {
            xx: one / self.xx,
            yy: one / self.yy,
            zz: one / self.zz,
            xy: zero,
            xz: zero,
            yz: zero,
        })
    }

    /// The inverse, or `None` unless the matrix is positive definite (leading minors positive).
    #[inline(always)]
    pub fn inverse_if_positive(&self) -> Option<Self> {
        let minor = self.xx * self.yy - self.xy * self.xy;
        let cofactor_x = self.yy * self.zz - self.yz * self.yz;
        let cofactor_y = self.xz * self.yz - self.xy * self.zz;
        let cofactor_z = self.xy * self.yz - self.xz * self.yy;
        let determinant = self.xx * cofactor_x + self.xy * cofactor_y + self.xz * cofactor_z;

        let zero = R::zero();
        if !(self.xx > zero && minor > zero && determinant > zero) {
            return None;
        }

        let s = R::one() / determinant;
        Some(Self {
            xx: cofactor_x * s,
            xy: cofactor_y * s,
            xz: cofactor_z * s,
            yy: (self.xx * self.zz - self.xz * self.xz) * s,
            yz: (self.xy * self.xz - self.xx * self.yz) * s,
            zz: minor * s,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::Symmetric3;
    use crate::math::Vec3;

    #[test]
    fn an_inverse_undoes_its_matrix() {
        let a = Symmetric3 { xx: 4.0, yy: 3.0, zz: 5.0, xy: 1.0, xz: -0.5, yz: 0.25 };
        let v = Vec3::new(1.0, -2.0, 3.0);
        let back = a.inverse_if_positive().expect("positive definite").times(&a.times(&v));
        assert!((back - v).norm() < 1e-14);
    }

    #[test]
    fn an_indefinite_block_has_no_inverse_to_precondition_with() {
        let a = Symmetric3 { xx: 1.0, yy: -1.0, zz: 1.0, xy: 0.0, xz: 0.0, yz: 0.0 };
        assert_eq!(a.inverse_if_positive(), None);
        assert_eq!(a.inverse_diagonal(), None);
    }
}

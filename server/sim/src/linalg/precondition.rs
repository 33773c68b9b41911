//! Preconditioners: none, the inverse diagonal, the inverse 3 x 3 diagonal blocks, factored in binary64.

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
    pub &'a [Inverse3<R>],
);

impl<R: Real> Preconditioner<R> for Diagonal<'_, R> {
    fn apply(&self, first_row: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]) {
        let inverse = &self.0[first_row..first_row + r.len()];
        for ((z, r), m) in z.iter_mut().zip(r).zip(inverse) {
            *z = r.component_mul(&m.pivots);
        }
    }
}

/// Inverse of the 3 x 3 diagonal blocks.
#[derive(Clone, Copy, Debug)]
pub struct BlockJacobi<'a, R: Real>(
    /// Inverse blocks, one per row.
    pub &'a [Inverse3<R>],
);

impl<R: Real> Preconditioner<R> for BlockJacobi<'_, R> {
    fn apply(&self, first_row: usize, r: &[Vec3<R>], z: &mut [Vec3<R>]) {
        let inverse = &self.0[first_row..first_row + r.len()];
        for ((z, r), m) in z.iter_mut().zip(r).zip(inverse) {
            *z = m.times(r);
        }
    }
}

/// A symmetric 3 x 3 matrix in binary64.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
#[allow(missing_docs, reason = "the entries of a matrix")]
pub struct Symmetric3 {
    pub xx: f64,
    pub yy: f64,
    pub zz: f64,
    pub xy: f64,
    pub xz: f64,
    pub yz: f64,
}

/// The inverse of a symmetric positive definite 3 x 3 matrix A = L D Lᵀ, as its factors: A⁻¹ = Wᵀ D⁻¹ W, W = L⁻¹.
///
/// It is positive definite whatever the rounding of its entries, and off by a rounding times the square root of the
/// condition number, where entries of the inverse itself would be off by a rounding times all of it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Inverse3<R: Real> {
    /// D⁻¹.
    pivots: Vec3<R>,
    /// Entries of W below its diagonal of ones: yx, zx, zy.
    below: Vec3<R>,
}

impl<R: Real> Inverse3<R> {
    /// The inverse of the identity times 1 / `s`.
    pub fn scalar(s: R) -> Self {
        Self { pivots: Vec3::repeat(s), below: Vec3::zeros() }
    }

    /// That of the diagonal alone, or `None` unless all of its entries are positive.
    pub fn of_diagonal(a: &Symmetric3) -> Option<Self> {
        let pivots = [a.xx, a.yy, a.zz];
        positive(pivots)
            .then(|| Self { pivots: Vec3::from(pivots).map(|d| R::of(1.0 / d)), below: Vec3::zeros() })
    }

    /// That of a matrix, or `None` unless it is positive definite.
    #[inline(always)]
    pub fn of(a: &Symmetric3) -> Option<Self> {
        let (yx, zx) = (a.xy / a.xx, a.xz / a.xx);
        let y = a.yy - yx * a.xy;
        let zy = (a.yz - zx * a.xy) / y;
        let z = a.zz - zx * a.xz - zy * zy * y;

        let pivots = [a.xx, y, z];
        positive(pivots).then(|| Self {
            pivots: Vec3::from(pivots).map(|d| R::of(1.0 / d)),
            below: Vec3::new(-yx, yx * zy - zx, -zy).map(R::of),
        })
    }

    /// Product with a vector.
    #[inline(always)]
    pub fn times(&self, v: &Vec3<R>) -> Vec3<R> {
        let [yx, zx, zy] = [self.below.x, self.below.y, self.below.z];
        let x = v.x * self.pivots.x;
        let y = (v.y + yx * v.x) * self.pivots.y;
        let z = (v.z + zx * v.x + zy * v.y) * self.pivots.z;
        Vec3::new(x + yx * y + zx * z, y + zy * z, z)
    }
}

/// Whether all are: a number that is not finite is not.
fn positive(pivots: [f64; 3]) -> bool {
    pivots.iter().all(|d| *d > 0.0 && d.is_finite())
}

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the test, not of a step")]
mod tests {
    use nalgebra::SymmetricEigen;

    use super::{Inverse3, Symmetric3};
    use crate::math::{Mat3, Vec3};

    /// The entries of a matrix.
    fn entries(a: &Mat3<f64>) -> Symmetric3 {
        let [xx, yy, zz, xy, xz, yz] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|place| a[place]);
        Symmetric3 { xx, yy, zz, xy, xz, yz }
    }

    #[test]
    fn an_inverse_undoes_its_matrix() {
        let a = Symmetric3 { xx: 4.0, yy: 3.0, zz: 5.0, xy: 1.0, xz: -0.5, yz: 0.25 };
        let v = Vec3::new(1.0, -2.0, 3.0);
        let product = Vec3::new(4.0 - 2.0 - 1.5, 1.0 - 6.0 + 0.75, -0.5 - 0.5 + 15.0);
        let back = Inverse3::<f64>::of(&a).expect("positive definite").times(&product);
        assert!((back - v).norm() < 1e-14);
    }

    #[test]
    fn an_indefinite_block_has_no_inverse_to_precondition_with() {
        let a = Symmetric3 { xx: 1.0, yy: -1.0, zz: 1.0, ..Symmetric3::default() };
        assert_eq!(Inverse3::<f64>::of(&a), None);
        assert_eq!(Inverse3::<f64>::of_diagonal(&a), None);
    }

    /// A stiff direction beside a mass: A⁻¹ A has eigenvalues near 1, although entries of A⁻¹ cannot be right in binary32.
    #[test]
    fn a_stiff_block_has_an_inverse_in_every_orientation_and_precision() {
        for stiffness in [1e6, 1e7, 1e8] {
            for turn in 0..200 {
                let (angle, height) = (2.4 * f64::from(turn), f64::from(turn) / 100.0 - 0.995);
                let across = (1.0 - height * height).sqrt();
                let stiff = Vec3::new(across * angle.cos(), across * angle.sin(), height);
                let a = Mat3::identity() + stiff * stiff.transpose() * stiffness;
                let inverse = Inverse3::<f32>::of(&entries(&a)).expect("positive definite");

                let (pivots, below) = (inverse.pivots.map(f64::from), inverse.below.map(f64::from));
                let w = Mat3::new(1.0, 0.0, 0.0, below.x, 1.0, 0.0, below.y, below.z, 1.0);
                let product = w * a.cholesky().expect("positive definite").l();
                let similar = product.transpose() * Mat3::from_diagonal(&pivots) * product;
                let found = SymmetricEigen::new(similar).eigenvalues;
                let label = format!("{stiffness:e}, {stiff:?}: {found:?}");
                assert!(found.iter().all(|e| (e - 1.0).abs() < 2e-7 * stiffness.sqrt()), "{label}");
            }
        }
    }
}

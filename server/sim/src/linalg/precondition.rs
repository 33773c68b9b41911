//! Preconditioners: none, the inverse diagonal, the inverse 3 x 3 diagonal blocks, factored in binary64.

use bytemuck::Zeroable;

use super::{operator::Preconditioner, settings::PreconditionerKind, sixteens::Sums};
use crate::math::{LANES, Pack, Portable, Real, Sixteen, WithSimd, dispatch, three};

/// No preconditioning: z = r.
#[derive(Clone, Copy, Debug, Default)]
pub struct Identity;

impl<R: Real> Preconditioner<R> for Identity {
    fn apply(&self, _: usize, r: &[Sixteen<R>], z: &mut [Sixteen<R>]) {
        z.copy_from_slice(r);
    }
}

/// Inverse of the 3 x 3 diagonal blocks, or of the diagonal alone.
#[derive(Clone, Copy, Debug)]
pub struct BlockJacobi<'a>(
    /// Inverse blocks, sixteen rows each.
    pub &'a [Inverse3],
);

impl<R: Real> Preconditioner<R> for BlockJacobi<'_> {
    fn apply(&self, first_row: usize, r: &[Sixteen<R>], z: &mut [Sixteen<R>]) {
        dispatch(Apply { inverse: &self.0[first_row / LANES..], r, z });
    }

    fn advance(&self, first_row: usize, alpha: R, r: &mut [Sixteen<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        dispatch(Advance { inverse: &self.0[first_row / LANES..], alpha, r, q })
    }
}

struct Apply<'a, R> {
    inverse: &'a [Inverse3],
    r: &'a [Sixteen<R>],
    z: &'a mut [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for Apply<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        for ((z, r), inverse) in self.z.iter_mut().zip(self.r).zip(self.inverse) {
            z.store(inverse.times::<P>(r.load()));
        }
    }
}

struct Advance<'a, R> {
    inverse: &'a [Inverse3],
    alpha: R,
    r: &'a mut [Sixteen<R>],
    q: &'a mut [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for Advance<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 2] {
        let mut sums = Sums::<P::Wide>::zero();
        for ((q, r), inverse) in self.q.iter_mut().zip(self.r).zip(self.inverse) {
            let (old, product) = (r.load::<P>(), q.load::<P>());
            let residual = three!(|c| old[c] - product[c] * self.alpha);
            let z = inverse.times(residual);
            r.store(residual);
            q.store(z);
            sums.add(residual, z);
        }
        sums.total()
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

/// Inverses of sixteen symmetric positive definite 3 x 3 matrices A = L D Lᵀ, as their factors in binary32:
/// A⁻¹ = Wᵀ D⁻¹ W, W = L⁻¹.
///
/// Each is positive definite whatever the rounding of its entries, and off by a rounding of binary32 times the square
/// root of the condition number, where entries of the inverse itself would be off by a rounding times all of it. No
/// preconditioner needs more, in binary64 neither.
#[derive(Clone, Copy, Debug, Default, PartialEq, Zeroable)]
#[repr(C, align(64))]
pub struct Inverse3 {
    /// D⁻¹.
    pivots: [[f32; LANES]; 3],
    /// Entries of W below its diagonal of ones: yx, zx, zy.
    below: [[f32; LANES]; 3],
}

/// 1 where a pivot is positive and within the range of binary32, else 0; a number that is not finite is neither. No closure: these are not compiled
/// for the instructions of the kernel that calls them.
#[inline(always)]
fn within<W: Pack<Number = f64>>(pivot: W) -> W {
    W::of(SMALLEST).if_less(pivot, pivot.if_less(W::of(LARGEST), W::one(), W::zero()), W::zero())
}

impl Inverse3 {
    /// Those of matrices, one or more; the scalar `otherwise` where one is not positive definite. A `kind` other than
    /// the inverse blocks leaves out what is beside the diagonals.
    pub fn of(blocks: &[Symmetric3], kind: PreconditionerKind, otherwise: f64) -> Vec<Self> {
        let sixteen = |blocks: &[Symmetric3]| {
            let lane = |lane: usize, entry: fn(&Symmetric3) -> f64| blocks.get(lane).map_or(1.0, entry);
            let entries: [fn(&Symmetric3) -> f64; 6] =
                [|a| a.xx, |a| a.yy, |a| a.zz, |a| a.xy, |a| a.xz, |a| a.yz];
            let lanes = entries.map(|entry| Portable::load(&std::array::from_fn(|l| lane(l, entry))));
            Self::of_packs(lanes, kind, Portable::splat(otherwise))
        };
        blocks.chunks(LANES).map(sixteen).collect()
    }

    /// Those of sixteen matrices in packs: xx, yy, zz, xy, xz, yz.
    #[inline(always)]
    pub(crate) fn of_packs<W: Pack<Number = f64>>(
        [xx, yy, zz, xy, xz, yz]: [W; 6],
        kind: PreconditionerKind,
        otherwise: W,
    ) -> Self {
        let is_whole = kind != PreconditionerKind::Diagonal;
        let kept = if is_whole { W::one() } else { W::zero() };
        let (xy, xz, yz) = (xy * kept, xz * kept, yz * kept);
        let one = W::one();
        let (yx, zx) = (xy / xx, xz / xx);
        let y = yy - yx * xy;
        let zy = (yz - zx * xy) / y;
        let z = zz - zx * xz - zy * zy * y;

        let is_good = within(xx) * within(y) * within(z);
        let otherwise = otherwise.min(W::of(LARGEST));
        let pivots = [xx, y, z];
        let below = [W::zero() - yx, yx * zy - zx, W::zero() - zy];
        Self {
            pivots: three!(|c| W::zero().if_less(is_good, one / pivots[c], otherwise).to_singles()),
            below: three!(|c| W::zero().if_less(is_good, below[c], W::zero()).to_singles()),
        }
    }

    /// Takes over in a lane the inverse of its matrix and another one together, which is positive semi-definite; leaves it as it was where a factor
    /// leaves the range.
    pub(crate) fn add(&mut self, lane: usize, added: &Symmetric3) {
        let [yx, zx, zy] = self.below.map(|row| -f64::from(row[lane]));
        let [x, y, z] = self.pivots.map(|row| 1.0 / f64::from(row[lane]));
        // L = W⁻¹.
        let zx = yx * zy + zx;
        let Symmetric3 { xx, yy, zz, xy, xz, yz } = *added;
        let (xx, xy, xz) = (x + xx, x * yx + xy, x * zx + xz);
        let (yy, yz) = (x * yx * yx + y + yy, x * yx * zx + y * zy + yz);
        let zz = x * zx * zx + y * zy * zy + z + zz;

        let (yx, zx) = (xy / xx, xz / xx);
        let y = yy - yx * xy;
        let zy = (yz - zx * xy) / y;
        let pivots = [xx, y, zz - zx * xz - zy * zy * y];
        if pivots.iter().all(|pivot| (SMALLEST..LARGEST).contains(pivot)) {
            for (row, pivot) in self.pivots.iter_mut().zip(pivots) {
                row[lane] = (1.0 / pivot) as f32;
            }
            for (row, entry) in self.below.iter_mut().zip([-yx, yx * zy - zx, -zy]) {
                row[lane] = entry as f32;
            }
        }
    }

    /// C with A⁻¹ = Cᵀ C of one of the matrices: a lower triangle, by rows.
    pub(crate) fn root(&self, lane: usize) -> [[f64; 3]; 3] {
        let [yx, zx, zy] = three!(|i| f64::from(self.below[i][lane]));
        let [x, y, z] = three!(|i| f64::from(self.pivots[i][lane]).sqrt());
        [[x, 0.0, 0.0], [y * yx, y, 0.0], [z * zx, z * zy, z]]
    }

    /// Products with sixteen vectors.
    #[inline(always)]
    pub(crate) fn times<P: Pack>(&self, v: [P; 3]) -> [P; 3] {
        let [yx, zx, zy] = three!(|i| P::from_singles(&self.below[i]));
        let pivots = three!(|i| P::from_singles(&self.pivots[i]));
        let x = v[0] * pivots[0];
        let y = (v[1] + yx * v[0]) * pivots[1];
        let z = (v[2] + zx * v[0] + zy * v[1]) * pivots[2];
        [x + yx * y + zx * z, y + zy * z, z]
    }
}

/// Pivots whose inverses are normal numbers of binary32.
const SMALLEST: f64 = 1e-37;
const LARGEST: f64 = 1e37;

#[cfg(test)]
#[allow(clippy::disallowed_methods, reason = "angles of the test, not of a step")]
mod tests {
    use nalgebra::SymmetricEigen;

    use super::{BlockJacobi, Inverse3, Preconditioner, PreconditionerKind, Symmetric3};
    use crate::math::{LANES, Mat3, Sixteen, Vec3};

    /// The entries of a matrix.
    fn entries(a: &Mat3<f64>) -> Symmetric3 {
        let [xx, yy, zz, xy, xz, yz] = [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|place| a[place]);
        Symmetric3 { xx, yy, zz, xy, xz, yz }
    }

    /// The inverse in the first lane, as pivots and W.
    fn factors(inverse: &Inverse3) -> (Vec3<f64>, Mat3<f64>) {
        let first = |lanes: [[f32; LANES]; 3]| Vec3::from(lanes.map(|lanes| f64::from(lanes[0])));
        let (pivots, below) = (first(inverse.pivots), first(inverse.below));
        (pivots, Mat3::new(1.0, 0.0, 0.0, below.x, 1.0, 0.0, below.y, below.z, 1.0))
    }

    #[test]
    fn an_inverse_undoes_its_matrix() {
        let a = Symmetric3 { xx: 4.0, yy: 3.0, zz: 5.0, xy: 1.0, xz: -0.5, yz: 0.25 };
        let v = Vec3::new(1.0, -2.0, 3.0);
        let product = Vec3::new(4.0 - 2.0 - 1.5, 1.0 - 6.0 + 0.75, -0.5 - 0.5 + 15.0);
        let inverse = Inverse3::of(&[a], PreconditionerKind::BlockJacobi, 0.0);
        let mut back = [Sixteen::<f64>::default()];
        BlockJacobi(&inverse).apply(0, &Sixteen::from_vectors(&[product]), &mut back);
        assert!((back[0].get(0) - v).norm() < 1e-6, "{back:?}");
    }

    #[test]
    fn an_indefinite_block_has_no_inverse_to_precondition_with() {
        for bad in [-1.0, 0.0, f64::NAN, f64::INFINITY] {
            let a = Symmetric3 { xx: 1.0, yy: bad, zz: 1.0, ..Symmetric3::default() };
            for kind in [PreconditionerKind::Diagonal, PreconditionerKind::BlockJacobi] {
                let (pivots, w) = factors(&Inverse3::of(&[a], kind, 0.25)[0]);
                assert_eq!((pivots, w), (Vec3::repeat(0.25), Mat3::identity()));
            }
        }
    }

    #[test]
    fn what_is_added_to_a_matrix_is_in_its_inverse_and_in_no_other() {
        let a = Symmetric3 { xx: 4.0, yy: 3.0, zz: 5.0, xy: 1.0, xz: -0.5, yz: 0.25 };
        let n = Vec3::new(2.0 / 3.0, -1.0 / 3.0, 2.0 / 3.0);
        for stiffness in [0.0, 1.0, 100.0, 1e4] {
            let [xx, yy, zz, xy, xz, yz] =
                [(0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2)].map(|(i, j)| stiffness * n[i] * n[j]);
            let mut inverse = Inverse3::of(&[a, a], PreconditionerKind::BlockJacobi, 0.0);
            let before = inverse[0];
            inverse[0].add(0, &Symmetric3 { xx, yy, zz, xy, xz, yz });
            let (pivots, w) = factors(&inverse[0]);
            let product = w.transpose() * Mat3::from_diagonal(&pivots) * w;
            let sum = Mat3::new(a.xx, a.xy, a.xz, a.xy, a.yy, a.yz, a.xz, a.yz, a.zz)
                + n * n.transpose() * stiffness;
            let off = (product * sum - Mat3::identity()).amax();
            assert!(off < 1e-6 * (1.0 + stiffness).sqrt() * 4.0, "{stiffness}: {off:e}");
            assert_eq!(
                (0..3).map(|c| inverse[0].pivots[c][1]).collect::<Vec<_>>(),
                (0..3).map(|c| before.pivots[c][1]).collect::<Vec<_>>()
            );
        }
    }

    /// A stiff direction beside a mass: A⁻¹ A has eigenvalues near 1, although entries of A⁻¹ cannot be right in binary32.
    #[test]
    fn a_stiff_block_has_an_inverse_in_every_orientation() {
        for stiffness in [1e6, 1e7, 1e8] {
            for turn in 0..200 {
                let (angle, height) = (2.4 * f64::from(turn), f64::from(turn) / 100.0 - 0.995);
                let across = (1.0 - height * height).sqrt();
                let stiff = Vec3::new(across * angle.cos(), across * angle.sin(), height);
                let a = Mat3::identity() + stiff * stiff.transpose() * stiffness;
                let (pivots, w) =
                    factors(&Inverse3::of(&[entries(&a)], PreconditionerKind::BlockJacobi, 0.0)[0]);

                let product = w * a.cholesky().expect("positive definite").l();
                let similar = product.transpose() * Mat3::from_diagonal(&pivots) * product;
                let found = SymmetricEigen::new(similar).eigenvalues;
                let label = format!("{stiffness:e}, {stiff:?}: {found:?}");
                assert!(found.iter().all(|e| (e - 1.0).abs() < 2e-7 * stiffness.sqrt()), "{label}");
            }
        }
    }
}

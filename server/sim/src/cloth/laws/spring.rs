//! The spring: f_i = -k (l - l0) u - nu ((v_i - v_j).u) u, with d = x_i - x_j, l = |d|, u = d/l.
//!
//! At l = 0, and where l is below what the precision can square twice, the direction is undefined: the force is 0 and the
//! elastic derivative -k I, the limit for l0 = 0. The stiffness across a spring is that of one no shorter than the root of
//! a rounding of its rest length.

use crate::{
    cloth::settings::Hessian,
    math::{Mat3, Pack, Portable, Precision, Real, Vec3, array::dot},
};

/// The greatest l0 / l that the stiffness across a spring is computed from, about the root of an inverse rounding: a of the
/// block a I + b d dᵀ is then known to the root of a rounding of h² k. Beyond, a stiff spring would lose that to rounding.
pub(super) const fn most_compressed<R: Real>() -> f64 {
    match R::PRECISION {
        Precision::F32 => 4096.0,
        Precision::F64 => 67_108_864.0,
    }
}

/// Sixteen springs: where they are, and what they are at rest.
#[derive(Clone, Copy)]
pub(crate) struct Spring<P> {
    /// Own position less the other's (m).
    d: [P; 3],
    rest_length: P,
    /// d.d (m²).
    pub(crate) square: P,
    /// |d| (m).
    pub(crate) length: P,
    /// 1 / |d| (1/m), 0 where |d| is too small to have a direction.
    inverse: P,
}

impl<P: Pack> Spring<P> {
    #[inline(always)]
    pub(crate) fn new(d: [P; 3], rest_length: P) -> Self {
        let square = dot(d, d);
        let length = square.sqrt();
        let inverse = length.inverse_above(P::of(P::Number::SMALLEST));
        Self { d, rest_length, square, length, inverse }
    }

    /// What d is multiplied by for the force on the other end (N/m), at the relative velocity w = v_i - v_j (m/s).
    #[inline(always)]
    pub(crate) fn pull(&self, w: [P; 3], stiffness: P, damping: P) -> P {
        let elastic = stiffness * (self.length - self.rest_length) * self.inverse;
        elastic + self.slowing(dot(w, self.d), damping)
    }

    /// What damping adds to that, where w.d is `along` (m²/s).
    #[inline(always)]
    pub(crate) fn slowing(&self, along: P, damping: P) -> P {
        damping * along * self.inverse * self.inverse
    }

    /// u, 0 where |d| is too small.
    #[inline(always)]
    pub(crate) fn direction(&self) -> [P; 3] {
        [self.d[0] * self.inverse, self.d[1] * self.inverse, self.d[2] * self.inverse]
    }

    /// Stiffness across it over that along it, 1 - l0/l, 0 under compression; 0 for a lane without a spring.
    #[inline(always)]
    pub(crate) fn transverse(&self) -> P {
        let ratio = P::one() - self.rest_length * self.inverse;
        ratio.max(P::zero()).where_positive(self.square + self.rest_length)
    }

    /// The square of the rate at which its ends move against each other, in rest lengths (1/s²); 0 without one.
    #[inline(always)]
    pub(crate) fn speed(&self, w: [P; 3]) -> P {
        let inverse = self.rest_length.inverse_or_zero();
        dot(w, w) * inverse * inverse
    }

    /// The block a I + b d dᵀ that it adds to M - h df/dv - h² df/dx, frozen: its elastic a (kg), and b (kg/m²), from
    /// which a of the whole follows as h² k + h nu - b d.d.
    ///
    /// With a transverse ratio that is not negative (`mirror` is 0 or -1), that difference is not negative either.
    #[inline(always)]
    pub(crate) fn tangent(&self, elastic: P, viscous: P, mirror: P) -> [P; 2] {
        let shorter = (self.rest_length * self.inverse).min(P::of(most_compressed::<P::Number>()));
        let ratio = P::one() - shorter;
        let across = elastic * (mirror * ratio).max(ratio);
        let b = (elastic - across + viscous) * self.inverse * self.inverse;

        // Rounding may leave a below 0 by some ten times that of h² k, which a light particle would feel.
        let left = elastic + viscous - b * self.square;
        let least = P::zero().if_less(mirror, P::of(-P::Number::LARGEST.to_f64()), P::zero());
        let smaller = b * P::of(1.0 - 16.0 * P::Number::ROUNDING);
        [across, left.if_less(least, smaller, b)]
    }

    /// Energies (J) in binary64 of the lengths that these positions have in binary64: the length in the precision of
    /// the state, and one step of Newton's method.
    #[inline(always)]
    pub(crate) fn energy(&self, stiffness: P) -> P::Wide {
        let [x, y, z] = P::widen3(self.d);
        let (length, inverse) = (self.length.widen(), self.inverse.widen());
        let half = P::Wide::of(0.5);
        let rest = dot([x, y, z], [x, y, z]) - length * length;
        let extension = (length - self.rest_length.widen()) + half * rest * inverse;
        half * stiffness.widen() * extension * extension
    }

    /// Adds the block itself, in binary64: xx, yy, zz, xy, xz, yz. In binary32 a stiff block would lose its mass to
    /// rounding. A lane without a spring counts for nothing; nor does a spring at rest length 0 whose ends coincide: a
    /// loss to the preconditioner alone.
    #[inline(always)]
    pub(crate) fn add_block(&self, sums: &mut [P::Wide; 6], along: P, b: P) {
        let a = (along - b * self.square).where_positive(self.square + self.rest_length).widen();
        let ([x, y, z], b) = (P::widen3(self.d), b.widen());
        let (bx, by, bz) = (b * x, b * y, b * z);
        let entries = [a + bx * x, a + by * y, a + bz * z, bx * y, bx * z, by * z];
        for c in 0..6 {
            sums[c] += entries[c];
        }
    }
}

/// The greatest length over rest length, in each lane: as a pair, so that nothing is divided.
#[derive(Clone, Copy)]
pub(crate) struct Stretch<P> {
    length: P,
    rest_length: P,
}

impl<P: Pack> Stretch<P> {
    #[inline(always)]
    pub(crate) fn none() -> Self {
        Self { length: P::zero(), rest_length: P::one() }
    }

    /// Takes springs with a rest length into account.
    #[inline(always)]
    pub(crate) fn look(&mut self, spring: &Spring<P>) {
        let length = spring.length.where_positive(spring.rest_length);
        let (own, new) = (self.length * spring.rest_length, length * self.rest_length);
        self.length = own.if_less(new, length, self.length);
        self.rest_length = own.if_less(new, spring.rest_length, self.rest_length);
    }

    /// The greatest of all lanes.
    #[inline(always)]
    pub(crate) fn greatest(self) -> f64 {
        let ratios = self.length.widen() / self.rest_length.widen();
        ratios.store().into_iter().fold(0.0, f64::max)
    }
}

/// One spring, in every lane: evaluated by the same code as sixteen different ones.
fn alone<R: Real>(d: &Vec3<R>, rest_length: R) -> Spring<Portable<R>> {
    Spring::new([d.x, d.y, d.z].map(Portable::splat), Portable::splat(rest_length))
}

/// Force (N) on particle i of a spring: `d` = x_i - x_j (m), `dv` = v_i - v_j (m/s), rest length
/// (m), stiffness (N/m), damping (N s/m).
pub fn spring_force<R: Real>(d: &Vec3<R>, dv: &Vec3<R>, rest_length: R, stiffness: R, damping: R) -> Vec3<R> {
    let w = [dv.x, dv.y, dv.z].map(Portable::splat);
    let pull = alone(d, rest_length).pull(w, Portable::splat(stiffness), Portable::splat(damping));
    d * -pull.store()[0]
}

/// Derivative of the elastic force on i by x_i (N/m): -k (u uᵀ + g (I - u uᵀ)), g = 1 - l0/l as
/// `hessian` treats it.
pub fn spring_jacobian_x<R: Real>(d: &Vec3<R>, rest_length: R, stiffness: R, hessian: Hessian) -> Mat3<R> {
    let splat = Portable::splat;
    let [a, b] =
        alone(d, rest_length).tangent(splat(stiffness), splat(R::zero()), splat(R::of(hessian.mirror())));
    let [a, b] = [a, b].map(|pack| pack.store()[0]);
    -(Mat3::identity() * a + d * d.transpose() * b)
}

/// Derivative of the damping force on i by v_i (N s/m): -nu u uᵀ.
pub fn spring_jacobian_v<R: Real>(d: &Vec3<R>, damping: R) -> Mat3<R> {
    let inverse = alone(d, R::zero()).inverse.store()[0];
    -(d * d.transpose() * (damping * inverse * inverse))
}

#[cfg(test)]
mod tests {
    use super::{Hessian, alone, spring_force, spring_jacobian_v, spring_jacobian_x};
    use crate::math::{Mat3, Pack, Portable, Vec3};

    #[test]
    fn derivatives_are_the_slopes_of_the_force() {
        let (rest_length, stiffness, damping, step) = (0.7, 30.0, 0.4, 1e-6);
        for d in [Vec3::new(0.3, -0.2, 0.4), Vec3::new(0.9, 0.5, -0.1)] {
            let still = Vec3::zeros();
            let (dx, dv) = (
                spring_jacobian_x(&d, rest_length, stiffness, Hessian::Full),
                spring_jacobian_v(&d, damping),
            );
            for c in 0..3 {
                let mut shift = Vec3::zeros();
                shift[c] = step;
                let force =
                    |d: Vec3<f64>, w: Vec3<f64>| spring_force(&d, &w, rest_length, stiffness, damping);
                let slope_x = (force(d + shift, still) - force(d - shift, still)) / (2.0 * step);
                let slope_v = (force(d, shift) - force(d, -shift)) / (2.0 * step);
                assert!((slope_x - dx.column(c)).norm() < 1e-7 * stiffness, "{slope_x} {dx}");
                assert!((slope_v - dv.column(c)).norm() < 1e-7, "{slope_v} {dv}");
            }
        }
    }

    #[test]
    fn a_spring_without_length_has_no_force_and_an_isotropic_derivative() {
        let zero = Vec3::<f64>::zeros();
        assert_eq!(spring_force(&zero, &Vec3::x(), 0.5, 10.0, 1.0), zero);
        assert_eq!(spring_jacobian_x(&zero, 0.0, 10.0, Hessian::Full), -Mat3::identity() * 10.0);
    }

    #[test]
    fn what_the_product_takes_for_the_transverse_stiffness_is_not_negative() {
        for i in 0..3000_u32 {
            let part = |k: u32| (i.wrapping_mul(2_654_435_761).wrapping_add(k * 977) >> 8) as f32 / 1.7e7;
            let d = Vec3::new(part(1) + 0.01, part(2), part(3));
            for (elastic, viscous) in [(1e8, 0.0), (1e-4, 3e3), (7.7, 0.13)] {
                for mirror in [0.0, -1.0] {
                    // At rest length, give or take a rounding: nothing is left of the difference.
                    let spring = alone(&d, d.norm());
                    let splat = Portable::splat;
                    let [_, b] = spring.tangent(splat(elastic), splat(viscous), splat(mirror));
                    let left = (splat(elastic + viscous) - b * spring.square).store()[0];
                    assert!(left >= 0.0 && left <= 4e-6 * (elastic + viscous), "{d}: {left}");
                }
            }
        }
    }

    #[test]
    fn treatments_differ_under_compression_alone() {
        let (short, long) = (Vec3::new(0.1, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
        let across = |d: &Vec3<f64>, hessian| spring_jacobian_x(d, 0.5, 1.0, hessian)[(1, 1)];
        assert_eq!(Hessian::ALL.map(|h| across(&short, h)), [4.0, -0.0, -4.0]);
        assert_eq!(Hessian::ALL.map(|h| across(&long, h)), [-0.5; 3]);
    }
}

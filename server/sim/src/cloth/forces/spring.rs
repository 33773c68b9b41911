//! The spring: f_i = -k (l - l0) u - nu ((v_i - v_j).u) u, with d = x_i - x_j, l = |d|, u = d/l.
//!
//! Reads d and v_i - v_j; gives the force on i (N) and its derivatives. At l = 0 the direction is
//! undefined: the force is 0 and the elastic derivative -k I, the limit for l0 = 0.

use crate::{
    cloth::{
        sell::{Edges, Fold, vectors},
        settings::Hessian,
    },
    math::{Mat3, Pack, Portable, Real, Vec3, array::dot},
};

/// What an implicit step uses for the transverse stiffness ratio 1 - l0/l.
pub(crate) trait Transverse: Copy + Sync {
    /// The ratio used in place of `ratio`.
    fn ratio<P: Pack>(self, ratio: P) -> P;
}

#[derive(Clone, Copy)]
struct Full;
#[derive(Clone, Copy)]
struct Clamped;
#[derive(Clone, Copy)]
struct Absolute;

impl Transverse for Full {
    #[inline(always)]
    fn ratio<P: Pack>(self, ratio: P) -> P {
        ratio
    }
}

impl Transverse for Clamped {
    #[inline(always)]
    fn ratio<P: Pack>(self, ratio: P) -> P {
        ratio.max(P::zero())
    }
}

impl Transverse for Absolute {
    #[inline(always)]
    fn ratio<P: Pack>(self, ratio: P) -> P {
        ratio.abs()
    }
}

/// Work that is compiled once for each treatment of compressed springs.
pub(crate) trait WithTransverse {
    type Output;
    fn run(self, transverse: impl Transverse) -> Self::Output;
}

/// Runs `work` for a treatment chosen at run time.
pub(crate) fn with_transverse<W: WithTransverse>(hessian: Hessian, work: W) -> W::Output {
    match hessian {
        Hessian::Full => work.run(Full),
        Hessian::Clamped => work.run(Clamped),
        Hessian::Absolute => work.run(Absolute),
    }
}

/// Adds forces: law = (k, nu), w = v_i - v_j.
#[derive(Clone, Copy)]
pub(crate) struct Force;

impl Force {
    #[inline(always)]
    fn on<P: Pack>(edges: &Edges<P>) -> [P; 3] {
        let [stiffness, damping] = edges.law;
        let length = dot(edges.d, edges.d).sqrt();
        let inverse = length.inverse_or_zero();
        let elastic = stiffness * (length - edges.rest_length) * inverse;
        let viscous = damping * dot(edges.w, edges.d) * inverse * inverse;
        let pull = elastic + viscous;
        edges.d.map(|d| pull * d)
    }
}

impl<P: Pack> Fold<P, P, 3> for Force {
    #[inline(always)]
    fn fold(self, sums: &mut [P; 3], edges: &Edges<P>) {
        let pull = Force::on(edges);
        for c in 0..3 {
            sums[c] -= pull[c];
        }
    }
}

/// Coefficients of the block a I + b d dᵀ that a spring adds to M - h df/dv - h² df/dx:
/// law = (h² k, h nu).
#[inline(always)]
pub(crate) fn spring_block<P: Pack>(edges: &Edges<P>, transverse: impl Transverse) -> [P; 2] {
    let [stiffness, damping] = edges.law;
    let inverse = dot(edges.d, edges.d).sqrt().inverse_or_zero();
    let ratio = P::one() - edges.rest_length * inverse;
    let across = stiffness * transverse.ratio(ratio);
    let along = (stiffness - across + damping) * inverse * inverse;
    [across, along]
}

/// Adds the product of that block with w = p_i - p_j.
#[derive(Clone, Copy)]
pub(crate) struct BlockProduct<T>(pub(crate) T);

impl<P: Pack, T: Transverse> Fold<P, P, 3> for BlockProduct<T> {
    #[inline(always)]
    fn fold(self, sums: &mut [P; 3], edges: &Edges<P>) {
        let [a, b] = spring_block(edges, self.0);
        let along = b * dot(edges.w, edges.d);
        for c in 0..3 {
            sums[c] += a * edges.w[c] + along * edges.d[c];
        }
    }
}

/// The same without damping: h² k alone.
#[derive(Clone, Copy)]
pub(crate) struct ElasticBlockProduct<T>(pub(crate) T);

impl<P: Pack, T: Transverse> Fold<P, P, 3> for ElasticBlockProduct<T> {
    #[inline(always)]
    fn fold(self, sums: &mut [P; 3], edges: &Edges<P>) {
        let undamped = Edges { law: [edges.law[0], P::zero()], ..*edges };
        BlockProduct(self.0).fold(sums, &undamped);
    }
}

/// Adds the block itself, in binary64: xx, yy, zz, xy, xz, yz. In binary32 a stiff block would lose its mass to rounding.
#[derive(Clone, Copy)]
pub(crate) struct DiagonalBlock<T>(pub(crate) T);

impl<P: Pack, T: Transverse> Fold<P, P::Wide, 6> for DiagonalBlock<T> {
    #[inline(always)]
    fn fold(self, sums: &mut [P::Wide; 6], edges: &Edges<P>) {
        let [a, b] = spring_block(edges, self.0);
        let [x, y, z] = edges.d.map(P::widen);

        // A lane without a spring has no length and no rest length: its a counts for nothing. Nor
        // does that of a spring at rest length 0 whose ends coincide: a loss to the preconditioner alone.
        let a = a.where_positive(dot(edges.d, edges.d) + edges.rest_length).widen();
        let b = b.widen();
        let (bx, by, bz) = (b * x, b * y, b * z);
        let entries = [a + bx * x, a + by * y, a + bz * z, bx * y, bx * z, by * z];
        for c in 0..6 {
            sums[c] += entries[c];
        }
    }
}

/// Adds energies (J) in binary64 and keeps the greatest length over rest length: law = (k, nu).
#[derive(Clone, Copy)]
pub(crate) struct Energy;

impl<P: Pack> Fold<P, P::Wide, 2> for Energy {
    #[inline(always)]
    fn fold(self, sums: &mut [P::Wide; 2], edges: &Edges<P>) {
        let length = dot(edges.d.map(P::widen), edges.d.map(P::widen)).sqrt();
        let rest_length = edges.rest_length.widen();
        let extension = length - rest_length;
        let half = P::Wide::of(0.5);
        sums[0] += half * edges.law[0].widen() * extension * extension;
        sums[1] = (length * rest_length.inverse_or_zero()).max(sums[1]);
    }
}

/// One spring, in every lane: evaluated by the same code as sixteen different ones.
fn alone<R: Real>(d: &Vec3<R>, w: &Vec3<R>, rest_length: R, law: [R; 2]) -> Edges<Portable<R>> {
    let splat = Portable::splat;
    let [d, w] = [d, w].map(|v| [v.x, v.y, v.z].map(splat));
    Edges { d, w, rest_length: splat(rest_length), law: law.map(splat) }
}

/// Force (N) on particle i of a spring: `d` = x_i - x_j (m), `dv` = v_i - v_j (m/s), rest length
/// (m), stiffness (N/m), damping (N s/m).
pub fn spring_force<R: Real>(d: &Vec3<R>, dv: &Vec3<R>, rest_length: R, stiffness: R, damping: R) -> Vec3<R> {
    let pull = Force::on(&alone(d, dv, rest_length, [stiffness, damping]));
    -vectors(pull)[0]
}

/// Derivative of the elastic force on i by x_i (N/m): -k (u uᵀ + g (I - u uᵀ)), g = 1 - l0/l as
/// `hessian` treats it.
pub fn spring_jacobian_x<R: Real>(d: &Vec3<R>, rest_length: R, stiffness: R, hessian: Hessian) -> Mat3<R> {
    let edges = alone(d, &Vec3::zeros(), rest_length, [stiffness, R::zero()]);
    let [a, b] = with_transverse(hessian, SpringBlock(edges));
    -(Mat3::identity() * a + d * d.transpose() * b)
}

/// The block of one spring.
pub(crate) struct SpringBlock<R: Real>(Edges<Portable<R>>);

impl<R: Real> SpringBlock<R> {
    pub(crate) fn new(d: &Vec3<R>, rest_length: R, law: [R; 2]) -> Self {
        Self(alone(d, &Vec3::zeros(), rest_length, law))
    }
}

impl<R: Real> WithTransverse for SpringBlock<R> {
    type Output = [R; 2];
    fn run(self, transverse: impl Transverse) -> [R; 2] {
        spring_block(&self.0, transverse).map(|pack| pack.store()[0])
    }
}

/// Derivative of the damping force on i by v_i (N s/m): -nu u uᵀ.
pub fn spring_jacobian_v<R: Real>(d: &Vec3<R>, damping: R) -> Mat3<R> {
    let length = d.norm();
    let inverse = if length > R::zero() { R::one() / length } else { R::zero() };
    -(d * d.transpose() * (damping * inverse * inverse))
}

#[cfg(test)]
mod tests {
    use super::{Hessian, spring_force, spring_jacobian_v, spring_jacobian_x};
    use crate::math::{Mat3, Vec3};

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
    fn treatments_differ_under_compression_alone() {
        let (short, long) = (Vec3::new(0.1, 0.0, 0.0), Vec3::new(1.0, 0.0, 0.0));
        let across = |d: &Vec3<f64>, hessian| spring_jacobian_x(d, 0.5, 1.0, hessian)[(1, 1)];
        assert_eq!(Hessian::ALL.map(|h| across(&short, h)), [4.0, -0.0, -4.0]);
        assert_eq!(Hessian::ALL.map(|h| across(&long, h)), [-0.5; 3]);
    }
}

//! The spring: f_i = -k (l - l0) u - nu ((v_i - v_j).u) u, with d = x_i - x_j, l = |d|, u = d/l.
//!
//! Reads d and v_i - v_j; gives the force on i (N) and its derivatives. At l = 0 the direction is
//! undefined: the force is 0 and the elastic derivative -k I, the limit for l0 = 0.

use super::super::{Hessian, rows::Edge};
use crate::math::{Mat3, Real, Vec3};

/// What an implicit step uses for the transverse stiffness ratio 1 - l0/l.
pub(crate) trait Transverse: Copy + Sync {
    /// The ratio used in place of `ratio`.
    fn ratio<R: Real>(self, ratio: R) -> R;
}

#[derive(Clone, Copy)]
struct Full;
#[derive(Clone, Copy)]
struct Clamped;
#[derive(Clone, Copy)]
struct Absolute;

impl Transverse for Full {
    #[inline(always)]
    fn ratio<R: Real>(self, ratio: R) -> R {
        ratio
    }
}

impl Transverse for Clamped {
    #[inline(always)]
    fn ratio<R: Real>(self, ratio: R) -> R {
        if ratio > R::zero() { ratio } else { R::zero() }
    }
}

impl Transverse for Absolute {
    #[inline(always)]
    fn ratio<R: Real>(self, ratio: R) -> R {
        if ratio > R::zero() { ratio } else { -ratio }
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

#[inline(always)]
fn dot<R: Real>(a: [R; 3], b: [R; 3]) -> R {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Length and its inverse, 0 for no length.
#[inline(always)]
fn length_of<R: Real>(d: [R; 3]) -> (R, R) {
    let length = dot(d, d).sqrt();
    (length, if length > R::zero() { R::one() / length } else { R::zero() })
}

/// Adds the force of one spring to its row: law = (k, nu), w = v_i - v_j.
#[inline(always)]
pub(crate) fn force_on<R: Real>(sum: &mut [R; 3], edge: Edge<R>) {
    let [stiffness, damping] = edge.law;
    let (length, inverse) = length_of(edge.d);
    let elastic = stiffness * (length - edge.rest_length) * inverse;
    let pull = elastic + damping * dot(edge.w, edge.d) * inverse * inverse;
    for c in 0..3 {
        sum[c] -= pull * edge.d[c];
    }
}

/// Coefficients of the block a I + b d dᵀ that a spring adds to M - h df/dv - h² df/dx:
/// law = (h² k, h nu).
#[inline(always)]
pub(crate) fn tangent_block<R: Real>(edge: &Edge<R>, transverse: impl Transverse) -> [R; 2] {
    let [stiffness, damping] = edge.law;
    let (_, inverse) = length_of(edge.d);
    let across = stiffness * transverse.ratio(R::one() - edge.rest_length * inverse);
    [across, (stiffness - across + damping) * inverse * inverse]
}

/// Adds the product of that block with w = p_i - p_j.
#[inline(always)]
pub(crate) fn tangent_on<R: Real>(sum: &mut [R; 3], edge: Edge<R>, transverse: impl Transverse) {
    let [a, b] = tangent_block(&edge, transverse);
    let along = b * dot(edge.w, edge.d);
    for c in 0..3 {
        sum[c] += a * edge.w[c] + along * edge.d[c];
    }
}

/// Energy of one spring (J) and its length over rest length (0 without one), in binary64:
/// law = (k, nu).
#[inline(always)]
pub(crate) fn elastic<R: Real>(edge: &Edge<R>) -> [f64; 2] {
    let d = edge.d.map(R::to_f64);
    let (length, rest) = (dot(d, d).sqrt(), edge.rest_length.to_f64());
    let extension = length - rest;
    let stretch = if rest > 0.0 { length / rest } else { 0.0 };
    [0.5 * edge.law[0].to_f64() * extension * extension, stretch]
}

fn edge_of<R: Real>(d: &Vec3<R>, w: &Vec3<R>, rest_length: R, law: [R; 2]) -> Edge<R> {
    Edge { d: [d.x, d.y, d.z], w: [w.x, w.y, w.z], rest_length, law }
}

/// Force (N) on particle i of a spring: `d` = x_i - x_j (m), `dv` = v_i - v_j (m/s), rest length
/// (m), stiffness (N/m), damping (N s/m).
pub fn spring_force<R: Real>(d: &Vec3<R>, dv: &Vec3<R>, rest_length: R, stiffness: R, damping: R) -> Vec3<R> {
    let mut sum = [R::zero(); 3];
    force_on(&mut sum, edge_of(d, dv, rest_length, [stiffness, damping]));
    Vec3::from(sum)
}

/// Derivative of the elastic force on i by x_i (N/m): -k (u uᵀ + g (I - u uᵀ)), g = 1 - l0/l as
/// `hessian` treats it.
pub fn spring_jacobian_x<R: Real>(d: &Vec3<R>, rest_length: R, stiffness: R, hessian: Hessian) -> Mat3<R> {
    struct Block<R>(Edge<R>);
    impl<R: Real> WithTransverse for Block<R> {
        type Output = [R; 2];
        fn run(self, transverse: impl Transverse) -> [R; 2] {
            tangent_block(&self.0, transverse)
        }
    }
    let edge = edge_of(d, &Vec3::zeros(), rest_length, [stiffness, R::zero()]);
    let [a, b] = with_transverse(hessian, Block(edge));
    -(Mat3::identity() * a + d * d.transpose() * b)
}

/// Derivative of the damping force on i by v_i (N s/m): -nu u uᵀ.
pub fn spring_jacobian_v<R: Real>(d: &Vec3<R>, damping: R) -> Mat3<R> {
    let (_, inverse) = length_of([d.x, d.y, d.z]);
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

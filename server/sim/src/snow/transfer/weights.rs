//! Weights of a particle on its nodes along one axis, and their slopes (Steffen, Kirby, Berzins 2008).
//! Nodes stand at i h; formulas are in docs/laws/snow.md.
//!
//! Reads x / h; writes the first node, the weights, and slopes times h: a gradient needs 1 / h.

use crate::{
    math::{Pack, Portable, Real},
    snow::settings::Kernel,
};

/// Weights of one axis in every lane: of nodes first, first + 1 ...; 0 past the kernel's width.
#[derive(Clone, Copy)]
pub(crate) struct AxisWeights<P> {
    /// x / h minus the first node.
    pub(crate) offset: P,
    /// Weights, which add up to 1.
    pub(crate) w: [P; 4],
    /// Slopes, times h.
    pub(crate) d: [P; 4],
}

/// The first node of a particle at `x_over_h`, as a whole number.
#[inline(always)]
pub(crate) fn first_node<P: Pack, const N: usize>(x_over_h: P) -> P {
    match N {
        2 => x_over_h.floor(),
        3 => (x_over_h - P::of(0.5)).floor(),
        _ => x_over_h.floor() - P::one(),
    }
}

/// Weights of a kernel of width `N`.
#[inline(always)]
pub(crate) fn axis_weights<P: Pack, const N: usize>(x_over_h: P) -> AxisWeights<P> {
    let zero = P::zero();
    let offset = x_over_h - first_node::<P, N>(x_over_h);
    let (w, d) = match N {
        2 => {
            let one = P::one();
            ([one - offset, offset, zero, zero], [P::of(-1.0), one, zero, zero])
        }
        3 => {
            let (a, b) = (P::of(1.5) - offset, offset - P::of(0.5));
            let c = offset - P::one();
            let half = P::of(0.5);
            let w = [half * a * a, P::of(0.75) - c * c, half * b * b, zero];
            (w, [-a, -(c + c), b, zero])
        }
        _ => cubic(offset - P::one()),
    };
    AxisWeights { offset, w, d }
}

/// The cubic B-spline of a particle that is t cells past its second node.
#[inline(always)]
fn cubic<P: Pack>(t: P) -> ([P; 4], [P; 4]) {
    let (half, sixth) = (P::of(0.5), P::of(1.0 / 6.0));
    let u = P::one() - t;
    let (t2, u2) = (t * t, u * u);
    let (two_thirds, two) = (P::of(2.0 / 3.0), P::of(2.0));
    let w =
        [sixth * u2 * u, two_thirds - t2 + half * t2 * t, two_thirds - u2 + half * u2 * u, sixth * t2 * t];
    let d = [-(half * u2), P::of(1.5) * t2 - two * t, two * u - P::of(1.5) * u2, half * t2];
    (w, d)
}

/// First node, weights and slopes times h of a particle at `x_over_h`, through the kernels of a
/// step; 0 past the kernel's width.
pub fn weights<R: Real>(kernel: Kernel, x_over_h: R) -> (i32, [R; 4], [R; 4]) {
    let x = Portable::splat(x_over_h);
    let (first, axis) = match kernel {
        Kernel::Linear => (first_node::<_, 2>(x), axis_weights::<_, 2>(x)),
        Kernel::Quadratic => (first_node::<_, 3>(x), axis_weights::<_, 3>(x)),
        Kernel::Cubic => (first_node::<_, 4>(x), axis_weights::<_, 4>(x)),
    };
    let lane = |pack: Portable<R>| pack.store()[0];
    (lane(first).to_f64() as i32, axis.w.map(lane), axis.d.map(lane))
}

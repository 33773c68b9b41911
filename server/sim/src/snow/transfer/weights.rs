//! Weights of a particle on its nodes along one axis, and their slopes (snow.md 0; Steffen, Kirby,
//! Berzins 2008). Nodes stand at i h.
//!
//! Reads x / h; writes the first node, the weights, and slopes times h: a gradient needs 1 / h.

use crate::math::{Pack, Portable, Real};
use crate::snow::Kernel;

/// Weights of one axis in every lane: of nodes first, first + 1 ...; 0 past the kernel's width.
#[derive(Clone, Copy)]
pub(crate) struct AxisWeights<P> {
    /// x / h minus the first node.
    pub(crate) offset: P,
    /// Weights.
    pub(crate) w: [P; 4],
    /// Slopes, times h.
    pub(crate) d: [P; 4],
}

/// The first node of a particle at `x_over_h`, as a whole number.
#[inline(always)]
pub(crate) fn first_node<R: Real, P: Pack<R>, const N: usize>(x_over_h: P) -> P {
    match N {
        2 => x_over_h.floor(),
        3 => x_over_h.sub(P::splat(R::of(0.5))).floor(),
        _ => x_over_h.floor().sub(P::splat(R::one())),
    }
}

/// Weights of a kernel of width `N`.
#[inline(always)]
pub(crate) fn axis_weights<R: Real, P: Pack<R>, const N: usize>(x_over_h: P) -> AxisWeights<P> {
    let number = |value: f64| P::splat(R::of(value));
    let zero = number(0.0);
    let offset = x_over_h.sub(first_node::<R, P, N>(x_over_h));
    let (w, d) = match N {
        2 => {
            let one = number(1.0);
            ([one.sub(offset), offset, zero, zero], [number(-1.0), one, zero, zero])
        }
        3 => {
            let (a, b) = (number(1.5).sub(offset), offset.sub(number(0.5)));
            let c = offset.sub(number(1.0));
            let half = number(0.5);
            let w = [half.mul(a).mul(a), number(0.75).sub(c.mul(c)), half.mul(b).mul(b), zero];
            (w, [zero.sub(a), zero.sub(c.add(c)), b, zero])
        }
        _ => cubic::<R, P>(offset.sub(number(1.0))),
    };
    AxisWeights { offset, w, d }
}

/// The cubic B-spline of a particle that is t cells past its second node.
#[inline(always)]
fn cubic<R: Real, P: Pack<R>>(t: P) -> ([P; 4], [P; 4]) {
    let number = |value: f64| P::splat(R::of(value));
    let (half, sixth) = (number(0.5), number(1.0 / 6.0));
    let u = number(1.0).sub(t);
    let (t2, u2) = (t.mul(t), u.mul(u));
    let (two_thirds, two) = (number(2.0 / 3.0), number(2.0));
    let w = [
        sixth.mul(u2).mul(u),
        two_thirds.sub(t2).add(half.mul(t2).mul(t)),
        two_thirds.sub(u2).add(half.mul(u2).mul(u)),
        sixth.mul(t2).mul(t),
    ];
    let d = [
        number(0.0).sub(half.mul(u2)),
        number(1.5).mul(t2).sub(two.mul(t)),
        two.mul(u).sub(number(1.5).mul(u2)),
        half.mul(t2),
    ];
    (w, d)
}

/// First node, weights and slopes times h of a particle at `x_over_h`, through the kernels of a
/// step; 0 past the kernel's width.
pub fn weights<R: Real>(kernel: Kernel, x_over_h: R) -> (i32, [R; 4], [R; 4]) {
    let x = Portable::splat(x_over_h);
    let (first, axis) = match kernel {
        Kernel::Linear => (first_node::<R, _, 2>(x), axis_weights::<R, _, 2>(x)),
        Kernel::Quadratic => (first_node::<R, _, 3>(x), axis_weights::<R, _, 3>(x)),
        Kernel::Cubic => (first_node::<R, _, 4>(x), axis_weights::<R, _, 4>(x)),
    };
    let lane = |pack: Portable<R>| pack.store()[0];
    (lane(first).to_f64() as i32, axis.w.map(lane), axis.d.map(lane))
}

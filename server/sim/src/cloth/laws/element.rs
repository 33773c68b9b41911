//! What a law of elements says: elements join a few particles each, and all that a step needs of them follows from an
//! energy.

use serde::{Deserialize, Serialize};

use super::threads::Threads;
use crate::{math::Pack, mesh::TriangleMesh};

/// What its mesh makes of the bending stiffness of a plate.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bending {
    /// The stiffness that the elements alone would have, where the mesh may relax, over the one that is asked for: all
    /// energy is divided by it. 1 where nothing was measured.
    pub factor: f64,
    /// Poisson's ratio that the mesh brings: the stiffness against spheres less that against saddles, over their sum.
    pub poisson: f64,
    /// Triangles by which both were measured; 0: the mesh is too narrow.
    pub measured: usize,
    /// Curvatures that the six points of an element hardly tell, and that nothing resists therefore.
    pub dropped: usize,
}

/// The elements of a mesh under a law.
#[derive(Default)]
pub(crate) struct Found<const N: usize, const C: usize> {
    /// The particles of each.
    pub(crate) particles: Vec<[u32; N]>,
    /// Numbers of each that never change.
    pub(crate) rest: Vec<[f64; C]>,
    /// What the mesh makes of a plate, under the law that is one.
    pub(crate) bending: Option<Bending>,
}

impl<const N: usize, const C: usize> Found<N, C> {
    /// Adds an element.
    pub(super) fn add(&mut self, particles: [u32; N], rest: [f64; C]) {
        self.particles.push(particles);
        self.rest.push(rest);
    }
}

/// A law of elements of `N` particles, each with `C` numbers that never change and `F` numbers that an evaluation freezes.
///
/// With stiffness k and damping nu of the body's law, an element has the energy k W(x), and its particles feel the
/// forces -k dW/dx - nu H v, where H is the frozen second derivative of W. A law with F > 0 has an H that changes with the
/// state, of two parts: what does not depend on loads, which is positive semi-definite and alone damps, and what loads add,
/// of which a [`Treatment`] says how it counts. A law with F = 0 has one H for all states, positive semi-definite, so that an
/// implicit step has one solution.
pub(crate) trait ElementLaw<const N: usize, const C: usize, const F: usize> {
    /// Elements of a mesh at rest as it lies; those without a shape to resist with are left out.
    fn elements(mesh: &TriangleMesh, threads: &Threads) -> Found<N, C>;

    /// W, dW/dx and what is frozen of H at positions `x`. Mark it and the others `#[inline(always)]`.
    fn evaluate<P: Pack>(rest: [P; C], x: [[P; 3]; N], treatment: Treatment<P>) -> Evaluated<P, N, F>;

    /// The product H w, from what was frozen.
    fn product<P: Pack>(rest: [P; C], frozen: [P; F], w: [[P; 3]; N]) -> [[P; 3]; N];

    /// Blocks of H on its diagonal, one per particle: xx, yy, zz, xy, xz, yz.
    fn diagonal<P: Pack>(rest: [P; C], frozen: [P; F]) -> [[P; 6]; N];

    /// Numbers s_i with w.H w <= sum of s_i |w_i|² for every w: what each particle adds to the bound of an explicit step. Of
    /// a law with F > 0 at rest.
    fn shares(rest: [f64; C]) -> [f64; N];

    /// Of a law with F > 0: what shares at positions `x` have beyond those at rest.
    #[inline(always)]
    fn beyond<P: Pack>(_rest: [P; C], _x: [[P; 3]; N]) -> Beyond<P, N> {
        Beyond { all: [P::zero(); N], loads: [P::zero(); N] }
    }

    /// Of a law with F > 0: the square of the greatest rate at which an element is stretched or turned, in its length at rest
    /// (1/s²), from the velocities `v` of its particles.
    #[inline(always)]
    fn rate<P: Pack>(_rest: [P; C], _v: [[P; 3]; N]) -> P {
        P::zero()
    }

    /// Of a law with F > 0: about how long the sides of an element are at rest (m).
    fn size(_rest: [f64; C]) -> f64 {
        0.0
    }
}

/// How the part of H counts that is there under loads alone.
#[derive(Clone, Copy)]
pub(crate) struct Treatment<P> {
    /// What its negative eigenvalues are multiplied by, if that makes them greater: 1, 0 or -1, or between.
    pub(crate) mirror: P,
    /// What it is multiplied by beside the other part, which alone damps: h k / (h k + nu) in the matrix of a step, 0 in a
    /// force of damping.
    pub(crate) elastic: P,
}

/// What the bounds of an explicit step have beyond those at rest.
pub(crate) struct Beyond<P, const N: usize> {
    /// What shares have more than at rest, of each particle.
    pub(crate) all: [P; N],
    /// The share of what loads add to H, of each particle.
    pub(crate) loads: [P; N],
}

/// Sixteen elements, evaluated.
pub(crate) struct Evaluated<P: Pack, const N: usize, const F: usize> {
    /// W, in binary64.
    pub(crate) energy: P::Wide,
    /// dW/dx of each particle.
    pub(crate) gradient: [[P; 3]; N],
    /// What [`ElementLaw::product`] needs of H.
    pub(crate) frozen: [P; F],
    /// The greatest length over that at rest; 0 under a law that does not resist stretching.
    pub(crate) stretch: P,
}

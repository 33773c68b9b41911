//! What a law of elements says: elements join a few particles each, and all that a step needs of them follows from an
//! energy.

use crate::{math::Pack, mesh::TriangleMesh};

/// A law of elements of `N` particles, each with `C` numbers that never change and `F` numbers that an evaluation freezes.
///
/// With stiffness k and damping nu of the body's law, an element has the energy k W(x), and its particles feel the
/// forces -k dW/dx - nu H v, where H is the frozen second derivative of W: positive semi-definite, so that an implicit
/// step has one solution.
pub(crate) trait ElementLaw<const N: usize, const C: usize, const F: usize> {
    /// Elements of a mesh: the particles of each.
    fn elements(mesh: &TriangleMesh) -> Vec<[u32; N]>;

    /// Numbers of an element from where its particles are at rest (m); none where it has no shape to resist with.
    fn rest(x: [[f64; 3]; N]) -> Option<[f64; C]>;

    /// W, dW/dx and what is frozen of H at positions `x`. Mark it and the others `#[inline(always)]`.
    fn evaluate<P: Pack>(rest: [P; C], x: [[P; 3]; N]) -> Evaluated<P, N, F>;

    /// The product H w, from what was frozen.
    fn product<P: Pack>(rest: [P; C], frozen: [P; F], w: [[P; 3]; N]) -> [[P; 3]; N];

    /// Blocks of H on its diagonal, one per particle: xx, yy, zz, xy, xz, yz.
    fn diagonal<P: Pack>(rest: [P; C], frozen: [P; F]) -> [[P; 6]; N];

    /// Numbers s_i with w.H w <= sum of s_i |w_i|² for every w: what each particle adds to the bound of an explicit step.
    fn shares(rest: [f64; C]) -> [f64; N];
}

/// Sixteen elements, evaluated.
pub(crate) struct Evaluated<P: Pack, const N: usize, const F: usize> {
    /// W, in binary64.
    pub(crate) energy: P::Wide,
    /// dW/dx of each particle.
    pub(crate) gradient: [[P; 3]; N],
    /// What [`ElementLaw::product`] needs of H.
    pub(crate) frozen: [P; F],
}

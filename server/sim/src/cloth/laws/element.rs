//! What a law of elements says: elements join a few particles each, and all that a step needs of them follows from an
//! energy.

use serde::{Deserialize, Serialize};

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
/// forces -k dW/dx - nu H v, where H is the frozen second derivative of W: positive semi-definite, so that an implicit
/// step has one solution.
pub(crate) trait ElementLaw<const N: usize, const C: usize, const F: usize> {
    /// Elements of a mesh at rest as it lies; those without a shape to resist with are left out.
    fn elements(mesh: &TriangleMesh) -> Found<N, C>;

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

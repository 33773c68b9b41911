//! The laws of cloth: what joins particles, and what the air does to triangles, a file each.

mod spring;
mod threads;
mod element;
mod quadratic_bending;
mod plate;
mod membrane;
mod air;

pub use air::Air;
pub(super) use air::third;
pub use element::Bending;
pub(super) use element::{Beyond, ElementLaw, Evaluated, Found, Treatment};
pub(super) use membrane::Membrane;
pub(super) use plate::Plate;
pub(super) use quadratic_bending::QuadraticBending;
pub(super) use spring::{Spring, Stretch};
pub use spring::{spring_force, spring_jacobian_v, spring_jacobian_x};
pub(super) use threads::no_warp;
pub use threads::{Threads, Warp, WarpError};

use crate::{mesh::TriangleMesh, names::names};

/// The laws of elements: each with its name in scene files, the number of particles of an element, of numbers that never
/// change and of numbers that an evaluation freezes.
macro_rules! with_element_laws {
    ($then:ident) => {
        $then! {
            QuadraticBending("quadratic_bending", 4, 3, 0),
            Plate("plate", 6, 15, 0),
            Membrane("membrane", 3, 7, 12),
        }
    };
}
pub(super) use with_element_laws;

macro_rules! kinds {
    ($($law:ident($name:literal, $n:literal, $c:literal, $f:literal),)+) => {
        /// A law of elements of a body.
        #[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, PartialOrd, Ord, serde::Serialize, serde::Deserialize)]
        pub enum ElementKind {
            $(#[doc = concat!("`", $name, "`: see docs/laws/", $name, ".md.")] $law,)+
        }

        names!(ElementKind { $($law: $name),+ });

        impl ElementKind {
            /// Particles of one element.
            pub(super) const fn particles(self) -> usize {
                match self {
                    $(Self::$law => $n,)+
                }
            }

            /// Numbers of one element that never change.
            pub(super) const fn rest_numbers(self) -> usize {
                match self {
                    $(Self::$law => $c,)+
                }
            }

            /// Elements of a mesh at rest as it lies.
            pub(super) fn list(self, mesh: &TriangleMesh, threads: &Threads) -> Listed {
                match self {
                    $(Self::$law => list::<$law, $n, $c, $f>(mesh, threads),)+
                }
            }

            /// The sum of the shares of all particles of elements with these numbers, at rest: what times their stiffness
            /// springs have that is four times that of each.
            pub(super) fn total_share(self, rest: &[f64]) -> f64 {
                match self {
                    $(Self::$law => {
                        let of_element = |rest: &[f64; $c]| <$law as ElementLaw<$n, $c, $f>>::shares(*rest).iter().sum::<f64>();
                        rest.as_chunks::<$c>().0.iter().map(of_element).sum()
                    })+
                }
            }
        }
    };
}
with_element_laws!(kinds);

/// The elements of a mesh under a law, one after the other.
pub(super) struct Listed {
    /// The particles of one element after the other.
    pub(super) particles: Vec<u32>,
    /// Numbers that never change.
    pub(super) rest: Vec<f64>,
    /// What the mesh makes of a plate, under the law that is one.
    pub(super) bending: Option<Bending>,
}

fn list<L: ElementLaw<N, C, F>, const N: usize, const C: usize, const F: usize>(
    mesh: &TriangleMesh,
    threads: &Threads,
) -> Listed {
    let Found { particles, rest, bending } = L::elements(mesh, threads);
    Listed { particles: particles.into_flattened(), rest: rest.into_flattened(), bending }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Mat3, Pack, Portable, Vec3, array::dot};

    type Lane = Portable<f64>;

    /// Numbers of [-1, 1], the same in every run.
    fn noise(i: usize) -> f64 {
        let hash = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        ((hash ^ (hash >> 29)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    /// Points of a triangle and of its neighbours, moved by noise: as many as an element has.
    fn corners<const N: usize>(seed: usize, by: f64) -> [[f64; 3]; N] {
        const BASE: [[f64; 3]; 6] = [
            [0.0, 0.0, 0.0],
            [1.0, 0.0, 0.0],
            [0.4, 0.9, 0.0],
            [0.5, -0.8, 0.0],
            [1.3, 0.8, 0.0],
            [-0.6, 0.7, 0.0],
        ];
        std::array::from_fn(|i| std::array::from_fn(|c| BASE[i][c] + by * noise(seed + 3 * i + c)))
    }

    /// The triangles between such points.
    fn mesh<const N: usize>(points: [[f64; 3]; N]) -> TriangleMesh {
        const TRIANGLES: [[u32; 3]; 4] = [[0, 1, 2], [1, 0, 3], [2, 1, 4], [0, 2, 5]];
        let is_there = |triangle: &[u32; 3]| triangle.iter().all(|corner| (*corner as usize) < N);
        TriangleMesh {
            points: points.to_vec(),
            triangles: TRIANGLES.into_iter().filter(is_there).collect(),
            ..TriangleMesh::default()
        }
    }

    fn lanes<const N: usize>(x: [[f64; 3]; N]) -> [[Lane; 3]; N] {
        x.map(|x| x.map(Lane::splat))
    }

    fn first<const N: usize>(x: [[Lane; 3]; N]) -> [[f64; 3]; N] {
        x.map(|x| x.map(|c| c.store()[0]))
    }

    struct Element<L, const N: usize, const C: usize, const F: usize> {
        rest: [f64; C],
        law: std::marker::PhantomData<L>,
    }

    impl<L: ElementLaw<N, C, F>, const N: usize, const C: usize, const F: usize> Element<L, N, C, F> {
        fn evaluate(&self, x: [[f64; 3]; N]) -> (f64, [[f64; 3]; N], [Lane; F]) {
            self.treat(x, 1.0)
        }

        /// The same with negative parts of the tangent multiplied by `mirror`.
        fn treat(&self, x: [[f64; 3]; N], mirror: f64) -> (f64, [[f64; 3]; N], [Lane; F]) {
            let treatment = Treatment { mirror: Lane::splat(mirror), elastic: Lane::one() };
            let Evaluated { energy, gradient, frozen, .. } =
                L::evaluate(self.rest.map(Lane::splat), lanes(x), treatment);
            (energy.store()[0], first(gradient), frozen)
        }

        fn product(&self, frozen: [Lane; F], w: [[f64; 3]; N]) -> [[f64; 3]; N] {
            first(L::product(self.rest.map(Lane::splat), frozen, lanes(w)))
        }

        /// The gradient against differences of the energy.
        fn check_gradient(&self, x: [[f64; 3]; N]) {
            let (_, gradient, _) = self.evaluate(x);
            for (corner, c) in (0..N).flat_map(|corner| (0..3).map(move |c| (corner, c))) {
                let energy = |by: f64| {
                    let mut moved = x;
                    moved[corner][c] += by;
                    self.evaluate(moved).0
                };
                let slope = (energy(1e-5) - energy(-1e-5)) / 2e-5;
                let found = gradient[corner][c];
                assert!((slope - found).abs() < 1e-8 * (1.0 + found.abs()), "{corner}.{c}: {slope}, {found}");
            }
        }

        /// The exact tangent against differences of the gradient.
        fn check_exact_tangent(&self, x: [[f64; 3]; N]) {
            let (_, _, frozen) = self.evaluate(x);
            for (corner, c) in (0..N).flat_map(|corner| (0..3).map(move |c| (corner, c))) {
                let gradient = |by: f64| {
                    let mut moved = x;
                    moved[corner][c] += by;
                    self.evaluate(moved).1
                };
                let [after, before] = [gradient(1e-5), gradient(-1e-5)];
                let mut w = [[0.0; 3]; N];
                w[corner][c] = 1.0;
                let found = self.product(frozen, w);
                for (other, axis) in (0..N).flat_map(|other| (0..3).map(move |axis| (other, axis))) {
                    let slope = (after[other][axis] - before[other][axis]) / 2e-5;
                    let found = found[other][axis];
                    assert!((slope - found).abs() < 1e-6 * (1.0 + found.abs()), "{slope}, {found}");
                }
            }
        }

        /// A frozen tangent without negative parts is symmetric, positive semi-definite and within its shares; its diagonal
        /// is its own.
        fn check_tangent(&self, x: [[f64; 3]; N]) {
            self.check_treated(x, -1.0, f64::INFINITY);
            self.check_treated(x, 0.0, 1.0 + 1e-12);
        }

        /// The same with negative parts multiplied by `mirror`, and up to so many shares.
        fn check_treated(&self, x: [[f64; 3]; N], mirror: f64, most: f64) {
            let (_, _, frozen) = self.treat(x, mirror);
            let diagonal = L::diagonal(self.rest.map(Lane::splat), frozen);
            let shares = self.shares(x);
            let all = |a: [[f64; 3]; N], b: [[f64; 3]; N]| -> f64 {
                a.into_iter().zip(b).map(|(a, b)| dot(a, b)).sum()
            };
            for seed in 0..20 {
                let [u, w]: [[[f64; 3]; N]; 2] = [corners(1000 + seed, 2.0), corners(2000 + seed, 2.0)];
                let [hu, hw] = [u, w].map(|v| self.product(frozen, v));
                assert!((all(w, hu) - all(u, hw)).abs() < 1e-12 * all(u, hu).max(1.0), "symmetry");
                assert!(all(w, hw) > -1e-12, "positive semi-definite");
                let bound: f64 = w.iter().zip(shares).map(|(w, share)| share * dot(*w, *w)).sum();
                assert!(all(w, hw) <= bound * most, "{} above {bound}", all(w, hw));
            }
            for corner in 0..N {
                let [xx, yy, zz, xy, xz, yz] = diagonal[corner].map(|entry| entry.store()[0]);
                let block = Mat3::new(xx, xy, xz, xy, yy, yz, xz, yz, zz);
                for c in 0..3 {
                    let mut w = [[0.0; 3]; N];
                    w[corner][c] = 1.0;
                    let found = Vec3::from(self.product(frozen, w)[corner]);
                    assert!((found - block.column(c)).norm() < 1e-12 * block.norm().max(1.0));
                }
            }
        }

        /// Shares at positions: those at rest, and what there is beyond them, if anything changes.
        fn shares(&self, x: [[f64; 3]; N]) -> [f64; N] {
            let Beyond { all, loads } = L::beyond(self.rest.map(Lane::splat), lanes(x));
            let at_rest = L::shares(self.rest);
            let [all, loads] = [all, loads].map(|of| of.map(|share| share.store()[0]));
            assert!(all.iter().chain(&loads).all(|share| *share >= 0.0));
            std::array::from_fn(|corner| at_rest[corner] + all[corner])
        }

        /// Neither a displacement nor a rotation of all changes the energy.
        fn check_rigid_motion(&self, x: [[f64; 3]; N]) {
            let turn = nalgebra::Rotation3::from_euler_angles(0.7, -1.1, 2.3);
            let moved = x.map(|x| (turn * Vec3::from(x) + Vec3::new(3.0, -2.0, 5.0)).into());
            let (before, after) = (self.evaluate(x).0, self.evaluate(moved).0);
            assert!((before - after).abs() < 1e-12 * before.max(1.0), "{before}, then {after}");
        }
    }

    fn check<L: ElementLaw<N, C, F>, const N: usize, const C: usize, const F: usize>() {
        for seed in 0..10 {
            let threads = Threads { shares: [1.0, 0.7, 0.3], ..Threads::default() };
            let found = L::elements(&mesh(corners::<N>(100 * seed, 0.2)), &threads);
            assert!(!found.rest.is_empty(), "a mesh of elements with a shape");
            for rest in found.rest {
                let element = Element::<L, N, C, F> { rest, law: std::marker::PhantomData };
                let x = corners(100 * seed + 50, 0.6);
                element.check_gradient(x);
                element.check_exact_tangent(x);
                element.check_tangent(x);
                element.check_rigid_motion(x);
            }
        }
    }

    /// On triangles thousands to a million million times as long as wide all stays finite, and no tangent has a negative part
    /// beyond rounding.
    fn check_thin<L: ElementLaw<N, C, F>, const N: usize, const C: usize, const F: usize>() {
        for flat in [1e-3, 1e-7, 1e-12] {
            let thin = corners::<N>(7, 0.2).map(|[x, y, z]| [x, flat * y, flat * z]);
            for rest in L::elements(&mesh(thin), &Threads::default()).rest {
                let element = Element::<L, N, C, F> { rest, law: std::marker::PhantomData };
                for x in [thin, corners(50, 0.6)] {
                    let (energy, gradient, frozen) = element.treat(x, -1.0);
                    let w = corners::<N>(3000, 2.0);
                    let push = element.product(frozen, w);
                    let numbers = gradient.as_flattened().iter().chain(push.as_flattened());
                    assert!(
                        energy >= 0.0 && numbers.chain([&energy]).all(|number| number.is_finite()),
                        "{flat}"
                    );
                    let pairs = || w.iter().zip(&push);
                    let form: f64 = pairs().map(|(w, push)| dot(*w, *push)).sum();
                    let sizes = pairs().map(|(w, push)| (dot(*w, *w) * dot(*push, *push)).sqrt());
                    assert!(form >= -1e-9 * sizes.sum::<f64>(), "{flat}: {form}");
                }
            }
        }
    }

    macro_rules! check_all {
        ($($law:ident($name:literal, $n:literal, $c:literal, $f:literal),)+) => {
            #[test]
            fn every_law_is_the_derivative_of_its_energy_and_moves_with_the_cloth() {
                $(check::<$law, $n, $c, $f>();)+
            }

            #[test]
            fn every_law_stays_finite_on_triangles_that_are_nearly_lines() {
                $(check_thin::<$law, $n, $c, $f>();)+
            }
        };
    }
    with_element_laws!(check_all);
}

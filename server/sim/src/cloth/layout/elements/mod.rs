//! Elements of three to six particles: what they add to the rows of a block, and what is frozen of them.

mod numbers;
mod evaluate;
mod project;
mod parts;
mod shares;

pub(crate) use numbers::{BlockOfRows, ElementFigures, ElementNumbers};

use std::ops::Range;

use super::{halo::behind, lists::Lists, scratch::BlockScratch};
use crate::{
    cloth::{
        laws::{ElementKind, ElementLaw, Membrane, Plate, QuadraticBending, with_element_laws},
        network::ElementList,
        settings::{Aim, RightHandSide},
    },
    linalg::{CoarseLayout, NineByNine, TakeParts},
    math::{LANES, Mat3, Pack, Padded, Portable, Real, Record, three},
};

/// Elements of `N` particles, in packs of sixteen, with `C` numbers each.
#[derive(Clone, Debug)]
pub(crate) struct Packs<R, const N: usize, const C: usize> {
    lists: Lists<N>,
    /// Numbers that never change.
    rest: Vec<[[R; LANES]; C]>,
}

impl<R: Real, const N: usize, const C: usize> Packs<R, N, C> {
    /// Lists elements by block, each in every block that it touches; `place` gives the model's numbering.
    fn new(list: &ElementList, block_size: usize, place: &[u32]) -> Self {
        let (of_element, mut rest) = (list.rest.as_chunks::<C>().0, Vec::new());
        let mut tell = |of_lanes: &[usize; LANES]| {
            rest.push(std::array::from_fn(|c| of_lanes.map(|element| R::of(of_element[element][c]))));
        };
        let lists = Lists::new(list.particles.as_chunks::<N>().0, block_size, place, &mut tell);
        Self { lists, rest }
    }

    /// The numbers of a pack and both vectors of its particles.
    #[inline(always)]
    fn gather<P: Pack<Number = R>>(
        &self,
        pack: usize,
        records: &[Record<R>],
    ) -> ([P; C], [[P; 3]; N], [[P; 3]; N]) {
        let (x, y) = self.lists.gather(pack, records);
        let mut rest = [P::zero(); C];
        for c in 0..C {
            rest[c] = P::load(&self.rest[pack][c]);
        }
        (rest, x, y)
    }

    /// Adds H w of a block's elements, times what stands before H in the matrix.
    #[inline(always)]
    fn multiply<L: ElementLaw<N, C, F>, P: Pack<Number = R>, const F: usize>(
        &self,
        at: BlockOfRows<'_, R>,
        numbers: &ElementNumbers<R>,
        frozen: &[[R; LANES]],
        scratch: &mut BlockScratch<R>,
    ) {
        assert!(scratch.records.len() >= self.lists.room(), "room for a block and its halo");
        let first = self.lists.packs(at.block).start;
        for (halo, packs) in self.lists.halos.parts(at.block) {
            halo.copy(behind(&mut scratch.records, self.lists.block_size), at.fields);
            for pack in packs {
                let (rest, _, w) = self.gather::<P>(pack, &scratch.records);
                let mut tangent = [P::zero(); F];
                for f in 0..F {
                    tangent[f] = P::load(&frozen[(pack - first) * F + f]);
                }
                let product = L::product(rest, tangent, w);
                for corner in 0..N {
                    let of_corner = product[corner];
                    scratch
                        .corners
                        .add(self.lists.names(pack, corner), three!(|c| of_corner[c] * numbers.matrix));
                }
            }
        }
    }

    /// Hands over the blocks of H in a row: `add(other particle, block)`.
    fn add_row<L: ElementLaw<N, C, F>, const F: usize>(
        &self,
        row: usize,
        frozen: &[[R; LANES]],
        add: &mut dyn FnMut(u32, Mat3<R>),
    ) {
        for (pack, lane, corner) in self.lists.touching(row) {
            let rest = std::array::from_fn(|c| Portable::load(&self.rest[pack][c]));
            let tangent = std::array::from_fn(|f| Portable::load(&frozen[pack * F + f]));
            for other in 0..N {
                let column = |axis: usize| {
                    let mut w = [[Portable::zero(); 3]; N];
                    w[other][axis] = Portable::one();
                    L::product(rest, tangent, w)[corner].map(|entry| entry.store()[lane])
                };
                let columns = [column(0), column(1), column(2)];
                let block = Mat3::from_fn(|r, c| columns[c][r]);
                add(self.lists.particle(row, pack, [other, lane]), block);
            }
        }
    }
}

macro_rules! lists {
    ($($law:ident($name:literal, $n:literal, $c:literal, $f:literal),)+) => {
        /// The elements of a body under one law.
        #[derive(Clone, Debug)]
        pub(crate) enum Elements<R> {
            $($law(Packs<R, $n, $c>),)+
        }

        impl<R: Real> Elements<R> {
            /// Lists elements by block; `place` gives the model's numbering.
            pub(crate) fn new(list: &ElementList, block_size: usize, place: &[u32]) -> Self {
                match list.kind {
                    $(ElementKind::$law => Self::$law(Packs::new(list, block_size, place)),)+
                }
            }

            /// Which law they follow.
            pub(crate) const fn kind(&self) -> ElementKind {
                match self {
                    $(Self::$law(_) => ElementKind::$law,)+
                }
            }

            /// Records that a block copies, at most.
            pub(crate) fn room(&self) -> usize {
                match self {
                    $(Self::$law(packs) => packs.lists.room(),)+
                }
            }

            /// Packs of frozen numbers of all blocks.
            pub(crate) fn frozen_count(&self) -> usize {
                match self {
                    $(Self::$law(packs) => packs.lists.particles.len() * $f,)+
                }
            }

            /// Those of a block.
            pub(crate) fn frozen(&self, block: usize) -> Range<usize> {
                match self {
                    $(Self::$law(packs) => {
                        let packs = packs.lists.packs(block);
                        packs.start * $f..packs.end * $f
                    })+
                }
            }

            /// Adds to the sums of a block's rows and freezes tangents: see [`Packs::evaluate`].
            #[inline(always)]
            pub(crate) fn evaluate<P: Pack<Number = R>, A: Aim>(
                &self,
                at: BlockOfRows<'_, R>,
                numbers: &ElementNumbers<R>,
                side: (RightHandSide, R),
                frozen: &mut [[R; LANES]],
                scratch: &mut BlockScratch<R>,
            ) -> ElementFigures {
                match self {
                    $(Self::$law(packs) => {
                        packs.evaluate::<$law, P, $f, A>(at, numbers, side, frozen, scratch)
                    })+
                }
            }

            /// Freezes the tangents of a block alone: see [`Packs::freeze`].
            #[inline(always)]
            pub(crate) fn freeze<P: Pack<Number = R>>(
                &self,
                at: BlockOfRows<'_, R>,
                numbers: &ElementNumbers<R>,
                mirror: R,
                frozen: &mut [[R; LANES]],
                scratch: &mut BlockScratch<R>,
            ) {
                match self {
                    $(Self::$law(packs) => {
                        packs.freeze::<$law, P, $f>(at, numbers, mirror, frozen, scratch);
                    })+
                }
            }

            /// The sum of about how long the sides of elements are at rest (m), and how many were counted: see
            /// [`Packs::sizes`].
            pub(crate) fn sizes(&self) -> [f64; 2] {
                match self {
                    $(Self::$law(packs) => packs.sizes::<$law, $f>(),)+
                }
            }

            /// Tells of the stretch of elements: see [`Packs::tell_stretch`].
            pub(crate) fn tell_stretch(&self, x: &[Padded<R>], tell: &mut dyn FnMut([usize; 2], f64)) {
                match self {
                    $(Self::$law(packs) => packs.tell_stretch::<$law, $f>(x, tell),)+
                }
            }

            /// Adds products to the sums of a block's rows: see [`Packs::multiply`].
            #[inline(always)]
            pub(crate) fn multiply<P: Pack<Number = R>>(
                &self,
                at: BlockOfRows<'_, R>,
                numbers: &ElementNumbers<R>,
                frozen: &[[R; LANES]],
                scratch: &mut BlockScratch<R>,
            ) {
                match self {
                    $(Self::$law(packs) => packs.multiply::<$law, P, $f>(at, numbers, frozen, scratch),)+
                }
            }

            /// Adds to the matrix on a coarse space: see [`Packs::project`].
            #[inline(always)]
            pub(crate) fn project<P: Pack<Number = R>>(
                &self,
                at: (usize, &CoarseLayout),
                scale: f64,
                frozen: &[[R; LANES]],
                to: &mut [NineByNine],
            ) {
                match self {
                    $(Self::$law(packs) => packs.project::<$law, P::Wide, $f>(at, scale, frozen, to),)+
                }
            }

            /// Hands over the blocks of elements at rows of a block: see [`Packs::hand_over`].
            #[inline(always)]
            pub(crate) fn hand_over<P: Pack<Number = R>>(
                &self,
                block: usize,
                scale: f64,
                frozen: &[[R; LANES]],
                take: &mut dyn TakeParts,
            ) {
                match self {
                    $(Self::$law(packs) => {
                        packs.hand_over::<$law, P::Wide, $f>(block, scale, frozen, take)
                    })+
                }
            }

            /// Hands over the blocks of H in a row: see [`Packs::add_row`].
            pub(crate) fn add_row(
                &self,
                row: usize,
                frozen: &[[R; LANES]],
                add: &mut dyn FnMut(u32, Mat3<R>),
            ) {
                match self {
                    $(Self::$law(packs) => packs.add_row::<$law, $f>(row, frozen, add),)+
                }
            }

            /// Particles that elements join to a row, some more than once.
            pub(crate) fn row(&self, row: usize) -> Vec<u32> {
                match self {
                    $(Self::$law(packs) => packs
                        .lists
                        .touching(row)
                        .flat_map(|(pack, lane, _)| {
                            (0..$n).map(move |corner| packs.lists.particle(row, pack, [corner, lane]))
                        })
                        .collect(),)+
                }
            }

            /// Adds shares of the energy: see [`Packs::add_energies`].
            pub(crate) fn add_energies(&self, x: &[Padded<R>], stiffness: f64, energies: &mut [f64]) {
                match self {
                    $(Self::$law(packs) => packs.add_energies::<$law, $f>(x, stiffness, energies),)+
                }
            }

            /// Adds shares of the bound of an explicit step: see [`Packs::add_shares`].
            pub(crate) fn add_shares(&self, shares: &mut [f64]) {
                match self {
                    $(Self::$law(packs) => packs.add_shares::<$law, $f>(shares),)+
                }
            }
        }
    };
}
with_element_laws!(lists);

#[cfg(test)]
mod tests;

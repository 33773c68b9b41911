//! Between the rows of a block and the unknowns of its patches.

use super::{
    functions::{WIDTH, width},
    gather::BlockFunctions,
    layout::PatchLayout,
    singles::Singles,
};
use crate::{
    linalg::sixteens::add_lanes,
    math::{LANES, Pack, Real, Sixteen, Vec3, WithSimd, dispatch},
};

/// A block of rows and its functions.
#[derive(Clone, Copy)]
pub(super) struct Block<'a> {
    pub(super) layout: &'a PatchLayout,
    pub(super) number: usize,
    pub(super) functions: &'a BlockFunctions,
}

/// Writes Pᵀ r of a block, patch after patch.
pub(super) fn restrict<R: Real>(block: Block<'_>, r: &[Sixteen<R>], to: &mut [f32]) {
    dispatch(Restrict { block, r, to });
}

/// Adds P c to a block, of which the unknowns of each patch begin where `places` says.
pub(super) fn prolong<R: Real>(block: Block<'_>, places: &[u32], c: &[f32], z: &mut [Sixteen<R>]) {
    dispatch(Prolong { block, places, c, z });
}

/// The functions of a number in whole packs, 0 beyond them.
#[inline(always)]
fn load<W: Pack<Number = f64>>(functions: &[Singles], packs: usize) -> [W; WIDTH / LANES] {
    let mut loaded = [W::zero(); WIDTH / LANES];
    for pack in 0..packs {
        loaded[pack] = W::from_singles(&functions[pack].0);
    }
    loaded
}

struct Restrict<'a, R> {
    block: Block<'a>,
    r: &'a [Sixteen<R>],
    to: &'a mut [f32],
}

impl<R: Real> WithSimd<R> for Restrict<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { block: Block { layout, number, functions }, r, to } = self;
        let first = number * layout.block_size;
        let mut begin = 0;
        for (in_block, patch) in layout.of_block(number).enumerate() {
            let count = functions.places[in_block].count;
            let (packs, of_patch) = (width(count), functions.of(in_block, 0));
            let mut sums = [P::Wide::zero(); WIDTH / LANES];
            for (member, row) in layout.rows(patch).iter().enumerate() {
                let (group, lane) = ((*row as usize - first) / LANES, *row as usize % LANES);
                for c in 0..3 {
                    let of_number = load::<P::Wide>(&of_patch[(3 * member + c) * packs..], packs);
                    let value = r[group].0[c][lane].to_f64();
                    for pack in 0..WIDTH / LANES {
                        sums[pack] += of_number[pack] * value;
                    }
                }
            }
            for (pack, to) in to[begin..begin + count].chunks_mut(LANES).enumerate() {
                to.copy_from_slice(&sums[pack].to_singles()[..to.len()]);
            }
            begin += count;
        }
    }
}

struct Prolong<'a, R> {
    block: Block<'a>,
    places: &'a [u32],
    c: &'a [f32],
    z: &'a mut [Sixteen<R>],
}

impl<R: Real> WithSimd<R> for Prolong<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let Self { block: Block { layout, number, functions }, places, c, z } = self;
        let first = number * layout.block_size;
        for (in_block, patch) in layout.of_block(number).enumerate() {
            let count = functions.places[in_block].count;
            let (packs, of_patch) = (width(count), functions.of(in_block, 0));
            let mut change = [Singles::ZERO; WIDTH / LANES];
            let start = places[patch] as usize;
            for (pack, from) in c[start..start + count].chunks(LANES).enumerate() {
                change[pack].0[..from.len()].copy_from_slice(from);
            }
            let change = load::<P::Wide>(&change, packs);
            for (member, row) in layout.rows(patch).iter().enumerate() {
                let (group, lane) = ((*row as usize - first) / LANES, *row as usize % LANES);
                let mut added = [0.0; 3];
                for axis in 0..3 {
                    let of_number = load::<P::Wide>(&of_patch[(3 * member + axis) * packs..], packs);
                    let mut sums = P::Wide::zero();
                    for pack in 0..WIDTH / LANES {
                        sums += of_number[pack] * change[pack];
                    }
                    added[axis] = add_lanes(sums.store());
                }
                let sum = z[group].get(lane) + Vec3::new(added[0], added[1], added[2]).map(R::of);
                z[group].set(lane, sum);
            }
        }
    }
}

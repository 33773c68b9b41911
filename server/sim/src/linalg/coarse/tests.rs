//! The V-cycle: symmetric, positive definite, and near the inverse.

use std::sync::Arc;

use super::{
    CoarseInverse, CoarseLayout, CoarseMatrix, CoarseVectors, NineByNine, Unknowns,
    cycle::products,
    nine::{add_product, place},
};
use crate::{
    math::{LANES, Sixteen, Vec3},
    parallel::{Communicator, Message, Ranks, Share, hilbert_order},
};

const BLOCK_SIZE: usize = 32;
/// Blocks along each side of a sheet: enough for three levels.
const SIDE: usize = 16;

/// Rows 8 by 4 are a block, 2 by 2 blocks an aggregate of the next level and so on.
fn rest() -> Vec<[f64; 3]> {
    let even_bits = |i: usize| (0..4).map(|bit| (i >> (2 * bit) & 1) << bit).sum::<usize>();
    let row = |i: usize| {
        let (block, inside) = (i / BLOCK_SIZE, i % BLOCK_SIZE);
        let (x, y) = (8 * even_bits(block) + inside % 8, 4 * even_bits(block / 2) + inside / 8);
        [x as f64, 0.2 * x as f64, y as f64]
    };
    (0..SIDE * SIDE * BLOCK_SIZE).map(row).collect()
}

/// Pairs of rows at a distance of about 1, joined by springs of different stiffness along x, y and z.
fn pairs(rest: &[[f64; 3]]) -> Vec<[u32; 2]> {
    let mut place = std::collections::BTreeMap::new();
    for (i, [x, _, z]) in (0..).zip(rest) {
        place.insert((*x as i64, *z as i64), i);
    }
    let near = |(x, z): (i64, i64)| [(x + 1, z), (x, z + 1), (x + 1, z + 1)];
    place
        .iter()
        .flat_map(|(at, i)| near(*at).into_iter().filter_map(|to| place.get(&to)).map(move |j| [*i, *j]))
        .collect()
}

/// Stiffness of a pair along each axis, and the mass of a row.
const STIFFNESS: [f64; 3] = [100.0, 3.0, 40.0];
const MASS: f64 = 0.05;

fn matrix(layout: &CoarseLayout, count: usize, pairs: &[[u32; 2]]) -> CoarseMatrix {
    let mut matrix = CoarseMatrix::default();
    matrix.fill(layout, &|block, blocks: &mut [NineByNine]| {
        blocks.fill([[0.0; 12]; 9]);
        let mut add = |[i, j]: [usize; 2], values: [f64; 3]| {
            if i / BLOCK_SIZE != block {
                return;
            }
            let at = layout.place(layout.aggregate(i), layout.aggregate(j));
            let (here, there) = (layout.at(i), layout.at(j));
            for m in 0..3 {
                for q in 0..3 {
                    for c in 0..3 {
                        blocks[at][3 * q + c][4 * m + c] += values[c] * here[m] * there[q];
                    }
                }
            }
        };
        for i in 0..count {
            add([i, i], [MASS; 3]);
        }
        for pair in pairs {
            let [i, j] = pair.map(|row| row as usize);
            for ends in [[i, i], [j, j]] {
                add(ends, STIFFNESS);
            }
            for ends in [[i, j], [j, i]] {
                add(ends, STIFFNESS.map(|k| -k));
            }
        }
    });
    matrix
}

/// A x on the blocks.
fn product(layout: &CoarseLayout, matrix: &CoarseMatrix, x: &[Unknowns]) -> Vec<Unknowns> {
    let finest = &layout.levels[0];
    let row = |i: usize| {
        let mut y = [0.0; 12];
        for k in finest.row(i) {
            add_product(&mut y, &matrix.levels[0].blocks[k], &x[finest.columns[k] as usize]);
        }
        y
    };
    (0..x.len()).map(row).collect()
}

fn dot(a: &[Unknowns], b: &[Unknowns]) -> f64 {
    a.iter().flatten().zip(b.iter().flatten()).map(|(a, b)| a * b).sum()
}

/// Numbers between -1 and 1 without an order.
fn scattered(blocks: usize, salt: u64) -> Vec<Unknowns> {
    let number = |i: u64| ((i * i * 2_654_435_761 + i * salt) % 2003) as f64 / 1001.0 - 1.0;
    let one = |block: usize| {
        let mut x = [0.0; 12];
        (0..9).for_each(|c| x[place(c)] = number((9 * block + c) as u64));
        x
    };
    (0..blocks).map(one).collect()
}

#[test]
fn a_cycle_is_symmetric_and_each_takes_a_good_part_of_the_error() {
    let rest = rest();
    let pairs = pairs(&rest);
    let mut is_free = vec![true; rest.len()];
    is_free[3] = false;
    let layout = CoarseLayout::new(&rest, &is_free, BLOCK_SIZE, pairs.iter().copied());
    let layout = layout.expect("few neighbours");
    assert_eq!(layout.levels.len(), 3);
    let matrix = matrix(&layout, rest.len(), &pairs);

    let blocks = rest.len() / BLOCK_SIZE;
    let inverse = CoarseInverse { layout: &layout, matrix: &matrix };
    let mut vectors = CoarseVectors::default();
    inverse.make_room(&mut vectors);
    let mut cycle = |b: &[Unknowns]| {
        let mut x = vec![[0.0; 12]; blocks];
        inverse.solve(&[], &mut b.to_vec(), &mut x, &mut vectors);
        x
    };

    let [a, b] = [scattered(blocks, 5), scattered(blocks, 77)];
    let [one, other] = [dot(&a, &cycle(&b)), dot(&b, &cycle(&a))];
    assert!((one - other).abs() < 1e-12 * dot(&a, &cycle(&a)), "{one} and {other}");

    let mut error = a;
    let mut energy = dot(&error, &product(&layout, &matrix, &error));
    for _ in 0..40 {
        let change = cycle(&product(&layout, &matrix, &error));
        error.iter_mut().flatten().zip(change.iter().flatten()).for_each(|(e, c)| *e -= c);
        let left = dot(&error, &product(&layout, &matrix, &error));
        // In the norm of the energy, in which a positive definite cycle below the inverse brings every error down.
        assert!(left < 0.81 * energy, "{left:e} of {energy:e}");
        energy = left;
    }
}

#[test]
fn rows_that_are_joined_at_random_are_refused() {
    let count = 256 * BLOCK_SIZE as u32;
    let rest: Vec<_> = (0..count).map(|i| [f64::from(i), 0.0, 0.0]).collect();
    let pairs = (0..200 * count)
        .map(|i| [i % count, i.wrapping_mul(2_654_435_761).wrapping_add(i / count * 40_503) % count]);
    let refused = CoarseLayout::new(&rest, &vec![true; rest.len()], BLOCK_SIZE, pairs);
    assert!(refused.is_err_and(|message| message.contains("more than 64 others")));
}

#[test]
fn restriction_is_the_transpose_of_prolongation_in_blocks_of_several_parts() {
    // Two strips that nothing joins, in turn, and a last block that is not full.
    let count = 3 * BLOCK_SIZE + 21;
    let at = |i: usize| [(i / 2) as f64, 0.1 * (i % 2) as f64, 0.0];
    let rest: Vec<_> = (0..count).map(at).collect();
    let is_free: Vec<_> = (0..count).map(|i| i % 13 != 5).collect();
    let pairs = (0..count as u32 - 2).map(|i| [i, i + 2]);
    let layout = CoarseLayout::new(&rest, &is_free, BLOCK_SIZE, pairs).expect("few neighbours");
    assert_eq!(layout.per_block(), 2);
    let matrix = CoarseMatrix::default();
    let inverse = CoarseInverse { layout: &layout, matrix: &matrix };

    let number = |i: usize| ((i * i * 37 + i) % 101) as f64 / 50.0 - 1.0;
    let r: Vec<Vec3<f64>> = (0..count).map(|i| Vec3::new(number(i), number(i + 7), number(3 * i))).collect();
    let r = Sixteen::from_vectors(&r);
    for (block, r) in r.chunks(BLOCK_SIZE / LANES).enumerate() {
        let change = [scattered(1, block as u64 + 3)[0], scattered(1, block as u64 + 9)[0]];
        let mut restricted = [[0.0; 12]; 2];
        inverse.restrict(block, r, &mut restricted);
        let mut z = vec![Sixteen::default(); r.len()];
        inverse.prolong(block, &change, &mut z);

        let mut product = 0.0;
        for (i, (r, z)) in r.iter().zip(&z).enumerate() {
            for lane in 0..LANES {
                let row = block * BLOCK_SIZE + i * LANES + lane;
                product += r.get(lane).dot(&z.get(lane));
                let functions = if row < count { layout.at(row) } else { [0.0; 3] };
                let part = if row < count { layout.part(row) } else { 0 };
                for c in 0..3 {
                    let expected: f64 = (0..3).map(|m| functions[m] * change[part][4 * m + c]).sum();
                    assert!((z.get(lane)[c] - expected).abs() < 1e-14);
                }
            }
        }
        let transposed = dot(&restricted, &change);
        assert!((product - transposed).abs() < 1e-12, "{product} {transposed}");
    }
}

/// One of four ranks, that is not asked to say anything.
#[derive(Debug)]
struct Silent {
    rank: usize,
    divides_from: usize,
}

impl Communicator for Silent {
    fn rank(&self) -> usize {
        self.rank
    }
    fn size(&self) -> usize {
        4
    }
    fn divides_from(&self) -> usize {
        self.divides_from
    }
    fn all_gather(&self, _: &[u8], _: &[usize], _: &mut Vec<u8>) {
        unreachable!("nothing is summed");
    }
    fn exchange(&self, _: &mut [Message]) {
        unreachable!("nothing is computed");
    }
    fn gather(&self, _: &[u8], _: &[usize]) -> Vec<u8> {
        unreachable!("nothing is looked at");
    }
}

#[test]
fn a_cycle_that_four_ranks_divide_makes_fewer_than_half_of_the_products_of_one() {
    let (side, block_size) = (240, 256);
    let points: Vec<_> = (0..side * side).map(|i| [(i % side) as f64, 0.0, (i / side) as f64]).collect();
    let mut place = vec![0; points.len()];
    let order = hilbert_order(&points, 1.0);
    order.iter().enumerate().for_each(|(row, old)| place[*old as usize] = row as u32);
    let rest: Vec<_> = order.iter().map(|old| points[*old as usize]).collect();
    let ends = |i: usize| {
        let (x, z) = (i % side, i / side);
        let near = [(x + 1, z), (x, z + 1), (x + 1, z + 1), (x + 2, z), (x, z + 2)];
        near.into_iter().filter(|(x, z)| *x < side && *z < side).map(move |(x, z)| [i, z * side + x])
    };
    let pairs = || (0..points.len()).flat_map(ends).map(|pair| pair.map(|i| place[i]));
    let layout = CoarseLayout::new(&rest, &vec![true; rest.len()], block_size, pairs()).expect("a sheet");
    let of_rank = |rank: usize, divides_from: usize| {
        let ranks = Ranks::new(Arc::new(Silent { rank, divides_from }));
        let share = Share::of(rest.len(), block_size, pairs(), &ranks);
        let layout = layout.clone().over(&share);
        products(&layout.levels, &layout.reach())
    };
    let alike = of_rank(0, usize::MAX);
    for rank in 0..4 {
        let divided = of_rank(rank, 0);
        assert!(100 * divided <= 45 * alike, "{divided} of {alike} on rank {rank}");
    }
}

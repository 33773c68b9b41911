//! Which particles may move at once where they move one by one: no spring or element joins two of them.
//!
//! Blocks have colours. Blocks of one colour work at the same time, each on its rows, one group after the other; what they
//! read of other blocks rests meanwhile. Rows of a block are ordered so that those of a group may move at once; where that
//! cannot be, the group is visited again. All is greedy in the order of numbers, and depends on the scene alone.

use crate::{interrupt, math::LANES};

/// The colours of blocks, and the order in which the rows of each move.
#[derive(Clone, Debug)]
pub(crate) struct Colours {
    blocks: Vec<u32>,
    count: u32,
    /// First visit of each block, and one more.
    starts: Vec<u32>,
    visits: Vec<Visit>,
}

/// Rows of a group that move at once.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Visit {
    /// The group, counted within the block.
    pub(crate) group: u16,
    /// A bit for each of its rows.
    lanes: u16,
}

impl Visit {
    /// 1 for rows that move, 0 for the others.
    pub(crate) fn mask(self) -> [f32; LANES] {
        std::array::from_fn(|lane| f32::from(self.lanes >> lane & 1))
    }
}

impl Colours {
    /// From all pairs of rows that springs or elements join.
    pub(crate) fn new(
        count: usize,
        block_size: usize,
        pairs: impl Iterator<Item = [u32; 2]> + Clone,
    ) -> Self {
        let of = |size: usize| move |pair: [u32; 2]| pair.map(|row| row / size as u32);
        let blocks = lowest(count.div_ceil(block_size), pairs.clone().map(of(block_size)));
        let within = pairs.filter(|pair| {
            let [one, other] = of(LANES)(*pair);
            one == other
        });
        let rows = lowest(count, within);

        let (mut starts, mut visits) = (vec![0], Vec::new());
        for rows in rows.chunks(block_size) {
            interrupt::point();
            for (group, rows) in (0..).zip(rows.chunks(LANES)) {
                for colour in 0..=rows.iter().copied().max().unwrap_or(0) {
                    let of_colour = rows.iter().enumerate().filter(|(_, row)| **row == colour);
                    let lanes = of_colour.fold(0, |lanes, (lane, _)| lanes | 1 << lane);
                    visits.push(Visit { group, lanes });
                }
            }
            starts.push(visits.len() as u32);
        }
        let count = blocks.iter().max().map_or(0, |last| last + 1);
        Self { blocks, count, starts, visits }
    }

    /// How many colours blocks have.
    pub(crate) fn count(&self) -> u32 {
        self.count
    }

    /// The colour of a block.
    pub(crate) fn of_block(&self, block: usize) -> u32 {
        self.blocks[block]
    }

    /// Which rows of a block move, one visit after the other.
    pub(crate) fn visits(&self, block: usize) -> &[Visit] {
        &self.visits[self.starts[block] as usize..self.starts[block + 1] as usize]
    }
}

/// The order of rows within blocks so that no pair is in one group, as far as that can be; otherwise as in `order`.
pub(crate) fn spread(order: &[u32], block_size: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<u32> {
    let size = block_size as u32;
    let mut neighbours = vec![Vec::new(); order.len()];
    for [a, b] in pairs.filter(|[a, b]| a != b && a / size == b / size) {
        interrupt::point();
        neighbours[a as usize].push(b);
        neighbours[b as usize].push(a);
    }

    let mut spread = Vec::with_capacity(order.len());
    let mut group_of = vec![None; order.len()];
    for rows in order.chunks(block_size) {
        interrupt::point();
        let mut groups: Vec<Vec<u32>> = rows.chunks(LANES).map(|_| Vec::new()).collect();
        let room: Vec<usize> = rows.chunks(LANES).map(<[u32]>::len).collect();
        let mut left = Vec::new();
        for &row in rows {
            let mut taken = vec![false; groups.len()];
            for group in neighbours[row as usize].iter().filter_map(|&other| group_of[other as usize]) {
                taken[group] = true;
            }
            match (0..groups.len()).find(|&group| !taken[group] && groups[group].len() < room[group]) {
                Some(group) => {
                    groups[group].push(row);
                    group_of[row as usize] = Some(group);
                }
                None => left.push(row),
            }
        }
        let mut left = left.into_iter();
        for (group, room) in groups.iter_mut().zip(room) {
            let missing = room - group.len();
            group.extend(left.by_ref().take(missing));
        }
        spread.extend(groups.into_iter().flatten());
    }
    spread
}

/// The lowest colour of each of `count` that none of its neighbours of a lower number has.
fn lowest(count: usize, pairs: impl Iterator<Item = [u32; 2]>) -> Vec<u32> {
    let mut lower = vec![Vec::new(); count];
    for [a, b] in pairs {
        interrupt::point();
        if a != b {
            lower[a.max(b) as usize].push(a.min(b));
        }
    }

    let mut colours: Vec<u32> = Vec::with_capacity(count);
    for lower in &lower {
        interrupt::point();
        let mut taken: Vec<u32> = lower.iter().map(|&other| colours[other as usize]).collect();
        taken.sort_unstable();
        taken.dedup();
        let free = (0..).zip(&taken).find(|(colour, taken)| colour != *taken);
        colours.push(free.map_or(taken.len() as u32, |(colour, _)| colour));
    }
    colours
}

#[cfg(test)]
mod tests {
    use super::{Colours, lowest, spread};
    use crate::math::LANES;

    /// Pairs of a chain.
    fn chain(count: u32) -> impl Iterator<Item = [u32; 2]> {
        (1..count).map(|i| [i, i - 1])
    }

    #[test]
    fn neighbours_differ_in_colour_and_few_colours_are_taken() {
        let all = |a: u32, b: u32| (0..4).flat_map(move |i| (0..4).map(move |j| [4 * a + i, 4 * b + j]));
        // Four cliques in a row, each joined to the next.
        let pairs: Vec<_> = (0..4).flat_map(|a| all(a, a).chain(all(a, (a + 1).min(3)))).collect();
        let colours = lowest(16, pairs.iter().copied());
        for [a, b] in pairs {
            assert!(a == b || colours[a as usize] != colours[b as usize], "{a} and {b}: {colours:?}");
        }
        assert_eq!(colours.iter().max(), Some(&7));
        assert_eq!(lowest(5, chain(5)), [0, 1, 0, 1, 0]);
        assert_eq!(lowest(3, std::iter::empty()), [0, 0, 0]);
    }

    #[test]
    fn every_row_moves_once_in_a_sweep_and_neighbours_apart() {
        let (count, size) = (75, 32);
        let order: Vec<u32> = (0..count as u32).collect();
        let spread = spread(&order, size, chain(count as u32));
        let mut place = vec![0; count];
        spread.iter().enumerate().for_each(|(new, &old)| place[old as usize] = new as u32);
        let pairs: Vec<_> = chain(count as u32).map(|pair| pair.map(|row| place[row as usize])).collect();
        let colours = Colours::new(count, size, pairs.iter().copied());
        assert_eq!([0, 1, 2].map(|block| colours.of_block(block)), [0, 1, 0]);
        for block in 0..3 {
            let rows = block * size..count.min((block + 1) * size);
            let mut moves = vec![0; rows.len()];
            for visit in colours.visits(block) {
                let first = usize::from(visit.group) * LANES;
                let moving: Vec<_> =
                    (0..LANES).filter(|&lane| visit.mask()[lane] > 0.0).map(|lane| first + lane).collect();
                let at_once = |row: &u32| moving.iter().any(|other| rows.start + other == *row as usize);
                assert!(!pairs.iter().any(|pair| pair.iter().all(at_once)), "block {block}: {moving:?}");
                for row in moving {
                    moves[row] += 1;
                }
            }
            assert_eq!(moves, vec![1; rows.len()], "block {block}");
            assert!(
                colours.visits(block).len() <= rows.len().div_ceil(LANES) + 1,
                "few groups are visited twice"
            );
        }
    }
}

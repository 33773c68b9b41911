//! The parts of each block: rows that are joined within it, and that lie flat.
//!
//! Neighbours along a Hilbert curve may belong to two layers of a fold, or to two sheets of which one lies on the other.
//! No affine function moves one layer without the other; so each becomes an aggregate of its own.

use std::{cmp::Reverse, collections::BinaryHeap};

use crate::{
    interrupt,
    linalg::rows::filed,
    math::{Vec3, vec3},
};

/// Parts of a block, at most.
pub(super) const MOST: usize = 8;
/// Rows of a part, at least; smaller ones go with the largest.
const SMALLEST: usize = 4;
/// A part is folded where two of its rows are more than so many times as far from each other along springs as through the
/// air. Along the springs of a flat grid it is up to 1.41.
const FOLDED: f64 = 2.0;

/// Pairs of rows that the matrix joins within their block.
pub(super) struct Links {
    starts: Vec<u32>,
    others: Vec<u32>,
}

impl Links {
    pub(super) fn within_blocks(
        count: usize,
        block_size: usize,
        pairs: impl Iterator<Item = [u32; 2]> + Clone,
    ) -> Self {
        let size = block_size as u32;
        let within = pairs.filter(|[i, j]| i != j && i / size == j / size).inspect(|_| interrupt::point());
        let [starts, others] = filed(count, within);
        Self { starts, others }
    }

    fn of(&self, row: u32) -> &[u32] {
        &self.others[self.starts[row as usize] as usize..self.starts[row as usize + 1] as usize]
    }
}

/// The part of its block that each row is in, from 0.
pub(super) fn parts_of_blocks(rest: &[[f64; 3]], block_size: usize, links: &Links) -> Vec<u8> {
    let mut parts = vec![0; rest.len()];
    for (block, parts) in parts.chunks_mut(block_size).enumerate() {
        interrupt::point();
        let first = (block * block_size) as u32;
        let work = Block { rest, links, first, count: parts.len() };
        for (number, rows) in (0_u8..).zip(work.parts()) {
            for row in rows {
                parts[(row - first) as usize] = number;
            }
        }
    }
    parts
}

struct Block<'a> {
    rest: &'a [[f64; 3]],
    links: &'a Links,
    first: u32,
    count: usize,
}

impl Block<'_> {
    /// The rows of each part, the largest first.
    fn parts(&self) -> Vec<Vec<u32>> {
        let (mut whole, mut left): (Vec<Vec<u32>>, Vec<u32>) = (Vec::new(), Vec::new());
        let mut is_seen = vec![false; self.count];
        for row in self.first..self.first + self.count as u32 {
            if !is_seen[(row - self.first) as usize] {
                let part: Vec<u32> = self.distances(row, None).iter().map(|(row, _)| *row).collect();
                for row in &part {
                    is_seen[(row - self.first) as usize] = true;
                }
                if part.len() < SMALLEST { left.extend(part) } else { whole.push(part) }
            }
        }

        let mut flat = Vec::new();
        whole.sort_by_key(Vec::len);
        while let Some(part) = whole.pop() {
            if part.len() < SMALLEST {
                left.extend(part);
            } else if let Some(halves) = self.halves(&part).filter(|_| whole.len() + flat.len() + 1 < MOST) {
                whole.extend(halves);
            } else {
                flat.push(part);
            }
        }
        flat.sort_by_key(|part| (Reverse(part.len()), part.iter().copied().min()));
        left.extend(flat.drain(flat.len().min(MOST)..).flatten());
        match flat.first_mut() {
            Some(largest) => largest.extend(left),
            None => flat.push(left),
        }
        flat
    }

    /// The two halves of a folded part: rows nearer to one or to the other of two that lie on each other.
    fn halves(&self, part: &[u32]) -> Option<[Vec<u32>; 2]> {
        if part.len() < 4 * SMALLEST {
            return None;
        }
        let (one, _) = *self.distances(part[0], Some(part)).last()?;
        let from_one = self.distances(one, Some(part));
        let (_, farthest) = *from_one.last()?;
        let mut most: Option<(f64, u32)> = None;
        for &(row, distance) in from_one.iter().filter(|(_, distance)| *distance > 0.5 * farthest) {
            let fold = distance / self.apart(one, row);
            if fold > most.map_or(FOLDED, |(fold, _)| fold) {
                most = Some((fold, row));
            }
        }
        let (_, other) = most?;
        let to_other = self.distances(other, Some(part));
        let mut nearness = vec![f64::INFINITY; self.count];
        for (row, distance) in &to_other {
            nearness[(row - self.first) as usize] = *distance;
        }
        let is_near = |(row, distance): &(u32, f64)| *distance <= nearness[(row - self.first) as usize];
        let (near, far): (Vec<_>, Vec<_>) = from_one.into_iter().partition(is_near);
        Some([near, far].map(|half| half.into_iter().map(|(row, _)| row).collect()))
    }

    fn apart(&self, i: u32, j: u32) -> f64 {
        let at = |row: u32| -> Vec3<f64> { vec3(self.rest[row as usize]) };
        (at(i) - at(j)).norm()
    }

    /// Rows that links lead to from one, within a part if one is given, with their distances along the links, the
    /// nearest first; of equal ones, the row of smaller number.
    fn distances(&self, from: u32, part: Option<&[u32]>) -> Vec<(u32, f64)> {
        let mut is_allowed = vec![part.is_none(); self.count];
        part.into_iter().flatten().for_each(|row| is_allowed[(row - self.first) as usize] = true);
        // Numbers that are not negative are in the order of their bits.
        let mut queue: BinaryHeap<Reverse<(u64, u32)>> = BinaryHeap::from([Reverse((0, from))]);
        let mut found = Vec::new();
        while let Some(Reverse((bits, row))) = queue.pop() {
            if !std::mem::take(&mut is_allowed[(row - self.first) as usize]) {
                continue;
            }
            let distance = f64::from_bits(bits);
            found.push((row, distance));
            for &other in self.links.of(row) {
                if is_allowed[(other - self.first) as usize] {
                    queue.push(Reverse(((distance + self.apart(row, other)).to_bits(), other)));
                }
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::{Links, parts_of_blocks};

    /// A strip of 4 by 16 rows in one block, with its diagonals, at places that `at` gives.
    fn parts(at: impl Fn(usize, usize) -> [f64; 3], joins: impl Fn([usize; 2]) -> bool) -> Vec<u8> {
        let rest: Vec<_> = (0..64).map(|i| at(i / 4, i % 4)).collect();
        let offsets = [(0, 1), (1, 0), (1, 1)];
        let pairs: Vec<[u32; 2]> = (0..64)
            .flat_map(|i| offsets.map(|(r, c)| [i, i + 4 * r + c, i % 4 + c]))
            .filter(|[i, j, column]| *column < 4 && *j < 64 && joins([*i, *j]))
            .map(|[i, j, _]| [i as u32, j as u32])
            .collect();
        parts_of_blocks(&rest, 64, &Links::within_blocks(64, 64, pairs.iter().copied()))
    }

    #[test]
    fn a_flat_block_is_one_part() {
        assert_eq!(parts(|r, c| [r as f64, 0.0, c as f64], |_| true), [0; 64]);
    }

    #[test]
    fn rows_that_nothing_joins_are_parts_of_their_own() {
        // The second eight rows lie on the first.
        let parts =
            parts(|r, c| [(r % 8) as f64, 0.01 * (r / 8) as f64, c as f64], |[i, j]| i / 32 == j / 32);
        assert_eq!(parts, (0..64).map(|i| (i / 32) as u8).collect::<Vec<_>>());
    }

    #[test]
    fn a_folded_strip_is_cut_at_its_fold() {
        let parts = parts(|r, c| [r.min(15 - r) as f64, 0.01 * (r / 8) as f64, c as f64], |_| true);
        let cut = (0..64).filter(|i| parts[*i] == parts[0]).count();
        assert!((24..=40).contains(&cut), "{parts:?}");
        assert_ne!(parts[0], parts[63]);
    }

    #[test]
    fn a_few_rows_apart_go_with_the_others_and_nothing_is_lost() {
        assert_eq!(parts(|r, c| [r as f64, 0.0, c as f64], |[i, j]| i > 1 && j > 1), [0; 64]);
        assert_eq!(parts(|r, c| [r as f64, 0.0, c as f64], |_| false), [0; 64]);
    }
}

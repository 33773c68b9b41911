//! The parts of a cloth that move by themselves: each component that no pin holds, all that pins hold as one, and the corners of each figure.
//!
//! What a part has is added up piece by piece: a piece is what a block of rows has of a part.

use crate::{
    cloth::network::Components,
    math::{Mat3, Real, Vec3},
    parallel::{Share, block_count},
};

/// Pieces of which parts are told apart: so many per block, and so many beside.
const MOST_PER_BLOCK: usize = 2;
const MOST_BESIDE: usize = 1024;

/// The parts of a model, in the order of their first rows.
#[derive(Clone, Debug, Default)]
pub(crate) struct Parts {
    /// Where the pieces of each block begin, and one more.
    starts: Vec<u32>,
    /// The part of each piece.
    of_piece: Vec<u32>,
    /// The part of each row.
    of_row: Vec<u32>,
    all: Vec<Part>,
    /// The rows that are pinned, but for corners of figures.
    pins: Vec<u32>,
}

/// What is known of a part.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Part {
    /// Mass of its free rows (kg), and how many they are.
    pub(crate) mass: f64,
    pub(crate) count: u32,
    /// Whether pins or frames hold it.
    pub(crate) is_held: bool,
    /// How many corners it has, where it is a figure.
    pub(crate) led: u32,
}

/// What colliders push a part with in a solve: impulses (N s), and by how much less they give per velocity of the part (kg).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Pushed {
    pub(crate) impulse: Vec3<f64>,
    pub(crate) matrix: Mat3<f64>,
}

impl Parts {
    /// From the components of a model, masses of its rows (kg) and their inverses, 0 for pins, and the number of the figure of which each row is a
    /// corner. Where there are very many, what no pin holds is one part: what parts take does not grow with their number.
    pub(crate) fn new<R: Real>(
        components: &Components,
        masses: [&[R]; 2],
        block_size: usize,
        led: &[Option<usize>],
    ) -> Self {
        let most = MOST_PER_BLOCK * block_count(components.row_count(), block_size) + MOST_BESIDE;
        let each = Self::of(components, masses, block_size, led, |component| component);
        if each.of_piece.len() <= most {
            return each;
        }
        Self::of(components, masses, block_size, led, |_| 0)
    }

    /// The same with loose components as one that have the same number.
    fn of<R: Real>(
        components: &Components,
        [m, inv_m]: [&[R]; 2],
        block_size: usize,
        led: &[Option<usize>],
        number: impl Fn(usize) -> usize,
    ) -> Self {
        let rows = components.row_count();
        let mut made = Self::default();
        let (mut of_component, mut held) = (vec![None; components.count()], None);
        let mut of_figure = vec![None; led.iter().flatten().max().map_or(0, |last| last + 1)];
        for (row, figure) in led.iter().enumerate().take(rows) {
            let component = components.of_row(row);
            let is_held = components.is_pinned(component);
            let known = match figure {
                Some(figure) => &mut of_figure[*figure],
                None if is_held => &mut held,
                None => &mut of_component[number(component)],
            };
            let part = *known.get_or_insert_with(|| {
                made.all.push(Part { is_held, ..Part::default() });
                made.all.len() as u32 - 1
            });
            made.of_row.push(part);
            let part = &mut made.all[part as usize];
            if inv_m[row] > R::zero() {
                part.mass += m[row].to_f64();
                part.count += 1;
            } else if figure.is_some() {
                part.led += 1;
            } else {
                made.pins.push(row as u32);
            }
        }
        for block in 0..block_count(rows, block_size) {
            let first = block * block_size;
            made.starts.push(made.of_piece.len() as u32);
            let mut of_block = made.of_row[first..rows.min(first + block_size)].to_vec();
            of_block.sort_unstable();
            of_block.dedup();
            made.of_piece.extend(of_block);
        }
        made.starts.push(made.of_piece.len() as u32);
        made
    }

    /// What is known of each part.
    pub(crate) fn all(&self) -> &[Part] {
        &self.all
    }

    /// Whether some part is free of pins.
    pub(crate) fn any_is_loose(&self) -> bool {
        self.all.iter().any(|part| !part.is_held)
    }

    /// The rows that are pinned, but for corners of figures.
    pub(crate) fn pins(&self) -> &[u32] {
        &self.pins
    }

    /// The part of a row.
    pub(crate) fn of_row(&self, row: usize) -> usize {
        self.of_row[row] as usize
    }

    /// Where the pieces of each block begin, and one more.
    pub(crate) fn starts(&self) -> &[u32] {
        &self.starts
    }

    /// Where among the pieces of a block that of a row is.
    pub(crate) fn piece_of(&self, block: usize, row: usize) -> usize {
        let pieces = &self.of_piece[self.starts[block] as usize..self.starts[block + 1] as usize];
        if pieces.len() == 1 { 0 } else { pieces.partition_point(|part| *part < self.of_row[row]) }
    }

    /// Adds up numbers of all pieces, part by part.
    pub(crate) fn sum<const K: usize>(&self, pieces: &[[f64; K]], sums: &mut Vec<[f64; K]>) {
        sums.clear();
        sums.resize(self.all.len(), [0.0; K]);
        for (part, piece) in self.of_piece.iter().zip(pieces) {
            let sum = &mut sums[*part as usize];
            sum.iter_mut().zip(piece).for_each(|(sum, number)| *sum += number);
        }
    }

    /// The pieces of the blocks that a rank computes.
    pub(crate) fn pieces_of(&self, share: &Share, rank: usize) -> std::ops::Range<usize> {
        let blocks = share.blocks_of(rank);
        self.starts[blocks.start] as usize..self.starts[blocks.end] as usize
    }
}

#[cfg(test)]
mod tests {
    use super::{MOST_BESIDE, MOST_PER_BLOCK, Part, Parts};
    use crate::cloth::network::Components;

    #[test]
    fn what_pins_hold_is_one_part_and_the_rest_are_components() {
        // 0-2 loose, 1-3 held by the pin 3, 4 loose alone, 5-6 held by the pin 6.
        let inv_m = [1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 0.0];
        let m = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0];
        let components = Components::new(7, &inv_m, [[0, 2], [1, 3], [5, 6]].into_iter());
        let parts = Parts::new(&components, [&m, &inv_m], 4, &[None; 7]);
        let part = |mass, count, is_held| Part { mass, count, is_held, led: 0 };
        assert_eq!(parts.all(), [part(5.0, 2, false), part(34.0, 2, true), part(16.0, 1, false)]);
        assert_eq!((parts.starts(), parts.pins()), (&[0, 2, 4][..], &[3, 6][..]));
        let pieces: Vec<_> = (0..7).map(|row| parts.piece_of(row / 4, row)).collect();
        assert_eq!(pieces, [0, 1, 0, 1, 1, 0, 0]);
        let mut sums = Vec::new();
        parts.sum(&[[1.0], [2.0], [4.0], [8.0]], &mut sums);
        assert_eq!(sums, [[1.0], [6.0], [8.0]]);
    }

    #[test]
    fn corners_of_each_figure_are_a_part_and_no_pins() {
        // 0 held by the pin 2, 1 and 3 corners of a figure, 4 one of another figure, 5 loose.
        let inv_m = [1.0, 0.0, 0.0, 0.0, 0.0, 1.0];
        let m = [1.0, 9.0, 2.0, 9.0, 9.0, 4.0];
        let components = Components::new(6, &inv_m, [[0, 2]].into_iter());
        let led = [None, Some(0), None, Some(0), Some(1), None];
        let parts = Parts::new(&components, [&m, &inv_m], 4, &led);
        let part = |mass, count, led| Part { mass, count, is_held: true, led };
        let loose = Part { is_held: false, ..part(4.0, 1, 0) };
        assert_eq!(parts.all(), [part(1.0, 1, 0), part(0.0, 0, 2), part(0.0, 0, 1), loose]);
        assert_eq!(parts.pins(), [2]);
    }

    #[test]
    fn a_swarm_is_one_part_and_takes_no_more_than_a_sheet() {
        for (count, parts) in [(MOST_BESIDE, MOST_BESIDE), (MOST_BESIDE + 900, 1)] {
            let masses = vec![1.0; count];
            let components = Components::new(count, &masses, std::iter::empty());
            let made = Parts::new(&components, [&masses, &masses], 256, &vec![None; count]);
            assert_eq!(made.all().len(), parts, "{count} particles");
            assert_eq!(made.all().iter().map(|part| part.count).sum::<u32>(), count as u32);
            let most = MOST_PER_BLOCK * count.div_ceil(256) + MOST_BESIDE;
            assert!(made.of_piece.len() <= most, "{count} particles");
        }
    }
}

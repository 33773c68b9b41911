//! Springs as a sparse matrix in sliced ELLPACK with slices of sixteen rows (SELL-16; Monakov et al.
//! 2010), rows not sorted by length: row i holds the springs of particle i.
//!
//! Every particle adds its own springs, in a fixed order, so that rows run in parallel, nothing is
//! scattered, and no result depends on who computes it. Spring s of each of the sixteen rows of a
//! slice makes a slot, evaluated in one pack of lanes. Both ends of a spring compute it: the two forces
//! are exact opposites.
#![allow(unsafe_code, reason = "lanes read neighbours whose range was checked when the rows were built")]

use std::ops::Range;

use crate::{
    interrupt,
    math::{LANES, Pack, Padded, Real, Vec3},
};

/// The law of a slot whose lanes have different ones.
const MIXED: u16 = u16::MAX;

/// A spring in the model's numbering.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Joint {
    pub(super) ends: [u32; 2],
    pub(super) rest_length: f64,
    pub(super) law: u16,
}

/// Springs by row, in sliced ELLPACK.
#[derive(Clone, Debug)]
pub struct Sell<R> {
    /// Number of rows: of particles.
    count: usize,
    /// First slot of each group of rows, and one more.
    starts: Vec<u32>,
    /// Other end of the spring in each lane; a lane without one names its own row.
    neighbours: Vec<[u32; LANES]>,
    /// Rest length (m) in each lane.
    rest_lengths: Vec<[R; LANES]>,
    /// Law of all lanes, or `MIXED`.
    laws: Vec<u16>,
    /// Laws of the lanes of mixed slots: empty unless there are any.
    lane_laws: Vec<[u16; LANES]>,
    /// Index into `lane_laws` of each slot; empty unless there are any.
    lane_index: Vec<u32>,
}

/// Sixteen springs seen from one of their ends.
#[derive(Clone, Copy)]
pub(super) struct Edges<P> {
    /// Own position less the other's (m).
    pub(super) d: [P; 3],
    /// The same of the second field.
    pub(super) w: [P; 3],
    /// Rest length (m).
    pub(super) rest_length: P,
    /// The pair of numbers of their laws.
    pub(super) law: [P; 2],
}

/// Adds a spring in each lane to the sums of its row. A lane without a spring has d = w = 0 and
/// rest length 0.
pub(super) trait Fold<P, T, const A: usize>: Copy {
    /// Mark it `#[inline(always)]`.
    fn fold(self, sums: &mut [T; A], edges: &Edges<P>);
}

impl<R: Real> Sell<R> {
    /// Gathers springs by row. A block's rows are in groups of their own.
    pub(super) fn new(count: usize, block_size: usize, joints: &[Joint]) -> Self {
        assert!(block_size.is_multiple_of(LANES), "groups of rows lie within a block");
        let mut rows: Vec<Vec<(u16, u32, R)>> = vec![Vec::new(); count];
        for &Joint { ends: [a, b], rest_length, law } in joints {
            interrupt::point();
            rows[a as usize].push((law, b, R::of(rest_length)));
            rows[b as usize].push((law, a, R::of(rest_length)));
        }

        for row in &mut rows {
            interrupt::point();
            row.sort_by(|a, b| (a.0, a.1).cmp(&(b.0, b.1)).then(a.2.to_f64().total_cmp(&b.2.to_f64())));
        }

        let mut gathered = Self {
            count,
            starts: vec![0],
            neighbours: Vec::new(),
            rest_lengths: Vec::new(),
            laws: Vec::new(),
            lane_laws: Vec::new(),
            lane_index: Vec::new(),
        };
        for first in (0..count).step_by(LANES) {
            interrupt::point();
            gathered.push_group(first, &rows[first..(first + LANES).min(count)]);
        }

        if gathered.lane_laws.is_empty() {
            gathered.lane_index = Vec::new();
        }
        gathered
    }

    fn push_group(&mut self, first: usize, rows: &[Vec<(u16, u32, R)>]) {
        let width = rows.iter().map(Vec::len).max().unwrap_or(0);
        for slot in 0..width {
            // A lane without a spring names its row: d = 0, so that it adds nothing.
            let mut neighbours = std::array::from_fn(|lane| (first + lane.min(rows.len() - 1)) as u32);
            let mut rest_lengths = [R::zero(); LANES];
            let mut laws = [None; LANES];

            for (lane, row) in rows.iter().enumerate() {
                if let Some(&(law, neighbour, rest_length)) = row.get(slot) {
                    (neighbours[lane], rest_lengths[lane], laws[lane]) = (neighbour, rest_length, Some(law));
                }
            }

            self.neighbours.push(neighbours);
            self.rest_lengths.push(rest_lengths);
            self.lane_index.push(self.lane_laws.len() as u32);

            let mut present = laws.iter().flatten();
            let one = *present.next().expect("a slot holds a spring");
            if present.all(|law| *law == one) {
                self.laws.push(one);
            } else {
                self.laws.push(MIXED);
                self.lane_laws.push(laws.map(|law| law.unwrap_or(one)));
            }
        }

        self.starts.push(self.neighbours.len() as u32);
    }

    /// The springs of one row: (neighbour, rest length, law), in the order in which they are added.
    pub(crate) fn row(&self, row: usize) -> impl Iterator<Item = (u32, R, u16)> {
        let (group, lane) = (row / LANES, row % LANES);
        (self.starts[group] as usize..self.starts[group + 1] as usize)
            .filter(move |&slot| self.neighbours[slot][lane] as usize != row)
            .map(move |slot| {
                let law = match self.laws[slot] {
                    MIXED => self.lane_laws[self.lane_index[slot] as usize][lane],
                    law => law,
                };

                (self.neighbours[slot][lane], self.rest_lengths[slot][lane], law)
            })
    }

    /// Folds the springs of sixteen rows from `first_row`, which starts a group. `x` and `y` are
    /// fields over all particles; `laws` is the table.
    ///
    /// # Panics
    /// If a field is shorter than the number of rows, or the table than the laws named.
    #[inline(always)]
    pub(super) fn fold_group<P: Pack<Number = R>, T, const A: usize>(
        &self,
        first_row: usize,
        [x, y]: [&[Padded<R>]; 2],
        laws: &[[R; 2]],
        mut sums: [T; A],
        fold: impl Fold<P, T, A>,
    ) -> [T; A] {
        assert!(x.len() >= self.count && y.len() >= self.count && first_row < self.count);
        let group = first_row / LANES;
        let own = std::array::from_fn(|lane| (first_row + lane).min(self.count - 1) as u32);

        // SAFETY: both fields have at least `count` elements, and `own` is below `count`.
        let (own_x, own_y) = unsafe { (P::gather(x, &own), P::gather(y, &own)) };

        for slot in self.starts[group] as usize..self.starts[group + 1] as usize {
            let neighbours = &self.neighbours[slot];

            // SAFETY: `new` puts only particle numbers, below `count`, into `neighbours`; the
            // fields were found to be at least that long above.
            let (other_x, other_y) = unsafe { (P::gather(x, neighbours), P::gather(y, neighbours)) };
            let edges = Edges {
                d: std::array::from_fn(|c| own_x[c] - other_x[c]),
                w: std::array::from_fn(|c| own_y[c] - other_y[c]),
                rest_length: P::load(&self.rest_lengths[slot]),
                law: self.laws_of(slot, laws),
            };

            fold.fold(&mut sums, &edges);
        }

        sums
    }

    #[inline(always)]
    fn laws_of<P: Pack<Number = R>>(&self, slot: usize, laws: &[[R; 2]]) -> [P; 2] {
        match self.laws[slot] {
            MIXED => {
                let lanes = &self.lane_laws[self.lane_index[slot] as usize];
                let mut numbers = [[R::zero(); LANES]; 2];
                for lane in 0..LANES {
                    let law = laws[lanes[lane] as usize];
                    (numbers[0][lane], numbers[1][lane]) = (law[0], law[1]);
                }

                [P::load(&numbers[0]), P::load(&numbers[1])]
            }
            law => {
                let law = laws[law as usize];
                [P::splat(law[0]), P::splat(law[1])]
            }
        }
    }

    /// Groups of rows that make up `rows`, each as the range of its rows.
    #[inline(always)]
    pub(super) fn groups(rows: Range<usize>) -> impl Iterator<Item = Range<usize>> {
        let end = rows.end;
        rows.step_by(LANES).map(move |first| first..(first + LANES).min(end))
    }
}

/// Three packs as sixteen vectors.
#[inline(always)]
pub(super) fn vectors<P: Pack>(packs: [P; 3]) -> [Vec3<P::Number>; LANES] {
    let [x, y, z] = packs.map(P::store);
    std::array::from_fn(|lane| Vec3::new(x[lane], y[lane], z[lane]))
}

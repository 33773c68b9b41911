//! The connected components of a cloth: what springs and elements hold together. One without pins moves as a whole under
//! gravity and the medium alone, whatever happens within it.

use crate::math::Real;

/// The components of a model, in the order of their first rows.
#[derive(Clone, Debug)]
pub(crate) struct Components {
    /// First of each among `rows`, and one more.
    starts: Vec<u32>,
    /// Free rows, component after component, each in ascending order.
    rows: Vec<u32>,
    /// The component of each row.
    of_row: Vec<u32>,
    /// Whether any row of a component is pinned.
    is_pinned: Vec<bool>,
}

impl Components {
    /// From the inverse masses of `count` rows, 0 for pins, and all pairs of rows that springs or elements join.
    pub(crate) fn new<R: Real>(count: usize, inv_m: &[R], pairs: impl Iterator<Item = [u32; 2]>) -> Self {
        // Each row names one before it of its component, the first one itself.
        let mut before: Vec<u32> = (0..count as u32).collect();
        for pair in pairs {
            let [one, other] = pair.map(|row| first(&mut before, row));
            before[one.max(other) as usize] = one.min(other);
        }

        let (mut of_row, mut is_pinned) = (vec![0; count], Vec::new());
        for row in 0..count {
            let first = first(&mut before, row as u32) as usize;
            if first == row {
                of_row[row] = is_pinned.len() as u32;
                is_pinned.push(false);
            } else {
                of_row[row] = of_row[first];
            }
            is_pinned[of_row[row] as usize] |= inv_m[row] == R::zero();
        }

        let mut rows: Vec<u32> = (0..count as u32).filter(|row| inv_m[*row as usize] > R::zero()).collect();
        rows.sort_by_key(|row| of_row[*row as usize]);
        let component = |row: &u32| of_row[*row as usize] as usize;
        let starts = (0..=is_pinned.len()).map(|it| rows.partition_point(|row| component(row) < it) as u32);
        Self { starts: starts.collect(), rows, of_row, is_pinned }
    }

    pub(crate) fn count(&self) -> usize {
        self.is_pinned.len()
    }

    /// How many rows there are.
    pub(crate) fn row_count(&self) -> usize {
        self.of_row.len()
    }

    /// The free rows of a component.
    pub(crate) fn rows(&self, component: usize) -> &[u32] {
        &self.rows[self.starts[component] as usize..self.starts[component + 1] as usize]
    }

    /// Whether any row of a component is pinned.
    pub(crate) fn is_pinned(&self, component: usize) -> bool {
        self.is_pinned[component]
    }

    /// The component of a row.
    pub(crate) fn of_row(&self, row: usize) -> usize {
        self.of_row[row] as usize
    }
}

/// The free rows of components without pins: what gravity and the medium alone move as one.
#[derive(Clone, Debug)]
pub(crate) struct Loose<R> {
    /// Mass (kg) of each such row, 0 of all others: as many numbers as masses.
    pub(crate) m: Vec<R>,
    /// Their mass (kg).
    pub(crate) mass: f64,
    /// How many rows these are.
    pub(crate) count: usize,
}

impl<R: Real> Loose<R> {
    /// From the masses of rows; none where there is no such row.
    pub(crate) fn new(m: &[R], components: &Components) -> Option<Self> {
        let mut of_loose = vec![R::zero(); m.len()];
        let (mut mass, mut count) = (0.0, 0);
        for row in 0..components.of_row.len() {
            if !components.is_pinned(components.of_row(row)) {
                of_loose[row] = m[row];
                mass += m[row].to_f64();
                count += 1;
            }
        }
        (count > 0).then_some(Self { m: of_loose, mass, count })
    }
}

/// The first row of the component of a row, as far as is known; shortens the way to it.
fn first(before: &mut [u32], mut row: u32) -> u32 {
    while before[row as usize] != row {
        let next = before[before[row as usize] as usize];
        before[row as usize] = next;
        row = next;
    }
    row
}

#[cfg(test)]
mod tests {
    use super::{Components, Loose};

    #[test]
    fn what_is_joined_is_one_component_and_pins_are_left_out() {
        // 0-2-4-6, 1-3 with a pin at 3, 5 by itself, 7 by itself and pinned.
        let inv_m = [1.0, 1.0, 1.0, 0.0, 1.0, 1.0, 1.0, 0.0, 0.0, 0.0];
        let pairs = [[6, 4], [0, 2], [3, 1], [4, 2], [2, 0]];
        let components = Components::new(8, &inv_m, pairs.into_iter());
        let all: Vec<_> = (0..components.count())
            .map(|it| (components.rows(it).to_vec(), components.is_pinned(it)))
            .collect();
        let expected = [(vec![0, 2, 4, 6], false), (vec![1], true), (vec![5], false), (vec![], true)];
        assert_eq!(all, expected);
        assert_eq!([0, 6, 1, 3, 5, 7].map(|row| components.of_row(row)), [0, 0, 1, 1, 2, 3]);

        let m = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0, 64.0, 128.0, 0.0, 0.0];
        let loose = Loose::new(&m, &components).expect("components without pins");
        assert_eq!(loose.m, [1.0, 0.0, 4.0, 0.0, 16.0, 32.0, 64.0, 0.0, 0.0, 0.0]);
        assert_eq!((loose.mass, loose.count), (117.0, 5));
    }
}

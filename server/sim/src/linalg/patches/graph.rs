//! Which of some numbered things are joined: each pair both ways and once, others in ascending order.

use crate::{interrupt, linalg::rows::filed};

/// An undirected graph in compressed rows; nothing is joined to itself.
#[derive(Clone, Debug, Default)]
pub(super) struct Graph {
    starts: Vec<u32>,
    others: Vec<u32>,
}

impl Graph {
    /// From pairs, in any order and some more than once.
    pub(super) fn new(count: usize, pairs: impl Iterator<Item = [u32; 2]> + Clone) -> Self {
        let apart = pairs.filter(|[i, j]| i != j).inspect(|_| interrupt::point());
        let [starts, mut all] = filed(count, apart);

        let (mut once, mut others) = (vec![0], Vec::new());
        for i in 0..count {
            let row = &mut all[starts[i] as usize..starts[i + 1] as usize];
            row.sort_unstable();
            let first = others.len();
            for other in &*row {
                if others[first..].last() != Some(other) {
                    others.push(*other);
                }
            }
            once.push(others.len() as u32);
        }
        Self { starts: once, others }
    }

    /// How many things there are.
    pub(super) fn len(&self) -> usize {
        self.starts.len() - 1
    }

    /// What one is joined to.
    pub(super) fn of(&self, i: u32) -> &[u32] {
        &self.others[self.starts[i as usize] as usize..self.starts[i as usize + 1] as usize]
    }
}

#[cfg(test)]
mod tests {
    use super::Graph;

    #[test]
    fn pairs_are_known_both_ways_and_once() {
        let graph = Graph::new(4, [[0, 2], [2, 0], [1, 1], [2, 1], [0, 2]].into_iter());
        let rows: Vec<&[u32]> = (0..graph.len() as u32).map(|i| graph.of(i)).collect();
        assert_eq!(rows, [&[2][..], &[2], &[0, 1], &[]]);
    }
}

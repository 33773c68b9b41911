//! Groups of indices that are joined pair by pair; each is named by its smallest index.

/// Groups of all indices below a count.
#[derive(Clone, Debug)]
pub struct Groups {
    /// For each index one of its group that is not larger; the smallest has itself.
    smaller: Vec<u32>,
}

impl Groups {
    /// Groups of `count` indices, each by itself.
    pub fn new(count: usize) -> Self {
        Self { smaller: (0..count as u32).collect() }
    }

    /// Makes one group of those of two indices.
    pub fn join(&mut self, [a, b]: [u32; 2]) {
        let (a, b) = (self.first(a), self.first(b));
        self.smaller[a.max(b) as usize] = a.min(b);
    }

    /// The smallest index of the group of an index; shortens the way to it.
    pub fn first(&mut self, mut index: u32) -> u32 {
        while self.smaller[index as usize] != index {
            let next = self.smaller[self.smaller[index as usize] as usize];
            self.smaller[index as usize] = next;
            index = next;
        }
        index
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_joined_has_one_smallest_index() {
        let mut groups = Groups::new(7);
        for pair in [[6, 4], [4, 2], [1, 3], [2, 0], [0, 6]] {
            groups.join(pair);
        }
        assert_eq!([0, 1, 2, 3, 4, 5, 6].map(|index| groups.first(index)), [0, 1, 0, 1, 0, 5, 0]);
    }
}

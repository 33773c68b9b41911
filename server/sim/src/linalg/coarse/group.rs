//! Groups of aggregates, for the next level.

use std::collections::BTreeSet;

use crate::interrupt;

/// Groups of aggregates that meet, of a size as a rule, by their members, in the order of the first ones. Each aggregate that
/// is left takes neighbours that are left, those of small number first, and then neighbours of those. One that finds none
/// joins a neighbour's group; those that have no neighbours are grouped in their order, and those that are empty go with the
/// one before.
pub(super) fn group(neighbours: &[BTreeSet<u32>], is_empty: &[bool], size: usize) -> Vec<Vec<u32>> {
    let none = u32::MAX;
    let mut group_of = vec![none; neighbours.len()];
    let mut groups: Vec<Vec<u32>> = Vec::new();
    for first in 0..neighbours.len() as u32 {
        interrupt::point();
        if group_of[first as usize] != none || is_empty[first as usize] {
            continue;
        }
        let number = groups.len() as u32;
        let mut members = vec![first];
        group_of[first as usize] = number;
        let mut looked_at = 0;
        while looked_at < members.len() && members.len() < size {
            for &other in &neighbours[members[looked_at] as usize] {
                let is_left = group_of[other as usize] == none && !is_empty[other as usize];
                if members.len() < size && is_left {
                    group_of[other as usize] = number;
                    members.push(other);
                }
            }
            looked_at += 1;
        }
        groups.push(members);
    }

    if groups.is_empty() {
        return vec![(0..neighbours.len() as u32).collect()];
    }
    if size > 1 {
        join_single(neighbours, &mut group_of, &mut groups, size);
    }
    let mut last = 0;
    for (aggregate, group) in (0..).zip(&group_of) {
        if *group == none {
            groups[last as usize].push(aggregate);
        } else {
            last = *group;
        }
    }
    for members in &mut groups {
        members.sort_unstable();
    }
    groups.retain(|members| !members.is_empty());
    groups.sort_unstable_by_key(|members| members[0]);
    groups
}

/// Gives the only members of groups to others.
fn join_single(neighbours: &[BTreeSet<u32>], group_of: &mut [u32], groups: &mut [Vec<u32>], size: usize) {
    let mut lonely: Option<u32> = None;
    for number in 0..groups.len() as u32 {
        let [single] = groups[number as usize][..] else { continue };
        let mut others = neighbours[single as usize].iter().map(|other| group_of[*other as usize]);
        let to = others.find(|group| *group != number && *group != u32::MAX).or(lonely);
        match to {
            Some(to) => {
                groups[number as usize].clear();
                groups[to as usize].push(single);
                group_of[single as usize] = to;
                if lonely == Some(to) && groups[to as usize].len() >= size {
                    lonely = None;
                }
            }
            None => lonely = Some(number),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    use super::group;

    fn neighbours(count: u32, pairs: &[[u32; 2]]) -> Vec<BTreeSet<u32>> {
        let mut sets: Vec<BTreeSet<u32>> = (0..count).map(|i| [i].into()).collect();
        for &[i, j] in pairs {
            sets[i as usize].insert(j);
            sets[j as usize].insert(i);
        }
        sets
    }

    #[test]
    fn neighbours_go_together_and_everyone_is_in_one_group() {
        let chain = neighbours(9, &[[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [6, 7], [7, 8]]);
        assert_eq!(group(&chain, &[false; 9], 4), [vec![0, 1, 2, 3], vec![4, 5, 6, 7, 8]]);

        let apart = neighbours(8, &[[0, 4], [2, 6]]);
        let mut is_empty = [false; 8];
        is_empty[7] = true;
        assert_eq!(group(&apart, &is_empty, 4), [vec![0, 4], vec![1, 3, 5], vec![2, 6, 7]]);
        let singles = [vec![0], vec![1], vec![2], vec![3], vec![4], vec![5], vec![6, 7]];
        assert_eq!(group(&apart, &is_empty, 1), singles);
        assert_eq!(group(&apart, &[true; 8], 4), [(0..8).collect::<Vec<u32>>()]);
    }

    #[test]
    fn without_neighbours_there_are_a_quarter_as_many_groups() {
        let groups = group(&neighbours(100, &[]), &[false; 100], 4);
        assert_eq!(groups.len(), 25);
        assert!(groups.iter().all(|members| members.len() == 4));
    }
}

//! How deep the deepest point of a solid is: cubes are halved where a deeper point may be.
//!
//! Reads a box (m) and the depth (m) of any point; a depth changes by no more than the way gone, so that a cube holds none
//! deeper than that of its middle and half its diagonal.

use std::{cmp::Ordering, collections::BinaryHeap};

use crate::interrupt;

/// Share by which the answer may be above the deepest point that was found.
const SPARE: f64 = 0.02;
/// Cubes that are looked into where a depth costs little, at most: a very thin solid has too many, and is then said to be thicker
/// than it is.
pub(super) const MOST_CUBES: usize = 4096;

/// A cube, and the greatest depth (m) that it may hold.
struct Cube {
    most: f64,
    center: [f64; 3],
    half: f64,
}

impl PartialEq for Cube {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other).is_eq()
    }
}

impl Eq for Cube {}

impl PartialOrd for Cube {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Cube {
    fn cmp(&self, other: &Self) -> Ordering {
        self.most.total_cmp(&other.most).then_with(|| {
            let [a, b] = [self, other].map(|cube| cube.center.map(f64::to_bits));
            a.cmp(&b)
        })
    }
}

/// A depth (m) that no point within the bounds exceeds; looks into so many cubes, at most.
pub(super) fn deepest([low, high]: [[f64; 3]; 2], cubes: usize, depth: impl Fn([f64; 3]) -> f64) -> f64 {
    let cube = |center: [f64; 3], half: f64| {
        let here = depth(center);
        (here, Cube { most: here + half * 3.0_f64.sqrt(), center, half })
    };
    let half = (0..3).map(|c| 0.5 * (high[c] - low[c])).fold(0.0, f64::max);
    let (mut found, whole) = cube([0, 1, 2].map(|c| 0.5 * (low[c] + high[c])), half);
    let mut waiting = BinaryHeap::from([whole]);
    for _ in 0..cubes {
        // Where triangles overlap, each depth looks at all of them.
        interrupt::point();
        let Some(top) = waiting.peek() else { break };
        if found > 0.0 && top.most <= (1.0 + SPARE) * found {
            break;
        }
        let Some(Cube { center, half, .. }) = waiting.pop() else { break };
        for corner in 0..8_u32 {
            let way = [0, 1, 2].map(|c| if corner >> c & 1 == 1 { 0.5 * half } else { -0.5 * half });
            let (here, part) = cube([0, 1, 2].map(|c| center[c] + way[c]), 0.5 * half);
            found = found.max(here);
            if part.most > 0.0 {
                waiting.push(part);
            }
        }
    }
    waiting.peek().map_or(found, |cube| cube.most)
}

#[cfg(test)]
mod tests {
    use std::cell::Cell;

    use super::*;
    use crate::interrupt::{Interrupt, Interrupted};

    #[test]
    fn a_search_that_is_given_up_looks_into_no_other_cube() {
        let (interrupt, looks) = (Interrupt::default(), Cell::new(0));
        let depth = |_: [f64; 3]| {
            looks.set(looks.get() + 1);
            if looks.get() == 100 {
                interrupt.request();
            }
            -1.0
        };
        let left = interrupt.leave_at_points(|| deepest([[0.0; 3], [100.0; 3]], MOST_CUBES, depth));
        assert_eq!(left, Err(Interrupted));
        assert!((100..108).contains(&looks.get()), "{looks:?}");
    }
}

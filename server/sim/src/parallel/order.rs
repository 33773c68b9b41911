//! Renumbering for locality: particles in the order of a Hilbert curve through their rest positions.
//!
//! Reads positions (m); writes, for each new number, the old one. J. Skilling, "Programming the
//! Hilbert curve", AIP Conference Proceedings 707 (2004).

use super::each::{Own, per_row, per_row_mut, sort};

/// Points that a thread takes at a time.
const BLOCK_SIZE: usize = 4096;
/// Bits per axis.
const BITS: u32 = 16;
/// The greatest coordinate of a cell.
const LAST: f64 = ((1_u32 << BITS) - 1) as f64;

/// The order of points along a Hilbert curve: `order[new] = old`. Points of one cell stay in the
/// order in which they were given.
///
/// Cells are `spacing` over a power of two wide, the finest that the curve has room for, so that points of a grid of
/// that spacing fill whole squares of the curve: blocks of 256 are 16 x 16 points, with the shortest border there is.
/// A spacing that is not positive stands for none: cells are then the largest extent / 65535 wide.
pub fn hilbert_order(points: &[[f64; 3]], spacing: f64) -> Vec<u32> {
    let (mut low, mut high) = ([f64::INFINITY; 3], [f64::NEG_INFINITY; 3]);
    for point in points {
        for axis in 0..3 {
            low[axis] = low[axis].min(point[axis]);
            high[axis] = high[axis].max(point[axis]);
        }
    }

    let extent = (0..3).map(|axis| high[axis] - low[axis]).fold(0.0, f64::max);
    let scale = scale(extent, spacing);
    // Rounded to the nearest cell: a point of a grid is not cut off from its square by a rounding.
    let cell = |p: &[f64; 3]| [0, 1, 2].map(|a| ((p[a] - low[a]) * scale + 0.5).min(LAST) as u32);

    let mut keyed: Vec<(u64, u32)> = vec![(0, 0); points.len()];
    let fields = (per_row_mut(&mut keyed), per_row(points));
    Own::whole(points.len(), BLOCK_SIZE).each(fields, |block, (keyed, points)| {
        for (i, (keyed, p)) in keyed.iter_mut().zip(points).enumerate() {
            *keyed = (hilbert_index(cell(p)), (block * BLOCK_SIZE + i) as u32);
        }
    });
    sort(&mut keyed);
    keyed.into_iter().map(|(_, old)| old).collect()
}

/// Cells per metre.
fn scale(extent: f64, spacing: f64) -> f64 {
    if extent <= 0.0 {
        return 0.0;
    }
    let most = LAST / extent;
    let mut scale = 1.0 / spacing;
    if !(spacing > 0.0 && scale.is_finite() && most.is_finite()) {
        return most;
    }
    while scale > most {
        scale *= 0.5;
    }
    while 2.0 * scale <= most {
        scale *= 2.0;
    }
    scale
}

/// Number of a cell along the curve.
fn hilbert_index(cell: [u32; 3]) -> u64 {
    let mut axes = cell;
    let top = 1_u32 << (BITS - 1);
    let mut bit = top;
    while bit > 1 {
        let below = bit - 1;
        for i in 0..3 {
            if axes[i] & bit == 0 {
                let swapped = (axes[0] ^ axes[i]) & below;
                axes[0] ^= swapped;
                axes[i] ^= swapped;
            } else {
                axes[0] ^= below;
            }
        }

        bit >>= 1;
    }

    axes[1] ^= axes[0];
    axes[2] ^= axes[1];
    let mut flip = 0;
    let mut bit = top;
    while bit > 1 {
        if axes[2] & bit != 0 {
            flip ^= bit - 1;
        }

        bit >>= 1;
    }

    let axes = axes.map(|axis| axis ^ flip);
    (0..BITS)
        .rev()
        .fold(0, |index, b| axes.iter().fold(index, |index, axis| (index << 1) | u64::from((axis >> b) & 1)))
}

#[cfg(test)]
mod tests {
    use super::{hilbert_index, hilbert_order};

    #[test]
    fn neighbours_on_the_curve_are_neighbours_in_space() {
        let side = 8_u32;
        let cells: Vec<[u32; 3]> =
            (0..side.pow(3)).map(|i| [i % side, i / side % side, i / side / side]).collect();
        let mut sorted = cells;
        sorted.sort_unstable_by_key(|cell| hilbert_index(*cell));
        for pair in sorted.windows(2) {
            let steps: u32 = (0..3).map(|axis| pair[0][axis].abs_diff(pair[1][axis])).sum();
            assert_eq!(steps, 1, "{pair:?}");
        }
    }

    #[test]
    fn an_order_is_a_permutation_even_of_equal_points() {
        for spacing in [0.0, 0.1, f64::NAN, 1e300] {
            assert_eq!(hilbert_order(&[[1.0, 2.0, 3.0]; 5], spacing), [0, 1, 2, 3, 4]);
            assert!(hilbert_order(&[], spacing).is_empty());
            let mut order = hilbert_order(&[[0.0; 3], [5.0, 0.0, 1.0], [1e-9, 0.0, 0.0]], spacing);
            order.sort_unstable();
            assert_eq!(order, [0, 1, 2]);
        }
    }

    #[test]
    fn blocks_of_a_grid_are_squares() {
        let (side, spacing) = (100, 0.1);
        let at = |i: usize| [spacing * (i % side) as f64 - 3.0, 1.0, spacing * (i / side) as f64];
        let points: Vec<_> = (0..side * side).map(at).collect();
        let order = hilbert_order(&points, spacing);
        for block in order.chunks_exact(256).take(20) {
            for axis in [0, 2] {
                let along = block.iter().map(|&i| points[i as usize][axis]);
                let extent = along.clone().fold(f64::MIN, f64::max) - along.fold(f64::MAX, f64::min);
                assert!(extent < 16.0 * spacing, "{extent} m");
            }
        }
    }
}

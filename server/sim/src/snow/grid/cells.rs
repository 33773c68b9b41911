//! The cells of a block while it is filled: where each begins, and who stands where.

use std::ops::Range;

use super::{
    arrivals::Arrival,
    blocks::{CELLS, CellStarts},
};

/// Where cells of a block begin in which nobody is.
pub(super) const NOBODY: CellStarts = [0; CELLS + 1];

/// Adds those that come to the starts of those that stay.
pub(super) fn starts_after(
    cells: &mut CellStarts,
    ranges: &[(Range<usize>, usize)],
    codes: &[u16],
    arrivals: &[Arrival],
) {
    let mut coming = NOBODY;
    for (_, cell, _) in arrivals {
        coming[usize::from(*cell) + 1] += 1;
    }
    for (range, direction) in ranges {
        for code in &codes[range.clone()] {
            if usize::from(*code) / CELLS == *direction {
                coming[usize::from(*code) % CELLS + 1] += 1;
            }
        }
    }

    accumulate(&mut coming);
    for (start, more) in cells.iter_mut().zip(coming) {
        *start += more;
    }
}

/// Copies those that stay in their cells to where these now begin, and counts them.
pub(super) fn copy_cells(
    out: &mut [u32],
    cells: &CellStarts,
    from: &[u32],
    kept: &CellStarts,
    filled: &mut [usize; CELLS],
) {
    for cell in 0..CELLS {
        let own = &from[kept[cell] as usize..kept[cell + 1] as usize];
        filled[cell] = own.len();
        out[cells[cell] as usize..][..own.len()].copy_from_slice(own);
    }
}

/// Inserts a place by the user's number among those of a cell, which are sorted but for the last: that is free.
#[inline(always)]
pub(super) fn insert(out: &mut [u32], place: u32, id: &[u32]) {
    let mut at = out.len() - 1;
    while at > 0 && id[out[at - 1] as usize] > id[place as usize] {
        out[at] = out[at - 1];
        at -= 1;
    }
    out[at] = place;
}

/// Counts to starts.
pub(super) fn accumulate(cells: &mut CellStarts) {
    for cell in 0..CELLS {
        cells[cell + 1] += cells[cell];
    }
}

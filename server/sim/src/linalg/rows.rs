//! Compressed rows: of what is joined in pairs, and of blocks, filled in parallel.

use std::ops::Range;

use crate::parallel::join;

/// Pairs of some numbered things: where what each is joined to begins, and the end; and all of that, in the order of the pairs.
pub(super) fn filed(count: usize, pairs: impl Iterator<Item = [u32; 2]> + Clone) -> [Vec<u32>; 2] {
    let mut starts = vec![0_u32; count + 1];
    for [i, j] in pairs.clone() {
        starts[i as usize + 1] += 1;
        starts[j as usize + 1] += 1;
    }
    for i in 0..count {
        starts[i + 1] += starts[i];
    }
    let mut others = vec![0; starts[count] as usize];
    let mut next = starts.clone();
    for [i, j] in pairs {
        for [from, to] in [[i, j], [j, i]] {
            others[next[from as usize] as usize] = to;
            next[from as usize] += 1;
        }
    }
    [starts, others]
}

/// Fills some rows of `blocks`: `fill(row, columns, blocks)`. Blocks and columns of row i are from `starts[i]` to
/// `starts[i + 1]`; a thread takes `least_piece` rows or more, if there are as many.
pub(super) fn fill_rows<T: Send>(
    rows: Range<usize>,
    starts: &[usize],
    columns: &[u32],
    blocks: &mut [T],
    least_piece: usize,
    fill: &(impl Fn(usize, &[u32], &mut [T]) + Sync),
) {
    let first = rows.start;
    let starts = &starts[first..=rows.end];
    let blocks = &mut blocks[starts[0]..starts[starts.len() - 1]];
    fill_range(starts, columns, blocks, [first, least_piece], fill);
}

/// `starts` are those of the range's rows and one more; `blocks` are the range's.
fn fill_range<T: Send>(
    starts: &[usize],
    columns: &[u32],
    blocks: &mut [T],
    [first_row, least_piece]: [usize; 2],
    fill: &(impl Fn(usize, &[u32], &mut [T]) + Sync),
) {
    let (rows, base) = (starts.len() - 1, starts[0]);
    if rows >= 2 * least_piece {
        let half = rows / 2;
        let (left, right) = blocks.split_at_mut(starts[half] - base);
        join(
            || fill_range(&starts[..=half], columns, left, [first_row, least_piece], fill),
            || fill_range(&starts[half..], columns, right, [first_row + half, least_piece], fill),
        );
        return;
    }

    for (i, w) in starts.windows(2).enumerate() {
        fill(first_row + i, &columns[w[0]..w[1]], &mut blocks[w[0] - base..w[1] - base]);
    }
}

//! The functions of the patches of a block, from the parts of the matrix within each.

use super::{
    choose::MOST,
    functions::{Soft, soften, width},
    layout::{MatrixParts, NONE, PatchLayout, TakeParts},
    singles::{Singles, room},
};
use crate::{
    linalg::precondition::{Inverse3, Symmetric3},
    math::LANES,
};

/// The functions of a patch among those of its block.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Place {
    /// How many there are.
    pub(super) count: usize,
    /// Where they begin, and where the block of the matrix does that they have with each other.
    functions: usize,
    within: usize,
}

/// The functions of the patches of a block.
#[derive(Clone, Debug, Default)]
pub(super) struct BlockFunctions {
    pub(super) places: Vec<Place>,
    /// By patches, members and axes: the functions in whole packs.
    functions: Vec<Singles>,
    /// Pᵀ A P within each patch, by rows.
    within: Vec<f32>,
}

impl BlockFunctions {
    /// Forgets what it holds.
    fn clear(&mut self) {
        self.places.clear();
        self.functions.clear();
        self.within.clear();
    }

    /// Takes those of the next patch.
    fn push(&mut self, soft: &Soft) {
        let (functions, within) = (self.functions.len(), self.within.len());
        self.places.push(Place { count: soft.count, functions, within });
        soft.append(&mut self.functions);
        for row in &soft.within[..soft.count] {
            self.within.extend(row[..soft.count].iter().map(|entry| *entry as f32));
        }
    }

    /// The functions of a patch of the block, from a member on: three times [`width`] packs for each.
    #[inline(always)]
    pub(super) fn of(&self, patch: usize, member: usize) -> &[Singles] {
        let Place { count, functions, .. } = self.places[patch];
        &self.functions[functions + 3 * member * width(count)..]
    }

    /// Pᵀ A P within a patch of the block, by rows.
    pub(super) fn within(&self, patch: usize) -> &[f32] {
        let Place { count, within, .. } = self.places[patch];
        &self.within[within..within + count * count]
    }

    /// Makes room for a quarter more than there is.
    fn make_room(&mut self) {
        self.functions.reserve(self.functions.len() / 4);
        self.within.reserve(self.within.len() / 4);
    }
}

/// A block that an element which is not within one patch has between two rows of the same patch.
#[derive(Clone, Copy, Debug)]
struct Coupling {
    patch: u32,
    members: [u8; 2],
    block: [[f64; 3]; 3],
}

/// Couplings per row that there is room for at once.
const COUPLINGS: usize = 16;

/// Sums over a block of rows.
#[derive(Debug, Default)]
pub(super) struct Sums {
    /// The matrix of each patch by rows, one after another; and where each begins.
    matrices: Vec<f64>,
    starts: Vec<usize>,
    /// What parts across borders of patches add to the diagonal block of each row, and between rows of a patch.
    outside: Vec<[[f64; 3]; 3]>,
    couplings: Vec<Coupling>,
    roots: Vec<[[f64; 3]; 3]>,
}

/// Makes the functions of a block; `inverse` are the inverse diagonal blocks of the matrix.
pub(super) fn gather(
    (layout, block): (&PatchLayout, usize),
    source: &dyn MatrixParts,
    inverse: &[Inverse3],
    sums: &mut Sums,
    to: &mut BlockFunctions,
) {
    let patches = layout.of_block(block);
    let (first, first_row) = (patches.start, block * layout.block_size);
    sums.begin(layout, block);
    source.visit(block, &mut Gather { layout, first, first_row, sums: &mut *sums });

    let is_first = to.places.capacity() == 0;
    to.clear();
    let mut soft = Soft::new();
    for patch in patches {
        let rows = layout.rows(patch);
        sums.roots.clear();
        sums.roots.extend(rows.iter().map(|row| inverse[*row as usize / LANES].root(*row as usize % LANES)));
        let start = sums.starts[patch - first];
        let size = 9 * rows.len() * rows.len();
        soften(&sums.matrices[start..start + size], &sums.roots, &mut soft);
        for (member, row) in rows.iter().enumerate() {
            let outside = &sums.outside[*row as usize - first_row];
            if *outside != [[0.0; 3]; 3] {
                soft.add([member, member], outside);
            }
        }
        for coupling in sums.couplings.iter().filter(|coupling| coupling.patch as usize == patch) {
            soft.add(coupling.members.map(usize::from), &coupling.block);
        }
        soft.normalise();
        to.push(&soft);
    }
    if is_first {
        to.make_room();
    }
}

impl Sums {
    /// Makes room for any block: which thread has which one is not known.
    pub(super) fn make_room(&mut self, layout: &PatchLayout) {
        let Self { matrices, starts, outside, couplings, roots } = self;
        let rows = layout.block_size;
        room(matrices, 9 * MOST * rows);
        room(starts, rows);
        room(outside, rows);
        room(couplings, COUPLINGS * rows);
        room(roots, MOST);
    }

    /// Begins with 0 in the matrices of a block.
    fn begin(&mut self, layout: &PatchLayout, block: usize) {
        let mut end = 0;
        self.starts.clear();
        for patch in layout.of_block(block) {
            self.starts.push(end);
            let rows = 3 * layout.rows(patch).len();
            end += rows * rows;
        }
        self.matrices.clear();
        self.matrices.resize(end, 0.0);
        self.outside.clear();
        self.outside.resize(layout.block_size, [[0.0; 3]; 3]);
        self.couplings.clear();
    }
}

/// Adds parts to the sums of a block.
struct Gather<'a> {
    layout: &'a PatchLayout,
    /// Its first patch, and its first row.
    first: usize,
    first_row: usize,
    sums: &'a mut Sums,
}

impl Gather<'_> {
    /// Adds a block times a sign between two members of a patch.
    fn add(&mut self, patch: u32, [i, j]: [usize; 2], sign: f64, block: &[[f64; 3]; 3]) {
        let rows = 3 * self.layout.rows(patch as usize).len();
        let start = self.sums.starts[patch as usize - self.first];
        for r in 0..3 {
            let at = start + (3 * i + r) * rows + 3 * j;
            for c in 0..3 {
                self.sums.matrices[at + c] += sign * block[r][c];
            }
        }
    }

    /// Adds to the diagonal block of a row from across the border of its patch.
    fn add_outside(&mut self, row: usize, block: &[[f64; 3]; 3]) {
        let outside = &mut self.sums.outside[row - self.first_row];
        for r in 0..3 {
            for c in 0..3 {
                outside[r][c] += block[r][c];
            }
        }
    }

    /// Which member of its patch a row is.
    fn member(&self, row: usize) -> usize {
        usize::from(self.layout.numbers[row])
    }
}

/// A symmetric block by rows.
pub(super) fn square(block: &Symmetric3) -> [[f64; 3]; 3] {
    let Symmetric3 { xx, yy, zz, xy, xz, yz } = *block;
    [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]
}

impl TakeParts for Gather<'_> {
    fn alone(&mut self, row: usize, block: &Symmetric3) {
        let patch = self.layout.patches[row];
        if patch != NONE {
            let member = self.member(row);
            self.add(patch, [member; 2], 1.0, &square(block));
        }
    }

    fn spring(&mut self, row: usize, other: usize, block: &Symmetric3) {
        let patch = self.layout.patches[row];
        if patch == NONE {
            return;
        }
        let block = square(block);
        if self.layout.patches[other] == patch {
            let [i, j] = [self.member(row), self.member(other)];
            self.add(patch, [i, i], 1.0, &block);
            self.add(patch, [i, j], -1.0, &block);
        } else {
            self.add_outside(row, &block);
        }
    }

    fn element(&mut self, corners: &[u32], own: usize, blocks: &[[[f64; 3]; 3]]) {
        let row = corners[own] as usize;
        let patch = self.layout.patches[row];
        if patch == NONE {
            return;
        }
        let is_of = |corner: &u32| self.layout.patches[*corner as usize] == patch;
        let is_inside = corners.iter().all(is_of);
        for (corner, block) in corners.iter().zip(blocks) {
            if self.layout.patches[*corner as usize] != patch {
                continue;
            }
            let (i, j) = (self.member(row), self.member(*corner as usize));
            if is_inside {
                self.add(patch, [i, j], 1.0, block);
            } else if i == j {
                self.add_outside(row, block);
            } else {
                let members = [i as u8, j as u8];
                self.sums.couplings.push(Coupling { patch, members, block: *block });
            }
        }
    }
}

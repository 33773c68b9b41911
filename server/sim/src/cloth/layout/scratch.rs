//! Scratch memory of a thread that works on a block.

use std::sync::{Mutex, MutexGuard, PoisonError, TryLockError};

use crate::{
    math::{LANES, Pack, Real, Record},
    parallel::{thread_count, thread_number},
};

/// What one block needs while it is worked on.
#[derive(Clone, Debug, Default)]
pub(crate) struct BlockScratch<R: Real> {
    /// Its particles and a part of its halo.
    pub(crate) records: Vec<Record<R>>,
    /// Sums of the diagonal blocks of its rows, sixteen at a time: xx, yy, zz, xy, xz, yz.
    pub(crate) diagonal: Vec<[[f64; LANES]; 6]>,
    /// The same of stiffness (N/m) and of damping (N s/m), where they bound a step.
    pub(crate) bounds: Vec<[[[R; LANES]; 6]; 2]>,
    /// The squares of the greatest rates at which the ends of springs move against each other, in rest lengths (1/s²).
    pub(crate) rates: Vec<[R; LANES]>,
    /// The aggregate of each particle of its halo.
    pub(crate) aggregates: Vec<u32>,
    pub(crate) corners: CornerSums<R>,
    pub(crate) matrices: MatrixSums<R>,
}

/// What elements add to the rows of a block, row by row.
#[derive(Clone, Debug, Default)]
pub(crate) struct CornerSums<R: Real> {
    rows: Vec<[R; 4]>,
    /// Diagonal blocks: xx, yy, zz, xy, xz, yz, and two that mean nothing.
    blocks: Vec<[f64; 8]>,
}

impl<R: Real> CornerSums<R> {
    /// Begins with 0 in so many rows.
    pub(crate) fn clear(&mut self, rows: usize) {
        self.rows.clear();
        self.rows.resize(rows, [R::zero(); 4]);
        self.blocks.clear();
        self.blocks.resize(rows, [0.0; 8]);
    }

    /// Adds lanes to the rows that they are named for, from the first lane; names of other rows are passed over.
    #[inline(always)]
    pub(crate) fn add<P: Pack<Number = R>>(&mut self, names: &[u16], [x, y, z]: [P; 3]) {
        let quads = P::rows([x, y, z, P::zero()]);
        for (name, quad) in names.iter().zip(&quads) {
            if let Some(row) = self.rows.get_mut(usize::from(*name)) {
                for c in 0..4 {
                    row[c] += quad[c];
                }
            }
        }
    }

    /// Adds diagonal blocks likewise.
    #[inline(always)]
    pub(crate) fn add_blocks<W: Pack<Number = f64>>(&mut self, names: &[u16], entries: [W; 6]) {
        let first = W::rows([entries[0], entries[1], entries[2], entries[3]]);
        let second = W::rows([entries[4], entries[5], W::zero(), W::zero()]);
        for ((name, first), second) in names.iter().zip(&first).zip(&second) {
            if let Some(block) = self.blocks.get_mut(usize::from(*name)) {
                for c in 0..4 {
                    block[c] += first[c];
                    block[c + 4] += second[c];
                }
            }
        }
    }

    /// The sums of sixteen rows.
    #[inline(always)]
    pub(crate) fn sixteen<P: Pack<Number = R>>(&self, group: usize) -> [P; 3] {
        let [x, y, z, _] = P::columns(&self.rows.as_chunks::<LANES>().0[group]);
        [x, y, z]
    }

    /// Adds the diagonal blocks of sixteen rows to those of their springs.
    pub(crate) fn add_blocks_to(&self, group: usize, diagonal: &mut [[f64; LANES]; 6]) {
        for (lane, block) in self.blocks[group * LANES..(group + 1) * LANES].iter().enumerate() {
            for c in 0..6 {
                diagonal[c][lane] += block[c];
            }
        }
    }
}

/// Symmetric matrices that triangles add to the particles of a block and its halo.
#[derive(Clone, Debug, Default)]
pub(crate) struct MatrixSums<R: Real>(
    /// xx, yy, zz, xy, xz, yz, and two that mean nothing.
    Vec<[R; 8]>,
);

impl<R: Real> MatrixSums<R> {
    /// Begins with 0.
    pub(crate) fn clear(&mut self) {
        self.0.fill([R::zero(); 8]);
    }

    /// Adds the matrix of each lane to the particles that the corners of that lane name, from the first lane.
    #[inline(always)]
    pub(crate) fn add<P: Pack<Number = R>>(&mut self, names: [&[u16]; 3], matrix: [P; 6]) {
        let [xx, yy, zz, xy, xz, yz] = matrix;
        let first = P::rows([xx, yy, zz, xy]);
        let second = P::rows([xz, yz, P::zero(), P::zero()]);
        for names in names {
            for ((name, first), second) in names.iter().zip(&first).zip(&second) {
                let sum = &mut self.0[usize::from(*name)];
                for c in 0..4 {
                    sum[c] += first[c];
                    sum[c + 4] += second[c];
                }
            }
        }
    }

    /// The sums of sixteen rows: xx, yy, zz, xy, xz, yz.
    #[inline(always)]
    pub(crate) fn sixteen<P: Pack<Number = R>>(&self, group: usize) -> [P; 6] {
        let sums = &self.0.as_chunks::<LANES>().0[group];
        let (mut first, mut second) = ([[R::zero(); 4]; LANES], [[R::zero(); 4]; LANES]);
        for lane in 0..LANES {
            for c in 0..4 {
                first[lane][c] = sums[lane][c];
                second[lane][c] = sums[lane][c + 4];
            }
        }
        let ([xx, yy, zz, xy], [xz, yz, ..]) = (P::columns(&first), P::columns(&second));
        [xx, yy, zz, xy, xz, yz]
    }
}

/// Scratch memory for as many threads as may work at a time.
#[derive(Debug, Default)]
pub(crate) struct Scratches<R: Real>(Vec<Mutex<BlockScratch<R>>>);

impl<R: Real> Scratches<R> {
    /// Makes room for the threads of the pool that works now, which has `blocks` blocks to do, of so many rows at most, so
    /// many to which elements add, and so many particles to which triangles do; for a block and its halo there must be
    /// `room` records.
    pub(crate) fn size_for(
        &mut self,
        blocks: usize,
        [rows, of_elements, of_triangles]: [usize; 3],
        room: usize,
    ) {
        let threads = thread_count().min(blocks).max(1);
        while self.0.len() < threads {
            let (record, diagonal) = (Record::default(), [[0.0; LANES]; 6]);
            let (records, diagonal) = (vec![record; room], vec![diagonal; rows / LANES]);
            let corners =
                CornerSums { rows: Vec::with_capacity(of_elements), blocks: Vec::with_capacity(of_elements) };
            let aggregates = vec![0; room];
            let bounds = vec![[[[R::zero(); LANES]; 6]; 2]; rows / LANES];
            let rates = vec![[R::zero(); LANES]; rows / LANES];
            let matrices = MatrixSums(vec![[R::zero(); 8]; of_triangles]);
            let scratch = BlockScratch { records, diagonal, bounds, rates, aggregates, corners, matrices };
            self.0.push(Mutex::new(scratch));
        }
    }

    /// Scratch memory that nobody else uses now. What it holds is what its last user left.
    pub(crate) fn take(&self) -> MutexGuard<'_, BlockScratch<R>> {
        let first = thread_number();
        for i in 0..self.0.len() {
            match self.0[(first + i) % self.0.len()].try_lock() {
                Ok(scratch) => return scratch,
                Err(TryLockError::Poisoned(scratch)) => return scratch.into_inner(),
                Err(TryLockError::WouldBlock) => {}
            }
        }
        self.0[first % self.0.len()].lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<R: Real> Clone for Scratches<R> {
    /// Scratch memory of its own, made when it is needed.
    fn clone(&self) -> Self {
        Self::default()
    }
}

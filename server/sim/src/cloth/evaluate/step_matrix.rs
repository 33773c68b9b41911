//! The matrix of an implicit step, frozen at a state: A = M - h df/dv - h² df/dx. Rows of pins are 0: a pin's change of
//! velocity is 0, its velocity is prescribed. Of a corner of a figure that gives way its row has its mass, and what pairs add.
//!
//! Reads the tangent that an evaluation stored; applies A row by row, or assembles it. No law is evaluated again.

use super::{evaluation::Evaluation, numbers::StepNumbers};
use crate::{
    cloth::{
        contact::PairRows,
        layout::{BlockOfRows, BlockScratch, Fold, Model, Scratches},
    },
    interrupt::Interrupt,
    linalg::{BlockCsr, LinearOperator, Sums, lanes_at, packs_at},
    math::{LANES, Lanes, Mat3, Pack, Padded, Real, Sixteen, WithSimd, array::dot, dispatch, three},
};

/// The matrix of a step from the state that was evaluated.
#[derive(Clone, Copy)]
pub(crate) struct StepMatrix<'a, R: Real> {
    pub(crate) model: &'a Model<R>,
    pub(crate) numbers: &'a StepNumbers<R>,
    /// Positions (m) of that state.
    pub(crate) x: &'a [Padded<R>],
    pub(crate) tangent: &'a [[R; LANES]],
    pub(crate) frozen: &'a [[R; LANES]],
    /// Pairs that keep surfaces apart, where any push. An assembled matrix has none.
    pub(crate) pairs: Option<&'a PairRows<R>>,
    pub(crate) scratches: &'a Scratches<R>,
    pub(crate) interrupt: &'a Interrupt,
}

impl<'a, R: Real> StepMatrix<'a, R> {
    pub(crate) fn new(
        (model, numbers): (&'a Model<R>, &'a StepNumbers<R>),
        x: &'a [Padded<R>],
        evaluation: &'a Evaluation<R>,
        scratches: &'a Scratches<R>,
        interrupt: &'a Interrupt,
    ) -> Self {
        Self {
            model,
            numbers,
            x,
            tangent: &evaluation.tangent,
            frozen: &evaluation.frozen,
            pairs: None,
            scratches,
            interrupt,
        }
    }

    /// The same with pairs that push.
    pub(crate) fn with(self, pairs: Option<&'a PairRows<R>>) -> Self {
        Self { pairs, ..self }
    }

    /// Writes the matrix into `matrix`, made by [`pattern`].
    pub(crate) fn assemble(&self, matrix: &mut BlockCsr<R>) {
        let Self { model, numbers, x, tangent, .. } = *self;
        let h = R::of(numbers.scheme.h);
        matrix.fill_rows(&|i, columns, blocks| {
            blocks.fill(Mat3::zeros());
            if model.movable()[i] == R::zero() {
                return;
            }

            let place = |j: u32| columns.binary_search(&j).expect("the pattern holds every spring");
            let diagonal = place(i as u32);
            let is_free = model.inv_m[i] > R::zero();
            let own = if is_free { numbers.external.mass(model.m[i], h) } else { model.m[i] };
            blocks[diagonal] += Mat3::identity() * own;
            if let Some(air) = numbers.external.air_of(i) {
                blocks[diagonal] += air * h;
            }

            for end in model.springs.row(i) {
                let d = x[i].vector() - x[end.other as usize].vector();
                let (slot, lane) = end.place;
                let b = tangent[slot][lane];
                let a = numbers.along[model.springs.pattern_of[slot] as usize][lane] - b * d.norm_squared();
                let block = Mat3::identity() * a + d * d.transpose() * b;
                blocks[diagonal] += block;
                blocks[place(end.other)] -= block;
            }

            let mut first = 0;
            for (elements, numbers) in model.elements.iter().zip(&numbers.elements) {
                let frozen = &self.frozen[first..first + elements.frozen_count()];
                elements.add_row(i, frozen, &mut |j, block| blocks[place(j)] += block * numbers.matrix);
                first += elements.frozen_count();
            }
        });
    }
}

/// Room for the matrix of a model.
pub(crate) fn pattern<R: Real>(model: &Model<R>) -> BlockCsr<R> {
    let row = |i: usize| {
        let elements = model.elements.iter().flat_map(|elements| elements.row(i));
        model.springs.row(i).map(|end| end.other).chain(elements).collect()
    };
    BlockCsr::with_pattern((0..model.count).map(row))
}

impl<R: Real> LinearOperator<R> for StepMatrix<'_, R> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        let scratch = &mut *self.scratches.take();
        dispatch(Product { matrix: *self, first_row, p, q, scratch })
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }
}

impl<R: Real> StepMatrix<'_, R> {
    /// Adds the products of the elements of a block.
    #[inline(always)]
    fn add_elements<P: Pack<Number = R>>(
        &self,
        block: usize,
        p: &[Padded<R>],
        q: &mut [Sixteen<R>],
        scratch: &mut BlockScratch<R>,
    ) {
        let rows = q.len() * LANES;
        let mut first = 0;
        scratch.corners.clear(rows);
        for (elements, numbers) in self.model.elements.iter().zip(&self.numbers.elements) {
            let range = elements.frozen(block);
            let frozen = &self.frozen[first + range.start..first + range.end];
            let at = BlockOfRows { block, rows, group: None, fields: [self.x, p] };
            elements.multiply::<P>(at, numbers, frozen, scratch);
            first += elements.frozen_count();
        }
        for (group, row) in q.iter_mut().enumerate() {
            let (own, added) = (row.load::<P>(), scratch.corners.sixteen::<P>(group));
            row.store(three!(|c| own[c] + added[c]));
        }
    }
}

struct Product<'a, R: Real> {
    matrix: StepMatrix<'a, R>,
    first_row: usize,
    p: &'a [Padded<R>],
    q: &'a mut [Sixteen<R>],
    scratch: &'a mut BlockScratch<R>,
}

impl<R: Real> WithSimd<R> for Product<'_, R> {
    type Output = [f64; 2];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 2] {
        let StepMatrix { model, numbers, x, .. } = self.matrix;
        self.q.fill(Sixteen::default());
        let mut fold = SpringProduct {
            along: &numbers.along,
            pattern_of: &model.springs.pattern_of,
            tangent: self.matrix.tangent,
            q: self.q,
        };
        let block = self.first_row / model.block_size;
        model.springs.fold_block::<P::Register>(block, [x, self.p], &mut self.scratch.records, &mut fold);
        if !model.elements.is_empty() {
            self.matrix.add_elements::<P>(block, self.p, self.q, self.scratch);
        }
        if let Some(pairs) = self.matrix.pairs {
            pairs.multiply(block, self.first_row, self.p, self.q);
        }

        let h = R::of(numbers.scheme.h);
        let mut sums = Sums::<P::Wide>::zero();
        let (first, movable) = (self.first_row / LANES, model.movable());
        for (place, q) in (first..).zip(self.q) {
            let [inv_m, moves] = [lanes_at::<P>(&model.inv_m, place), lanes_at::<P>(movable, place)];
            let (m, p) = (lanes_at::<P>(&model.m, place), packs_at::<P>(self.p, place));
            let medium = numbers.external.at::<P>(place).on_free(inv_m);
            let row = medium.add_product(q.load::<P>(), p, m, h);
            let row = three!(|c| row[c].where_positive(moves));
            sums.add(p, row);
            q.store(row);
        }
        sums.total()
    }
}

/// Adds the springs' blocks a I + b d dᵀ times w = p_i - p_j.
struct SpringProduct<'a, R: Real> {
    along: &'a [[R; LANES]],
    pattern_of: &'a [u32],
    tangent: &'a [[R; LANES]],
    q: &'a mut [Sixteen<R>],
}

impl<P: Lanes> Fold<P> for SpringProduct<'_, P::Number> {
    type Sums = [P; 3];

    #[inline(always)]
    fn sums(&self, [group, part]: [usize; 2]) -> [P; 3] {
        let q = &self.q[group].0;
        three!(|c| P::load_part(&q[c], part))
    }

    #[inline(always)]
    fn add(&mut self, sums: &mut [P; 3], [slot, part]: [usize; 2], d: [P; 3], w: [P; 3]) {
        let along = P::load_part(&self.along[self.pattern_of[slot] as usize], part);
        let b = P::load_part(&self.tangent[slot], part);
        let a = along - b * dot(d, d);
        let pull = b * dot(w, d);
        for c in 0..3 {
            sums[c] += a * w[c] + pull * d[c];
        }
    }

    #[inline(always)]
    fn keep(&mut self, [group, part]: [usize; 2], sums: [P; 3]) {
        let q = &mut self.q[group].0;
        for c in 0..3 {
            sums[c].store_part(&mut q[c], part);
        }
    }
}

//! What pushes adds to a solve: to the matrix, block by block of rows, to its diagonal blocks and to the right-hand side.
//!
//! A block has the pairs that touch it, in their order, so that a row adds them in one order whatever the number of threads.

use super::{pushing::Pushing, room::make_room, ways::wide};
use crate::{
    cloth::layout::{Figure, Model},
    linalg::{Inverse3, Symmetric3},
    math::{LANES, Padded, Real, Sixteen, Vec3},
    parallel::{block_count, per_sixteen, per_sixteen_mut, size},
};

/// What pushes, as the solve has it.
#[derive(Clone, Copy, Debug)]
struct Push<R: Real> {
    corners: [u32; 4],
    weights: [R; 4],
    normal: Vec3<R>,
    /// What it adds along the normal, beyond what it adds in all directions (kg).
    along: R,
    /// Friction (kg) in all directions; along the way that it slides there is as much less.
    rub: R,
    slides: Vec3<R>,
    /// What it gives the right-hand side at a weight of 1 (N s).
    given: Vec3<R>,
}

/// Bytes of an active pair: beside it stand the blocks that it touches.
pub(super) const PUSH_BYTES: usize = size_of::<Push<f64>>() + 4 * size_of::<u32>();

/// The pairs of a solve, by blocks, and the right-hand side and the inverse diagonal blocks with them.
#[derive(Clone, Debug, Default)]
pub(crate) struct PairRows<R: Real> {
    pushes: Vec<Push<R>>,
    /// Where the pushes of each block start among `of_blocks`, and the end.
    starts: Vec<u32>,
    of_blocks: Vec<u32>,
    /// Of the evaluation, as they were before the first solve of the sub-step.
    rows: Vec<Sixteen<R>>,
    pub(crate) b: Vec<Sixteen<R>>,
    pub(crate) inverse: Vec<Inverse3>,
    /// What pushes add to the diagonal blocks, of blocks that any touches.
    added: Vec<[Symmetric3; LANES]>,
    /// Whether any push moves a row, where corners of figures give way; else empty.
    touched: Vec<bool>,
}

impl<R: Real> PairRows<R> {
    /// Keeps the right-hand side that has no pairs.
    pub(crate) fn keep(&mut self, model: &Model<R>, rows: &[Sixteen<R>]) {
        size(&mut self.rows, rows.len());
        let fields = (per_sixteen_mut(&mut self.rows), per_sixteen(rows));
        model.share.own().each(fields, |_, (kept, rows)| kept.copy_from_slice(rows));
    }

    /// The right-hand side that has no pairs.
    pub(crate) fn kept(&self) -> &[Sixteen<R>] {
        &self.rows
    }

    /// Bytes of its lists of active pairs.
    pub(super) fn bytes(&self) -> usize {
        self.pushes.capacity() * size_of::<Push<R>>() + self.of_blocks.capacity() * size_of::<u32>()
    }

    pub(crate) fn is_empty(&self) -> bool {
        self.pushes.is_empty()
    }

    /// Takes over what pushes, at velocities (m/s) with which a sub-step of `dt` (s) starts; what that adds to the diagonal blocks goes beside the
    /// inverses of the evaluation.
    pub(crate) fn set<'a>(
        &mut self,
        (model, inverse): (&Model<R>, &[Inverse3]),
        pushing: impl Iterator<Item = Pushing<'a>> + Clone,
        (v, dt): (&[Padded<R>], f64),
    ) {
        self.pushes.clear();
        make_room(&mut self.pushes, pushing.clone().count(), usize::MAX);
        for push in pushing {
            let Pushing { stencil, hold, .. } = push;
            let (velocity, rub) = (push.relative(|corner| wide(&v[corner])), hold.rub.per_speed());
            self.pushes.push(Push {
                corners: stencil.corners,
                weights: stencil.weights.map(R::of),
                normal: stencil.normal.map(R::of),
                along: R::of(hold.stiffness - rub),
                rub: R::of(rub),
                slides: hold.rub.way.map(R::of),
                given: push.impulse(&velocity, dt).map(R::of),
            });
        }
        self.touch(model);
        if !self.pushes.is_empty() {
            self.divide(model);
            self.add_up(model, inverse);
        }
    }

    /// Takes over which rows pushes move.
    fn touch(&mut self, model: &Model<R>) {
        let Self { pushes, touched, .. } = self;
        touched.clear();
        if !model.has_giving_corners() {
            return;
        }
        touched.resize(model.count, false);
        for push in &*pushes {
            for (corner, weight) in push.corners.iter().zip(push.weights) {
                touched[*corner as usize] |= weight != R::zero();
            }
        }
    }

    /// Keeps a first guess of changes of velocity off corners of figures that nothing pushes. Their rows have their mass alone, so that their
    /// solution is exactly 0, and stays so.
    pub(crate) fn keep_off(&self, model: &Model<R>, dv: &mut [Sixteen<R>]) {
        for (row, _) in model.figures.iter().flat_map(Figure::giving) {
            if self.touched.get(row) != Some(&true) {
                dv[row / LANES].set(row % LANES, Vec3::zeros());
            }
        }
    }

    /// Lists the pushes of each block.
    fn divide(&mut self, model: &Model<R>) {
        let blocks = block_count(model.count, model.block_size);
        let Self { pushes, starts, of_blocks, .. } = self;
        starts.clear();
        starts.resize(blocks + 1, 0);
        for push in &*pushes {
            push.blocks(model.block_size).for_each(|block| starts[block + 1] += 1);
        }
        for block in 0..blocks {
            starts[block + 1] += starts[block];
        }
        of_blocks.clear();
        make_room(of_blocks, starts[blocks] as usize, usize::MAX);
        of_blocks.resize(starts[blocks] as usize, 0);
        for (number, push) in pushes.iter().enumerate() {
            for block in push.blocks(model.block_size) {
                of_blocks[starts[block] as usize] = number as u32;
                starts[block] += 1;
            }
        }
        // Each start went on to that of the next block.
        starts.rotate_right(1);
        starts[0] = 0;
    }

    /// The right-hand side and the inverses with the pushes.
    fn add_up(&mut self, model: &Model<R>, of_evaluation: &[Inverse3]) {
        let Self { pushes, starts, of_blocks, rows, b, inverse, added, .. } = self;
        size(b, rows.len());
        size(inverse, of_evaluation.len());
        added.resize(b.len(), Default::default());
        let (pushes, starts, of_blocks) = (&*pushes, &*starts, &*of_blocks);
        let movable = model.movable();
        let sums = (per_sixteen_mut(b), per_sixteen_mut(inverse), per_sixteen_mut(added));
        let fields = (sums, per_sixteen(rows), per_sixteen(of_evaluation));
        model.share.own().each(fields, |block, ((b, inverse, added), rows, of_evaluation)| {
            b.copy_from_slice(rows);
            inverse.copy_from_slice(of_evaluation);
            let of_block = &of_blocks[starts[block] as usize..starts[block + 1] as usize];
            if of_block.is_empty() {
                return;
            }
            added.fill(Default::default());
            let first = block * model.block_size;
            for push in of_block.iter().map(|number| &pushes[*number as usize]) {
                for (row, weight) in push.rows(first..first + b.len() * LANES) {
                    if movable[first + row] == R::zero() {
                        continue;
                    }
                    add(&mut b[row / LANES], row % LANES, push.given * weight);
                    push.add_to(&mut added[row / LANES][row % LANES], weight.to_f64());
                }
            }
            let added = added.as_flattened().iter().enumerate();
            for (row, added) in added.filter(|(_, added)| **added != Symmetric3::default()) {
                inverse[row / LANES].add(row % LANES, added);
            }
        });
    }

    /// Adds the products of the pushes of a block of rows with a vector.
    pub(crate) fn multiply(&self, block: usize, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) {
        if self.pushes.is_empty() {
            return;
        }
        let of_block = self.starts[block] as usize..self.starts[block + 1] as usize;
        let own = first_row..first_row + q.len() * LANES;
        for number in &self.of_blocks[of_block] {
            let push = &self.pushes[*number as usize];
            let force = push.times(p);
            for (row, weight) in push.rows(own.clone()) {
                add(&mut q[row / LANES], row % LANES, force * weight);
            }
        }
    }
}

impl<R: Real> Push<R> {
    /// The blocks that it touches, each once.
    fn blocks(&self, block_size: usize) -> impl Iterator<Item = usize> {
        let of = self.corners.map(|corner| corner as usize / block_size);
        let weights = self.weights;
        (0..4)
            .filter(move |&k| {
                weights[k] != R::zero() && !(0..k).any(|j| weights[j] != R::zero() && of[j] == of[k])
            })
            .map(move |k| of[k])
    }

    /// Its corners among rows, from the first of these on, with their weights.
    fn rows(&self, own: std::ops::Range<usize>) -> impl Iterator<Item = (usize, R)> {
        let (corners, weights, start) = (self.corners, self.weights, own.start);
        (0..4)
            .filter(move |&k| weights[k] != R::zero() && own.contains(&(corners[k] as usize)))
            .map(move |k| (corners[k] as usize - start, weights[k]))
    }

    /// What it makes of a vector at a weight of 1.
    fn times(&self, p: &[Padded<R>]) -> Vec3<R> {
        let mut u = Vec3::zeros();
        for (corner, weight) in self.corners.iter().zip(self.weights) {
            if weight != R::zero() {
                u += p[*corner as usize].vector() * weight;
            }
        }
        let across = u - self.slides * u.dot(&self.slides);
        self.normal * (self.along * u.dot(&self.normal)) + across * self.rub
    }

    /// Adds its block of the diagonal at a weight.
    fn add_to(&self, block: &mut Symmetric3, weight: f64) {
        let [n, s] = [self.normal, self.slides].map(|vector| vector.map(R::to_f64));
        let [along, rub] = [self.along, self.rub].map(|number| number.to_f64() * weight * weight);
        block.xx += along * n.x * n.x + rub * (1.0 - s.x * s.x);
        block.yy += along * n.y * n.y + rub * (1.0 - s.y * s.y);
        block.zz += along * n.z * n.z + rub * (1.0 - s.z * s.z);
        block.xy += along * n.x * n.y - rub * s.x * s.y;
        block.xz += along * n.x * n.z - rub * s.x * s.z;
        block.yz += along * n.y * n.z - rub * s.y * s.z;
    }
}

/// Adds a vector to a lane.
fn add<R: Real>(group: &mut Sixteen<R>, lane: usize, vector: Vec3<R>) {
    group.set(lane, group.get(lane) + vector);
}

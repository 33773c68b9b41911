//! Vertex block descent (Chen, Liu, Yang and Yuksel 2024): each particle in turn goes to where what is minimised is least to
//! second order in its own position, the others held, by the diagonal block of the matrix.
//!
//! A sweep goes over the blocks colour by colour, those of a colour at the same time, and within a block over its rows
//! colour by colour. What it converges to is the step that Newton's method finds: a sweep costs no more than a few products
//! with the matrix, but errors that are as long as the cloth take many sweeps: so sweeps [gather momentum](super::momentum),
//! and [what all particles share](super::common_motion) is not left to them.

use super::{
    iterate::{Block, Start},
    mix::Mix,
    newton::{Search, Tried},
    update::Step,
    vectors::Vectors,
};
use crate::{
    cloth::{
        evaluate::{Evaluated, SpringSums, StepNumbers},
        judge::Found,
        laws::Stretch,
        layout::{BlockOfRows, BlockScratch, Model},
        network::Visit,
        settings::{ClothSettings, Descend, RightHandSide},
    },
    interrupt::Interrupt,
    linalg::{Inverse3, Outcome, PreconditionerKind, SolveReport, load_six, packs, store_padded},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, dispatch, three},
    parallel::{per_row, per_row_mut, per_sixteen_mut},
    report::{Stage, StepFailure},
};

/// How many times as many sweeps as asked for a sub-step makes at most, before it is rejected.
const LONGEST: u32 = 16;

/// Writes where the step leads; returns its sweeps as a solve, what they found, and what the error of a particle is of the
/// vector that its block added up.
///
/// # Errors
/// Where the momentum of a component does not balance after 16 times as many sweeps; where unchecked steps were asked for
/// that is not looked at.
pub(super) fn advance<R: Real>(
    step: &mut Step<'_, R>,
    settings: &ClothSettings,
    sweeps: u32,
    interrupt: &Interrupt,
) -> Result<(SolveReport, Found, f64), StepFailure> {
    let inertia = step.predict();

    let none = SolveReport::at_once(Outcome::IterationCap, 0.0);
    let mut search = Search { step, settings, interrupt, report: Some(none), mix: Mix::EXACT, taken: 0.0 };
    let first = search.evaluate(Tried::Next);
    search.step.fall();
    let mut momentum = search.step.gather_momentum();
    let is_checked = !settings.time_step.is_unchecked();
    let most = if is_checked { sweeps.saturating_mul(LONGEST) } else { sweeps };
    let (mut made, mut outcome) = (0, Outcome::IterationCap);
    let mut last = loop {
        for _ in 0..sweeps {
            if interrupt.is_requested() {
                return Err(StepFailure::Interrupted);
            }
            if made > 0 && !search.step.extrapolate(&mut momentum) {
                outcome = Outcome::Converged;
                break;
            }
            search.step.sweep();
            made += 1;
        }
        let last = search.evaluate(Tried::Next);
        let is_last = made >= most || outcome == Outcome::Converged;
        let unbalanced = if is_checked { search.step.unbalanced(made) } else { None };
        match unbalanced {
            Some(failure) if is_last => return Err(failure),
            Some(_) => {}
            None => break last,
        }
    };
    if search.step.take_common_motion() {
        last = search.evaluate(Tried::Next);
    }
    search.report = Some(SolveReport { iterations: made, ..none });
    Ok(search.end(inertia, [first, last], outcome))
}

impl<R: Real> Step<'_, R> {
    /// Moves every free particle of the iterate in `next` once.
    fn sweep(&mut self) {
        let (model, own) = (self.model, self.model.share.own());
        let colours = model.colours.as_ref().expect("laid out for these settings");
        let Evaluated { evaluation, numbers, scratches, .. } = &mut *self.evaluated;
        let Vectors { trial: [x, v], .. } = &mut *self.vectors;
        let next = &mut *self.next;
        evaluation.runs += 1;
        let start = Start::new(model, self.state, numbers);
        let scratch = || scratches.take();
        for colour in 0..colours.count() {
            // What others read rests until all blocks of the colour are done.
            let targets = [per_row_mut(x), per_row_mut(v)];
            let parts = (start.rows(), targets, per_sixteen_mut(&mut evaluation.rows));
            own.each_with(scratch, parts, |scratch, number, (start_rows, to, rows)| {
                if colours.of_block(number) != colour {
                    return;
                }
                let (start, visits) = (start.block(number, start_rows), colours.visits(number));
                let fields = [&*next.x, &*next.v];
                dispatch(DescendBlock { model, numbers, number, start, visits, fields, to, rows, scratch });
            });

            let targets = [per_row_mut(&mut next.x), per_row_mut(&mut next.v)];
            own.each((targets, [per_row(x), per_row(v)]), |block, ([to_x, to_v], [x, v])| {
                if colours.of_block(block) == colour {
                    to_x.copy_from_slice(x);
                    to_v.copy_from_slice(v);
                }
            });
        }
        self.watch.lap(Stage::Solve);
    }
}

/// A block whose rows move once each.
struct DescendBlock<'a, R: Real> {
    model: &'a Model<R>,
    numbers: &'a StepNumbers<R>,
    number: usize,
    start: Block<'a, R>,
    visits: &'a [Visit],
    /// Positions and velocities of all particles.
    fields: [&'a [Padded<R>]; 2],
    /// Those of the block, to be written.
    to: [&'a mut [Padded<R>]; 2],
    rows: &'a mut [Sixteen<R>],
    scratch: &'a mut BlockScratch<R>,
}

impl<R: Real> WithSimd<R> for DescendBlock<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(mut self) {
        self.model.springs.copy_block(self.number, self.fields, &mut self.scratch.records);
        for visit in self.visits {
            self.visit::<P>(*visit);
        }
        let [to_x, to_v] = self.to;
        for ((x, v), record) in to_x.iter_mut().zip(to_v).zip(&self.scratch.records) {
            [*x, *v] = record.0;
        }
    }
}

impl<R: Real> DescendBlock<'_, R> {
    /// Moves rows of a group, whose records they change.
    #[inline(always)]
    fn visit<P: Pack<Number = R>>(&mut self, visit: Visit) {
        let group = usize::from(visit.group);
        let (forces, mut block) = self.forces::<P>(group);
        let StepNumbers { scheme, gravity, .. } = *self.numbers;
        let ([_, base], [m, inv_m]) = self.start.at::<P>(group);
        let records = self.scratch.records[group * LANES..].first_chunk::<LANES>();
        let records = records.expect("a group of a block");
        let field = |number: usize| std::array::from_fn(|lane| records[lane].0[number]);
        let (x, u) = (packs::<P>(&field(0)), packs::<P>(&field(1)));

        let h = R::of(scheme.h);
        let place = self.number * (self.model.block_size / LANES) + group;
        let medium = self.numbers.external.at::<P>(place);
        let force = medium.force(u);
        let rest = three!(|c| (m * gravity[c] + force[c]) * h + forces[c] - m * (u[c] - base[c]));
        medium.widen().add_to(&mut block, m.widen(), P::Wide::of(scheme.h));
        let inverse = Inverse3::of_packs(block, PreconditionerKind::BlockJacobi, inv_m.widen());
        let moves = P::from_singles(&visit.mask());
        let change = inverse.times(three!(|c| rest[c].where_positive(inv_m)));
        let change = three!(|c| change[c].where_positive(moves));

        let mut new = [[Padded::default(); LANES]; 2];
        store_padded(three!(|c| x[c] + change[c] * h), &mut new[0]);
        store_padded(three!(|c| u[c] + change[c]), &mut new[1]);
        let records = &mut self.scratch.records[group * LANES..(group + 1) * LANES];
        for ((record, x), u) in records.iter_mut().zip(&new[0]).zip(&new[1]) {
            record.0 = [*x, *u];
        }
    }

    /// h f (N s) of springs and elements on the rows of a group, and what they add to its diagonal blocks (kg).
    #[inline(always)]
    fn forces<P: Pack<Number = R>>(&mut self, group: usize) -> ([P; 3], [P::Wide; 6]) {
        let Self { model, numbers, number, fields, .. } = *self;
        let springs = &model.springs;
        self.rows[group] = Sixteen::default();
        self.scratch.diagonal[group] = [[0.0; LANES]; 6];
        let has_elements = !model.elements.is_empty();
        if has_elements {
            let rows = self.rows.len() * LANES;
            let side = (RightHandSide::Forces, numbers.mirror);
            self.scratch.corners.clear(rows);
            let at = BlockOfRows { block: number, rows, group: Some(group), fields };
            for (elements, numbers) in model.elements.iter().zip(&numbers.elements) {
                elements.evaluate::<P, Descend>(at, numbers, side, &mut [], self.scratch);
            }
            springs.copy_first_halo(number, fields, &mut self.scratch.records);
        }

        let BlockScratch { records, diagonal, bounds, rates, corners, .. } = &mut *self.scratch;
        let mut fold = SpringSums::<P, Descend> {
            springs,
            laws: &numbers.springs,
            along: &numbers.along,
            bounds: &numbers.bounds.springs,
            mirror: P::splat(numbers.mirror),
            side: RightHandSide::Forces,
            first_slot: 0,
            tangent: &mut [],
            rows: self.rows,
            diagonal,
            stiffness: bounds,
            rates,
            energy: P::Wide::zero(),
            power: P::Wide::zero(),
            stretch: Stretch::none(),
            aim: std::marker::PhantomData,
        };
        springs.fold_rows([number, group], fields, records, &mut fold);
        let mut forces = self.rows[group].load::<P>();
        if has_elements {
            let added = corners.sixteen::<P>(group);
            forces = three!(|c| forces[c] + added[c]);
            corners.add_blocks_to(group, &mut diagonal[group]);
        }
        (forces, load_six::<P::Wide>(&diagonal[group]))
    }
}

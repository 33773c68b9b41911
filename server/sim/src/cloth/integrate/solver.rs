//! What solves the linear systems of steps: their matrix, applied or assembled, with preconditioners that are set up for it.
//!
//! Reads a system; writes the change of velocities (m/s) that solves it, and memory that goes from solve to solve.

use crate::{
    cloth::{
        evaluate::{SetUp, StepMatrix, pattern},
        layout::Model,
        state::Kept,
    },
    interrupt::Interrupt,
    linalg::{
        BlockCsr, CgWorkspace, CoarseLayout, CoarseMatrix, Inverse3, LinearOperator, OperatorKind,
        PatchLayout, PreconditionerKind, SolveReport, SolverSettings, System, solve,
    },
    math::{Padded, Real, Sixteen},
};

/// A linear system of a step.
#[derive(Clone, Copy)]
pub(super) struct Linear<'a, R: Real> {
    pub(super) matrix: StepMatrix<'a, R>,
    /// (N s)
    pub(super) b: &'a [Sixteen<R>],
    /// Inverses of its diagonal blocks (1/kg).
    pub(super) inverse: &'a [Inverse3],
}

/// Memory of the solves of one cloth.
#[derive(Clone, Debug, Default)]
pub(crate) struct Solver<R: Real> {
    /// The matrix, where the settings ask for an assembled one.
    assembled: Option<BlockCsr<R>>,
    /// Of a preconditioner that has a coarse space.
    coarse: CoarseMatrix,
    /// Of a preconditioner that has patches.
    patches: SetUp<R>,
    pub(crate) cg: CgWorkspace<R>,
    /// Products with the matrix since the step of the world began.
    pub(crate) products: u64,
    /// Linear solves of the sub-step that is tried.
    pub(crate) solves: u32,
}

impl<R: Real> Solver<R> {
    /// Makes room for the systems of a cloth.
    pub(crate) fn size_for(&mut self, model: &Model<R>) {
        if Sixteen::<R>::count_for(model.count) != self.cg.len() {
            self.cg = CgWorkspace::new(model.count, model.block_size);
        }
    }

    /// Lets the next solve set up again what was set up for a state that somebody else changed.
    pub(crate) fn forget(&mut self) {
        self.patches.forget();
    }

    /// Sets up what a preconditioner has on a coarse space, from a matrix and its inverse diagonal blocks; patches alone where those
    /// that are kept do not serve.
    pub(super) fn set_up(
        &mut self,
        matrix: &StepMatrix<'_, R>,
        inverse: &[Inverse3],
        kind: PreconditionerKind,
        kept: &mut Kept<R>,
    ) {
        let StepMatrix { model, numbers, x, scratches, interrupt, .. } = *matrix;
        if let Some(layout) = affine(model, kind) {
            self.coarse.fill(layout, &|block, blocks| matrix.project(layout, block, blocks));
        }
        let Some(layout) = soft(model, kind) else { return };
        let now = [numbers.scheme.h, numbers.mirror.to_f64()];
        if kept.serves(now) {
            self.patches.make_again(layout, (model, numbers), kept, scratches, interrupt);
            return;
        }
        // Of the air the matrix has a part that follows from velocities too.
        if numbers.external.has_air() {
            kept.forget();
        } else {
            kept.begin(x, now);
        }
        self.patches.make(layout, matrix, inverse, kept);
    }

    /// Solves a system for a change of velocity, of which `begin` writes the first guess where the settings ask for a warm start.
    pub(super) fn solve(
        &mut self,
        system: &Linear<'_, R>,
        dv: &mut [Sixteen<R>],
        begin: &dyn Fn(&mut [Sixteen<R>]),
        settings: &SolverSettings,
    ) -> SolveReport {
        let Linear { matrix, b, inverse } = *system;
        let (model, interrupt, kind) = (matrix.model, matrix.interrupt, settings.preconditioner);
        let stored;
        let operator: &dyn LinearOperator<R> = match settings.operator {
            OperatorKind::MatrixFree => &matrix,
            OperatorKind::Assembled => {
                let room = self.assembled.get_or_insert_with(|| pattern(model));
                matrix.assemble(room);
                stored = Interruptible { operator: &*room, interrupt };
                &stored
            }
        };
        let coarse = affine(model, kind).map(|layout| (layout, &self.coarse));
        let patches = soft(model, kind).map(|layout| (layout, self.patches.matrix()));
        let system = System { operator, b, inverse, coarse, patches };
        let report = solve(&system, dv, begin, settings, &model.share, &mut self.cg);
        self.products += u64::from(report.products);
        report
    }
}

/// The affine functions of a preconditioner, if it has any.
fn affine<R: Real>(model: &Model<R>, kind: PreconditionerKind) -> Option<&CoarseLayout> {
    model.coarse.as_ref().filter(|_| kind == PreconditionerKind::TwoLevel)
}

/// The patches of a preconditioner, if it has any.
fn soft<R: Real>(model: &Model<R>, kind: PreconditionerKind) -> Option<&PatchLayout> {
    model.patches.as_ref().filter(|_| kind == PreconditionerKind::Patches)
}

/// An operator whose solve can be given up.
struct Interruptible<'a, R> {
    operator: &'a dyn LinearOperator<R>,
    interrupt: &'a Interrupt,
}

impl<R: Real> LinearOperator<R> for Interruptible<'_, R> {
    fn apply(&self, first_row: usize, p: &[Padded<R>], q: &mut [Sixteen<R>]) -> [f64; 2] {
        self.operator.apply(first_row, p, q)
    }

    fn is_interrupted(&self) -> bool {
        self.interrupt.is_requested()
    }
}

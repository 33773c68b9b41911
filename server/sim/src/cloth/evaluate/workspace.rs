//! The scratch memory of a step.

use super::{
    common::{Common, PartSums, Shift},
    energy::{Allowance, Judged, Start},
    evaluation::Evaluation,
    external::External,
    iterate_sums::{Leftover, SweepSums},
    moved::Moved,
    numbers::StepNumbers,
    set_up::SetUp,
};
use crate::{
    cloth::{
        contact::{Contact, Count},
        layout::{Model, Scratches, Triangles},
        settings::{ClothSettings, Integrator, Purpose},
        state::{ClothReport, PinMotion, State},
    },
    collide,
    linalg::{BlockCsr, CgWorkspace, CoarseMatrix},
    math::{LANES, Padded, Real, Sixteen, Vec3, vec3},
    parallel::{block_count, per_sixteen_mut, size},
};

/// Pins on their way and their velocities, to return to.
#[derive(Clone, Debug, Default)]
struct Pins<R: Real> {
    motions: Vec<PinMotion>,
    velocities: Vec<Padded<R>>,
}

impl<R: Real> Pins<R> {
    fn keep(&mut self, state: &State<R>) {
        self.motions.clone_from(&state.motions);
        self.velocities.clear();
        self.velocities.extend(state.motions.iter().map(|motion| state.v[motion.particle as usize]));
    }

    fn restore(&self, state: &mut State<R>) {
        state.motions.clone_from(&self.motions);
        for (motion, v) in self.motions.iter().zip(&self.velocities) {
            state.v[motion.particle as usize] = *v;
        }
    }
}

/// Scratch memory of one cloth under one set of settings: a step allocates nothing after the first two, which make the
/// two or three states that steps take turns in.
#[derive(Clone, Debug, Default)]
pub struct Workspace<R: Real> {
    /// The state before the step, to return to; but for pins on their way.
    before: State<R>,
    /// What a sub-step writes.
    pub(crate) next: State<R>,
    /// Whether `before` is the state before the step.
    has_moved: bool,
    /// Pins on their way before the step, and before the sub-step.
    pins: Pins<R>,
    pins_of_substep: Pins<R>,
    pub(crate) numbers: StepNumbers<R>,
    pub(crate) evaluation: Evaluation<R>,
    /// What the evaluation was made for, where it is that of the state, with these numbers.
    current: Option<Purpose>,
    /// What is known of the state that the sub-step which is tried starts from.
    pub(crate) start: Start,
    /// Of implicit steps that are judged: what energy the sub-step that is tried may have, and whether that holds after contacts.
    pub(crate) allowed: Option<Allowance>,
    pub(crate) judged: Judged,
    /// What its parts do as a whole, memory for that, and what each lacks of the momentum that it should have.
    pub(crate) common: Common,
    pub(crate) of_parts: PartSums,
    pub(crate) lacking: Vec<Shift>,
    /// What it met.
    pub(crate) met: collide::Met,
    /// What a sub-step that is tried found of its motion, block by block.
    pub(crate) moved: Vec<Moved>,
    /// Of implicit steps, block by block: inertia where the step starts (J), what is left over at an iterate, the momentum
    /// (N s) that forces give to what no pin holds, and B (N s/m) of the air there.
    pub(crate) inertias: Vec<f64>,
    pub(crate) leftovers: Vec<Leftover>,
    pub(crate) momenta: Vec<[f64; 9]>,
    /// On the way out of a saddle, block by block: the greatest square of a change of velocity (m²/s²).
    pub(crate) squares: Vec<f64>,
    /// Of sweeps, block by block: where the last one led.
    pub(crate) sweep_sums: Vec<SweepSums>,
    /// Pairs that keep its surfaces apart, in the sub-step that is tried.
    pub(crate) contact: Contact<R>,
    /// Memory of the count of crossings.
    pub(crate) crossings: Count,
    /// What its contacts keep.
    pub(crate) contacts: collide::Kept,
    /// What the sub-step that is tried tells, and what those before it in the step told.
    pub(crate) tried: ClothReport,
    pub(crate) report: ClothReport,
    /// Velocities (m/s) that a force is predicted at; of explicit steps alone.
    pub(crate) predicted: Vec<Padded<R>>,
    /// Positions (m) and velocities (m/s) of an iterate that is tried.
    pub(crate) trial: [Vec<Padded<R>>; 2],
    /// Of sweeps: velocities (m/s) that the last one began with, and those that the one before it ended with.
    pub(crate) swept: [Vec<Padded<R>>; 2],
    /// By how much each component, of sweeps, or each part moves as a whole (m/s).
    pub(crate) shifts: Vec<Vec3<R>>,
    /// The matrix of an implicit step, where the solver asks for an assembled one.
    pub(crate) assembled: Option<BlockCsr<R>>,
    /// Of a preconditioner that has a coarse space.
    pub(crate) coarse: CoarseMatrix,
    /// Of a preconditioner that has patches.
    pub(crate) patches: SetUp<R>,
    pub(crate) cg: CgWorkspace<R>,
    /// Products with the matrix since the step of the world began.
    pub(crate) products: u64,
    /// Linear solves of the sub-step that is tried.
    pub(crate) solves: u32,
    pub(crate) scratches: Scratches<R>,
}

impl<R: Real> Workspace<R> {
    /// Empty: the first step sizes it for its method.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets what is known of the state, which somebody else changed.
    pub(crate) fn forget(&mut self) {
        self.current = None;
        self.patches.forget();
    }

    /// The largest error (m) of the sub-step that was tried last.
    pub(crate) fn tried_error(&self) -> f64 {
        self.tried.error.largest
    }

    /// Whether the state was evaluated for a purpose.
    pub(crate) fn is_current(&self, purpose: Purpose) -> bool {
        self.current == Some(purpose)
    }

    pub(crate) fn size_for(&mut self, model: &Model<R>, settings: &ClothSettings, purpose: Purpose) {
        let blocks = block_count(model.count, model.block_size);
        // A cloth of few particles has one block, of fewer rows than a block may have.
        let rows = model.block_size.min(model.m.len());
        let elements = if model.elements.is_empty() { 0 } else { rows };
        let triangles = model.triangles.as_ref().map_or(0, Triangles::room);
        self.scratches.size_for(blocks, [rows, elements, triangles], model.room());
        let has_iterates = settings.has_iterates();
        let largest = if has_iterates { Purpose::Iterate(settings.solver.preconditioner) } else { purpose };
        self.evaluation.size_for(model, largest);
        self.moved.resize(blocks, Moved::default());
        if largest.has_matrix() {
            self.inertias.resize(blocks, 0.0);
            self.leftovers.resize(blocks, Leftover::default());
            self.momenta.resize(blocks, [0.0; 9]);
            self.squares.resize(blocks, 0.0);
        }
        if settings.integrator == Integrator::VelocityVerletPredicted {
            size(&mut self.predicted, model.m.len());
        }
        if has_iterates {
            self.trial.iter_mut().for_each(|field| size(field, model.m.len()));
        }
        if settings.has_sweeps() {
            self.sweep_sums.resize(blocks, SweepSums::default());
            self.swept.iter_mut().for_each(|field| size(field, model.m.len()));
        }
        if largest.has_matrix() && self.evaluation.rows.len() != self.cg.len() {
            self.cg = CgWorkspace::new(model.count, model.block_size);
        }
    }

    /// Begins a step from a state.
    pub(crate) fn begin(&mut self, state: &State<R>) {
        self.has_moved = false;
        self.pins.keep(state);
        self.report = ClothReport::default();
        self.contacts.begin();
        (self.evaluation.runs, self.products) = (0, 0);
    }

    /// Begins a sub-step from a state, before its pins are aimed.
    pub(crate) fn begin_substep(&mut self, state: &State<R>) {
        self.pins_of_substep.keep(state);
        self.solves = 0;
    }

    /// Makes room for what a sub-step from `state` writes, without touching what `undo` needs; of two states where
    /// the step is not divided, of three otherwise.
    pub(crate) fn make_room(&mut self, state: &State<R>) {
        if !self.has_moved && self.next.x.is_empty() {
            std::mem::swap(&mut self.before, &mut self.next);
        }
        self.next.succeed(state);
        if !state.past.x.is_empty() {
            self.next.size_past();
        }
    }

    /// Gives a sub-step up that was not accepted: what it wrote is not the state.
    pub(crate) fn abandon(&mut self, state: &mut State<R>) {
        self.pins_of_substep.restore(state);
        self.forget();
    }

    /// Ends a sub-step: what it wrote is the state.
    pub(crate) fn accept(&mut self, state: &mut State<R>) {
        std::mem::swap(state, &mut self.next);
        if !self.has_moved {
            std::mem::swap(&mut self.before, &mut self.next);
            self.has_moved = true;
        }
    }

    /// The state before the step, once a sub-step was accepted.
    pub(crate) fn before(&self) -> &State<R> {
        &self.before
    }

    /// Takes `state` back to where it was before the step.
    pub(crate) fn undo(&mut self, state: &mut State<R>) {
        if self.has_moved {
            std::mem::swap(state, &mut self.before);
            self.has_moved = false;
        }
        self.pins.restore(state);
        self.forget();
    }

    /// Takes over that what a sub-step wrote has moved since it was evaluated.
    pub(crate) fn know_nothing(&mut self) {
        self.current = None;
    }

    /// Takes over that the evaluation is that of what a sub-step wrote, for this purpose too.
    pub(crate) fn know(&mut self, purpose: Purpose) {
        self.current = Some(purpose);
    }

    /// Whether anything of a cloth moves as a whole: what no pin holds, or what pins that move hold.
    pub(crate) fn has_common_motion(model: &Model<R>, state: &State<R>) -> bool {
        model.parts.any_is_loose() || !state.motions.is_empty()
    }

    /// Evaluates what a sub-step wrote.
    pub(crate) fn evaluate_next(&mut self, model: &Model<R>, purpose: Purpose) {
        let Self { evaluation, numbers, next: State { x, v, .. }, scratches, .. } = self;
        evaluation.run_in_air(model, numbers, purpose, [x, v], scratches);
        self.current = Some(purpose);
    }

    /// Evaluates a state.
    pub(crate) fn evaluate(&mut self, model: &Model<R>, purpose: Purpose, state: &mut State<R>) {
        let Self { evaluation, numbers, scratches, .. } = self;
        let State { x, v, .. } = state;
        evaluation.run_in_air(model, numbers, purpose, [x, v], scratches);
        self.current = Some(purpose);
    }

    /// Puts the forces (N) on particles of the user in place of those that there were; those on one particle add up. Rows of
    /// other ranks are left alone.
    pub(crate) fn set_forces(&mut self, model: &Model<R>, forces: impl Iterator<Item = (u32, [f64; 3])>) {
        let External { forces: rows, force_sum, .. } = &mut self.numbers.external;
        (*force_sum, self.current) = (0.0, None);
        let mut forces = forces.peekable();
        let groups = forces.peek().map_or(0, |_| Sixteen::<R>::count_for(model.count));
        size(rows, groups);
        model.share.own().each(per_sixteen_mut(rows), |_, rows| rows.fill(Sixteen::default()));
        for (user, force) in forces {
            let (place, force) = (model.place[user as usize] as usize, vec3::<f64>(force));
            *force_sum += force.norm();
            if model.share.has(place) {
                let (group, lane) = (place / LANES, place % LANES);
                let sum = rows[group].get(lane) + force.map(R::of);
                rows[group].set(lane, sum);
            }
        }
    }

    /// Freezes the air at a state, for iterates.
    pub(crate) fn freeze_air(&mut self, model: &Model<R>, state: &mut State<R>) {
        if model.triangles.is_some() {
            model.share.exchange([&mut state.x, &mut state.v]);
            self.numbers.freeze_air(model, [&state.x, &state.v], &self.scratches);
        }
    }

    /// Evaluates accelerations of what a sub-step has written so far.
    pub(crate) fn evaluate_forces(&mut self, model: &Model<R>) {
        let Self { evaluation, numbers, next: State { x, v, .. }, scratches, .. } = self;
        evaluation.run_in_air(model, numbers, Purpose::Explicit, [x, v], scratches);
    }

    /// The same at the velocities that are predicted.
    pub(crate) fn evaluate_predicted_forces(&mut self, model: &Model<R>) {
        let Self { evaluation, numbers, next: State { x, .. }, predicted, scratches, .. } = self;
        evaluation.run_in_air(model, numbers, Purpose::Explicit, [x, predicted], scratches);
    }
}

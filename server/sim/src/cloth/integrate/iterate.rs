//! The sweeps over iterates of an implicit step: velocities u, and the positions X + h u to which they lead. X and h are
//! those of [`Scheme`](crate::cloth::settings::Scheme).

use crate::{
    cloth::{
        evaluate::{Evaluation, Leftover, Moved, MovedSums, StepNumbers, Weights},
        layout::Model,
        settings::{Integrator, Scheme, error_constant},
        state::State,
    },
    linalg::{add_lanes, lane_sums, lanes_at, packs, packs_at, store_padded},
    math::{LANES, Pack, Padded, Real, Sixteen, WithSimd, array::dot, dispatch, three},
    parallel::{Parts, per_block_mut, per_row, per_row_mut, per_sixteen, per_sixteen_mut},
};

/// Where a step starts, and the numbers of its minimisation.
#[derive(Clone, Copy)]
pub(super) struct Start<'a, R: Real> {
    model: &'a Model<R>,
    state: &'a State<R>,
    scheme: Scheme,
    numbers: &'a StepNumbers<R>,
}

/// What a block is made of: positions and velocities, those one sub-step before where these are known, masses and their
/// inverses.
type Rows<'a, R> = ([&'a [Padded<R>]; 2], Option<[&'a [Padded<R>]; 2]>, [&'a [R]; 2]);

impl<'a, R: Real> Start<'a, R> {
    pub(super) fn new(model: &'a Model<R>, state: &'a State<R>, numbers: &'a StepNumbers<R>) -> Self {
        Self { model, state, scheme: numbers.scheme, numbers }
    }

    /// What blocks are made of.
    pub(super) fn rows(&self) -> impl Parts<Part = Rows<'a, R>> {
        let (model, state) = (self.model, self.state);
        let past = (state.past.dt > 0.0).then(|| [per_row(&state.past.x), per_row(&state.past.v)]);
        let masses = [per_row(&model.m), per_row(&model.inv_m)];
        ([per_row(&state.x), per_row(&state.v)], past, masses)
    }

    /// A block, from its number and its part of the rows.
    pub(super) fn block(&self, number: usize, ([x, v], past, [m, inv_m]): Rows<'a, R>) -> Block<'a, R> {
        let first = number * (self.model.block_size / LANES);
        Block { x, v, past, m, inv_m, first, start: *self }
    }

    /// Writes the iterate at which velocities do not change. Returns the inertia of the start of the step, in the sense of
    /// [`Leftover`], and the potential of the medium there (J).
    pub(super) fn predict(&self, to: [&mut [Padded<R>]; 2], inertias: &mut [f64]) -> f64 {
        let fields = (per_block_mut(inertias), self.rows(), to.map(per_row_mut));
        self.model.share.own().each(fields, |number, (inertia, rows, [x, v])| {
            *inertia = dispatch(Predict { block: self.block(number, rows), x, v });
        });
        let [inertia] = self.model.share.sum(inertias, &|inertia| [*inertia]);
        inertia
    }

    /// Takes the change of momentum off the rows of an evaluation, which are then the residual.
    pub(super) fn leave_over(
        &self,
        evaluation: &mut Evaluation<R>,
        v: &[Padded<R>],
        change: Option<&[Sixteen<R>]>,
        leftovers: &mut [Leftover],
    ) -> Leftover {
        let of_iterate = (per_row(v), change.map(per_sixteen));
        let residual = per_sixteen_mut(&mut evaluation.rows);
        let fields = (per_block_mut(leftovers), self.rows(), of_iterate, residual);
        self.model.share.own().each(fields, |number, (leftover, start_rows, (v, change), rows)| {
            *leftover = dispatch(LeaveOver { block: self.block(number, start_rows), rows, v, change });
        });
        Leftover::of_all(&self.model.share, leftovers)
    }

    /// Writes the iterate a share of the way along a change of velocities.
    pub(super) fn go(
        &self,
        from: [&[Padded<R>]; 2],
        change: &[Sixteen<R>],
        share: f64,
        to: [&mut [Padded<R>]; 2],
    ) {
        let h = self.scheme.h;
        let fields = (from.map(per_row), per_sixteen(change), to.map(per_row_mut));
        self.model.share.own().each(fields, |_, (from, change, to)| {
            dispatch(Go { from, to, change, share, h });
        });
    }

    /// Writes where the step ends that an iterate is the solution of, and what the next one has to know of its start;
    /// returns what the error of a particle is of the length of the vector that its block added up.
    pub(super) fn finish(
        &self,
        integrator: Integrator,
        from: [&[Padded<R>]; 2],
        next: &mut State<R>,
        moved: &mut [Moved],
    ) -> f64 {
        let (dt, before) = (self.numbers.sub_step.dt, self.state.past.dt);
        if integrator.has_past() {
            next.size_past();
        }
        let State { x, v, past, .. } = next;
        let both = |fields: [_; 2]| fields.map(|field: &mut Vec<Padded<R>>| per_row_mut(field));
        let (to, past_to) = (both([x, v]), integrator.has_past().then(|| both([&mut past.x, &mut past.v])));
        let fields = (per_block_mut(moved), self.rows(), from.map(per_row), to, past_to);
        self.model.share.own().each(fields, |number, (moved, rows, from, to, past)| {
            let block = self.block(number, rows);
            if let Some([x, v]) = past {
                x.copy_from_slice(block.x);
                v.copy_from_slice(block.v);
            }
            *moved = dispatch(Finish { block, from, to, before });
        });

        if !integrator.has_past() {
            return 0.5 * dt;
        }
        next.past.dt = dt;
        if before > 0.0 { error_constant(integrator, dt, before) } else { 0.5 * dt }
    }
}

/// The rows of a block: where they are, where they were, their masses.
pub(super) struct Block<'a, R: Real> {
    x: &'a [Padded<R>],
    v: &'a [Padded<R>],
    past: Option<[&'a [Padded<R>]; 2]>,
    m: &'a [R],
    inv_m: &'a [R],
    /// Which group of sixteen it begins with.
    first: usize,
    start: Start<'a, R>,
}

impl<R: Real> Block<'_, R> {
    /// X - x_n and V of sixteen rows, their free masses and their inverses.
    #[inline(always)]
    pub(super) fn at<P: Pack<Number = R>>(&self, group: usize) -> ([[P; 3]; 2], [P; 2]) {
        let scheme = self.start.scheme;
        let [m, inv_m] = [lanes_at::<P>(self.m, group), lanes_at::<P>(self.inv_m, group)];
        let v = packs_at::<P>(self.v, group);
        let (of_pins, past) = (P::of(scheme.of_pins), P::of(scheme.past));
        let pinned = three!(|c| v[c] * of_pins - (v[c] * of_pins).where_positive(inv_m));
        let masses = [m.where_positive(inv_m), inv_m];
        let Some([past_x, past_v]) = self.past else { return ([pinned, v], masses) };

        let x = packs_at::<P>(self.x, group);
        let [past_x, past_v] = [packs_at::<P>(past_x, group), packs_at::<P>(past_v, group)];
        let way = three!(|c| ((x[c] - past_x[c]) * past).where_positive(inv_m) + pinned[c]);
        let base = three!(|c| v[c] + ((v[c] - past_v[c]) * past).where_positive(inv_m));
        ([way, base], masses)
    }
}

struct Predict<'a, R: Real> {
    block: Block<'a, R>,
    x: &'a mut [Padded<R>],
    v: &'a mut [Padded<R>],
}

impl<R: Real> WithSimd<R> for Predict<'_, R> {
    type Output = f64;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> f64 {
        let Self { block, x: to_x, v: to_v } = self;
        let Start { scheme, numbers, .. } = block.start;
        let wide = P::Wide::of;
        let of_pins = P::of(numbers.sub_step.dt / scheme.beyond);
        let (h, inverse) = (P::of(scheme.h), wide(-1.0 / scheme.h));
        let (to_x, to_v) = (to_x.as_chunks_mut::<LANES>().0, to_v.as_chunks_mut::<LANES>().0);
        let mut inertia = P::Wide::zero();
        for (group, (to_x, to_v)) in to_x.iter_mut().zip(to_v).enumerate() {
            let ([way, base], [m, inv_m]) = block.at::<P>(group);
            let [x, v] = [packs_at::<P>(block.x, group), packs_at::<P>(block.v, group)];
            store_padded(v, to_v);
            // In one rounding, so that pins end exactly where they are to be.
            let pinned = three!(|c| v[c] * of_pins - (v[c] * of_pins).where_positive(inv_m));
            let free = three!(|c| (way[c] + v[c] * h).where_positive(inv_m));
            store_padded(three!(|c| x[c] + (free[c] + pinned[c])), to_x);

            // The velocity at which X + h u is x_n.
            let still = P::widen3(way);
            let still = three!(|c| still[c] * inverse);
            let base = P::widen3(base);
            let change = three!(|c| still[c] - base[c]);
            let half = wide(0.5);
            let medium = numbers.external.at::<P>(block.first + group).widen();
            let medium = medium.potential(still, wide(scheme.h));
            inertia += half * m.widen() * dot(change, change) + medium.where_positive(inv_m.widen());
        }
        add_lanes(inertia.store())
    }
}

struct LeaveOver<'a, R: Real> {
    block: Block<'a, R>,
    rows: &'a mut [Sixteen<R>],
    v: &'a [Padded<R>],
    change: Option<&'a [Sixteen<R>]>,
}

impl<R: Real> WithSimd<R> for LeaveOver<'_, R> {
    type Output = Leftover;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Leftover {
        let [mut inertia, mut squares, mut along, mut largest] = [P::Wide::zero(); 4];
        let v = self.v.as_chunks::<LANES>().0;
        for (group, (row, u)) in self.rows.iter_mut().zip(v).enumerate() {
            let ([_, base], [m, inv_m]) = self.block.at::<P>(group);
            let (force, u) = (row.load::<P>(), packs::<P>(u));
            let change = three!(|c| u[c] - base[c]);
            let rest = three!(|c| force[c] - m * change[c]);
            row.store(rest);

            if let Some(tried) = self.change {
                let tried = P::widen3(tried[group].load::<P>());
                along += dot(P::widen3(rest), tried);
            }
            let (change, rest, inv_m) = (P::widen3(change), P::widen3(rest), inv_m.widen());
            let square = dot(rest, rest) * inv_m;
            inertia += P::Wide::of(0.5) * m.widen() * dot(change, change);
            squares += square;
            largest = largest.max(square * inv_m);
        }
        let [inertia, square, along] = lane_sums([inertia, squares, along]);
        let largest = largest.store().into_iter().fold(0.0, f64::max);
        Leftover { inertia, square, along, largest: largest.sqrt() / self.block.start.scheme.h }
    }
}

struct Go<'a, R: Real> {
    from: [&'a [Padded<R>]; 2],
    to: [&'a mut [Padded<R>]; 2],
    change: &'a [Sixteen<R>],
    share: f64,
    h: f64,
}

impl<R: Real> WithSimd<R> for Go<'_, R> {
    type Output = ();

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) {
        let (share, time) = (P::of(self.share), P::of(self.share * self.h));
        let [x, v] = self.from.map(|field| field.as_chunks::<LANES>().0);
        let [to_x, to_v] = self.to;
        let (to_x, to_v) = (to_x.as_chunks_mut::<LANES>().0, to_v.as_chunks_mut::<LANES>().0);
        for (((x, v), change), (to_x, to_v)) in
            x.iter().zip(v).zip(self.change).zip(to_x.iter_mut().zip(to_v))
        {
            let (x, v, change) = (packs::<P>(x), packs::<P>(v), change.load::<P>());
            store_padded(three!(|c| v[c] + change[c] * share), to_v);
            store_padded(three!(|c| x[c] + change[c] * time), to_x);
        }
    }
}

struct Finish<'a, R: Real> {
    block: Block<'a, R>,
    from: [&'a [Padded<R>]; 2],
    to: [&'a mut [Padded<R>]; 2],
    /// Length of the sub-step before (s).
    before: f64,
}

impl<R: Real> WithSimd<R> for Finish<'_, R> {
    type Output = Moved;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> Moved {
        let Self { block, from, to: [to_x, to_v], before } = self;
        let Start { scheme, numbers, .. } = block.start;
        let dt = numbers.sub_step.dt;
        let weights = Weights { m: block.m, inv_m: block.inv_m, numbers, first: block.first };
        let wide = P::Wide::of;
        let (of_this, of_past, of_both) = (wide(1.0 / dt), wide(-1.0 / before), wide(2.0 / (dt + before)));
        let (beyond, of_pins) = (P::of(scheme.beyond), P::of(dt));
        let [from_x, from_v] = from.map(|field| field.as_chunks::<LANES>().0);
        let (to_x, to_v) = (to_x.as_chunks_mut::<LANES>().0, to_v.as_chunks_mut::<LANES>().0);
        let mut sums = MovedSums::<P::Wide>::none();
        for (group, (to_x, to_v)) in to_x.iter_mut().zip(to_v).enumerate() {
            let ([_, base], [_, inv_m]) = block.at::<P>(group);
            let [x, v] = [packs_at::<P>(block.x, group), packs_at::<P>(block.v, group)];
            let (near, u) = (packs::<P>(&from_x[group]), packs::<P>(&from_v[group]));
            let [end, new] = if scheme.beyond == 1.0 {
                [near, u]
            } else {
                let pinned = three!(|c| v[c] * of_pins - (v[c] * of_pins).where_positive(inv_m));
                let free = three!(|c| ((near[c] - x[c]) * beyond).where_positive(inv_m));
                [three!(|c| x[c] + (free[c] + pinned[c])), three!(|c| v[c] + (u[c] - v[c]) * beyond)]
            };
            store_padded(end, to_x);
            store_padded(new, to_v);

            let own = P::widen3(three!(|c| new[c] - v[c]));
            if let Some([_, past_v]) = block.past {
                let past_v = packs_at::<P>(past_v, group);
                let last = P::widen3(three!(|c| (v[c] - past_v[c]).where_positive(inv_m)));
                sums.add_error(three!(|c| (own[c] * of_this + last[c] * of_past) * of_both));
            } else {
                sums.add_error(own);
            }
            let change = P::widen3(three!(|c| u[c] - base[c]));
            sums.add_weighed::<P>(group, &weights, [change, P::widen3(u)]);
        }
        sums.block()
    }
}

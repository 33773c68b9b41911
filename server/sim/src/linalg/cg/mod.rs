//! Preconditioned conjugate gradient: settings in, report out (Zara 2001, algorithm 1, made safe).
//!
//! Residuals are measured as sqrt(r.z), z = M⁻¹ r, beside that of b: the norm in which the method minimises, which
//! costs no sum of its own and does not depend on the unit of mass. Where it leaves the paper: p^T A p is tested in
//! every iteration against its own rounding bound, since the tangent of compressed springs can be indefinite; r.z is
//! tested too; a residual that is said to be small enough is computed from x before it is believed. Dot products are
//! binary64 over fixed blocks.

mod curvature;
mod residual;

use self::residual::{Goal, Residual};
use super::{
    coarse::{CoarseVectors, Unknowns},
    operator::{LinearOperator, Preconditioner, Room, WholePreconditioner},
    settings::{Outcome, SolveReport, SolverSettings, Stop},
    sixteens::{Turn, add_scaled, block_sums, pad, subtract_scaled},
};
use crate::{
    math::{LANES, Padded, Real, Sixteen, dispatch},
    parallel::{
        Own, Share, block_count, per_block_mut, per_row, per_row_mut, per_sixteen, per_sixteen_mut,
        several_per_block, several_per_block_mut, zeroed,
    },
};

/// Scratch vectors of a solve: allocated once, reused by every solve of the same size.
#[derive(Clone, Debug, Default)]
pub struct CgWorkspace<R: Real> {
    r: Vec<Sixteen<R>>,
    /// A p, then M⁻¹ r.
    q: Vec<Sixteen<R>>,
    /// The direction, padded for the operator.
    p: Vec<Padded<R>>,
    partials: Vec<[f64; 2]>,
    /// b.x - x.A x / 2 of the solution returned.
    descent: f64,
    /// Of the aggregates of each block, where the preconditioner has a coarse space: Pᵀ r, and the change that it calls for.
    restricted: Vec<Unknowns>,
    change: Vec<Unknowns>,
    coarse: CoarseVectors,
    /// Of a preconditioner that is applied to whole vectors.
    room: Room<R>,
}

impl<R: Real> CgWorkspace<R> {
    /// Room for `count` rows in blocks of `block_size`, a multiple of sixteen.
    pub fn new(count: usize, block_size: usize) -> Self {
        let groups = Sixteen::<R>::count_for(count);
        Self {
            r: zeroed(groups),
            p: zeroed(groups * LANES),
            q: zeroed(groups),
            partials: vec![[0.0; 2]; block_count(count, block_size)],
            descent: 0.0,
            restricted: Vec::new(),
            change: Vec::new(),
            coarse: CoarseVectors::default(),
            room: Room::default(),
        }
    }

    /// Sixteens of rows that there is room for.
    pub(crate) fn len(&self) -> usize {
        self.r.len()
    }

    /// The last direction: that in which a curvature was negative, unless it was the first.
    pub(crate) fn direction(&self) -> &[Padded<R>] {
        &self.p
    }

    /// b.x - x.A x / 2 of the last solve: how much its solution lowers what the method minimises, which is 0 at x = 0.
    pub(crate) fn descent(&self) -> f64 {
        self.descent
    }

    /// Adds what a part of the solution lowers that was taken out of the solve.
    pub(crate) fn lower(&mut self, descent: f64) {
        self.descent += descent;
    }
}

/// Solves A x = b by conjugate gradient, in the blocks of a share; from the `x` given if the settings ask for a
/// warm start, or else from 0.
///
/// `x` becomes the last iterate, however the solve ends: each lowers x^T A x / 2 - b^T x, which its residual need not
/// do. Where the very first direction has a curvature that is not positive, it is followed for r.z over the sum of the
/// magnitudes of its curvature's terms: a step of steepest descent. It ends with
///
/// - [`Outcome::Converged`] when the residual, computed from `x`, met the tolerance or the floor, or when it is as small as the
///   precision lets it become: the recursion is below a rounding of b, or a new start from `x` did not halve it;
/// - [`Outcome::IterationCap`] at the cap, or when the operator is interrupted;
/// - the other outcomes as they say. After [`Outcome::NotFinite`] `x` may hold numbers that are not finite.
///
/// Lanes of `x` and `b` beyond the last row are 0.
///
/// # Panics
/// Unless `x`, `b` and the workspace have the same length, and blocks a multiple of sixteen rows.
pub fn conjugate_gradient<R: Real>(
    a: &dyn LinearOperator<R>,
    m: &dyn Preconditioner<R>,
    b: &[Sixteen<R>],
    x: &mut [Sixteen<R>],
    settings: &SolverSettings,
    share: &Share,
    work: &mut CgWorkspace<R>,
) -> SolveReport {
    assert!(x.len() == b.len() && work.r.len() == b.len(), "one length for x, b and the workspace");
    let groups = share.block_size() / LANES;
    assert!(share.block_size().is_multiple_of(LANES), "sixteen rows lie within a block");
    let (tolerance, cap) = match settings.stop {
        Stop::Residual { tolerance, max_iterations } => (tolerance.max(R::ROUNDING), max_iterations),
        Stop::Iterations(count) => (R::ROUNDING, count),
    };
    let parts = m.coarse().map_or(1, |coarse| {
        coarse.make_room(&mut work.coarse);
        coarse.per_block()
    });
    let blocks = work.partials.len();
    work.restricted.resize(blocks * parts, Unknowns::default());
    work.change.resize(blocks * parts, Unknowns::default());
    work.descent = 0.0;
    let mut solve = Solve { a, m, b, share, groups, parts, products: 0, work };

    let start = solve.start(None);
    if start.magnitude == 0.0 {
        clear(share.own(), x);
        return SolveReport::at_once(Outcome::Converged, 0.0);
    }
    if let Some(outcome) = start.fault(0) {
        return SolveReport::at_once(outcome, f64::NAN);
    }

    let scale = start.residual();
    let first = if settings.warm_start {
        let first = solve.start(Some(x));
        solve.credit(x);
        first
    } else {
        clear(share.own(), x);
        start
    };
    let residual = (tolerance * scale).max(settings.floor);
    let goal = Goal { residual, is_rounding: tolerance <= R::ROUNDING, cap };
    let (outcome, iterations, residual) = solve.runs(first, &goal, x);
    let products = solve.products;
    SolveReport { iterations, products, residual, ..SolveReport::at_once(outcome, residual / scale) }
}

/// Operator and preconditioner are called once per block of rows, so that one copy of the solver serves all of them.
struct Solve<'a, R: Real> {
    a: &'a dyn LinearOperator<R>,
    m: &'a dyn Preconditioner<R>,
    b: &'a [Sixteen<R>],
    /// The blocks that are computed here.
    share: &'a Share,
    /// Sixteens per block.
    groups: usize,
    /// Aggregates of each block; 1 without a coarse space.
    parts: usize,
    /// Products made so far.
    products: u32,
    work: &'a mut CgWorkspace<R>,
}

impl<R: Real> Solve<'_, R> {
    /// Runs of the recursion, each from a residual that was computed from `x`, until one is believed. Returns how it
    /// ended, the iterations made, and the residual.
    fn runs(&mut self, first: Residual, goal: &Goal, x: &mut [Sixteen<R>]) -> (Outcome, u32, f64) {
        let (mut begin, mut iterations) = (first, 0);
        loop {
            let (outcome, residual) = self.run(begin, goal, &mut iterations, x);
            if outcome != Outcome::Converged || iterations == 0 {
                return (outcome, iterations, residual);
            }

            let computed = self.start(Some(x));
            if let Some(fault) = computed.fault(iterations) {
                return (fault, iterations, residual);
            }
            let found = computed.residual();
            // Where a run did not halve what is left, rounding keeps it there, and would do so again.
            let is_all = found <= goal.residual || goal.is_rounding || found > 0.5 * begin.residual();
            if is_all || iterations == goal.cap {
                return (if is_all { Outcome::Converged } else { Outcome::IterationCap }, iterations, found);
            }
            begin = computed;
        }
    }

    /// Iterates from the residual in the workspace until the recursion comes to the goal, or cannot go on.
    fn run(
        &mut self,
        begin: Residual,
        goal: &Goal,
        iterations: &mut u32,
        x: &mut [Sixteen<R>],
    ) -> (Outcome, f64) {
        let (mut now, mut last) = (begin, f64::NAN);
        // What x still lacks of the last direction, and how much of that the next one takes over.
        let mut pending: Option<[f64; 2]> = None;
        let end = loop {
            if let Some(fault) = now.fault(*iterations) {
                break fault;
            }
            last = now.residual();
            if last <= goal.residual {
                break Outcome::Converged;
            }
            if *iterations == goal.cap || self.a.is_interrupted() {
                break Outcome::IterationCap;
            }

            if let Some([alpha, beta]) = pending.take() {
                self.turn(alpha, beta, x);
            }
            let [curvature, magnitude] = self.apply_operator();
            if let Some(bad) = self.bad_curvature([curvature, magnitude], *iterations + 1) {
                let is_descent = *iterations == 0 && magnitude > 0.0 && magnitude.is_finite();
                if is_descent {
                    self.aim();
                    let alpha = now.square / magnitude;
                    self.work.descent += alpha * (now.square - 0.5 * alpha * curvature);
                    self.go(alpha, x);
                    last = self.start(Some(x)).residual();
                }
                return (bad, last);
            }

            *iterations += 1;
            let alpha = now.square / curvature;
            self.work.descent += 0.5 * alpha * now.square;
            let next = self.advance(alpha);
            pending = Some([alpha, next.square / now.square]);
            now = next;
        };
        if let Some([alpha, _]) = pending {
            self.go(alpha, x);
        }
        (end, last)
    }

    /// Counts what `x` lowers, from the residual that was computed of it: x.(b + r) / 2.
    fn credit(&mut self, x: &[Sixteen<R>]) {
        let CgWorkspace { r, partials, descent, .. } = &mut *self.work;
        let fields = (per_block_mut(partials), per_sixteen(x), per_sixteen(r), per_sixteen(self.b));
        self.share.own().each(fields, |_, (partial, x, r, b)| {
            *partial = [block_sums(x, r)[0], block_sums(x, b)[0]];
        });
        let [of_r, of_b] = self.share.sum(partials, &|partial| *partial);
        *descent += 0.5 * (of_r + of_b);
    }

    /// r = b - A x, or b; q = M⁻¹ r, p = q.
    fn start(&mut self, x: Option<&[Sixteen<R>]>) -> Residual {
        let (groups, a, b, own) = (self.groups, self.a, self.b, self.share.own());
        let CgWorkspace { r, q, p, .. } = &mut *self.work;
        match x {
            None => own.each((per_sixteen_mut(r), per_sixteen(b)), |_, (r, b)| r.copy_from_slice(b)),
            Some(x) => {
                self.products += 1;
                pad_all(own, x, p);
                self.share.exchange([p]);
                let fields = (per_sixteen_mut(r), per_sixteen(b), per_sixteen_mut(q));
                own.each(fields, |block, (r, b, q)| {
                    a.apply(block * groups * LANES, p, q);
                    r.copy_from_slice(b);
                    subtract_scaled(r, R::one(), q);
                });
            }
        }

        self.aim()
    }

    /// q = M⁻¹ r, p = q.
    fn aim(&mut self) -> Residual {
        let (groups, parts, m, own) = (self.groups, self.parts, self.m, self.share.own());
        if let Some(whole) = m.whole() {
            let residual = self.precondition(whole);
            pad_all(own, &self.work.q, &mut self.work.p);
            return residual;
        }
        let coarse = m.coarse();
        let CgWorkspace { r, q, partials, restricted, .. } = &mut *self.work;
        let sums = (per_block_mut(partials), several_per_block_mut(restricted, parts));
        own.each((per_sixteen(r), per_sixteen_mut(q), sums), |block, (r, z, (partial, restricted))| {
            m.apply(block * groups * LANES, r, z);
            *partial = block_sums(r, z);
            if let Some(coarse) = coarse {
                coarse.restrict(block, r, restricted);
            }
        });

        let residual = self.residual();
        let CgWorkspace { q, p, change, .. } = &mut *self.work;
        let fields = (per_row_mut(p), per_sixteen_mut(q), several_per_block(change, parts));
        own.each(fields, |block, (p, z, change)| {
            if let Some(coarse) = coarse {
                coarse.prolong(block, change, z);
            }
            pad(z, p);
        });
        residual
    }

    /// q = M⁻¹ r, by a preconditioner that is applied to whole vectors.
    fn precondition(&mut self, whole: &dyn WholePreconditioner<R>) -> Residual {
        let CgWorkspace { r, q, partials, room, .. } = &mut *self.work;
        self.products += whole.apply(self.a, self.share, r, q, partials, room);
        self.residual()
    }

    /// r.z from the parts of the blocks, and from the coarse space, on which it solves.
    fn residual(&mut self) -> Residual {
        let CgWorkspace { partials, restricted, change, coarse: vectors, .. } = &mut *self.work;
        let [[square, magnitude], [of_coarse, magnitudes]] = match self.m.coarse() {
            Some(coarse) => coarse.solve(partials, restricted, change, vectors),
            None => [self.share.sum(partials, &|partial| *partial), [0.0; 2]],
        };
        Residual { square: square + of_coarse, magnitude: magnitude + magnitudes }
    }

    /// q = A p; returns (p.q, sum of `|p_c q_c|`).
    fn apply_operator(&mut self) -> [f64; 2] {
        self.products += 1;
        let (groups, a) = (self.groups, self.a);
        let CgWorkspace { p, q, partials, .. } = &mut *self.work;
        self.share.exchange([p]);
        self.share.own().each((per_block_mut(partials), per_sixteen_mut(q)), |block, (partial, q)| {
            *partial = a.apply(block * groups * LANES, p, q);
        });
        self.share.sum(partials, &|partial| *partial)
    }

    /// r -= alpha q, q = M⁻¹ r but for what the coarse space adds to it.
    fn advance(&mut self, alpha: f64) -> Residual {
        let (groups, parts, m, alpha) = (self.groups, self.parts, self.m, R::of(alpha));
        let (coarse, own) = (m.coarse(), self.share.own());
        let CgWorkspace { r, q, partials, restricted, .. } = &mut *self.work;
        if let Some(whole) = m.whole() {
            own.each((per_sixteen_mut(r), per_sixteen(q)), |_, (r, q)| subtract_scaled(r, alpha, q));
            return self.precondition(whole);
        }
        let sums = (per_block_mut(partials), several_per_block_mut(restricted, parts));
        own.each((per_sixteen_mut(r), per_sixteen_mut(q), sums), |block, (r, q, (partial, restricted))| {
            *partial = m.advance(block * groups * LANES, alpha, r, q);
            if let Some(coarse) = coarse {
                coarse.restrict(block, r, restricted);
            }
        });
        self.residual()
    }

    /// x += alpha p, p = q + beta p, where q takes what the coarse space adds to it.
    fn turn(&mut self, alpha: f64, beta: f64, x: &mut [Sixteen<R>]) {
        let (parts, coarse) = (self.parts, self.m.coarse());
        let (alpha, beta) = (R::of(alpha), R::of(beta));
        let CgWorkspace { p, q, change, .. } = &mut *self.work;
        let change = several_per_block(change, parts);
        let fields = (per_sixteen_mut(x), per_sixteen_mut(q), per_row_mut(p), change);
        self.share.own().each(fields, |block, (x, z, p, change)| {
            if let Some(coarse) = coarse {
                coarse.prolong(block, change, z);
            }
            dispatch(Turn { alpha, beta, x, z, p });
        });
    }

    /// x += alpha p.
    fn go(&self, alpha: f64, x: &mut [Sixteen<R>]) {
        let alpha = R::of(alpha);
        let fields = (per_sixteen_mut(x), per_row(&self.work.p));
        self.share.own().each(fields, |_, (x, p)| add_scaled(x, alpha, p));
    }
}

/// x = 0.
fn clear<R: Real>(own: Own, x: &mut [Sixteen<R>]) {
    own.each(per_sixteen_mut(x), |_, x| x.fill(Sixteen::default()));
}

/// Copies sixteens into padded vectors.
fn pad_all<R: Real>(own: Own, from: &[Sixteen<R>], to: &mut [Padded<R>]) {
    own.each((per_sixteen(from), per_row_mut(to)), |_, (from, to)| pad(from, to));
}

#[cfg(test)]
mod tests;

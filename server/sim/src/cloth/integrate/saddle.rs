//! The way out of a saddle: a direction in which what is minimised curves down, although nothing is left over.
//!
//! Conjugate gradient on the exact tangent meets such a direction within a few iterations, where there is one and its
//! right-hand side is not at right angles to it: velocities at random are not.

use super::{
    at::At,
    mix::Mix,
    newton::{Iterate, Search, Tried},
    update::Step,
};
use crate::{
    cloth::{
        layout::{Elements, Model},
        settings::ClothSettings,
    },
    linalg::{Outcome, SolveReport, SolverSettings, Stop, packs_at},
    math::{LANES, Pack, Padded, Real, Sixteen, Vec3, WithSimd, array::dot, dispatch, three},
    parallel::{hash_numbers, per_block_mut, per_row, per_sixteen_mut},
    report::StepFailure,
};

/// Relative residual at which there is no such direction, at most: solves of iterates may end before.
const TOLERANCE: f64 = 1e-4;
/// How far the first try displaces a particle at most, in rest lengths of a spring.
const DISPLACEMENT: f64 = 0.1;
/// How often that is halved, at most.
const HALVINGS: u32 = 16;

impl<R: Real> Search<'_, '_, R> {
    /// Goes to where what is minimised is lower than at the iterate in `next`, a balance; none where that is a minimum.
    pub(super) fn leave_saddle(&mut self, now: &Iterate) -> Result<Option<Iterate>, StepFailure> {
        // The exact tangent need not be positive definite: iterates that were evaluated with it are evaluated again.
        let mirror = self.step.evaluated.numbers.mirror;
        if mirror > R::zero() {
            self.step.evaluated.numbers.mirror = R::zero() - R::one();
            self.evaluate(Tried::Next);
        }
        self.scatter();
        let settings = self.to_the_end();
        let (report, _) = self.step.solve_mixed(At::Balance, [Mix::EXACT; 2], &settings, self.interrupt);
        self.step.evaluated.numbers.mirror = mirror;
        if self.interrupt.is_requested() {
            return Err(StepFailure::Interrupted);
        }
        let spent = self.report.unwrap_or(SolveReport::at_once(Outcome::Converged, 0.0));
        self.report = Some(spent.beside(report));
        let Outcome::NegativeCurvature { iteration } = report.outcome else { return Ok(None) };

        let mut share = DISPLACEMENT * self.rest_length() / self.follow(iteration);
        for _ in 0..HALVINGS {
            for sign in [1.0, -1.0] {
                self.go(sign * share);
                let new = self.evaluate(Tried::Trial);
                if new.value_on_the_way() < now.value() - self.slack(now) {
                    self.take();
                    return Ok(Some(new));
                }
            }
            share *= 0.5;
        }
        self.evaluate(Tried::Next);
        Ok(None)
    }

    /// The settings with a residual that is small enough to tell.
    fn to_the_end(&self) -> ClothSettings {
        let solver = self.settings.solver;
        let stop = match solver.stop {
            Stop::Residual { tolerance, max_iterations } => {
                Stop::Residual { tolerance: tolerance.min(TOLERANCE), max_iterations }
            }
            Stop::Iterations(count) => Stop::Iterations(count),
        };
        ClothSettings { solver: SolverSettings { stop, ..solver }, ..*self.settings }
    }

    /// Writes momenta at random into the right-hand side: the same for the same particles of the user.
    fn scatter(&mut self) {
        let model = self.step.model;
        let size = model.block_size / LANES;
        let rows = per_sixteen_mut(&mut self.step.evaluated.evaluation.rows);
        model.share.own().each(rows, |block, rows| {
            for (group, row) in rows.iter_mut().enumerate() {
                for lane in 0..LANES {
                    let place = (block * size + group) * LANES + lane;
                    let is_free = model.inv_m.get(place).is_some_and(|inv_m| *inv_m > R::zero());
                    let momentum = if is_free {
                        let bits = hash_numbers(u64::from(model.user[place]), [0.0]);
                        let part = |shift: u32| f64::from((bits >> shift) as u16) / 65_536.0 - 0.5;
                        Vec3::new(part(0), part(16), part(32)).map(|c| R::of(c) * model.m[place])
                    } else {
                        Vec3::zeros()
                    };
                    row.set(lane, momentum);
                }
            }
        });
    }

    /// Puts the direction in which the solve met the curvature where changes of velocity are; returns how far the fastest
    /// particle goes by it in the step (m).
    fn follow(&mut self, iteration: u32) -> f64 {
        let Step { model, next, evaluated, solver, vectors, .. } = &mut *self.step;
        let (share, squares) = (&model.share, &mut vectors.squares);
        // Where it was the first direction, the solve has gone along it.
        let direction = (iteration > 1).then(|| per_row(solver.cg.direction()));
        let fields = (per_block_mut(squares), per_sixteen_mut(&mut next.dv), direction);
        share.own().each(fields, |_, (square, dv, from)| *square = dispatch(Follow { dv, from }));
        let here = share.own().blocks(squares).iter().copied().fold(0.0, f64::max);
        let mut greatest = 0.0;
        share.tell([here], |[of_rank]| greatest = f64::max(greatest, of_rank));
        evaluated.numbers.scheme.h * greatest.sqrt()
    }

    /// The mean rest length of the springs (m); without any about that of the sides of elements.
    fn rest_length(&self) -> f64 {
        let Model { springs, elements, .. } = self.step.model;
        let lengths = springs.rest_lengths.as_flattened().iter().map(|length| length.to_f64());
        let [sum, count] = lengths
            .filter(|length| *length > 0.0)
            .fold([0.0, 0.0], |[sum, count], length| [sum + length, count + 1.0]);
        if count > 0.0 {
            return sum / count;
        }
        let sizes = elements.iter().map(Elements::sizes);
        let [sum, count] =
            sizes.fold([0.0, 0.0], |[sum, count], [size, number]| [sum + size, count + number]);
        sum / f64::max(count, 1.0)
    }
}

/// Returns the greatest square of a change of velocity (m²/s²).
struct Follow<'a, R: Real> {
    dv: &'a mut [Sixteen<R>],
    from: Option<&'a [Padded<R>]>,
}

impl<R: Real> WithSimd<R> for Follow<'_, R> {
    type Output = f64;

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> f64 {
        let mut largest = P::Wide::zero();
        for (group, dv) in self.dv.iter_mut().enumerate() {
            let v = match self.from {
                Some(p) => packs_at::<P>(p, group),
                None => dv.load::<P>(),
            };
            dv.store(three!(|c| v[c]));
            let wide = P::widen3(v);
            largest = largest.max(dot(wide, wide));
        }
        largest.store().into_iter().fold(0.0, f64::max)
    }
}

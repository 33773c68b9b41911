//! Preconditioned conjugate gradient: settings in, report out (Zara 2001, algorithm 1, made safe).
//!
//! Residuals are measured as sqrt(r.z), z = M⁻¹ r, beside that of b: the norm in which the method minimises, which
//! costs no sum of its own and does not depend on the unit of mass. Where it leaves the paper: p^T A p is tested in
//! every iteration against its own rounding bound, since the tangent of compressed springs can be indefinite; r.z is
//! tested too; a residual that is said to be small enough is computed from x before it is believed. Dot products are
//! binary64 over fixed blocks.

use rayon::prelude::*;

use super::{
    dot::{block_sums, combine},
    operator::{LinearOperator, Preconditioner, pad},
    settings::{Outcome, SolveReport, SolverSettings, Stop},
};
use crate::{
    math::{Padded, Real, Vec3},
    parallel::{block_count, sum},
};

/// Scratch vectors of a solve: allocated once, reused by every solve of the same size.
#[derive(Clone, Debug, Default)]
pub struct CgWorkspace<R: Real> {
    r: Vec<Vec3<R>>,
    z: Vec<Vec3<R>>,
    p: Vec<Vec3<R>>,
    /// p again, padded for the operator.
    padded: Vec<Padded<R>>,
    q: Vec<Vec3<R>>,
    partials: Vec<[f64; 2]>,
}

impl<R: Real> CgWorkspace<R> {
    /// Room for `count` rows in blocks of `block_size`.
    pub fn new(count: usize, block_size: usize) -> Self {
        let zeros = vec![Vec3::zeros(); count];
        Self {
            r: zeros.clone(),
            z: zeros.clone(),
            p: zeros.clone(),
            padded: vec![Padded::default(); count],
            q: zeros,
            partials: vec![[0.0; 2]; block_count(count, block_size)],
        }
    }
}

/// Solves A x = b by conjugate gradient, in blocks of `block_size` rows; from the `x` given if the settings ask for a
/// warm start, or else from 0.
///
/// `x` becomes the last iterate, however the solve ends: each lowers x^T A x / 2 - b^T x, which its residual need not
/// do. Where the very first direction has a curvature that is not positive, it is followed for r.z over the sum of the
/// magnitudes of its curvature's terms: a step of steepest descent. It ends with
///
/// - [`Outcome::Converged`] when the residual, computed from `x`, met the tolerance, or when it is as small as the
///   precision lets it become: the recursion is below a rounding of b, or a new start from `x` did not halve it;
/// - [`Outcome::IterationCap`] at the cap, or when the operator is interrupted;
/// - the other outcomes as they say. After [`Outcome::NotFinite`] `x` may hold numbers that are not finite.
///
/// # Panics
/// Unless `x`, `b` and the workspace have the same length.
pub fn conjugate_gradient<R: Real>(
    a: &dyn LinearOperator<R>,
    m: &dyn Preconditioner<R>,
    b: &[Vec3<R>],
    x: &mut [Vec3<R>],
    settings: &SolverSettings,
    block_size: usize,
    work: &mut CgWorkspace<R>,
) -> SolveReport {
    assert!(x.len() == b.len() && work.r.len() == b.len(), "one length for x, b and the workspace");
    let (tolerance, cap) = match settings.stop {
        Stop::Residual { tolerance, max_iterations } => (tolerance.max(R::ROUNDING), max_iterations),
        Stop::Iterations(count) => (R::ROUNDING, count),
    };
    let mut solve = Solve { a, m, b, block_size, work };

    let start = solve.start(None);
    let end = |outcome, relative_residual| SolveReport { outcome, iterations: 0, relative_residual };
    if start.magnitude == 0.0 {
        x.fill(Vec3::zeros());
        return end(Outcome::Converged, 0.0);
    }
    if let Some(outcome) = start.fault(0) {
        return end(outcome, f64::NAN);
    }

    let scale = start.residual();
    let first = if settings.warm_start {
        solve.start(Some(x))
    } else {
        x.fill(Vec3::zeros());
        start
    };
    let goal = Goal { residual: tolerance * scale, is_rounding: tolerance <= R::ROUNDING, cap };
    let (outcome, iterations, residual) = solve.runs(first, &goal, x);
    SolveReport { outcome, iterations, relative_residual: residual / scale }
}

/// What a solve is to come to.
struct Goal {
    residual: f64,
    /// Whether no smaller residual can be told from 0 in this precision.
    is_rounding: bool,
    /// Iterations that it may make.
    cap: u32,
}

/// r.z of an iterate, and the sum of the magnitudes of its terms.
#[derive(Clone, Copy)]
struct Residual {
    square: f64,
    magnitude: f64,
}

impl Residual {
    fn residual(self) -> f64 {
        self.square.sqrt()
    }

    /// What is wrong with it after so many iterations, if it is not 0.
    fn fault(self, iteration: u32) -> Option<Outcome> {
        if !self.square.is_finite() {
            return Some(Outcome::NotFinite { iteration });
        }
        (self.square <= 0.0 && self.magnitude > 0.0)
            .then_some(Outcome::IndefinitePreconditioner { iteration })
    }
}

/// Operator and preconditioner are called once per block of rows, so that one copy of the solver serves all of them.
struct Solve<'a, R: Real> {
    a: &'a dyn LinearOperator<R>,
    m: &'a dyn Preconditioner<R>,
    b: &'a [Vec3<R>],
    block_size: usize,
    work: &'a mut CgWorkspace<R>,
}

impl<R: Real> Solve<'_, R> {
    /// Runs of the recursion, each from a residual that was computed from `x`, until one is believed. Returns how it
    /// ended, the iterations made, and the residual.
    fn runs(&mut self, first: Residual, goal: &Goal, x: &mut [Vec3<R>]) -> (Outcome, u32, f64) {
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
        x: &mut [Vec3<R>],
    ) -> (Outcome, f64) {
        let (mut now, mut last) = (begin, f64::NAN);
        loop {
            if let Some(fault) = now.fault(*iterations) {
                return (fault, last);
            }
            last = now.residual();
            if last <= goal.residual {
                return (Outcome::Converged, last);
            }
            if *iterations == goal.cap || self.a.is_interrupted() {
                return (Outcome::IterationCap, last);
            }

            let [curvature, magnitude] = self.apply_operator();
            if let Some(bad) = self.bad_curvature([curvature, magnitude], *iterations + 1) {
                let is_descent = *iterations == 0 && magnitude > 0.0 && magnitude.is_finite();
                if is_descent {
                    self.descend(now.square / magnitude, x);
                    last = self.start(Some(x)).residual();
                }
                return (bad, last);
            }

            *iterations += 1;
            let next = self.advance(now.square / curvature, x);
            self.turn(next.square / now.square);
            now = next;
        }
    }

    /// r = b - A x, or b; z = M⁻¹ r, p = z.
    fn start(&mut self, x: Option<&[Vec3<R>]>) -> Residual {
        let (block_size, a, m, b) = (self.block_size, self.a, self.m, self.b);
        let CgWorkspace { r, z, p, padded, partials, .. } = &mut *self.work;
        if let Some(x) = x {
            pad(x, block_size, padded);
        }

        let at = padded.as_slice();
        let blocks = (
            partials.par_iter_mut(),
            b.par_chunks(block_size),
            r.par_chunks_mut(block_size),
            z.par_chunks_mut(block_size),
        );
        blocks.into_par_iter().zip(p.par_chunks_mut(block_size)).enumerate().for_each(
            |(block, ((partial, b, r, z), p))| {
                if x.is_none() {
                    r.copy_from_slice(b);
                } else {
                    a.apply(block * block_size, at, r);
                    r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
                }

                m.apply(block * block_size, r, z);
                p.copy_from_slice(z);
                *partial = block_sums(r, z);
            },
        );

        let [square, magnitude] = sum(partials);
        pad(p, block_size, padded);
        Residual { square, magnitude }
    }

    /// q = A p; returns (p.q, sum of `|p_c q_c|`).
    fn apply_operator(&mut self) -> [f64; 2] {
        let (block_size, a) = (self.block_size, self.a);
        let CgWorkspace { p, padded, q, partials, .. } = &mut *self.work;
        (partials.par_iter_mut(), q.par_chunks_mut(block_size), p.par_chunks(block_size))
            .into_par_iter()
            .enumerate()
            .for_each(|(block, (partial, q, mine))| {
                a.apply(block * block_size, padded, q);
                *partial = block_sums(mine, q);
            });
        sum(partials)
    }

    /// x += alpha p, r -= alpha q, z = M⁻¹ r.
    fn advance(&mut self, alpha: f64, x: &mut [Vec3<R>]) -> Residual {
        let (block_size, m, alpha) = (self.block_size, self.m, R::of(alpha));
        let CgWorkspace { r, z, p, q, partials, .. } = &mut *self.work;
        let vectors =
            (x.par_chunks_mut(block_size), r.par_chunks_mut(block_size), z.par_chunks_mut(block_size));
        let inputs = (partials.par_iter_mut(), p.par_chunks(block_size), q.par_chunks(block_size));
        vectors.into_par_iter().zip(inputs.into_par_iter()).enumerate().for_each(
            |(block, ((x, r, z), (partial, p, q)))| {
                combine(x, R::one(), p, alpha);
                combine(r, R::one(), q, -alpha);
                m.apply(block * block_size, r, z);
                *partial = block_sums(r, z);
            },
        );
        let [square, magnitude] = sum(partials);
        Residual { square, magnitude }
    }

    /// p = z + beta p.
    fn turn(&mut self, beta: f64) {
        let (block_size, beta) = (self.block_size, R::of(beta));
        let CgWorkspace { z, p, padded, .. } = &mut *self.work;
        (p.par_chunks_mut(block_size), padded.par_chunks_mut(block_size), z.par_chunks(block_size))
            .into_par_iter()
            .for_each(|(p, padded, z)| {
                combine(p, beta, z, R::one());
                padded.iter_mut().zip(&*p).for_each(|(padded, p)| *padded = Padded::new(p));
            });
    }

    /// x += alpha z.
    fn descend(&self, alpha: f64, x: &mut [Vec3<R>]) {
        let (block_size, alpha) = (self.block_size, R::of(alpha));
        (x.par_chunks_mut(block_size), self.work.z.par_chunks(block_size))
            .into_par_iter()
            .for_each(|(x, z)| combine(x, R::one(), z, alpha));
    }

    /// Names a curvature that is not above its rounding bound.
    fn bad_curvature(&mut self, [curvature, magnitude]: [f64; 2], iteration: u32) -> Option<Outcome> {
        // A row adds a few dozen products, each with a relative error of a few roundings.
        let bound = 8.0 * R::ROUNDING * magnitude;
        if !curvature.is_finite() {
            return Some(Outcome::NotFinite { iteration });
        }
        if curvature > bound {
            return None;
        }
        if curvature < -bound {
            return Some(Outcome::NegativeCurvature { iteration });
        }

        // A p = 0 is judged against the size of A, for which |A b| / |b| stands.
        let [p_norm, q_norm] = [self.norm_of(|work| &work.p), self.norm_of(|work| &work.q)];

        self.work.p.copy_from_slice(self.b);
        pad(&self.work.p, self.block_size, &mut self.work.padded);
        self.apply_operator();
        let size = self.norm_of(|work| &work.q) / self.norm_of(|work| &work.p);

        let vanishes = q_norm <= 64.0 * R::ROUNDING * size * p_norm;
        Some(if vanishes { Outcome::Singular { iteration } } else { Outcome::ZeroCurvature { iteration } })
    }

    fn norm_of(&mut self, vector: impl Fn(&CgWorkspace<R>) -> &Vec<Vec3<R>>) -> f64 {
        let partials = vector(self.work).chunks(self.block_size).map(|v| block_sums(v, v)[0]);
        partials.sum::<f64>().sqrt()
    }
}

#[cfg(test)]
mod tests {
    use std::sync::atomic::{AtomicU32, Ordering};

    use super::{CgWorkspace, conjugate_gradient};
    use crate::{
        linalg::{BlockCsr, Identity, LinearOperator, Outcome, SolverSettings},
        math::{Padded, Vec3},
    };

    #[test]
    fn numbers_that_leave_the_range_are_named_and_not_returned_as_a_solution() {
        let huge: Vec<Vec<f64>> =
            (0..3).map(|i| (0..3).map(|j| if i == j { 1e300 } else { 0.0 }).collect()).collect();
        let a = BlockCsr::<f64>::from_dense(&huge);
        for (b, iteration) in [(1e200, 0), (1e10, 1)] {
            let mut x = [Vec3::zeros()];
            let mut work = CgWorkspace::new(1, 32);
            let b = [Vec3::new(b, 0.0, 0.0)];
            let report =
                conjugate_gradient(&a, &Identity, &b, &mut x, &SolverSettings::default(), 32, &mut work);
            assert_eq!(report.outcome, Outcome::NotFinite { iteration });
            assert_eq!(x, [Vec3::zeros()]);
        }
    }

    /// The second difference, which is given up after a number of products.
    struct Chain {
        products: AtomicU32,
        allowed: u32,
    }

    impl LinearOperator<f64> for Chain {
        fn apply(&self, first_row: usize, p: &[Padded<f64>], out: &mut [Vec3<f64>]) {
            self.products.fetch_add(1, Ordering::Relaxed);
            let x = |i: usize| p.get(i).map_or(Vec3::zeros(), Padded::vector);
            for (i, out) in (first_row..).zip(out) {
                *out = x(i) * 2.0 - x(i.wrapping_sub(1)) - x(i + 1);
            }
        }

        fn is_interrupted(&self) -> bool {
            self.products.load(Ordering::Relaxed) >= self.allowed
        }
    }

    #[test]
    fn a_solve_that_is_interrupted_makes_no_further_iteration() {
        let b = vec![Vec3::new(1.0, 0.0, 0.0); 100];
        for allowed in [0, 1, 7] {
            let a = Chain { products: AtomicU32::new(0), allowed };
            let (mut x, mut work) = (vec![Vec3::zeros(); 100], CgWorkspace::new(100, 100));
            let settings = SolverSettings::default();
            let report = conjugate_gradient(&a, &Identity, &b, &mut x, &settings, 100, &mut work);
            assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, allowed));
        }
    }
}

//! Preconditioned conjugate gradient: settings in, report out (Zara 2001, algorithm 1, made safe).
//!
//! Where it leaves the paper: the residual is relative to b; p^T A p is tested in every iteration
//! against its own rounding bound, since the tangent of compressed springs can be indefinite; the
//! best iterate is returned when it does not converge. Dot products are binary64 over fixed blocks.

use rayon::prelude::*;

use super::{
    dot::{block_sums, combine},
    operator::{LinearOperator, Preconditioner},
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
    best: Vec<Vec3<R>>,
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
            q: zeros.clone(),
            best: zeros,
            partials: vec![[0.0; 2]; block_count(count, block_size)],
        }
    }
}

/// Solves A x = b by conjugate gradient from the `x` given; in blocks of `block_size` rows.
///
/// `x` becomes the solution, or the iterate with the smallest residual when the solve stops at the
/// cap, because the operator is interrupted or at a curvature that is not positive. With [`Stop::Iterations`] it becomes the last
/// iterate, which minimises the error in the A-norm.
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
        Stop::Residual { tolerance, max_iterations } => (tolerance, max_iterations),
        Stop::Iterations(count) => (0.0, count),
    };

    let mut solve = Solve { a, m, block_size, work };

    let b_norm = solve.dot_with(b, b)[0].sqrt();
    if b_norm == 0.0 {
        x.fill(Vec3::zeros());
        return SolveReport { outcome: Outcome::Converged, iterations: 0, relative_residual: 0.0 };
    }
    if !b_norm.is_finite() {
        let outcome = Outcome::NotFinite { iteration: 0 };
        return SolveReport { outcome, iterations: 0, relative_residual: f64::NAN };
    }

    let [mut rho, mut rr] = solve.start(b, x);
    // The iterate with the smallest residual: `x` itself, until the residual grows.
    let (mut best, mut best_is_x) = (rr, true);
    let mut iterations = 0;
    let outcome = loop {
        if !rr.is_finite() {
            break Outcome::NotFinite { iteration: iterations };
        }
        if rr.sqrt() <= tolerance * b_norm || rr == 0.0 {
            break Outcome::Converged;
        }
        if iterations == cap || solve.a.is_interrupted() {
            break Outcome::IterationCap;
        }

        let [curvature, magnitude] = solve.apply_operator();
        if let Some(bad) = solve.bad_curvature([curvature, magnitude], b, iterations + 1) {
            break bad;
        }

        iterations += 1;
        let alpha = rho / curvature;
        let [rho_next, rr_next] = solve.advance(alpha, x);

        if rr_next < best {
            (best, best_is_x) = (rr_next, true);
        } else if best_is_x {
            solve.keep_previous(alpha, x);
            best_is_x = false;
        }

        solve.turn(rho_next / rho);
        (rho, rr) = (rho_next, rr_next);
    };

    let fixed = matches!((settings.stop, outcome), (Stop::Iterations(_), Outcome::IterationCap));
    if !best_is_x && !fixed && outcome != Outcome::Converged {
        x.copy_from_slice(&solve.work.best);
        rr = best;
    }
    SolveReport { outcome, iterations, relative_residual: rr.sqrt() / b_norm }
}

/// Operator and preconditioner are called once per block of rows, so that one copy of the solver serves all of them.
struct Solve<'a, R: Real> {
    a: &'a dyn LinearOperator<R>,
    m: &'a dyn Preconditioner<R>,
    block_size: usize,
    work: &'a mut CgWorkspace<R>,
}

impl<R: Real> Solve<'_, R> {
    /// a.b and the sum of magnitudes.
    fn dot_with(&mut self, a: &[Vec3<R>], b: &[Vec3<R>]) -> [f64; 2] {
        let block_size = self.block_size;
        (self.work.partials.par_iter_mut(), a.par_chunks(block_size), b.par_chunks(block_size))
            .into_par_iter()
            .for_each(|(partial, a, b)| *partial = block_sums(a, b));
        sum(&self.work.partials)
    }

    /// r = b - A x, z = M⁻¹ r, p = z; returns (r.z, r.r).
    fn start(&mut self, b: &[Vec3<R>], x: &[Vec3<R>]) -> [f64; 2] {
        let (block_size, a, m) = (self.block_size, self.a, self.m);
        let from_zero = x.iter().all(|x| *x == Vec3::zeros());
        let CgWorkspace { r, z, p, padded, partials, .. } = &mut *self.work;
        if !from_zero {
            padded.iter_mut().zip(x).for_each(|(padded, x)| *padded = Padded::new(x));
        }

        let x = padded.as_slice();
        let blocks = (
            partials.par_iter_mut(),
            b.par_chunks(block_size),
            r.par_chunks_mut(block_size),
            z.par_chunks_mut(block_size),
        );
        blocks.into_par_iter().zip(p.par_chunks_mut(block_size)).enumerate().for_each(
            |(block, ((partial, b, r, z), p))| {
                if from_zero {
                    r.copy_from_slice(b);
                } else {
                    a.apply(block * block_size, x, r);
                    r.iter_mut().zip(b).for_each(|(r, b)| *r = b - *r);
                }

                m.apply(block * block_size, r, z);
                p.copy_from_slice(z);
                *partial = [block_sums(r, z)[0], block_sums(r, r)[0]];
            },
        );

        let sums = sum(partials);
        self.pad_p();
        sums
    }

    fn pad_p(&mut self) {
        let (block_size, CgWorkspace { p, padded, .. }) = (self.block_size, &mut *self.work);
        (padded.par_chunks_mut(block_size), p.par_chunks(block_size)).into_par_iter().for_each(
            |(padded, p)| {
                padded.iter_mut().zip(p).for_each(|(padded, p)| *padded = Padded::new(p));
            },
        );
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

    /// x += alpha p, r -= alpha q, z = M⁻¹ r; returns (r.z, r.r).
    fn advance(&mut self, alpha: f64, x: &mut [Vec3<R>]) -> [f64; 2] {
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
                *partial = [block_sums(r, z)[0], block_sums(r, r)[0]];
            },
        );
        sum(partials)
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

    /// best = x - alpha p: the iterate before the one in `x`.
    fn keep_previous(&mut self, alpha: f64, x: &[Vec3<R>]) {
        let (block_size, alpha) = (self.block_size, R::of(alpha));
        let CgWorkspace { p, best, .. } = &mut *self.work;
        (best.par_chunks_mut(block_size), x.par_chunks(block_size), p.par_chunks(block_size))
            .into_par_iter()
            .for_each(|(best, x, p)| {
                best.iter_mut().zip(x.iter().zip(p)).for_each(|(best, (x, p))| *best = x - p * alpha);
            });
    }

    /// Names a curvature that is not above its rounding bound.
    fn bad_curvature(
        &mut self,
        [curvature, magnitude]: [f64; 2],
        b: &[Vec3<R>],
        iteration: u32,
    ) -> Option<Outcome> {
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

        self.work.p.copy_from_slice(b);
        self.pad_p();
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

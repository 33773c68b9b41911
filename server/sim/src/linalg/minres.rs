//! Minimal residuals with a diagonal mass as preconditioner: settings in, report out (Paige and
//! Saunders 1975, with the preconditioner of Choi 2006).
//!
//! For symmetric matrices, indefinite ones included: `|b - A x|` falls in every iteration, whatever
//! the signs of the eigenvalues. Norms are those of `M⁻¹`, so that a system `(M + dt² H) v = M v*`
//! is solved as `(1 + dt² M⁻¹ H) v = v*` would be if that matrix were symmetric. Where it leaves the
//! papers: the residual that decides is recomputed from x, and the solve starts again from there
//! when rounding has taken the recursive one away from it; no iterate that is not finite, or worse
//! than the one before, is returned. Dot products are binary64 over fixed blocks.

use super::{
    dot::{block_sums, combine},
    operator::WholeOperator,
    settings::{Outcome, SolveReport, Stop},
};
use crate::{
    math::{Real, Vec3},
    parallel::{Own, block_count, per_block_mut, per_row, per_row_mut, sum},
};

/// Rows per block: work of a few microseconds, which threads share well.
const BLOCK_SIZE: usize = 1024;

/// Scratch vectors of a solve: they grow to the largest system solved, and are then reused.
#[derive(Clone, Debug, Default)]
pub struct MinresWorkspace<R: Real> {
    /// The Lanczos vector v, and A v.
    v: Vec<Vec3<R>>,
    q: Vec<Vec3<R>>,
    /// Residual-like vectors: M v times a length, of the iteration before and of this one.
    before: Vec<Vec3<R>>,
    r: Vec<Vec3<R>>,
    /// M⁻¹ r, with 0 in rows without mass.
    z: Vec<Vec3<R>>,
    /// Directions of x, of the iteration before and of this one.
    w_before: Vec<Vec3<R>>,
    w: Vec<Vec3<R>>,
    /// The iterate with the smallest residual that was recomputed.
    best: Vec<Vec3<R>>,
    partials: Vec<[f64; 1]>,
}

impl<R: Real> MinresWorkspace<R> {
    /// Room for systems of up to `count` rows, so that solving them allocates nothing.
    pub(crate) fn reserve(&mut self, count: usize) {
        let Self { v, q, before, r, z, w_before, w, best, partials } = self;
        for vector in [v, q, before, r, z, w_before, w, best] {
            vector.reserve(count.saturating_sub(vector.len()));
        }

        partials.reserve(block_count(count, BLOCK_SIZE).saturating_sub(partials.len()));
    }

    fn resize(&mut self, count: usize) {
        let Self { v, q, before, r, z, w_before, w, best, partials } = self;
        for vector in [v, q, before, r, z, w_before, w, best] {
            vector.resize(count, Vec3::zeros());
        }

        partials.resize(block_count(count, BLOCK_SIZE), [0.0]);
    }
}

/// Solves A x = b for a symmetric A by minimal residuals from the `x` given, in the norm
/// `|r|² = Σ r·r / m`.
///
/// `mass` has one entry per row, 0 or more. A row without mass is left out of the system, and x
/// becomes 0 there.
///
/// A solve costs one product with A per iteration, and one or two more for residuals. `x` becomes the
/// last iterate, which has the smallest residual; the report's residual is that of this x, recomputed.
/// It ends with
///
/// - [`Outcome::Converged`] when it met the tolerance,
/// - [`Outcome::IterationCap`] when it did not, after the iterations of [`Stop::Iterations`], or
///   before the cap when rounding keeps the residual from falling further or the operator is interrupted,
/// - [`Outcome::Singular`] when A r vanishes while r does not: x solves the system in the sense of
///   least squares only,
/// - [`Outcome::NotFinite`] when a number left the range of its precision: in b or the `x` given
///   (iteration 0; x is left as it was), or later; x is the last finite iterate.
///
/// # Panics
/// Unless `mass`, `b` and `x` have the same length.
pub fn minres<R: Real, A: WholeOperator<R>>(
    a: &mut A,
    mass: &[R],
    b: &[Vec3<R>],
    x: &mut [Vec3<R>],
    stop: Stop,
    work: &mut MinresWorkspace<R>,
) -> SolveReport {
    assert!(x.len() == b.len() && mass.len() == b.len(), "one length for mass, b and x");
    work.resize(b.len());
    let (tolerance, cap) = match stop {
        Stop::Residual { tolerance, max_iterations } => (tolerance, max_iterations),
        Stop::Iterations(count) => (0.0, count),
    };

    let mut solve = Solve { a, mass, products: 0, work };
    let scale = solve.norm_of(b);
    if scale == 0.0 {
        x.fill(Vec3::zeros());
        return SolveReport::at_once(Outcome::Converged, 0.0);
    }
    let mut residual = if scale.is_finite() { solve.start(b, x) } else { f64::NAN };
    if !residual.is_finite() {
        return SolveReport::at_once(Outcome::NotFinite { iteration: 0 }, f64::NAN);
    }
    solve.leave_out(x);

    let goal = tolerance * scale;
    let mut iterations = 0;
    let outcome = loop {
        if residual <= goal {
            break Outcome::Converged;
        }
        if iterations == cap || solve.a.is_interrupted() {
            break Outcome::IterationCap;
        }

        solve.work.best.copy_from_slice(x);
        let run = solve.run(x, residual, goal, cap - iterations);
        iterations += run.iterations;

        let recomputed = solve.start(b, x);

        // A residual that is not a number has not fallen.
        let fell = recomputed < residual;
        if fell {
            residual = recomputed;
        } else {
            x.copy_from_slice(&solve.work.best);
        }

        match run.end {
            End::NotFinite => break Outcome::NotFinite { iteration: iterations + 1 },
            _ if !recomputed.is_finite() => break Outcome::NotFinite { iteration: iterations },
            End::Singular if residual > goal => break Outcome::Singular { iteration: iterations + 1 },
            // Another run from the same x would end in the same way.
            _ if !fell => break Outcome::IterationCap,
            End::Singular | End::Goal => {}
        }
    };
    let products = solve.products;
    SolveReport { iterations, products, residual, ..SolveReport::at_once(outcome, residual / scale) }
}

/// How a run of iterations ended.
#[derive(Clone, Copy, Debug)]
enum End {
    /// At its goal, as far as the recursion knows, at its cap, or interrupted.
    Goal,
    /// A r vanishes: no step makes the residual smaller.
    Singular,
    /// A number left the range of its precision.
    NotFinite,
}

struct Run {
    end: End,
    /// Iterations that changed x.
    iterations: u32,
}

struct Solve<'a, R: Real, A> {
    a: &'a mut A,
    mass: &'a [R],
    /// Products made so far.
    products: u32,
    work: &'a mut MinresWorkspace<R>,
}

impl<R: Real, A: WholeOperator<R>> Solve<'_, R, A> {
    /// Norm of a vector; z becomes M⁻¹ times it.
    fn norm_of(&mut self, b: &[Vec3<R>]) -> f64 {
        self.work.r.copy_from_slice(b);
        self.divide_by_mass()
    }

    /// x = 0 in rows without mass.
    fn leave_out(&self, x: &mut [Vec3<R>]) {
        for (x, _) in x.iter_mut().zip(self.mass).filter(|(_, m)| **m <= R::zero()) {
            *x = Vec3::zeros();
        }
    }

    /// r = b - A x, z = M⁻¹ r; returns |r|. Rows without mass see x = 0.
    fn start(&mut self, b: &[Vec3<R>], x: &[Vec3<R>]) -> f64 {
        self.work.v.copy_from_slice(x);
        let (mass, MinresWorkspace { v, r, .. }) = (self.mass, &mut *self.work);
        for (v, _) in v.iter_mut().zip(mass).filter(|(_, m)| **m <= R::zero()) {
            *v = Vec3::zeros();
        }

        if v.iter().all(|v| *v == Vec3::zeros()) {
            r.copy_from_slice(b);
        } else {
            self.products += 1;
            self.a.apply(v, r);
            blocks(r).each((per_row_mut(r), per_row(b)), |_, (r, b)| combine(r, -R::one(), b, R::one()));
        }

        self.divide_by_mass()
    }

    /// z = M⁻¹ r, and r = 0 in rows without mass; returns |r|.
    fn divide_by_mass(&mut self) -> f64 {
        let (mass, MinresWorkspace { r, z, partials, .. }) = (self.mass, &mut *self.work);
        let fields = (per_block_mut(partials), per_row_mut(r), per_row_mut(z), per_row(mass));
        blocks(mass).each(fields, |_, (partial, r, z, mass)| {
            for ((r, z), m) in r.iter_mut().zip(z.iter_mut()).zip(mass) {
                if *m > R::zero() {
                    *z = *r / *m;
                } else {
                    (*r, *z) = (Vec3::zeros(), Vec3::zeros());
                }
            }

            *partial = [block_sums(r, z)[0]];
        });

        sum(partials)[0].sqrt()
    }

    /// Iterates from the r and z of x until the residual is `goal`, `cap` times at most.
    fn run(&mut self, x: &mut [Vec3<R>], residual: f64, goal: f64, cap: u32) -> Run {
        for vector in [&mut self.work.before, &mut self.work.w_before, &mut self.work.w] {
            vector.fill(Vec3::zeros());
        }

        // No component of x can be larger than this.
        let mut largest = self.length(x);
        let mut qr = LanczosQr::new(residual);
        let mut iterations = 0;
        let end = loop {
            if qr.residual <= goal || iterations == cap || self.a.is_interrupted() {
                break End::Goal;
            }

            let [alpha, beta] = self.lanczos(&qr);
            qr.turn(alpha, beta);
            if !qr.is_finite() {
                break End::NotFinite;
            }
            if qr.is_singular(64.0 * R::ROUNDING) {
                break End::Singular;
            }

            let step = qr.step.abs();
            largest += step * self.direct(&qr);
            if largest.is_nan() || largest.max(step) > R::LARGEST {
                break End::NotFinite;
            }

            self.advance(qr.step, x);
            iterations += 1;
        };
        Run { end, iterations }
    }

    /// The next Lanczos vector, in r and z, from those of this iteration; returns v.A v and |r|.
    fn lanczos(&mut self, qr: &LanczosQr) -> [f64; 2] {
        let beta = qr.beta;
        let MinresWorkspace { v, q, before, r, z, partials, .. } = &mut *self.work;
        let inverse = R::of(1.0 / beta);
        let all = blocks(v);
        all.each((per_row_mut(v), per_row(z)), |_, (v, z)| {
            v.iter_mut().zip(z).for_each(|(v, z)| *v = z * inverse);
        });

        self.products += 1;
        self.a.apply(v, q);
        let share = R::of(-qr.beta_ratio);
        let fields = (per_block_mut(partials), per_row_mut(q), per_row(before), per_row(v));
        all.each(fields, |_, (partial, q, before, v)| {
            combine(q, R::one(), before, share);
            *partial = [block_sums(v, q)[0]];
        });

        let alpha = sum(partials)[0];
        let share = R::of(-alpha / beta);
        all.each((per_row_mut(q), per_row(r)), |_, (q, r)| combine(q, R::one(), r, share));

        std::mem::swap(before, r);
        std::mem::swap(r, q);
        [alpha, self.divide_by_mass()]
    }

    /// w becomes the next direction of x; returns its length.
    fn direct(&mut self, qr: &LanczosQr) -> f64 {
        let MinresWorkspace { v, w_before, w, partials, .. } = &mut *self.work;
        std::mem::swap(w_before, w);
        let [older, old, new] = qr.direction.map(R::of);
        let fields = (per_block_mut(partials), per_row_mut(w), per_row(w_before), per_row(v));
        blocks(v).each(fields, |_, (partial, w, w_before, v)| {
            combine(w, older, v, new);
            combine(w, R::one(), w_before, old);
            *partial = [block_sums(w, w)[0]];
        });

        sum(partials)[0].sqrt()
    }

    /// x += step w.
    fn advance(&self, step: f64, x: &mut [Vec3<R>]) {
        let step = R::of(step);
        let fields = (per_row_mut(x), per_row(&self.work.w));
        blocks(&self.work.w).each(fields, |_, (x, w)| combine(x, R::one(), w, step));
    }

    /// Length of a vector, without the mass.
    fn length(&mut self, x: &[Vec3<R>]) -> f64 {
        let partials = &mut self.work.partials;
        blocks(x).each((per_block_mut(partials), per_row(x)), |_, (partial, x)| {
            *partial = [block_sums(x, x)[0]];
        });
        sum(partials)[0].sqrt()
    }
}

/// The blocks of a vector.
fn blocks<T>(vector: &[T]) -> Own {
    Own::whole(vector.len(), BLOCK_SIZE)
}

/// QR factorisation of the tridiagonal matrix of the Lanczos vectors, row by row as they come, with one
/// plane rotation per row (the names are those of Paige and Saunders).
struct LanczosQr {
    /// |r| of the recursion: the entry beside the diagonal.
    beta: f64,
    /// beta over that of the iteration before.
    beta_ratio: f64,
    /// Cosine and sine of the last rotation.
    cosine: f64,
    sine: f64,
    /// Entries of the next row that are not final yet.
    delta_bar: f64,
    epsilon: f64,
    /// |r|, as far as the recursion knows.
    residual: f64,
    /// Sum of squares of all entries: that of the size of the matrix.
    size2: f64,
    /// |A r| / |r| before this iteration's step.
    slope: f64,
    /// What the next direction has of the one before the last, of the last, and of v.
    direction: [f64; 3],
    /// How far x goes along it.
    step: f64,
}

impl LanczosQr {
    fn new(residual: f64) -> Self {
        Self {
            beta: residual,
            beta_ratio: 0.0,
            cosine: -1.0,
            sine: 0.0,
            delta_bar: 0.0,
            epsilon: 0.0,
            residual,
            size2: 0.0,
            slope: f64::INFINITY,
            direction: [0.0; 3],
            step: 0.0,
        }
    }

    /// Takes in the next row: alpha on the diagonal, beta beside it.
    fn turn(&mut self, alpha: f64, beta: f64) {
        let beside = if self.beta_ratio > 0.0 { self.beta } else { 0.0 };
        self.size2 += alpha * alpha + beside * beside + beta * beta;

        let epsilon = self.epsilon;
        let delta = self.cosine * self.delta_bar + self.sine * alpha;
        let gamma_bar = self.sine * self.delta_bar - self.cosine * alpha;
        self.epsilon = self.sine * beta;
        self.delta_bar = -self.cosine * beta;
        self.slope = (gamma_bar * gamma_bar + self.delta_bar * self.delta_bar).sqrt();

        let gamma = (gamma_bar * gamma_bar + beta * beta).sqrt();
        (self.cosine, self.sine) = (gamma_bar / gamma, beta / gamma);

        self.step = self.cosine * self.residual;
        self.residual *= self.sine;
        self.direction = [-epsilon / gamma, -delta / gamma, 1.0 / gamma];
        self.beta_ratio = beta / self.beta;
        self.beta = beta;
    }

    fn is_finite(&self) -> bool {
        self.size2.is_finite()
    }

    /// Whether A r is 0 within rounding, for the size of A and of r.
    fn is_singular(&self, rounding: f64) -> bool {
        self.slope <= rounding * self.size2.sqrt()
    }
}

//! What is wrong with the curvature along a direction that is not above its rounding bound.

use super::{CgWorkspace, Solve, pad_all};
use crate::{
    linalg::{settings::Outcome, sixteens::block_sums},
    math::Real,
    parallel::{per_block_mut, per_row, per_sixteen},
};

impl<R: Real> Solve<'_, R> {
    /// Names a curvature that is not above its rounding bound. p and q are then other vectors.
    pub(super) fn bad_curvature(
        &mut self,
        [curvature, magnitude]: [f64; 2],
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
        let [p_norm, q_norm] = self.norms();
        pad_all(self.share.own(), self.b, &mut self.work.p);
        self.apply_operator();
        let [b_norm, product_norm] = self.norms();

        let vanishes = q_norm <= 64.0 * R::ROUNDING * product_norm / b_norm * p_norm;
        Some(if vanishes { Outcome::Singular { iteration } } else { Outcome::ZeroCurvature { iteration } })
    }

    /// |p| and |q|.
    fn norms(&mut self) -> [f64; 2] {
        let CgWorkspace { p, q, partials, .. } = &mut *self.work;
        let fields = (per_block_mut(partials), per_row(p), per_sixteen(q));
        self.share.own().each(fields, |_, (partial, p, q)| {
            let of_p = p.iter().map(|p| p.vector().map(R::to_f64).norm_squared());
            *partial = [of_p.fold(0.0, |sum, square| sum + square), block_sums(q, q)[0]];
        });
        self.share.sum(partials, &|partial| *partial).map(f64::sqrt)
    }
}

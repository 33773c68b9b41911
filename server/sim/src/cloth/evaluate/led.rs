//! Velocities that a step leads to, as they are or by a change of those at its start.

use crate::math::{LANES, Padded, Real, Sixteen, Vec3};

/// Velocities that a step leads to.
#[derive(Clone, Copy)]
pub(crate) enum Led<'a, R> {
    /// A change of velocities.
    ByChange {
        from: &'a [Padded<R>],
        dv: &'a [Sixteen<R>],
    },
    To(&'a [Padded<R>]),
}

impl<R: Real> Led<'_, R> {
    pub(crate) fn of(&self, row: usize) -> Vec3<f64> {
        let wide = |field: &[Padded<R>]| field[row].vector().map(R::to_f64);
        match self {
            Self::ByChange { from, dv } => wide(from) + dv[row / LANES].get(row % LANES).map(R::to_f64),
            Self::To(u) => wide(u),
        }
    }
}

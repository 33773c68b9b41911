//! What a solve makes of numbers out of range, and of being interrupted.

use std::sync::atomic::{AtomicU32, Ordering};

use super::{CgWorkspace, conjugate_gradient};
use crate::{
    linalg::{BlockCsr, Identity, LinearOperator, Outcome, SolverSettings, sixteens::sums_of_padded},
    math::{LANES, Padded, Sixteen, Vec3},
    parallel::Share,
};

#[test]
fn numbers_that_leave_the_range_are_named_and_not_returned_as_a_solution() {
    let huge: Vec<Vec<f64>> =
        (0..3).map(|i| (0..3).map(|j| if i == j { 1e300 } else { 0.0 }).collect()).collect();
    let a = BlockCsr::<f64>::from_dense(&huge);
    for (b, iteration) in [(1e200, 0), (1e10, 1)] {
        let mut x = [Sixteen::default()];
        let mut work = CgWorkspace::new(1, 32);
        let b = Sixteen::from_vectors(&[Vec3::new(b, 0.0, 0.0)]);
        let report = conjugate_gradient(
            &a,
            &Identity,
            &b,
            &mut x,
            &SolverSettings::default(),
            &Share::whole(1, 32),
            &mut work,
        );
        assert_eq!(report.outcome, Outcome::NotFinite { iteration });
        assert_eq!(x, [Sixteen::default()]);
    }
}

/// The second difference, which is given up after a number of products.
struct Chain {
    products: AtomicU32,
    allowed: u32,
}

impl LinearOperator<f64> for Chain {
    fn apply(&self, first_row: usize, p: &[Padded<f64>], q: &mut [Sixteen<f64>]) -> [f64; 2] {
        self.products.fetch_add(1, Ordering::Relaxed);
        let x = |i: usize| p.get(i).map_or(Vec3::zeros(), Padded::vector);
        for (i, lane) in (first_row..first_row + q.len() * LANES).zip((0..LANES).cycle()) {
            q[(i - first_row) / LANES].set(lane, x(i) * 2.0 - x(i.wrapping_sub(1)) - x(i + 1));
        }
        sums_of_padded(&p[first_row..first_row + q.len() * LANES], q)
    }

    fn is_interrupted(&self) -> bool {
        self.products.load(Ordering::Relaxed) >= self.allowed
    }
}

#[test]
fn a_solve_that_is_interrupted_makes_no_further_iteration() {
    let b = Sixteen::from_vectors(&[Vec3::new(1.0, 0.0, 0.0); 96]);
    for allowed in [0, 1, 7] {
        let a = Chain { products: AtomicU32::new(0), allowed };
        let (mut x, mut work) = (vec![Sixteen::default(); b.len()], CgWorkspace::new(96, 96));
        let settings = SolverSettings::default();
        let report =
            conjugate_gradient(&a, &Identity, &b, &mut x, &settings, &Share::whole(96, 96), &mut work);
        assert_eq!((report.outcome, report.iterations), (Outcome::IterationCap, allowed));
    }
}

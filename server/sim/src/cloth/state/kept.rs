//! What the patches that solves still use were set up for, and how many iterations they needed.
//!
//! Functions and factors follow from positions, the h of the matrix and its treatment of compressed springs. The state holds
//! these in their place, so that a copy of it, or one that was saved, goes on with the same bits.

use serde::{Deserialize, Serialize};

use crate::math::{Padded, Real, array3, bytes};

/// A set-up is made anew after a solve with more iterations than its first one, 3/2 as many.
const MORE: [u32; 2] = [3, 2];
/// A solve goes on with a new one after so many times the iterations of the first.
const GIVEN_UP: u32 = 3;
/// Iterations that cost less than a set-up, whatever the first solve took.
const FEW: u32 = 8;
/// Iterations of a first solve from which on it is not worth keeping.
const MANY: u32 = 60;

/// A set-up that is kept; empty where the next solve with patches makes one of its own.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(bound = "")]
pub(crate) struct Kept<R: Real> {
    /// Positions (m), as those of the state.
    #[serde(with = "bytes")]
    x: Vec<Padded<R>>,
    /// h of the matrix (s).
    h: f64,
    /// What it multiplied negative transverse ratios by.
    mirror: f64,
    /// Iterations of the first whole solve that converged with it; 0 before.
    iterations: u32,
    /// Whether the solve that goes on has made it.
    #[serde(skip)]
    is_new: bool,
}

impl<R: Real> Kept<R> {
    /// Keeps the one that is made at these positions (m).
    pub(crate) fn begin(&mut self, x: &[Padded<R>], [h, mirror]: [f64; 2]) {
        self.x.clear();
        self.x.extend_from_slice(x);
        (self.h, self.mirror, self.iterations, self.is_new) = (h, mirror, 0, true);
    }

    /// Takes over what another one keeps.
    pub(crate) fn follow(&mut self, other: &Self) {
        let Self { x, h, mirror, iterations, is_new } = other;
        self.x.clone_from(x);
        (self.h, self.mirror, self.iterations, self.is_new) = (*h, *mirror, *iterations, *is_new);
    }

    /// Gives the set-up away: the next solve with patches makes one.
    pub(crate) fn forget(&mut self) {
        self.begin(&[], [0.0; 2]);
        self.is_new = false;
    }

    /// Whether it may precondition a matrix with this h (s) and this treatment of compressed springs.
    pub(crate) fn serves(&self, [h, mirror]: [f64; 2]) -> bool {
        !self.x.is_empty() && [self.h, self.mirror].map(f64::to_bits) == [h, mirror].map(f64::to_bits)
    }

    /// Whether both are made of the same.
    pub(crate) fn is_made_as(&self, other: &Self) -> bool {
        other.serves([self.h, self.mirror]) && self.x == other.x
    }

    /// Positions (m) that it was made at; none where none is kept.
    pub(crate) fn positions(&self) -> &[Padded<R>] {
        &self.x
    }

    /// What it is beside its positions, as numbers.
    pub(crate) fn numbers(&self) -> [f64; 3] {
        [self.h, self.mirror, f64::from(self.iterations)]
    }

    /// Whether a cloth of so many positions may keep it.
    pub(crate) fn is_sound(&self, count: usize) -> bool {
        let Self { x, h, mirror, iterations, .. } = self;
        let is_finite = |row: &Padded<R>| array3(&row.vector()).iter().all(|c| c.is_finite());
        [0, count].contains(&x.len())
            && x.iter().all(is_finite)
            && h.is_finite()
            && mirror.is_finite()
            && *iterations <= MANY
    }

    /// Iterations after which a solve goes on with a new one; none of a new one. Of one that no whole solve has shown to serve, those from
    /// which on it is not worth keeping.
    pub(crate) fn limit(&self) -> Option<u32> {
        if self.is_new || self.x.is_empty() {
            return None;
        }
        Some(if self.iterations > 0 { GIVEN_UP * self.iterations.max(FEW) } else { MANY })
    }

    /// Takes into account that a solve ended with it of which nothing follows.
    pub(crate) fn pass(&mut self) {
        self.is_new = false;
    }

    /// Takes into account that a solve converged after so many iterations: too many end it.
    pub(crate) fn note(&mut self, iterations: u32) {
        let [more, than] = MORE;
        let is_first = self.iterations == 0;
        let is_much = if is_first {
            iterations > MANY
        } else {
            iterations > FEW && than * iterations > more * self.iterations
        };
        self.is_new = false;
        if self.x.is_empty() {
            return;
        }
        if is_much {
            self.forget();
        } else if is_first {
            self.iterations = iterations.max(1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Kept;
    use crate::math::{Padded, Vec3};

    fn made() -> Kept<f64> {
        let mut kept = Kept::default();
        kept.begin(&[Padded::new(&Vec3::new(1.0, 2.0, 3.0))], [0.01, -1.0]);
        kept
    }

    #[test]
    fn it_serves_one_h_and_one_treatment_and_is_known_by_its_positions() {
        let mut kept = made();
        assert!(kept.serves([0.01, -1.0]) && !kept.serves([0.005, -1.0]) && !kept.serves([0.01, 1.0]));
        let mut other = Kept::default();
        assert!(!other.serves([0.0, 0.0]) && !other.is_made_as(&kept) && !kept.is_made_as(&other));
        other.follow(&kept);
        assert!(other.is_made_as(&kept) && other == kept);
        other.begin(&[Padded::new(&Vec3::new(1.0, 2.0, 4.0))], [0.01, -1.0]);
        assert!(!other.is_made_as(&kept));
        kept.forget();
        assert!(kept.positions().is_empty() && !kept.serves([0.01, -1.0]));
    }

    #[test]
    fn what_no_cloth_keeps_is_known() {
        let sound = made();
        assert!(sound.is_sound(1) && Kept::<f64>::default().is_sound(1) && !sound.is_sound(2));
        let spoiled: [fn(&mut Kept<f64>); 4] = [
            |kept| kept.x[0] = Padded::new(&Vec3::new(1.0, f64::NAN, 3.0)),
            |kept| kept.h = f64::INFINITY,
            |kept| kept.mirror = f64::NAN,
            |kept| kept.iterations = u32::MAX,
        ];
        for spoil in spoiled {
            let mut kept = made();
            spoil(&mut kept);
            assert!(!kept.is_sound(1), "{kept:?}");
        }
    }

    #[test]
    fn it_ends_where_solves_take_half_as_many_iterations_again_as_the_first() {
        let mut kept = made();
        assert_eq!(kept.limit(), None);
        kept.pass();
        assert_eq!(kept.limit(), Some(60));
        kept.note(12);
        assert_eq!(kept.limit(), Some(36));
        kept.note(3);
        kept.note(18);
        assert_eq!(kept.limit(), Some(36));
        kept.note(19);
        assert_eq!((kept.limit(), kept.positions().len()), (None, 0));

        let mut kept = made();
        kept.note(2);
        kept.note(8);
        assert_eq!(kept.limit(), Some(24), "few are not too many");
        let mut kept = made();
        kept.note(61);
        assert!(kept.positions().is_empty(), "what needs many is not kept");
    }
}

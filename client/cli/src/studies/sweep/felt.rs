//! What colliders feel over a run: the last force, the mean and the greatest of its size.
//!
//! Enters: loads, step by step. Leaves: forces (N).

use nappe_sim::{math::array::length, report::Load};

/// What is measured of the force on a collider.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Force {
    /// Along an axis, in the last step (N).
    Along(usize),
    /// The mean of its size over all steps (N).
    Mean,
    /// The greatest of its size in any step (N).
    Greatest,
}

/// What each collider felt in the steps of a run so far.
#[derive(Clone, Debug, Default)]
pub(crate) struct Felt {
    colliders: Vec<OfOne>,
    steps: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct OfOne {
    /// The force in the last step (N).
    last: [f64; 3],
    /// The sizes of the forces of all steps, added in their order (N).
    sum: f64,
    /// The greatest of them (N).
    most: f64,
}

impl Felt {
    /// Adds the loads of a step, one for each collider.
    pub(crate) fn add(&mut self, loads: &[Load]) {
        self.colliders.resize(loads.len(), OfOne::default());
        self.steps += 1;
        for (OfOne { last, sum, most }, load) in self.colliders.iter_mut().zip(loads) {
            let size = length(load.force);
            *last = load.force;
            *sum += size;
            *most = most.max(size);
        }
    }

    /// A force on a collider (N), by its place in the scene; 0 before the first step.
    pub(crate) fn force(&self, collider: usize, force: Force) -> f64 {
        let Some(felt) = self.colliders.get(collider) else { return 0.0 };
        match force {
            Force::Along(axis) => felt.last[axis],
            Force::Mean => felt.sum / self.steps as f64,
            Force::Greatest => felt.most,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn forces_are_those_of_the_steps() {
        let load = |force: [f64; 3]| Load { force, ..Load::default() };
        let mut felt = Felt::default();
        assert_eq!(felt.force(1, Force::Mean), 0.0, "no step was taken");
        felt.add(&[load([0.0; 3]), load([3.0, -4.0, 0.0])]);
        felt.add(&[load([0.0; 3]), load([0.0, -2.0, 0.0])]);
        felt.add(&[load([0.0; 3]), load([0.0, 0.0, 2.0])]);
        let found = [Force::Along(1), Force::Along(2), Force::Mean, Force::Greatest];
        assert_eq!(found.map(|force| felt.force(1, force)), [0.0, 2.0, 3.0, 5.0]);
        assert_eq!(found.map(|force| felt.force(0, force)), [0.0; 4]);
    }
}

//! Diagnostics of a state, and the checks on them: energies, momentum, largest stretch, finiteness.
//!
//! Reads positions and velocities; every sum is binary64 over fixed blocks.

use rayon::prelude::*;

use super::{
    forces::Energy,
    model::Model,
    sell::Sell,
    settings::ClothSettings,
    state::{Frozen, State, Workspace},
};
use crate::{
    linalg::pad,
    math::{Pack, Padded, Real, Vec3, WithSimd, array::dot, array3, dispatch},
    parallel::sum,
    report::{Diagnostics, StepFailure},
};

/// Places in the sums of a block: energies (J), momentum (kg m/s, three places), the check that all is
/// finite, and the largest stretch.
const KINETIC: usize = 0;
const ELASTIC: usize = 1;
const GRAVITATIONAL: usize = 2;
const MOMENTUM: usize = 3;
const CHECKSUM: usize = 6;
const STRETCH: usize = 7;

/// Diagnostics of a state.
pub(super) fn diagnose<R: Real>(model: &Model<R>, state: &State<R>, work: &mut Workspace<R>) -> Diagnostics {
    let block_size = model.block_size;
    let Workspace { frozen, padded: [x, _], partials, .. } = work;
    pad(&state.x, block_size, x);

    partials.par_iter_mut().enumerate().for_each(|(block, partial)| {
        let rows = block * block_size..((block + 1) * block_size).min(model.count);
        *partial = dispatch(BlockSums { model, frozen, state, x, rows });
    });

    // A maximum has no order; NaN, which it would lose, shows in the sums.
    let max_stretch = partials.iter().map(|p| p[STRETCH]).fold(0.0, f64::max);
    let [kinetic_energy, elastic_energy, gravitational_energy, px, py, pz, checksum, _] = sum(partials);

    // A position that is not finite may not reach an energy (no spring, no gravity): the checksum
    // is 0 or NaN, and makes the kinetic energy NaN.
    Diagnostics {
        kinetic_energy: kinetic_energy + checksum,
        elastic_energy,
        gravitational_energy,
        momentum: [px, py, pz],
        max_stretch,
    }
}

struct BlockSums<'a, R: Real> {
    model: &'a Model<R>,
    frozen: &'a Frozen<R>,
    state: &'a State<R>,
    x: &'a [Padded<R>],
    rows: std::ops::Range<usize>,
}

impl<R: Real> WithSimd<R> for BlockSums<'_, R> {
    type Output = [f64; 8];

    #[inline(always)]
    fn run<P: Pack<Number = R>>(self) -> [f64; 8] {
        let (model, x) = (self.model, self.x);
        let gravity = array3(&self.frozen.gravity);
        let mut sums = [0.0; 8];
        for group in Sell::<R>::groups(self.rows.clone()) {
            let start = [P::Wide::zero(); 2];
            let fold = Energy;
            let springs =
                model.springs.fold_group::<P, _, 2>(group.start, [x, x], &self.frozen.laws, start, fold);
            let lanes = springs.map(Pack::store);
            for (lane, i) in group.enumerate() {
                // Both ends count a spring.
                sums[ELASTIC] += 0.5 * lanes[0][lane];
                sums[STRETCH] = f64::max(sums[STRETCH], lanes[1][lane]);

                let (position, v) = (array3(&self.state.x[i]), array3(&self.state.v[i]));
                let free = if model.inv_m[i] > R::zero() { model.m[i].to_f64() } else { 0.0 };
                sums[KINETIC] += 0.5 * free * dot(v, v);
                sums[GRAVITATIONAL] -= free * dot(gravity, position);

                for c in 0..3 {
                    sums[MOMENTUM + c] += free * v[c];
                }

                sums[CHECKSUM] += 0.0 * (position[0] + position[1] + position[2] + v[0] + v[1] + v[2]);
            }
        }

        sums
    }
}

/// Finds what is wrong with diagnostics that leave what is allowed. Particles are the user's.
pub(super) fn judge<R: Real>(
    model: &Model<R>,
    state: &State<R>,
    diagnostics: &Diagnostics,
    settings: &ClothSettings,
) -> Option<StepFailure> {
    let mechanical = diagnostics.kinetic_energy + diagnostics.elastic_energy;
    if !(mechanical + diagnostics.gravitational_energy).is_finite() || !diagnostics.max_stretch.is_finite() {
        return Some(not_finite(model, state).unwrap_or(StepFailure::NotFinite {
            particle: fastest(model, state),
            quantity: "energy",
            value: diagnostics.total_energy(),
        }));
    }

    if let Some(limit) = settings.limits.max_stretch.filter(|limit| diagnostics.max_stretch > *limit) {
        return longest(model, state, diagnostics.max_stretch, limit);
    }

    let limit = settings.limits.max_energy.filter(|limit| mechanical > *limit)?;
    Some(StepFailure::Energy { particle: fastest(model, state), value: mechanical, limit })
}

/// The user's first particle with a component that is not finite.
fn not_finite<R: Real>(model: &Model<R>, state: &State<R>) -> Option<StepFailure> {
    let bad = |v: &Vec3<R>| v.iter().map(|c| c.to_f64()).find(|c| !c.is_finite());
    model.place.iter().enumerate().find_map(|(user, &i)| {
        let found = |quantity, value| StepFailure::NotFinite { particle: user as u64, quantity, value };
        let i = i as usize;
        bad(&state.x[i])
            .map(|value| found("position", value))
            .or_else(|| bad(&state.v[i]).map(|value| found("velocity", value)))
    })
}

/// The user's first particle with the greatest speed.
fn fastest<R: Real>(model: &Model<R>, state: &State<R>) -> u64 {
    let speed = |user: usize| {
        state.v[model.place[user] as usize].iter().map(|c| c.to_f64() * c.to_f64()).sum::<f64>()
    };

    (0..model.count)
        .fold((0, -1.0), |best, user| if speed(user) > best.1 { (user, speed(user)) } else { best })
        .0 as u64
}

/// The user's first spring of that stretch.
fn longest<R: Real>(model: &Model<R>, state: &State<R>, stretch: f64, limit: f64) -> Option<StepFailure> {
    let length = |i: usize, j: usize| (state.x[i].map(R::to_f64) - state.x[j].map(R::to_f64)).norm();
    let (mut best, mut ends) = (0.0, None);
    for (user, &i) in model.place.iter().enumerate() {
        for (j, rest, _) in model.springs.row(i as usize).filter(|(_, rest, _)| *rest > R::zero()) {
            let ratio = length(i as usize, j as usize) / rest.to_f64();
            if ratio > best {
                (best, ends) = (ratio, Some((user as u64, u64::from(model.user[j as usize]))));
            }
        }
    }

    ends.map(|(particle, other)| StepFailure::Stretch { particle, other, value: stretch, limit })
}

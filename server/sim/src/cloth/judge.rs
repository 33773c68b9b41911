//! The checks on the diagnostics of a state: whether all is finite and within the scene's limits.

use super::{model::Model, settings::ClothSettings, state::State};
use crate::{
    math::{Padded, Real},
    report::{Diagnostics, StepFailure},
};

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
    let bad = |v: &Padded<R>| v.vector().iter().map(|c| c.to_f64()).find(|c| !c.is_finite());
    model.place.iter().enumerate().find_map(|(user, &i)| {
        let found = |quantity, value| StepFailure::NotFinite { particle: user as u64, quantity, value };
        let i = i as usize;
        bad(&state.x[i])
            .map(|value| found("position", value))
            .or_else(|| bad(&state.v[i]).map(|value| found("velocity", value)))
    })
}

/// The user's first particle with the greatest speed.
pub(super) fn fastest<R: Real>(model: &Model<R>, state: &State<R>) -> u64 {
    let speed = |user: usize| state.v[model.place[user] as usize].vector().map(R::to_f64).norm_squared();

    (0..model.count)
        .fold((0, -1.0), |best, user| if speed(user) > best.1 { (user, speed(user)) } else { best })
        .0 as u64
}

/// The user's first spring of that stretch.
fn longest<R: Real>(model: &Model<R>, state: &State<R>, stretch: f64, limit: f64) -> Option<StepFailure> {
    let at = |i: usize| state.x[i].vector().map(R::to_f64);
    let length = |i: usize, j: usize| (at(i) - at(j)).norm();
    let (mut best, mut ends) = (0.0, None);
    for (user, &i) in model.place.iter().enumerate() {
        for spring in model.springs.row(i as usize).filter(|spring| spring.rest_length > R::zero()) {
            let other = spring.other as usize;
            let ratio = length(i as usize, other) / spring.rest_length.to_f64();
            if ratio > best {
                (best, ends) = (ratio, Some((user as u64, u64::from(model.user[other]))));
            }
        }
    }

    ends.map(|(particle, other)| StepFailure::Stretch { particle, other, value: stretch, limit })
}

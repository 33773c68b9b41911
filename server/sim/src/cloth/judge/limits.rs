//! The checks on the diagnostics of a state: whether all is finite and within the scene's limits.

use crate::{
    cloth::{
        layout::{Figure, Model},
        settings::ClothSettings,
        state::State,
    },
    math::{Padded, Real},
    report::{Diagnostics, StepFailure},
};

/// What share of its rest length a spring is at least whose ends do not nearly meet.
const APART: f64 = 1e-3;
/// Stands for no particle among numbers that ranks tell each other.
const NO_PIN: f64 = -1.0;

/// Finds what is wrong with diagnostics that leave what is allowed: those of the second state, which the first one led to. Particles
/// are the user's.
pub(crate) fn judge<R: Real>(
    model: &Model<R>,
    [before, state]: [&State<R>; 2],
    diagnostics: &Diagnostics,
    settings: &ClothSettings,
) -> Option<StepFailure> {
    let mechanical = diagnostics.kinetic_energy + diagnostics.elastic_energy;
    if !(mechanical + diagnostics.gravitational_energy).is_finite() || !diagnostics.max_stretch.is_finite() {
        return Some(not_finite(model, state).unwrap_or(StepFailure::NotFinite {
            particle: fastest(model, state),
            quantity: "energy".into(),
            value: diagnostics.total_energy(),
        }));
    }

    if let Some(limit) = settings.limits.max_stretch.filter(|limit| diagnostics.max_stretch > *limit) {
        return longest(model, [before, state], diagnostics.max_stretch, limit);
    }

    let limit = settings.limits.max_energy.filter(|limit| mechanical > *limit)?;
    Some(StepFailure::Energy { particle: fastest(model, state), value: mechanical, limit })
}

/// The user's first particle with a component that is not finite.
fn not_finite<R: Real>(model: &Model<R>, state: &State<R>) -> Option<StepFailure> {
    const QUANTITIES: [&str; 2] = ["position", "velocity"];
    let bad = |v: &Padded<R>| v.vector().iter().map(|c| c.to_f64()).find(|c| !c.is_finite());
    let found = own_particles(model).find_map(|(user, place)| {
        let value = |fields: [&[Padded<R>]; 2]| {
            let mut values = fields.into_iter().enumerate();
            values.find_map(|(quantity, field)| Some([quantity as f64, bad(&field[place])?]))
        };
        let [quantity, value] = value([&state.x, &state.v])?;
        Some([-(user as f64), 0.0, quantity, value])
    });
    let [user, _, quantity, value] =
        model.share.greatest(found.unwrap_or([f64::NEG_INFINITY, 0.0, 0.0, 0.0]));
    user.is_finite().then(|| StepFailure::NotFinite {
        particle: -user as u64,
        quantity: QUANTITIES[quantity as usize].into(),
        value,
    })
}

/// The user's numbers of the particles that are computed here, ascending, and where these are.
fn own_particles<R: Real>(model: &Model<R>) -> impl Iterator<Item = (usize, usize)> {
    let all = model.place.iter().map(|place| *place as usize).enumerate();
    all.filter(|(_, place)| model.share.has(*place))
}

/// The user's first particle with the greatest speed, of those that no frames lead: what corners of figures do is nothing that a step went wrong at.
pub(crate) fn fastest<R: Real>(model: &Model<R>, state: &State<R>) -> u64 {
    let mut is_led = vec![false; model.count];
    for row in model.figures.iter().flat_map(Figure::rows) {
        is_led[row] = true;
    }
    let of_cloth = own_particles(model).filter(|(_, place)| !is_led[*place]);
    let best = of_cloth.fold([-1.0, 0.0], |best, (user, place)| {
        let speed = state.v[place].vector().map(R::to_f64).norm_squared();
        if speed > best[0] { [speed, user as f64] } else { best }
    });
    model.share.greatest(best)[1] as u64
}

/// The user's first spring of that stretch, or two particles of a triangle of it, and which of them is a pin that moved, if one
/// is.
fn longest<R: Real>(
    model: &Model<R>,
    [before, state]: [&State<R>; 2],
    stretch: f64,
    limit: f64,
) -> Option<StepFailure> {
    let at = |i: usize| state.x[i].vector().map(R::to_f64);
    let length = |i: usize, j: usize| (at(i) - at(j)).norm();
    let is_moved = |i: usize| before.x.get(i).is_some_and(|x| x.vector().map(R::to_f64) != at(i));
    let is_moved_pin = |i: usize| model.inv_m[i] == R::zero() && is_moved(i);
    let mut best = [0.0, 0.0, 0.0, NO_PIN];
    for (user, i) in own_particles(model) {
        for spring in model.springs.row(i).filter(|spring| spring.rest_length > R::zero()) {
            let other = spring.other as usize;
            let ratio = length(i, other) / spring.rest_length.to_f64();
            if ratio > best[0] {
                let pin = [i, other].into_iter().find(|end| is_moved_pin(*end));
                let pin = pin.map_or(NO_PIN, |pin| f64::from(model.user[pin]));
                best = [ratio, user as f64, f64::from(model.user[other]), pin];
            }
        }
    }

    for elements in &model.elements {
        elements.tell_stretch(&state.x, &mut |ends, ratio| {
            if ratio > best[0] && ends.iter().any(|end| model.share.has(*end)) {
                let pin = ends.into_iter().find(|end| is_moved_pin(*end));
                let [particle, other] = ends.map(|end| f64::from(model.user[end]));
                best = [ratio, particle, other, pin.map_or(NO_PIN, |pin| f64::from(model.user[pin]))];
            }
        });
    }

    let [ratio, particle, other, pin] = model.share.greatest(best);
    let (particle, other) = (particle as u64, other as u64);
    let pin = (pin >= 0.0).then_some(pin as u64);
    (ratio > 0.0).then_some(StepFailure::Stretch { particle, other, value: stretch, limit, pin })
}

/// Why a step failed, from the state that it started from: where numbers left their range and the ends of a spring nearly
/// met, that is it, and a shorter step would change nothing.
pub(crate) fn cause<R: Real>(model: &Model<R>, state: &State<R>, failure: StepFailure) -> StepFailure {
    match failure {
        StepFailure::NotFinite { .. } | StepFailure::Solver { .. } => {
            collapsed(model, state).unwrap_or(failure)
        }
        _ => failure,
    }
}

/// The user's first spring of those that are the least share of their rest length, where its ends nearly meet.
fn collapsed<R: Real>(model: &Model<R>, state: &State<R>) -> Option<StepFailure> {
    let at = |i: usize| state.x[i].vector().map(R::to_f64);
    let mut best = [0.0; 5];
    for (user, i) in own_particles(model) {
        for spring in model.springs.row(i).filter(|spring| spring.rest_length > R::zero()) {
            let other = spring.other as usize;
            let (value, rest_length) = ((at(i) - at(other)).norm(), spring.rest_length.to_f64());
            // Infinite where the ends are in one place.
            if rest_length / value > best[0] {
                best = [rest_length / value, user as f64, f64::from(model.user[other]), value, rest_length];
            }
        }
    }

    let [ratio, particle, other, value, rest_length] = model.share.greatest(best);
    let (particle, other) = (particle as u64, other as u64);
    (ratio > 1.0 / APART).then_some(StepFailure::Collapsed { particle, other, value, rest_length })
}

//! Where the energy of a cloth is: the share of each particle, to say which one a step went wrong at.

use crate::{
    cloth::{evaluate::StepNumbers, layout::Model, state::State},
    math::Real,
};

/// The user's first free particle whose share of the energy rose most from one state to another; 0 without any.
pub(crate) fn risen_most<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    [from, to]: [&State<R>; 2],
) -> u64 {
    let [before, after] = [from, to].map(|state| shares(model, numbers, state));
    let rise = |place: usize| after[place] - before[place];
    let is_own_and_free =
        |place: &u32| model.inv_m[*place as usize] > R::zero() && model.share.has(*place as usize);
    let free = model.place.iter().enumerate().filter(|(_, place)| is_own_and_free(place));
    let most = free.fold(None, |most: Option<(usize, f64)>, (user, place)| {
        let rise = rise(*place as usize);
        if most.is_none_or(|(_, largest)| rise > largest) { Some((user, rise)) } else { most }
    });
    let told = most.map_or([f64::NEG_INFINITY, 0.0], |(user, rise)| [rise, user as f64]);
    model.share.greatest(told)[1] as u64
}

/// The kinetic and gravitational energy of each particle, and its part of that of its springs and elements, of which all
/// ends have the same (J).
fn shares<R: Real>(model: &Model<R>, numbers: &StepNumbers<R>, state: &State<R>) -> Vec<f64> {
    let x = |row: usize| state.x[row].vector().map(R::to_f64);
    let gravity = numbers.gravity.map(R::to_f64);
    let mut shares: Vec<f64> = (0..model.count)
        .map(|row| {
            let v = state.v[row].vector().map(R::to_f64);
            let own = model.m[row].to_f64() * (0.5 * v.norm_squared() - gravity.dot(&x(row)));
            let springs = model.springs.row(row).map(|spring| {
                let (slot, lane) = spring.place;
                let stiffness = numbers.springs[model.springs.pattern_of[slot] as usize].stiffness[lane];
                let longer = (x(row) - x(spring.other as usize)).norm() - spring.rest_length.to_f64();
                0.25 * stiffness.to_f64() * longer * longer
            });
            own + springs.sum::<f64>()
        })
        .collect();
    for (elements, numbers) in model.elements.iter().zip(&numbers.elements) {
        elements.add_energies(&state.x, numbers.energy, &mut shares);
    }
    shares
}

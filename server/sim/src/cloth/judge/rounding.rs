//! How much of an energy is rounding.

use crate::{
    cloth::{
        evaluate::{StepNumbers, Total},
        layout::Model,
    },
    math::Real,
};

/// A bound on what rounding does to the energies of a state (J), of which no component of a position is more than
/// `largest_coordinate` (m): positions are off by a rounding of that, e, against the tensions, which add up to sqrt(2 k E)
/// at most, against the stiffness itself, and against the weight and given forces.
pub(crate) fn rounding<R: Real>(
    model: &Model<R>,
    numbers: &StepNumbers<R>,
    total: &Total,
    largest_coordinate: f64,
) -> f64 {
    let e = 4.0 * R::ROUNDING * largest_coordinate;
    let tension = (2.0 * numbers.stiffness * total.elastic_energy).sqrt();
    let weight = model.free_mass * numbers.gravity.map(R::to_f64).norm() + numbers.external.force_sum;
    e * (tension + e * numbers.stiffness + weight) + 8.0 * R::ROUNDING * total.kinetic_energy
}

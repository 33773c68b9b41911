//! Which law bounds an explicit step at a particle: by the stiffness that each has there.
//!
//! Reads a model and its parameters; gives a name, as scenes have it.

use crate::{
    cloth::layout::{Model, Parameters},
    math::Real,
    mesh::SpringKind,
};

/// The law with the largest part of the stiffness (N/m) at a particle of the user's numbering, at rest; none without any.
pub(crate) fn bounding_law<R: Real>(
    model: &Model<R>,
    parameters: &Parameters,
    particle: u32,
) -> Option<String> {
    let place = *model.place.get(particle as usize)? as usize;
    let of_springs = SpringKind::ALL.map(|kind| {
        let laws = model.springs.row(place).map(|spring| {
            let (slot, lane) = spring.place;
            let law = model.springs.patterns[model.springs.pattern_of[slot] as usize][lane];
            parameters.laws[usize::from(law)]
        });
        let stiffness: f64 = laws.filter(|entry| entry.kind == kind).map(|entry| entry.law.stiffness).sum();
        // Both ends move.
        (2.0 * stiffness, format!("springs.{}", kind.name()))
    });
    let of_elements = model.elements.iter().zip(&parameters.elements).map(|(elements, law)| {
        let mut shares = vec![0.0; model.count];
        elements.add_shares(&mut shares);
        (law.stiffness * shares[place], elements.kind().name().to_owned())
    });
    let acting = of_springs.into_iter().chain(of_elements).filter(|(stiffness, _)| *stiffness > 0.0);
    acting.max_by(|(one, _), (other, _)| one.total_cmp(other)).map(|(_, name)| name)
}

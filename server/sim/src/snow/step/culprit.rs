//! The particle that sets a bound on the time step.
//!
//! Reads extremes and the particles that have them; writes their numbers, for reports and failures.

use crate::{
    math::{Pack, Portable, Real},
    snow::{
        bound::{Culprits, Extremes, extremes},
        grid::Sorted,
        law::{Moduli, hardened},
        model::SnowModel,
        particles::{Constants, Group, Particles},
        transfer::ChunkDiagnostics,
    },
};

/// Looks in the chunks that have the extremes, while particles are still in their order.
pub(crate) fn culprits_in_chunks<R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    sorted: Sorted<'_>,
    extremes: &Extremes,
    chunks: &[ChunkDiagnostics],
) -> Culprits {
    let greatest = extremes.values();
    let has = |own: [f64; 5]| (0..5).any(|k| greatest[k] > 0.0 && own[k] >= greatest[k]);
    let chunks = (0..chunks.len()).filter(|chunk| has(chunks[*chunk].extremes.values()));
    let blocks = chunks.flat_map(|chunk| sorted.chunks.blocks(chunk));
    culprits_in(model, particles, blocks.flat_map(|block| sorted.places(block)), extremes)
}

/// Looks at the particles of a list of places.
pub(crate) fn culprits_in<'a, R: Real>(
    model: &SnowModel<R>,
    particles: &Particles<R>,
    places: impl Iterator<Item = &'a u32>,
    extremes: &Extremes,
) -> Culprits {
    let greatest = extremes.values();
    let mut culprits = Culprits::default();
    for place in places {
        let id = u64::from(particles.id[*place as usize]);
        let values = extremes_of(model, particles, *place).values();
        for k in (0..5).filter(|k| greatest[*k] > 0.0 && values[*k] >= greatest[*k]) {
            culprits.0[k] = Some(culprits.0[k].map_or(id, |other| other.min(id)));
        }
    }
    culprits
}

/// The extremes of one particle, with the bits that a step has.
fn extremes_of<R: Real>(model: &SnowModel<R>, particles: &Particles<R>, place: u32) -> Extremes {
    let at = place as usize;
    let lane = |value: R| Portable::splat(value);
    let columns = |rows: [[R; 3]; 3]| [0, 1, 2].map(|k| [0, 1, 2].map(|row| lane(rows[row][k])));
    let Constants { stiffness, object, .. } = particles.constants(&Group::of(&[place]));
    let moduli = Moduli::gather(&model.materials, &object, Portable::load(&stiffness));
    let values = extremes(
        &columns(particles.f_e(at)),
        hardened(lane(particles.plastic_ratio(at)), &moduli),
        &particles.v(at).map(lane),
        &columns(particles.c(at)),
        lane(particles.volume(at)) / lane(particles.mass(at)),
        &moduli,
    );
    Extremes::of(values.map(|value| value.store()[0].to_f64()))
}

//! What is odd about a network but defined, in sentences for its user.

use super::description::Network;
use crate::{
    interrupt,
    math::{
        Precision, Real,
        array::{length, minus},
    },
    mesh::sorted,
};

/// Largest distance between neighbouring numbers that is fine enough for positions, in distances between particles: strains
/// are then known to a ten-thousandth.
const FINEST: f64 = 1e-4;

/// The distance between neighbours of a grid: the rest length that a tenth of the springs does not exceed; without springs
/// likewise the length of the sides of membranes as they lie, and 0 without these.
pub(crate) fn spacing(network: &Network) -> f64 {
    let lengths = network.springs.iter().inspect(|_| interrupt::point()).map(|spring| spring.rest_length);
    let mut lengths: Vec<f64> = lengths.collect();
    if lengths.is_empty() {
        let ends = network.membrane_sides().map(|side| side.map(|particle| network.x[particle as usize]));
        lengths.extend(ends.map(|[p, q]| length(minus(q, p))));
    }
    let tenth = lengths.len() / 10;
    if lengths.is_empty() { 0.0 } else { *lengths.select_nth_unstable_by(tenth, f64::total_cmp).1 }
}

/// What is odd but defined; `spacing` is that of the network.
pub(crate) fn warnings<R: Real>(network: &Network, spacing: f64) -> Vec<String> {
    let mut warnings = Vec::new();
    let mut note = |count: usize, what: &str, meaning: &str| {
        if count > 0 {
            warnings.push(format!("{count} {what}: {meaning}"));
        }
    };

    let springs = &network.springs;
    let mut joined = vec![false; network.x.len()];
    let of_elements = network.elements.iter().flat_map(|list| list.particles.iter().copied());
    springs.iter().flat_map(|s| s.particles).chain(of_elements).for_each(|p| joined[p as usize] = true);
    let isolated = joined.iter().filter(|j| !**j).count();
    if !springs.is_empty() {
        note(isolated, "particles without springs", "they move by gravity and drag alone");
    }

    let selfish = springs.iter().filter(|s| s.particles[0] == s.particles[1]).count();
    note(selfish, "springs join a particle to itself", "they are left out");

    let zero = springs.iter().filter(|s| s.rest_length == 0.0 && s.particles[0] != s.particles[1]).count();
    note(
        zero,
        "springs have rest length 0",
        "they pull with f = -k d, and have no direction while their ends coincide",
    );

    let pairs = springs.iter().map(|s| s.particles).map(|[a, b]| (a.min(b), a.max(b)));
    let repeated = sorted(pairs, network.x.len()).windows(2).filter(|w| w[0] == w[1]).count();
    note(repeated, "springs join a pair that another spring joins", "each acts");
    warnings.extend(coarse_numbers::<R>(network, spacing));
    warnings
}

/// Says so where the numbers that positions are kept in lie too far apart for the springs.
fn coarse_numbers<R: Real>(network: &Network, spacing: f64) -> Option<String> {
    let far = network.x.iter().flatten().fold(0.0, |far, c| f64::max(far, c.abs()));
    let apart = far * 2.0 * R::ROUNDING;
    (apart > FINEST * spacing && spacing > 0.0).then(|| {
        let precision = R::PRECISION;
        format!(
            "positions reach {far:.3e} m from the origin, where numbers of {precision} are {apart:.1e} m apart, {:.1e} of the \
             distance between neighbours: move the scene to the origin{}",
            apart / spacing,
            if precision == Precision::F32 { ", or compute in f64" } else { "" },
        )
    })
}

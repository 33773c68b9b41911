//! Sizes and densities of cloth that look as if they were meant in other units.

use nappe_sim::{
    math::{
        array::{length, minus},
        four_digits,
    },
    mesh::TriangleMesh,
};

use crate::body::Mass;

/// Diagonal (m) of the box around a cloth above which it is asked about.
const LARGE: f64 = 1e3;
/// Density (kg/m²) from which on it is asked about.
const DENSE: f64 = 1e3;

/// Questions about the size of a body's mesh as it stands in the world, and about its density.
pub(super) fn questions(mesh: &TriangleMesh, mass: Option<Mass>) -> Vec<String> {
    let mut questions = Vec::new();
    let diagonal = diagonal(&mesh.points);
    if diagonal > LARGE {
        questions.push(format!(
            "the box around it has a diagonal of {} m: is it meant to be so large? Lengths are metres: \
             transform.scale = 0.001 reads millimetres",
            four_digits(diagonal)
        ));
    }
    if let Some(Mass::Density(density)) = mass
        && density >= DENSE
    {
        questions.push(format!(
            "its density is {density} kg/m^2: is it meant to be so heavy? Densities are kilograms per square metre: \
             cloths have 0.05 to 1"
        ));
    }
    questions
}

/// Diagonal (m) of the box around points; 0 without points.
fn diagonal(points: &[[f64; 3]]) -> f64 {
    let Some(&start) = points.first() else { return 0.0 };
    let [low, high] = points.iter().fold([start; 2], |[low, high], p| {
        [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))]
    });
    length(minus(high, low))
}

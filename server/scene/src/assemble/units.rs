//! Sizes and densities of cloth, and sizes of solids, that look as if meant in other units.

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
/// Shortest edge (m) of the box around a solid mesh from which on it is asked about: a ground is thin, however wide it is.
const THICK: f64 = 100.0;
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

/// A question about the size of a solid mesh as it stands in the world, which encloses so much (m³).
pub(super) fn question_of_solid(points: &[[f64; 3]], volume: f64) -> Option<String> {
    let edges = edges(points);
    let [x, y, z] = edges.map(four_digits);
    edges.iter().all(|edge| *edge >= THICK).then(|| {
        format!(
            "the box around it is {x} by {y} by {z} m, and its volume {} m^3: is it meant to be so large? Lengths are metres: \
             transform.scale = 0.001 reads millimetres",
            four_digits(volume)
        )
    })
}

/// Diagonal (m) of the box around points; 0 without points.
fn diagonal(points: &[[f64; 3]]) -> f64 {
    length(edges(points))
}

/// Edges (m) of the box around points; 0 without points.
fn edges(points: &[[f64; 3]]) -> [f64; 3] {
    let Some(&start) = points.first() else { return [0.0; 3] };
    let [low, high] = points.iter().fold([start; 2], |[low, high], p| {
        [[0, 1, 2].map(|c| low[c].min(p[c])), [0, 1, 2].map(|c| high[c].max(p[c]))]
    });
    minus(high, low)
}

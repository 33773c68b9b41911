//! Parts of a surface that touch each other: nothing can be kept apart that has no direction to be pushed along.

use super::{
    PairKind,
    distance::closest,
    faces::Faces,
    tree::{Candidate, Tree, Wanted},
};
use crate::{
    interrupt::{Interrupt, Interrupted},
    math::Vec3,
};

/// Roundings of places below which no distance is known.
const ROUNDINGS: f64 = 64.0;

/// A particle of each part of the first pair that shares none and touches, in the order of candidates: no nearer to each other than rounding tells
/// apart. `x` gives the place (m, finite) of a particle; `counts` says of the four particles of a pair whether it is looked at.
///
/// # Errors
/// When the search is given up.
pub fn touching(
    faces: &Faces,
    x: &(dyn Fn(u32) -> Vec3<f64> + Sync),
    counts: &(dyn Fn(&[u32]) -> bool + Sync),
    interrupt: &Interrupt,
) -> Result<Option<[u32; 2]>, Interrupted> {
    let spare = |corners: &[u32]| {
        let largest = corners.iter().map(|corner| x(*corner).amax()).fold(0.0, f64::max);
        ROUNDINGS * f64::EPSILON * largest
    };
    let around = |corners: &[u32]| {
        let spare = spare(corners);
        let mut bounds = [[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]];
        for corner in corners {
            let place = x(*corner);
            for c in 0..3 {
                bounds[0][c] = bounds[0][c].min(place[c] - spare);
                bounds[1][c] = bounds[1][c].max(place[c] + spare);
            }
        }
        bounds
    };
    let touches = |kind: PairKind, corners: [u32; 4]| {
        counts(&corners) && closest(kind, corners.map(x)).difference.norm() <= spare(&corners)
    };
    let mut tree = Tree::new(faces.triangles().len());
    tree.refit(&|face| around(&faces.triangles()[face]));
    let wanted = Wanted { without: &|_| &[], is_wanted: &touches };
    let first = tree.first_candidate(faces, &wanted, &around, interrupt)?;
    Ok(first.map(|Candidate { corners: [first, .., last], .. }| [first, last]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// What touches of two triangles side by side along x = 1, of which the second one is so far (m) away, without a particle.
    fn beside(gap: f64, without: u32) -> Option<[u32; 2]> {
        let places = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0 + gap, 0.3], [2.0, 0.0], [2.0, 1.0]];
        let faces = Faces::new(&[[0, 1, 2], [3, 4, 5]], places.len());
        let x = |particle: u32| {
            let [x, y] = places[particle as usize];
            Vec3::new(x, y, 0.5)
        };
        let counts = |particles: &[u32]| !particles.contains(&without);
        touching(&faces, &x, &counts, &Interrupt::default()).expect("nobody gives it up")
    }

    #[test]
    fn a_corner_on_an_edge_touches_and_one_a_nanometre_away_does_not() {
        // The corner and the triangle that it lies on come first.
        assert_eq!(beside(0.0, u32::MAX), Some([3, 2]));
        assert_eq!((beside(1e-9, u32::MAX), beside(0.1, u32::MAX)), (None, None));
        // All that touches has the corner on the edge.
        assert_eq!(beside(0.0, 3), None);
        // Corners of one triangle touch each other, and are one part.
        let faces = Faces::new(&[[0, 1, 2], [2, 1, 3]], 4);
        let corner = |particle: u32| Vec3::new(f64::from(particle & 1), f64::from(particle >> 1), 0.0);
        assert_eq!(touching(&faces, &corner, &|_| true, &Interrupt::default()), Ok(None));
    }
}

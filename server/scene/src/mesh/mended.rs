//! A mesh from outside as the surface of one solid: triangles that are there twice are left out, holes are filled where
//! that is asked for, and triangles are turned outwards.
//!
//! Reads a mesh; gives points and triangles with what was done, or why it encloses no solid.

use nappe_sim::{interrupt, mesh::TriangleMesh};

use super::{
    closed::{Closed, NotClosed, Numbered, whole_triangles},
    holes::{Holes, fill_holes},
};

/// Volume of a part that rounding may leave of a flat one, over the cube of the diagonal of its box.
const FLAT: f64 = 1e-12;

/// A closed surface, and what was done for it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mended {
    /// Points and triangles, turned outwards.
    pub(crate) surface: TriangleMesh,
    /// Volume (m³), above 0.
    pub(crate) volume: f64,
    /// Triangles that were left out because an earlier one has their points, whichever way round: how many, and the first.
    pub(crate) repeated: Option<(usize, u32)>,
    /// Holes that were filled.
    pub(crate) holes: usize,
}

/// The surface of the solid that a mesh encloses. Points with the same coordinates count as one.
pub(crate) fn mend(mesh: &TriangleMesh, holes: Holes) -> Result<Mended, NotClosed> {
    let mut kept = whole_triangles(mesh);
    let repeated = leave_out_repeated(&mut kept);
    let next = mesh.triangles.len() as u32;
    let holes = match holes {
        Holes::Refused => 0,
        Holes::Filled => fill_holes(&mut kept, next, &mesh.points)?,
    };
    let closed = Closed::of(&mesh.points, kept)?;
    if let Some(part) = closed.parts.iter().find(|part| part.volume.abs() <= FLAT * cube(part.bounds)) {
        return Err(NotClosed::FlatPart { triangle: part.first });
    }

    let Closed { points, mut triangles, volume, is_inside_out, .. } = closed;
    if is_inside_out {
        for corners in &mut triangles {
            corners.swap(1, 2);
        }
    }
    let mut surface = TriangleMesh { points, triangles, ..TriangleMesh::default() };
    surface.drop_unused();
    Ok(Mended { surface, volume, repeated, holes })
}

/// The cube of a box's diagonal (m³).
fn cube([low, high]: [[f64; 3]; 2]) -> f64 {
    let square: f64 = (0..3).map(|c| (high[c] - low[c]) * (high[c] - low[c])).sum();
    square * square.sqrt()
}

/// Leaves out triangles whose three points an earlier one has; the others keep their order.
fn leave_out_repeated(triangles: &mut Vec<Numbered>) -> Option<(usize, u32)> {
    let key = |place: u32| {
        let mut corners = triangles[place as usize].1;
        corners.sort_unstable();
        corners
    };
    let mut places: Vec<u32> = (0..triangles.len() as u32).collect();
    interrupt::point();
    places.sort_unstable_by_key(|place| (key(*place), *place));
    interrupt::point();
    let mut is_kept = vec![true; triangles.len()];
    for same in places.chunk_by(|a, b| key(*a) == key(*b)) {
        same[1..].iter().for_each(|place| is_kept[*place as usize] = false);
    }
    let first = is_kept.iter().position(|kept| !kept)?;
    let found = (is_kept.iter().filter(|kept| !**kept).count(), triangles[first].0);
    let mut kept = is_kept.into_iter();
    triangles.retain(|_| kept.next().is_some_and(|kept| kept));
    Some(found)
}

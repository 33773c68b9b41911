//! A mesh from outside as the surface of one solid: triangles that are there twice are left out, holes are filled where
//! that is asked for, and parts that are turned the wrong way are turned round.
//!
//! Reads a mesh; gives points and triangles with what was done, or why it encloses no solid.

use nappe_sim::{
    collide::shape::{Shell, Shells},
    interrupt,
    mesh::TriangleMesh,
};

use super::{
    closed::{Closed, NotClosed, Numbered, check_closed, whole_triangles, whole_triangles_of_pieces},
    holes::{Holes, fill_holes},
};

/// Volume of a part that rounding may leave of a flat one, over the cube of the diagonal of its box.
const FLAT: f64 = 1e-12;

/// A closed surface, and what was done for it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Mended {
    /// Points and triangles, turned outwards.
    pub(crate) surface: TriangleMesh,
    /// The same with its parts.
    pub(crate) closed: Closed,
    /// The number of each triangle in the file; those that fill holes have numbers after these.
    pub(crate) numbers: Vec<u32>,
    /// Parts that are holes in others.
    pub(crate) hollows: usize,
    /// The first triangles of the parts that were turned round; none where all of them were.
    pub(crate) turned: Vec<u32>,
    /// Triangles that were left out because an earlier one has their points, whichever way round: how many, and the first.
    pub(crate) repeated: Option<(usize, u32)>,
    /// Holes that were filled.
    pub(crate) holes: usize,
}

/// The surface of the solid that a mesh encloses. Points with the same coordinates count as one.
pub(crate) fn mend(mesh: &TriangleMesh, holes: Holes) -> Result<Mended, NotClosed> {
    match mend_triangles(mesh, holes, whole_triangles(mesh)) {
        // Parts that touch in an edge or a face, each with points of its own, are closed one by one.
        Err(error @ NotClosed::Edge { triangles: 3.., .. }) => {
            mend_triangles(mesh, holes, whole_triangles_of_pieces(mesh)).map_err(|_again| error)
        }
        mended => mended,
    }
}

/// The same of triangles whose corners are the first of the points that count as one.
fn mend_triangles(mesh: &TriangleMesh, holes: Holes, mut kept: Vec<Numbered>) -> Result<Mended, NotClosed> {
    let repeated = leave_out_repeated(&mut kept);
    let next = mesh.triangles.len() as u32;
    let holes = match holes {
        Holes::Refused => 0,
        Holes::Filled => fill_holes(&mut kept, next, &mesh.points)?,
    };
    let shells = turn_round(&mesh.points, &mut kept)?;
    let numbers = kept.iter().map(|(number, _)| *number).collect();
    let closed = Closed::of(&mesh.points, kept)?;
    if let Some(part) = closed.parts.iter().find(|part| part.volume.abs() <= FLAT * cube(part.bounds)) {
        return Err(NotClosed::FlatPart { triangle: part.first });
    }

    let hollows = shells.iter().filter(|shell| shell.hole_in.is_some()).count();
    let is_turned_as_a_whole = shells.iter().all(|shell| shell.is_turned);
    let turned =
        closed.parts.iter().zip(&shells).filter(|(_, shell)| shell.is_turned && !is_turned_as_a_whole);
    let turned = turned.map(|(part, _)| part.first).collect();
    let (points, triangles) = (closed.points.clone(), closed.triangles.clone());
    let mut surface = TriangleMesh { points, triangles, ..TriangleMesh::default() };
    surface.drop_unused();
    Ok(Mended { surface, closed, numbers, hollows, turned, repeated, holes })
}

/// Turns parts round that are turned the wrong way: solids outwards, holes in them inwards. Gives the parts as they were. Those
/// that are no surface are left out.
fn turn_round(points: &[[f64; 3]], kept: &mut Vec<Numbered>) -> Result<Vec<Shell>, NotClosed> {
    check_closed(kept, points)?;
    let triangles: Vec<[u32; 3]> = kept.iter().map(|(_, corners)| *corners).collect();
    let Shells { of_triangle, mut list } = Shells::new(points, &triangles).map_err(NotClosed::Crowded)?;
    for ((_, corners), shell) in kept.iter_mut().zip(&of_triangle) {
        if list[*shell as usize].is_turned {
            corners.swap(1, 2);
        }
    }
    if list.iter().any(|shell| shell.is_inner) {
        let mut shells = of_triangle.iter();
        kept.retain(|_| shells.next().is_some_and(|shell| !list[*shell as usize].is_inner));
        list.retain(|shell| !shell.is_inner);
    }
    Ok(list)
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

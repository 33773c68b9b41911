//! Points that lie nearer to each other than a distance become one, the first of them.
//!
//! Enters: a mesh. Leaves: the same with fewer points, and how many are gone. Points are filed in cells so small that all of a
//! cell are one; of two cells near each other a single pair that is near enough joins all. Points may be joined over others.

use super::{
    MeshError, TriangleMesh, corners::is_degenerate, groups::Groups, kept::keep, slivers::median_edge,
};
use crate::{
    interrupt,
    math::array::{length, minus},
};

/// Edge of a cell, in distances: its diagonal is below 1, and what lies within 1 is at most two cells away.
const CELL: f64 = 0.55;
/// Least distance, in the largest coordinate: cells are numbered exactly.
const LEAST: f64 = 1e-12;
/// Largest distance, in the median edge: what is drawn stays.
const MOST: f64 = 0.1;
/// Pairs that are compared for each point, at most, and those that may be compared besides.
const PAIRS_PER_POINT: usize = 64;
const FREE_PAIRS: usize = 1 << 20;

/// Rows of cells, along the last axis, that may hold a cell near to one and after it: their steps along the others.
const ROWS: [[i64; 2]; 13] = [
    [0, 0],
    [0, 1],
    [0, 2],
    [1, -2],
    [1, -1],
    [1, 0],
    [1, 1],
    [1, 2],
    [2, -2],
    [2, -1],
    [2, 0],
    [2, 1],
    [2, 2],
];

/// What welding did.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Welded {
    /// Points that are gone, because each became one with an earlier point.
    pub joined: usize,
    /// Triangles that are gone, because two of their points became one.
    pub dropped: usize,
}

/// A point, filed under its cell.
type Filed = ([i64; 3], u32);

impl TriangleMesh {
    /// Makes one of points that are nearer to each other than `distance` (m), also where only others between them are: the
    /// first by index stays, with its place and its texture coordinates. Masses add up; a mass of 0 stays 0. A spring between two
    /// of them is gone.
    ///
    /// # Errors
    /// A distance that is too small for the coordinates or above a tenth of the median edge, and points that are too many to
    /// be compared. The mesh is then as it was.
    ///
    /// # Panics
    /// On a mesh that [`TriangleMesh::validate`] refuses.
    pub fn weld(&mut self, distance: f64) -> Result<Welded, MeshError> {
        let far = self.points.iter().flatten().fold(0.0, |far, c| f64::max(far, c.abs()));
        let least = LEAST * far;
        let most = median_edge(&self.points, &self.triangles).map_or(f64::INFINITY, |median| MOST * median);
        if !(least..=most).contains(&distance) || distance <= 0.0 {
            return Err(MeshError::WeldRange { distance, least, most });
        }
        let firsts = firsts(&self.points, distance).ok_or(MeshError::WeldTooDense { distance })?;

        for point in 0..self.masses.len() {
            let first = firsts[point] as usize;
            if first != point {
                let [sum, own] = [first, point].map(|i| self.masses[i]);
                self.masses[first] = if sum == 0.0 || own == 0.0 { 0.0 } else { sum + own };
            }
        }

        let (points, triangles) = (self.points.len(), self.triangles.len());
        self.triangles.retain_mut(|corners| {
            let was_degenerate = is_degenerate(corners);
            *corners = corners.map(|point| firsts[point as usize]);
            was_degenerate || !is_degenerate(corners)
        });
        self.springs.retain_mut(|spring| {
            spring.points = spring.points.map(|point| firsts[point as usize]);
            spring.points[0] != spring.points[1]
        });
        let is_kept: Vec<bool> = (0u32..).zip(&firsts).map(|(point, first)| point == *first).collect();
        keep(self, &is_kept);
        Ok(Welded { joined: points - self.points.len(), dropped: triangles - self.triangles.len() })
    }
}

/// For each point the first of those with which it becomes one; none: there are too many to be compared.
fn firsts(points: &[[f64; 3]], distance: f64) -> Option<Vec<u32>> {
    let edge = CELL * distance;
    let file = |(index, point): (u32, &[f64; 3])| {
        interrupt::point();
        (point.map(|c| (c / edge).floor() as i64), index)
    };
    let mut filed: Vec<Filed> = (0u32..).zip(points).map(file).collect();
    filed.sort_unstable();
    let cells: Vec<&[Filed]> = filed.chunk_by(|a, b| a.0 == b.0).collect();

    let mut groups = Groups::new(points.len());
    for cell in &cells {
        cell[1..].iter().for_each(|other| groups.join([cell[0].1, other.1]));
    }

    let mut left = FREE_PAIRS + PAIRS_PER_POINT * points.len();
    // Of each row the first cell that may be near: cells are in order, and so these only move on.
    let mut starts = [0; ROWS.len()];
    for own in &cells {
        interrupt::point();
        let [x, y, z] = own[0].0;
        for (start, [dx, dy]) in starts.iter_mut().zip(ROWS) {
            let [low, high] = [z - 2, z + 2].map(|z| [x + dx, y + dy, z]);
            *start += cells[*start..].iter().take_while(|cell| cell[0].0 < low).count();
            let row = cells[*start..].iter().take_while(|cell| cell[0].0 <= high);
            for other in row.filter(|cell| cell[0].0 > own[0].0) {
                let ends = [own[0].1, other[0].1];
                if groups.first(ends[0]) != groups.first(ends[1])
                    && has_near_pair(points, [*own, *other], distance, &mut left)?
                {
                    groups.join(ends);
                }
            }
        }
    }
    Some((0..points.len() as u32).map(|point| groups.first(point)).collect())
}

/// Whether a point of one cell and a point of another are nearer than `distance` (m); none: no comparisons are left.
fn has_near_pair(
    points: &[[f64; 3]],
    [own, other]: [&[Filed]; 2],
    distance: f64,
    left: &mut usize,
) -> Option<bool> {
    for (_, a) in own {
        interrupt::point();
        for (_, b) in other {
            *left = left.checked_sub(1)?;
            if length(minus(points[*a as usize], points[*b as usize])) < distance {
                return Some(true);
            }
        }
    }
    Some(false)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::mesh::{MeshSpring, SpringKind};

    fn spring(points: [u32; 2]) -> MeshSpring {
        MeshSpring { points, kind: SpringKind::Stretch, stiffness: 1.0, damping: 0.0, rest_length: None }
    }

    fn on_a_line(places: &[f64]) -> TriangleMesh {
        let points = places.iter().map(|x| [*x, 0.0, 0.0]).collect();
        TriangleMesh { points, ..TriangleMesh::default() }
    }

    #[test]
    fn a_flat_shaded_square_becomes_one_part_of_four_points() {
        let mut mesh = TriangleMesh {
            points: vec![
                [0.0; 3],
                [1.0, 0.0, 0.0],
                [1.0, 1.0, 0.0],
                [0.0; 3],
                [1.0, 1.0, 0.0],
                [0.0, 1.0, 0.0],
            ],
            triangles: vec![[0, 1, 2], [3, 4, 5]],
            masses: vec![1.0, 2.0, 0.0, 4.0, 5.0, 6.0],
            uv: (0..6).map(|i| [f64::from(i), 0.5]).collect(),
            springs: [[2, 3], [0, 3], [4, 5]].map(spring).to_vec(),
            ..TriangleMesh::default()
        };
        assert_eq!(mesh.weld(1e-6), Ok(Welded { joined: 2, dropped: 0 }));
        assert_eq!(mesh.triangles, [[0, 1, 2], [0, 2, 3]]);
        assert_eq!(mesh.points, [[0.0; 3], [1.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 1.0, 0.0]]);
        assert_eq!(mesh.masses, [5.0, 2.0, 0.0, 6.0]);
        assert_eq!(mesh.uv.iter().map(|uv| uv[0]).collect::<Vec<_>>(), [0.0, 1.0, 2.0, 5.0]);
        assert_eq!(mesh.edges().len(), 5);
        assert_eq!(mesh.springs, [[2, 0], [2, 3]].map(spring), "one of them joined a point to itself");
    }

    #[test]
    fn points_are_joined_over_others_between_them() {
        let mut chain = on_a_line(&[5.0, 3.2, 4.4, 3.8, 9.0, 9.0]);
        chain.masses = vec![1.0, 2.0, 3.0, 4.0, 0.0, 6.0];
        assert_eq!(chain.weld(0.7), Ok(Welded { joined: 4, dropped: 0 }));
        assert_eq!(chain.points, [[5.0, 0.0, 0.0], [9.0, 0.0, 0.0]]);
        assert_eq!(chain.masses, [10.0, 0.0]);
        // As far apart as the distance is not nearer than it.
        assert_eq!(on_a_line(&[0.0, 0.5, 1.0]).weld(0.5), Ok(Welded { joined: 0, dropped: 0 }));
    }

    #[test]
    fn cells_join_what_comparing_all_pairs_joins() {
        let mut state = 1_u32;
        let mut next = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1_u32 << 24)
        };
        for place in [0.0, 1e4, -3e6] {
            let points: Vec<[f64; 3]> = (0..300).map(|_| [next() + place, next() - place, next()]).collect();
            for distance in [0.02, 0.06, 0.1, 0.3] {
                let mut expected = Groups::new(points.len());
                for (a, b) in (0..300_u32).flat_map(|a| (0..a).map(move |b| (a, b))) {
                    if length(minus(points[a as usize], points[b as usize])) < distance {
                        expected.join([a, b]);
                    }
                }
                let expected: Vec<u32> = (0..300).map(|point| expected.first(point)).collect();
                assert_eq!(firsts(&points, distance), Some(expected), "{place} {distance}");
            }
        }
    }

    #[test]
    fn a_distance_must_fit_the_mesh_and_what_it_flattens_goes() {
        let mut sheet = TriangleMesh::grid(4, 3, 0.1);
        let before = sheet.clone();
        for distance in [0.0, -1.0, 1e-15, 0.02, f64::NAN, f64::INFINITY] {
            assert!(matches!(sheet.weld(distance), Err(MeshError::WeldRange { .. })), "{distance}");
        }
        assert_eq!(sheet, before);
        sheet.points[5] = [0.2 - 1e-4, 0.0, 0.1];
        // Points 5 and 6 become one, and two triangles have both.
        assert_eq!(sheet.weld(1e-3), Ok(Welded { joined: 1, dropped: 2 }));
        assert_eq!((sheet.points.len(), sheet.triangles.len()), (11, 10));
        assert_eq!(sheet.check().map(|odd| odd.len()), Ok(0));
    }

    #[test]
    fn too_many_points_near_each_other_are_refused() {
        // Two heaps one distance apart: no pair is near enough, and each heap is a cell.
        let heap = |x: f64| (0..20_000).map(move |i| [x, f64::from(i) * 1e-9, 0.0]);
        let points: Vec<[f64; 3]> = heap(0.0).chain(heap(1.0)).collect();
        assert_eq!(firsts(&points, 1.0), None);
    }
}

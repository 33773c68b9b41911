//! Triangles of polygons against the area of the shoelace formula, and what is told of polygons.

use std::collections::BTreeSet;

use nappe_sim::math::array::{cross, dot, length, minus};

use super::shapes::{Random, SHAPES};
use crate::mesh::{
    polygon::{Placed, Polygons},
    read_obj,
};

/// Twice the area, with its direction.
fn twice_area(points: &[[f64; 3]], [a, b, c]: [u32; 3]) -> [f64; 3] {
    let [a, b, c] = [a, b, c].map(|corner| points[corner as usize]);
    cross(minus(b, a), minus(c, a))
}

fn area(points: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    triangles.iter().map(|triangle| 0.5 * length(twice_area(points, *triangle))).sum()
}

/// The shoelace formula.
fn shoelace(polygon: &[[f64; 2]]) -> f64 {
    let next = polygon.iter().cycle().skip(1);
    let sum: f64 = polygon.iter().zip(next).map(|([x, y], [to_x, to_y])| x * to_y - to_x * y).sum();
    0.5 * sum
}

/// Two directions at a right angle, of length 1.
fn plane(random: &mut Random) -> [[f64; 3]; 2] {
    loop {
        let [u, v] = [(); 2].map(|()| [(); 3].map(|()| 2.0 * random.unit() - 1.0));
        let normal = cross(u, v);
        if length(normal) > 0.1 && length(u) > 0.1 {
            let [u, v] = [u, cross(normal, u)];
            return [u, v].map(|axis| axis.map(|c| c / length(axis)));
        }
    }
}

fn cut(points: &[[f64; 3]], corners: &[u32]) -> (Vec<[u32; 3]>, Vec<String>) {
    let (mut polygons, mut triangles) = (Polygons::new(), Vec::new());
    polygons.cut(points, corners, 7, &mut triangles);
    (triangles, polygons.warnings("a.ply", Placed::Faces))
}

#[test]
fn a_thousand_simple_polygons_keep_their_area_their_corners_and_the_way_they_turn() {
    let mut random = Random(0x9e37_79b9_7f4a_7c15);
    for round in 0..1000 {
        let shape = round % SHAPES.len();
        let count = random.between(3, 40);
        let mut polygon = SHAPES[shape](&mut random, count);
        if (round / SHAPES.len()).is_multiple_of(2) {
            polygon.reverse();
        }
        let start = random.between(0, polygon.len() - 1);
        polygon.rotate_left(start);

        let scale = 10_f64.powi(random.between(0, 6) as i32 - 3);
        let [u, v] = plane(&mut random);
        let origin = [(); 3].map(|()| scale * random.unit());
        let in_space = |[x, y]: [f64; 2]| [0, 1, 2].map(|c| origin[c] + scale * (x * u[c] + y * v[c]));
        // Corners at one place are one point, as where the way to a hole goes to and fro.
        let index = |corner: [f64; 2]| {
            polygon.iter().position(|other| *other == corner).expect("it is a corner") as u32
        };
        let points: Vec<[f64; 3]> = polygon.iter().copied().map(in_space).collect();
        let corners: Vec<u32> = polygon.iter().copied().map(index).collect();

        let (triangles, warnings) = cut(&points, &corners);
        let story = format!("round {round}: shape {shape}, {count}: {points:?} {triangles:?}");
        assert!(warnings.is_empty(), "{warnings:?} {story}");
        assert_eq!(triangles.len(), corners.len() - 2, "{story}");
        let wanted = shoelace(&polygon) * scale * scale;
        assert!((area(&points, &triangles) - wanted.abs()).abs() <= 1e-12 * wanted.abs(), "{story}");

        let normal = cross(u, v).map(|c| c * wanted.signum());
        assert!(
            triangles.iter().all(|triangle| dot(normal, twice_area(&points, *triangle)) > 0.0),
            "{story}"
        );
        let used: BTreeSet<u32> = triangles.iter().flatten().copied().collect();
        assert_eq!(used, corners.into_iter().collect::<BTreeSet<u32>>(), "{story}");
    }
}

#[test]
fn a_concave_polygon_has_its_own_area_from_every_corner() {
    let concave = b"v 0 0 0\nv 4 0 0\nv 4 4 0\nv 2 1 0\nv 0 4 0\nf 3 4 5 1 2\n";
    let text = std::str::from_utf8(concave).expect("it is ASCII");
    let vertices = &text[..text.find('f').expect("a face")];
    for start in 0..5 {
        let mut corners = [1, 2, 3, 4, 5];
        corners.rotate_left(start);
        for up in [1.0, -1.0] {
            let [a, b, c, d, e] = corners;
            let loaded = read_obj(&format!("{vertices}f {a} {b} {c} {d} {e}\n"), "a.obj").expect("a mesh");
            let mesh = loaded.mesh;
            assert_eq!((area(&mesh.points, &mesh.triangles), mesh.triangles.len()), (10.0, 3), "{corners:?}");
            assert!(mesh.triangles.iter().all(|t| up * twice_area(&mesh.points, *t)[2] > 0.0), "{corners:?}");
            assert!(loaded.warnings.is_empty());
            corners.reverse();
        }
    }
    let mesh = read_obj(text, "concave.obj").expect("a mesh").mesh;
    assert_eq!(area(&mesh.points, &mesh.triangles), 10.0);
}

#[test]
fn a_convex_polygon_is_a_fan_from_its_first_corner_and_a_dart_from_one_that_covers_it() {
    let points = [[0.0, 0.0, 0.0], [2.0, 1.0, 0.0], [0.0, 2.0, 0.0], [0.5, 1.0, 0.0], [-1.0, 1.0, 0.0]];
    assert_eq!(cut(&points, &[0, 1, 2, 4]).0, [[0, 1, 2], [0, 2, 4]]);
    assert_eq!(cut(&points, &[4, 2, 1, 0]).0, [[4, 2, 1], [4, 1, 0]]);
    // Only from the concave corner, 3, and from the one opposite does a fan cover the dart 0 1 2 3.
    for corners in [[0, 1, 2, 3], [1, 2, 3, 0], [2, 3, 0, 1], [3, 0, 1, 2]] {
        let (triangles, warnings) = cut(&points, &corners);
        assert_eq!((area(&points, &triangles), triangles.len()), (1.5, 2), "{corners:?} {triangles:?}");
        assert!(triangles.iter().all(|triangle| triangle.contains(&1) && triangle.contains(&3)));
        assert!(warnings.is_empty());
    }
}

#[test]
fn two_corners_at_one_place_are_both_in_a_triangle() {
    let points = [
        [0.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 0.0, 0.0],
        [4.0, 4.0, 0.0],
        [2.0, 1.0, 0.0],
        [0.0, 4.0, 0.0],
    ];
    for start in 0..6 {
        let mut corners = [0, 1, 2, 3, 4, 5];
        corners.rotate_left(start);
        let (triangles, warnings) = cut(&points, &corners);
        assert_eq!((area(&points, &triangles), triangles.len()), (10.0, 4), "{triangles:?}");
        assert!((0..6).all(|corner| triangles.iter().flatten().any(|other| *other == corner)));
        assert!(warnings.is_empty(), "{warnings:?}");
    }
}

const FANNED: &str = "each becomes a fan of triangles from its first corner, which may overlap; cut them into \
                      triangles in the program that made the file";

/// Points and corners of a polygon, its triangles, and what is told.
type Case<'a> = ([[f64; 3]; 5], &'a [u32], &'a [[u32; 3]], Vec<String>);

#[test]
fn what_is_odd_about_a_polygon_is_told_with_its_face() {
    let points = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.2], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]];
    let flat = [[0.0, 0.0, 0.0], [2.0, 0.0, 0.0], [2.0, 2.0, 0.0], [0.0, 2.0, 0.0], [1.0, 0.0, 0.0]];
    let few = "faces of two corners or fewer (1, the first here): they give no triangle".to_owned();
    let repeated =
        "polygons that name a corner twice in a row (1, the first here): it is taken once".to_owned();
    let fanned = format!("polygons that cross themselves or have no area (1, the first here): {FANNED}");
    let bent =
        "polygons that are not flat (1, the first here): a corner is off the mean plane by more than 1 % of \
                the polygon's size, and other triangles of the same corners have another shape"
            .to_owned();
    let cases: [Case<'_>; 10] = [
        (points, &[0, 1, 2, 3], &[[0, 1, 2], [0, 2, 3]], vec![bent]),
        (flat, &[0, 1, 3, 2], &[[0, 1, 3], [0, 3, 2]], vec![fanned.clone()]),
        (flat, &[0, 1, 4, 0, 4], &[[0, 1, 4], [0, 4, 0], [0, 0, 4]], vec![fanned.clone()]),
        (flat, &[0, 4, 1, 4], &[[0, 4, 1], [0, 1, 4]], vec![fanned]),
        (flat, &[], &[], vec![few.clone()]),
        (flat, &[0], &[], vec![few.clone()]),
        (flat, &[0, 1], &[], vec![few.clone()]),
        (flat, &[0, 0, 1, 1], &[], vec![repeated.clone(), few]),
        (flat, &[0, 1, 1, 2, 3, 0], &[[0, 1, 2], [0, 2, 3]], vec![repeated]),
        (flat, &[0, 1, 1], &[[0, 1, 1]], Vec::new()),
    ];
    for (points, corners, wanted, told) in cases {
        let (triangles, mut warnings) = cut(&points, corners);
        assert_eq!(triangles, wanted, "{corners:?}");
        let mut told: Vec<_> = told.iter().map(|told| format!("a.ply: face 7: {told}")).collect();
        warnings.sort();
        told.sort();
        assert_eq!(warnings, told, "{corners:?}");
    }
}

#[test]
fn a_polygon_too_large_for_its_ears_is_told() {
    let comb = SHAPES[2](&mut Random(1), 2001);
    let points: Vec<[f64; 3]> = comb.iter().map(|[x, y]| [*x, *y, 0.0]).collect();
    let corners: Vec<u32> = (0..points.len() as u32).collect();
    let (triangles, warnings) = cut(&points, &corners);
    assert_eq!((corners.len(), triangles.len()), (2002, 2000));
    let wanted = format!(
        "a.ply: face 7: polygons that are not convex, of more than 2000 corners (1, the first here): {FANNED}"
    );
    assert_eq!(warnings, [wanted]);
}

#[test]
fn coordinates_beyond_all_measure_give_triangles_and_no_panic() {
    for size in [1e-200, 1e100, 1e200, f64::MAX] {
        let points = [[0.0; 3], [size, 0.0, 0.0], [0.1 * size, 0.1 * size, -size], [0.0, size, -size]];
        assert_eq!(cut(&points, &[0, 1, 2, 3]).0.len(), 2, "{size}");
    }
}

//! The tree against all triangles in turn, distances and sides against other formulas.
#![allow(clippy::disallowed_methods, reason = "meshes and angles of the tests, not of a step")]

use std::f64::consts::TAU;

use super::{
    FirstCrossing, MeshSolid, Near, Parts, SelfCrossings, Surface,
    nearest::Triangles,
    tree::{Leaf, Tree},
};
use crate::{
    collide::shape::sample::Sample,
    math::array::{cross, dot, length, minus},
};

/// A box of 12 triangles.
fn cube(half: [f64; 3]) -> MeshSolid {
    let points = (0..8_u32).map(|i| [0, 1, 2].map(|c| if i >> c & 1 == 1 { half[c] } else { -half[c] }));
    let faces = [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];
    let triangles = faces.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]);
    MeshSolid::new(points.collect(), triangles.collect()).expect("it is closed")
}

/// A surface around the origin whose radius is a function of the direction: a refined octahedron.
fn round(levels: u32, radius: impl Fn([f64; 3]) -> f64) -> MeshSolid {
    let axis = |c: usize, s: f64| [0, 1, 2].map(|k| if k == c { s } else { 0.0 });
    let mut points: Vec<[f64; 3]> = (0..3).flat_map(|c| [axis(c, 1.0), axis(c, -1.0)]).collect();
    let mut triangles = Vec::new();
    for i in 0..8_u32 {
        let [x, y, z] = [i & 1, 2 + (i >> 1 & 1), 4 + (i >> 2 & 1)];
        triangles.push(if i.count_ones() % 2 == 0 { [x, y, z] } else { [x, z, y] });
    }
    for _ in 0..levels {
        let mut between = std::collections::BTreeMap::new();
        let mut finer = Vec::new();
        for [a, b, c] in triangles {
            let mut middle = |a: u32, b: u32| {
                *between.entry((a.min(b), a.max(b))).or_insert_with(|| {
                    let sum = [0, 1, 2].map(|c| points[a as usize][c] + points[b as usize][c]);
                    points.push(sum.map(|c| c / length(sum)));
                    points.len() as u32 - 1
                })
            };
            let [ab, bc, ca] = [middle(a, b), middle(b, c), middle(c, a)];
            finer.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
        triangles = finer;
    }
    let points = points.into_iter().map(|p| p.map(|c| c * radius(p))).collect();
    MeshSolid::new(points, triangles).expect("it is closed")
}

/// A ball with bumps and dents.
fn bumpy(levels: u32) -> MeshSolid {
    round(levels, |[x, y, z]| 1.0 + 0.4 * (3.0 * x).sin() * (2.0 * y + 1.0).cos() + 0.2 * (5.0 * z).sin())
}

/// A prism over a star that is drawn in one line: its walls cross each other, and it goes round its middle twice.
fn star() -> MeshSolid {
    let rim = |z: f64| (0..5_u32).map(move |k| f64::from(k) * TAU / 5.0).map(move |t| [t.cos(), t.sin(), z]);
    let points = rim(-0.4).chain(rim(0.4)).chain([[0.0, 0.0, -0.4], [0.0, 0.0, 0.4]]).collect();
    let walls = [[0, 2], [2, 4], [4, 1], [1, 3], [3, 0]];
    let triangles =
        walls.iter().flat_map(|&[a, b]| [[a, b, b + 5], [a, b + 5, a + 5], [10, b, a], [11, a + 5, b + 5]]);
    MeshSolid::new(points, triangles.collect()).expect("it is closed")
}

fn solids() -> Vec<MeshSolid> {
    vec![cube([0.5, 0.3, 0.7]), MeshSolid::example(), round(3, |_| 1.0), bumpy(4), star()]
}

#[test]
fn crossings_are_counted_where_a_surface_passes_through_itself_and_nowhere_else() {
    for solid in [cube([0.5, 0.3, 0.7]), MeshSolid::example(), round(3, |_| 1.0), bumpy(4), overlapping()] {
        assert_eq!(solid.crossings(), SelfCrossings::default(), "{solid:?}");
    }
    let star = star();
    let found = star.crossings();
    assert_eq!(SelfCrossings::new(star.points(), star.triangles()), Ok(found));
    // Each line of the star crosses two others, with its edge above and that below, and with diagonals of walls.
    assert!(found.count >= 20 && !found.is_cut_off, "{found:?}");
    let FirstCrossing { triangles: [a, b], place } = found.first.expect("there is one");
    assert!(a < b, "{found:?}");
    for t in [a, b] {
        let corners = star.triangles()[t as usize].map(|i| star.points()[i as usize]);
        let off = distance_from(place, corners);
        assert!(off < 1e-14, "{place:?} is {off} m off triangle {t}");
    }
}

/// Points all over a cube about a solid, and near its corners, edges and faces.
fn points(solid: &MeshSolid, count: usize) -> impl Iterator<Item = [f64; 3]> {
    let mut random = 7_u64;
    let mut number = move || {
        random ^= random << 13;
        random ^= random >> 7;
        random ^= random << 17;
        (random >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    };
    let corners: Vec<[[f64; 3]; 3]> =
        solid.triangles().iter().map(|t| t.map(|i| solid.points()[i as usize])).collect();
    (0..count).map(move |i| {
        let away = [1e-1, 1e-4, 1e-8, 1e-13, 0.0][i / 4 % 5];
        let [a, b, c] = corners[i * 7919 % corners.len()];
        let (s, t) = (number().abs(), number().abs());
        let at = |s: f64, t: f64| [0, 1, 2].map(|k| a[k] + s * (b[k] - a[k]) + t * (c[k] - a[k]));
        let on = match i % 4 {
            0 => return [2.0 * number(), 2.0 * number(), 2.0 * number()],
            1 => a,
            2 => at(s, 0.0),
            _ => at(s * (1.0 - t), t),
        };
        on.map(|c| c + away * number())
    })
}

#[test]
fn the_tree_finds_what_looking_at_every_triangle_finds() {
    for solid in solids() {
        let tree = &solid.0.tree;
        for p in points(&solid, 20_000) {
            let mut best = (f64::INFINITY, u32::MAX, Leaf { leaf: 0, lane: 0 });
            for (leaf, triangles) in tree.leaves.iter().enumerate() {
                for (lane, square) in triangles.squares(p).into_iter().enumerate() {
                    if (square, triangles.number[lane]) < (best.0, best.1) {
                        best = (square, triangles.number[lane], Leaf { leaf, lane });
                    }
                }
            }
            let (square, leaf) = tree.nearest(p).expect("a point is given");
            assert_eq!((square.to_bits(), leaf), (best.0.to_bits(), best.2), "{solid:?} at {p:?}");
        }
    }
}

/// Distance (m) of a point from a triangle: over it that of its plane, elsewhere of an edge.
fn distance_from(p: [f64; 3], corners: [[f64; 3]; 3]) -> f64 {
    let normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    let mut nearest = f64::INFINITY;
    let mut is_over = true;
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        let edge = minus(b, a);
        let t = (dot(minus(p, a), edge) / dot(edge, edge)).clamp(0.0, 1.0);
        nearest = nearest.min(length([0, 1, 2].map(|c| p[c] - a[c] - t * edge[c])));
        is_over &= dot(cross(normal, edge), minus(p, a)) >= 0.0;
    }
    if is_over { dot(minus(p, corners[0]), normal).abs() / length(normal) } else { nearest }
}

/// How often a surface goes round a point: the sum of solid angles (Van Oosterom and Strackee 1983).
fn winding(solid: &MeshSolid, p: [f64; 3]) -> f64 {
    let of_one = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| minus(solid.points()[i as usize], p));
        let [la, lb, lc] = [a, b, c].map(length);
        let below = la * lb * lc + dot(a, b) * lc + dot(b, c) * la + dot(c, a) * lb;
        2.0 * dot(a, cross(b, c)).atan2(below)
    };
    solid.triangles().iter().map(of_one).sum::<f64>() / (2.0 * TAU)
}

#[test]
fn distances_and_sides_are_those_of_another_formula() {
    for solid in solids() {
        for p in points(&solid, 2_000) {
            let corners = |t: &[u32; 3]| t.map(|i| solid.points()[i as usize]);
            let nearest =
                solid.triangles().iter().map(|t| distance_from(p, corners(t))).fold(f64::INFINITY, f64::min);
            let (distance, normal) = solid.0.at(p);
            assert!(
                (distance.abs() - nearest).abs() < 1e-14,
                "{solid:?} at {p:?}: {distance}, not {nearest}"
            );
            assert!((length(normal) - 1.0).abs() < 1e-14, "{solid:?} at {p:?}: {normal:?}");
            if nearest > 1e-9 {
                let inside = winding(&solid, p) > 0.5;
                assert_eq!(distance < 0.0, inside, "{solid:?} at {p:?}: {distance}");
            }
        }
    }
}

#[test]
fn what_is_not_a_place_has_no_distance() {
    for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
        let (distance, _) = cube([0.5; 3]).0.at([0.0, bad, 0.0]);
        assert!(!distance.is_finite() || distance > 1e300, "{bad}: {distance}");
    }
}

#[test]
fn surfaces_that_enclose_no_solid_are_refused_with_the_reason() {
    let sound = cube([0.5; 3]);
    let (points, triangles) = (sound.points().to_vec(), sound.triangles().to_vec());
    let refused = |points: &[[f64; 3]], triangles: &[[u32; 3]], named: &str| {
        let reason = MeshSolid::new(points.to_vec(), triangles.to_vec()).expect_err("it is wrong");
        assert!(reason.contains(named), "{reason}");
    };
    refused(&points, &[], "no triangles");
    refused(&points, &triangles[1..], "1 triangles have the edge");
    let turned: Vec<_> = triangles.iter().map(|&[a, b, c]| [a, c, b]).collect();
    refused(&points, &turned, "its volume is -1 m³");
    refused(&points, &[&triangles[..11], &[[4, 6, 7]]].concat(), "opposite directions");
    refused(&points[..7], &triangles, "points 0 to 6");
    refused(&[&points[..7], &[[f64::NAN; 3]]].concat(), &triangles, "point 7");
    refused(&[&points[..7], &[[f64::INFINITY; 3]]].concat(), &triangles, "finite");
}

#[test]
fn a_solid_that_is_sent_is_the_same_one() {
    let solid = bumpy(2);
    let sent = Parts::from(solid.clone());
    let back = MeshSolid::try_from(sent).expect("it was sent");
    assert_eq!(back, solid);
    for p in points(&solid, 500) {
        assert_eq!(back.0.at(p), solid.0.at(p));
    }
    let mut open = Parts::from(solid);
    open.triangles.pop();
    assert!(MeshSolid::try_from(open).is_err(), "an open surface is refused as it comes");
}

/// Copies of a solid, each moved by a way (m), as parts of one.
fn copies(part: &MeshSolid, ways: &[[f64; 3]]) -> MeshSolid {
    let moved =
        ways.iter().flat_map(|&way| part.points().iter().map(move |p| [0, 1, 2].map(|c| p[c] + way[c])));
    let count = part.points().len() as u32;
    let numbered = (0_u32..).take(ways.len()).flat_map(|copy| {
        part.triangles().iter().map(move |corners| corners.map(|corner| corner + copy * count))
    });
    MeshSolid::new(moved.collect(), numbered.collect()).expect("all are closed")
}

/// Two boxes that overlap, each a part.
fn overlapping() -> MeshSolid {
    copies(&cube([0.5, 0.3, 0.7]), &[[0.0; 3], [0.4, 0.2, -0.3]])
}

#[test]
fn what_is_counted_of_a_solid_is_what_its_lists_take() {
    let one = round(3, |_| 1.0);
    for solid in [one.clone(), copies(&one, &[[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0]])] {
        let Surface { points, triangles, normals, tree, union, .. } = &*solid.0;
        let lists = [
            size_of_val(&points[..]),
            size_of_val(&triangles[..]),
            size_of_val(&normals.faces[..]),
            size_of_val(&normals.edges[..]),
            size_of_val(&normals.corners[..]),
            size_of_val(&tree.leaves[..]),
            union.as_ref().map_or(0, |union| size_of_val(&union.of_triangle[..])),
        ];
        let [point_count, count] = [points.len() as u64, triangles.len() as u64];
        // Nodes are as many as it comes; of one part nobody keeps which it is.
        let nodes = (Tree::bytes_per_leaf() - size_of::<Triangles>() as u64) * count / 4;
        let of_parts = if union.is_some() { 0 } else { 4 * count };
        let taken = lists.iter().sum::<usize>() as u64;
        assert_eq!(taken, MeshSolid::bytes(point_count, count) - nodes - of_parts, "{solid:?}");
    }
}

#[test]
fn what_is_known_around_a_place_gives_the_same_bits_or_nothing() {
    let (mut told, mut untold, mut cleared) = (0, 0, 0);
    for solid in solids().into_iter().chain([overlapping()]) {
        for (i, place) in points(&solid, 3_000).enumerate() {
            let (near, nearest) = solid.look(place, 0.3);
            assert_eq!(nearest, solid.0.at(place));
            for (k, away) in [0.0, 1e-9, 1e-3, 1e-2, 0.1].into_iter().enumerate() {
                let way = [i % 7, i % 5, i % 3 + k].map(|c| c as f64 - 2.0);
                let other = [0, 1, 2].map(|c| place[c] + away * way[c]);
                let expected = solid.0.at(other);
                let least = near.at_least(other);
                assert!(least <= expected.0.max(0.0), "{solid:?} at {other:?}: {least}, not {expected:?}");
                cleared += usize::from(least > 0.0);
                match solid.by_near(other, &near) {
                    Some(found) => {
                        told += 1;
                        assert_eq!(found, expected, "{solid:?} at {other:?} from {place:?}");
                    }
                    None => untold += 1,
                }
            }
        }
    }
    assert!(told > 10_000 && untold > 1_000 && cleared > 5_000, "{told} told, {untold} not, {cleared} clear");
    let (near, _) = cube([0.5; 3]).look([f64::NAN; 3], 1.0);
    assert!(cube([0.5; 3]).by_near([f64::NAN; 3], &near).is_none());
    let least = near.at_least([1.0; 3]);
    assert!(least.is_nan() || least < 0.0, "{least}");
    assert!(cube([0.5; 3]).by_near([0.6; 3], &Near::default()).is_none(), "nothing is known");
}

/// A ball of 1 m across: so many strips from pole to pole, and so many pieces of each.
fn ball([around, across]: [u32; 2]) -> MeshSolid {
    let mut points = vec![[0.0, 0.5, 0.0]];
    for ring in 1..across {
        let (out, up) = (0.5 * TAU * f64::from(ring) / f64::from(across)).sin_cos();
        points.extend((0..around).map(|j| {
            let (sin, cos) = (TAU * f64::from(j) / f64::from(around)).sin_cos();
            [0.5 * out * cos, 0.5 * up, 0.5 * out * sin]
        }));
    }
    points.push([0.0, -0.5, 0.0]);
    let at = |ring: u32, j: u32| 1 + ring * around + j % around;
    let (last, pole) = (across - 2, points.len() as u32 - 1);
    let mut triangles = Vec::new();
    for j in 0..around {
        triangles.extend([[0, at(0, j + 1), at(0, j)], [pole, at(last, j), at(last, j + 1)]]);
        for ring in 0..last {
            let [a, b, c, d] = [at(ring, j), at(ring, j + 1), at(ring + 1, j + 1), at(ring + 1, j)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
    }
    MeshSolid::new(points, triangles).expect("it is closed")
}

/// How many nodes and leaves are looked at for the distances of points (m).
fn looks(solid: &MeshSolid, points: &[[f64; 3]]) -> u64 {
    let Surface { tree, union, .. } = &*solid.0;
    let taken = || tree.looks.take() + union.as_ref().map_or(0, |union| union.boxes.looks.take());
    taken();
    for p in points {
        let (distance, _) = solid.0.at(*p);
        assert!(distance.is_finite());
    }
    taken()
}

#[test]
fn a_distance_from_ten_parts_costs_little_more_than_from_one_mesh_of_as_many_triangles() {
    // Balls that overlap by a fifth of their size, in a row.
    let ways: Vec<[f64; 3]> =
        (0..10_u32).map(|i| [0.8 * f64::from(i), 0.0, 0.1 * f64::from(i).sin()]).collect();
    let (parts, one) = (copies(&ball([20, 11]), &ways), ball([40, 51]));
    assert_eq!((parts.triangles().len(), one.triangles().len()), (4_000, 4_000));

    // Up to 6 cm outside of the surface, as where cloth lies on it.
    let (mut near_parts, mut near_one) = (Vec::new(), Vec::new());
    for k in 0..4_000_u32 {
        let (up, angle) = (1.0 - (f64::from(k) + 0.5) / 2_000.0, 2.399_963 * f64::from(k));
        let (out, away) = ((1.0 - up * up).sqrt(), 0.5 + 0.06 * (0.754_877 * f64::from(k)).fract());
        let p = [away * out * angle.cos(), away * up, away * out * angle.sin()];
        let way = ways[k as usize * 7 % ways.len()];
        let of_parts = [0, 1, 2].map(|c| p[c] + way[c]);
        if parts.0.at(of_parts).0 > 0.0 && one.0.at(p).0 > 0.0 {
            near_parts.push(of_parts);
            near_one.push(p);
        }
    }
    assert!(near_one.len() > 2_000, "{} points", near_one.len());

    // All over the boxes around them, and half a metre beyond.
    let all_over = |low: [f64; 3], high: [f64; 3]| -> Vec<[f64; 3]> {
        let share = |k: u32, c: usize| (f64::from(k) * [0.819_173, 0.671_044, 0.549_700][c]).fract();
        let count = near_one.len() as u32;
        (0..count).map(|k| [0, 1, 2].map(|c| low[c] + share(k, c) * (high[c] - low[c]))).collect()
    };
    let (over_parts, over_one) =
        (all_over([-1.0, -1.0, -1.1], [8.2, 1.0, 1.1]), all_over([-1.0; 3], [1.0; 3]));

    let [near, over] = [(near_parts, near_one), (over_parts, over_one)]
        .map(|(of_parts, of_one)| [looks(&parts, &of_parts), looks(&one, &of_one)].map(|looks| looks as f64));
    let (all, of_near) = ((near[0] + over[0]) / (near[1] + over[1]), near[0] / near[1]);
    assert!(all < 1.5, "{all} times as many looks: near {near:?}, all over {over:?}");
    // Beside a part others must be asked too.
    assert!(of_near < 1.8, "{of_near} times as many looks near the surface: {near:?}");
}

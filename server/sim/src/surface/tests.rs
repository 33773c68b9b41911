//! The tree and the counts of crossings against all pairs, on sheets that are crumpled at random.

use std::collections::BTreeSet;

use super::{numbers::Numbers, *};
use crate::{
    interrupt::Interrupt,
    math::{Vec3, array3},
    parallel::on_threads,
};

/// A sheet of `side` by `side` particles, a metre wide.
fn sheet(side: u32, first: u32) -> Vec<[u32; 3]> {
    let quads = (0..(side - 1) * (side - 1)).map(|i| first + i / (side - 1) * side + i % (side - 1));
    quads.flat_map(|a| [[a, a + 1, a + side], [a + side, a + 1, a + side + 1]]).collect()
}

/// Places of `sheets` such sheets one over another, each particle moved by up to `crumpled` (m).
fn places(side: u32, sheets: u32, crumpled: f64) -> Vec<Vec3<f64>> {
    let mut numbers = Numbers(11);
    let step = 1.0 / f64::from(side);
    let flat = |i: u32| {
        let (sheet, i) = (i / (side * side), i % (side * side));
        Vec3::new(f64::from(i % side) * step, 0.1 * f64::from(sheet), f64::from(i / side) * step)
    };
    (0..sheets * side * side).map(|i| flat(i) + numbers.place() * crumpled).collect()
}

fn faces(side: u32, sheets: u32) -> Faces {
    let all: Vec<_> = (0..sheets).flat_map(|s| sheet(side, s * side * side)).collect();
    Faces::new(&all, (sheets * side * side) as usize)
}

/// The box around the ways of some particles, wider by `by` (m).
fn around(ways: &[[Vec3<f64>; 2]], points: &[u32], by: f64) -> [[f64; 3]; 2] {
    let of = |start: f64, pick: fn(f64, f64) -> f64, by: f64| {
        let places = points.iter().flat_map(|point| ways[*point as usize]);
        let corner = places.fold(Vec3::repeat(start), |corner, place| corner.zip_map(&place, pick));
        array3(&corner.add_scalar(by))
    };
    [of(f64::INFINITY, f64::min, -by), of(f64::NEG_INFINITY, f64::max, by)]
}

fn overlap([low, high]: [[f64; 3]; 2], [from, to]: [[f64; 3]; 2]) -> bool {
    (0..3).all(|c| low[c] <= to[c] && from[c] <= high[c])
}

/// A pair as a set of two parts, whichever stands first.
fn named(kind: PairKind, corners: [u32; 4]) -> [Vec<u32>; 2] {
    let split = if kind == PairKind::Edges { 2 } else { 1 };
    let mut parts = [corners[..split].to_vec(), corners[split..].to_vec()];
    for part in &mut parts {
        part.sort_unstable();
    }
    parts.sort();
    parts
}

/// Particles, and the box about them.
type Part = (Vec<u32>, [[f64; 3]; 2]);

/// The pairs that all parts of a surface make whose boxes overlap.
fn all_pairs(
    faces: &Faces,
    box_of: &dyn Fn(&[u32]) -> [[f64; 3]; 2],
    skip: &dyn Fn(u32) -> bool,
) -> BTreeSet<[Vec<u32>; 2]> {
    let boxed = |part: &[u32]| (part.to_vec(), box_of(part));
    let corners: BTreeSet<u32> = faces.triangles().as_flattened().iter().copied().collect();
    let corners: Vec<_> = corners.iter().map(|corner| boxed(&[*corner])).collect();
    let triangles: Vec<_> = faces.triangles().iter().map(|triangle| boxed(triangle)).collect();
    let edges = faces.triangles().iter().flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]]);
    let edges: BTreeSet<[u32; 2]> = edges.map(|[a, b]| [a.min(b), a.max(b)]).collect();
    let edges: Vec<_> = edges.iter().map(|edge| boxed(edge)).collect();

    let mut found = BTreeSet::new();
    let mut look = |kind, first: &Part, second: &Part| {
        let (points, others) = (&first.0, &second.0);
        let is_apart = points.iter().all(|point| !others.contains(point));
        let is_skipped = points.iter().chain(others).all(|point| skip(*point));
        if overlap(first.1, second.1) && is_apart && !is_skipped {
            let corners: Vec<u32> = points.iter().chain(others).copied().collect();
            found.insert(named(kind, corners.try_into().expect("four corners")));
        }
    };
    for corner in &corners {
        for triangle in &triangles {
            look(PairKind::VertexTriangle, corner, triangle);
        }
    }
    for (i, edge) in edges.iter().enumerate() {
        for other in &edges[i + 1..] {
            look(PairKind::Edges, edge, other);
        }
    }
    found
}

/// Boxes made anew, and the candidates.
fn candidates(
    faces: &Faces,
    tree: &mut Tree,
    box_of: &(dyn Fn(&[u32]) -> [[f64; 3]; 2] + Sync),
    is_wanted: &(dyn Fn(PairKind, [u32; 4]) -> bool + Sync),
) -> Vec<Candidate> {
    let mut out = Vec::new();
    tree.refit(&|face| box_of(&faces.triangles()[face]));
    let (wanted, never) = (Wanted { without: &|_| &[], is_wanted }, Interrupt::default());
    tree.candidates(faces, &wanted, box_of, &mut out, &never).expect("not too many");
    out
}

#[test]
fn candidates_are_the_pairs_of_all_parts_whose_boxes_meet() {
    for (side, sheets, crumpled, moved) in
        [(2, 1, 0.0, 0.1), (5, 1, 0.5, 0.0), (9, 2, 0.1, 0.05), (14, 1, 0.05, 0.01), (8, 3, 0.2, 0.02)]
    {
        let (faces, start) = (faces(side, sheets), places(side, sheets, crumpled));
        let mut numbers = Numbers(23);
        let ways: Vec<_> = start.iter().map(|x| [*x, x + numbers.place() * moved]).collect();
        let by = 0.01;
        let skip = |point: u32| point % side < 3;
        let is_wanted = |_: PairKind, corners: [u32; 4]| !corners.into_iter().all(skip);
        let mut tree = Tree::new(faces.triangles().len());
        let found = candidates(&faces, &mut tree, &|points| around(&ways, points, by), &is_wanted);

        let set: BTreeSet<_> = found.iter().map(|pair| named(pair.kind(), pair.corners)).collect();
        assert_eq!(set.len(), found.len(), "each once");
        // Boxes of binary32 are a little wider.
        let least = all_pairs(&faces, &|points| around(&ways, points, by), &skip);
        let most = all_pairs(&faces, &|points| around(&ways, points, by + 1e-6), &skip);
        assert!(set.is_superset(&least), "{:?}", least.difference(&set).next());
        assert!(set.is_subset(&most), "{:?}", set.difference(&most).next());
        assert!(side == 2 || least.len() > 30, "{}", least.len());
        for pair in &found {
            let [_, a, b, c] = pair.corners;
            let triangle = faces.triangles().get(pair.triangle as usize).copied();
            let expected = (pair.kind() == PairKind::VertexTriangle).then_some([a, b, c]);
            assert_eq!(triangle, expected, "{pair:?}");
        }
    }
}

#[test]
fn candidates_are_the_same_for_any_number_of_threads_and_in_a_tree_that_was_used() {
    let (side, sheets) = (30, 2);
    let (faces, x) = (faces(side, sheets), places(side, sheets, 0.05));
    let mut tree = Tree::new(faces.triangles().len());
    let ways: Vec<_> = x.iter().map(|x| [*x, *x]).collect();
    let box_of = |points: &[u32]| around(&ways, points, 0.01);
    let all = |_: PairKind, _: [u32; 4]| true;
    let mut lists = Vec::new();
    for threads in 1..=4 {
        on_threads(threads, || lists.push(candidates(&faces, &mut tree, &box_of, &all)));
        // More, in between: what was there does not stay.
        let wider = |points: &[u32]| around(&ways, points, 0.02);
        assert!(candidates(&faces, &mut tree, &wider, &all).len() > lists[0].len());
    }
    assert!(lists[0].len() > 1000, "{}", lists[0].len());
    assert!(lists.iter().all(|list| *list == lists[0]));
}

#[test]
fn far_from_the_origin_as_many_pairs_are_found() {
    let (side, sheets) = (12, 2);
    let faces = faces(side, sheets);
    // Places that are exact there too.
    let exact = |x: Vec3<f64>| x.map(|c| (c * 4096.0).round() / 4096.0);
    let near: Vec<_> = places(side, sheets, 0.1).into_iter().map(exact).collect();
    let mut tree = Tree::new(faces.triangles().len());
    let mut found = |far: Vec3<f64>| {
        let ways: Vec<_> = near.iter().map(|x| [x + far, x + far]).collect();
        candidates(&faces, &mut tree, &|points| around(&ways, points, 0.007_812_5), &|_, _| true)
    };
    let here = found(Vec3::zeros());
    assert!(here.len() > 100);
    assert_eq!(found(Vec3::new(1e6, -2e6, 3e6)), here);
}

#[test]
fn pairs_with_triangles_that_are_left_out_are_not_found() {
    let (side, sheets) = (9, 2);
    let (faces, x) = (faces(side, sheets), places(side, sheets, 0.1));
    let beside = Beside::new(&faces, &x);
    let ways: Vec<_> = x.iter().map(|x| [*x, *x]).collect();
    let box_of = |points: &[u32]| around(&ways, points, 0.02);
    let mut tree = Tree::new(faces.triangles().len());
    let every = candidates(&faces, &mut tree, &box_of, &|_, _| true);
    let mut rest = Vec::new();
    let wanted = Wanted { without: &|face| beside.triangles(face), is_wanted: &|_, _| true };
    tree.candidates(&faces, &wanted, &box_of, &mut rest, &Interrupt::default()).expect("not too many");

    let touch = |pair: &Candidate| {
        let (first, second) = match pair.kind() {
            PairKind::VertexTriangle => pair.corners.split_at(1),
            PairKind::Edges => pair.corners.split_at(2),
        };
        // The triangle that counts a part is the first that has it.
        let of =
            |part: &[u32]| faces.triangles().iter().find(|t| part.iter().all(|p| t.contains(p))).unwrap();
        of(first).iter().any(|corner| of(second).contains(corner))
    };
    let left: Vec<_> = every.iter().filter(|pair| !touch(pair)).copied().collect();
    assert!(left.len() > 100 && left.len() + 100 < every.len(), "{} of {}", left.len(), every.len());
    assert_eq!(rest, left);
}

#[test]
fn a_surface_without_triangles_has_no_pairs() {
    let faces = Faces::new(&[[0, 0, 1]], 3);
    let mut tree = Tree::new(0);
    let nowhere = |_: &[u32]| [[0.0; 3]; 2];
    assert!(candidates(&faces, &mut tree, &nowhere, &|_, _| true).is_empty());
    assert_eq!(counted(&mut Crossings::new(&faces), &faces, &|_| Vec3::zeros()), (0, None));
}

/// The crossings, and the first of them.
fn counted(
    crossings: &mut Crossings,
    faces: &Faces,
    x: &(dyn Fn(u32) -> Vec3<f64> + Sync),
) -> (u64, Option<Crossing>) {
    crossings.count(faces, x, &Interrupt::default()).expect("nobody gives it up")
}

#[test]
fn crossings_are_those_of_all_edges_with_all_triangles() {
    for (side, crumpled) in [(6, 0.0), (6, 0.01), (6, 0.2), (15, 0.1)] {
        let (faces, x) = (faces(side, 2), places(side, 2, crumpled));
        let at = |point: u32| x[point as usize];
        let (mut pairs, all) = (Vec::new(), 0..faces.triangles().len());
        for (from, to) in all.clone().flat_map(|from| all.clone().map(move |to| (from, to))) {
            let triangle = faces.triangles()[to];
            for edge in faces.edges(from).filter(|edge| edge.iter().all(|end| !triangle.contains(end))) {
                if crosses(edge.map(at), triangle.map(at)) {
                    pairs.push((from.min(to), from.max(to), Crossing { edge, triangle }));
                }
            }
        }
        let mut crossings = Crossings::new(&faces);
        for threads in [1, 3] {
            on_threads(threads, || {
                let (count, first) = counted(&mut crossings, &faces, &at);
                assert_eq!(count, pairs.len() as u64, "{side} {crumpled}");
                let alone = crossings.first_of(&faces, &at, &|_| true, &Interrupt::default());
                assert_eq!(alone, Ok(first), "{side} {crumpled}");
                let lowest = pairs.iter().map(|(a, b, _)| (*a, *b)).min();
                let is_first = |(a, b, crossing): &(usize, usize, Crossing)| {
                    Some((*a, *b)) == lowest && Some(*crossing) == first
                };
                assert!(pairs.is_empty() && first.is_none() || pairs.iter().any(is_first), "{first:?}");
            });
        }
        assert_eq!(pairs.is_empty(), crumpled < 0.05, "{side} {crumpled}");
    }
}

#[test]
fn a_corner_that_sticks_out_by_a_nanometre_is_counted() {
    let (faces, mut x) = (faces(4, 2), places(4, 2, 0.0));
    let mut crossings = Crossings::new(&faces);
    let mut count = |x: &[Vec3<f64>]| counted(&mut crossings, &faces, &|point| x[point as usize]);
    for (depth, expected) in [(-1e-9, 0), (0.0, 0), (1e-9, 2)] {
        // Above the inside of a triangle of the other sheet.
        x[0] = Vec3::new(0.3, 0.1 + depth, 0.3);
        let (crossings, first) = count(&x);
        assert_eq!(crossings, expected, "{depth}");
        assert_eq!(first.is_some_and(|first| first.edge.contains(&0)), expected > 0);
    }
    // Both edges have the corner.
    let at = |point: u32| x[point as usize];
    let counts = |particles: &[u32]| !particles[..2].contains(&0);
    let without = Crossings::new(&faces).first_of(&faces, &at, &counts, &Interrupt::default());
    assert_eq!(without, Ok(None));
}

#[test]
fn sheets_that_go_through_each_other_along_their_seams_are_counted() {
    // The second sheet stands upright on a row of particles of the first, none of its own being in the plane of that one.
    let side = 5;
    let faces = faces(side, 2);
    let at = |point: u32| {
        let (sheet, i) = (point / (side * side), point % (side * side));
        let [u, v] = [i % side, i / side].map(f64::from);
        if sheet == 0 { Vec3::new(u, 0.0, v) } else { Vec3::new(u, v - 1.5, 2.0) }
    };
    let (count, first) = counted(&mut Crossings::new(&faces), &faces, &at);
    // Five edges through particles, two of them at the border, and four through seams.
    assert_eq!(count, 3 * 6 + 2 * 3 + 4 * 2);
    assert!(first.is_some());
}

#[test]
fn pairs_are_counted_where_they_are_too_many_to_be_kept_and_refused_where_they_crowd() {
    let (side, sheets) = (14, 2);
    let (faces, x) = (faces(side, sheets), places(side, sheets, 0.1));
    let ways: Vec<_> = x.iter().map(|x| [*x, *x]).collect();
    let box_of = |points: &[u32]| around(&ways, points, 0.02);
    let wanted = Wanted { without: &|_| &[], is_wanted: &|_, _| true };
    let mut tree = Tree::new(faces.triangles().len());
    let every = candidates(&faces, &mut tree, &box_of, &|_, _| true);
    let never = Interrupt::default();
    for most in [0, 100, every.len() - 1, every.len()] {
        assert_eq!(tree.find(&faces, &wanted, &box_of, most, &never), Ok(every.len()), "{most}");
    }
    let mut list = vec![Candidate::default(); every.len()];
    tree.write(&mut list, |place, candidate| *place = candidate);
    assert_eq!(list, every);

    let everywhere = |_: &[u32]| [[0.0; 3], [1.0; 3]];
    tree.refit(&|_| everywhere(&[]));
    let crowded = Unlisted::Crowded { triangle: 0, most: 32_000 };
    assert_eq!(tree.find(&faces, &wanted, &everywhere, 100, &never), Err(crowded));
}

//! Surfaces of which all triangles overlap: how much is looked at before a search ends, counted.

use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

use super::{numbers::Numbers, *};
use crate::{
    interrupt::{Interrupt, Interrupted},
    math::{Vec3, array3},
    parallel::on_threads,
};

/// Triangles of a heap.
const COUNT: u32 = 1000;
/// Blocks of 64 of them.
const BLOCKS: usize = COUNT.div_ceil(64) as usize;
/// Triangles that one is looked at with before it is asked whether to go on.
const GO: usize = 256;
/// Pairs of parts of two triangles: six of a vertex and a triangle, and nine of edges.
const PARTS: usize = 15;

/// Triangles that all overlap, and many of which cross: each with particles of its own, about the origin.
fn heap() -> (Faces, Vec<Vec3<f64>>) {
    let mut numbers = Numbers(31);
    let mut x = Vec::new();
    for _ in 0..COUNT {
        let [a, b, c] = numbers.places();
        x.extend([a.map(|c| 0.1 + c.abs()), b.map(|c| -0.1 - c.abs()), c]);
    }
    let triangles: Vec<[u32; 3]> = (0..COUNT).map(|i| [0, 1, 2].map(|k| 3 * i + k)).collect();
    (Faces::new(&triangles, x.len()), x)
}

/// The box around some particles (m).
fn around(x: &[Vec3<f64>], points: &[u32]) -> [[f64; 3]; 2] {
    let ends = |pick: fn(f64, f64) -> f64| {
        let places = points.iter().map(|point| x[*point as usize]);
        array3(&places.reduce(|one, other| one.zip_map(&other, pick)).expect("a particle"))
    };
    [ends(f64::min), ends(f64::max)]
}

#[test]
fn of_much_that_crosses_the_first_is_found_without_the_others() {
    let (faces, x) = heap();
    let at = |point: u32| x[point as usize];
    let (count, first) =
        Crossings::new(&faces).count(&faces, &at, &Interrupt::default()).expect("nobody gives it up");
    assert!(count > 100_000, "{count}");
    for threads in [1, 4] {
        let found = AtomicUsize::new(0);
        let counts = |_: &[u32]| {
            found.fetch_add(1, Relaxed);
            true
        };
        let alone = on_threads(threads, || {
            Crossings::new(&faces).first_of(&faces, &at, &counts, &Interrupt::default())
        });
        assert_eq!(alone, Ok(first));
        // Of several threads each may have begun with another block.
        let most = if threads == 1 { GO * PARTS } else { BLOCKS * GO * PARTS };
        assert!(found.into_inner() <= most, "{threads} threads");
    }
}

#[test]
fn of_much_that_touches_the_first_is_found_without_the_others() {
    // All lie in one plane.
    let (faces, mut x) = heap();
    for place in &mut x {
        place.z = 0.25;
    }
    let at = |point: u32| x[point as usize];
    let mut found = Vec::new();
    for threads in [1, 4] {
        let looks = AtomicUsize::new(0);
        let counts = |_: &[u32]| {
            looks.fetch_add(1, Relaxed);
            true
        };
        let first = on_threads(threads, || touching(&faces, &at, &counts, &Interrupt::default()));
        found.push(first.expect("nobody gives it up").expect("they touch"));
        let most = if threads == 1 { GO * PARTS } else { BLOCKS * GO * PARTS };
        assert!(looks.into_inner() <= most, "{threads} threads");
    }
    assert_eq!(found[0], found[1]);
}

#[test]
fn a_search_that_is_given_up_ends_within_few_looks() {
    let (faces, x) = heap();
    let box_of = |points: &[u32]| around(&x, points);
    // Given up before it begins, and at a look in the middle.
    for at in [0, 100_000] {
        let (looks, interrupt) = (AtomicUsize::new(0), Interrupt::default());
        let look = || {
            if looks.fetch_add(1, Relaxed) >= at {
                interrupt.request();
            }
        };
        let place = |point: u32| {
            look();
            x[point as usize]
        };
        let left = on_threads(1, || Crossings::new(&faces).count(&faces, &place, &interrupt));
        assert_eq!(left, Err(Interrupted));
        // Places are asked for where boxes are made, and for each look at two triangles: two ends and three corners.
        let most = at.max(3 * faces.triangles().len()) + GO * PARTS * 5;
        assert!(looks.into_inner() <= most, "given up after {at}");
    }

    let (looks, interrupt) = (AtomicUsize::new(0), Interrupt::default());
    let never = |_: PairKind, _: [u32; 4]| {
        if looks.fetch_add(1, Relaxed) >= 100_000 {
            interrupt.request();
        }
        false
    };
    let mut tree = Tree::new(faces.triangles().len());
    tree.refit(&|face| box_of(&faces.triangles()[face]));
    let wanted = Wanted { without: &|_| &[], is_wanted: &never };
    let left = on_threads(1, || tree.candidates(&faces, &wanted, &box_of, &mut Vec::new(), &interrupt));
    assert_eq!(left, Err(Unlisted::Interrupted));
    let looks = looks.into_inner();
    assert!(looks > 100_000 && looks <= 100_000 + GO * PARTS, "{looks}");
}

#[test]
fn what_crowds_is_refused_at_the_first_block_of_which_that_is_so() {
    // The first block stands apart.
    let (faces, mut x) = heap();
    for (triangle, corners) in faces.triangles().iter().enumerate().take(64) {
        for corner in corners {
            x[*corner as usize].x += 10.0 * (triangle + 1) as f64;
        }
    }
    let box_of = |points: &[u32]| around(&x, points);
    let mut tree = Tree::new(faces.triangles().len());
    tree.refit(&|face| box_of(&faces.triangles()[face]));
    for threads in [1, 4] {
        let listed = AtomicUsize::new(0);
        let all = |_: PairKind, _: [u32; 4]| {
            listed.fetch_add(1, Relaxed);
            true
        };
        let wanted = Wanted { without: &|_| &[], is_wanted: &all };
        let mut out = Vec::new();
        let left = on_threads(threads, || {
            tree.candidates(&faces, &wanted, &box_of, &mut out, &Interrupt::default())
        });
        assert_eq!((left, out.len()), (Err(Unlisted::Crowded { triangle: 64, most: 32_000 }), 0));
        // A block has 500 per triangle and those of one go more, at most.
        let blocks = if threads == 1 { 1 } else { BLOCKS };
        assert!(listed.into_inner() <= blocks * (500 * 64 + GO * PARTS), "{threads} threads");
    }
}

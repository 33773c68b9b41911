//! Scenes that begin crossed are refused, by however little; those that begin apart are taken.

use nappe_sim::{cloth::Network, math::Precision, surface::Crossing, world::Simulation};
use nappe_tests::{
    Random, Scene,
    crossings::crossings,
    networks::particles,
    sheets::{Sheet, together},
    surface::scene,
    threads::with_threads,
};

/// A level sheet, and an upright one whose lower corners are so far (m) below it, within its triangles.
fn pierced(depth: f64) -> Scene {
    let level = Sheet::level(4, 0.1, [0.0; 3], 0.0);
    let upright = Sheet::upright(3, 0.05);
    // Its bottom row is 0.1 m below its top row.
    let origin = [0.017 + upright.origin[0], 0.1 - depth, 0.023];
    scene(together(&[level.network(), Sheet { origin, ..upright }.network()]), 1e-3, 0.0)
}

#[test]
fn a_scene_that_begins_crossed_by_a_nanometre_is_refused_with_the_first_pair_on_any_number_of_threads() {
    let crossed = pierced(1e-9);
    let counted = crossings(&crossed.network.triangles, &crossed.network.x);
    assert!(counted > 0, "it is crossed");
    let told = |threads: usize| {
        let made = with_threads(threads, || Simulation::new(&crossed.setup(), Precision::F64).map(drop));
        made.expect_err("it is crossed").to_string()
    };
    let error = told(1);
    let first = crossed.network.first_crossing().expect("it is crossed");
    let Crossing { edge: [p, q], triangle: [a, b, c] } = first;
    let pair = format!("particles {p} and {q} crosses the triangle of {a}, {b} and {c} (at least 1 pair");
    assert!(error.contains("crosses itself") && error.contains(&pair), "{error}");
    assert_eq!(told(4), error);
    assert_eq!(crossed.network.crossed().map(|crossed| crossed.count), Some(counted));
}

#[test]
fn twenty_thousand_triangles_that_all_overlap_are_refused_at_the_first_crossing() {
    // Looks at all pairs would take a quarter of an hour.
    let mut random = Random::seeded(5);
    let mut triangle = || {
        let [a, b, c] = [0; 3].map(|_| random.vector());
        [a.map(|c| 0.1 + c.abs()), b.map(|c| -0.1 - c.abs()), c]
    };
    let corners: Vec<[f64; 3]> = (0..20_000).flat_map(|_| triangle()).collect();
    let triangles = (0..20_000).map(|i| [0, 1, 2].map(|k| 3 * i + k)).collect();
    let heap = Network { triangles, ..particles(&corners, 1e-3) };
    let error = Simulation::new(&scene(heap, 1e-9, 0.0).setup(), Precision::F64).expect_err("it is crossed");
    assert!(error.to_string().contains("(at least 1 pair"), "{error}");
}

#[test]
fn a_scene_that_begins_a_nanometre_apart_is_taken() {
    let apart = pierced(-1e-9);
    assert_eq!(crossings(&apart.network.triangles, &apart.network.x), 0);
    let made = Simulation::new(&apart.setup(), Precision::F64);
    assert!(made.is_ok(), "{:?}", made.err());
}

#[test]
fn a_thickness_above_half_of_the_shortest_edge_is_refused_with_both() {
    // Half of a 128th is 0.00390625.
    let sheet = Sheet::level(4, 0.007_812_5, [0.0; 3], 0.0).network();
    for (thickness, is_taken) in [(0.0039, true), (0.004, false)] {
        let made = Simulation::new(&scene(sheet.clone(), thickness, 0.0).setup(), Precision::F64);
        assert_eq!(made.is_ok(), is_taken, "{thickness} m: {:?}", made.as_ref().err());
        if let Err(error) = made {
            let told = error.to_string();
            assert!(told.contains("0.004 ") && told.contains("0.0078125 "), "{told}");
        }
    }
}

#[test]
fn a_thickness_above_the_height_of_a_sliver_is_refused_with_its_corners() {
    // The corner that is in one triangle alone comes near to the side across from it.
    let of_height = |height: f64| {
        let mut sheet = Sheet::level(4, 0.05, [0.0; 3], 0.0).network();
        let uses =
            |particle: u32| sheet.triangles.iter().flatten().filter(|corner| **corner == particle).count();
        let alone = (0..16).find(|particle| uses(*particle) == 1).expect("two corners are in one triangle");
        let triangle =
            *sheet.triangles.iter().find(|triangle| triangle.contains(&alone)).expect("its triangle");
        let others: Vec<usize> = triangle.iter().filter(|i| **i != alone).map(|i| *i as usize).collect();
        let [corner, p, q] = [alone as usize, others[0], others[1]].map(|i| sheet.x[i]);
        let middle = [0, 1, 2].map(|c| 0.5 * (p[c] + q[c]));
        let out = [0, 1, 2].map(|c| corner[c] - middle[c]);
        let length = out.iter().map(|c| c * c).sum::<f64>().sqrt();
        sheet.x[alone as usize] = [0, 1, 2].map(|c| middle[c] + out[c] * (height / length));
        (scene(sheet, 4e-3, 0.0).setup(), triangle)
    };
    let (setup, [a, b, c]) = of_height(1.4e-5);
    let told = Simulation::new(&setup, Precision::F64).expect_err("a sliver").to_string();
    let expected = format!("the flattest triangle, of particles {a}, {b} and {c}, which is 1.4e-5 m");
    assert!(told.contains(&expected), "{told}");
    let made = Simulation::new(&of_height(4.1e-3).0, Precision::F64);
    assert!(made.is_ok(), "{:?}", made.err());
}

#[test]
fn surfaces_that_touch_at_the_start_are_refused_with_the_remedy() {
    // Side by side, so that the last column of one is the first of the other; a nanometre apart they are taken.
    let beside = |gap: f64| {
        let sheet =
            |at: f64| Sheet { origin: [at, 0.0, 0.0], ..Sheet::level(4, 0.05, [0.0; 3], 0.0) }.network();
        scene(together(&[sheet(0.0), sheet(0.15 + gap)]), 4e-3, 0.0)
    };
    let error = Simulation::new(&beside(0.0).setup(), Precision::F64).expect_err("it touches").to_string();
    assert!(error.contains("touches itself") && error.contains("weld = 1e-6"), "{error}");
    let made = Simulation::new(&beside(1e-9).setup(), Precision::F64);
    assert!(made.is_ok(), "{:?}", made.err());
}

//! Scenes that begin crossed are refused, by however little; those that begin apart are taken.

use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::{
    Scene,
    crossings::crossings,
    sheets::{Sheet, together},
    surface::scene,
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
fn a_scene_that_begins_crossed_by_a_nanometre_is_refused_with_the_pair_and_the_count() {
    let crossed = pierced(1e-9);
    let counted = crossings(&crossed.network.triangles, &crossed.network.x);
    assert!(counted > 0, "it is crossed");
    let error = Simulation::new(&crossed.setup(), Precision::F64).expect_err("it is crossed").to_string();
    assert!(error.contains("cross"), "{error}");
    assert!(error.contains(&counted.to_string()), "{error}: {counted} crossings");
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

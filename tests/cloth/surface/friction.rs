//! Cloth rubs on cloth by Coulomb's law: where it slips, how it creeps below that, and that it crosses itself nowhere.

use nappe_sim::math::Precision;
use nappe_tests::{
    Scene,
    scene::positions,
    sheets::{Sheet, together},
    surface::{Case, DT, Folds, GRAVITY, Tally, Watched, folded_twice, on_a_ball, piled, scene, speeds},
};

const FRICTION: f64 = 0.3;

/// Particles along a side of what lies on top; below it is a sheet of twice as many, all of them pins.
const SIDE: usize = 12;

/// Steps in which it comes to rest or to its speed, and steps in which it is measured.
const BEFORE: u64 = 40;
const MEASURED: u64 = 120;

/// A sheet on a slope of cloth, of which the tangent is `share` of the friction. Gravity leans, and the slope is level.
fn on_a_slope(share: f64) -> Scene {
    let thickness = 2e-3;
    let mut below = Sheet::level(2 * SIDE, 0.02, [0.0; 3], 0.0).network();
    below.pins = (0..below.x.len() as u32).collect();
    let above = Sheet::level(SIDE, 0.02, [0.0013, thickness, 0.0017], 0.1);
    let (sin, cos) = (share * FRICTION).atan().sin_cos();
    scene(together(&[below, above.network()]), thickness, FRICTION).under([
        GRAVITY * sin,
        -GRAVITY * cos,
        0.0,
    ])
}

/// The mean place (m) of what lies on top, down the slope.
fn place(watched: &Watched) -> f64 {
    let x = positions(&watched.simulation);
    let top = &x[4 * SIDE * SIDE..];
    top.iter().map(|x| x[0]).sum::<f64>() / top.len() as f64
}

/// The mean speed (m/s) down a slope, once it has been on it for a while.
fn speed(share: f64, precision: Precision) -> f64 {
    let mut watched = Watched::new(&on_a_slope(share), precision);
    watched.go(BEFORE);
    let start = place(&watched);
    watched.go(MEASURED);
    assert_eq!(watched.tally.complaint(), None, "a slope of {share} in {precision}");
    (place(&watched) - start) / (MEASURED as f64 * DT)
}

#[test]
fn cloth_that_is_turned_on_cloth_holds_below_the_friction_and_slips_above_it() {
    for precision in Precision::ALL {
        // Below the threshold it creeps by up to 1 mm/s, once it has come to rest.
        let held = speed(0.98, precision);
        assert!((0.9e-3..1e-3).contains(&held), "{precision}: {held} m/s on a slope that holds");

        let slipped = speed(1.1, precision);
        let (sin, cos) = (1.1 * FRICTION).atan().sin_cos();
        let mean_time = DT * (BEFORE as f64 + 0.5 * MEASURED as f64);
        let expected = GRAVITY * (sin - FRICTION * cos) * mean_time;
        let off = slipped / expected - 1.0;
        assert!(off.abs() < 0.05, "{precision}: {slipped} m/s on a slope that does not hold, not {expected}");
    }
}

#[test]
fn cloth_creeps_under_a_side_load_by_its_share_of_the_friction_in_millimetres_per_second() {
    for share in [0.25, 0.5] {
        let found = speed(share, Precision::F64);
        let expected = 1e-3 * share;
        assert!((found / expected - 1.0).abs() < 0.1, "{share}: {found} m/s, not {expected}");
    }
}

#[test]
fn cloth_that_rubs_on_itself_crosses_itself_nowhere() {
    let towel = Folds { side: 16, spacing: 0.01, thickness: 2e-3, steps: [100, 40, 60] };
    for case in Case::ROUGH {
        assert_eq!(folded_twice(&towel, &case).complaint(), None, "{case:?}, a towel");
        let scene = on_a_ball([3, 13], [0.03, 0.1], 4e-3, &case);
        let mut watched = Watched::new(&scene, case.precision);
        watched.go(250);
        assert_eq!(watched.tally.complaint(), None, "{case:?}, sheets on a ball");
    }
}

#[test]
fn a_pile_with_friction_comes_to_rest() {
    let thickness = 2e-3;
    for case in Case::ROUGH {
        let scene = piled([3, 10], thickness, &case);
        let mut watched = Watched::new(&scene, case.precision);
        watched.go(400);
        watched.tally = Tally::default();
        watched.go(100);
        let tally = watched.tally;
        assert_eq!(tally.complaint(), None, "{case:?}");
        assert!(tally.least_gap > 0.4 * thickness, "{case:?}: {tally:?}");
        let [all, vertical] = speeds(&watched.simulation, &scene.network.masses);
        assert!(all < 1e-3 && vertical < 1e-4, "{case:?}: {all:e} m/s, {vertical:e} of it up and down");
    }
}

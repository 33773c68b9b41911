//! A sheet that lies on a plane in a medium: what the medium takes of the fall of each step, from which contact brings it back, is no
//! energy that contact gives.

use nappe_sim::math::Precision;
use nappe_tests::scene::{advance, max_distance, of_text, positions};

/// Steps in which what was owed by mistake came to the limit eight times.
const STEPS: u64 = 200;

/// A sheet that lies on a plane below it along y or beside it along x, in a medium of that drag (kg/s), all of which goes at one velocity (m/s).
fn lying(integrator: &str, drag: f64, axis: usize, frame: [f64; 3]) -> String {
    let along = |length: f64| {
        let mut vector = [0.0; 3];
        vector[axis] = length;
        vector
    };
    let turn = if axis == 0 { "rotate = { axis = [0, 0, 1], degrees = 90 }, " } else { "" };
    format!(
        "version = 1\ndt = 0.005\nsteps = {STEPS}\ngravity = {:?}\nwind = {frame:?}\n[[body]]\nname = \"sheet\"\n\
         mesh = {{ grid = [9, 9], spacing = 0.05 }}\ntransform = {{ {turn}translate = {:?} }}\n\
         mass = {{ particle = 0.005 }}\ndrag = {drag}\nvelocity = {frame:?}\nintegrator = \"{integrator}\"\n\
         springs = {{ stretch = {{ stiffness = 100, damping = 0.02 }}, shear = {{ stiffness = 50, damping = 0.01 }}, \
         bend = {{ stiffness = 5, damping = 0.002 }} }}\nsolver = {{ tolerance = 1e-6, max_iterations = 600 }}\n\
         [[collider]]\nname = \"floor\"\nplane = {{ point = [0, 0, 0], normal = {:?} }}\nfriction = 0.5\nmargin = 0.01\nvelocity = {frame:?}\n",
        along(-9.81),
        along(0.01),
        along(1.0)
    )
}

/// Steps such a scene, and looks at each step and at where the sheet is in the end.
fn is_owed_nothing(integrator: &str, (drag, axis): (f64, usize), frame: [f64; 3], precision: Precision) {
    let mut simulation = of_text(&lying(integrator, drag, axis, frame), precision);
    let mut expected = positions(&simulation);
    let named = format!("{integrator} in {precision}, drag {drag}, axis {axis}, at {frame:?} m/s");
    for step in 0..STEPS {
        let rejections = advance(&mut simulation, 1).rejections;
        assert!(rejections.is_empty(), "{named}, step {step}: {rejections:?}");
    }
    for x in &mut expected {
        for c in 0..3 {
            x[c] += frame[c] * 0.005 * STEPS as f64;
        }
    }
    let off = max_distance(&positions(&simulation), &expected);
    assert!(off < 1e-6, "{named}: {off:e} m");
}

#[test]
fn what_lies_in_a_medium_is_owed_nothing() {
    for precision in Precision::ALL {
        for integrator in ["implicit_euler", "implicit_midpoint", "bdf2"] {
            for of in [(1e-3, 1), (0.1, 1), (1e-3, 0)] {
                is_owed_nothing(integrator, of, [0.0; 3], precision);
            }
        }
    }
}

#[test]
fn what_lies_in_a_lift_or_a_train_is_owed_nothing() {
    for frame in [[0.0, 3.0, 0.0], [0.0, -3.0, 0.0], [3.0, 0.0, 0.0], [2.0, 30.0, -1.0]] {
        for integrator in ["implicit_euler", "implicit_midpoint", "bdf2"] {
            is_owed_nothing(integrator, (1e-3, 1), frame, Precision::F64);
        }
    }
}

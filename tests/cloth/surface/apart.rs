//! What is not near is not touched, what is too near is moved apart at its own pace, and what bounces comes back.

use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::scene::{advance, of_text, positions, velocities};

/// The springs, mass and thickness of a sheet.
const CLOTH: &str = "mass = { density = 0.2 }\nthickness = 0.004\n\
    springs = { stretch = { stiffness = 400, damping = 0.05 }, shear = { stiffness = 120, damping = 0.02 }, \
    bend = { stiffness = 4, damping = 0.004 } }\n";

/// A sheet of `side` x `side` particles.
fn sheet(name: &str, side: usize, spacing: f64, place: [f64; 3], more: &str) -> String {
    format!(
        "[[body]]\nname = \"{name}\"\nmesh = {{ grid = [{side}, {side}], spacing = {spacing} }}\n\
         transform = {{ translate = {place:?} }}\n{CLOTH}{more}\n"
    )
}

/// The mean height (m), or speed upwards (m/s), of some particles.
fn mean(rows: &[[f64; 3]]) -> f64 {
    rows.iter().map(|row| row[1]).sum::<f64>() / rows.len() as f64
}

fn energy(simulation: &mut Simulation) -> f64 {
    simulation.diagnose().total_energy()
}

#[test]
fn what_passes_an_edge_outside_of_the_margin_is_not_touched() {
    let scrap = sheet("scrap", 4, 0.01, [-0.3, 0.15, 0.0], "velocity = [10, 0, 0]");
    let text = format!(
        "version = 1\ndt = 0.016666666666666666\ngravity = [0, 0, 0]\n{scrap}\
         [[collider]]\nname = \"box\"\nbox = {{ center = [0, 0, 0], size = [0.2, 0.2, 0.2] }}\nmargin = 0.003\n"
    );
    let mut simulation = of_text(&text, Precision::F64);
    let before = energy(&mut simulation);
    let report = advance(&mut simulation, 5);
    let after = energy(&mut simulation);
    assert!((after / before - 1.0).abs() < 1e-9, "{after} J of {before}");
    assert_eq!(report.cloth.expect("there is cloth").rejected, 0);
}

#[test]
fn lost_thickness_is_given_back_at_one_speed_whatever_the_step() {
    for (dt, steps) in [(0.02, 10), (5e-3, 40), (1e-3, 100), (2e-4, 400)] {
        let text = format!(
            "version = 1\ndt = {dt}\ngravity = [0, 0, 0]\n{}{}",
            sheet("below", 9, 0.02, [0.0; 3], ""),
            sheet("above", 9, 0.02, [0.0033, 1e-4, 0.0017], "")
        );
        let mut simulation = of_text(&text, Precision::F64);
        advance(&mut simulation, steps);
        let v = velocities(&simulation);
        let apart = mean(&v[81..]) - mean(&v[..81]);
        assert!((apart / 0.1 - 1.0).abs() < 0.1, "steps of {dt} s: they part at {apart} m/s");
    }
}

#[test]
fn a_sheet_with_a_thickness_bounces_as_high_as_restitution_says() {
    for dt in [0.01, 5e-3, 2e-3] {
        let text = format!(
            "version = 1\ndt = {dt}\n{}[[collider]]\nname = \"floor\"\nplane = {{ point = [0, 0, 0], normal = [0, 1, 0] }}\n\
             margin = 0.003\nrestitution = 0.9\n",
            sheet("sheet", 4, 0.02, [0.0, 0.203, 0.0], "")
        );
        let mut simulation = of_text(&text, Precision::F64);
        let mut height = 0.0_f64;
        for _ in 0..(0.39 / dt) as u64 {
            advance(&mut simulation, 1);
            let is_back = mean(&velocities(&simulation)) > 0.0 || height > 0.0;
            height = if is_back { height.max(mean(&positions(&simulation)) - 0.003) } else { 0.0 };
        }
        assert!((height / 0.162 - 1.0).abs() < 0.02, "steps of {dt} s: it bounces to {height} m of 0.162");
    }
}

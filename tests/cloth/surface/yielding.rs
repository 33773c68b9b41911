//! Figures that give way: what presses their corners moves them, by a pressure over their firmness; what lets them go lets them back.

use nappe_sim::{
    cloth::{Network, Repeat},
    linalg::Stop,
    math::Precision,
    mesh::TriangleMesh,
    time_step::TimeStep,
    world::WorldSetup,
};
use nappe_tests::{
    Scene,
    scene::{advance, norm, positions},
    sheets::Sheet,
    surface::{
        DT, GRAVITY, THICKNESS, built, figure, giving_way, of_bodies, off_frames, pinched, scene,
        sheet_on_a_plate, walked,
    },
};

/// Firmness (N/m³) of a plate that a sheet sinks by 2 mm.
const SOFT: f64 = 1e3;

/// A scene without a body, with friction.
fn empty() -> Scene {
    scene(Network::default(), 0.0, 0.3)
}

/// A sheet just above a level plate that is soft, in steps that are so many parts of [`DT`].
fn on_a_soft_plate(parts: f64) -> WorldSetup {
    let plate = TriangleMesh::grid(7, 7, 0.05);
    let frame = plate.points.iter().map(|[x, y, z]| [x - 0.15, *y, z - 0.15]).collect::<Vec<[f64; 3]>>();
    let plate = figure(&plate.triangles, &[frame], 1.0, Repeat::Hold);
    let sheet = Sheet::level(10, 0.02, [0.004, 1.1 * THICKNESS, 0.007], 0.2).network();
    let mut scene = empty();
    scene.settings.time_step = TimeStep::Fixed(DT / parts);
    // What a solve leaves over is missing at the corners: by a tolerance of 1e-3 they carry 4 % too little.
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-8, max_iterations: 2000 };
    giving_way(of_bodies(&scene, vec![("sheet", sheet, THICKNESS), ("plate", plate, THICKNESS)]), SOFT)
}

#[test]
fn a_sheet_sinks_a_soft_plate_by_its_weight_over_the_firmness_and_in_half_a_sub_step_by_a_quarter() {
    for parts in [1.0, 2.0] {
        let setup = on_a_soft_plate(parts);
        let mut simulation = built(&setup, Precision::F64);
        let told = advance(&mut simulation, 300).surface.expect("there is a thickness");
        let off = off_frames(&setup, &positions(&simulation), simulation.time());

        // The corners carry the sheet: each by its area, the firmness, and how far it sank.
        let masses = &setup.bodies[1].network.frames.as_ref().expect("a figure").masses;
        let carried: f64 = masses.iter().zip(&off).map(|(mass, off)| -mass / (DT * DT) * off[1]).sum();
        let weight = GRAVITY * setup.bodies[0].network.masses.iter().sum::<f64>();
        let share = carried * parts * parts / weight;
        assert!((share - 1.0).abs() < 0.02, "{parts} parts: {share} of its weight are carried");

        let farthest = off.iter().copied().map(norm).fold(0.0, f64::max);
        let yielding = off.iter().filter(|off| norm(**off) > 1e-3).count();
        assert!((told.yield_m - farthest).abs() < 1e-12, "{told:?}, and not {farthest} m");
        assert_eq!(told.yielding, yielding as u64, "{told:?}");
        assert!(farthest > 1e-3 / (parts * parts), "{parts} parts: {farthest} m");
    }
}

#[test]
fn corners_that_nothing_touches_are_on_their_frames_though_others_give_way() {
    for precision in Precision::ALL {
        let setup = giving_way(sheet_on_a_plate(&empty()), SOFT);
        let mut simulation = built(&setup, precision);
        let allowed = match precision {
            Precision::F64 => 1e-12,
            Precision::F32 => 1e-6,
        };
        let mut farthest = 0.0_f64;
        for step in 1..=80 {
            advance(&mut simulation, 1);
            let off = off_frames(&setup, &positions(&simulation), simulation.time());
            // The sheet reaches no triangle at a corner of the plate.
            for corner in [0, 5, 30, 35] {
                let off = norm(off[corner]);
                assert!(off < allowed, "{precision}, step {step}: corner {corner} is off by {off:e} m");
            }
            farthest = off.iter().copied().map(norm).fold(farthest, f64::max);
        }
        assert!(farthest > 1e-3, "{precision}: {farthest} m");
    }
}

#[test]
fn plates_that_go_into_each_other_give_way_to_a_sheet_take_it_along_and_let_it_go() {
    let precision = Precision::F32;
    assert_eq!(pinched(8, 11, precision).complaint(precision), None);
}

#[test]
fn the_walker_lowers_its_arms_on_its_tunic_and_no_cloth_crosses_anything() {
    assert_eq!(walked(Precision::F32, 0.3, 100).complaint(), None);
}

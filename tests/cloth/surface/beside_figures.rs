//! What a figure leaves alone that goes by: how often steps evaluate forces, whom a failure names, and the air of the cloth beside it; that no medium
//! acts on it, and what calls may not put through it.

use nappe_sim::{
    cloth::{Air, Network, Repeat},
    field::Field,
    math::Precision,
    mesh::TriangleMesh,
    report::StepFailure,
    world::{Change, ChangeError, WorldSetup},
};
use nappe_tests::{
    Scene,
    scene::{advance, try_advance},
    sheets::Sheet,
    surface::{THICKNESS, built, figure, giving_way, of_bodies, scene},
};

/// Frames in a second (1/s) of what goes by.
const RATE: f64 = 100.0;

/// A scene without a body, with friction.
fn empty() -> Scene {
    scene(Network::default(), 0.0, 0.3)
}

/// A sheet of nine particles that falls, the first body, and a plate 10 m from it that goes so far (m) from one frame to the next.
fn with_a_plate(scene: &Scene, way: f64) -> WorldSetup {
    let sheet = Sheet::level(3, 0.05, [0.0; 3], 0.0).network();
    let plate = TriangleMesh::grid(3, 3, 0.1);
    let frame = |number: u32| {
        let gone = way * f64::from(number);
        plate.points.iter().map(|[x, y, z]| [x + 10.0, *y, z + gone]).collect::<Vec<[f64; 3]>>()
    };
    let frames: Vec<Vec<[f64; 3]>> = (0..40).map(frame).collect();
    let plate = figure(&plate.triangles, &frames, RATE, Repeat::Hold);
    of_bodies(scene, vec![("sheet", sheet, THICKNESS), ("plate", plate, THICKNESS)])
}

#[test]
fn a_step_beside_a_figure_that_moves_evaluates_no_more_than_beside_one_that_stands() {
    for precision in Precision::ALL {
        for firmness in [None, Some(1e6)] {
            let [standing, moving] = [0.0, 1.0].map(|way| {
                let setup = with_a_plate(&empty(), way);
                let setup = match firmness {
                    Some(firmness) => giving_way(setup, firmness),
                    None => setup,
                };
                advance(&mut built(&setup, precision), 3).work.force_evaluations
            });
            assert_eq!(moving, standing, "{precision}, firmness {firmness:?}");
        }
    }
}

#[test]
fn no_medium_acts_on_a_corner_that_gives_way() {
    let mut setup = giving_way(with_a_plate(&empty(), 1.0), 1e6);
    for body in &mut setup.bodies {
        body.network.drag = 1e-3;
    }
    for precision in Precision::ALL {
        let mut simulation = built(&setup, precision);
        advance(&mut simulation, 3);
        let mut forces = vec![[0.0; 3]; simulation.particle_count()];
        simulation.read::<f64>(Field::Forces, forces.as_flattened_mut());
        let (sheet, plate) = forces.split_at(9);
        assert!(sheet.iter().all(|force| *force != [0.0; 3]), "{precision}: {sheet:?}");
        assert!(plate.iter().all(|force| *force == [0.0; 3]), "{precision}: {plate:?}");
    }
}

#[test]
fn a_failure_names_the_cloth_that_it_is_of_and_no_corner_that_is_faster() {
    let mut scene = empty();
    scene.settings.limits.max_energy = Some(1e-6);
    for precision in Precision::ALL {
        let mut simulation = built(&with_a_plate(&scene, 1.0), precision);
        let error = try_advance(&mut simulation, 40).expect_err("the sheet falls ever faster");
        assert!(matches!(error.failure, StepFailure::Energy { particle: 0..9, .. }), "{error}");
        assert_eq!(error.body, "sheet", "{error}");
    }
}

#[test]
fn a_call_may_name_the_one_garment_whose_air_it_changes_and_no_figure() {
    let mut setup = with_a_plate(&empty(), 1.0);
    for body in &mut setup.bodies {
        body.network.air = Some(Air::default());
    }
    let air = |body: &str| Change::Air {
        body: Some(body.to_owned()),
        density: Some(0.6),
        normal: None,
        lift: None,
        tangential: None,
    };
    let mut simulation = built(&setup, Precision::F64);
    simulation.apply(&[air("sheet")]).expect("nobody shares its air");
    let error = simulation.apply(&[air("plate")]).expect_err("air acts on no figure");
    assert_eq!(error, ChangeError::NoAir { body: "plate".to_owned() });
}

#[test]
fn pinned_cloth_is_not_put_through_a_figure_that_gives_way() {
    let sheet = Sheet::level(3, 0.05, [5.0, 0.0, 0.0], 0.0).network();
    let mut held = Sheet::level(6, 0.02, [0.003, 0.3, 0.002], 0.0).network();
    held.pins = (0..36).collect();
    let plate = TriangleMesh::grid(6, 6, 0.06);
    let frame = plate.points.iter().map(|[x, y, z]| [x - 0.15, *y, z - 0.15]).collect::<Vec<[f64; 3]>>();
    let plate = figure(&plate.triangles, &[frame], 1.0, Repeat::Hold);
    let bodies = vec![("sheet", sheet, THICKNESS), ("held", held, THICKNESS), ("plate", plate, THICKNESS)];
    let setup = of_bodies(&empty(), bodies);

    // Upright, with its middle in the plane of the plate.
    let upright = Sheet { origin: [-0.047, 0.053, 0.002], ..Sheet::upright(6, 0.02) }.network();
    let through = Change::State { body: "held".to_owned(), positions: upright.x.into(), velocities: None };
    let mut simulation = built(&giving_way(setup.clone(), 1e6), Precision::F64);
    let error = simulation.apply(std::slice::from_ref(&through)).expect_err("the plate is there");
    let ChangeError::NotApart { bodies: [one, other], .. } = &error else { panic!("{error}") };
    assert!(one != other && [one, other].iter().all(|body| *body == "held" || *body == "plate"), "{error}");

    // Pins alone may go through each other.
    built(&setup, Precision::F64).apply(&[through]).expect("all of them are pins");
}

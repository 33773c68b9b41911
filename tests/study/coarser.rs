//! Coarser copies of scenes against the fine ones: distances at common points by a program of the test's own, what they would be of a
//! copy that is made wrongly, and what plans and charts say of copies.

use nappe_scene::{CoarserGrid, NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{cloth::Integrator, math::Precision, world::Simulation};
use nappe_study::{
    Budget, Case, Coarser, CommonPoints, Plan, Request, Row, SceneTerms, Setting, Stepped, Steps, Terms,
    add_coarser, chart, plan, run,
};
use nappe_tests::scene::{advance, positions};

/// A sheet that hangs by its upper row and stretches under its weight: waves take 0.09 s along it.
const HANGING: &str = "version = 1\ndt = 0.005\nsteps = 40\nprecision = \"f64\"\n[[body]]\nname = \"sheet\"\n\
    mesh = { grid = [21, 21], spacing = 0.05, plane = \"upright\" }\nmass = { particle = 0.01 }\npins = [\"top\"]\n\
    springs = { stretch = { stiffness = 500 }, shear = { stiffness = 100 } }\n";

fn shipped(name: &str) -> Scene {
    let (_, text) = shipped_scenes().iter().find(|(known, _)| *known == name).expect("it is shipped");
    Scene::parse(text, name).unwrap_or_else(|error| panic!("{error}"))
}

fn case(scene: &Scene) -> Case {
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    Case::new("scene", built.setup, built.initial_changes, scene.precision).expect("cloth or snow")
}

/// Where particles are at the start, and after some steps.
fn states(scene: &Scene, steps: u64) -> [Vec<[f64; 3]>; 2] {
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (mut simulation, _) = Simulation::new(&built.setup, scene.precision).expect("a scene");
    let start = positions(&simulation);
    advance(&mut simulation, steps);
    [start, positions(&simulation)]
}

/// The points that the cloths of two scenes have in common.
fn of_cloth(fine: &Scene, coarse: &Scene) -> CommonPoints {
    let bodies = fine.bodies.iter().zip(&coarse.bodies);
    let grids: Vec<[[u32; 2]; 2]> = bodies
        .map(|(fine, coarse)| {
            let CoarserGrid { fine, coarse } = CoarserGrid::between(&fine.mesh, &coarse.mesh).expect("grids");
            [fine, coarse]
        })
        .collect();
    CommonPoints::of_cloth(&case(fine), &case(coarse), &grids).expect("the same bodies")
}

fn squared(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum()
}

/// Where a grid of `columns` is at a place between its particles.
fn between(x: &[[f64; 3]], columns: usize, [across, down]: [f64; 2]) -> [f64; 3] {
    let rows = x.len() / columns;
    let [left, top] = [(across as usize).min(columns - 2), (down as usize).min(rows - 2)];
    let [u, v] = [across - left as f64, down - top as f64];
    let at = |row: usize, column: usize, axis: usize| x[row * columns + column][axis];
    [0, 1, 2].map(|axis| {
        let upper = at(top, left, axis) * (1.0 - u) + at(top, left + 1, axis) * u;
        let lower = at(top + 1, left, axis) * (1.0 - u) + at(top + 1, left + 1, axis) * u;
        upper * (1.0 - v) + lower * v
    })
}

#[test]
fn distances_of_cloth_are_those_of_a_program_of_its_own() {
    for (name, by, steps, [columns, rows], [few, rest], pins) in [
        ("hanging_sheet", 3, 10, [40, 40], [14, 14], vec![0, 13]),
        ("hanging_sheet", 2, 10, [40, 40], [20, 20], vec![0, 19]),
        ("flag", 2, 10, [60, 40], [30, 20], (0..20).map(|row| 30 * row).collect()),
        ("demo", 3, 4, [88, 88], [30, 30], Vec::<usize>::new()),
    ] {
        let fine = shipped(name);
        let coarse = fine.coarser(by).unwrap_or_else(|error| panic!("{error}"));
        let points = of_cloth(&fine, &coarse);
        let [[_, of_fine], [_, of_coarse]] = [&fine, &coarse].map(|scene| states(scene, steps));
        assert_eq!((of_fine.len(), of_coarse.len()), (columns * rows, few * rest), "{name} by {by}");
        let free: Vec<usize> = (0..few * rest).filter(|i| !pins.contains(i)).collect();
        let squares = free.iter().map(|i| {
            let place = [(i % few, columns, few), (i / few, rows, rest)]
                .map(|(place, fine, coarse)| (place * (fine - 1)) as f64 / (coarse - 1) as f64);
            squared(of_coarse[*i], between(&of_fine, columns, place))
        });
        let own = (squares.sum::<f64>() / free.len() as f64).sqrt();
        let told = points.rms(of_coarse.as_flattened(), of_fine.as_flattened());
        assert_eq!(points.count(), free.len(), "{name} by {by}");
        assert!(own > 0.0 && (told / own - 1.0).abs() < 1e-9, "{name} by {by}: {told:e} m, not {own:e} m");
    }
}

#[test]
fn distances_of_snow_are_those_of_a_program_of_its_own() {
    for (name, steps) in [("two_snowballs", 2), ("block_on_incline", 2)] {
        let fine = Scene { precision: Precision::F64, ..shipped(name) };
        let coarse = fine.coarser(2).unwrap_or_else(|error| panic!("{error}"));
        let points = CommonPoints::of_snow(&case(&fine), &case(&coarse)).expect("snow of the same objects");
        let [[x0, x], [y0, y]] = [&fine, &coarse].map(|scene| states(scene, steps));
        let flat = |x: &[[f64; 3]]| x.as_flattened().to_vec();
        // Nothing has moved at the start.
        assert!(points.rms(&flat(&y0), &flat(&x0)) < 1e-12, "{name}");

        // Objects are far from each other, so that the nearest particle is one of the same object.
        let mut moved = vec![([0.0; 3], 0.0); y0.len()];
        let cell = coarse.snow.as_ref().expect("snow").cell;
        for (begin, end) in x0.iter().zip(&x) {
            let near = y0.iter().enumerate().map(|(i, y)| (squared(*y, *begin), i));
            let (distance, i) = near.min_by(|(a, _), (b, _)| a.total_cmp(b)).expect("particles");
            if distance <= cell * cell {
                for axis in 0..3 {
                    moved[i].0[axis] += end[axis] - begin[axis];
                }
                moved[i].1 += 1.0;
            }
        }
        let squares: Vec<f64> = (0..y.len())
            .filter(|i| moved[*i].1 > 0.0)
            .map(|i| {
                let (sum, count) = moved[i];
                squared([0, 1, 2].map(|axis| y[i][axis] - y0[i][axis]), sum.map(|sum| sum / count))
            })
            .collect();
        let own = (squares.iter().sum::<f64>() / squares.len() as f64).sqrt();
        let told = points.rms(&flat(&y), &flat(&x));
        assert_eq!(points.count(), squares.len(), "{name}");
        assert!(own > 0.0 && (told / own - 1.0).abs() < 1e-6, "{name}: {told:e} m, not {own:e} m");
    }
}

#[test]
fn a_copy_is_nearer_to_the_fine_scene_than_one_whose_masses_or_springs_are_wrong() {
    let fine = Scene::parse(HANGING, "hanging.toml").unwrap_or_else(|error| panic!("{error}"));
    let right = fine.coarser(2).unwrap_or_else(|error| panic!("{error}"));
    let set = |key: &str, value: &str| {
        let values = [(key.to_owned(), value.to_owned())];
        right.with_values(&values).unwrap_or_else(|error| panic!("{error}"))
    };
    let points = of_cloth(&fine, &right);
    let [_, there] = states(&fine, fine.steps);
    let distance = |scene: &Scene| {
        let [_, here] = states(scene, scene.steps);
        points.rms(here.as_flattened(), there.as_flattened())
    };
    let least = distance(&right);
    for (key, value) in [
        ("body.sheet.mass.particle", "0.01"),
        ("body.sheet.mass.particle", "0.02"),
        ("body.sheet.springs.stretch.stiffness", "1000"),
        ("body.sheet.springs.stretch.stiffness", "250"),
    ] {
        let wrong = distance(&set(key, value));
        assert!(2.0 * least < wrong, "{key} = {value}: {wrong:e} m, and {least:e} m of the copy");
    }
}

#[test]
fn other_bodies_and_other_objects_have_no_points_in_common() {
    let cloth = Scene::parse(HANGING, "hanging.toml").unwrap_or_else(|error| panic!("{error}"));
    let [fine, coarse] = [case(&cloth), case(&cloth.coarser(2).unwrap_or_else(|error| panic!("{error}")))];
    assert!(CommonPoints::of_cloth(&fine, &coarse, &[[[21, 21], [11, 11]]]).is_some());
    assert_eq!(CommonPoints::of_cloth(&fine, &coarse, &[[[21, 20], [11, 11]]]), None);
    assert_eq!(CommonPoints::of_cloth(&fine, &coarse, &[[[21, 21], [11, 12]]]), None);
    assert_eq!(CommonPoints::of_cloth(&fine, &coarse, &[]), None);
    assert_eq!(CommonPoints::of_snow(&fine, &coarse), None);
}

/// Where particles are after each step of a scene.
fn every_step(scene: &Scene, steps: u64) -> Vec<Vec<[f64; 3]>> {
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let (mut simulation, _) = Simulation::new(&built.setup, scene.precision).expect("a scene");
    let states = (0..steps).map(|_| {
        advance(&mut simulation, 1);
        positions(&simulation)
    });
    states.collect()
}

/// The largest over states of the rms distance (m) of the free particles of the copy of the sheet, 11 x 11, from those of the sheet at
/// their places, every second of 21 x 21.
fn farthest(coarse: &[Vec<[f64; 3]>], fine: &[Vec<[f64; 3]>]) -> f64 {
    let rms = |(coarse, fine): (&Vec<[f64; 3]>, &Vec<[f64; 3]>)| {
        let squares = (11..121).map(|i| squared(coarse[i], fine[2 * (i / 11) * 21 + 2 * (i % 11)]));
        (squares.sum::<f64>() / 110.0).sqrt()
    };
    coarse.iter().zip(fine).map(rms).fold(0.0, f64::max)
}

/// A scene by velocity Verlet, in so many steps in one of the scene.
fn by_verlet(scene: &Scene, parts: u32) -> Scene {
    let mut scene = scene.clone();
    scene.bodies[0].integrator = Integrator::VelocityVerlet;
    scene.bodies[0].substeps = Some(parts);
    scene
}

/// How many steps a setting makes in one of the scene.
fn parts(stepped: &Stepped) -> u32 {
    match stepped {
        Stepped::Cloth(Setting { steps: Steps::Fixed(parts), .. }) => *parts,
        other => panic!("{other:?}"),
    }
}

fn quarter(scene: &Scene) -> Scene {
    scene.coarser(2).unwrap_or_else(|error| panic!("{error}"))
}

fn request(scene: &Scene, tolerance: f64) -> Request {
    Request {
        tolerance,
        end: scene.steps as f64 * scene.dt,
        scene_steps: scene.steps,
        times: None,
        methods: vec!["velocity_verlet".to_owned()],
        precisions: vec![Precision::F64],
        effort: None,
    }
}

/// A plan of the sheet, which leaves particles out where it can.
fn planned(fine: &Scene, tolerance: f64) -> Plan {
    let names = |_: &Stepped| -> Vec<String> { vec!["particles: a quarter".to_owned()] };
    let without = |stepped: &Stepped, places: &[usize]| -> Result<Case, String> {
        let whole = by_verlet(fine, parts(stepped));
        Ok(case(&if places.is_empty() { whole } else { quarter(&whole) }))
    };
    let grids = [[[21, 21], [11, 11]]];
    let terms = SceneTerms { names: &names, without: &without, grids: &grids, wanted: Terms::LeftOut };
    plan(&case(fine), &request(fine, tolerance), &terms, &Budget::new(None), &|_| ())
}

#[test]
fn a_plan_that_takes_a_quarter_of_the_particles_has_the_error_that_it_says_and_runs_to_its_end() {
    let fine = Scene::parse(HANGING, "hanging.toml").unwrap_or_else(|error| panic!("{error}"));
    let found = planned(&fine, 0.04);
    let stepped = found.row.as_ref().filter(|_| found.is_met).expect("a row").stepped;
    let whole = by_verlet(&fine, parts(&stepped));
    let of_fine = every_step(&whole, (found.chart.until() / fine.dt).round() as u64);
    // It runs to its end.
    let of_coarse = every_step(&quarter(&whole), fine.steps);
    assert_eq!(found.reach.as_ref().map(|reach| reach.steps), Some(fine.steps));

    let term = &found.terms[0];
    assert!(term.is_left_out && !term.is_needed, "{term:?}");
    let (change, own) = (term.change.expect("it ran"), farthest(&of_coarse, &of_fine));
    assert!(own > 1e-4 && (change / own - 1.0).abs() < 1e-6, "{change:e} m, not {own:e} m");

    let said = found.written().and_then(Row::error).expect("an error");
    let truth = every_step(&by_verlet(&fine, 32), of_fine.len() as u64);
    let error = farthest(&of_coarse, &truth);
    assert!(said <= 0.04 && error < 1.5 * said && said < 1.5 * error, "{error:e} m, not {said:e} m");
}

#[test]
fn a_plan_keeps_the_particles_where_fewer_move_the_answer_too_far() {
    let fine = Scene::parse(HANGING, "hanging.toml").unwrap_or_else(|error| panic!("{error}"));
    let found = planned(&fine, 5e-4);
    let term = &found.terms[0];
    assert!(found.is_met && term.is_looked_at && term.is_needed && !term.is_left_out, "{term:?}");
    assert!(found.reduced.is_none());
}

#[test]
fn rows_of_a_coarser_copy_are_as_far_from_the_reference_as_a_program_of_its_own_says() {
    let fine = Scene::parse(HANGING, "hanging.toml").unwrap_or_else(|error| panic!("{error}"));
    let coarse = quarter(&fine);
    let copy = Coarser { points: of_cloth(&fine, &coarse), case: case(&coarse) };
    let budget = Budget::new(None);
    let mut found = chart(&case(&fine), &request(&fine, 1e-3), &budget, &|_| ());
    let rows = found.rows.clone();
    add_coarser(&mut found, &copy, &budget.until(1.0), &|_| ());
    assert_eq!(found.rows, rows);

    let reference = found.reference.as_ref().expect("a reference");
    let points = |states: &[Vec<f64>]| -> Vec<Vec<[f64; 3]>> {
        let of_state = |state: &Vec<f64>| -> Vec<[f64; 3]> {
            state.chunks_exact(3).map(|x| [x[0], x[1], x[2]]).collect()
        };
        states.iter().map(of_state).collect()
    };
    let rows = &found.coarser.as_ref().expect("rows of the copy").rows;
    assert_eq!(rows.iter().filter(|row| row.own && row.error().is_some()).count(), 1, "{rows:?}");
    let held: Vec<&Row> = rows.iter().filter(|row| !row.own && row.error().is_some()).collect();
    assert!(held.len() >= 2, "{rows:?}");
    for row in held {
        let made = run(&copy.case, row.stepped, &reference.times, &budget.until(1.0));
        let own = farthest(&points(&made.states), &points(&reference.states));
        let told = row.error().expect("it held");
        assert!((told / own - 1.0).abs() < 1e-9, "{told:e} m, not {own:e} m");
        assert!(told > 1e-4 && row.centre_error.is_none(), "{row:?}");
    }
}

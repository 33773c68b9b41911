//! Coarser copies of scenes against the fine ones: distances at common points by a program of the test's own, and what they would be
//! of a copy that is made wrongly.

use nappe_scene::{CoarserGrid, NoMeshes, Scene, SceneLimits, shipped_scenes};
use nappe_sim::{math::Precision, world::Simulation};
use nappe_study::{Case, CommonPoints};
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

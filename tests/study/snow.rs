//! Snow on a chart: particles split into eight, references by halved cells, rows against the error of symplectic Euler.

use nappe_sim::{
    collide::Contact,
    math::Precision,
    snow::{Kernel, Preset, Transfer},
    time_step::TimeStep,
};
use nappe_study::{
    Budget, CHILDREN, Case, Chart, Limit, Request, Row, Times, Variant, chart, parents, split,
};
use nappe_tests::{
    Random,
    snow::{SnowScene, elastic, lattice, object, plane},
    threads::with_threads,
};

const GRAVITY: f64 = 9.81;
/// Side of a cell, and edge of a particle (m).
const CELL: f64 = 0.1;
const EDGE: f64 = 0.5 * CELL;
/// Time step of the world, and the end (s).
const DT: f64 = 0.01;
const END: f64 = 0.04;

/// A block of so many particles along each axis, its lowest face so high (m), in certified steps.
fn block(count: usize, height: f64) -> SnowScene {
    let preset = Preset::from_name("stomakhin").expect("a preset");
    let x = lattice([0.0, height, 0.0], [count; 3], [EDGE; 3]);
    let body = object("block", x, EDGE.powi(3), preset.density, preset.material);
    let variant = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let mut scene = SnowScene::new(vec![body], CELL, DT).by(variant).under([0.0, -GRAVITY, 0.0]);
    scene.settings.time_step = TimeStep::default();
    scene
}

fn charted(scene: &SnowScene, methods: &[&str]) -> Chart {
    let case = Case::new("block", scene.setup(), Vec::new(), Precision::F32).expect("snow");
    let request = Request {
        tolerance: 1e-3,
        end: END,
        scene_steps: 4,
        times: Some(Times::until(END, DT).expect("a multiple")),
        methods: methods.iter().map(|&name| name.to_owned()).collect(),
        precisions: Precision::ALL.to_vec(),
        effort: None,
    };
    chart(&case, &request, &Budget::new(None), &|_| ())
}

#[test]
fn rows_of_a_block_that_falls_freely_differ_by_the_error_of_symplectic_euler_alone() {
    let chart = charted(&block(3, 1.0), &[]);
    let reference = chart.reference.as_ref().expect("a reference");
    assert_eq!((&chart.limit, chart.rows.len(), chart.is_cut), (&Limit::Asked, 49, false));
    // It knows by how much it falls too far, by the order that its runs show.
    let farther = |dt: f64| 0.5 * GRAVITY * END * dt;
    assert!(reference.orders.iter().all(|order| (order - 1.0).abs() < 0.05), "{:?}", reference.orders);
    assert!((reference.error() / farther(reference.step) - 1.0).abs() < 0.05, "{}", reference.error());
    // It is so near that f32 would be too rough.
    assert_eq!((reference.stepped.cell(), reference.stepped.precision()), (Some(CELL / 8.0), Precision::F64));

    for row in &chart.rows {
        let expected = farther(row.dt - reference.step);
        let label = format!("{} {}, {} m, {} s", row.stepped.name(), row.stepped.precision(), CELL, row.dt);
        let error = row.error().unwrap_or_else(|| panic!("{label}: {:?}", row.end));
        let rounding = if row.stepped.precision() == Precision::F64 { 1e-9 } else { 2e-6 };
        assert!((error - expected).abs() < rounding, "{label}: {error:e} m, not {expected:e} m");
        assert!((row.centre_error.expect("a centre") - expected).abs() < rounding, "{label}");
        assert!(!row.below_floor, "{label}: {error:e} m, floor {:e} m", chart.floor);
    }
    // Steps of two lengths on cells of two.
    for cell in [CELL, 2.0 * CELL] {
        let dt: Vec<f64> =
            chart.rows.iter().filter(|row| row.stepped.cell() == Some(cell)).map(|row| row.dt).collect();
        let [least, most] = [f64::min, f64::max].map(|of| dt.iter().copied().reduce(of).expect("rows"));
        assert!(most > 1.7 * least, "{cell} m: {least} s to {most} s");
    }
}

#[test]
fn splitting_keeps_mass_momentum_centre_and_what_particles_are_made_of() {
    let mut random = Random::seeded(7);
    let x: Vec<_> = (0..200).map(|_| random.vector()).collect();
    let mut whole = object("cloud", x, 1.0, 1.0, elastic(1e5, 0.2));
    whole.v = (0..200).map(|_| random.vector()).collect();
    whole.mass = (0..200).map(|_| random.between(0.5, 2.0)).collect();
    whole.volume = (0..200).map(|_| random.between(1e-4, 1e-3)).collect();
    whole.stiffness = (0..200).map(|_| random.between(0.5, 2.0)).collect();
    let children = split(&whole, CELL);
    assert_eq!(children.x.len(), CHILDREN * 200);
    let sum = |values: &[f64]| values.iter().sum::<f64>();
    let moment = |mass: &[f64], of: &[[f64; 3]]| {
        [0, 1, 2].map(|axis| mass.iter().zip(of).map(|(mass, of)| mass * of[axis]).sum::<f64>())
    };
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12 * b.abs().max(1.0);
    assert!(near(sum(&children.mass), sum(&whole.mass)) && near(sum(&children.volume), sum(&whole.volume)));
    for (of, before) in [(&children.x, &whole.x), (&children.v, &whole.v)] {
        let [after, before] = [moment(&children.mass, of), moment(&whole.mass, before)];
        assert!(
            after.iter().zip(before).all(|(after, before)| near(*after, before)),
            "{after:?}, {before:?}"
        );
    }
    for (i, factor) in whole.stiffness.iter().enumerate() {
        assert!(children.stiffness[CHILDREN * i..CHILDREN * (i + 1)].iter().all(|of| of == factor));
        let away = 0.25 * whole.volume[i].cbrt();
        for child in &children.x[CHILDREN * i..CHILDREN * (i + 1)] {
            for axis in 0..3 {
                assert!(near((child[axis] - whole.x[i][axis]).abs(), away), "particle {i}");
            }
        }
    }
    // And back, twice.
    let grandchildren = split(&children, 0.5 * CELL);
    for (found, halvings) in [(&children, 1), (&grandchildren, 2)] {
        let back = parents(found.x.as_flattened().to_vec(), halvings);
        assert!(back.iter().zip(whole.x.as_flattened()).all(|(back, x)| near(*back, *x)));
    }
}

#[test]
fn a_lattice_whose_volumes_come_from_the_grid_is_split_into_a_finer_lattice() {
    let mut whole = object("block", lattice([0.0; 3], [4; 3], [EDGE; 3]), 1.0, 1.0, elastic(1e5, 0.2));
    whole.volume.clear();
    let mut found = split(&whole, CELL).x;
    let mut finer = lattice([0.0; 3], [8; 3], [0.5 * EDGE; 3]);
    for x in [&mut found, &mut finer] {
        x.sort_by(|a, b| a.partial_cmp(b).expect("numbers"));
    }
    let off = found.as_flattened().iter().zip(finer.as_flattened()).map(|(a, b)| (a - b).abs());
    assert!(off.fold(0.0, f64::max) < 1e-12);
}

/// A block that hits a floor, at 2 m/s.
fn impact() -> SnowScene {
    let mut scene = block(3, 0.05).moving(|_| [0.0, -2.0, 0.0]);
    scene.colliders = vec![plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Separating, 0.5)];
    scene
}

#[test]
fn rows_below_the_floor_are_marked_and_never_on_the_front() {
    let chart = charted(&impact(), &["mls_quadratic", "pic_flip_cubic"]);
    assert!(chart.floor > 1e-4, "{} m", chart.floor);
    assert_eq!(chart.rows.len(), 17);
    for row in &chart.rows {
        assert_eq!(row.below_floor, row.error().is_some_and(|error| error < chart.floor));
        assert!(!(row.below_floor && row.front), "{} at {:?} m", row.stepped.name(), row.error());
    }
    assert!(chart.rows.iter().any(|row| row.front) && chart.rows[0].own);
}

#[test]
fn all_but_seconds_is_the_same_on_any_number_of_threads() {
    let plain = |row: &Row| Row { seconds: None, minimum_seconds: None, front: false, ..row.clone() };
    let rows = |chart: &Chart| chart.rows.iter().map(plain).collect::<Vec<_>>();
    let run = |threads| with_threads(threads, || charted(&impact(), &["apic_cubic"]));
    let [one, two] = [1, 2].map(run);
    assert_eq!((rows(&one), &one.reference, one.floor), (rows(&two), &two.reference, two.floor));
}

#[test]
fn a_period_stays_what_it_is_on_other_cells() {
    for (blocks, cells) in [(1, &[CELL][..]), (2, &[CELL, 2.0 * CELL])] {
        let mut scene = block(2, 0.0).periodic([blocks, 0, 0]);
        let bar = lattice([0.0; 3], [8 * blocks as usize, 2, 2], [EDGE; 3]);
        scene.objects = vec![object("bar", bar, EDGE.powi(3), 400.0, scene.objects[0].material)];
        let chart = charted(&scene, &["mls_quadratic"]);
        let mut found: Vec<f64> = chart.rows.iter().filter_map(|row| row.stepped.cell()).collect();
        found.dedup();
        assert_eq!(found, cells, "{blocks} blocks");
        // A full period falls as a point does: nothing presses it together.
        assert!(
            chart.rows.iter().all(|row| row.error().is_some_and(|error| error < 2e-3)),
            "{blocks} blocks"
        );
    }
}

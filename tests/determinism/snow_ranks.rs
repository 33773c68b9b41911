//! The same bits of snow over ranks, which are threads here.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    collide::Contact,
    math::Precision,
    report::{NoStopwatch, Stopwatch},
    snow::{Blend, Kernel, Preset, SnowObject, Transfer},
    time_step::TimeStep,
    world::{Simulation, WorldSetup},
};
use nappe_tests::{
    networks::scatter,
    ranks::{on_ranks, on_ranks_with_drawn_parts},
    snow::{SnowScene, Variant, lattice, object, plane},
    threads::{THREAD_COUNTS, with_threads},
};

use crate::{ranks::spinning, snow::SnowRun};

/// Numbers of ranks over which results must not change.
const RANK_COUNTS: [usize; 4] = [2, 3, 4, 7];

/// A simulation of one process, or of one of several ranks.
pub(crate) fn made(setup: &WorldSetup, precision: Precision, ranks: Option<Arc<dyn Cluster>>) -> Simulation {
    let made = match ranks {
        Some(ranks) => Simulation::over(setup, precision, ranks),
        None => Simulation::new(setup, precision),
    };
    made.expect("it is in").0
}

/// What each of so many steps says until one fails.
pub(crate) fn said(simulation: &mut Simulation, steps: u64, watch: &mut dyn Stopwatch) -> Vec<String> {
    let mut said = Vec::new();
    for _ in 0..steps {
        match simulation.step(watch) {
            Ok(report) => said.push(format!("{report:?}")),
            Err(error) => {
                said.push(error.to_string());
                break;
            }
        }
    }
    said
}

/// What each step says until one fails, and the hash at the end; whole on rank 0 of several.
pub(crate) fn run(
    setup: &WorldSetup,
    precision: Precision,
    steps: u64,
    ranks: Option<Arc<dyn Cluster>>,
) -> (Vec<String>, u64) {
    prepared(setup, precision, steps, ranks, |_| {})
}

/// The same of a simulation that something is done with before its first step.
pub(crate) fn prepared(
    setup: &WorldSetup,
    precision: Precision,
    steps: u64,
    ranks: Option<Arc<dyn Cluster>>,
    prepare: impl Fn(&mut Simulation),
) -> (Vec<String>, u64) {
    let mut simulation = made(setup, precision, ranks);
    prepare(&mut simulation);
    let said = said(&mut simulation, steps, &mut NoStopwatch);
    let (mut whole, _) = Simulation::new(setup, precision).expect("it is in");
    whole.put(&simulation.take());
    (said, whole.state_hash())
}

#[test]
fn every_explicit_run_says_the_same_over_ranks_and_has_the_same_hash() {
    let mut compared = 0;
    for (seed, snow) in (0..).zip(SnowRun::repeated().into_iter().filter(SnowRun::is_explicit)) {
        let setup = snow.scene().setup();
        let alone = run(&setup, snow.precision, snow.steps(), None);
        let work = |ranks: Arc<dyn Cluster>| run(&setup, snow.precision, snow.steps(), Some(ranks));
        let equal = RANK_COUNTS.map(|size| (size, on_ranks(size, 1 + size % 2, work)));
        let drawn = [4, 7].map(|size| (size, on_ranks_with_drawn_parts(seed, size, 1 + size % 2, work)));
        for (size, over) in equal.into_iter().chain(drawn) {
            assert!(over[0].0.1 == alone.1, "{} on {size} ranks: another hash", snow.key());
            for ((said, _), _) in over {
                assert_eq!(said, alone.0, "{} on {size} ranks", snow.key());
            }
            compared += 1;
        }
    }
    // Eighteen rows, four counts of ranks, and two with parts that are drawn.
    assert_eq!(compared, 108);
}

#[test]
fn snow_in_the_wind_says_the_same_over_ranks_and_threads() {
    let mut scene = certified(vec![block("block", [-0.4, 0.05, -0.2], [12, 6, 8], [1.0, -2.0, 0.0])]);
    scene.settings.drag = 3.0;
    let wind_at = vec![(0.0, [20.0, 0.0, 0.0]), (0.02, [0.0, 5.0, -9.0])];
    let setup = WorldSetup { wind_at, ..scene.setup() };
    for precision in Precision::ALL {
        let alone = run(&setup, precision, 4, None);
        for threads in THREAD_COUNTS {
            let said = with_threads(threads, || run(&setup, precision, 4, None));
            assert_eq!(said, alone, "{precision} on {threads} threads");
        }
        for size in RANK_COUNTS {
            let over = on_ranks(size, 1 + size % 2, |ranks| run(&setup, precision, 4, Some(ranks)));
            assert_eq!(over[0].0.1, alone.1, "{precision} on {size} ranks: another hash");
            for ((said, _), _) in over {
                assert_eq!(said, alone.0, "{precision} on {size} ranks");
            }
        }
    }
}

/// Side of a cell (m).
pub(crate) const H: f64 = 0.05;

/// A block of snow of so many particles along each axis, at a corner (m), which flies (m/s).
pub(crate) fn block(name: &str, corner: [f64; 3], counts: [usize; 3], v: [f64; 3]) -> SnowObject {
    let snow = Preset::from_name("stomakhin").expect("a preset");
    let x = lattice(corner, counts, [0.5 * H; 3]);
    let mut body = object(name, x, (0.5 * H).powi(3), snow.density, snow.material);
    body.v.fill(v);
    body
}

pub(crate) fn certified(objects: Vec<SnowObject>) -> SnowScene {
    let mut scene = SnowScene::new(objects, H, 4e-3).under([0.0, -9.81, 0.0]);
    scene.settings.time_step = TimeStep::default();
    scene.colliders = vec![plane([0.0, -0.01, 0.0], [0.0, 1.0, 0.0], Contact::Separating, 0.3)];
    scene
}

/// Steps in which the particle of [`stray`] stays among the others.
const STRAY_STEPS: u64 = 3;

/// A bar that is pressed, and through it a light particle that goes by more than two blocks in a step: the last one.
fn stray() -> SnowScene {
    let bar = block("bar", [-0.8, 0.0, 0.0], [64, 4, 4], [0.0; 3]);
    let press = block("press", [-0.8, 0.1, 0.0], [64, 4, 4], [0.0, -8.0, 0.0]);
    let mut light = block("light", [-0.7, 0.0875, 0.0375], [1; 3], [900.0, 0.0, 0.0]);
    light.mass[0] *= 1e-5;
    let mut scene = SnowScene::new(vec![bar, press, light], H, 5e-4);
    scene.settings.transfer = Transfer::PicFlip(Blend::PerStep(1.0));
    scene
}

fn still() -> SnowObject {
    block("still", [0.0; 3], [8, 6, 8], [0.0; 3])
}

fn thrown() -> SnowObject {
    block("thrown", [-0.9, 0.1, 0.02], [8, 8, 6], [12.0, 0.0, 0.3])
}

/// Two blocks that are thrown at one that lies.
pub(crate) fn crossing() -> SnowScene {
    let third = block("third", [0.5, 0.3, 0.0], [6, 6, 6], [-9.0, -4.0, 0.0]);
    certified(vec![still(), thrown(), third])
}

/// The same by PIC/FLIP and the cubic kernel.
pub(crate) fn cubic_crossing() -> SnowScene {
    crossing().by(Variant { kernel: Kernel::Cubic, transfer: Transfer::PicFlip(Blend::PerStep(0.95)) })
}

/// Scenes whose snow goes from rank to rank, each in another way, with steps and a part of what they say.
fn scenes() -> Vec<(&'static str, WorldSetup, u64)> {
    let crossing = crossing();
    let mut spray = certified(vec![block("spray", [0.0, 0.1, 0.0], [7, 7, 7], [0.0; 3])]);
    let SnowObject { x, v, .. } = &mut spray.objects[0];
    for (i, (x, v)) in x.iter_mut().zip(v).enumerate() {
        *x = [1, 2, 3].map(|salt| 0.6 * scatter(i + 1000 * salt) + 0.7);
        *v = [4, 5, 6].map(|salt| 9.0 * scatter(i + 1000 * salt));
    }
    // What flies alone empties the ranks that it comes from.
    let mut lone = certified(vec![block("lone", [-0.4, 0.2, 0.0], [4, 4, 4], [14.0, 1.0, 0.0])]);
    lone.colliders.clear();
    let periodic = |blocks: [u32; 3]| {
        let mut scene = certified(vec![still(), thrown()]);
        scene.settings.periodic = blocks;
        scene
    };
    let mut beside_cloth = crossing.setup();
    beside_cloth.bodies = spinning(1.0, 500.0).setup().bodies;
    let mut limited = crossing.clone();
    limited.settings.max_energy = Some(20.0);
    let mut long = crossing.clone();
    long.settings.time_step = TimeStep::Unchecked(4e-3);
    long.dt = 0.04;
    let mut few = crossing.clone();
    few.settings.max_substeps = 3;
    vec![
        ("StepReport", crossing.setup(), 20),
        ("StepReport", cubic_crossing().setup(), 16),
        ("StepReport", beside_cloth, 12),
        ("StepReport", spray.setup(), 12),
        ("StepReport", lone.setup(), 16),
        ("StepReport", periodic([2, 0, 0]).setup(), 12),
        ("StepReport", periodic([3, 0, 4]).setup(), 12),
        ("plastic_ratio_range: [0.9", stray().setup(), STRAY_STEPS),
        ("kinetic and elastic energy", limited.setup(), 20),
        ("node", long.setup(), 10),
        ("3", few.setup(), 4),
    ]
}

#[test]
fn snow_that_goes_from_rank_to_rank_says_and_becomes_what_it_does_alone() {
    for (number, (part, setup, steps)) in scenes().into_iter().enumerate() {
        for (precision, sizes) in [(Precision::F32, &[2, 5, 16][..]), (Precision::F64, &[3])] {
            let alone = run(&setup, precision, steps, None);
            assert!(alone.0.concat().contains(part), "{number}: {part}: {:?}", alone.0);
            for size in sizes.iter().copied() {
                let work = |ranks: Arc<dyn Cluster>| run(&setup, precision, steps, Some(ranks));
                let over = on_ranks(size, 1, work);
                for ((said, _), _) in &over {
                    assert_eq!(*said, alone.0, "scene {number} on {size} ranks");
                }
                assert!(over[0].0.1 == alone.1, "scene {number} on {size} ranks: another hash");
            }
        }
    }
}

#[test]
fn a_particle_that_goes_too_far_to_be_followed_takes_no_count_from_the_report() {
    let mut simulation = stray().simulate(Precision::F32);
    let far = |simulation: &Simulation| simulation.snow_particles().last().expect("a particle").x[0];
    for _ in 0..STRAY_STEPS {
        let before = far(&simulation);
        let report = simulation.step(&mut NoStopwatch).expect("it is stable").snow.expect("snow");
        // Two blocks of four cells.
        assert!(far(&simulation) - before > 8.0 * H);
        assert!(report.plastic_count > 500, "{report:?}");
        let [least, most] = report.plastic_ratio_range;
        assert!((0.5..1.0).contains(&least) && (1.0..1.5).contains(&most), "{report:?}");
    }
}

#[test]
fn a_step_of_snow_asks_as_much_as_its_formula_says() {
    let (_, setup, _) = scenes().swap_remove(0);
    let asked = |steps: u64| {
        let over = on_ranks(3, 1, |ranks| {
            let (mut simulation, _) = Simulation::over(&setup, Precision::F32, ranks).expect("it is in");
            let step =
                |_| simulation.step(&mut NoStopwatch).expect("it is stable").snow.expect("snow").substeps;
            (0..steps).map(step).last().unwrap_or_default()
        });
        over.into_iter().next().expect("a rank")
    };
    let ((_, before), (substeps, after)) = (asked(4), asked(5));
    let substeps = u64::from(substeps);
    // Who leaves, what is needed, what was found, what nodes add up to, and what nodes and particles give to each collider; and
    // of the step of the world what it comes to.
    let each = 4 + 2 * setup.colliders.len() as u64;
    assert_eq!(after.gathers - before.gathers, each * substeps + 1, "{substeps} steps of the snow");
    // Particles, keys, tiles.
    assert_eq!(after.exchanges - before.exchanges, 3 * substeps, "{substeps} steps of the snow");
    // One message to each neighbour, at most: particles and keys that there are, and tiles.
    let messages = after.messages - before.messages;
    assert!(messages <= 3 * 2 * substeps && messages >= 2 * substeps, "{messages}");
}

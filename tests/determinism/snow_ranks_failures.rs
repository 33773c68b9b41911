//! What ends or refuses snow over ranks says so as in one process, on every rank.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    math::Precision,
    report::{NoStopwatch, StepFailure},
    snow::{Blend, Kernel, ParticleState, Transfer},
    time_step::TimeStep,
    world::{Simulation, WorldSetup},
};
use nappe_tests::{
    ranks::on_ranks,
    snow::{SnowScene, Variant, elastic, lattice, object, rework},
};

use crate::snow_ranks::{H, block, certified, crossing, made, prepared, run};

/// What is done with snow before its first step.
type Prepare = Box<dyn Fn(&mut Simulation) + Sync>;

/// Steps until which a step fails.
const STEPS: u64 = 20;

fn cube() -> WorldSetup {
    certified(vec![block("cube", [-0.2, 0.0, 0.1], [12; 3], [0.0; 3])]).setup()
}

/// Elastic blocks of few particles that meet with a speed (m/s), by the kernel that shows how it fails.
fn meeting(speed: f64) -> WorldSetup {
    let body = |name: &str, corner, v| {
        let x = lattice(corner, [4, 3, 3], [H; 3]);
        let mut body = object(name, x, H.powi(3), 400.0, elastic(1.4e5, 0.2));
        body.v.fill(v);
        body
    };
    let bodies = vec![
        body("a", [-0.1, 0.0, 0.0], [speed, 0.0, 0.0]),
        body("b", [0.11, 0.05, 0.05], [-speed, 1.0, 0.0]),
    ];
    let variant = Variant { kernel: Kernel::Linear, transfer: Transfer::PicFlip(Blend::PerStep(1.0)) };
    let mut scene = SnowScene::new(bodies, H, 1e-3).by(variant);
    scene.settings.time_step = TimeStep::default();
    scene.setup()
}

/// Snow that fails, if need be since something is done with it, with a part of what that says.
fn failures() -> Vec<(&'static str, WorldSetup, Prepare)> {
    // The last two blocks of the range are a margin.
    let end = f64::from((1 << 20) - 2) * 4.0 * H;
    let mut pair = block("pair", [0.0; 3], [1; 3], [0.0; 3]);
    pair.x.push([0.15, end - 0.025, 0.1]);
    pair.v.push([0.0, 45.0, 0.0]);
    pair.mass.push(pair.mass[0]);
    pair.volume.push(pair.volume[0]);
    let pair = SnowScene::new(vec![pair], H, 1e-3).setup();
    let mut cloud = certified(vec![block("cloud", [-0.35; 3], [28; 3], [0.0; 3])]);
    cloud.colliders.clear();
    // It falls until it is too fast for its step.
    let mut fixed = crossing().under([1e4, 0.0, 0.0]);
    fixed.colliders.clear();
    fixed.settings.time_step = TimeStep::Fixed(3e-4);
    // The energy rises in about every second of these collisions: the kernel has no bound for few particles.
    let gain = "the total energy rises";
    let rises = |setup: &WorldSetup| run(setup, Precision::F64, STEPS, None).0.concat().contains(gain);
    let gains = (0..20).map(|i| meeting(10.0 + 0.01 * f64::from(i))).find(rises).expect("a rise");
    vec![
        ("velocity", cube(), Box::new(kick)),
        ("came to 5.0000e3", cube(), Box::new(stretch)),
        ("range", pair, Box::new(|_: &mut Simulation| {})),
        (
            "flies apart",
            cloud.setup(),
            Box::new(|s: &mut Simulation| rework(s, |_, p| p.x = p.x.map(|c| 16.0 * c))),
        ),
        ("the time step of", fixed.setup(), Box::new(|_: &mut Simulation| {})),
        (gain, gains, Box::new(|_: &mut Simulation| {})),
    ]
}

fn kick(simulation: &mut Simulation) {
    simulation.kick_snow(|particle, _, _| [0.0, if particle == 700 { f64::NAN } else { 0.5 }, 0.0]);
}

fn stretch(simulation: &mut Simulation) {
    rework(simulation, |i, p| p.elastic[0][0] = if i == 1200 { 5e3 } else { 1.0 });
}

/// What each step says, alone, and the same over three ranks.
fn alone_and_over(setup: &WorldSetup, prepare: &Prepare) -> Vec<String> {
    let alone = prepared(setup, Precision::F64, STEPS, None, prepare).0;
    let work = |ranks: Arc<dyn Cluster>| prepared(setup, Precision::F64, STEPS, Some(ranks), prepare).0;
    for (said, _) in on_ranks(3, 1, work) {
        assert_eq!(said, alone);
    }
    alone
}

#[test]
fn snow_that_fails_says_the_same_over_ranks() {
    for (part, setup, prepare) in failures() {
        let alone = alone_and_over(&setup, &prepare);
        assert!(alone.last().is_some_and(|said| said.contains(part)), "{part}: {alone:?}");
    }
}

/// One of the numbers of a particle.
type Number = fn(&mut ParticleState) -> &mut f64;

/// Numbers of a particle by what they are called where they are not finite.
const NUMBERS: [(&str, Number); 5] = [
    ("position", |particle| &mut particle.x[1]),
    ("velocity", |particle| &mut particle.v[2]),
    ("deformation gradient", |particle| &mut particle.elastic[0][1]),
    ("affine velocity", |particle| &mut particle.affine[2][0]),
    ("plastic volume ratio", |particle| &mut particle.plastic_ratio),
];

#[test]
fn numbers_that_are_not_finite_fail_alike_over_ranks() {
    let setup = cube();
    let (mut failed, mut named) = (0, 0);
    for (what, number) in NUMBERS {
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let prepare: Prepare = Box::new(move |simulation: &mut Simulation| {
                rework(simulation, |i, particle| {
                    if i == 777 {
                        *number(particle) = value;
                    }
                });
            });
            let alone = alone_and_over(&setup, &prepare);
            let last = alone.last().expect("a step");
            failed += usize::from(!last.contains("StepReport"));
            named += usize::from(last.contains(what) && last.contains("777"));
        }
    }
    // A velocity that is infinite asks for a step of length 0 before anything is looked at; a ratio is limited by the law.
    assert!(failed >= 10 && named >= 5, "{failed} fail, {named} with the name of the number");
}

#[test]
fn an_interrupt_of_one_rank_ends_all_at_the_same_place() {
    let mut scene = crossing();
    // Many steps of the snow in each of the world.
    scene.dt = 0.02;
    let setup = scene.setup();
    let work = |ranks: Arc<dyn Cluster>| {
        let rank = ranks.rank();
        let mut simulation = made(&setup, Precision::F32, Some(ranks));
        loop {
            if rank == 1 && simulation.step_count() == 3 {
                simulation.interrupt().request();
            }
            if let Err(error) = simulation.step(&mut NoStopwatch) {
                break (error.step, error.failure);
            }
        }
    };
    let ends = on_ranks(3, 1, work);
    for (end, counts) in &ends {
        assert_eq!(*end, (3, StepFailure::Interrupted));
        assert_eq!((counts.gathers, counts.exchanges), (ends[0].1.gathers, ends[0].1.exchanges));
    }
}

/// Does something on two ranks after their first step.
fn after_a_step(work: fn(&mut Simulation)) {
    let setup = crossing().setup();
    on_ranks(2, 1, |ranks| {
        let mut simulation = made(&setup, Precision::F32, Some(ranks));
        simulation.step(&mut NoStopwatch).expect("it is stable");
        work(&mut simulation);
    });
}

#[test]
#[should_panic(expected = "ranks have begun to step this snow: it is restored before")]
fn snow_that_ranks_step_is_not_restored() {
    after_a_step(|simulation| rework(simulation, |_, _| {}));
}

#[test]
#[should_panic(expected = "ranks have begun to step this snow: it is kicked before")]
fn snow_that_ranks_step_is_not_kicked() {
    after_a_step(|simulation| simulation.kick_snow(|_, _, _| [0.0; 3]));
}

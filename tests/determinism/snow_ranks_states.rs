//! What ranks of snow come to on the way: one has nothing for a while, a step is taken again, a copy goes on by itself.

use std::sync::Arc;

use nappe_cluster::Cluster;
use nappe_sim::{
    field::Field,
    math::Precision,
    report::{NoStopwatch, Stage, Stopwatch},
    world::{Simulation, WorldSetup},
};
use nappe_tests::ranks::on_ranks;

use crate::snow_ranks::{block, certified, crossing, cubic_crossing, made, run, said};

/// Two blocks of 64 particles, each in a block of the grid of its own, which a pull along x turns back.
fn returning() -> WorldSetup {
    let flying = |name: &str, x: f64| block(name, [x, 0.05, 0.05], [4; 3], [-14.0, 0.0, 0.0]);
    let mut scene = certified(vec![flying("left", -0.5), flying("right", 0.12)]).under([200.0, 0.0, 0.0]);
    scene.colliders.clear();
    scene.setup()
}

#[test]
fn a_rank_that_is_emptied_and_filled_again_goes_on() {
    let setup = returning();
    // Of each rank after so many steps: the positions that it tells.
    let own = |steps: u64| {
        let over = on_ranks(2, 1, |ranks| {
            let mut simulation = made(&setup, Precision::F32, Some(ranks));
            said(&mut simulation, steps, &mut NoStopwatch);
            drop(simulation.take_field(Field::Positions));
        });
        // A number and three coordinates in binary32.
        over.iter().map(|((), counts)| counts.given / 16).collect::<Vec<_>>()
    };
    assert_eq!([1, 17, 36].map(own), [vec![64, 64], vec![128, 0], vec![64, 64]]);

    let alone = run(&setup, Precision::F32, 40, None);
    assert!(alone.0.iter().all(|said| said.contains("StepReport")), "{:?}", alone.0);
    let over = on_ranks(2, 1, |ranks| run(&setup, Precision::F32, 40, Some(ranks)));
    assert_eq!(over[1].0.0, alone.0);
    assert_eq!(over[0].0, alone);
}

/// How often the two halves of a step of the snow ended.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Halves {
    first: u64,
    second: u64,
}

impl Stopwatch for Halves {
    fn lap(&mut self, stage: Stage) {
        match stage {
            Stage::ParticlesToGrid => self.first += 1,
            Stage::GridToParticles => self.second += 1,
            _ => {}
        }
    }
}

#[test]
fn a_step_that_nodes_are_too_fast_for_is_taken_again_by_all_ranks() {
    // The pull moves nodes at rest by several cells, within a step that the soft material allows.
    let mut scene = crossing().under([1e4, 0.0, 0.0]);
    scene.colliders.clear();
    for object in &mut scene.objects {
        object.material.young = 1400.0;
        object.v.fill([0.0; 3]);
    }
    let setup = scene.setup();
    let told = |ranks: Option<Arc<dyn Cluster>>| {
        let mut halves = Halves::default();
        let said = said(&mut made(&setup, Precision::F64, ranks), 3, &mut halves);
        (said, halves)
    };
    let alone = told(None);
    assert!(alone.1.first > alone.1.second, "{:?}", alone.1);
    assert!(alone.0.iter().all(|said| said.contains("StepReport")), "{:?}", alone.0);
    for size in [2, 5] {
        for (over, _) in on_ranks(size, 1, |ranks| told(Some(ranks))) {
            assert_eq!(over, alone, "{size} ranks");
        }
    }
    let hash = |ranks: Option<Arc<dyn Cluster>>| run(&setup, Precision::F64, 3, ranks).1;
    assert_eq!(on_ranks(3, 1, |ranks| hash(Some(ranks)))[0].0, hash(None));
}

#[test]
fn a_copy_of_what_ranks_step_goes_on_with_the_bits_of_one_process() {
    const BEFORE: u64 = 6;
    const AFTER: u64 = 8;
    for (setup, precision) in [(crossing(), Precision::F32), (cubic_crossing(), Precision::F64)] {
        let setup = setup.setup();
        let (alone, hash) = run(&setup, precision, BEFORE + AFTER, None);
        let (before, after) = alone.split_at(BEFORE as usize);
        let work = |ranks: Arc<dyn Cluster>| {
            let is_whole = ranks.rank() == 0;
            let mut simulation = made(&setup, precision, Some(ranks));
            assert_eq!(said(&mut simulation, BEFORE, &mut NoStopwatch), before);
            let state = simulation.take();
            assert_eq!(said(&mut simulation, AFTER, &mut NoStopwatch), after, "the ranks go on");
            is_whole.then(|| {
                let (mut whole, _) = Simulation::new(&setup, precision).expect("it is in");
                whole.put(&state);
                let mut copy = whole.fork();
                let said = said(&mut copy, AFTER, &mut NoStopwatch);
                (said, copy.state_hash())
            })
        };
        for size in [2, 5] {
            let over = on_ranks(size, 1, work);
            assert_eq!(over[0].0, Some((after.to_vec(), hash)), "{size} ranks");
        }
    }
}

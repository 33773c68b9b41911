//! The same bits where cloth meets itself: over threads, widths of vectors and forks, and whatever was looked for before.

use nappe_sim::{
    cloth::Network,
    math::{Precision, SimdLevel, force_simd_level, simd_level},
    report::StepFailure,
    world::{BodySetup, Simulation, WorldSetup},
};
use nappe_tests::{
    numbering::Numbering,
    scene::{advance, try_advance},
    sheets::Sheet,
    surface::{Case, bodies_on_a_ball, built, giving_way, on_a_ball, piled, scene, sheet_on_a_plate},
    threads::with_threads,
};

/// Steps in which sheets fall on a ball and on each other, lie in a pile, or are lifted.
const STEPS: u64 = 60;

/// Worlds of several blocks in which surfaces touch, by name.
fn worlds(precision: Precision) -> [(&'static str, WorldSetup); 6] {
    let case = Case { precision, friction: 0.3, numbering: Numbering::AsBuilt };
    let bodies = bodies_on_a_ball(13, [0.03, 0.1], 4e-3, &case);
    let mut one_is_thin = bodies.clone();
    let thin = Sheet::level(13, 0.03, [0.01, 0.25, 0.0], 0.2).network();
    let settings = bodies.bodies[0].settings;
    let thin = BodySetup { name: "thin".to_owned(), network: thin, settings, forces: Vec::new() };
    one_is_thin.bodies.insert(1, thin);
    let on_a_plate = sheet_on_a_plate(&scene(Network::default(), 0.0, 0.3));
    let worlds = [
        ("on a ball", on_a_ball([3, 13], [0.03, 0.1], 4e-3, &case).setup()),
        ("a pile", piled([3, 10], 2e-3, &case).setup()),
        ("bodies on a ball", bodies),
        ("a thin body between others", one_is_thin),
        ("a figure in mid-walk", on_a_plate.clone()),
        ("a figure that gives way", giving_way(on_a_plate, 1e3)),
    ];
    worlds.map(|(name, mut world)| {
        world.bodies.iter_mut().for_each(|body| body.settings.block_size = 64);
        (name, world)
    })
}

/// The simulation after all steps, of which pairs must have pushed in some.
fn stepped(world: &WorldSetup, precision: Precision) -> Simulation {
    let mut simulation = built(world, precision);
    let pushed = |simulation: &mut Simulation| advance(simulation, 1).surface.map_or(0, |told| told.active);
    let most = (0..STEPS).map(|_| pushed(&mut simulation)).max();
    assert!(most > Some(10), "{most:?} pairs pushed");
    simulation
}

#[test]
fn cloth_that_meets_itself_has_the_same_bits_for_1_to_4_threads_and_every_width_of_vectors() {
    let best = simd_level();
    for precision in Precision::ALL {
        for (name, world) in worlds(precision) {
            let alone = with_threads(1, || stepped(&world, precision).state_hash());
            for threads in 2..=4 {
                let hash = with_threads(threads, || stepped(&world, precision).state_hash());
                assert_eq!(hash, alone, "{name} in {precision} on {threads} threads");
            }
            for level in SimdLevel::ALL {
                let used = force_simd_level(*level);
                assert_eq!(
                    stepped(&world, precision).state_hash(),
                    alone,
                    "{name} in {precision} by {used:?}"
                );
            }
            force_simd_level(best);
        }
    }
}

#[test]
fn a_fork_of_cloth_that_meets_itself_goes_on_with_the_same_bits() {
    for precision in Precision::ALL {
        for (name, world) in worlds(precision) {
            let whole = stepped(&world, precision).state_hash();
            let mut before = built(&world, precision);
            for at in 1..STEPS {
                advance(&mut before, 1);
                if at % 12 == 0 {
                    let mut fork = before.fork();
                    advance(&mut fork, STEPS - at);
                    assert_eq!(fork.state_hash(), whole, "{name} in {precision}, forked after step {at}");
                }
            }
        }
    }
}

#[test]
fn nothing_of_the_contact_of_cloth_with_itself_is_state() {
    for precision in Precision::ALL {
        for (name, world) in worlds(precision) {
            let whole = stepped(&world, precision).state_hash();
            let start = built(&world, precision);
            let (mut state, mut hash) = (start.take(), start.state_hash());
            for _ in 0..STEPS {
                // It was built for this step, and knows nothing but the state.
                let mut fresh = built(&world, precision);
                fresh.put(&state);
                advance(&mut fresh, 1);
                (state, hash) = (fresh.take(), fresh.state_hash());
            }
            assert_eq!(hash, whole, "{name} in {precision}");
        }
    }
}

#[test]
fn steps_that_are_taken_again_with_more_room_for_pairs_have_the_same_bits() {
    for precision in Precision::ALL {
        for (name, world) in worlds(precision) {
            let whole = stepped(&world, precision).state_hash();
            let (mut simulation, mut again) = (built(&world, precision), 0);
            simulation.limit_pair_memory(0);
            while simulation.step_count() < STEPS {
                let before = simulation.state_hash();
                let Err(error) = try_advance(&mut simulation, 1) else { continue };
                let StepFailure::PairMemory { bytes } = error.failure else { panic!("{name}: {error}") };
                assert_eq!(simulation.state_hash(), before, "{name} in {precision}: {error}");
                simulation.limit_pair_memory(bytes);
                again += 1;
            }
            assert_eq!(simulation.state_hash(), whole, "{name} in {precision}");
            assert!(again > 0 && simulation.pair_memory_bytes() > 0, "{name} in {precision}: {again} again");
            assert_eq!(simulation.fork().pair_memory_bytes(), 0, "a fork has no pairs yet");
        }
    }
}

//! The bits of cloth that sleeps: beside a run without sleep, in forks and in states that are put back, and on any number of threads.

use nappe_sim::{
    math::Precision,
    report::RestReport,
    world::{Change, Simulation},
};
use nappe_tests::{
    scene::{advance, of_text},
    threads::{THREAD_COUNTS, with_threads},
};

use super::{Compared, FLOOR, Sheet, asleep, beside, hanging, pinned, scene};

#[test]
fn the_bits_are_those_without_sleep_until_something_sleeps_and_the_hash_knows_of_it() {
    for compared in [beside(), hanging()] {
        let Compared { name, steps, root, parts, .. } = compared;
        let of = |sleep: bool| {
            let rest = format!("error = 1e-3, sleep = {sleep}");
            of_text(&scene(steps, root, &rest, &parts), Precision::F32)
        };
        let [mut sleeps, mut awake] = [of(true), of(false)];
        let first = (1..=steps).find(|step| {
            let slept = advance(&mut sleeps, 1).rest.expect("it is watched").pieces_asleep > 0;
            advance(&mut awake, 1);
            let is_same = sleeps.state_hash() == awake.state_hash();
            assert_eq!(is_same, !slept, "{name}, step {step}");
            slept
        });
        assert!(first.is_some(), "{name}: nothing slept");
    }
}

/// What each of some steps tells, and the hash after it.
fn told(simulation: &mut Simulation, steps: u64) -> Vec<(Option<RestReport>, u64)> {
    (0..steps).map(|_| (advance(simulation, 1).rest, simulation.state_hash())).collect()
}

#[test]
fn forks_and_states_that_are_put_back_sleep_on_with_the_same_bits() {
    let Compared { steps, root, parts, .. } = beside();
    let text = scene(steps, root, "error = 1e-3", &parts);
    for precision in Precision::ALL {
        let expected = told(&mut of_text(&text, precision), 130);
        let slept = expected.iter().filter(|(rest, _)| rest.is_some_and(|rest| rest.pieces_asleep > 0));
        assert!(slept.count() > 50, "{precision}");
        let mut cut = of_text(&text, precision);
        for step in 1..=90_usize {
            advance(&mut cut, 1);
            if step < 20 || step % 3 > 0 {
                continue;
            }
            let (mut fork, mut fresh) = (cut.fork(), of_text(&text, precision));
            let state = cut.take();
            state.check(&fresh).expect("a state of this scene");
            fresh.put(&state);
            for simulation in [&mut fork, &mut fresh] {
                assert_eq!(
                    told(simulation, 40),
                    expected[step..step + 40],
                    "{precision}, cut after step {step}"
                );
            }
        }
    }
}

#[test]
fn a_state_that_sleeps_is_refused_where_nothing_may_sleep() {
    let state = asleep("", 100).take();
    let check = |sleep: bool| {
        let text = scene(400, "", &format!("error = 1e-3, sleep = {sleep}"), &pinned());
        state.check(&of_text(&text, Precision::F64)).map_err(|error| error.to_string())
    };
    assert_eq!(check(true), Ok(()));
    let message = check(false).expect_err("nothing may sleep");
    assert!(message.contains("how still it lies"), "{message}");
}

#[test]
fn what_sleeps_has_the_same_bits_for_any_number_of_threads_and_after_a_reset() {
    // Sheets of more than one block.
    let sheets = ["one", "two"].into_iter().enumerate().map(|(place, name)| {
        let keys = if place == 0 { "drag = 1e-3" } else { "drag = 1e-3\nvelocity = [0, 0.3, 0]" };
        Sheet { name, side: 18, at: [2.0 * place as f64, 0.01, 0.0], keys }.text()
    });
    let text = scene(80, "", "error = 1e-3", &(sheets.collect::<String>() + FLOOR));
    let run = || {
        let mut simulation = of_text(&text, Precision::F32);
        let first = told(&mut simulation, 80);
        simulation.apply(&[Change::Reset]).expect("a world can be reset");
        (first, told(&mut simulation, 80))
    };
    let expected = with_threads(1, run);
    for told in [&expected.0, &expected.1] {
        let slept = told.iter().filter(|(rest, _)| rest.is_some_and(|rest| rest.pieces_asleep > 0));
        assert!(slept.count() > 40);
    }
    let (first, again) = (expected.0[0].0, expected.1[0].0);
    assert_eq!(first, again, "a reset forgets that it slept");
    for threads in THREAD_COUNTS {
        assert_eq!(with_threads(threads, run), expected, "{threads} threads");
    }
}

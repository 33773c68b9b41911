//! The preconditioner on two levels over ranks, which are threads here: the same words, reports and bits as by one, whether
//! they divide the finest level of its coarse space or all do the same.

use nappe_sim::{
    cloth::{Hessian, Minimizer, NewtonSettings, Spring},
    linalg::{PreconditionerKind, Stop},
    math::Precision,
    report::NoStopwatch,
    time_step::TimeStep,
    world::{Change, Simulation},
};
use nappe_tests::{
    Scene,
    networks::scatter,
    ranks::{Counts, DIVIDES_FROM, on_ranks_that_divide},
    scene::advance,
};

use crate::ranks::{asked_of, drawn_of, failure, falling_of, spinning_of};

/// Steps of each scene, unless it fails before.
const STEPS: u64 = 6;

/// A sheet that spins, of so many blocks that its coarse space has several levels.
fn spinning(omega: f64, stiffness: f64) -> Scene {
    coarse(spinning_of(40, omega, stiffness))
}

fn coarse(mut scene: Scene) -> Scene {
    scene.settings.solver.preconditioner = PreconditionerKind::TwoLevel;
    scene
}

/// A flat sheet pressed to half of its size, which the matrix of exact tangents pushes further: so far that the coarse space
/// is indefinite.
fn unfit() -> Scene {
    let mut scene = spinning(0.0, 200.0);
    for x in &mut scene.network.x {
        *x = [0.5 * x[0], 0.0, 0.5 * x[2]];
    }
    scene.dt = 0.5;
    scene.settings.time_step = TimeStep::Unchecked(scene.dt);
    scene.settings.hessian = Hessian::Full;
    scene
}

/// Scenes that are solved, divided, rejected or given up, with a part of what they say.
fn scenes() -> Vec<(&'static str, Scene)> {
    let squeezed = |side: usize| {
        let mut scene = coarse(spinning_of(side, 0.0, 200.0)).certified();
        for (i, x) in scene.network.x.iter_mut().enumerate() {
            *x = [0.7 * x[0], 1e-3 * scatter(i), 0.7 * x[2]];
        }
        scene.dt = 0.05;
        scene
    };
    let mut indefinite = squeezed(40);
    indefinite.settings.hessian = Hessian::Full;
    let mut buckled = squeezed(40);
    buckled.settings.minimizer = Minimizer::Newton(NewtonSettings { tolerance: 0.1, max_iterations: 6 });
    let mut inaccurate = spinning(30.0, 1e4).certified();
    inaccurate.settings.tolerance = Some(1e-9);
    // Whole blocks of it, and most of others.
    let mut pinned = spinning(1.0, 1e4).under([0.0, -9.81, 0.0]);
    pinned.network.pins = (0..900).collect();
    let mut chosen = spinning(1.0, 1e6);
    chosen.settings.solver.preconditioner = PreconditionerKind::Auto;
    chosen.settings.solver.stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    vec![
        ("Converged", spinning(1.0, 1e4)),
        ("Some(TwoLevel)", chosen),
        ("Descent", spinning(30.0, 1e6).certified()),
        ("NegativeCurvature", indefinite),
        ("IterationCap", buckled),
        ("has an estimated error of", inaccurate),
        ("Converged", pinned),
        // Blocks enough for some of the ranks alone.
        ("Converged", coarse(spinning_of(9, 1.0, 1e4))),
        ("NegativeCurvature", unfit()),
    ]
}

/// Steps a scene alone and over ranks, in all of which it says the same, a part of which is known.
fn says_the_same(part: &str, scene: &Scene, changes: &[Change]) {
    let alone = failure(scene, changes, STEPS, None);
    assert!(alone.contains(part), "{part}: {alone}");
    for (size, divides_from) in
        [(2, DIVIDES_FROM[0]), (2, DIVIDES_FROM[1]), (5, DIVIDES_FROM[0]), (5, DIVIDES_FROM[1])]
    {
        let work = |ranks| failure(scene, changes, STEPS, Some(ranks));
        for (over, _) in on_ranks_that_divide(divides_from, size, 1, work) {
            assert_eq!(over, alone, "{part} on {size} ranks, divided from {divides_from} blocks on");
        }
    }
}

#[test]
fn all_reports_and_words_are_those_of_one() {
    for (part, scene) in scenes() {
        says_the_same(part, &scene, &[]);
    }
}

#[test]
fn what_fails_or_is_rejected_says_the_same_with_two_levels() {
    let (drawn, draw) = drawn_of(1200);
    says_the_same("the spring from particle 43 to 44", &coarse(drawn), &[draw]);
    says_the_same("Passed", &coarse(falling_of(40)), &[]);
    says_the_same("Rejection {", &spinning(20.0, 1e4).certified(), &[]);
}

#[test]
fn a_solve_with_an_indefinite_coarse_space_is_made_without() {
    let ends = [PreconditionerKind::TwoLevel, PreconditionerKind::BlockJacobi].map(|preconditioner| {
        let mut scene = unfit();
        scene.settings.solver.preconditioner = preconditioner;
        let mut simulation = scene.simulate(Precision::F64);
        let solve = advance(&mut simulation, 1).solve.expect("a solve");
        (simulation.state_hash(), solve.products)
    });
    assert!(ends[0].0 == ends[1].0 && ends[0].1 > ends[1].1, "{ends:?}");
}

/// A stiff sheet with springs at random, which join all of its blocks.
fn entangled(preconditioner: PreconditionerKind) -> Scene {
    let mut scene = spinning_of(80, 1.0, 1e4);
    scene.settings.solver.preconditioner = preconditioner;
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    let (like, count) = (scene.network.springs[0], scene.network.x.len());
    scene.network.springs.extend((0..40_000_usize).map(|i| {
        let particles =
            [(i * 7919) % count, (i * 104_729 + i / count * 911 + 1) % count].map(|row| row as u32);
        Spring { particles, rest_length: 1.0, ..like }
    }));
    scene.network.springs.retain(|spring| spring.particles[0] != spring.particles[1]);
    scene
}

#[test]
fn what_is_too_entangled_is_refused_by_name_and_goes_without_by_auto() {
    let named = failure(&entangled(PreconditionerKind::TwoLevel), &[], 1, None);
    assert!(named.contains("too entangled"), "{named}");
    let chosen = failure(&entangled(PreconditionerKind::Auto), &[], 1, None);
    assert!(chosen.contains("Some(BlockJacobi)"), "{chosen}");
    assert_eq!(chosen, failure(&entangled(PreconditionerKind::BlockJacobi), &[], 1, None));
    for (preconditioner, alone) in [(PreconditionerKind::TwoLevel, named), (PreconditionerKind::Auto, chosen)]
    {
        let scene = entangled(preconditioner);
        for (over, _) in on_ranks_that_divide(0, 3, 1, |ranks| failure(&scene, &[], 1, Some(ranks))) {
            assert_eq!(over, alone);
        }
    }
    // It is the tangle alone that keeps "auto" from two levels.
    let mut plain = entangled(PreconditionerKind::Auto);
    plain.network.springs.retain(|spring| spring.rest_length < 1.0);
    assert!(failure(&plain, &[], 1, None).contains("Some(TwoLevel)"));
}

/// Sheets of 36 particles, one on the other, of which each block has a part: nine blocks of eight parts.
fn pile() -> Scene {
    let mut scene = spinning_of(6, 1.0, 1e4);
    let one = scene.network.clone();
    let network = &mut scene.network;
    for layer in 1..8_u32 {
        let first = network.x.len() as u32;
        network.x.extend(one.x.iter().map(|[x, y, z]| [*x, y + 0.002 * f64::from(layer), *z]));
        network.v.extend(&one.v);
        network.masses.extend(&one.masses);
        network.springs.extend(one.springs.iter().map(|spring| {
            let particles = spring.particles.map(|particle| particle + first);
            Spring { particles, ..*spring }
        }));
    }
    coarse(scene)
}

#[test]
fn ranks_without_blocks_take_part_where_the_finest_level_is_divided() {
    let (size, empty) = (11, [0, 5]);
    let mut scene = pile();
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-6, max_iterations: 200 };
    let alone = failure(&scene, &[], 2, None);
    assert!(alone.contains("Converged") && alone.contains("Some(TwoLevel)"), "{alone}");
    let work = |ranks| failure(&scene, &[], 2, Some(ranks));
    for (over, _) in on_ranks_that_divide(DIVIDES_FROM[0], size, 1, work) {
        assert_eq!(over, alone);
    }
    scene.settings.solver.stop = Stop::Iterations(4);
    for (rank, counts) in asked_of(DIVIDES_FROM[0], &scene, size, 1).iter().enumerate() {
        assert_eq!((counts.exchanges, counts.gathers), (2 * 4 + 3, 3 * 4 + 5), "rank {rank}");
        assert_eq!(counts.messages == 0, empty.contains(&rank), "rank {rank}: {counts:?}");
    }
}

#[test]
fn a_step_asks_as_much_as_its_formula_says() {
    let size = 3;
    let blocks = 50_usize;
    for (divides_from, is_divided) in DIVIDES_FROM.into_iter().zip([true, false]) {
        let of = |k: u32, preconditioner: PreconditionerKind| {
            let mut scene = spinning(1.0, 500.0);
            scene.settings.solver.preconditioner = preconditioner;
            scene.settings.solver.stop = Stop::Iterations(k);
            asked_of(divides_from, &scene, size, 2)
        };
        let [few, many] = [4, 10].map(|k| {
            let counts = of(k, PreconditionerKind::TwoLevel);
            let k = u64::from(k);
            let expected = if is_divided { (2 * k + 3, 3 * k + 5) } else { (k + 1, 2 * k + 4) };
            assert!(counts.iter().all(|all| (all.exchanges, all.gathers) == expected), "{k}: {counts:?}");
            counts
        });
        let per_iteration = |few: &[Counts], many: &[Counts], rank: usize| {
            [many[rank].told - few[rank].told, many[rank].bytes - few[rank].bytes].map(|bytes| bytes / 6)
        };
        let [few_plain, many_plain] = [4, 10].map(|k| of(k, PreconditionerKind::BlockJacobi));
        for rank in 0..size {
            let own = (blocks * (rank + 1) / size - blocks * rank / size) as u64;
            let [told, sent] = per_iteration(&few, &many, rank);
            let [plain_told, plain_sent] = per_iteration(&few_plain, &many_plain, rank);
            // Nine numbers per block, beside sums; those of r.z on the coarse space, where it is divided.
            let sums = if is_divided { plain_told + plain_told / 2 } else { plain_told };
            assert_eq!(told, sums + 72 * own, "rank {rank}");
            let at_border = (sent - plain_sent) / 72;
            assert_eq!(sent, plain_sent + 72 * at_border, "rank {rank}");
            assert!(if is_divided { (4..2 * own).contains(&at_border) } else { at_border == 0 });
            // Once per solve: 81 numbers for each pair of blocks that meet, or of the next level.
            let once = |few: &Counts, told: u64| few.told - 4 * told;
            let once = once(&few[rank], told) - once(&few_plain[rank], plain_told) - 72 * own;
            let pairs = (once - 1 - (sums - plain_told)) / 648;
            assert_eq!(once, 648 * pairs + 1 + (sums - plain_told), "rank {rank}");
            let range = if is_divided { 4..2 * own } else { 4 * own..9 * own };
            assert!(range.contains(&pairs), "{pairs} pairs of {own} blocks");
        }
    }
}

#[test]
fn a_stiff_sheet_takes_the_iterations_of_one() {
    let mut scene = coarse(spinning_of(64, 1.0, 1e5));
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    let setup = scene.setup();
    let alone = advance(&mut scene.simulate(Precision::F32), 1).solve;
    let over = on_ranks_that_divide(DIVIDES_FROM[0], 2, 1, |ranks| {
        let (mut simulation, _) = Simulation::over(&setup, Precision::F32, ranks).expect("it is in");
        simulation.step(&mut NoStopwatch).expect("it is stable").solve
    });
    assert!(over.iter().all(|(solve, _)| *solve == alone), "{over:?}");
}

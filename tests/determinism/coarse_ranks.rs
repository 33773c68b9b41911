//! The preconditioner on two levels over ranks, which are threads here: the same words, reports and bits as by one, whether
//! they divide the finest level of its coarse space or all do the same.

use std::collections::BTreeSet;

use nappe_sim::{
    cloth::{Hessian, Minimizer, Model, NewtonSettings, Spring},
    linalg::{PreconditionerKind, Stop},
    math::Precision,
    report::NoStopwatch,
    time_step::TimeStep,
    world::{Change, Simulation},
};
use nappe_tests::{
    Scene,
    networks::scatter,
    ranks::{DIVIDES_FROM, on_ranks_that_divide},
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
    says_the_same("the cloth from particle 43 to 44", &coarse(drawn), &[draw]);
    says_the_same("Passed", &coarse(falling_of(40)), &[]);
    let mut taken_again = spinning(20.0, 1e4).certified();
    taken_again.settings.tolerance = Some(0.05);
    says_the_same("Rejection {", &taken_again, &[]);
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
        assert_eq!((counts.exchanges, counts.gathers), (2 * 4 + 3, 3 * 4 + 6), "rank {rank}");
        assert_eq!(counts.messages == 0, empty.contains(&rank), "rank {rank}: {counts:?}");
    }
}

/// The sheet whose calls are counted, solved so.
fn counted(preconditioner: PreconditionerKind, stop: Stop) -> Scene {
    let mut scene = spinning(1.0, 500.0);
    scene.settings.solver.preconditioner = preconditioner;
    scene.settings.solver.stop = stop;
    scene
}

#[test]
fn a_step_asks_as_much_as_its_formula_says() {
    let tolerance = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    for stop in [Stop::Iterations(4), Stop::Iterations(10), tolerance] {
        for preconditioner in [PreconditionerKind::BlockJacobi, PreconditionerKind::TwoLevel] {
            let scene = counted(preconditioner, stop);
            let solve = advance(&mut scene.simulate(Precision::F32), 3).solve.expect("a solve");
            let k = u64::from(solve.iterations);
            // Residuals that are computed from a solution, where one has to be believed.
            let again = u64::from(solve.products) - k;
            assert_eq!(again > 0, stop == tolerance, "{solve:?}");
            for (divides_from, is_divided) in DIVIDES_FROM.into_iter().zip([true, false]) {
                let expected = match preconditioner {
                    PreconditionerKind::TwoLevel if is_divided => {
                        (2 * (k + again) + 3, 3 * k + 2 * again + 6)
                    }
                    PreconditionerKind::TwoLevel => (k + again + 1, 2 * k + again + 5),
                    _ => (k + again + 1, 2 * k + again + 4),
                };
                for counts in asked_of(divides_from, &scene, 3, 2) {
                    assert_eq!((counts.exchanges, counts.gathers), expected, "{divides_from}, {solve:?}");
                }
            }
        }
    }
}

/// What of a sheet goes over the borders of a rank.
#[derive(Clone, Copy, Debug)]
struct Borders {
    /// Blocks that it owns.
    blocks: u64,
    /// Its particles that others need, once for each of them.
    ghosts: u64,
    /// Its blocks that are joined to those of others, once for each of them.
    at_border: u64,
    /// Pairs of a block of its own and one that springs join to it, itself among them.
    pairs: u64,
}

/// Counts from springs alone what goes over the borders of each of some ranks.
fn borders(scene: &Scene, size: usize) -> Vec<Borders> {
    let Scene { network, settings, .. } = scene;
    let (model, ..) = Model::<f32>::new(network, settings).expect("it is laid out");
    let blocks = model.count.div_ceil(model.block_size);
    let range = |rank: usize| blocks * rank / size..blocks * (rank + 1) / size;
    let owner = |block: usize| (0..size).find(|rank| range(*rank).contains(&block)).expect("a rank");
    let [mut ghosts, mut at_border, mut pairs] = <[BTreeSet<[usize; 2]>; 3]>::default();
    for spring in &network.springs {
        let [a, b] = spring.particles.map(|particle| model.place[particle as usize] as usize);
        for [own, other] in [[a, b], [b, a]] {
            let [block, joined] = [own, other].map(|row| row / model.block_size);
            pairs.extend([[block, block], [block, joined]]);
            let to = owner(joined);
            if to != owner(block) {
                ghosts.insert([own, to]);
                at_border.insert([block, to]);
            }
        }
    }
    let of = |set: &BTreeSet<[usize; 2]>, per_block: usize, rank: usize| {
        set.iter().filter(|[own, _]| range(rank).contains(&(own / per_block))).count() as u64
    };
    let of_rank = |rank: usize| Borders {
        blocks: range(rank).len() as u64,
        ghosts: of(&ghosts, model.block_size, rank),
        at_border: of(&at_border, 1, rank),
        pairs: of(&pairs, 1, rank),
    };
    (0..size).map(of_rank).collect()
}

#[test]
fn a_step_sends_as_many_bytes_as_its_formula_says() {
    let (size, ks) = (3, [4, 10]);
    let borders = borders(&counted(PreconditionerKind::TwoLevel, Stop::Iterations(ks[0])), size);
    for (divides_from, is_divided) in DIVIDES_FROM.into_iter().zip([true, false]) {
        let of = |kind| ks.map(|k| asked_of(divides_from, &counted(kind, Stop::Iterations(k)), size, 2));
        let [plain, coarse] = [PreconditionerKind::BlockJacobi, PreconditionerKind::TwoLevel].map(of);
        for (rank, borders) in borders.iter().enumerate() {
            let Borders { blocks, ghosts, at_border, pairs } = *borders;
            let [plain, coarse] = [&plain, &coarse].map(|of_ks| [of_ks[0][rank], of_ks[1][rank]]);
            // Positions and velocities before the evaluation, and the direction of each iteration.
            let of_particles = ks.map(|k| 12 * ghosts * (2 + u64::from(k)));
            assert_eq!(plain.map(|counts| counts.bytes), of_particles, "rank {rank}");
            // What is restricted of b and in each iteration; and once per solve blocks of the matrix.
            let restrictions = |k: u32| if is_divided { 72 * at_border * (u64::from(k) + 1) } else { 0 };
            let once = [0, 1].map(|i| coarse[i].bytes - of_particles[i] - restrictions(ks[i]));
            assert!(once[0] == once[1] && once[0].is_multiple_of(648), "rank {rank}: {once:?}");
            // Those of blocks at the border, and rows that another rank adds to the next level.
            let is_right = if is_divided { once[0] >= 648 * at_border } else { once[0] == 0 };
            assert!(is_right, "rank {rank}: {once:?} with {borders:?}");

            // Nine numbers per block, beside sums; those of r.z on the coarse space, where it is divided.
            let [plain_told, told] = [plain, coarse].map(|[few, many]| (many.told - few.told) / 6);
            let sums = if is_divided { plain_told + plain_told / 2 } else { plain_told };
            assert_eq!(told, sums + 72 * blocks, "rank {rank}");
            // Once per solve: 81 numbers for each pair of blocks that meet, or of the next level.
            let once = (coarse[0].told - 4 * told) - (plain[0].told - 4 * plain_told);
            let of_matrix = once - 72 * blocks - (sums - plain_told) - 1;
            if is_divided {
                let pairs = of_matrix / 648;
                assert!(of_matrix == 648 * pairs && (4..2 * blocks).contains(&pairs), "{pairs} pairs");
            } else {
                assert_eq!(of_matrix, 648 * pairs, "rank {rank}");
            }
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

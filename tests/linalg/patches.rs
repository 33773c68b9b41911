//! The preconditioner `patches` on rippled cloth: iterations whatever the stiffness and bending, solutions as with `block_jacobi`,
//! and how `auto` comes to it.

use nappe_scene::{NoMeshes, Scene as SceneText, SceneLimits};
use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Minimizer, Network, NewtonSettings, SpringLaw},
    linalg::{OperatorKind, Outcome, PreconditionerKind, SolveReport, SolverSettings, Stop},
    math::Precision,
    mesh::TriangleMesh,
    time_step::TimeStep,
    world::{Change, Simulation, WorldSetup},
};
use nappe_tests::{
    Scene,
    networks::{chain, particles, scatter, stiff_sheet},
    scene::{advance, max_distance, positions},
    threads::with_threads,
};

/// Springs of the rippled sheet, with stretch and shear (N/m) and, where there is any, bending (N/m).
fn springs(stiffness: f64, bend: f64) -> String {
    let bend = if bend > 0.0 { format!(", bend = {{ stiffness = {bend} }}") } else { String::new() };
    format!("stretch = {{ stiffness = {stiffness} }}, shear = {{ stiffness = {stiffness} }}{bend}")
}

/// A stiff sheet with ripples of two and a half columns that hangs by two corners.
fn rippled([columns, rows]: [u32; 2], springs: &str, solver: &str) -> WorldSetup {
    let text = format!(
        r#"
        version = 1
        dt = 0.016666666
        [[body]]
        name = "a"
        integrator = "implicit_euler"
        mesh = {{ grid = [{columns}, {rows}], spacing = 0.008, plane = "upright", ripple = 0.002 }}
        mass = {{ density = 0.15 }}
        pins = ["top_left", "top_right"]
        springs = {{ {springs} }}
        solver = {{ {solver} }}
        "#
    );
    let scene = SceneText::parse(&text, "rippled").unwrap_or_else(|error| panic!("{error}"));
    scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}")).setup
}

fn simulate(setup: &WorldSetup) -> Simulation {
    Simulation::new(setup, Precision::F64).expect("a good scene").0
}

/// The solve of the next step.
fn next_solve(simulation: &mut Simulation) -> SolveReport {
    advance(simulation, 1).solve.expect("an implicit step solves")
}

#[test]
fn a_rippled_sheet_takes_few_iterations_at_every_stiffness_and_bending() {
    let by_bending = [300.0, 30.0, 3.0, 0.3, 0.0].map(|bend| springs(12_000.0, bend));
    let stretch_alone = "stretch = { stiffness = 12000 }".to_owned();
    for springs in by_bending.into_iter().chain([springs(1.2e6, 3e4), springs(3.6e7, 9e5), stretch_alone]) {
        let mut setup = rippled([60, 50], &springs, "preconditioner = \"patches\", tolerance = 1e-4");
        // One solve, whatever is said of its step.
        setup.bodies[0].settings.time_step = TimeStep::Unchecked(setup.dt);
        let solve = next_solve(&mut simulate(&setup));
        assert_eq!(solve.outcome, Outcome::Converged, "{springs}");
        assert_eq!(solve.preconditioner, Some(PreconditionerKind::Patches));
        assert!(solve.iterations <= 16, "{springs}: {solve:?}");
        // Three products per iteration, and what begins and ends a solve.
        assert!(solve.products <= 3 * solve.iterations + 8, "{springs}: {solve:?}");
    }
}

/// Sheets of which each asks for something else: elements, points off their places, pins, a seam.
fn networks() -> [(&'static str, Network); 3] {
    let side = 40;
    let mut hung = stiff_sheet(side);
    hung.pins = vec![0, side as u32 - 1];
    let mut pinned = stiff_sheet(side);
    pinned.pins = (0..side as u32).chain((0..20).map(|i| (i * 331 + 700) % (side * side) as u32)).collect();
    let mut bending = stiff_sheet(side);
    let mesh = TriangleMesh::grid(side, side, 1.0 / (side - 1) as f64);
    let law = SpringLaw { stiffness: 1e-3, damping: 0.0 };
    bending.elements = vec![ElementList::new(ElementKind::QuadraticBending, law, &mesh)];
    bending.pins = vec![0, side as u32 - 1];
    let mut networks = [("hung", hung), ("pinned", pinned), ("bending", bending)];
    for (_, network) in &mut networks {
        network.x.iter_mut().enumerate().for_each(|(i, [_, y, _])| *y += 0.004 * scatter(i));
    }
    networks
}

#[test]
fn solutions_are_those_of_the_simpler_preconditioner() {
    for (name, network) in networks() {
        let run = |kind: PreconditionerKind, operator: OperatorKind| {
            let mut scene = Scene::new(network.clone(), 1.0 / 60.0).under([0.0, -9.81, 0.0]);
            scene.settings.solver.preconditioner = kind;
            scene.settings.solver.operator = operator;
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-12, max_iterations: 10_000 };
            let mut simulation = scene.simulate(Precision::F64);
            let solve = next_solve(&mut simulation);
            assert_eq!(solve.outcome, Outcome::Converged, "{name}, {kind:?}: {solve:?}");
            positions(&simulation)
        };
        let expected = run(PreconditionerKind::BlockJacobi, OperatorKind::MatrixFree);
        for operator in OperatorKind::ALL {
            let distance = max_distance(&run(PreconditionerKind::Patches, operator), &expected);
            assert!(distance < 1e-10, "{name}, {operator:?}: {distance:e} m");
        }
    }
}

#[test]
fn auto_goes_on_with_patches_at_the_cap_and_the_state_remembers_it() {
    let setup = rippled([75, 65], &springs(12_000.0, 300.0), "tolerance = 1e-4");
    let mut simulation = simulate(&setup);
    let first = next_solve(&mut simulation);
    assert_eq!(
        (first.outcome, first.preconditioner),
        (Outcome::Converged, Some(PreconditionerKind::Patches))
    );
    assert!((200..300).contains(&first.iterations), "{first:?}");

    let mut others = Vec::new();
    for step in 2..=6 {
        // What is kept of the first steps is of no use once the sheet moves.
        let solve = next_solve(&mut simulation);
        assert_eq!(
            (solve.outcome, solve.preconditioner),
            (Outcome::Converged, Some(PreconditionerKind::Patches))
        );
        assert!(solve.iterations <= if step < 4 { 80 } else { 40 }, "step {step}: {solve:?}");
        let mut other = simulate(&setup);
        other.put(&simulation.take());
        others.extend([(step, other), (step, simulation.fork())]);
    }
    // Who goes on from a state makes the patches again that it keeps.
    let solve = next_solve(&mut simulation);
    for (step, other) in &mut others {
        let again = advance(other, 7 - *step).solve.expect("an implicit step solves");
        assert_eq!(
            (again.iterations, again.products),
            (solve.iterations, solve.products),
            "from step {step}"
        );
        assert_eq!(other.state_hash(), simulation.state_hash(), "from step {step}");
    }
}

#[test]
fn easy_cloth_stays_with_what_auto_chose() {
    let mut network = stiff_sheet(40);
    network.pins = vec![0, 39];
    let mut scene = Scene::new(network, 1.0 / 60.0).under([0.0, -9.81, 0.0]);
    scene.settings.solver = SolverSettings::default();
    let solve = next_solve(&mut scene.simulate(Precision::F64));
    assert_eq!(solve.preconditioner, Some(PreconditionerKind::TwoLevel), "{solve:?}");
    assert!(solve.outcome == Outcome::Converged && solve.iterations > 10, "{solve:?}");
}

#[test]
fn bits_do_not_depend_on_threads() {
    let setup = rippled([75, 65], &springs(12_000.0, 300.0), "preconditioner = \"patches\"");
    let on = |threads: usize| {
        with_threads(threads, || {
            let mut simulation = simulate(&setup);
            advance(&mut simulation, 2);
            simulation.state_hash()
        })
    };
    let one = on(1);
    for threads in [2, 3, 8] {
        assert_eq!(on(threads), one, "{threads} threads");
    }
}

#[test]
fn odd_bodies_are_stepped() {
    let line = |count: usize| (0..count).map(|i| [0.1 * i as f64, 0.0, 0.0]).collect::<Vec<_>>();
    let hung = |stiffness: f64| {
        let mut network = stiff_sheet(12);
        network.pins = vec![0, 11];
        network.springs.iter_mut().for_each(|spring| spring.law.stiffness *= stiffness);
        network
    };
    let mut pinned = hung(1.0);
    pinned.pins = (0..144).collect();
    let mut coincident = hung(1.0);
    coincident.x[14] = coincident.x[13];
    let mut bodies = vec![
        ("alone", particles(&line(1), 0.1)),
        ("three", chain(&line(3), 0.1, 1e4, 0.0, 0.01)),
        ("chain", chain(&line(100), 0.1, 1e4, 0.0, 0.01)),
        ("pinned", pinned),
        ("coincident", coincident),
    ];
    bodies.extend([0.0, 1e-7, 1e-3, 1.0, 1e3].map(|stiffness| ("hung", hung(stiffness))));
    for (name, network) in bodies {
        for hessian in [Hessian::Absolute, Hessian::Clamped] {
            let mut scene = Scene::new(network.clone(), 1.0 / 60.0).under([0.0, -9.81, 0.0]);
            scene.settings.hessian = hessian;
            scene.settings.solver.preconditioner = PreconditionerKind::Patches;
            let mut simulation = scene.simulate(Precision::F64);
            let solve = next_solve(&mut simulation);
            assert_eq!(solve.outcome, Outcome::Converged, "{name}, {hessian:?}: {solve:?}");
            assert!(
                positions(&simulation).as_flattened().iter().all(|x| x.is_finite()),
                "{name}, {hessian:?}"
            );
        }
    }
}

#[test]
fn a_change_of_stiffness_makes_patches_anew() {
    let setup = rippled([40, 35], &springs(12_000.0, 300.0), "preconditioner = \"patches\"");
    let stiffer = Change::Springs { body: None, kind: None, stiffness: Some(3e4), damping: None };
    let mut simulation = simulate(&setup);
    advance(&mut simulation, 3);
    simulation.apply(std::slice::from_ref(&stiffer)).expect("it has springs");
    // Its own set-up is gone, and one that begins here has none.
    let mut other = simulate(&setup);
    other.apply(&[stiffer]).expect("it has springs");
    other.put(&simulation.take());
    for _ in 0..3 {
        let [one, two] = [&mut simulation, &mut other].map(next_solve);
        assert_eq!(one, two);
        assert_eq!(simulation.state_hash(), other.state_hash());
    }
}

#[test]
fn what_goes_on_from_a_state_makes_patches_of_its_parameters() {
    let mut setup = rippled([40, 35], &springs(12_000.0, 300.0), "preconditioner = \"patches\"");
    setup.bodies[0].settings.time_step = TimeStep::Unchecked(setup.dt);
    // It has patches of stiffer springs at the same place.
    let mut other = simulate(&setup);
    let stiffer = Change::Springs { body: None, kind: None, stiffness: Some(3e4), damping: None };
    other.apply(&[stiffer]).expect("it has springs");
    advance(&mut other, 1);
    let mut simulation = simulate(&setup);
    advance(&mut simulation, 1);
    other.put(&simulation.take());
    for _ in 0..2 {
        let [one, two] = [&mut simulation, &mut other].map(next_solve);
        assert_eq!(one, two);
        assert_eq!(simulation.state_hash(), other.state_hash());
    }
}

#[test]
fn forks_of_newtons_method_go_on_with_the_same_bits() {
    for hessian in [Hessian::Absolute, Hessian::Clamped, Hessian::Full] {
        let mut setup = rippled([40, 35], &springs(12_000.0, 300.0), "preconditioner = \"patches\"");
        let settings = &mut setup.bodies[0].settings;
        settings.minimizer = Minimizer::Newton(NewtonSettings::default());
        settings.hessian = hessian;
        settings.solver.stop = settings.minimizer.default_stop();
        let mut simulation = simulate(&setup);
        let mut forks = Vec::new();
        for _ in 0..4 {
            advance(&mut simulation, 1);
            forks.push(simulation.fork());
        }
        for (taken, fork) in (1..).zip(&mut forks) {
            advance(fork, 4 - taken);
            assert_eq!(fork.state_hash(), simulation.state_hash(), "{hessian:?} after {taken} steps");
        }
    }
}

#[test]
fn ranks_refuse_patches_by_name() {
    let setup = rippled([20, 20], &springs(12_000.0, 300.0), "preconditioner = \"patches\"");
    let refused = setup.check_for_ranks().expect_err("they are not divided");
    assert!(refused.to_string().contains("preconditioner = \"patches\""), "{refused}");
}

//! What cloth that sleeps costs, and which methods cannot let it sleep.

use nappe_scene::{NoMeshes, Scene as SceneText, SceneLimits};
use nappe_sim::{
    cloth::{Integrator, Minimizer, NewtonSettings, RestSettings},
    math::Precision,
    report::StepReport,
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    Scene,
    networks::particles,
    scene::{advance, of_text},
};

use super::{DT, FLOOR, Sheet, asleep, drawn, scene};

#[test]
fn what_sleeps_adds_at_most_a_fifth_to_the_work_of_one_sheet_that_moves() {
    let products = |count: usize| {
        let mut parts = String::new();
        for place in 0..count {
            let name = format!("sheet{place}");
            let at = [place as f64, 0.01, 0.0];
            let sheet = Sheet { name: &name, side: 20, at, keys: "drag = 1e-3" };
            parts += &sheet.text();
        }
        let text = scene(600, "", "error = 1e-3", &(parts + FLOOR));
        let mut simulation = of_text(&text, Precision::F64);
        advance(&mut simulation, 40);
        simulation.apply(&[drawn("sheet0", 0, [0.0, 0.1, 0.0], 2.5)]).expect("a fair pull");
        // All sheets have as many rows.
        let of_steps = (0..500).map(|_| advance(&mut simulation, 1).work.matrix_products);
        let all = of_steps.sum::<u64>();
        let rest = advance(&mut simulation, 1).rest.expect("it is watched");
        assert_eq!(rest.pieces_asleep, count as u64 - 1, "{rest:?}");
        all
    };
    let [alone, fifty] = [1, 50].map(products);
    assert!(alone > 0 && 5 * fifty <= 6 * alone, "{fifty} products, {alone} of one alone");
}

#[test]
fn where_all_sleep_a_step_evaluates_nothing_but_long_steps() {
    let mut simulation = asleep("", 100);
    let (mut idle, mut steps) = (0, 0);
    for _ in 0..100 {
        let StepReport { work, cloth, diagnostics, .. } = advance(&mut simulation, 1);
        idle += u32::from(work.force_evaluations == 0);
        steps += cloth.expect("there is cloth").substeps;
        assert!(diagnostics.gravitational_energy > 0.0, "its energies stay");
    }
    // Of the steps up to 200 a period of 8 or more leaves one in eight.
    assert!(idle >= 87 && steps == 0, "{idle} idle steps, {steps} sub-steps");
}

/// A change of a scene.
type Change = fn(&mut Scene);

#[test]
fn methods_that_take_no_long_steps_are_refused_by_name() {
    let refused = |change: Change| {
        let mut scene = Scene::new(particles(&[[0.0; 3]], 1.0), DT).certified();
        scene.settings.rest = Some(RestSettings { error: 1e-3, within: 10.0, sleep: true });
        assert!(Simulation::new(&scene.setup(), Precision::F64).is_ok());
        change(&mut scene);
        let found = Simulation::new(&scene.setup(), Precision::F64).map(|_| ());
        scene.settings.rest = Some(RestSettings { error: 1e-3, within: 10.0, sleep: false });
        assert!(Simulation::new(&scene.setup(), Precision::F64).is_ok(), "it may be watched");
        found.expect_err("no long steps").to_string()
    };
    let cases: [(Change, &str); 4] = [
        (
            |scene| scene.settings.integrator = Integrator::SymplecticEuler,
            "integrator = \"symplectic_euler\"",
        ),
        (|scene| scene.settings.integrator = Integrator::Bdf2, "integrator = \"bdf2\""),
        (
            |scene| scene.settings.minimizer = Minimizer::Newton(NewtonSettings::default()),
            "minimizer = \"newton\"",
        ),
        (|scene| scene.settings.time_step = TimeStep::Unchecked(DT), "unchecked"),
    ];
    for (change, named) in cases {
        let message = refused(change);
        assert!(message.contains(named) && message.contains("sleep = false"), "{message}, not {named}");
    }
}

#[test]
fn a_scene_that_sleeps_says_so_by_default() {
    let sheet = Sheet { name: "sheet", side: 3, at: [0.0; 3], keys: "" };
    let text = scene(10, "", "error = 1e-3", &sheet.text());
    let parsed = SceneText::parse(&text, "scene").expect("a scene");
    let built = parsed.build(&NoMeshes, &SceneLimits::default()).expect("a good scene");
    assert!(built.setup.bodies[0].settings.rest.is_some_and(|rest| rest.sleep));
}

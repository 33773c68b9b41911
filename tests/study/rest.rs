//! What a plan says of a scene in which cloth lies still: what is saved if it sleeps, and how far that moves the answer.

use nappe_scene::{NoMeshes, Scene, SceneLimits};
use nappe_sim::math::Precision;
use nappe_study::{Budget, Case, Plan, Request, Rested, SceneTerms, plan};

/// A sheet lies on a floor while a chain falls far above it.
const LYING: &str = "version = 1\ndt = 0.01\nsteps = 100\nprecision = \"f64\"\n\
    [[body]]\nname = \"lying\"\nmesh = { grid = [4, 4], spacing = 0.05 }\ntransform = { translate = [0, 0.01, 0] }\n\
    mass = { particle = 0.005 }\ndrag = 1e-3\n\
    springs = { stretch = { stiffness = 100, damping = 0.02 }, shear = { stiffness = 50, damping = 0.01 } }\n\
    [[body]]\nname = \"falling\"\nmesh = { chain = 3, spacing = 0.05 }\ntransform = { translate = [0, 10, 0] }\n\
    mass = { particle = 0.005 }\nsprings = { stretch = { stiffness = 100, damping = 0.02 } }\n\
    [[collider]]\nname = \"floor\"\nplane = { point = [0, 0, 0], normal = [0, 1, 0] }\nfriction = 0.5\nmargin = 0.01\n";

fn planned(method: &str, rest: &str) -> Plan {
    let text = LYING.replacen("version = 1\n", &format!("version = 1\n{rest}"), 1);
    let scene = Scene::parse(&text, "lying.toml").unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    let case = Case::new("lying", built.setup, built.initial_changes, scene.precision).expect("it has cloth");
    let request = Request {
        tolerance: 0.01,
        end: 1.0,
        scene_steps: scene.steps,
        times: None,
        methods: vec![method.to_owned()],
        precisions: vec![Precision::F64],
        effort: None,
    };
    plan(&case, &request, &SceneTerms::NONE, &Budget::new(None), &|_| ())
}

#[test]
fn a_plan_says_what_sleep_saves_and_how_far_it_moves_the_answer() {
    let found = planned("implicit_euler_absolute", "");
    let (verified, rested) = (found.verified.expect("it is verified"), found.rested.expect("it can sleep"));
    assert!(found.is_met, "{verified:?}");
    assert_eq!(rested.error, 0.01 - verified.error);
    assert!(rested.told > 0.0 || rested.measured == 0.0, "{rested:?}");
    assert!(rested.measured <= rested.told + 1e-12 && rested.measured <= rested.error, "{rested:?}");
    // One of two bodies sleeps for the most part.
    assert!((0.1..0.9).contains(&rested.saved_counts), "{rested:?}");

    // All steps are compared, whatever the scene lets sleep.
    let again = planned("implicit_euler_absolute", "rest = { error = 1e-3 }\n");
    let hash = |plan: &Plan| plan.row.as_ref().map(|row| row.state_hash);
    assert_eq!(hash(&again), hash(&found));
    let without_seconds = |plan: &Plan| plan.rested.map(|rested| Rested { saving: None, ..rested });
    assert_eq!(without_seconds(&again), without_seconds(&found));
}

#[test]
fn what_takes_no_long_steps_has_nothing_said_of_sleep() {
    for rest in ["", "rest = { error = 1e-3 }\n"] {
        let found = planned("implicit_midpoint_absolute", rest);
        assert!(found.is_met && found.rested.is_none(), "{rest}: {:?}", found.verified);
    }
}

//! The step in which cloth wakes, and why it does.

use nappe_scene::{NoMeshes, Scene as SceneText, SceneLimits};
use nappe_sim::{
    collide::Collider,
    math::Precision,
    report::{StepReport, Wake, WakeCause},
    world::{Change, ColliderMove, Forces, MoveKey, Simulation},
};
use nappe_tests::{
    meshes::icosphere,
    scene::{advance, max_distance, of_text, positions},
};

use super::{Sheet, asleep, drawn, pinned, scene};

#[test]
fn each_call_wakes_what_it_changes_in_its_step() {
    let body = || "sheet".to_owned();
    let forces = Forces::One([0.0, 0.01, 0.0]);
    let causes = [
        (Change::Gravity([0.0, -9.0, 0.0]), WakeCause::Call),
        (Change::Wind([0.5, 0.0, 0.0]), WakeCause::Call),
        (Change::Drag(0.01), WakeCause::Call),
        (Change::Springs { body: None, kind: None, stiffness: Some(20.0), damping: None }, WakeCause::Call),
        (Change::Force { body: body(), particles: [7].into(), forces }, WakeCause::Force),
        (drawn("sheet", 24, [0.2, 0.1, 0.2], 0.1), WakeCause::Force),
        (Change::Pin { particle: 0, target: [0.0, 0.02, 0.0], duration: 0.1 }, WakeCause::Pin),
        (Change::PinPath { particle: 0, points: [(0.1, [0.0, 0.02, 0.0])].into() }, WakeCause::Pin),
    ];
    for (change, cause) in causes {
        let mut simulation = asleep("", 100);
        simulation.apply(std::slice::from_ref(&change)).expect("a fair change");
        let rest = advance(&mut simulation, 1).rest.expect("it is watched");
        let found = (rest.pieces_asleep, rest.wakes, rest.wake);
        assert_eq!(found, (0, 1, Some(Wake { step: 100, cause })), "{change:?}");
    }

    let mut simulation = asleep("", 100);
    let there: Vec<[f64; 3]> = positions(&simulation).iter().map(|[x, y, z]| [*x, y + 0.5, *z]).collect();
    let state = Change::State { body: body(), positions: there.into(), velocities: None };
    simulation.apply(&[state]).expect("it may be put there");
    let before = positions(&simulation)[12][1];
    let rest = advance(&mut simulation, 1).rest.expect("it is watched");
    assert_eq!(rest.wake, Some(Wake { step: 100, cause: WakeCause::Call }));
    assert!(positions(&simulation)[12][1] < before, "it falls at once");

    simulation.apply(&[Change::Reset]).expect("a world can be reset");
    let rest = advance(&mut simulation, 1).rest.expect("it is watched");
    assert_eq!((rest.pieces_asleep, rest.wakes, rest.wake), (0, 0, None), "a reset begins anew");
}

#[test]
fn wind_that_changes_wakes_what_feels_it() {
    // 0 until 0.5 s: the step from there on is the first whose middle has another wind.
    let root = "wind_at = [{ time = 0.5, velocity = [0, 0, 0] }, { time = 1, velocity = [2, 0, 0] }]";
    let mut simulation = asleep(root, 100);
    let rest = advance(&mut simulation, 1).rest.expect("it is watched");
    assert_eq!(rest.wake, Some(Wake { step: 100, cause: WakeCause::Wind }), "{rest:?}");
}

#[test]
fn a_collider_wakes_what_it_comes_near_and_nothing_else() {
    let sent = |to: [f64; 3], time: f64| {
        let keys = [MoveKey { time, position: Some(to), turn: None }].into();
        Change::Collider(ColliderMove { collider: "ball".to_owned(), keys })
    };
    // Far above, and then down to the sheet.
    let mut simulation = asleep("", 100);
    simulation.apply(&[sent([0.5, 3.5, 0.0], 0.25)]).expect("it may go there");
    let rest = advance(&mut simulation, 60).rest.expect("it is watched");
    assert_eq!((rest.pieces_asleep, rest.wakes), (1, 0), "it passes far away");
    simulation.apply(&[sent([0.1, 0.0, 0.1], 1.0)]).expect("it may go there");
    let woken = (0..200).find_map(|_| advance(&mut simulation, 1).rest.expect("it is watched").wake);
    let Wake { step, cause } = woken.expect("it is hit");
    // From 3.5 m to 0 m in a second: its lower side is at the sheet's 0.01 m after 0.97 s.
    assert_eq!(cause, WakeCause::Collider);
    assert!((350..=355).contains(&step), "{step}");
}

#[test]
fn a_collider_that_goes_round_what_sleeps_does_not_pass_through_it_in_a_long_step() {
    let parsed = SceneText::parse(&scene(400, "", "error = 1e-3", &pinned()), "scene").expect("a scene");
    let mut setup = parsed.build(&NoMeshes, &SceneLimits::default()).expect("a good scene").setup;
    let ball = setup.colliders.iter_mut().find(|collider| collider.name == "ball").expect("it has a ball");
    // What a mesh passed on its way is met, as nothing is that a formula passed.
    let mesh = icosphere([0.1, 3.0, 0.1], 0.1, 2).collider(0.0, 0.005);
    *ball = Collider { name: "ball".to_owned(), ..mesh };
    let mut simulation = Simulation::new(&setup, Precision::F64).expect("a good scene").0;
    let rest = advance(&mut simulation, 100).rest.expect("it is watched");
    assert_eq!(rest.pieces_asleep, 1, "{rest:?}");
    // Down beside the sheet, and after 3 s over it to its other side.
    let way = [
        (1.5, [-1.0, 0.01, 0.1]),
        (2.5, [-1.0, 0.01, 0.1]),
        (2.7, [-1.0, 1.0, 0.1]),
        (3.0, [1.2, 1.0, 0.1]),
        (3.2, [1.2, 0.01, 0.1]),
    ];
    let keys = way.map(|(time, to)| MoveKey { time, position: Some(to), turn: None }).into();
    let sent = Change::Collider(ColliderMove { collider: "ball".to_owned(), keys });
    simulation.apply(&[sent]).expect("it may go there");
    let before = positions(&simulation);
    let rest = advance(&mut simulation, 1100).rest.expect("it is watched");
    // Up to 24 long steps: some of them over all of the way from side to side.
    assert_eq!((rest.pieces_asleep, rest.wakes, rest.long_steps < 24), (1, 0, true), "{rest:?}");
    let off = max_distance(&positions(&simulation), &before);
    assert!(off < 1e-6, "{off:e} m");
}

#[test]
fn a_ball_at_5_m_per_s_does_not_pass_what_sleeps() {
    let sheet = Sheet { name: "sheet", side: 9, at: [0.0, 0.0, 0.0], keys: "" };
    let ball = "[[collider]]\nname = \"ball\"\nsphere = { center = [0.2, 1.5, 0.2], radius = 0.1 }\n\
        velocity = [0, -5, 0]\nmargin = 0.005\n";
    let parts = sheet.text() + ball;
    for precision in Precision::ALL {
        let of = |sleep: bool| {
            let rest = format!("error = 1e-3, sleep = {sleep}");
            of_text(&scene(100, "gravity = [0, 0, 0]", &rest, &parts), precision)
        };
        let [mut sleeps, mut awake] = [of(true), of(false)];
        let mut asleep = 0;
        for _ in 0..100 {
            let StepReport { rest, notices, .. } = advance(&mut sleeps, 1);
            advance(&mut awake, 1);
            asleep = asleep.max(rest.expect("it is watched").pieces_asleep);
            assert_eq!(notices.passed_count, 0, "{precision}");
            // What a solve rounds in a long step is all that moves it.
            let off = max_distance(&positions(&sleeps), &positions(&awake));
            assert!(off < 1e-6, "{precision}: {off:e} m while it slept");
        }
        let rest = advance(&mut sleeps, 1).rest.expect("it is watched");
        assert_eq!((asleep, rest.wakes), (1, 1), "{precision}");
        assert_eq!(rest.wake.map(|wake| wake.cause), Some(WakeCause::Collider), "{precision}");
    }
}

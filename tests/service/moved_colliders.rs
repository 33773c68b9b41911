//! Colliders that calls move: at the step named, all or none, with the bits of a path, across forks.

use nappe_client::{Client, Steps};
use nappe_proto::v1;
use nappe_server::{Limits, Reason};
use tonic_types::StatusExt as _;

use crate::{
    cloth_scenes::sheet,
    harness::{Server, assert_reason},
};

/// Time step of the sheet (s).
const DT: f64 = 0.002;
/// Where the box is at the start (m): below the free half of the sheet.
const START: [f64; 3] = [0.25, -0.3, 0.3];

/// A sheet that falls on a box, and a ball that passes by.
fn scene() -> String {
    sheet(6)
        + r#"
        [[collider]]
        name = "box"
        box = { center = [0.25, -0.3, 0.3], size = [0.3, 0.1, 0.3] }
        friction = 0.4
        [[collider]]
        name = "ball"
        sphere = { center = [0, -2, 0], radius = 0.2 }
        velocity = [0, 0, 0.5]
        "#
}

/// Where the box is after so many steps of a lift by 0.25 m, in which it turns by 0.8 rad.
fn lift(step: u32) -> ([f64; 3], [f64; 4]) {
    let share = f64::from(step) / 100.0;
    let (sine, cosine) = (0.4 * share).sin_cos();
    ([START[0], START[1] + 0.25 * share, START[2]], [0.0, 0.0, sine, cosine])
}

/// A move of the box within one step.
fn update(step: u32) -> v1::ColliderUpdate {
    let (position, turn) = lift(step);
    v1::ColliderUpdate {
        name: "box".into(),
        position: Some(position.into()),
        turn: Some(turn.into()),
        duration_seconds: DT,
    }
}

/// The first steps of the lift in one message.
fn path(steps: u32) -> v1::ColliderPath {
    v1::ColliderPath {
        name: "box".into(),
        times_seconds: (1..=steps).map(|step| DT * f64::from(step)).collect(),
        positions: (1..=steps).flat_map(|step| lift(step).0).collect(),
        turns: (1..=steps).flat_map(|step| lift(step).1).collect(),
    }
}

fn updates(id: &str, at_step: u64, colliders: Vec<v1::ColliderUpdate>) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest { at_step, colliders, ..v1::UpdateParametersRequest::of(id) }
}

fn paths(id: &str, at_step: u64, collider_paths: Vec<v1::ColliderPath>) -> v1::UpdateParametersRequest {
    v1::UpdateParametersRequest { at_step, collider_paths, ..v1::UpdateParametersRequest::of(id) }
}

async fn send(server: &mut Server, request: v1::UpdateParametersRequest) {
    server.client.update_parameters(request).await.expect("accepted");
}

/// Where a session says that a collider is, and how it is turned.
fn pose(session: &v1::Session, name: &str) -> ([f64; 3], [f64; 4]) {
    let poses = &session.parameters.as_ref().expect("parameters").collider_poses;
    let told = poses.iter().find(|pose| pose.name == name).expect("it is a collider");
    (told.position.expect("a position").into(), told.turn.expect("a turn").into())
}

fn close<const N: usize>(found: [f64; N], expected: [f64; N]) {
    let far = found.iter().zip(expected).any(|(a, b)| (a - b).abs() > 1e-12);
    assert!(!far, "{found:?} is not {expected:?}");
}

#[tokio::test(flavor = "multi_thread")]
async fn a_path_of_a_collider_is_one_call_with_the_bits_of_one_call_per_step() {
    let mut server = Server::start().await;
    let by_calls = server.session(scene()).await;
    for step in 1..=100 {
        send(&mut server, updates(&by_calls, u64::from(step) - 1, vec![update(step)])).await;
    }
    let by_calls = server.step(&by_calls, 120).await;

    let by_path = server.session(scene()).await;
    send(&mut server, paths(&by_path, 0, vec![path(100)])).await;
    let halfway = server.step(&by_path, 50).await;
    close(pose(&halfway, "box").0, lift(50).0);
    close(pose(&halfway, "box").1, lift(50).1);
    let by_path = server.step(&by_path, 70).await;
    assert_eq!(by_path.state_hash, by_calls.state_hash);
    assert_eq!(pose(&by_path, "box"), pose(&by_calls, "box"));

    // The same, sent with the steps.
    let client = Client::connect(&server.app.url()).await.expect("connected");
    let with_steps = server.session(scene()).await;
    for step in 1..=100 {
        let changes = Some(v1::Changes { colliders: vec![update(step)], ..v1::Changes::default() });
        let steps = Steps { changes, to_step: Some(step.into()), ..Steps::default() };
        client.advance(&with_steps, steps).await.expect("stepped");
    }
    assert_eq!(server.step(&with_steps, 20).await.state_hash, by_calls.state_hash);

    let untouched = server.session(scene()).await;
    let untouched = server.step(&untouched, 120).await;
    assert_ne!(untouched.state_hash, by_calls.state_hash, "the box was moved");
    close(pose(&untouched, "box").0, START);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_session_tells_where_its_colliders_are() {
    let mut server = Server::start().await;
    let id = server.session(scene()).await;
    let start = server.get(&id).await;
    let names = start.parameters.as_ref().expect("parameters").collider_poses.iter();
    assert_eq!(names.map(|pose| pose.name.as_str()).collect::<Vec<_>>(), ["box", "ball"]);
    assert_eq!(pose(&start, "box"), (START, [0.0, 0.0, 0.0, 1.0]));

    // Ten steps from step 5 on: it goes, keeps its turn, and rests.
    let to = [0.25, -0.2, 0.3];
    let there = v1::ColliderUpdate {
        turn: None,
        position: Some(to.into()),
        duration_seconds: 10.0 * DT,
        ..update(0)
    };
    send(&mut server, updates(&id, 5, vec![there])).await;
    for (steps, height) in [(5, -0.3), (3, -0.27), (7, -0.2), (5, -0.2)] {
        let (position, turn) = pose(&server.step(&id, steps).await, "box");
        close(position, [0.25, height, 0.3]);
        assert_eq!(turn, [0.0, 0.0, 0.0, 1.0]);
    }

    // It turns where it is, by the shorter arc.
    let half = 0.5_f64.sqrt();
    let quarter = [0.0, -half, 0.0, -half];
    let turned = v1::ColliderUpdate {
        position: None,
        turn: Some(quarter.into()),
        duration_seconds: 2.0 * DT,
        ..update(0)
    };
    send(&mut server, updates(&id, 0, vec![turned])).await;
    let halfway = pose(&server.step(&id, 1).await, "box");
    let sign = halfway.1[3].signum();
    let eighth = std::f64::consts::PI / 8.0;
    close(halfway.1.map(|c| sign * c), [0.0, eighth.sin(), 0.0, eighth.cos()]);
    let (position, turn) = pose(&server.step(&id, 4).await, "box");
    close(position, to);
    close(turn.map(|c| turn[3].signum() * c), quarter.map(|c| -c));

    // A collider with a velocity goes on, and one that is sent somewhere else leaves its way.
    let here = server.get(&id).await;
    let (position, _) = pose(&here, "ball");
    close(position, [0.0, -2.0, 0.5 * here.time_seconds]);
    let back =
        v1::ColliderUpdate { name: "ball".into(), position: Some([0.0, -2.0, 0.0].into()), ..update(0) };
    send(&mut server, updates(&id, 0, vec![back])).await;
    close(pose(&server.step(&id, 30).await, "ball").0, [0.0, -2.0, 0.0]);
}

/// Moves that are refused: why, and a part of what is said.
fn refused_moves() -> Vec<(Vec<v1::ColliderUpdate>, Reason, &'static str)> {
    let good = update(1);
    let turned = |turn: [f64; 4]| v1::ColliderUpdate { turn: Some(turn.into()), ..good.clone() };
    let to = |position: [f64; 3]| v1::ColliderUpdate { position: Some(position.into()), ..good.clone() };
    let lasting = |duration_seconds| v1::ColliderUpdate { duration_seconds, ..good.clone() };
    let named = |name: &str| v1::ColliderUpdate { name: name.into(), ..good.clone() };
    let nothing = v1::ColliderUpdate { position: None, turn: None, ..good.clone() };
    vec![
        (vec![named("bx")], Reason::InvalidChange, "box, ball"),
        (vec![named("")], Reason::InvalidChange, "box, ball"),
        (vec![good.clone(), good.clone()], Reason::InvalidChange, "box"),
        (vec![turned([0.0; 4])], Reason::InvalidChange, "length"),
        (vec![turned([0.0, 0.0, 0.0, 1.0 + 2e-6])], Reason::InvalidChange, "length"),
        (vec![turned([0.0, f64::NAN, 0.0, 1.0])], Reason::InvalidField, "colliders[0].turn.y"),
        (vec![lasting(-1e-9)], Reason::InvalidChange, "duration"),
        (vec![lasting(f64::INFINITY)], Reason::InvalidField, "colliders[0].duration_seconds"),
        (vec![to([0.0, 1e6 + 1.0, 0.0])], Reason::InvalidChange, "position"),
        (vec![to([f64::NAN, 0.0, 0.0])], Reason::InvalidField, "colliders[0].position.x"),
        (vec![nothing], Reason::InvalidField, "neither position nor turn"),
    ]
}

/// The same of paths.
fn refused_paths() -> Vec<(Vec<v1::ColliderPath>, Reason, &'static str)> {
    let good = path(3);
    let times =
        |times_seconds: &[f64]| v1::ColliderPath { times_seconds: times_seconds.to_vec(), ..good.clone() };
    let turns = |turns: Vec<f64>| v1::ColliderPath { turns, ..good.clone() };
    let positions = |positions: Vec<f64>| v1::ColliderPath { positions, ..good.clone() };
    let there = [0.0; 6].to_vec();
    let far = [there.clone(), vec![1e6 + 1.0, 0.0, 0.0]].concat();
    // 1 km within a step of 2 ms.
    let fast = [there, vec![0.0, 1e3, 0.0]].concat();
    let long = [good.turns[..8].to_vec(), vec![0.0, 0.0, 0.0, 1.1]].concat();
    let nothing = v1::ColliderPath { positions: Vec::new(), turns: Vec::new(), ..good.clone() };
    let named = v1::ColliderPath { name: "table".into(), ..good.clone() };
    vec![
        (vec![times(&[0.002, 0.004])], Reason::InvalidField, "9 numbers: three for each of 2 times"),
        (vec![turns(good.turns[1..].to_vec())], Reason::InvalidField, "11 numbers: four for each of 3 times"),
        (vec![times(&[])], Reason::InvalidField, "9 numbers: three for each of 0 times"),
        (vec![times(&[0.0, 0.004, 0.006])], Reason::InvalidField, "above 0"),
        (vec![times(&[0.002, 0.006, 0.004])], Reason::InvalidChange, "box"),
        (vec![times(&[0.002, 0.004, 0.004])], Reason::InvalidChange, "box"),
        (vec![times(&[0.002, 0.004, f64::NAN])], Reason::InvalidField, "collider_paths[0].times_seconds[2]"),
        (vec![positions(far)], Reason::InvalidChange, "position"),
        (vec![positions(fast)], Reason::InvalidChange, "m/s"),
        (vec![turns(long)], Reason::InvalidChange, "length"),
        (vec![nothing], Reason::InvalidField, "neither positions nor turns"),
        (vec![named], Reason::InvalidChange, "box, ball"),
        (vec![good.clone(), good], Reason::InvalidChange, "box"),
    ]
}

#[tokio::test(flavor = "multi_thread")]
async fn a_refused_move_changes_nothing() {
    let mut server = Server::start().await;
    let id = server.session(scene()).await;
    let both = (vec![update(1)], vec![path(3)], Reason::InvalidChange, "box");
    let moves = refused_moves()
        .into_iter()
        .map(|(moves, reason, told)| (moves, Vec::<v1::ColliderPath>::new(), reason, told));
    let paths = refused_paths()
        .into_iter()
        .map(|(paths, reason, told)| (Vec::<v1::ColliderUpdate>::new(), paths, reason, told));
    for (colliders, collider_paths, reason, told) in moves.chain(paths).chain([both]) {
        // A good change before it, and a good move of another collider.
        let gravity = Some([0.0, 99.0, 0.0].into());
        let aside = v1::ColliderUpdate { name: "ball".into(), ..update(1) };
        let colliders = [colliders, vec![aside]].concat();
        let request = v1::UpdateParametersRequest {
            gravity,
            colliders: colliders.clone(),
            collider_paths: collider_paths.clone(),
            ..v1::UpdateParametersRequest::of(&id)
        };
        let status = server.client.update_parameters(request).await.expect_err("refused");
        println!("{}", status.message());
        assert_reason(&status, reason);
        assert!(status.message().contains(told), "'{told}' is missing: {}", status.message());
        assert!(status.get_details_bad_request().is_some_and(|bad| !bad.field_violations.is_empty()));

        let changes = Some(v1::Changes { gravity, colliders, collider_paths, ..v1::Changes::default() });
        let request = v1::StepSessionRequest { changes, ..v1::StepSessionRequest::of(&id) };
        let status = server.client.step_session(request).await.expect_err("refused");
        assert_reason(&status, reason);
    }

    let untouched = server.session(scene()).await;
    let (a, b) = (server.step(&id, 10).await, server.step(&untouched, 10).await);
    assert_eq!((a.step, a.state_hash), (10, b.state_hash));
    assert_eq!(a.parameters, b.parameters);
}

/// A turn by an angle (rad) about z.
fn about_z(angle: f64) -> v1::Quaternion {
    let (sine, cosine) = (0.5 * angle).sin_cos();
    [0.0, 0.0, sine, cosine].into()
}

#[tokio::test(flavor = "multi_thread")]
async fn a_surface_that_particles_would_meet_too_fast_is_refused() {
    let mut server = Server::start().await;
    // Within a step of 2 ms, 10 000 m/s are 0.02 rad at a distance of 1 km; the sheet is within 1 m of the origin.
    let plane = "[[collider]]\nname = \"ground\"\nplane = { point = [0, -1000, 0], normal = [0, 1, 0] }\n";
    let id = server.session(scene() + plane).await;
    let turned = |name: &str, angle: f64| v1::ColliderUpdate {
        name: name.into(),
        position: None,
        turn: Some(about_z(angle)),
        duration_seconds: DT,
    };
    let refused = server.client.update_parameters(updates(&id, 0, vec![turned("ground", 0.0202)])).await;
    let status = refused.expect_err("it is too fast");
    assert_eq!(assert_reason(&status, Reason::InvalidChange)["collider"], "ground");
    let told = ["from where it is to pose 0", "collider 'ground'", "at most 10000 m/s"];
    assert!(told.iter().all(|part| status.message().contains(part)), "{}", status.message());

    let there_and_on = |angle: f64| v1::ColliderPath {
        name: "ground".into(),
        times_seconds: vec![DT, 2.0 * DT],
        positions: Vec::new(),
        turns: [about_z(0.0), about_z(angle)].into_iter().flat_map(<[f64; 4]>::from).collect(),
    };
    let refused = server.client.update_parameters(paths(&id, 30, vec![there_and_on(0.0202)])).await;
    let status = refused.expect_err("it is too fast");
    assert!(status.message().contains("from pose 0 to pose 1"), "{}", status.message());

    // A little slower is taken, and what is small may turn as fast as it likes.
    send(&mut server, updates(&id, 0, vec![turned("ground", 0.0198), turned("box", 3.0)])).await;
    send(&mut server, paths(&id, 30, vec![there_and_on(0.0198)])).await;
    server.step(&id, 1).await;

    // From where it will be then nobody knows.
    send(&mut server, updates(&id, 40, vec![turned("ground", 1.0)])).await;
    let again = server.client.update_parameters(updates(&id, 0, vec![turned("ground", 1.0)])).await;
    again.expect("another move of it waits");
}

#[tokio::test(flavor = "multi_thread")]
async fn moves_that_wait_are_listed_as_they_were_asked_for() {
    let mut server = Server::start().await;
    let id = server.session(scene()).await;
    let straight = v1::ColliderUpdate { turn: None, ..update(3) };
    let on_the_spot = v1::ColliderPath { name: "ball".into(), positions: Vec::new(), ..path(4) };
    let request = v1::UpdateParametersRequest {
        collider_paths: vec![on_the_spot.clone()],
        ..updates(&id, 50, vec![straight.clone()])
    };
    send(&mut server, request).await;
    send(&mut server, paths(&id, 60, vec![path(5)])).await;
    let listed = server.client.list_pending_changes(v1::ListPendingChangesRequest::of(&id)).await;
    let listed = listed.expect("a page").into_inner().changes;
    let [first, second] = &listed[..] else { panic!("two calls wait: {listed:?}") };
    let first = first.changes.as_ref().expect("changes");
    assert_eq!((&first.colliders, &first.collider_paths), (&vec![straight], &vec![on_the_spot]));
    assert_eq!(second.changes.as_ref().expect("changes").collider_paths, [path(5)]);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_fork_in_the_middle_of_a_way_goes_on_with_the_same_bits() {
    let mut server = Server::start().await;
    let id = server.session(scene()).await;
    let slow = v1::ColliderUpdate { duration_seconds: 80.0 * DT, ..update(100) };
    send(&mut server, updates(&id, 0, vec![slow])).await;
    // A move that waits goes with it too.
    let below = [0.0, -3.0, 0.0];
    let aside = v1::ColliderUpdate { name: "ball".into(), position: Some(below.into()), ..update(0) };
    send(&mut server, updates(&id, 60, vec![aside])).await;
    let original = server.step(&id, 37).await;
    let request = v1::ForkSessionRequest { new_session_id: "copy".into(), ..v1::ForkSessionRequest::of(&id) };
    let copy = server.client.fork_session(request).await.expect("forked").into_inner().session;
    let copy = copy.expect("a session");
    assert_eq!(
        (copy.state_hash, &copy.parameters),
        (original.state_hash, &original.parameters),
        "it stands where the original stands"
    );
    let (original, copy) = (server.step(&id, 80).await, server.step("copy", 80).await);
    assert_eq!((copy.state_hash, copy.parameters.clone()), (original.state_hash, original.parameters));
    let (position, turn) = lift(100);
    close(pose(&copy, "box").0, position);
    close(pose(&copy, "box").1, turn);
    close(pose(&copy, "ball").0, below);
}

#[tokio::test(flavor = "multi_thread")]
async fn a_reset_puts_moved_colliders_back() {
    let mut server = Server::start().await;
    let id = server.session(scene()).await;
    let below = [0.25, -0.5, 0.3];
    let lower = v1::ColliderUpdate { position: Some(below.into()), ..update(100) };
    send(&mut server, updates(&id, 0, vec![lower])).await;
    let moved = server.step(&id, 5).await;
    close(pose(&moved, "box").0, below);
    server.client.reset_session(v1::ResetSessionRequest::of(&id)).await.expect("a reset");
    let reset = server.get(&id).await;
    assert_eq!(pose(&reset, "box"), (START, [0.0, 0.0, 0.0, 1.0]));
    // Time goes on, and with it who has a velocity.
    close(pose(&reset, "ball").0, [0.0, -2.0, 0.5 * reset.time_seconds]);
}

#[tokio::test(flavor = "multi_thread")]
async fn points_of_paths_of_colliders_count_as_changes() {
    let limits = Limits { max_changes_per_call: 10, max_pending_changes: 15, ..Limits::default() };
    let mut server = Server::with(limits).await;
    let id = server.session(scene()).await;
    let refused = server.client.update_parameters(paths(&id, 0, vec![path(11)])).await.expect_err("too many");
    assert_eq!(assert_reason(&refused, Reason::TooManyChanges)["changes"], "11");
    let many = updates(&id, 0, vec![update(1); 11]);
    let refused = server.client.update_parameters(many).await.expect_err("too many");
    assert_eq!(assert_reason(&refused, Reason::TooManyChanges)["allowed"], "10");
    send(&mut server, paths(&id, 5, vec![path(10)])).await;
    let refused =
        server.client.update_parameters(paths(&id, 6, vec![path(10)])).await.expect_err("too many wait");
    assert_eq!(assert_reason(&refused, Reason::TooManyChanges)["changes"], "20");
    server.step(&id, 6).await;
    send(&mut server, paths(&id, 20, vec![path(10)])).await;
}

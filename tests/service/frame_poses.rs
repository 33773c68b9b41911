//! Where colliders are in frames: those that keys of the scene or calls move, for watchers from the start, for those that
//! come later, and in answers of steps.

use nappe_client::{Client, ColliderPose, Event, Frame, Steps, WatchOptions};
use nappe_proto::v1;

use crate::{
    cloth_scenes::{dust, sheet_with},
    frames::in_time,
    harness::{Server, every, latest},
};

/// A box that turns by 90 degrees about y and rises by 0.1 m in 0.04 s, and a ball that only moves.
const COLLIDERS: &str = r#"
    [[collider]]
    name = "box"
    box = { center = [0.25, -1, 0.3], size = [0.3, 0.1, 0.2] }
    [[collider.key]]
    time = 0
    position = [0.25, -1, 0.3]
    [[collider.key]]
    time = 0.04
    position = [0.25, -0.9, 0.3]
    turn = [0, 1, 0, 1]
    [[collider]]
    name = "ball"
    sphere = { center = [0, -2, 0], radius = 0.2 }
    velocity = [0, 0, 0.5]
"#;

/// A pose on the wire.
fn told(pose: &v1::ColliderPose) -> (&str, [f64; 3], [f64; 4]) {
    (&pose.name, pose.position.expect("a position").into(), pose.turn.expect("a turn").into())
}

fn read(pose: &ColliderPose) -> (&str, [f64; 3], [f64; 4]) {
    (&pose.name, pose.position, pose.turn)
}

/// Checks that a pose is that of the box after a share of its way.
#[track_caller]
fn is_on_its_way((name, position, turn): (&str, [f64; 3], [f64; 4]), share: f64) {
    let (sine, cosine) = (share * std::f64::consts::FRAC_PI_4).sin_cos();
    let expected = ([0.25, -1.0 + 0.1 * share, 0.3], [0.0, sine, 0.0, cosine]);
    let far = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    assert_eq!(name, "box");
    assert!(far(&position, &expected.0) < 1e-12, "{position:?} is not {:?}", expected.0);
    assert!(far(&turn, &expected.1) < 1e-12, "{turn:?} is not {:?}", expected.1);
}

/// The next frame of a stream that begins now.
async fn next_frame(client: &Client, id: &str) -> Frame {
    let mut frames = client.watch(id, WatchOptions::default()).await.expect("a stream");
    in_time(async {
        loop {
            if let Event::Frame(frame) = frames.next().await.expect("no end").expect("no error") {
                return frame;
            }
        }
    })
    .await
}

#[tokio::test(flavor = "multi_thread")]
async fn frames_say_where_a_turning_box_is() {
    let mut server = Server::start().await;
    let id = server.session(sheet_with(6, "steps = 20") + COLLIDERS).await;
    let mut watch = server.watch(every(&id, 0)).await;
    server.play(&id).await;
    let (frames, _end) = watch.until_end().await;
    assert_eq!(frames.len(), 21);
    for at in [0, 10, 20] {
        let [pose] = &frames[at].head.poses[..] else { panic!("the ball has a velocity: {at}") };
        is_on_its_way(told(pose), at as f64 / 20.0);
    }
}

#[tokio::test(flavor = "multi_thread")]
async fn poses_are_on_the_first_of_several_pieces() {
    let mut server = Server::start().await;
    let id = server.session(dust(300, "steps = 10") + COLLIDERS).await;
    let frame = server.watch(latest(&id)).await.frame().await;
    assert!(frame.piece_count > 1, "{} pieces", frame.piece_count);
    let [pose] = &frame.head.poses[..] else { panic!("one pose") };
    is_on_its_way(told(pose), 0.0);
}

#[tokio::test(flavor = "multi_thread")]
async fn what_a_call_moves_is_told_from_then_on_to_everyone_until_a_reset() {
    let mut server = Server::start().await;
    let client = Client::connect(&server.app.url()).await.expect("connected");
    let id = server.session(sheet_with(6, "") + COLLIDERS).await;
    let names = |frame: &Frame| frame.poses.iter().map(|pose| pose.name.clone()).collect::<Vec<_>>();
    assert_eq!(names(&next_frame(&client, &id).await), ["box"]);

    let turn = [0.0, 0.6, 0.0, 0.8];
    let aside = v1::ColliderUpdate {
        name: "ball".into(),
        position: Some([1.0, -2.0, 0.0].into()),
        turn: Some(turn.into()),
        duration_seconds: 0.01,
    };
    let changes = Some(v1::Changes { colliders: vec![aside], ..v1::Changes::default() });
    let (_, frame) =
        client.advance(&id, Steps { step_count: 10, changes, ..Steps::default() }).await.expect("stepped");
    assert_eq!(names(&frame), ["box", "ball"]);
    is_on_its_way(read(&frame.poses[0]), 0.5);
    assert_eq!(read(&frame.poses[1]), ("ball", [1.0, -2.0, 0.0], turn));
    assert_eq!(next_frame(&client, &id).await.poses, frame.poses, "a stream that begins later has them");

    server.client.reset_session(v1::ResetSessionRequest::of(&id)).await.expect("a reset");
    assert_eq!(names(&next_frame(&client, &id).await), ["box"]);
}

//! A create whose caller has gone gives its place back soon, wherever its build stands.

use std::time::{Duration, Instant};

use nappe_proto::v1;
use nappe_server::{Limits, Reason};

use crate::{
    cloth_scenes::sheet,
    frames::in_time,
    harness::{Server, assert_reason},
};

/// Time in which the place is free again. It takes 2 to 26 ms; run to their ends, the builds take 7 and 27 s.
const SOON: Duration = Duration::from_secs(3);

fn create(text: String) -> v1::CreateSessionRequest {
    let scene = Some(v1::create_session_request::Scene::SceneText(text));
    v1::CreateSessionRequest { scene, ..v1::CreateSessionRequest::default() }
}

/// A sheet of a million particles and 6 million springs, on edges: seconds of work.
const CLOTH: &str = r#"
version = 1
dt = 1e-4
[[body]]
name = "sheet"
mesh = { grid = [1000, 1000], spacing = 0.001 }
mass = { density = 0.2 }
pins = ["top_left"]
[body.springs]
pattern = "edges"
stretch = { stiffness = 200, damping = 0.02 }
shear = { stiffness = 50, damping = 0.01 }
bend = { stiffness = 5, damping = 0.002 }
"#;

/// Two million particles at random places: seconds of work.
const SNOW: &str = r#"
version = 1
dt = 1e-3
[snow]
cell = 0.01
[[snow.object]]
name = "ball"
sphere = { center = [0, 0, 0], radius = 0.35 }
sampling = "poisson"
density_noise = 0.2
"#;

#[tokio::test(flavor = "multi_thread")]
async fn an_abandoned_create_gives_its_place_back_soon() {
    let mut server = Server::with(Limits { max_sessions: 1, ..Limits::default() }).await;
    for scene in [CLOTH, SNOW] {
        for leave_after in [0.05, 0.3, 0.8, 1.5, 2.5] {
            // A machine that is busy with something else may be late once; a build that runs to its end always is.
            let mut times = Vec::new();
            while times.last().is_none_or(|time| *time >= SOON) {
                assert!(times.len() < 5, "left after {leave_after} s: {times:?}");
                times.push(abandon(&mut server, scene, Duration::from_secs_f64(leave_after)).await);
            }
            println!("left after {leave_after} s: {times:?}");
        }
    }
}

/// Leaves a create after a time, and waits for its place; gives how long that took.
async fn abandon(server: &mut Server, scene: &str, leave_after: Duration) -> Duration {
    // Dropping the call tells the server that nobody waits for it.
    let mut leaver = server.client.clone();
    let call = leaver.create_session(create(scene.to_owned()));
    if let Ok(made) = tokio::time::timeout(leave_after, call).await {
        // This machine built it before.
        delete(server, made.expect("made").into_inner().session).await;
        return Duration::ZERO;
    }

    let begin = Instant::now();
    let made = async {
        loop {
            match server.client.create_session(create(sheet(3))).await {
                Ok(made) => break made.into_inner().session,
                Err(status) => drop(assert_reason(&status, Reason::TooManySessions)),
            }
            tokio::time::sleep(Duration::from_millis(5)).await;
        }
    };
    let made = in_time(made).await;
    let time = begin.elapsed();
    delete(server, made).await;
    time
}

async fn delete(server: &mut Server, session: Option<v1::Session>) {
    let id = session.expect("the answer has the session").session_id;
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
}

//! Shipped scenes go on from files of their sessions, in both precisions: at once, later and after a reset with the same bits.

use nappe_proto::v1::{self, create_session_request::Scene};
use nappe_scene::shipped_scenes;

use crate::{
    harness::{Server, request},
    saved_sessions::{create, save, session},
};

/// Scenes that take seconds; all of them take minutes.
const QUICK: [&str; 2] = ["flag", "hanging_sheet"];
/// The id of each session.
const ID: &str = "scene";
/// Steps after which both sessions are compared again.
const LATER: u64 = 20;

async fn reset(server: &mut Server) {
    server.client.reset_session(v1::ResetSessionRequest::of(ID)).await.expect("it is reset");
}

async fn delete(server: &mut Server) {
    server.client.delete_session(v1::DeleteSessionRequest::of(ID)).await.expect("it is deleted");
}

/// Takes both sessions so many steps further, to the same state.
async fn compare(first: &mut Server, second: &mut Server, steps: u64, what: &str) {
    let (original, again) = (first.step(ID, steps).await, second.step(ID, steps).await);
    assert!(original.state_hash.is_some(), "{what}: {original:?}");
    assert_eq!(
        (again.step, again.frame, again.state_hash),
        (original.step, original.frame, original.state_hash),
        "{what}, {steps} steps later"
    );
}

#[tokio::test(flavor = "multi_thread")]
async fn shipped_scenes_go_on_from_files_with_the_same_bits() {
    let (mut first, mut second) = (Server::start().await, Server::start().await);
    let names = shipped_scenes().iter().map(|(name, _)| *name);
    for name in names.filter(|name| cfg!(feature = "slow") || QUICK.contains(name)) {
        for precision in [v1::Precision::F32, v1::Precision::F64] {
            let asked = v1::CreateSessionRequest {
                session_id: ID.into(),
                scene: Some(Scene::SceneName(name.into())),
                precision: precision.into(),
                step_limit: Some(0),
                ..request()
            };
            first.create(asked).await;
            // From the start, after a step, and after some more and a reset.
            for steps in [0, 1, 4] {
                let original = match steps {
                    0 => first.get(ID).await,
                    steps => first.step(ID, steps).await,
                };
                let what = format!("{name} in {precision:?} from step {}", original.step);
                let file = save(&mut first, ID).await.expect("it is saved");
                let again = session(create(&mut second, &file, ID).await.expect("it goes on"));
                assert_eq!((again.step, again.frame), (original.step, original.frame), "{what}");
                if original.state_hash.is_some() {
                    assert_eq!(again.state_hash, original.state_hash, "{what}");
                }
                compare(&mut first, &mut second, LATER, &what).await;
                reset(&mut first).await;
                reset(&mut second).await;
                compare(&mut first, &mut second, 2, &what).await;
                delete(&mut second).await;
            }
            delete(&mut first).await;
        }
    }
}

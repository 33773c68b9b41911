//! The frames that a session keeps take the memory that it is allowed, however few the particles of a frame are.

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
};
use nappe_server::Limits;

use crate::{alone, server, used};

/// `count` particles without springs, a frame after each step.
fn dust(count: u32) -> String {
    format!(
        "version = 1\ndt = 1e-3\n[[body]]\nname = \"dust\"\nmesh = {{ grid = [1, {count}], spacing = 0.01 }}\n\
         mass = {{ particle = 0.1 }}\nintegrator = \"symplectic_euler\"\n"
    )
}

/// Bytes that a session of so many particles grows by in so many frames, with `budget` bytes for frames.
async fn growth(count: u32, frames: u64, budget: u64) -> usize {
    let limits = Limits { history_bytes_per_session: budget, ..Limits::default() };
    let (app, channel) = server(limits).await;
    let mut client = SimulationServiceClient::new(channel);
    let request = v1::CreateSessionRequest {
        scene: Some(Scene::SceneText(dust(count))),
        thread_count: 1,
        ..v1::CreateSessionRequest::default()
    };
    let made = client.create_session(request).await.expect("a session is made").into_inner();
    let session_id = made.session.expect("the answer has the session").session_id;
    let step = |step_count| v1::StepSessionRequest {
        step_count,
        wait: true,
        ..v1::StepSessionRequest::of(&session_id)
    };

    client.step_session(step(2)).await.expect("steps are taken");
    let before = used();
    client.step_session(step(frames)).await.expect("steps are taken");
    let grown = used().saturating_sub(before);
    app.shutdown().await;
    grown
}

#[test]
fn kept_frames_take_no_more_memory_than_they_are_allowed() {
    let _alone = alone();
    let runtime = tokio::runtime::Builder::new_multi_thread()
        .worker_threads(2)
        .enable_all()
        .build()
        .expect("a runtime");
    for (count, frames, budget) in
        [(1, 10_000, 4 << 20), (4, 10_000, 4 << 20), (100, 4_000, 4 << 20), (100_000, 30, 16 << 20)]
    {
        let grown = runtime.block_on(growth(count, frames, budget));
        println!("{count} particles: {grown} bytes of {budget}");
        assert!(grown as u64 <= budget + budget / 4, "{count} particles: {grown} bytes of {budget}");
        // A large first frame, which has every field, made room for later ones.
        let is_small = count < 1000;
        assert!(
            !is_small || grown as u64 >= budget / 2,
            "{count} particles: {grown} bytes of {budget} are used"
        );
    }
}

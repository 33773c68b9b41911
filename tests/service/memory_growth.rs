//! Snow that flies apart takes more memory than it had at the start: that is counted too.

use nappe_proto::v1::{self, SessionState};
use nappe_server::{Limits, Reason};

use crate::harness::{Server, assert_reason, request};

/// A soft ball of 10 000 particles that spins so fast that it flies apart: from some 700 to 2 000 bytes per particle.
const SPINNING: &str = "
version = 1
dt = 0.005
gravity = [0, 0, 0]
[snow]
cell = 0.03
[[snow.object]]
name = 'ball'
sphere = { center = [0, 0, 0], radius = 0.2 }
angular_velocity = [0, 0, 100]
material = { young = 10 }
";

fn limits(max_server_bytes: u64) -> Limits {
    Limits { history_bytes_per_session: 1 << 20, max_server_bytes, ..Limits::default() }
}

fn spinning() -> v1::CreateSessionRequest {
    let scene = v1::create_session_request::Scene::SceneText(SPINNING.to_owned());
    v1::CreateSessionRequest { scene: Some(scene), ..request() }
}

#[tokio::test(flavor = "multi_thread")]
async fn a_grid_that_grows_counts_against_the_memory_of_the_server() {
    let mut server = Server::with(limits(1 << 20)).await;
    let refused = server.client.create_session(spinning()).await.expect_err("a megabyte is not enough");
    let needed = &assert_reason(&refused, Reason::ServerMemoryFull)["needed_bytes"];
    let needed: u64 = needed.parse().expect("a number of bytes");

    // Enough to build it, and not enough for its grid to grow.
    let mut server = Server::with(limits(needed + (1 << 20))).await;
    let id = server.create(spinning()).await;
    let steps = v1::StepSessionRequest { step_count: 40, wait: true, ..v1::StepSessionRequest::of(&id) };
    let failed = server.client.step_session(steps).await.expect_err("the server is full");
    assert_reason(&failed, Reason::ServerMemoryFull);
    let session = server.get(&id).await;
    assert_eq!(session.state(), SessionState::Failed);
    assert!(session.step > 0 && session.step < 40, "{session:?}");
    assert_eq!(session.failure.expect("it tells why").reason, Reason::ServerMemoryFull.name());

    // It keeps what it has until it is deleted; then there is room again.
    server.client.delete_session(v1::DeleteSessionRequest::of(&id)).await.expect("deleted");
    server.create(spinning()).await;
}

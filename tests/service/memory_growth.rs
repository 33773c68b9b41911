//! Snow that flies apart and cloth that comes together take more memory than they had at the start: that is counted too.

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

/// Sixteen sheets of 10 x 10 particles, a quarter of a millimetre from one to the next, with a thickness (m).
fn pile(thickness: f64) -> v1::CreateSessionRequest {
    let law = "{ stiffness = 100.0 }";
    let sheet = |layer: u32| {
        format!(
            "[[body]]\nname = 'sheet{layer}'\nmesh = {{ grid = [10, 10], spacing = 0.01 }}\nmass = {{ particle = 0.001 }}\n\
             integrator = 'implicit_euler'\nthickness = {thickness}\n\
             springs = {{ stretch = {law}, shear = {law}, bend = {law} }}\n\
             transform = {{ translate = [0, {:e}, 0] }}\n",
            2.5e-4 * f64::from(layer)
        )
    };
    let sheets: String = (0..16).map(sheet).collect();
    let scene = v1::create_session_request::Scene::SceneText(format!("version = 1\ndt = 0.001\n{sheets}"));
    v1::CreateSessionRequest { scene: Some(scene), ..request() }
}

#[tokio::test(flavor = "multi_thread")]
async fn pairs_of_surfaces_count_against_the_memory_of_the_server_and_others_go_on_with_their_bits() {
    let mut server = Server::with(limits(1 << 30)).await;
    let thin = server.create(pile(0.0)).await;
    let expected = server.step(&thin, 5).await.state_hash;
    assert!(expected.is_some(), "a session that stands has a hash");

    // Some 200 000 pairs may meet.
    let mut server = Server::with(limits(24 << 20)).await;
    let (thin, thick) = (server.create(pile(0.0)).await, server.create(pile(0.004)).await);
    server.step(&thin, 2).await;
    let step = v1::StepSessionRequest { step_count: 1, wait: true, ..v1::StepSessionRequest::of(&thick) };
    let failed = server.client.step_session(step).await.expect_err("the server is full");
    assert_reason(&failed, Reason::ServerMemoryFull);
    let session = server.get(&thick).await;
    assert_eq!((session.state(), session.step), (SessionState::Failed, 0));
    assert_eq!(server.step(&thin, 3).await.state_hash, expected);
}

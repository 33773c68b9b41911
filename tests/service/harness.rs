//! A server in this process, a client of it, and what every test does with them.

use std::{collections::BTreeMap, time::Duration};

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
};
use nappe_server::{App, Config, DOMAIN, Limits, Reason};
use tonic::{Code, Status, transport::Channel};
use tonic_types::StatusExt as _;

use crate::frames::{PATIENCE, Watch, in_time};

/// A client of the generated stubs.
pub(crate) type Client = SimulationServiceClient<Channel>;

/// A server and a client of it.
pub(crate) struct Server {
    pub(crate) app: App,
    pub(crate) client: Client,
}

impl Server {
    /// A server with default limits.
    pub(crate) async fn start() -> Self {
        Self::with(Limits::default()).await
    }

    /// A server with these limits.
    pub(crate) async fn with(limits: Limits) -> Self {
        Self::configured(Config { limits, ..config() }).await
    }

    /// A server with this configuration.
    pub(crate) async fn configured(config: Config) -> Self {
        let app = started(config);
        let client = connect(&app).await;
        Self { app, client }
    }

    /// Makes a session of a scene's text and returns its id.
    pub(crate) async fn session(&mut self, text: String) -> String {
        self.create(v1::CreateSessionRequest { scene: Some(Scene::SceneText(text)), ..request() }).await
    }

    /// Makes a session and returns its id.
    pub(crate) async fn create(&mut self, request: v1::CreateSessionRequest) -> String {
        let made = self.client.create_session(request).await.expect("a session is made").into_inner();
        made.session.expect("the answer has the session").session_id
    }

    /// Takes steps and returns the session after them.
    pub(crate) async fn step(&mut self, id: &str, step_count: u64) -> v1::Session {
        let request = v1::StepSessionRequest { step_count, wait: true, ..v1::StepSessionRequest::of(id) };
        let stepped = self.client.step_session(request).await.expect("the steps are taken").into_inner();
        stepped.session.expect("the answer has the session")
    }

    /// Plays as fast as possible. Who reads every frame of it may fall behind what is kept, unless it ends by itself.
    pub(crate) async fn play(&mut self, id: &str) {
        self.play_at(id, 0.0).await;
    }

    /// Plays at a rate at which all frames are kept for minutes.
    pub(crate) async fn play_in_real_time(&mut self, id: &str) {
        self.play_at(id, 1.0).await;
    }

    async fn play_at(&mut self, id: &str, real_time_factor: f64) {
        let request = v1::PlaySessionRequest { real_time_factor, ..v1::PlaySessionRequest::of(id) };
        self.client.play_session(request).await.expect("it plays");
    }

    /// Pauses, and returns the session once it stands.
    pub(crate) async fn pause(&mut self, id: &str) -> v1::Session {
        let request = v1::PauseSessionRequest { session_id: id.into(), wait: true, ..Default::default() };
        let paused = self.client.pause_session(request).await.expect("it pauses").into_inner();
        paused.session.expect("the answer has the session")
    }

    /// The session as it is.
    pub(crate) async fn get(&mut self, id: &str) -> v1::Session {
        let got = self.client.get_session(v1::GetSessionRequest::of(id)).await;
        got.expect("the session is there").into_inner().session.expect("the answer has the session")
    }

    /// Waits until the session is as wanted.
    pub(crate) async fn until(&mut self, id: &str, wanted: impl Fn(&v1::Session) -> bool) -> v1::Session {
        let waiting = async {
            loop {
                let session = self.get(id).await;
                if wanted(&session) {
                    return session;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time(waiting).await
    }

    /// Leaves a change that changes nothing for the first step.
    pub(crate) async fn mark_first_step(&mut self, id: &str) {
        let gravity = self.get(id).await.parameters.expect("parameters").gravity;
        let mark = v1::UpdateParametersRequest { gravity, ..v1::UpdateParametersRequest::of(id) };
        self.client.update_parameters(mark).await.expect("accepted");
    }

    /// Waits until a step has begun for which the only change was left that waits.
    pub(crate) async fn until_marked_step(&mut self, id: &str) {
        self.until_pending(id, 0).await;
    }

    /// Waits until so many changes wait for their step.
    pub(crate) async fn until_pending(&mut self, id: &str, count: usize) {
        let waiting = async {
            loop {
                let list = v1::ListPendingChangesRequest::of(id);
                let listed = self.client.list_pending_changes(list).await.expect("a page").into_inner();
                if listed.changes.len() == count {
                    return;
                }
                tokio::time::sleep(Duration::from_millis(5)).await;
            }
        };
        in_time(waiting).await;
    }

    /// Starts to watch frames.
    pub(crate) async fn watch(&mut self, request: v1::WatchFramesRequest) -> Watch {
        let stream = self.client.watch_frames(request).await.expect("the stream opens").into_inner();
        Watch::new(stream).await
    }
}

/// Times so long that a busy machine breaks none of them: a test that is about one sets it.
pub(crate) fn config() -> Config {
    Config {
        drain_seconds: 300.0,
        drain_stall_seconds: 300.0,
        handshake_seconds: 300.0,
        request_seconds: 300.0,
        upload_idle_seconds: 300.0,
        watcher_stall_seconds: 300.0,
        ..Config::default()
    }
}

/// A server on a free port of loopback, which nobody is connected to. It asks for no token, since most tests are about
/// something else.
pub(crate) fn started(config: Config) -> App {
    let address = "127.0.0.1:0".parse().expect("an address");
    App::start(Config { address, no_token: true, ..config }).expect("the server starts")
}

/// A new connection to a server. A call that is not answered in time fails.
pub(crate) async fn channel(app: &App) -> Channel {
    let endpoint = Channel::from_shared(app.url()).expect("a URL").timeout(PATIENCE);
    endpoint.connect().await.expect("the server answers")
}

/// A client with a connection of its own.
pub(crate) async fn connect(app: &App) -> Client {
    Client::new(channel(app).await).max_decoding_message_size(2 << 20)
}

/// A request for one thread; the scene is missing.
pub(crate) fn request() -> v1::CreateSessionRequest {
    v1::CreateSessionRequest { thread_count: 1, ..v1::CreateSessionRequest::default() }
}

/// A request to watch every frame from `from_frame`.
pub(crate) fn every(id: &str, from_frame: u64) -> v1::WatchFramesRequest {
    v1::WatchFramesRequest {
        session_id: id.into(),
        delivery: v1::Delivery::Every.into(),
        from_frame: Some(from_frame),
        ..v1::WatchFramesRequest::default()
    }
}

/// A request to watch the newest frames.
pub(crate) fn latest(id: &str) -> v1::WatchFramesRequest {
    v1::WatchFramesRequest { session_id: id.into(), ..v1::WatchFramesRequest::default() }
}

/// Checks that a status has a reason of the table with its code, and returns the metadata.
pub(crate) fn assert_reason(status: &Status, reason: Reason) -> BTreeMap<String, String> {
    let info = status.get_details_error_info().unwrap_or_else(|| panic!("no ErrorInfo: {status:?}"));
    assert_eq!(info.reason, reason.name(), "{status:?}");
    assert_eq!(info.domain, DOMAIN);
    assert_eq!(status.code(), reason.code(), "{status:?}");
    assert!(!status.message().is_empty(), "an error says something");
    assert_ne!(status.code(), Code::Ok);
    info.metadata.into_iter().collect()
}

//! A server in this process, a client of it, and what every test does with them.

use std::{collections::BTreeMap, time::Duration};

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
};
use nappe_server::{App, Config, DOMAIN, Limits, Reason};
use tonic::{Code, Status, transport::Channel};
use tonic_types::StatusExt as _;

use crate::frames::{PATIENCE, Watch};

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
        Self::configured(Config { limits, ..Config::default() }).await
    }

    /// A server with this configuration, on a free port of loopback. It asks for no token, since most tests are
    /// about something else.
    pub(crate) async fn configured(config: Config) -> Self {
        let address = "127.0.0.1:0".parse().expect("an address");
        let app = App::start(Config { address, no_token: true, ..config }).expect("the server starts");
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

    /// Plays as fast as possible.
    pub(crate) async fn play(&mut self, id: &str) {
        let request = v1::PlaySessionRequest { real_time_factor: 0.0, ..v1::PlaySessionRequest::of(id) };
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
        tokio::time::timeout(PATIENCE, waiting).await.expect("it comes true in time")
    }

    /// Starts to watch frames.
    pub(crate) async fn watch(&mut self, request: v1::WatchFramesRequest) -> Watch {
        let stream = self.client.watch_frames(request).await.expect("the stream opens").into_inner();
        Watch::new(stream).await
    }
}

/// A new connection to a server.
pub(crate) async fn channel(app: &App) -> Channel {
    let endpoint = Channel::from_shared(app.url()).expect("a URL");
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

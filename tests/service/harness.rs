//! A server in this process, a client of it, and the few things that every test does.

use std::{collections::BTreeMap, time::Duration};

use nappe_proto::v1::{
    self, create_session_request::Scene, simulation_service_client::SimulationServiceClient,
    watch_frames_response::Event,
};
use nappe_server::{App, Config, DOMAIN, Limits, Reason};
use tokio_stream::StreamExt as _;
use tonic::{Code, Status, Streaming, transport::Channel};
use tonic_types::StatusExt as _;

/// A client of the generated stubs.
pub(crate) type Client = SimulationServiceClient<Channel>;

/// Nothing in this suite takes this long unless it hangs.
pub(crate) const PATIENCE: Duration = Duration::from_mins(1);

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

    /// A server with this configuration, on a free port of loopback.
    pub(crate) async fn configured(config: Config) -> Self {
        let address = "127.0.0.1:0".parse().expect("an address");
        let app = App::start(Config { address, ..config }).expect("the server starts");
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
        let request = v1::StepSessionRequest { session_id: id.into(), step_count, wait: true };
        let stepped = self.client.step_session(request).await.expect("the steps are taken").into_inner();
        stepped.session.expect("the answer has the session")
    }

    /// Plays as fast as possible.
    pub(crate) async fn play(&mut self, id: &str) {
        let request = v1::PlaySessionRequest { session_id: id.into(), real_time_factor: 0.0 };
        self.client.play_session(request).await.expect("it plays");
    }

    /// The session as it is.
    pub(crate) async fn get(&mut self, id: &str) -> v1::Session {
        let got = self.client.get_session(v1::GetSessionRequest { session_id: id.into() }).await;
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

    /// Watches frames.
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

/// A sheet of `side` x `side` particles that hangs by two corners, with more lines at the root.
pub(crate) fn sheet_with(side: u32, root: &str) -> String {
    format!(
        r#"
        version = 1
        title = "a sheet of {side}"
        dt = 0.002
        {root}
        [[body]]
        name = "sheet"
        mesh = {{ grid = [{side}, {side}], spacing = 0.1, ripple = 0.01 }}
        mass = {{ density = 0.2 }}
        pins = ["top_left", "top_right"]
        drag = 1e-4
        [body.springs]
        stretch = {{ stiffness = 50, damping = 0.02 }}
        shear = {{ stiffness = 20, damping = 0.01 }}
        "#
    )
}

/// A sheet of `side` x `side` particles that hangs by two corners.
pub(crate) fn sheet(side: u32) -> String {
    sheet_with(side, "")
}

/// `side` x `side` particles without springs: frames of 12 bytes each, and hardly any work.
pub(crate) fn dust(side: u32, root: &str) -> String {
    format!(
        r#"
        version = 1
        title = "dust"
        dt = 0.001
        {root}
        [[body]]
        name = "dust"
        mesh = {{ grid = [{side}, {side}], spacing = 0.1 }}
        mass = {{ density = 0.2 }}
        integrator = "symplectic_euler"
        "#
    )
}

/// A frame put together from its pieces.
#[derive(Clone, Debug)]
pub(crate) struct Whole {
    pub(crate) head: v1::Frame,
    pub(crate) piece_count: u32,
    /// Bytes by field.
    pub(crate) fields: BTreeMap<i32, Vec<u8>>,
    /// The grid's nodes, and how many pieces they came in.
    pub(crate) grid: Option<Nodes>,
}

/// Nodes of the snow's grid put together from their pieces.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Nodes {
    pub(crate) cell: f64,
    pub(crate) stride: u32,
    pub(crate) node_count: u64,
    pub(crate) index: Vec<[i32; 3]>,
    pub(crate) mass: Vec<f32>,
    pub(crate) velocity: Vec<[f32; 3]>,
    pub(crate) piece_count: u32,
}

impl Nodes {
    fn append(&mut self, piece: &v1::GridField) {
        let head = (piece.cell, piece.stride, piece.node_count);
        assert!(self.piece_count == 0 || head == (self.cell, self.stride, self.node_count));
        (self.cell, self.stride, self.node_count) = head;
        let index = numbers(&piece.index_i32, i32::from_le_bytes);
        let velocity = numbers(&piece.velocity_f32, f32::from_le_bytes);
        self.index.extend(index.as_chunks().0);
        self.velocity.extend(velocity.as_chunks().0);
        self.mass.extend(numbers(&piece.mass_f32, f32::from_le_bytes));
        assert_eq!((self.index.len(), self.velocity.len()), (self.mass.len(), self.mass.len()));
        self.piece_count += 1;
    }
}

/// Packed numbers of `N` bytes each.
fn numbers<T, const N: usize>(bytes: &[u8], read: impl Fn([u8; N]) -> T) -> Vec<T> {
    assert_eq!(bytes.len() % N, 0);
    bytes.as_chunks().0.iter().map(|chunk| read(*chunk)).collect()
}

impl Whole {
    /// A field's numbers.
    pub(crate) fn numbers<T, const N: usize>(&self, field: v1::Field, read: impl Fn([u8; N]) -> T) -> Vec<T> {
        numbers(&self.fields[&i32::from(field)], read)
    }
}

/// What a stream of frames gives.
#[derive(Debug)]
pub(crate) enum Next {
    Frame(Box<Whole>),
    End(v1::SessionEnd),
    Broken(Status),
    Closed,
}

/// A watcher that puts frames together and checks that pieces are in order.
pub(crate) struct Watch {
    pub(crate) topology: v1::Topology,
    pub(crate) topology_piece_count: u32,
    stream: Streaming<v1::WatchFramesResponse>,
}

impl Watch {
    async fn new(mut stream: Streaming<v1::WatchFramesResponse>) -> Self {
        let mut topology = first_piece(&mut stream).await;
        let count = topology.chunk.map_or(1, |chunk| chunk.count);
        for index in 1..count {
            let piece = first_piece(&mut stream).await;
            assert_eq!(piece.chunk, Some(v1::Chunk { index, count }));
            piece.bodies.into_iter().for_each(|body| append(&mut topology.bodies, body));
        }
        Self { topology, topology_piece_count: count, stream }
    }

    async fn message(&mut self) -> Option<Result<Event, Status>> {
        let next = tokio::time::timeout(PATIENCE, self.stream.next()).await.expect("a message in time");
        next.map(|message| message.map(|message| message.event.expect("a message holds an event")))
    }

    /// The next whole frame, or the end.
    pub(crate) async fn next(&mut self) -> Next {
        let mut whole: Option<Whole> = None;
        loop {
            match self.message().await {
                None => return Next::Closed,
                Some(Err(status)) => return Next::Broken(status),
                Some(Ok(Event::End(end))) => return Next::End(end),
                Some(Ok(Event::Topology(_))) => panic!("the topology comes once"),
                Some(Ok(Event::Frame(piece))) => {
                    let chunk = piece.chunk.expect("a piece says where it stands");
                    let whole = whole.get_or_insert_with(|| Whole {
                        head: piece.clone(),
                        piece_count: 0,
                        fields: BTreeMap::new(),
                        grid: None,
                    });
                    assert_eq!((piece.frame, chunk.index), (whole.head.frame, whole.piece_count));
                    assert_eq!(piece.diagnostics.is_some(), chunk.index == 0);
                    whole.piece_count += 1;
                    if let Some(grid) = &piece.grid {
                        whole.grid.get_or_insert_default().append(grid);
                    }
                    for field in piece.fields {
                        whole.fields.entry(field.field).or_default().extend_from_slice(&field.data);
                    }
                    if whole.piece_count == chunk.count {
                        return Next::Frame(Box::new(whole.clone()));
                    }
                }
            }
        }
    }

    /// The next frame, which must come.
    pub(crate) async fn frame(&mut self) -> Whole {
        match self.next().await {
            Next::Frame(frame) => *frame,
            other => panic!("a frame was due: {other:?}"),
        }
    }

    /// The frames until the end of the session, and the end.
    pub(crate) async fn until_end(&mut self) -> (Vec<Whole>, v1::SessionEnd) {
        let mut frames = Vec::new();
        loop {
            match self.next().await {
                Next::Frame(frame) => frames.push(*frame),
                Next::End(end) => {
                    assert!(matches!(self.next().await, Next::Closed), "nothing follows the end");
                    return (frames, end);
                }
                other => panic!("the end was due: {other:?}"),
            }
        }
    }

    /// The frames until the stream breaks, and its status.
    pub(crate) async fn until_break(&mut self) -> (Vec<Whole>, Status) {
        let mut frames = Vec::new();
        loop {
            match self.next().await {
                Next::Frame(frame) => frames.push(*frame),
                Next::Broken(status) => return (frames, status),
                other => panic!("a status was due: {other:?}"),
            }
        }
    }
}

async fn first_piece(stream: &mut Streaming<v1::WatchFramesResponse>) -> v1::Topology {
    match stream.next().await.expect("a message").expect("no error").event {
        Some(Event::Topology(topology)) => topology,
        other => panic!("the topology comes first: {other:?}"),
    }
}

/// Adds a body, or the next bytes of the last one.
fn append(bodies: &mut Vec<v1::BodyTopology>, part: v1::BodyTopology) {
    match bodies.last_mut().filter(|body| body.first_particle == part.first_particle) {
        None => bodies.push(part),
        Some(body) => {
            body.triangles_u32 = [&body.triangles_u32[..], &part.triangles_u32].concat().into();
            body.springs_u32 = [&body.springs_u32[..], &part.springs_u32].concat().into();
            body.pins_u32 = [&body.pins_u32[..], &part.pins_u32].concat().into();
            body.uv_f32 = [&body.uv_f32[..], &part.uv_f32].concat().into();
        }
    }
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

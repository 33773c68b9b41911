//! Calls with one answer: server information, meshes, sessions, control, parameters.
//!
//! Enters: the caller's request. Leaves: the answer, or an error that says who failed. What a server answers at
//! once has a deadline; what waits for a session's step has none.

use std::{future::Future, sync::Arc, time::Duration};

use nappe_proto::{
    token::Token,
    v1::{self, simulation_service_client::SimulationServiceClient},
};
use tonic::{
    Request, Response, Status,
    service::interceptor::InterceptedService,
    transport::{Channel, Endpoint},
};

use crate::{
    error::{ClientError, innermost},
    mesh_file::MeshFile,
    options::{CreateSession, Wait},
    target::{Bearer, Target},
    upload::{MeshUpload, UploadedMesh},
};

/// Largest message accepted from the server (bytes). Frames and topologies come in pieces of about 1 MiB.
const MAX_MESSAGE_BYTES: usize = 8 << 20;
/// Longest time in which a connection must be made.
const CONNECT_LIMIT: Duration = Duration::from_secs(5);
/// Longest time that a call may take that the server answers at once.
pub(crate) const CALL_LIMIT: Duration = Duration::from_secs(10);
/// Longest time that the building of a large scene may take.
const CREATE_LIMIT: Duration = Duration::from_mins(2);
/// Longest time that an upload may take: the server gives up before.
const UPLOAD_LIMIT: Duration = Duration::from_mins(11);
/// Calls that a session answers have no limit: its step takes what it takes, and a server that is gone is noticed
/// by the connection's own pings, within half a minute.
pub(crate) const NO_LIMIT: Duration = Duration::MAX;
/// Sessions per page of a list.
pub(crate) const PAGE_SIZE: i32 = 200;

/// The methods of the service, on a connection that shows a token.
type Calls = SimulationServiceClient<InterceptedService<Channel, Bearer>>;

/// A connection to a server. Cloning it is cheap and shares the connection.
#[derive(Debug, Clone)]
pub struct Client {
    /// For calls, and for streams of the newest.
    pub(crate) calls: Calls,
    /// For streams of everything: a connection of its own, made when it is needed.
    pub(crate) bulk: Calls,
    pub(crate) endpoint: Arc<str>,
}

/// A session just created.
#[derive(Debug, Clone, PartialEq)]
pub struct CreatedSession {
    /// The session, paused before its first step.
    pub session: v1::Session,
    /// What is odd about the scene and does not stop a simulation.
    pub warnings: Vec<String>,
}

/// A session that was paused.
#[derive(Debug, Clone, PartialEq)]
pub struct Paused {
    /// The session when the call was answered.
    pub session: v1::Session,
    /// Steps that it will have taken when it stands.
    pub effective_step: u64,
}

impl Client {
    /// Connects to a server, for example `http://127.0.0.1:6277`; without a scheme, `http://` is meant. A Unix
    /// socket is `unix:PATH`. The token of a server of the same user on this machine is found by itself.
    ///
    /// # Errors
    /// If the address is not one, or nothing answers there within 5 s.
    pub async fn connect(address: &str) -> Result<Self, ClientError> {
        Self::to(Target::new(address, None)?).await
    }

    /// Connects to a server that asks for a token.
    ///
    /// # Errors
    /// If the address is not one, or nothing answers there within 5 s. A wrong token is refused by the first call.
    pub async fn connect_with(address: &str, token: &Token) -> Result<Self, ClientError> {
        Self::to(Target::new(address, Some(token))?).await
    }

    async fn to(target: Target) -> Result<Self, ClientError> {
        let Target { endpoint, address, bearer } = target;
        let bulk = tuned(endpoint.clone(), BULK).connect_lazy();
        let channel = tuned(endpoint, FRESH).connect().await.map_err(|error| ClientError::Connect {
            endpoint: address.to_string(),
            cause: innermost(&error).to_string(),
        })?;
        let [calls, bulk] = [channel, bulk].map(|channel| {
            SimulationServiceClient::with_interceptor(channel, bearer.clone())
                .max_decoding_message_size(MAX_MESSAGE_BYTES)
        });
        Ok(Self { calls, bulk, endpoint: address })
    }

    /// The server's address.
    pub fn endpoint(&self) -> &str {
        &self.endpoint
    }

    /// Version, limits and shipped scenes of the server.
    ///
    /// # Errors
    /// If the call fails.
    pub async fn server_info(&self) -> Result<v1::GetServerInfoResponse, ClientError> {
        let request = Request::new(v1::GetServerInfoRequest {});
        self.call("GetServerInfo", CALL_LIMIT, request, async |mut calls, r| calls.get_server_info(r).await)
            .await
    }

    /// Uploads a mesh, in pieces of at most 1 MiB.
    ///
    /// # Errors
    /// If the counts of the arrays disagree, or the server refuses the mesh.
    pub async fn upload_mesh(&self, mesh: &MeshUpload) -> Result<UploadedMesh, ClientError> {
        let messages =
            mesh.messages().map_err(|source| ClientError::Mesh { name: mesh.name.clone(), source })?;
        self.upload(messages).await
    }

    /// Uploads a mesh file as it is, in pieces of at most 1 MiB; the server reads it.
    ///
    /// # Errors
    /// If the server cannot read the file, or refuses the mesh.
    pub async fn upload_file(&self, file: &MeshFile) -> Result<UploadedMesh, ClientError> {
        self.upload(file.messages()).await
    }

    async fn upload(&self, messages: Vec<v1::UploadMeshRequest>) -> Result<UploadedMesh, ClientError> {
        let request = Request::new(tokio_stream::iter(messages));
        let answer = self
            .call("UploadMesh", UPLOAD_LIMIT, request, async |mut calls, r| calls.upload_mesh(r).await)
            .await?;
        Ok(UploadedMesh { mesh_id: answer.mesh_id, warnings: answer.warnings })
    }

    /// Makes a session, paused before its first step.
    ///
    /// # Errors
    /// If the server refuses the scene, its id or its size.
    pub async fn create_session(&self, wanted: CreateSession) -> Result<CreatedSession, ClientError> {
        let method = "CreateSession";
        let request = Request::new(wanted.into_request());
        let answer = self
            .call(method, CREATE_LIMIT, request, async |mut calls, r| calls.create_session(r).await)
            .await?;
        let session = answer.session.ok_or(ClientError::Incomplete { method, what: "session" })?;
        Ok(CreatedSession { session, warnings: answer.warnings })
    }

    /// Makes a session that stands where another one stands, to the bit, paused; with an empty `new_id`, the server
    /// chooses its id. Without a limit of steps it has that of the other one, or none if that one is at its end.
    ///
    /// # Errors
    /// If there is no such session, it failed, or the server has as many as it allows.
    pub async fn fork(
        &self,
        session_id: &str,
        new_id: &str,
        step_limit: Option<u64>,
    ) -> Result<v1::Session, ClientError> {
        let method = "ForkSession";
        let request = Request::new(v1::ForkSessionRequest {
            new_session_id: new_id.to_owned(),
            step_limit,
            ..v1::ForkSessionRequest::of(session_id)
        });
        let answer =
            self.call(method, NO_LIMIT, request, async |mut calls, r| calls.fork_session(r).await).await?;
        answer.session.ok_or(ClientError::Incomplete { method, what: "session" })
    }

    /// One session.
    ///
    /// # Errors
    /// If there is no such session.
    pub async fn get_session(&self, session_id: &str) -> Result<v1::Session, ClientError> {
        let method = "GetSession";
        let request = Request::new(v1::GetSessionRequest::of(session_id));
        let answer =
            self.call(method, CALL_LIMIT, request, async |mut calls, r| calls.get_session(r).await).await?;
        answer.session.ok_or(ClientError::Incomplete { method, what: "session" })
    }

    /// All sessions, in the order of their ids.
    ///
    /// # Errors
    /// If a call fails.
    pub async fn list_sessions(&self) -> Result<Vec<v1::Session>, ClientError> {
        let mut sessions = Vec::new();
        let mut page_token = String::new();
        loop {
            let request = Request::new(v1::ListSessionsRequest { page_size: PAGE_SIZE, page_token });
            let page = self
                .call("ListSessions", CALL_LIMIT, request, async |mut calls, r| calls.list_sessions(r).await)
                .await?;
            // A page that holds nothing and promises more would never end.
            let is_last = page.next_page_token.is_empty() || page.sessions.is_empty();
            sessions.extend(page.sessions);
            page_token = page.next_page_token;
            if is_last {
                return Ok(sessions);
            }
        }
    }

    /// Ends a session and forgets it.
    ///
    /// # Errors
    /// If there is no such session.
    pub async fn delete_session(&self, session_id: &str) -> Result<(), ClientError> {
        let request = Request::new(v1::DeleteSessionRequest::of(session_id));
        self.call("DeleteSession", NO_LIMIT, request, async |mut calls, r| calls.delete_session(r).await)
            .await?;
        Ok(())
    }

    /// Steps on until paused, stopped or at the end. `real_time_factor`: simulated seconds per second of wall
    /// clock; 0: as fast as possible.
    ///
    /// # Errors
    /// If there is no such session, or it has ended.
    pub async fn play(&self, session_id: &str, real_time_factor: f64) -> Result<v1::Session, ClientError> {
        let method = "PlaySession";
        let session_id = session_id.to_owned();
        let request = Request::new(v1::PlaySessionRequest {
            real_time_factor,
            ..v1::PlaySessionRequest::of(session_id)
        });
        let answer =
            self.call(method, NO_LIMIT, request, async |mut calls, r| calls.play_session(r).await).await?;
        answer.session.ok_or(ClientError::Incomplete { method, what: "session" })
    }

    /// Stops stepping, after the step in progress. With [`Wait::Yes`] the answer comes once the session stands.
    ///
    /// # Errors
    /// If there is no such session.
    pub async fn pause(&self, session_id: &str, wait: Wait) -> Result<Paused, ClientError> {
        let method = "PauseSession";
        let message =
            v1::PauseSessionRequest { wait: wait == Wait::Yes, ..v1::PauseSessionRequest::of(session_id) };
        let request = Request::new(message);
        let answer =
            self.call(method, NO_LIMIT, request, async |mut calls, r| calls.pause_session(r).await).await?;
        let session = answer.session.ok_or(ClientError::Incomplete { method, what: "session" })?;
        Ok(Paused { session, effective_step: answer.effective_step })
    }

    /// Takes `count` steps, then pauses.
    ///
    /// # Errors
    /// If there is no such session, it has ended, or a step fails.
    pub async fn step(&self, session_id: &str, count: u64, wait: Wait) -> Result<v1::Session, ClientError> {
        let message = v1::StepSessionRequest { step_count: count, ..v1::StepSessionRequest::of(session_id) };
        self.steps(message, wait).await
    }

    /// Takes steps until the session has taken `to_step` since its initial state, then pauses. A session that has
    /// taken as many or more takes none, so that the call can be repeated after it was cut off.
    ///
    /// # Errors
    /// If there is no such session, it ends before, or a step fails.
    pub async fn step_to(
        &self,
        session_id: &str,
        to_step: u64,
        wait: Wait,
    ) -> Result<v1::Session, ClientError> {
        let to_step = Some(to_step);
        self.steps(v1::StepSessionRequest { to_step, ..v1::StepSessionRequest::of(session_id) }, wait).await
    }

    async fn steps(
        &self,
        mut message: v1::StepSessionRequest,
        wait: Wait,
    ) -> Result<v1::Session, ClientError> {
        message.wait = wait == Wait::Yes;
        let answer = Box::pin(self.stepped(message)).await?;
        answer.session.ok_or(ClientError::Incomplete { method: "StepSession", what: "session" })
    }

    pub(crate) async fn stepped(
        &self,
        message: v1::StepSessionRequest,
    ) -> Result<v1::StepSessionResponse, ClientError> {
        let request = Request::new(message);
        self.call("StepSession", NO_LIMIT, request, async |mut calls, r| calls.step_session(r).await).await
    }

    /// Ends the simulation; the session stays readable until it is deleted.
    ///
    /// # Errors
    /// If there is no such session.
    pub async fn stop(&self, session_id: &str) -> Result<v1::Session, ClientError> {
        let method = "StopSession";
        let request = Request::new(v1::StopSessionRequest::of(session_id));
        let answer =
            self.call(method, NO_LIMIT, request, async |mut calls, r| calls.stop_session(r).await).await?;
        answer.session.ok_or(ClientError::Incomplete { method, what: "session" })
    }

    /// Changes parameters between two steps, all of them or none; returns the step before which they change, and the
    /// order of the change among all. With `wait` set, the answer comes then.
    ///
    /// # Errors
    /// If there is no such session, it has ended, or a value is out of range.
    pub async fn update(
        &self,
        changes: v1::UpdateParametersRequest,
    ) -> Result<v1::UpdateParametersResponse, ClientError> {
        let request = Request::new(changes);
        self.call("UpdateParameters", NO_LIMIT, request, async |mut calls, r| {
            calls.update_parameters(r).await
        })
        .await
    }

    /// Makes one call within `limit`; the server is told the limit too, so that it can give up on its side.
    pub(crate) async fn call<Message, Answer, Call>(
        &self,
        method: &'static str,
        limit: Duration,
        mut request: Request<Message>,
        call: impl FnOnce(Calls, Request<Message>) -> Call,
    ) -> Result<Answer, ClientError>
    where
        Call: Future<Output = Result<Response<Answer>, Status>>,
    {
        // Longer than here, so that this side names the call and the limit.
        if let Some(on_server) = limit.checked_add(Duration::from_secs(1)) {
            request.set_timeout(on_server);
        }
        self.within(method, limit, call(self.calls.clone(), request)).await
    }

    /// Waits for an answer, `limit` at most.
    pub(crate) async fn within<Answer>(
        &self,
        method: &'static str,
        limit: Duration,
        answer: impl Future<Output = Result<Response<Answer>, Status>>,
    ) -> Result<Answer, ClientError> {
        let late = || ClientError::Deadline { endpoint: self.endpoint.to_string(), method, limit };
        let answer = tokio::time::timeout(limit, answer).await.map_err(|_elapsed| late())?;
        answer.map(Response::into_inner).map_err(|status| ClientError::from_status(&status, &self.endpoint))
    }
}

/// How much may be on its way to this client.
#[derive(Debug, Clone, Copy)]
struct Windows {
    /// Bytes per stream.
    stream: u32,
    /// Bytes per connection.
    connection: u32,
    /// Bytes per frame of HTTP/2.
    frame: u32,
}

/// What is on its way ages: on a line of 2 MB/s, a frame that is the newest when it is sent is an eighth of a second
/// old when the bytes before it have arrived.
const FRESH: Windows = Windows { stream: 256 << 10, connection: 1 << 20, frame: 256 << 10 };
/// Who wants everything wants it fast, over long lines too.
const BULK: Windows = Windows { stream: 4 << 20, connection: 16 << 20, frame: 1 << 20 };

/// A connection with these windows, and with pings that notice a server that is gone.
fn tuned(endpoint: Endpoint, windows: Windows) -> Endpoint {
    endpoint
        .connect_timeout(CONNECT_LIMIT)
        .tcp_nodelay(true)
        .initial_stream_window_size(windows.stream)
        .initial_connection_window_size(windows.connection)
        .max_frame_size(windows.frame)
        .http2_keep_alive_interval(Duration::from_secs(10))
        .keep_alive_timeout(Duration::from_secs(20))
        .keep_alive_while_idle(true)
}

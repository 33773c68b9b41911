//! The methods of the service: a request becomes a command, and its answer a response.
//!
//! Enters: messages, checked here. Leaves: messages, or a status with a reason.

use std::{sync::Arc, time::Instant};

use nappe_proto::v1::{self, simulation_service_server::SimulationService};
use nappe_sim::world::Vectors;
use tokio_stream::{Empty, StreamExt as _};
use tonic::{Request, Response, Status, Streaming};

use super::{
    changes::{self, changes},
    create, links, lists, pending, save,
    server_info::server_info,
    shared::{Shared, no_mesh},
    upload, validate,
};
use crate::{
    caller::Caller,
    error::ServiceError,
    passes::{Visitor, too_narrow},
    refusals::Call,
    session::{Accepted, Session},
    stream::{self, Cut, Delivery, DiagnosticsOnly, FieldSet, Frames, Seat, WatchStream, watch},
};

/// The service over what calls share.
#[derive(Clone, Debug)]
pub(crate) struct Methods {
    shared: Arc<Shared>,
}

impl Methods {
    pub(crate) fn new(shared: Arc<Shared>) -> Self {
        Self { shared }
    }

    /// Points and velocities of an uploaded mesh, by its id. For the bearer of a pass, who uploads none, there is none.
    fn placed(&self, visitor: &Visitor) -> impl Fn(&str) -> Result<[Vectors; 2], ServiceError> {
        let (shared, is_bound) = (&self.shared, visitor.is_bound());
        move |id| if is_bound { Err(no_mesh(id)) } else { shared.vectors(id) }
    }

    /// Up to `count` sessions that there are for a visitor, with ids after `after`, and whether more follow.
    fn page(&self, visitor: &Visitor, after: &str, count: usize) -> (Vec<Arc<Session>>, bool) {
        let registry = &self.shared.registry;
        if !visitor.is_bound() {
            return registry.page(after, count);
        }
        let mut seen = registry.all();
        seen.retain(|session| session.id() > after && visitor.sees(session.uid()));
        let more = seen.len() > count;
        seen.truncate(count);
        (seen, more)
    }

    /// Starts a watcher, after the session was asked for the fields that it wants.
    async fn start_watcher(
        &self,
        request: Request<v1::WatchFramesRequest>,
    ) -> Result<WatchStream<v1::WatchFramesResponse>, Status> {
        let (cut, call) = (cut(&request), Call::of(request.extensions()));
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let wanted = validate::wanted(&request, session.snow_cell(), &self.shared.config.limits)?;
        let delivery = validate::frame_delivery(&request)?;
        if request.pace_to_watcher && !visitor.owns(session.uid()) {
            return Err(
                too_narrow("your link lets you watch this session, which does not wait for you").into()
            );
        }
        let slot = session.watcher_slot()?;

        let wish = self.shared.answered(session.provide(wanted.needed()).await)?;
        let feed = session.feed();
        if let Delivery::Every { from_frame: Some(number), .. } = delivery {
            feed.check_start(number, wanted.needed())?;
        }

        let pieces = session.topology().iter().cloned().map(v1::watch_frames_response::Event::Topology);
        let opening = pieces.map(|piece| v1::WatchFramesResponse { event: Some(piece) }).collect();
        let draining = self.shared.draining.clone();
        let seat = Seat::new(slot, Some(wish), call);
        Ok(watch(Arc::clone(feed), Frames(wanted), delivery, opening, seat, cut, draining))
    }
}

type Answer<T> = Result<Response<T>, Status>;

/// The message of a call, which is about the session of an id, and who calls: the log names the session if the call is refused.
fn about<M>(request: Request<M>, id: impl FnOnce(&M) -> &str) -> (M, Visitor) {
    Call::of(request.extensions()).note_session(id(request.get_ref()));
    let visitor = Visitor::of(request.extensions());
    (request.into_inner(), visitor)
}

/// The connection of a call.
fn cut<T>(request: &Request<T>) -> Cut {
    request.extensions().get().cloned().unwrap_or_default()
}

#[tonic::async_trait]
impl SimulationService for Methods {
    async fn get_server_info(
        &self,
        _: Request<v1::GetServerInfoRequest>,
    ) -> Answer<v1::GetServerInfoResponse> {
        Ok(Response::new(server_info(&self.shared.config.limits)))
    }

    async fn upload_mesh(
        &self,
        request: Request<Streaming<v1::UploadMeshRequest>>,
    ) -> Answer<v1::UploadMeshResponse> {
        let _place = self.shared.upload_place()?;
        let pieces = request.into_inner().map(|piece| piece.map_err(upload::with_reason));
        let (times, claim) = (self.shared.config.upload_times(), self.shared.requests.claim());
        let meshes = Arc::clone(&self.shared.meshes);
        let receive = upload::receive(pieces, &self.shared.config.limits, times, claim, meshes);
        let stored = tokio::select! {
            stored = receive => stored?,
            () = self.shared.draining.cancelled() => return Err(ServiceError::draining().into()),
        };
        Ok(Response::new(v1::UploadMeshResponse { mesh_id: stored.mesh_id, warnings: stored.warnings }))
    }

    async fn begin_upload(
        &self,
        request: Request<v1::BeginUploadRequest>,
    ) -> Answer<v1::BeginUploadResponse> {
        use v1::begin_upload_request::Header;
        let header = match request.into_inner().header {
            Some(Header::Mesh(mesh)) => upload::Header::Mesh(mesh),
            Some(Header::File(file)) => upload::Header::File(file),
            None => return Err(ServiceError::field("header", "is missing: mesh or file is needed").into()),
        };
        let shared = &self.shared;
        let memory = (shared.requests.claim(), shared.upload_place()?);
        let end = (shared.config.upload_times(), shared.draining.clone());
        let begun = shared.unary_uploads.begin(&header, &shared.config.limits, memory, end);
        let (upload_id, byte_count) = begun?;
        Ok(Response::new(v1::BeginUploadResponse { upload_id, byte_count }))
    }

    async fn append_upload(
        &self,
        request: Request<v1::AppendUploadRequest>,
    ) -> Answer<v1::AppendUploadResponse> {
        let v1::AppendUploadRequest { upload_id, offset, data } = request.into_inner();
        let received = self.shared.unary_uploads.append(&upload_id, offset, data).await?;
        Ok(Response::new(v1::AppendUploadResponse { received }))
    }

    async fn finish_upload(
        &self,
        request: Request<v1::FinishUploadRequest>,
    ) -> Answer<v1::FinishUploadResponse> {
        let (id, shared) = (request.into_inner().upload_id, &self.shared);
        let stored = shared.unary_uploads.finish(&id, &shared.config.limits, &shared.meshes).await?;
        Ok(Response::new(v1::FinishUploadResponse { mesh_id: stored.mesh_id, warnings: stored.warnings }))
    }

    async fn create_session(
        &self,
        request: Request<v1::CreateSessionRequest>,
    ) -> Answer<v1::CreateSessionResponse> {
        let caller = Caller::of(request.extensions());
        let (request, _) = about(request, |asked| &asked.session_id);
        let made = create::create(&self.shared, request, caller).await;
        Ok(Response::new(self.shared.answered(made)?))
    }

    async fn fork_session(
        &self,
        request: Request<v1::ForkSessionRequest>,
    ) -> Answer<v1::ForkSessionResponse> {
        let caller = Caller::of(request.extensions());
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let forked = create::fork(&self.shared, request, &visitor, caller).await;
        Ok(Response::new(v1::ForkSessionResponse { session: Some(self.shared.answered(forked)?) }))
    }

    type SaveSessionStream = save::Pieces;

    async fn save_session(
        &self,
        request: Request<v1::SaveSessionRequest>,
    ) -> Answer<Self::SaveSessionStream> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let shared = &self.shared;
        let session = shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let place = shared.upload_place()?;
        let saved = session.save(shared.config.limits.clone(), shared.memory.claim(), place).await;
        let (file, place) = shared.answered(saved)?;
        let (patience, draining) = (shared.config.watcher_stall(), shared.draining.clone());
        Ok(Response::new(save::pieces(file, place, patience, draining)))
    }

    async fn get_session(&self, request: Request<v1::GetSessionRequest>) -> Answer<v1::GetSessionResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        Ok(Response::new(v1::GetSessionResponse { session: Some(session.describe()) }))
    }

    async fn list_sessions(
        &self,
        request: Request<v1::ListSessionsRequest>,
    ) -> Answer<v1::ListSessionsResponse> {
        let visitor = Visitor::of(request.extensions());
        let request = request.into_inner();
        let count = validate::page_size(request.page_size)?;
        validate::page_token(&request.page_token)?;
        let (page, more) = self.page(&visitor, &request.page_token, count);
        let last = page.last().filter(|_| more);
        Ok(Response::new(v1::ListSessionsResponse {
            next_page_token: last.map_or_else(String::new, |session| session.id().to_owned()),
            sessions: page.iter().map(|session| lists::without_lists(session.describe())).collect(),
        }))
    }

    async fn delete_session(
        &self,
        request: Request<v1::DeleteSessionRequest>,
    ) -> Answer<v1::DeleteSessionResponse> {
        let caller = Caller::of(request.extensions());
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let session = self.shared.registry.remove(&request.session_id, session.uid())?;
        self.shared.end_passes();
        tracing::info!(session = session.id(), %caller, "deleted");
        session.end();
        session.ended().await;
        Ok(Response::new(v1::DeleteSessionResponse {}))
    }

    async fn play_session(
        &self,
        request: Request<v1::PlaySessionRequest>,
    ) -> Answer<v1::PlaySessionResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let real_time_factor = validate::real_time_factor(request.real_time_factor)?;
        let session = self.shared.answered(session.play(real_time_factor))?;
        Ok(Response::new(v1::PlaySessionResponse { session: Some(session) }))
    }

    async fn pause_session(
        &self,
        request: Request<v1::PauseSessionRequest>,
    ) -> Answer<v1::PauseSessionResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let paused = session.pause(request.wait.into()).await;
        let (session, effective_step) = self.shared.answered(paused)?;
        Ok(Response::new(v1::PauseSessionResponse { session: Some(session), effective_step }))
    }

    async fn step_session(
        &self,
        request: Request<v1::StepSessionRequest>,
    ) -> Answer<v1::StepSessionResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let steps = validate::steps(&request, session.step_count(), &self.shared.config.limits)?;
        let changes = match &request.changes {
            Some(asked) => changes(asked, "changes.", &self.shared.config.limits, &self.placed(&visitor))?,
            None => Vec::new(),
        };
        let frame = validate::answered_fields(&request, session.particle_count())?;
        let stepped = session.step(steps, changes, frame, request.wait.into()).await;
        let (session, frame) = self.shared.answered(stepped)?;
        Ok(Response::new(v1::StepSessionResponse { session: Some(session), frame }))
    }

    async fn stop_session(
        &self,
        request: Request<v1::StopSessionRequest>,
    ) -> Answer<v1::StopSessionResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let stopped = session.stop().await;
        Ok(Response::new(v1::StopSessionResponse { session: Some(self.shared.answered(stopped)?) }))
    }

    async fn update_parameters(
        &self,
        request: Request<v1::UpdateParametersRequest>,
    ) -> Answer<v1::UpdateParametersResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let (at_step, when) = (request.at_step, request.wait.into());
        let changes =
            changes(&changes::of_update(request), "", &self.shared.config.limits, &self.placed(&visitor))?;
        let updated = session.update(at_step, changes, when).await;
        Ok(Response::new(self.shared.answered(updated)?.into()))
    }

    async fn reset_session(
        &self,
        request: Request<v1::ResetSessionRequest>,
    ) -> Answer<v1::ResetSessionResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let reset = session.reset().await;
        let Accepted { step, order } = self.shared.answered(reset)?;
        Ok(Response::new(v1::ResetSessionResponse { effective_step: step, order }))
    }

    async fn list_pending_changes(
        &self,
        request: Request<v1::ListPendingChangesRequest>,
    ) -> Answer<v1::ListPendingChangesResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let count = validate::page_size(request.page_size)?;
        let after = pending::page_token(&request.page_token)?;
        let (page, last) = session.pending_changes(after, count);
        Ok(Response::new(pending::page(&page, last)))
    }

    async fn drop_pending_changes(
        &self,
        request: Request<v1::DropPendingChangesRequest>,
    ) -> Answer<v1::DropPendingChangesResponse> {
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;
        let orders = (!request.orders.is_empty()).then_some(request.orders.as_slice());
        Ok(Response::new(v1::DropPendingChangesResponse { dropped_count: session.drop_changes(orders) }))
    }

    /// Frames travel in the body that `stream::with_frames` gives the answer.
    type WatchFramesStream = Empty<Result<v1::WatchFramesResponse, Status>>;

    async fn watch_frames(
        &self,
        request: Request<v1::WatchFramesRequest>,
    ) -> Answer<Self::WatchFramesStream> {
        Ok(stream::answer(self.start_watcher(request).await?, tokio_stream::empty()))
    }

    type WatchDiagnosticsStream = WatchStream<v1::WatchDiagnosticsResponse>;

    async fn watch_diagnostics(
        &self,
        request: Request<v1::WatchDiagnosticsRequest>,
    ) -> Answer<Self::WatchDiagnosticsStream> {
        let (cut, call) = (cut(&request), Call::of(request.extensions()));
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let session = self.shared.session(&visitor, &request.session_id, &request.session_uid)?;

        let v1::WatchDiagnosticsRequest { delivery, from_frame, max_rate_hz, .. } = request;
        let delivery = validate::delivery(delivery, from_frame, max_rate_hz)?;
        let slot = session.watcher_slot()?;
        let feed = Arc::clone(session.feed());
        if let Delivery::Every { from_frame: Some(number), .. } = delivery {
            feed.check_start(number, FieldSet::NONE)?;
        }
        Ok(Response::new(watch(
            feed,
            DiagnosticsOnly,
            delivery,
            Vec::new(),
            Seat::new(slot, None, call),
            cut,
            self.shared.draining.clone(),
        )))
    }

    async fn make_link(&self, request: Request<v1::MakeLinkRequest>) -> Answer<v1::MakeLinkResponse> {
        let caller = Caller::of(request.extensions());
        let (request, visitor) = about(request, |asked| &asked.session_id);
        let made = links::make(&self.shared, &visitor, &request, Instant::now())?;
        let session = (!request.session_id.is_empty()).then_some(request.session_id);
        tracing::info!(%caller, session, "link made");
        Ok(Response::new(made))
    }

    async fn open_link(&self, request: Request<v1::OpenLinkRequest>) -> Answer<v1::OpenLinkResponse> {
        let caller = Caller::of(request.extensions());
        let token = links::open(&self.shared, &request.into_inner().code, Instant::now())?;
        tracing::info!(%caller, "link opened");
        Ok(Response::new(v1::OpenLinkResponse { token }))
    }
}

//! CreateSession: from the request to a running thread, once per request id. ForkSession: the same from a session.

use std::sync::Arc;

use nappe_proto::v1::{self, create_session_request::Scene};
use nappe_sim::math::Precision;
use uuid::Uuid;

use super::{request_ids::CreatedSession, shared::Shared, validate};
use crate::{
    caller::Caller,
    config::{Limits, core_count},
    error::{Reason, ServiceError},
    passes::{Visitor, too_narrow},
    scenes::{self, Checkpoint},
    session::{
        self, RankCounts, Resources, RevivedOptions, SavedFrame, Session, SessionOptions, revive, start,
    },
};

/// Characters of a session's title that the log shows.
const TITLE_CHARS: usize = 80;

/// Makes the session of a request, or returns the one that the same request made before.
///
/// # Errors
/// If a field, the scene or the number of sessions is not allowed.
pub(super) async fn create(
    shared: &Shared,
    request: v1::CreateSessionRequest,
    caller: Caller,
) -> Result<v1::CreateSessionResponse, ServiceError> {
    if request.request_id.is_empty() {
        let (session, warnings) = make(shared, &request, caller).await?;
        return Ok(response(&session, warnings));
    }

    let id = Uuid::try_parse(&request.request_id).map_err(|error| {
        let problem = format!("is '{}', not a UUID: {error}", request.request_id);
        ServiceError::field("request_id", problem)
    })?;

    let mut entry = shared.request_ids.entry(id).await;
    if let Some(made) = entry.as_ref()
        && let Some(session) = made.session.upgrade().filter(|session| !session.is_ending())
    {
        if made.request != request {
            let message = format!("the request id {id} belongs to an earlier request with other fields");
            return Err(ServiceError::new(Reason::RequestIdReused, message)
                .with("request_id", id)
                .with("session_id", session.id())
                .at_field("request_id", "belongs to another request"));
        }
        return Ok(response(&session, made.warnings.clone()));
    }

    let (session, warnings) = make(shared, &request, caller).await?;
    *entry = Some(CreatedSession { request, session: Arc::downgrade(&session), warnings: warnings.clone() });
    Ok(response(&session, warnings))
}

fn response(session: &Session, warnings: Vec<String>) -> v1::CreateSessionResponse {
    v1::CreateSessionResponse { session: Some(session.describe()), warnings }
}

async fn make(
    shared: &Shared,
    request: &v1::CreateSessionRequest,
    caller: Caller,
) -> Result<(Arc<Session>, Vec<String>), ServiceError> {
    let limits = &shared.config.limits;
    if !request.session_id.is_empty() {
        validate::session_id(&request.session_id)?;
    }

    let source = source(shared, request)?;
    let precision = precision(request.precision)?;
    let ranks = rank_count(request.rank_count, limits)?;
    let thread_count = thread_count(request.thread_count, ranks, limits)?;

    let reservation = shared.registry.reserve(&request.session_id)?;
    let place = shared.registry.place()?;
    let (id, memory) = (reservation.id().to_owned(), shared.memory.claim());
    let &v1::CreateSessionRequest { step_limit, frame_interval_steps, .. } = request;
    let ranks = (ranks > 0).then_some(RankCounts { ranks, threads: thread_count });
    let (session, warnings) = match source {
        Source::Scene { scene_text, scene_name, begin } => {
            let options = SessionOptions {
                id,
                request: request.clone(),
                scene_text,
                scene_name,
                precision,
                thread_count,
                step_limit,
                frame_interval_steps,
                ranks,
                begin,
            };
            start(options, resources(shared), place, memory).await?
        }
        Source::File(file) => {
            let options = RevivedOptions {
                id,
                file,
                precision,
                thread_count,
                step_limit,
                frame_interval_steps,
                ranks,
                kept: None,
            };
            revive(options, resources(shared), place, memory).await?
        }
    };

    let session = Arc::new(session);
    tell_made(&session, None, caller);
    shared.keep(&session).await;
    reservation.fill(Arc::clone(&session));
    Ok((session, warnings))
}

/// What a session is made from.
enum Source {
    Scene { scene_text: String, scene_name: String, begin: Option<SavedFrame> },
    File(Checkpoint),
}

fn source(shared: &Shared, request: &v1::CreateSessionRequest) -> Result<Source, ServiceError> {
    let begin = request.begin.as_ref();
    if let Some(Scene::CheckpointId(id)) = &request.scene {
        let file = shared.checkpoint(id)?;
        return match begin {
            Some(_) => {
                Err(ServiceError::field("begin", "does not go with checkpoint_id, which says the state"))
            }
            None => Ok(Source::File(file)),
        };
    }
    let (scene_text, scene_name) = scene(request, &shared.config.limits)?;
    let begin = begin.map(|begin| saved_frame(shared, begin)).transpose()?;
    Ok(Source::Scene { scene_text, scene_name, begin })
}

/// The frame at which a session is to begin.
fn saved_frame(shared: &Shared, asked: &v1::Begin) -> Result<SavedFrame, ServiceError> {
    SavedFrame::of(asked, shared.vectors(&asked.upload_id)?)
}

/// Makes a session that stands where another one stands.
///
/// # Errors
/// If a field or the number of sessions is not allowed, or that one cannot be copied.
pub(super) async fn fork(
    shared: &Shared,
    request: v1::ForkSessionRequest,
    visitor: &Visitor,
    caller: Caller,
) -> Result<v1::Session, ServiceError> {
    let original = shared.session(visitor, &request.session_id, &request.session_uid)?;
    if !request.new_session_id.is_empty() {
        if visitor.is_bound() {
            // Whether an id is taken would tell of sessions that do not exist for it.
            return Err(too_narrow("the server chooses the ids of your copies: leave new_session_id empty"));
        }
        validate::id_in("new_session_id", &request.new_session_id)?;
    }

    let own = visitor.copy_place(|uid| shared.registry.has(uid))?;
    let reservation = shared.registry.reserve(&request.new_session_id)?;
    let place = shared.registry.place()?;
    let id = reservation.id().to_owned();
    let memory = shared.memory.claim();
    let session = session::fork(&original, id, request.step_limit, resources(shared), place, memory).await?;

    let session = Arc::new(session);
    tell_made(&session, Some(original.id()), caller);
    shared.keep(&session).await;
    reservation.fill(Arc::clone(&session));
    own.fill(session.uid());
    Ok(session.describe())
}

/// Tells the log of a session that was made, from another one if it is a fork.
fn tell_made(session: &Session, original: Option<&str>, caller: Caller) {
    let v1::Session { title, particle_count, ranks, .. } = session.describe();
    let title: String = title.chars().take(TITLE_CHARS).collect();
    let ranks = ranks.map_or(0, |ranks| ranks.rank_count);
    tracing::info!(
        session = session.id(),
        original,
        %caller,
        particles = particle_count,
        bytes = session.claimed_bytes(),
        ranks,
        title,
        "{}",
        if original.is_some() { "forked" } else { "created" }
    );
}

/// What the sessions of a server are made with.
pub(super) fn resources(shared: &Shared) -> Resources {
    Resources {
        meshes: Arc::clone(&shared.meshes),
        limits: shared.config.limits.clone(),
        streams: Arc::clone(&shared.streams),
        ranks: shared.config.ranks.clone(),
        counters: Arc::clone(&shared.counters),
    }
}

/// The scene's text and its name in messages.
fn scene(request: &v1::CreateSessionRequest, limits: &Limits) -> Result<(String, String), ServiceError> {
    match &request.scene {
        None | Some(Scene::CheckpointId(_)) => {
            let problem = "is missing: scene_name, scene_text or checkpoint_id is needed";
            Err(ServiceError::field("scene", problem))
        }
        Some(Scene::SceneName(name)) => Ok((scenes::shipped_scene(name)?.to_owned(), name.clone())),
        Some(Scene::SceneText(text)) => {
            let (bytes, allowed) = (text.len() as u64, limits.max_scene_bytes);
            if bytes > allowed {
                let message = format!("the scene has {bytes} bytes; allowed: at most {allowed}");
                return Err(ServiceError::new(Reason::SceneTooLarge, message)
                    .with("bytes", bytes)
                    .with("allowed", allowed));
            }
            Ok((text.clone(), "scene".to_owned()))
        }
    }
}

fn precision(number: i32) -> Result<Option<Precision>, ServiceError> {
    match v1::Precision::try_from(number) {
        Ok(v1::Precision::Unspecified) => Ok(None),
        Ok(v1::Precision::F32) => Ok(Some(Precision::F32)),
        Ok(v1::Precision::F64) => Ok(Some(Precision::F64)),
        Err(_unknown) => Err(validate::unknown_value("precision", number)),
    }
}

fn rank_count(asked: u32, limits: &Limits) -> Result<u32, ServiceError> {
    let allowed = limits.rank_limit();
    if asked <= allowed {
        return Ok(asked);
    }
    let message = format!("{asked} ranks are asked for; allowed are at most {allowed}");
    Err(ServiceError::new(Reason::TooManyRanks, message).with("value", asked).with("allowed", allowed))
}

/// Threads of a session, or of each of its ranks.
fn thread_count(asked: u32, ranks: u32, limits: &Limits) -> Result<u32, ServiceError> {
    let allowed = limits.thread_limit();
    match asked {
        0 => Ok((core_count() / ranks.max(1)).clamp(1, allowed)),
        asked if asked <= allowed => Ok(asked),
        asked => {
            let problem = format!("is {asked}: allowed are at most {allowed}");
            Err(ServiceError::field("thread_count", problem).with("value", asked).with("allowed", allowed))
        }
    }
}

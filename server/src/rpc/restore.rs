//! The sessions that a server has of the one before it: each goes on from its newest good state, with what its logs say happened since.
//!
//! Enters: the folder of the server. Leaves: sessions, with their ids, their uids and the requests that made them. What cannot be taken
//! stays in the folder, and is named in the log.

use std::{error::Error, ffi::OsStr, sync::Arc};

use nappe_proto::v1;
use nappe_scene::printable;
use tokio::task::{JoinSet, spawn_blocking};
use uuid::Uuid;

use super::{create::resources, request_ids::CreatedSession, shared::Shared, validate};
use crate::{
    config::Limits,
    error::ServiceError,
    scenes::Checkpoint,
    session::{Keeping, RankCounts, RevivedOptions, Session, revive},
    state::{Opened, Record, SessionFolder, StateFolder, StatePlace, records, told_session},
};

/// Why a state is not taken.
type Problem = Box<dyn Error + Send + Sync>;

/// What a folder has of a session.
struct Found {
    file: Vec<u8>,
    /// As the session was described.
    told: v1::Session,
    /// What happened since.
    records: Vec<Record<'static>>,
    /// The highest number of a state or a log.
    last_number: u64,
}

/// Makes the sessions again that the folder of the server has, all at a time.
pub(crate) async fn restore(shared: &Arc<Shared>) {
    let Some(state) = shared.state.clone() else { return };
    let found = match spawn_blocking(move || list(&state)).await {
        Ok(found) => found,
        Err(error) => {
            tracing::error!("the folder of sessions was not read: {error}");
            return;
        }
    };
    let mut restored = JoinSet::new();
    for folder in found {
        let shared = Arc::clone(shared);
        restored.spawn(async move { restore_one(&shared, &folder).await });
    }
    while let Some(ended) = restored.join_next().await {
        if let Err(error) = ended {
            tracing::error!("a session is not restored: {error}");
        }
    }
}

/// The folders of sessions, once nothing is there that no session needs.
fn list(state: &Arc<StateFolder>) -> Vec<SessionFolder> {
    if let Err(error) = state.sweep() {
        tracing::warn!("the folder of sessions has more than is needed: {error}");
    }
    let uids = state.sessions().unwrap_or_else(|error| {
        tracing::error!("the folder of sessions cannot be read: {error}");
        Vec::new()
    });
    uids.iter().map(|uid| state.session(uid)).collect()
}

/// Makes a session again, of its newest state that is good.
async fn restore_one(shared: &Shared, folder: &SessionFolder) {
    let path = folder.path().display();
    let states = folder.states().unwrap_or_default();
    for (index, state) in states.iter().enumerate() {
        let StatePlace { number, step } = *state;
        match session_at(shared, folder, *state).await {
            Ok(session) => {
                tracing::info!(session = session.id(), step, "restored");
                set_aside(folder, &states[..index]);
                return;
            }
            Err(problem) => {
                tracing::error!("{path}: state {number}, of step {step}, is not taken: {problem}");
            }
        }
    }
    tracing::error!(
        "{path}: no state of this session can be taken: it stays there, for `nappe create --from {path}`"
    );
}

/// Keeps states from counting that could not be used.
fn set_aside(folder: &SessionFolder, states: &[StatePlace]) {
    for state in states {
        if let Err(error) = folder.set_aside(*state) {
            tracing::warn!("{}: a state is not set aside: {error}", folder.path().display());
        }
    }
}

/// The session as it stands at one of its states, with what it is to do since.
async fn session_at(
    shared: &Shared,
    folder: &SessionFolder,
    state: StatePlace,
) -> Result<Arc<Session>, Problem> {
    let memory = shared.memory.claim();
    memory.grow(folder.bytes(state)?)?;
    let reader = folder.clone();
    let Found { file, told, records, last_number } = spawn_blocking(move || read(&reader, state)).await??;
    check(folder, &told)?;
    let limits = &shared.config.limits;
    let kept =
        Keeping { folder: folder.clone(), interval: shared.config.checkpoint_time(), last_number, records };
    let options = RevivedOptions {
        id: told.session_id.clone(),
        file: Checkpoint::new(file, memory),
        precision: None,
        thread_count: told.thread_count.clamp(1, limits.thread_limit()),
        step_limit: Some(told.step_limit),
        frame_interval_steps: told.frame_interval_steps,
        ranks: ranks(&told, limits),
        kept: Some(kept),
    };
    let reservation = shared.registry.reserve(&options.id)?;
    let (session, warnings) = revived(shared, options).await?;
    let session = Arc::new(session);
    remember(shared, &session, warnings).await;
    reservation.fill(Arc::clone(&session));
    Ok(session)
}

/// What a folder has: a state with its setup, of which the hashes are checked, and the records since. A log is cut where it is damaged.
fn read(folder: &SessionFolder, state: StatePlace) -> Result<Found, Problem> {
    let file = folder.read_state(state)?;
    let opened = Opened::of(&file)?;
    if !opened.has_own_bits() {
        let (version, path) = (printable(opened.version()), folder.path().display());
        return Err(format!(
            "version {version} wrote it, which computes other bits than this one: `nappe create --from {path}` goes \
             on from it"
        )
        .into());
    }
    let told = told_session(&opened)?;
    let last_number = folder.last_number()?;
    let (mut all, mut is_damaged) = (Vec::new(), false);
    for place in folder.logs_since(state)? {
        let (path, number) = (folder.path().display(), place.number);
        if is_damaged {
            tracing::warn!("{path}: log {number} follows a damaged one, and is removed");
            folder.remove_log(place)?;
            continue;
        }
        let log = folder.read_log(place)?;
        let (mut found, length) = records(&log);
        if place.number == state.number && found.first() == Some(&Record::Gap) {
            // What is missing is in the state.
            found.remove(0);
        }
        all.append(&mut found);
        is_damaged = length < log.len();
        if is_damaged {
            let count = log.len();
            tracing::warn!(
                "{path}: log {number} is good up to byte {length} of {count}: what follows is dropped"
            );
            folder.cut_log(place, length as u64)?;
        }
    }
    Ok(Found { file, told, records: all, last_number })
}

/// A folder has the session of its name, with an id that sessions can have.
fn check(folder: &SessionFolder, told: &v1::Session) -> Result<(), Problem> {
    validate::session_id(&told.session_id)?;
    let uid = &told.uid;
    if folder.path().file_name() == Some(OsStr::new(uid)) {
        return Ok(());
    }
    Err(format!("it is of the session with the uid {uid}: the folder of a session has its uid as its name")
        .into())
}

/// The ranks that stepped a session, as many as this server allows.
fn ranks(told: &v1::Session, limits: &Limits) -> Option<RankCounts> {
    let ranks = told.ranks.as_ref().map(|ranks| ranks.rank_count)?;
    let threads = told.thread_count.clamp(1, limits.thread_limit());
    (1..=limits.rank_limit()).contains(&ranks).then_some(RankCounts { ranks, threads })
}

/// The session, stepped by ranks as before, or by the server itself where they do not start: its bits are the same.
async fn revived(shared: &Shared, options: RevivedOptions) -> Result<(Session, Vec<String>), ServiceError> {
    let place = shared.registry.place()?;
    if options.ranks.is_some() {
        let with_ranks = options.clone();
        match revive(with_ranks, resources(shared), place.clone(), shared.memory.claim()).await {
            Ok(revived) => return Ok(revived),
            Err(error) => {
                tracing::warn!(session = options.id, "the server steps it itself, without ranks: {error}");
            }
        }
    }
    revive(RevivedOptions { ranks: None, ..options }, resources(shared), place, shared.memory.claim()).await
}

/// Who sends the request again that made a session is given that session.
async fn remember(shared: &Shared, session: &Arc<Session>, warnings: Vec<String>) {
    let Some(request) = session.request() else { return };
    if let Ok(id) = Uuid::try_parse(&request.request_id) {
        let made = CreatedSession { request: request.clone(), session: Arc::downgrade(session), warnings };
        *shared.request_ids.entry(id).await = Some(made);
    }
}

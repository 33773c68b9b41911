//! The sessions that a server has of the one before it: each goes on from its newest good state, with what its logs say happened since.
//!
//! Enters: the folder of the server. Leaves: sessions, with their ids, their uids and the requests that made them. What cannot be taken
//! stays in the folder, and is named in the log.

use std::{error::Error, ffi::OsStr, io, sync::Arc};

use nappe_proto::v1;
use nappe_scene::printable;
use tokio::task::{JoinSet, spawn_blocking};
use uuid::Uuid;

use super::{create::resources, request_ids::CreatedSession, shared::Shared, validate};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
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
    logs: Logs,
    /// The highest number of a state or a log.
    last_number: u64,
}

/// What the logs since a state say, up to the first record that is missing.
#[derive(Default)]
struct Logs {
    records: Vec<Record<'static>>,
    /// A log whose end is damaged: how many of its bytes are good, and how many there are.
    cut: Option<(StatePlace, [u64; 2])>,
    /// Logs that follow what is missing.
    after: Vec<StatePlace>,
}

/// When a session is made again.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Turn {
    WithOthers,
    /// After all others.
    Last,
}

/// Makes the sessions again that the folder of the server has, all at a time. Making one takes more than having it: what there is no
/// room or no time for then is made once the others stand.
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
        restored.spawn(async move {
            let is_due_again = restore_one(&shared, &folder, Turn::WithOthers).await;
            is_due_again.then_some(folder)
        });
    }
    let mut left = Vec::new();
    while let Some(ended) = restored.join_next().await {
        match ended {
            Ok(folder) => left.extend(folder),
            Err(error) => tracing::error!("a session is not restored: {error}"),
        }
    }
    for folder in left {
        restore_one(shared, &folder, Turn::Last).await;
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

/// Makes a session again, of its newest state that is good. Whether that is to be tried again after all others.
async fn restore_one(shared: &Shared, folder: &SessionFolder, turn: Turn) -> bool {
    let path = folder.path().display();
    let states = folder.states().unwrap_or_default();
    for (index, state) in states.iter().enumerate() {
        let StatePlace { number, step } = *state;
        match session_at(shared, folder, *state).await {
            Ok(session) => {
                tracing::info!(session = session.id(), step, "restored");
                set_aside(folder, &states[..index]);
                return false;
            }
            Err(problem) if turn == Turn::WithOthers && is_of_others(&problem) => {
                tracing::info!("{path}: it is made again after the others: {problem}");
                return true;
            }
            Err(problem) => {
                tracing::error!("{path}: state {number}, of step {step}, is not taken: {problem}");
            }
        }
    }
    tracing::error!(
        "{path}: no state of this session can be taken: it stays there, for `nappe create --from {path}`"
    );
    false
}

/// Whether sessions that are made at the same time may be what is in the way.
fn is_of_others(problem: &Problem) -> bool {
    let refused = problem.downcast_ref::<ServiceError>();
    refused.is_some_and(|error| matches!(error.reason, Reason::ServerMemoryFull | Reason::BuildTooLong))
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
    let Found { file, told, mut logs, last_number } = spawn_blocking(move || read(&reader, state)).await??;
    let records = std::mem::take(&mut logs.records);
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
    if let Err(error) = mend(folder, &logs) {
        // What is told to the log now follows what could not be used.
        tracing::error!("{}: the logs are not mended: {error}", folder.path().display());
    }
    remember(shared, &session, warnings).await;
    reservation.fill(Arc::clone(&session));
    Ok(session)
}

/// What a folder has: a state with its setup, of which the hashes are checked, and the records since.
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
    let (last_number, logs) = (folder.last_number()?, read_logs(folder, state)?);
    Ok(Found { file, told, logs, last_number })
}

/// What the logs since a state say. Nothing is changed: an earlier state may be looked at because there is no room for a later one, whose
/// log is good.
fn read_logs(folder: &SessionFolder, state: StatePlace) -> io::Result<Logs> {
    let (mut logs, mut is_whole) = (Logs::default(), true);
    for place in folder.logs_since(state)? {
        if !is_whole {
            logs.after.push(place);
            continue;
        }
        let log = folder.read_log(place)?;
        let (mut found, length) = records(&log);
        let has_gap = found.first() == Some(&Record::Gap);
        if has_gap && place.number != state.number {
            is_whole = false;
            logs.after.push(place);
            continue;
        }
        if has_gap {
            // What is missing is in the state.
            found.remove(0);
        }
        logs.records.append(&mut found);
        if length < log.len() {
            is_whole = false;
            logs.cut = Some((place, [length as u64, log.len() as u64]));
        }
    }
    Ok(logs)
}

/// Leaves nothing of the logs that cannot be used, so that what is told to the log from now on follows what was used.
fn mend(folder: &SessionFolder, logs: &Logs) -> io::Result<()> {
    let path = folder.path().display();
    if let Some((place, [length, count])) = logs.cut {
        let number = place.number;
        tracing::warn!(
            "{path}: log {number} is good up to byte {length} of {count}: what follows is dropped"
        );
        folder.cut_log(place, length)?;
    }
    for place in &logs.after {
        let number = place.number;
        tracing::warn!("{path}: log {number} follows records that are missing, and is removed");
        folder.remove_log(*place)?;
    }
    Ok(())
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

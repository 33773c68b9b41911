//! Makes a session that goes on from the file of another one.
//!
//! Enters: a file, and what a request asks for beside it. Leaves: a handle and warnings, or the reason why there is no session. Memory
//! is claimed by the counts of the file before anything is read or built.

use std::{fmt::Display, sync::Arc, time::SystemTime};

use nappe_proto::v1;
use nappe_scene::printable;
use nappe_sim::{
    interrupt::{self, Interrupt},
    math::Precision,
    world::{ChangeError, ChangeRules, Simulation},
};
use tokio_util::sync::CancellationToken;

use super::{
    handle::Session,
    pending_changes::PendingChanges,
    place::Place,
    ranks::{Begin, RankCounts},
    stand::{Beginning, Parts, Past, Resources, stand, thread_pool},
    start::{launch, rules},
    status::{Properties, new_uid},
    stay::{Keeping, Kept},
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::{Checkpoint, Claimed, Origin, Source, claim_saved},
    state::{self, FileError, Opened, SavedSession, Section},
};

/// Memory at most that a request takes for each byte of it in a file: an empty text takes two there.
const REQUEST_BYTES_PER_BYTE: u64 = 12;

/// What a session is made from that goes on from a file.
#[derive(Clone, Debug)]
pub(crate) struct RevivedOptions {
    pub id: String,
    pub file: Checkpoint,
    /// `None`: as the file says; no other one is possible.
    pub precision: Option<Precision>,
    /// Threads, 1 or more.
    pub thread_count: u32,
    /// The session ends after this many steps since the start of the other one, 0: never; none: as that one, or never if that is at
    /// its end.
    pub step_limit: Option<u64>,
    /// Steps between frames; 0: as the file says.
    pub frame_interval_steps: u32,
    /// Ranks that step it; none: the server does.
    pub ranks: Option<RankCounts>,
    /// Where the session itself was kept; none: it is a copy of the one that was saved.
    pub kept: Option<Keeping>,
}

/// Starts the thread of a session that goes on from a file, which keeps `place` and `memory` until it ends. If the caller goes, or the
/// build takes longer than is allowed, it is given up.
///
/// # Errors
/// If the file is refused, cannot be stepped as it is asked for, or takes too long to build.
pub(crate) async fn revive(
    options: RevivedOptions,
    resources: Resources,
    place: Place,
    memory: Claim,
) -> Result<(Session, Vec<String>), ServiceError> {
    let (name, allowed) = (options.id.clone(), resources.limits.max_build_seconds);
    let build =
        move |interrupt: &Interrupt, ended, memory| build(options, &resources, interrupt, ended, memory);
    launch(name, place, memory, allowed, build).await
}

fn build(
    mut options: RevivedOptions,
    resources: &Resources,
    interrupt: &Interrupt,
    ended: CancellationToken,
    mut memory: Claim,
) -> Result<Parts, ServiceError> {
    let limits = &resources.limits;
    let refused = |error: FileError| ServiceError::from(&error);
    let file = Opened::of(options.file.bytes()).map_err(refused)?;
    // What is read is there until the session stands.
    let reading = memory.another();
    reading.grow(file.bytes_to_read())?;
    let pool = thread_pool(options.thread_count)?;
    let mut saved = pool.install(|| interrupt.leave_at_points(|| state::read(&file)))?.map_err(refused)?;
    check_precision(options.precision, &saved)?;
    let taken = saved.state.step_count();
    let kept = options.kept.take().map(|keeping| Kept::of(keeping, taken, &mut saved.pending));
    let Claimed { session_bytes, snow_bytes } = claim_saved(&saved, options.thread_count, limits, &memory)?;
    let restored = pool.install(|| interrupt.leave_at_points(|| state::restore(&saved)))?;
    let (simulation, odd) = restored.map_err(refused)?;
    let rules = match options.ranks {
        Some(_) => Arc::new(rules_over_ranks(&saved, &simulation, limits)?),
        None => rules(&simulation, limits),
    };
    interrupt::point();

    memory.shrink_to(session_bytes);
    let mut warnings = warnings(&file, &saved, odd);
    let SavedSession { session, request, setup, initial, state, pending, frame, positions, .. } = saved;
    let session_before = session.session.unwrap_or_default();
    let held = memory.another();
    held.grow(REQUEST_BYTES_PER_BYTE * file.section(Section::Request).len() as u64)?;
    let source = Source::of_section(file.section(Section::Setup), held)?;
    let origin = Origin { request, warnings: session.warnings, source };
    let properties = Properties {
        hash_interval: saved.hash_interval,
        colors: saved.colors.into(),
        initial_changes: initial.clone().into(),
        claimed_bytes: session_bytes,
        claimed_snow_bytes: snow_bytes,
        ..properties(&options, &session_before, &simulation, Arc::new(origin))
    };
    let (most, room) = (limits.max_pending_changes, memory.another());
    let (properties, pending) = match &kept {
        None => (properties, PendingChanges::restored(pending, most, room)?),
        Some(_) => (same(properties, &session_before), PendingChanges::replayed(pending, most, room)?),
    };
    let past = Past { session: session_before, frame, positions, state_hash: saved.state_hash };
    let begin = Beginning { rules, pending, past: Some(past) };
    let (mut stepper, session) = stand(simulation, pool, properties, begin, resources, ended, memory)?;
    if let Some(counts) = options.ranks {
        let precision = state.precision();
        let begin = Begin { setup: &setup, precision, changes: &initial, begun: Some(state) };
        for warning in stepper.hand_to_ranks(&resources.ranks, counts, &begin, interrupt)? {
            add(&mut warnings, warning);
        }
    }
    if let Some(kept) = &kept {
        stepper.go_on(kept, limits);
    }
    drop(reading);
    Ok((stepper, session, warnings))
}

/// Those of the session itself, which was kept.
fn same(properties: Properties, before: &v1::Session) -> Properties {
    let created = before.create_time.and_then(|time| SystemTime::try_from(time).ok());
    let create_time = created.unwrap_or(properties.create_time);
    Properties { uid: before.uid.clone(), create_time, is_copy: false, ..properties }
}

/// The state is in one precision, and goes on in it.
fn check_precision(asked: Option<Precision>, saved: &SavedSession) -> Result<(), ServiceError> {
    let own = saved.state.precision();
    match asked {
        Some(asked) if asked != own => {
            let problem = format!("is {asked}, and the session that was saved is in {own}: leave it out");
            Err(ServiceError::field("precision", problem))
        }
        _ => Ok(()),
    }
}

/// The changes that the session accepts while ranks step it.
///
/// # Errors
/// What they cannot step.
fn rules_over_ranks(
    saved: &SavedSession,
    simulation: &Simulation,
    limits: &Limits,
) -> Result<ChangeRules, ServiceError> {
    let refused = |error: &dyn Display| {
        ServiceError::new(Reason::RanksUnsupported, format!("the session that was saved: {error}"))
    };
    saved.setup.check_for_ranks().map_err(|error| refused(&error))?;
    let rules = rules(simulation, limits).over_ranks();
    for group in &saved.pending.groups {
        rules.check(&group.changes).map_err(|error| refused(&error))?;
    }
    let called = simulation.called_forces(0);
    let mut snow = saved.setup.snow.iter().flat_map(|snow| &snow.objects);
    match snow.find(|object| called.iter().any(|forces| forces.body == object.name)) {
        Some(object) => Err(refused(&ChangeError::SnowOverRanks { body: object.name.clone() })),
        None => Ok(rules),
    }
}

/// What the session was made with, and what is odd about the file.
fn warnings(file: &Opened<'_>, saved: &SavedSession, odd: Vec<String>) -> Vec<String> {
    let mut warnings = saved.session.warnings.clone();
    for warning in odd {
        add(&mut warnings, warning);
    }
    if !file.has_own_bits() {
        let warning = format!(
            "the session was saved by version {}, which computes other bits than this one: it goes on from the same state, and what \
             follows may differ from what would have followed there",
            printable(file.version())
        );
        add(&mut warnings, warning);
    }
    warnings
}

/// Adds a warning, unless it is there.
fn add(warnings: &mut Vec<String>, warning: String) {
    if !warnings.contains(&warning) {
        warnings.push(warning);
    }
}

fn properties(
    options: &RevivedOptions,
    before: &v1::Session,
    simulation: &Simulation,
    origin: Arc<Origin>,
) -> Properties {
    let is_at_end = before.step_limit > 0 && simulation.step_count() >= before.step_limit;
    let frame_interval_steps = match options.frame_interval_steps {
        0 => before.frame_interval_steps,
        asked => asked,
    };
    Properties {
        id: options.id.clone(),
        uid: new_uid(),
        create_time: SystemTime::now(),
        title: before.title.clone(),
        dt_seconds: simulation.dt(),
        step_limit: options.step_limit.unwrap_or(if is_at_end { 0 } else { before.step_limit }),
        frame_interval_steps,
        hash_interval: 1,
        colors: Arc::default(),
        precision: simulation.precision(),
        thread_count: options.thread_count,
        particle_count: simulation.particle_count() as u64,
        snow_particle_count: simulation.snow_particle_count() as u64,
        spring_count: simulation.spring_count() as u64,
        snow_cell: simulation.snow_cell(),
        initial_changes: Arc::default(),
        origin,
        is_copy: true,
        claimed_bytes: 0,
        claimed_snow_bytes: 0,
        claimed_way_bytes: 0,
    }
}

//! A session that stands: of a simulation, and of a pool, what a thread needs to step it, and what calls need.
//!
//! Enters: a simulation at its start or anywhere else, perhaps with what a file says of frames before. Leaves: the stepper and the
//! handle.

use std::{cell::Cell, sync::Arc};

use nappe_proto::v1;
use nappe_sim::{
    interrupt,
    world::{ChangeRules, Simulation},
};
use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio_util::sync::CancellationToken;

use super::{
    control::Control,
    frame_room::FrameRoom,
    handle::Session,
    parameters::parameters,
    pending_changes::PendingChanges,
    simulator::{Behind, Simulator},
    status::{Progress, Properties, Status},
    stepper::Stepper,
    transition::State,
};
use crate::{
    config::{Limits, RankSettings},
    counters::Counters,
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::MeshStore,
    stream::{Arrays, EncodedFrame, Feed, FieldSet, FrameHead, Streams, initial_diagnostics, topology},
};

/// Stack of a stepping thread (bytes), the size that a program's first thread has. Kernels keep many
/// vectors on it, and stolen work nests them; an overflow would end the process, not the session.
const STACK_BYTES: usize = 8 << 20;

/// What the sessions of a server are made with.
#[derive(Clone, Debug)]
pub(crate) struct Resources {
    pub meshes: Arc<MeshStore>,
    pub limits: Limits,
    pub streams: Arc<Streams>,
    /// How ranks are started.
    pub ranks: RankSettings,
    pub counters: Arc<Counters>,
}

/// A stepper, its handle, and warnings.
pub(super) type Parts = (Stepper, Session, Vec<String>);

/// What a session begins with beside its simulation.
pub(super) struct Beginning {
    /// The changes that it accepts.
    pub rules: Arc<ChangeRules>,
    /// Those that wait.
    pub pending: PendingChanges,
    /// What was before, if it goes on from a file.
    pub past: Option<Past>,
}

/// What a session that goes on from a file knows of the steps before.
pub(super) struct Past {
    /// As it was described.
    pub session: v1::Session,
    /// Its newest frame, without fields.
    pub frame: v1::Frame,
    /// The positions of that frame (m), in binary32.
    pub positions: Vec<u8>,
    /// The hash of the state.
    pub state_hash: u64,
}

/// The first frame of a session, and how far it is.
struct First {
    frame: EncodedFrame,
    state_hash: u64,
    diagnostics: v1::Diagnostics,
    /// The largest stretch so far, and when it was (s).
    largest_stretch: [f64; 2],
    /// Wall-clock time spent stepping so far (s).
    stepping_seconds: f64,
}

impl First {
    /// Of a session that begins, with frame 0.
    fn of(
        simulation: &Simulation,
        pool: &ThreadPool,
        budget: u64,
        streams: &Streams,
    ) -> Result<Self, ServiceError> {
        let diagnostics = pool.install(|| initial_diagnostics(simulation));
        interrupt::point();
        let (frame, state_hash) = pool.install(|| first_frame(simulation, &diagnostics, budget, streams))?;
        let largest_stretch = [diagnostics.max_stretch, simulation.time()];
        Ok(Self { frame, state_hash, diagnostics, largest_stretch, stepping_seconds: 0.0 })
    }

    /// Of a session that goes on: its newest frame, of which those who want more fields find them made again if its state still stands.
    fn of_past(past: Past, pool: &ThreadPool, streams: &Streams) -> Self {
        let Past { session, frame, positions, state_hash } = past;
        let found = frame.diagnostics.unwrap_or_default();
        let diagnostics = session.diagnostics.unwrap_or_else(|| found.clone());
        let head = FrameHead {
            frame: frame.frame,
            step: frame.step,
            time_seconds: frame.time_seconds,
            state_hash: frame.state_hash,
            diagnostics: found,
            poses: frame.poses,
        };
        // Arrays of their own, as those of another first frame.
        let arrays = Arrays::new(streams.memory());
        let frame = pool.install(|| EncodedFrame::of_positions(head, &positions, &arrays));
        let largest_stretch = [session.largest_stretch, session.largest_stretch_seconds];
        let stepping_seconds = session.stepping_seconds;
        Self { frame, state_hash, diagnostics, largest_stretch, stepping_seconds }
    }
}

/// A session that stands, paused, with its first frame.
pub(super) fn stand(
    simulation: Simulation,
    pool: ThreadPool,
    properties: Properties,
    Beginning { rules, pending, past }: Beginning,
    resources: &Resources,
    ended: CancellationToken,
    memory: Claim,
) -> Result<(Stepper, Session), ServiceError> {
    let Resources { limits, streams, counters, .. } = resources;
    let Properties { claimed_snow_bytes: snow_bytes, claimed_way_bytes: changed_bytes, .. } = properties;
    let topology = topology(&simulation, &properties.colors, &properties.uid);
    interrupt::point();
    let budget = limits.history_bytes_per_session;
    let first = match past {
        None => First::of(&simulation, &pool, budget, streams)?,
        Some(past) => First::of_past(past, &pool, streams),
    };
    let First { frame, state_hash, diagnostics, largest_stretch, stepping_seconds } = first;
    let feed = Arc::new(Feed::new(&properties.uid, frame, budget, Arc::clone(streams)));

    let progress = Progress {
        state: State::Paused,
        largest_stretch,
        step: simulation.step_count(),
        time_seconds: simulation.time(),
        state_hash: Some(state_hash),
        diagnostics,
        stepping_seconds,
        parameters: parameters(&simulation),
        failure: None,
        ranks: None,
    };
    let status = Arc::new(Status::new(properties, feed, progress));

    let step_interrupt = simulation.interrupt().clone();
    let control = Arc::new(Control::new(Arc::clone(&status), rules, step_interrupt, pending));
    let room = FrameRoom::new(memory.another(), status.properties.particle_count, budget);
    let session = Session::new(Arc::clone(&status), topology, Arc::clone(&control), (room, ended), limits);

    let hashed = Cell::new(Some((simulation.step_count(), state_hash)));
    let arrays = Arrays::new(streams.memory());
    let mut simulator = Simulator {
        simulation,
        pool,
        status,
        arrays,
        hashed,
        memory,
        snow_bytes,
        changed_bytes,
        pair_bytes: 0,
        ranks: None,
        behind: Behind::Nothing,
        is_torn: false,
    };
    simulator.count_growth()?;
    let counters = Arc::clone(counters);
    Ok((Stepper { simulator, control, counters, completing: Vec::new() }, session))
}

/// The threads that step a session, so many.
///
/// # Errors
/// If the system gives no thread.
pub(super) fn thread_pool(thread_count: u32) -> Result<ThreadPool, ServiceError> {
    ThreadPoolBuilder::new()
        .num_threads(thread_count as usize)
        .stack_size(STACK_BYTES)
        .thread_name(|index| format!("step-{index}"))
        .build()
        .map_err(|error| no_threads(&error))
}

/// The system gives no thread: it has no memory for its stack, or the limit on threads is reached.
pub(super) fn no_threads(error: &impl std::fmt::Display) -> ServiceError {
    ServiceError::new(
        Reason::ServerMemoryFull,
        format!("the system starts no thread for the session: {error}"),
    )
}

/// Frame 0 has every field of the state if the `budget` (bytes) of frames holds them: whoever opens a stream after a call that
/// plays finds it complete until the next frame is made. Its nodes of a grid, forces and accelerations are made for who asks
/// before the first step.
fn first_frame(
    simulation: &Simulation,
    diagnostics: &v1::Diagnostics,
    budget: u64,
    streams: &Streams,
) -> Result<(EncodedFrame, u64), ServiceError> {
    let state_hash = simulation.state_hash();
    let head =
        FrameHead { state_hash: Some(state_hash), ..FrameHead::of(simulation, 0, diagnostics.clone()) };

    // Arrays of their own, which are freed: no later frame may need as many.
    let arrays = Arrays::new(streams.memory());
    let encode = |wanted| EncodedFrame::encode(simulation, wanted, head.clone(), &arrays);
    let bytes = FieldSet::OF_STATE.stride() * simulation.particle_count();
    let complete = if bytes as u64 <= budget { encode(FieldSet::OF_STATE).ok() } else { None };
    // A field that is not finite is missed by who asks for it; positions are needed.
    let first = complete.map_or_else(|| encode(FieldSet::ALWAYS), Ok).map_err(|error| {
        let refused = ServiceError::new(Reason::InvalidScene, format!("at the start, {error}"));
        match error.particle() {
            Some(particle) => refused.with("particle", particle),
            None => refused,
        }
    })?;
    Ok((first, state_hash))
}

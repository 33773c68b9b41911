//! Makes a session: a thread that builds the simulation, reports back, and then steps it.
//!
//! Enters: the options of a session. Leaves: a handle and warnings, or the reason why there is no
//! session.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, atomic::AtomicBool, mpsc},
    thread,
    time::{Instant, SystemTime},
};

use nappe_proto::v1;
use nappe_scene::Scene;
use nappe_sim::{math::Precision, world::Simulation};
use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio::sync::{OwnedSemaphorePermit, oneshot};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::{
    command::MAX_COMMANDS,
    handle::Session,
    pace::Pace,
    parameters::parameters,
    pending_changes::PendingChanges,
    simulator::Simulator,
    status::{Progress, Properties, Status},
    stepper::Stepper,
    transition::State,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::{Asked, Assembled, MeshStore, assemble_scene},
    stream::{EncodedFrame, Feed, FieldSet, FrameHead, initial_diagnostics, topology},
};

/// Stack of a stepping thread (bytes), the size that a program's first thread has. Kernels keep many
/// vectors on it, and stolen work nests them; an overflow would end the process, not the session.
const STACK_BYTES: usize = 8 << 20;

/// What a session is made from.
#[derive(Clone, Debug)]
pub(crate) struct SessionOptions {
    pub id: String,
    /// The text of the scene.
    pub scene_text: String,
    /// What the scene is called in messages.
    pub scene_name: String,
    /// `None`: as the scene says.
    pub precision: Option<Precision>,
    /// Threads, 1 or more.
    pub thread_count: u32,
    /// The session ends after this many steps, 0: never; none: as the scene says.
    pub step_limit: Option<u64>,
    /// Steps between frames; 0: as the scene says.
    pub frame_interval_steps: u32,
}

/// Starts the thread of a session, which keeps `slot` and `memory` until it ends.
///
/// # Errors
/// If the scene cannot be read or simulated.
pub(crate) async fn start(
    options: SessionOptions,
    meshes: Arc<MeshStore>,
    limits: Limits,
    slot: OwnedSemaphorePermit,
    memory: Claim,
) -> Result<(Session, Vec<String>), ServiceError> {
    let (reply, answer) = oneshot::channel();
    let name = options.id.clone();
    let ended = CancellationToken::new();
    let (guard, token) = (ended.clone().drop_guard(), ended);

    let body = move || {
        // Dropped in the opposite order: the memory is given back before the end is announced, the slot after it.
        let _guard = guard;
        let _slot = slot;
        let mut memory = memory;

        // A panic while building ends this thread alone: the caller sees the reply dropped.
        let built = catch_unwind(AssertUnwindSafe(|| build(&options, &meshes, &limits, token, &mut memory)));
        drop(meshes);
        match built {
            Ok(Ok((stepper, session, warnings))) => {
                // A caller that is gone drops the handle, and the stepper ends by itself.
                let _ = reply.send(Ok((session, warnings)));
                stepper.run();
            }
            Ok(Err(error)) => drop(reply.send(Err(error))),
            Err(_panic) => drop(reply),
        }
    };

    // Linux shows the first 15 characters of a thread's name.
    thread::Builder::new().name(name).spawn(body).map_err(|error| no_threads(&error))?;
    answer.await.map_err(|_panicked| {
        ServiceError::internal("building the scene panicked: this is a bug in the server")
    })?
}

type Parts = (Stepper, Session, Vec<String>);

fn build(
    options: &SessionOptions,
    meshes: &MeshStore,
    limits: &Limits,
    ended: CancellationToken,
    memory: &mut Claim,
) -> Result<Parts, ServiceError> {
    let asked = Asked {
        text: &options.scene_text,
        file: &options.scene_name,
        precision: options.precision,
        thread_count: options.thread_count,
    };
    let Assembled { scene, built, session_bytes } = assemble_scene(asked, meshes, limits, memory)?;
    let pool = thread_pool(options)?;
    let precision = options.precision.unwrap_or(scene.precision);
    let (mut simulation, mut warnings) = pool
        .install(|| Simulation::new(&built.setup, precision))
        .map_err(|error| invalid_setup(options, &error))?;
    warnings.splice(0..0, built.warnings);
    simulation.apply(&built.initial_changes).map_err(|error| invalid_setup(options, &error))?;
    drop(built.setup);

    let properties = properties(options, &scene, &simulation);
    let topology = topology(&simulation, &properties.uid);
    let diagnostics = pool.install(|| initial_diagnostics(&simulation));
    let (first, state_hash) = pool.install(|| first_frame(&simulation, &diagnostics))?;
    let feed = Arc::new(Feed::new(&properties.uid, first, limits.history_bytes_per_session));

    let progress = Progress {
        state: State::Paused,
        step: 0,
        time_seconds: simulation.time(),
        state_hash: Some(state_hash),
        diagnostics,
        stepping_seconds: 0.0,
        parameters: parameters(simulation.parameters()),
        failure: None,
    };
    let status = Arc::new(Status::new(properties, feed, progress));

    let (sender, commands) = mpsc::sync_channel(MAX_COMMANDS);
    let is_deleted = Arc::new(AtomicBool::new(false));
    let control = (sender, Arc::clone(&is_deleted));
    let session = Session::new(Arc::clone(&status), topology, control, ended, limits);

    let stepper = Stepper {
        pace: Pace::start(0.0, Instant::now(), simulation.time()),
        pending: PendingChanges::new(limits.max_pending_changes),
        state: State::Paused,
        waiting: Vec::new(),
        panic_next: false,
        simulator: Simulator { simulation, pool, status },
        commands,
        commands_since_step: 0,
        is_deleted,
    };
    memory.shrink_to(session_bytes);
    Ok((stepper, session, warnings))
}

fn thread_pool(options: &SessionOptions) -> Result<ThreadPool, ServiceError> {
    ThreadPoolBuilder::new()
        .num_threads(options.thread_count as usize)
        .stack_size(STACK_BYTES)
        .thread_name(|index| format!("step-{index}"))
        .build()
        .map_err(|error| no_threads(&error))
}

/// The system gives no thread: it has no memory for its stack, or the limit on threads is reached.
fn no_threads(error: &impl std::fmt::Display) -> ServiceError {
    ServiceError::new(
        Reason::ServerMemoryFull,
        format!("the system starts no thread for the session: {error}"),
    )
}

/// A scene that can be read but not simulated.
fn invalid_setup(options: &SessionOptions, error: &impl std::fmt::Display) -> ServiceError {
    let message = format!("{}: {error}", options.scene_name);
    ServiceError::new(Reason::InvalidScene, message).with("fault", "SETUP")
}

fn properties(options: &SessionOptions, scene: &Scene, simulation: &Simulation) -> Properties {
    let frame_interval_steps =
        if options.frame_interval_steps == 0 { scene.frame_interval } else { options.frame_interval_steps };
    Properties {
        id: options.id.clone(),
        uid: Uuid::new_v4().to_string(),
        create_time: SystemTime::now(),
        title: scene.title.clone(),
        dt_seconds: simulation.dt(),
        step_limit: options.step_limit.unwrap_or(scene.steps),
        frame_interval_steps: frame_interval_steps.max(1),
        hash_interval: scene.hash_interval.max(1),
        precision: simulation.precision(),
        thread_count: options.thread_count,
        particle_count: simulation.particle_count() as u64,
        snow_particle_count: simulation.snow_particle_count() as u64,
        spring_count: simulation.spring_count() as u64,
        snow_cell: simulation.snow_cell(),
    }
}

/// Frame 0 has every field and the grid, so that a watcher who comes before the first step misses
/// none of them.
fn first_frame(
    simulation: &Simulation,
    diagnostics: &v1::Diagnostics,
) -> Result<(EncodedFrame, u64), ServiceError> {
    let state_hash = simulation.state_hash();
    let head =
        FrameHead { state_hash: Some(state_hash), ..FrameHead::of(simulation, 0, diagnostics.clone()) };

    let first = EncodedFrame::encode(simulation, FieldSet::ALL, head).map_err(|error| {
        let refused = ServiceError::new(Reason::InvalidScene, format!("at the start, {error}"));
        match error.particle() {
            Some(particle) => refused.with("particle", particle),
            None => refused,
        }
    })?;
    Ok((first, state_hash))
}

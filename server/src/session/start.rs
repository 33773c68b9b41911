//! Makes a session: a thread that builds the simulation, reports back, and then steps it.
//!
//! Enters: the options of a session. Leaves: a handle and warnings, or the reason why there is no
//! session.

use std::{
    cell::Cell,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread,
    time::SystemTime,
};

use nappe_proto::v1;
use nappe_scene::Scene;
use nappe_sim::{interrupt::Interrupt, math::Precision, world::Simulation};
use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio::sync::{OwnedSemaphorePermit, oneshot};
use tokio_util::sync::CancellationToken;
use uuid::Uuid;

use super::{
    control::Control,
    handle::Session,
    parameters::parameters,
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
    stream::{Arrays, EncodedFrame, Feed, FieldSet, FrameHead, Streams, initial_diagnostics, topology},
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

/// What the sessions of a server are made with.
#[derive(Clone, Debug)]
pub(crate) struct Resources {
    pub meshes: Arc<MeshStore>,
    pub limits: Limits,
    pub streams: Arc<Streams>,
}

/// Asks a build to give up when the call that waits for it is gone.
struct Abandoned(Interrupt);

impl Drop for Abandoned {
    fn drop(&mut self) {
        self.0.request();
    }
}

/// Starts the thread of a session, which keeps `slot` and `memory` until it ends. If the caller goes, the build is
/// given up.
///
/// # Errors
/// If the scene cannot be read or simulated.
pub(crate) async fn start(
    options: SessionOptions,
    resources: Resources,
    slot: OwnedSemaphorePermit,
    memory: Claim,
) -> Result<(Session, Vec<String>), ServiceError> {
    let (reply, answer) = oneshot::channel();
    let name = options.id.clone();
    let abandoned = Abandoned(Interrupt::default());
    let interrupt = abandoned.0.clone();
    let ended = CancellationToken::new();
    let (guard, token) = (ended.clone().drop_guard(), ended);

    let body = move || {
        // Dropped in the opposite order: the memory is given back before the end is announced, the slot after it.
        let _guard = guard;
        let _slot = slot;
        let mut memory = memory;

        // A panic while building ends this thread alone: the caller sees the reply dropped.
        let built =
            catch_unwind(AssertUnwindSafe(|| build(&options, &resources, &interrupt, token, &mut memory)));
        drop(resources);
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
    resources: &Resources,
    interrupt: &Interrupt,
    ended: CancellationToken,
    memory: &mut Claim,
) -> Result<Parts, ServiceError> {
    let Resources { meshes, limits, streams } = resources;
    let asked = Asked {
        text: &options.scene_text,
        file: &options.scene_name,
        precision: options.precision,
        thread_count: options.thread_count,
    };
    let Assembled { scene, built, session_bytes } = assemble_scene(asked, meshes, limits, memory)?;
    check(interrupt)?;
    let pool = thread_pool(options)?;
    let precision = options.precision.unwrap_or(scene.precision);
    let (mut simulation, mut warnings) = pool
        .install(|| Simulation::new(&built.setup, precision))
        .map_err(|error| invalid_setup(options, &error))?;
    check(interrupt)?;
    warnings.splice(0..0, built.warnings);
    simulation.apply(&built.initial_changes).map_err(|error| invalid_setup(options, &error))?;
    drop(built.setup);

    let properties = properties(options, &scene, &simulation);
    let topology = topology(&simulation, &properties.uid);
    let diagnostics = pool.install(|| initial_diagnostics(&simulation));
    let arrays = Arrays::new(streams.memory());
    let (first, state_hash) = pool.install(|| first_frame(&simulation, &diagnostics, &arrays))?;
    let budget = limits.history_bytes_per_session;
    let feed = Arc::new(Feed::new(&properties.uid, first, budget, Arc::clone(streams)));

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

    let (rules, step_interrupt) = (Arc::clone(simulation.rules()), simulation.interrupt().clone());
    let control = Control::new(Arc::clone(&status), rules, step_interrupt, limits.max_pending_changes);
    let control = Arc::new(control);
    let session = Session::new(Arc::clone(&status), topology, Arc::clone(&control), ended, limits);

    let hashed = Cell::new(Some((simulation.step_count(), state_hash)));
    let simulator = Simulator { simulation, pool, status, arrays, hashed, is_torn: false };
    let stepper = Stepper { simulator, control };
    memory.shrink_to(session_bytes);
    Ok((stepper, session, warnings))
}

/// Gives a build up whose caller is gone.
fn check(interrupt: &Interrupt) -> Result<(), ServiceError> {
    if !interrupt.is_requested() {
        return Ok(());
    }
    Err(ServiceError::new(Reason::RequestCancelled, "the caller is gone: the session is not made"))
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

/// Frame 0 has what every frame has. Until the first step, a watcher who wants more finds it completed.
fn first_frame(
    simulation: &Simulation,
    diagnostics: &v1::Diagnostics,
    arrays: &Arc<Arrays>,
) -> Result<(EncodedFrame, u64), ServiceError> {
    let state_hash = simulation.state_hash();
    let head =
        FrameHead { state_hash: Some(state_hash), ..FrameHead::of(simulation, 0, diagnostics.clone()) };

    let first = EncodedFrame::encode(simulation, FieldSet::ALWAYS, head, arrays).map_err(|error| {
        let refused = ServiceError::new(Reason::InvalidScene, format!("at the start, {error}"));
        match error.particle() {
            Some(particle) => refused.with("particle", particle),
            None => refused,
        }
    })?;
    Ok((first, state_hash))
}

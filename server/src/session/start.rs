//! Makes a session: a thread that builds the simulation, reports back, and then steps it.
//!
//! Enters: an order. Leaves: a handle and remarks, or the reason why there is no session.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{Arc, mpsc},
    thread,
    time::Instant,
};

use nappe_proto::v1;
use nappe_scene::Scene;
use nappe_sim::{
    math::Precision,
    report::{Diagnostics, Stage, StepReport},
    world::Simulation,
};
use rayon::{ThreadPool, ThreadPoolBuilder};
use tokio::sync::{OwnedSemaphorePermit, oneshot};
use tokio_util::sync::CancellationToken;

use super::{
    handle::Session,
    pace::Pace,
    pending_changes::Pending,
    status::{Facts, Progress, Status},
    stepper::Stepper,
    transition::State,
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    scenes::{MeshStore, build_scene},
    stream::{Contents, EncodedFrame, Feed, FrameHead, topology, wire},
};

/// Stack of a stepping thread (bytes), as a program's first thread has. Kernels keep many vectors on
/// it, and stealing work nests them; an overflow would end the process, not the session.
const STACK_BYTES: usize = 8 << 20;

/// A session to make.
#[derive(Clone, Debug)]
pub(crate) struct Order {
    /// Its id.
    pub id: String,
    /// The scene's text.
    pub text: String,
    /// The scene's name in messages.
    pub file: String,
    /// Precision; `None`: as the scene says.
    pub precision: Option<Precision>,
    /// Threads, 1 or more.
    pub thread_count: u32,
    /// Ends after so many steps; 0: as the scene says.
    pub step_limit: u64,
    /// A frame every so many steps; 0: as the scene says.
    pub frame_interval: u32,
}

/// Starts the thread of a session, which keeps `slot` until it ends.
///
/// # Errors
/// If the scene cannot be read or simulated.
pub(crate) async fn start(
    order: Order,
    meshes: Arc<MeshStore>,
    limits: Limits,
    slot: OwnedSemaphorePermit,
) -> Result<(Session, Vec<String>), ServiceError> {
    let (reply, answer) = oneshot::channel();
    let name = order.id.clone();
    let ended = CancellationToken::new();
    let (guard, token) = (ended.clone().drop_guard(), ended);
    let body = move || {
        // Dropped in the opposite order: the slot is free when the end is told.
        let _guard = guard;
        let _slot = slot;
        // A panic while building ends this thread alone: the caller sees the reply dropped.
        let built = catch_unwind(AssertUnwindSafe(|| build(&order, &meshes, &limits, token)));
        drop(meshes);
        match built {
            Ok(Ok((stepper, session, remarks))) => {
                // A caller that is gone drops the handle, and the stepper ends by itself.
                let _ = reply.send(Ok((session, remarks)));
                stepper.run();
            }
            Ok(Err(error)) => drop(reply.send(Err(error))),
            Err(_panic) => drop(reply),
        }
    };
    // Linux shows the first 15 characters of a thread's name.
    thread::Builder::new().name(name).spawn(body).map_err(|error| {
        ServiceError::new(Reason::Internal, format!("no thread could be started: {error}"))
    })?;
    answer.await.map_err(|_panicked| {
        ServiceError::new(Reason::Internal, "building the scene panicked: this is a fault of the program")
    })?
}

type Parts = (Stepper, Session, Vec<String>);

fn build(
    order: &Order,
    meshes: &MeshStore,
    limits: &Limits,
    ended: CancellationToken,
) -> Result<Parts, ServiceError> {
    let (scene, built) = build_scene(&order.text, &order.file, meshes, limits)?;
    let pool = thread_pool(order)?;
    let precision = order.precision.unwrap_or(scene.precision);
    let (mut simulation, mut remarks) =
        pool.install(|| Simulation::new(&built.setup, precision)).map_err(|error| {
            ServiceError::new(Reason::InvalidScene, format!("{}: {error}", order.file)).with("fault", "SETUP")
        })?;
    remarks.splice(0..0, built.remarks);
    simulation.apply(&built.initial_changes).map_err(|error| {
        ServiceError::new(Reason::InvalidScene, format!("{}: {error}", order.file)).with("fault", "SETUP")
    })?;
    let topology = topology::pieces(wire::topology(&simulation.topology(), simulation.colliders()));
    let diagnostics = pool.install(|| initial_figures(&simulation));
    let (first, state_hash) = pool.install(|| first_frame(&simulation, &diagnostics))?;
    let feed = Arc::new(Feed::new(first, limits.history_bytes_per_session));
    let progress = Progress {
        state: State::Paused,
        step: 0,
        time: simulation.time(),
        state_hash: Some(state_hash),
        diagnostics,
        stepping_seconds: 0.0,
        failure: None,
    };
    let status = Arc::new(Status::new(facts(order, &scene, &simulation), feed, progress));
    let (sender, commands) = mpsc::channel();
    let session = Session::new(Arc::clone(&status), topology, sender, ended, limits);
    let stepper = Stepper {
        pace: Pace::start(0.0, Instant::now(), simulation.time()),
        pending: Pending::new(limits.max_pending_changes),
        state: State::Paused,
        waiting: Vec::new(),
        panic_next: false,
        simulation,
        pool,
        status,
        commands,
    };
    Ok((stepper, session, remarks))
}

fn thread_pool(order: &Order) -> Result<ThreadPool, ServiceError> {
    ThreadPoolBuilder::new()
        .num_threads(order.thread_count as usize)
        .stack_size(STACK_BYTES)
        .thread_name(|index| format!("step-{index}"))
        .build()
        .map_err(|error| ServiceError::new(Reason::Internal, format!("no threads could be started: {error}")))
}

fn facts(order: &Order, scene: &Scene, simulation: &Simulation) -> Facts {
    let or = |asked: u64, scene: u64| if asked == 0 { scene } else { asked };
    Facts {
        id: order.id.clone(),
        title: scene.title.clone(),
        dt: simulation.dt(),
        step_limit: or(order.step_limit, scene.steps),
        frame_interval: or(order.frame_interval.into(), scene.frame_interval.into()).max(1) as u32,
        hash_interval: scene.hash_interval.max(1),
        precision: simulation.precision(),
        thread_count: order.thread_count,
        particle_count: simulation.particle_count() as u64,
        snow_particle_count: simulation.snow_particle_count() as u64,
        spring_count: simulation.spring_count() as u64,
        snow_cell: simulation.snow_cell(),
    }
}

/// Frame 0 has every array and the grid, so that a watcher who comes before the first step misses none.
fn first_frame(
    simulation: &Simulation,
    diagnostics: &v1::Diagnostics,
) -> Result<(EncodedFrame, u64), ServiceError> {
    let state_hash = simulation.state_hash();
    let head = FrameHead { state_hash: Some(state_hash), ..head(simulation, 0, diagnostics.clone()) };
    let first = EncodedFrame::encode(simulation, Contents::ALL, head);
    let first = first.map_err(|fault| {
        let refused = ServiceError::new(Reason::InvalidScene, format!("at the start, {fault}"));
        fault.particle().into_iter().fold(refused, |refused, particle| refused.with("particle", particle))
    })?;
    Ok((first, state_hash))
}

/// The head of a frame of the state as it is, without a hash.
pub(super) fn head(simulation: &Simulation, frame: u64, diagnostics: v1::Diagnostics) -> FrameHead {
    FrameHead { frame, step: simulation.step_count(), time: simulation.time(), state_hash: None, diagnostics }
}

fn initial_figures(simulation: &Simulation) -> v1::Diagnostics {
    let report = StepReport {
        step: simulation.step_count(),
        time: simulation.time(),
        diagnostics: simulation.diagnose(),
        ..StepReport::default()
    };
    figures(&report, 0, &[0.0; Stage::ALL.len()], 0.0)
}

/// The message of a step's figures.
pub(super) fn figures(
    report: &StepReport,
    frame: u64,
    stage_seconds: &[f64; Stage::ALL.len()],
    step_seconds: f64,
) -> v1::Diagnostics {
    let Diagnostics { kinetic_energy, elastic_energy, gravitational_energy, momentum, max_stretch } =
        report.diagnostics;
    v1::Diagnostics {
        step: report.step,
        time_seconds: report.time,
        frame,
        kinetic_energy,
        elastic_energy,
        gravitational_energy,
        momentum: Some(wire::vector(momentum)),
        max_stretch,
        contact_count: report.contact_count,
        solve: report.solve.as_ref().map(wire::solve),
        stages: wire::stages(stage_seconds),
        step_seconds,
        snow: report.snow.as_ref().map(wire::snow),
    }
}

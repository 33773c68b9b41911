//! Makes a session: a thread that builds the simulation, reports back, and then steps it.
//!
//! Enters: the options of a session. Leaves: a handle and warnings, or the reason why there is no
//! session.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
    thread,
    time::{Duration, SystemTime},
};

use nappe_scene::Scene;
use nappe_sim::{
    interrupt::{self, Interrupt},
    world::{ChangeRules, Simulation},
};
use tokio::{sync::oneshot, time::timeout};
use tokio_util::sync::CancellationToken;

use super::{
    desk::Copied,
    handle::Session,
    options::SessionOptions,
    pending_changes::PendingChanges,
    place::Place,
    ranks::Begin,
    stand::{Beginning, Parts, Resources, no_threads, stand, thread_pool},
    status::{Properties, new_uid},
};
use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    memory::Claim,
    scenes::{Asked, Assembled, Origin, Source, assemble_scene},
};

/// A call that waits for a build: if it goes before there is an answer, or waits no longer, the build is given up.
struct Waiting {
    interrupt: Interrupt,
    place: Place,
    is_answered: bool,
}

impl Drop for Waiting {
    fn drop(&mut self) {
        if !self.is_answered {
            self.interrupt.request();
            self.place.leave();
        }
    }
}

/// Starts the thread of a session, which keeps `place` and `memory` until it ends. If the caller goes, or the build
/// takes longer than is allowed, it is given up.
///
/// # Errors
/// If the scene cannot be read or simulated, or takes too long to build.
pub(crate) async fn start(
    options: SessionOptions,
    resources: Resources,
    place: Place,
    memory: Claim,
) -> Result<(Session, Vec<String>), ServiceError> {
    let (name, allowed) = (options.id.clone(), resources.limits.max_build_seconds);
    let build =
        move |interrupt: &Interrupt, ended, memory| build(&options, &resources, interrupt, ended, memory);
    launch(name, place, memory, allowed, build).await
}

/// Starts the thread of a session that stands where another one stands; without a limit of steps, as that one has
/// it, or never if it is at its end.
///
/// # Errors
/// If that one cannot be copied.
pub(crate) async fn fork(
    original: &Session,
    id: String,
    step_limit: Option<u64>,
    resources: Resources,
    place: Place,
    memory: Claim,
) -> Result<Session, ServiceError> {
    memory.grow(original.claimed_bytes())?;
    let (properties, Copied { simulation, pending }) = original.copy().await?;
    let pending = PendingChanges::of(pending, memory.another())?;
    let is_at_end = properties.step_limit > 0 && simulation.step_count() >= properties.step_limit;
    let properties = Properties {
        step_limit: step_limit.unwrap_or(if is_at_end { 0 } else { properties.step_limit }),
        ..properties.of_new_session(id)
    };

    let (name, allowed) = (properties.id.clone(), resources.limits.max_build_seconds);
    let build = move |_: &Interrupt, ended, memory| {
        let pool = thread_pool(properties.thread_count)?;
        let begin = Beginning { rules: rules(&simulation, &resources.limits), pending, past: None };
        let (stepper, session) = stand(simulation, pool, properties, begin, &resources, ended, memory)?;
        Ok((stepper, session, Vec::new()))
    };
    Ok(launch(name, place, memory, allowed, build).await?.0)
}

/// Starts a thread that builds a session within `allowed` seconds and steps it, and that keeps `place` and `memory` until it ends.
///
/// # Errors
/// Those of the build, that it takes too long, or that the system gives no thread.
pub(super) async fn launch(
    name: String,
    place: Place,
    memory: Claim,
    allowed: u32,
    build: impl FnOnce(&Interrupt, CancellationToken, Claim) -> Result<Parts, ServiceError> + Send + 'static,
) -> Result<(Session, Vec<String>), ServiceError> {
    let (reply, answer) = oneshot::channel();
    let interrupt = Interrupt::default();
    let mut waiting = Waiting { interrupt: interrupt.clone(), place: place.clone(), is_answered: false };
    let ended = CancellationToken::new();
    let (guard, token) = (ended.clone().drop_guard(), ended);

    let body = move || {
        // Dropped in the opposite order, after the memory: who is told of the end finds the place free.
        let _guard = guard;
        let _place = place;

        // A panic while building ends this thread alone: the caller sees the reply dropped.
        let build = || interrupt.leave_at_points(|| build(&interrupt, token, memory));
        let built =
            catch_unwind(AssertUnwindSafe(build)).map(|built| built.unwrap_or_else(|left| Err(left.into())));
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
    let answer = timeout(Duration::from_secs(allowed.into()), answer).await;
    let answer = answer.map_err(|_elapsed| too_long(allowed))?;
    waiting.is_answered = true;
    answer.map_err(|_panicked| {
        ServiceError::internal("building the scene panicked: this is a bug in the server")
    })?
}

/// Which changes of calls a session accepts.
pub(super) fn rules(simulation: &Simulation, limits: &Limits) -> Arc<ChangeRules> {
    Arc::new(simulation.rules().with_most_pulled(limits.max_pulls as usize))
}

fn build(
    options: &SessionOptions,
    resources: &Resources,
    interrupt: &Interrupt,
    ended: CancellationToken,
    mut memory: Claim,
) -> Result<Parts, ServiceError> {
    let Resources { meshes, limits, .. } = resources;
    let asked = Asked {
        text: &options.scene_text,
        file: &options.scene_name,
        precision: options.precision,
        thread_count: options.thread_count,
    };
    let Assembled { scene, built, session_bytes, snow_bytes, parts } =
        assemble_scene(asked, meshes, limits, &memory)?;
    if options.ranks.is_some() {
        built.setup.check_for_ranks().map_err(|error| {
            ServiceError::new(Reason::RanksUnsupported, format!("{}: {error}", options.scene_name))
        })?;
    }
    let pool = thread_pool(options.thread_count)?;
    let precision = options.precision.unwrap_or(scene.precision);
    let (mut simulation, mut warnings) = pool
        .install(|| interrupt.leave_at_points(|| Simulation::new(&built.setup, precision)))?
        .map_err(|error| invalid_setup(options, &error))?;
    warnings.splice(0..0, built.warnings);
    simulation.apply(&built.initial_changes).map_err(|error| invalid_setup(options, &error))?;
    if let Some(frame) = &options.begin {
        let step_limit = options.step_limit.unwrap_or(scene.steps);
        let put = || interrupt.leave_at_points(|| frame.put(&mut simulation, step_limit));
        warnings.extend(pool.install(put)??);
    }
    interrupt::point();

    memory.shrink_to(session_bytes);
    let (request, source) = (Some(options.request.clone()), Source::Scene(parts));
    let origin = Origin { request, warnings: warnings.clone(), source };
    let properties = Properties {
        claimed_bytes: session_bytes,
        claimed_snow_bytes: snow_bytes,
        claimed_way_bytes: simulation.changed_memory_bytes() as u64,
        initial_changes: built.initial_changes.clone().into(),
        ..properties(options, &scene, &simulation, Arc::new(origin))
    };
    // The copy of what ranks step accepts more than they do.
    let rules = match options.ranks {
        Some(_) => Arc::new(rules(&simulation, limits).over_ranks()),
        None => rules(&simulation, limits),
    };
    let pending = PendingChanges::new(limits.max_pending_changes, memory.another());
    let begin = Beginning { rules, pending, past: None };
    let (mut stepper, session) = stand(simulation, pool, properties, begin, resources, ended, memory)?;
    if let Some(counts) = options.ranks {
        let begun = options.begin.as_ref().map(|_| stepper.simulator.simulation.take());
        let begin = Begin { setup: &built.setup, precision, changes: &built.initial_changes, begun };
        for warning in stepper.hand_to_ranks(&resources.ranks, counts, &begin, interrupt)? {
            // Ranks also warn of what the copy of the server warned of.
            if !warnings.contains(&warning) {
                warnings.push(warning);
            }
        }
    }
    Ok((stepper, session, warnings))
}

/// A build that was given up after so many seconds.
fn too_long(allowed: u32) -> ServiceError {
    let message = format!(
        "building the session takes more than {allowed} s, and no more is allowed: where many triangles overlap, it takes long"
    );
    ServiceError::new(Reason::BuildTooLong, message).with("allowed_seconds", allowed)
}

/// A scene that can be read but not simulated.
fn invalid_setup(options: &SessionOptions, error: &impl std::fmt::Display) -> ServiceError {
    let message = format!("{}: {error}", options.scene_name);
    ServiceError::new(Reason::InvalidScene, message).with("violation", "SETUP")
}

fn properties(
    options: &SessionOptions,
    scene: &Scene,
    simulation: &Simulation,
    origin: Arc<Origin>,
) -> Properties {
    let frame_interval_steps =
        if options.frame_interval_steps == 0 { scene.frame_interval } else { options.frame_interval_steps };
    Properties {
        id: options.id.clone(),
        uid: new_uid(),
        create_time: SystemTime::now(),
        title: scene.title.clone(),
        colors: colors(scene),
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
        initial_changes: Arc::default(),
        origin,
        is_copy: false,
        claimed_bytes: 0,
        claimed_snow_bytes: 0,
        claimed_way_bytes: 0,
    }
}

/// Colours of the bodies that the scene gives one.
fn colors(scene: &Scene) -> Arc<[(String, u32)]> {
    let channel = |share: f64| (255.0 * share).round() as u8;
    let packed =
        |[red, green, blue]: [f64; 3]| u32::from_be_bytes([0, channel(red), channel(green), channel(blue)]);
    let bodies = scene.bodies.iter().map(|body| (&body.name, body.color));
    let all = bodies.chain(scene.figures.iter().map(|figure| (&figure.name, figure.color)));
    all.filter_map(|(name, color)| Some((name.clone(), packed(color?)))).collect()
}

//! A session in words: as JSON for programs, as lines and table rows for people.

use nappe_client::v1;
use serde::Serialize;

use crate::{
    error::{CliError, Exit, Result},
    output::{self, Column, Format},
    snow::SnowJson,
};

/// A session as programs read it; the names are those of the contract (simulation.proto).
#[derive(Debug, Serialize)]
pub(crate) struct SessionJson {
    session_id: String,
    title: String,
    state: &'static str,
    failure: Option<FailureJson>,
    step: u64,
    time_seconds: f64,
    frame: u64,
    oldest_frame: u64,
    dt_seconds: f64,
    step_limit: u64,
    frame_interval_steps: u32,
    precision: &'static str,
    thread_count: u32,
    particle_count: u64,
    spring_count: u64,
    snow_particle_count: u64,
    watcher_count: u32,
    state_hash: Option<String>,
    diagnostics: Option<DiagnosticsJson>,
    stepping_seconds: f64,
}

#[derive(Debug, Serialize)]
struct FailureJson {
    reason: String,
    message: String,
    step: u64,
    time_seconds: f64,
    particle: Option<u64>,
    value: Option<f64>,
}

/// Figures of a step as programs read them.
#[derive(Debug, Serialize)]
pub(crate) struct DiagnosticsJson {
    step: u64,
    time_seconds: f64,
    frame: u64,
    kinetic_energy: f64,
    elastic_energy: f64,
    gravitational_energy: f64,
    max_stretch: f64,
    contact_count: u64,
    step_seconds: f64,
    iterations: Option<u32>,
    relative_residual: Option<f64>,
    snow: Option<SnowJson>,
}

impl From<&v1::Session> for SessionJson {
    fn from(session: &v1::Session) -> Self {
        Self {
            session_id: session.session_id.clone(),
            title: session.title.clone(),
            state: state(session),
            failure: session.failure.as_ref().map(|failure| FailureJson {
                reason: failure.reason.clone(),
                message: failure.message.clone(),
                step: failure.step,
                time_seconds: failure.time_seconds,
                particle: failure.particle,
                value: failure.value,
            }),
            step: session.step,
            time_seconds: session.time_seconds,
            frame: session.frame,
            oldest_frame: session.oldest_frame,
            dt_seconds: session.dt_seconds,
            step_limit: session.step_limit,
            frame_interval_steps: session.frame_interval_steps,
            precision: precision(session),
            thread_count: session.thread_count,
            particle_count: session.particle_count,
            spring_count: session.spring_count,
            snow_particle_count: session.snow_particle_count,
            watcher_count: session.watcher_count,
            state_hash: session.state_hash.map(output::hash),
            diagnostics: session.diagnostics.as_ref().map(DiagnosticsJson::from),
            stepping_seconds: session.stepping_seconds,
        }
    }
}

impl From<&v1::Diagnostics> for DiagnosticsJson {
    fn from(figures: &v1::Diagnostics) -> Self {
        Self {
            step: figures.step,
            time_seconds: figures.time_seconds,
            frame: figures.frame,
            kinetic_energy: figures.kinetic_energy,
            elastic_energy: figures.elastic_energy,
            gravitational_energy: figures.gravitational_energy,
            max_stretch: figures.max_stretch,
            contact_count: figures.contact_count,
            step_seconds: figures.step_seconds,
            iterations: figures.solve.as_ref().map(|solve| solve.iterations),
            relative_residual: figures.solve.as_ref().map(|solve| solve.relative_residual),
            snow: figures.snow.as_ref().map(SnowJson::from),
        }
    }
}

/// What a session is doing, in a word.
pub(crate) fn state(session: &v1::Session) -> &'static str {
    match session.state() {
        v1::SessionState::Unspecified => "unknown",
        v1::SessionState::Paused => "paused",
        v1::SessionState::Playing => "playing",
        v1::SessionState::Finished => "finished",
        v1::SessionState::Failed => "failed",
    }
}

/// Precision of a session, in a word.
pub(crate) fn precision(session: &v1::Session) -> &'static str {
    match session.precision() {
        v1::Precision::Unspecified => "unknown",
        v1::Precision::F32 => "f32",
        v1::Precision::F64 => "f64",
    }
}

/// Kinetic, elastic and gravitational energy together (J).
pub(crate) fn total_energy(figures: &v1::Diagnostics) -> f64 {
    figures.kinetic_energy + figures.elastic_energy + figures.gravitational_energy
}

/// The failure of a session as an error of this command; `None` while it has not failed.
pub(crate) fn failure(session: &v1::Session) -> Option<CliError> {
    let failure = session.failure.as_ref()?;
    let exit = if diverged(failure) { Exit::Diverged } else { Exit::Failure };
    Some(CliError::new(exit, format!("{} ({})", failure.message, failure.reason)))
}

/// Whether a failure comes from the numbers, and not from the program.
pub(crate) fn diverged(failure: &v1::Failure) -> bool {
    is_divergence(&failure.reason)
}

/// Reasons of steps that left what the scene allows.
const DIVERGENCES: [&str; 10] = [
    "NOT_FINITE",
    "STRETCH_LIMIT",
    "ENERGY_LIMIT",
    "SOLVER_FAILED",
    "TIME_STEP_LIMIT",
    "SUBSTEP_LIMIT",
    "NODE_SPEED",
    "DEFORMATION_LIMIT",
    "OUT_OF_RANGE",
    "MASS_LOST",
];

/// Whether a reason says that the simulation diverged.
pub(crate) fn is_divergence(reason: &str) -> bool {
    DIVERGENCES.contains(&reason)
}

/// Prints one session.
///
/// # Errors
/// As [`output::line`].
pub(crate) fn print(session: &v1::Session, format: Format) -> Result<()> {
    match format {
        Format::Json => output::json(&SessionJson::from(session)),
        Format::Text => output::line(&text(std::slice::from_ref(session))),
    }
}

/// A table of sessions.
pub(crate) fn text(sessions: &[v1::Session]) -> String {
    let columns = [
        Column::Left("session"),
        Column::Left("state"),
        Column::Right("step"),
        Column::Right("time"),
        Column::Right("particles"),
        Column::Right("threads"),
        Column::Left("precision"),
        Column::Right("watchers"),
        Column::Left("title"),
    ];
    let rows: Vec<Vec<String>> = sessions
        .iter()
        .map(|session| {
            let step = match session.step_limit {
                0 => session.step.to_string(),
                limit => format!("{} of {limit}", session.step),
            };
            vec![
                session.session_id.clone(),
                state(session).to_owned(),
                step,
                format!("{:.3} s", session.time_seconds),
                output::count(session.particle_count),
                session.thread_count.to_string(),
                precision(session).to_owned(),
                session.watcher_count.to_string(),
                session.title.clone(),
            ]
        })
        .collect();
    let failures: Vec<String> = sessions
        .iter()
        .filter_map(|session| {
            let failure = session.failure.as_ref()?;
            Some(format!("\n{}: {} ({})", session.session_id, failure.message, failure.reason))
        })
        .collect();
    output::table(&columns, &rows) + &failures.concat()
}

//! What a whole simulation came to: one JSON object for scripts, a small table for people.
//!
//! The names in the object are stable. A number that is not of the run as a whole says so: `..._at_end` are those of the last
//! state, or of the step that led to it.

use std::path::PathBuf;

use nappe_client::v1;
use nappe_scene::mesh::six_digits;
use serde::Serialize;

use super::drive::{DriveEnd, Driven};
use crate::{
    files::paths,
    words::{
        diagnostics,
        error::{CliError, Exit, Result},
        output::{self, Column, Format},
        session,
    },
};

/// The result of a run. Where it began at a saved frame, steps and time count from the start of the scene, and all else from the
/// frame.
#[derive(Debug, Serialize)]
pub(crate) struct Summary {
    /// The scene, as it was named.
    scene: String,
    /// Steps taken, fewer than asked for if the run ended early.
    steps: u64,
    /// Simulated time at the end (s).
    time: f64,
    /// Wall-clock seconds spent stepping.
    seconds: f64,
    /// Hash of the final state, 16 hexadecimal digits.
    state_hash: Option<String>,
    /// Kinetic, elastic and gravitational energy of the last state (J).
    energy_at_end: f64,
    /// Largest length over rest length of a spring in all states of the run.
    max_stretch: f64,
    /// Time of the first state in which it was so (s).
    max_stretch_time: f64,
    /// Work of air and given forces in the last step (J).
    external_work_at_end: f64,
    /// How the last step was divided for the cloths; none without cloth.
    cloth_at_end: Option<v1::ClothSteps>,
    /// What kept surfaces of cloth apart in the last step; none where nothing has to, and nothing is counted.
    surface_at_end: Option<v1::SurfaceReport>,
    /// How still cloth lies at the end; none where the scene does not ask for that.
    rest_at_end: Option<v1::RestReport>,
    /// Diagnostics of the snow in the last step; none without snow.
    snow_at_end: Option<v1::SnowDiagnostics>,
    /// What colliders felt in the last step; empty before the first.
    loads_at_end: Vec<v1::ColliderLoad>,
    /// Where colliders are at the end.
    poses_at_end: Vec<v1::ColliderPose>,
    /// What makes the results doubtful, counted over all steps of the run.
    notices_over_run: v1::Notices,
    /// Where and why the simulation diverged.
    diverged: Option<Divergence>,
    /// Whether the user ended it before its end.
    interrupted: bool,
    particles: u64,
    springs: u64,
    /// Threads, of each rank where there are any.
    threads: u32,
    /// Ranks that stepped it; 0: none.
    ranks: u32,
    /// The host of each rank.
    hosts: Vec<String>,
    /// Messages that rank 0 sent to its neighbours over the run, and their bytes.
    messages: u64,
    message_bytes: u64,
    /// Lists that all ranks gathered over the run.
    gathers: u64,
    precision: String,
    dt: f64,
    /// Frames that were saved; if none were to be, those that the session made.
    frames: u64,
    /// Where the frames were saved.
    saved: Option<PathBuf>,
    /// Steps that this command took.
    #[serde(skip)]
    taken: u64,
}

#[derive(Debug, Serialize)]
struct Divergence {
    step: u64,
    particle: Option<u64>,
    cause: String,
    value: Option<f64>,
    message: String,
}

impl Summary {
    /// Reads the session as it ended.
    pub(crate) fn new(scene: String, driven: &Driven, saved: Option<PathBuf>) -> Self {
        let session = &driven.session;
        let last = session.diagnostics.clone().unwrap_or_default();
        let ranks = session.ranks.clone().unwrap_or_default();
        let diverged = session.failure.as_ref().filter(|failure| session::diverged(failure));
        Self {
            scene,
            steps: session.step,
            time: session.time_seconds,
            seconds: session.stepping_seconds,
            state_hash: session.state_hash.map(output::hash),
            energy_at_end: diagnostics::total_energy(&last),
            max_stretch: session.largest_stretch,
            max_stretch_time: session.largest_stretch_seconds,
            external_work_at_end: last.external_work,
            cloth_at_end: last.cloth,
            surface_at_end: last.surface,
            rest_at_end: last.rest,
            snow_at_end: last.snow,
            loads_at_end: last.loads,
            poses_at_end: session.parameters.as_ref().map_or_else(Vec::new, |now| now.collider_poses.clone()),
            notices_over_run: last.notices.unwrap_or_default(),
            diverged: diverged.map(|failure| Divergence {
                step: failure.step,
                particle: failure.particle,
                cause: failure.reason.clone(),
                value: failure.value.filter(|value| value.is_finite()),
                message: failure.message.clone(),
            }),
            interrupted: driven.end == DriveEnd::Interrupted,
            particles: session.particle_count,
            springs: session.spring_count,
            threads: session.thread_count,
            ranks: ranks.rank_count,
            hosts: ranks.hosts,
            messages: ranks.message_count,
            message_bytes: ranks.message_bytes,
            gathers: ranks.gather_count,
            precision: session.precision().word(),
            dt: session.dt_seconds,
            frames: driven.saved.unwrap_or(session.frame + 1),
            saved,
            taken: session.step.saturating_sub(driven.first_step),
        }
    }

    /// Prints it, and gives the command's exit: an error for a run that diverged or was ended.
    ///
    /// # Errors
    /// When the session failed or was interrupted, or standard output cannot be written.
    pub(crate) fn print(&self, driven: &Driven, format: Format) -> Result<()> {
        match format {
            Format::Json => output::json(self)?,
            Format::Text => output::line(&self.text())?,
        }
        if let Some(failure) = session::failure(&driven.session) {
            return Err(failure);
        }
        match driven.end {
            DriveEnd::Session => Ok(()),
            DriveEnd::Interrupted => Err(CliError::new(
                Exit::Interrupted,
                format!("ended by the user at step {}, before its end", self.steps),
            )),
        }
    }

    /// How many ranks, if there are any.
    fn of_ranks(&self) -> String {
        if self.ranks > 0 {
            format!("{} of ", output::several(self.ranks.into(), "rank"))
        } else {
            String::new()
        }
    }

    /// A table of what ran and how fast.
    pub(crate) fn text(&self) -> String {
        let step_seconds = self.seconds / self.taken.max(1) as f64;
        let factor = self.taken as f64 * self.dt / self.seconds.max(f64::MIN_POSITIVE);
        let threads = output::several(self.threads.into(), "thread");
        let mut rows = vec![
            ("scene", self.scene.clone()),
            (
                "particles",
                format!("{}, {}", output::count(self.particles), output::several(self.springs, "spring")),
            ),
            ("steps", format!("{} of {} s", output::count(self.steps), self.dt)),
            ("simulated", output::moment(self.time)),
            (
                "computed in",
                format!("{}, {} per step", output::time(self.seconds), output::time(step_seconds)),
            ),
            ("real-time factor", format!("{factor:.2}")),
            ("with", format!("{}{threads}, {}", self.of_ranks(), self.precision)),
            ("energy at the end", format!("{} J", six_digits(self.energy_at_end))),
        ];

        if self.springs > 0 {
            let moment = output::moment(self.max_stretch_time);
            rows.push(("max stretch", format!("{:.4} over the run, at t = {moment}", self.max_stretch)));
        }
        if let Some(cloth) = &self.cloth_at_end {
            rows.push(("last step of cloth", diagnostics::cloth_steps(cloth)));
        }
        if let Some(surface) = &self.surface_at_end {
            rows.push(("surfaces in the last step", diagnostics::surfaces(surface)));
        }
        if let Some(rest) = &self.rest_at_end {
            rows.push(("at rest", diagnostics::rest(rest)));
        }
        if let Some(snow) = &self.snow_at_end {
            rows.push(("last step of snow", diagnostics::substeps(snow)));
            let state = format!("{}; {}", diagnostics::counts(snow), diagnostics::packing(snow));
            rows.push(("snow at the end", state));
        }
        let doubts = diagnostics::doubts(&self.notices_over_run);
        if !doubts.is_empty() {
            rows.push(("doubtful over the run", doubts));
        }
        if let Some(hash) = &self.state_hash {
            rows.push(("state hash", hash.clone()));
        }
        if let Some(saved) = &self.saved {
            // A picture holds no frames.
            let frames = if paths::is_drawn(saved) {
                String::new()
            } else {
                format!("{} in ", output::several(self.frames, "frame"))
            };
            rows.push(("saved", format!("{frames}{}", saved.display())));
        }

        let rows: Vec<Vec<String>> =
            rows.into_iter().map(|(name, value)| vec![name.to_owned(), value]).collect();
        output::table(&[Column::Left(""), Column::Left("")], &rows).trim_start_matches('\n').to_owned()
    }
}

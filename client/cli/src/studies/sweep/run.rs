//! One run of a sweep, from a scene to its row.

use std::{path::Path, time::Instant};

use nappe_scene::{
    Scene, SceneLimits,
    mesh::{PlyFrame, PlyNumbers, write_ply_frame},
};
use nappe_sim::{field::Field, report::NoStopwatch, world::Simulation};

use super::{
    end::End,
    felt::Felt,
    measure::{self, Bodies, Measure},
    meshes::Meshes,
};
use crate::{
    files::write::{self, Existing},
    studies::study::csv::{known, number, quoted},
    words::{
        error::{CliError, Result},
        output,
    },
};

/// Name of the file in which the end of a run is kept.
pub(crate) fn end_file(run: usize) -> String {
    format!("run-{run:06}.ply")
}

/// What all runs of a sweep have in common.
pub(crate) struct Common {
    pub(crate) meshes: Meshes,
    pub(crate) end: End,
    /// What is measured of each.
    pub(crate) measures: Vec<Measure>,
}

/// What a run came to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ran {
    steps: u64,
    time: f64,
    energy: f64,
    max_stretch: f64,
    /// As many as there are measures; none of what is refused.
    measured: Vec<f64>,
    state_hash: u64,
    outcome: &'static str,
    cause: String,
    seconds: f64,
}

/// Names of the columns after the keys and before the measures: they stay.
pub(crate) const BEFORE: [&str; 4] = ["steps", "time_s", "energy_j", "max_stretch"];
/// Names of the columns after the measures: they stay.
pub(crate) const AFTER: [&str; 4] = ["state_hash", "outcome", "cause", "seconds"];

impl Ran {
    /// Of a scene that cannot be built, and why.
    pub(crate) fn refused(cause: String) -> Self {
        Self { outcome: "refused", cause, ..Self::default() }
    }

    /// What stands in the columns after the keys, with those of so many measures.
    pub(crate) fn fields(&self, measures: usize) -> Vec<String> {
        // A row is a line.
        let cause = self.cause.replace(['\n', '\r'], " ");
        let before =
            [self.steps.to_string(), number(self.time), number(self.energy), number(self.max_stretch)];
        let measured = (0..measures).map(|place| known(self.measured.get(place)));
        let after = [
            output::hash(self.state_hash),
            self.outcome.to_owned(),
            quoted(&cause),
            format!("{:.3}", self.seconds),
        ];
        before.into_iter().chain(measured).chain(after).collect()
    }
}

/// Runs a scene on one thread, and keeps its end where that is asked for. None where it was told to stop.
///
/// # Errors
/// An end that cannot be written. That a scene fails is a result.
pub(crate) fn run(
    scene: &Scene,
    common: &Common,
    end: Option<&Path>,
    is_stopped: &dyn Fn() -> bool,
) -> Result<Option<Ran>> {
    let begin = Instant::now();
    let Ready { mut simulation, bodies, steps } = match ready(scene, common) {
        Ok(ready) => ready,
        Err(cause) => return Ok(Some(Ran::refused(cause))),
    };
    let mut ran = Ran { outcome: "ok", ..Ran::default() };
    let start = simulation.diagnose();
    (ran.energy, ran.max_stretch) = (start.total_energy(), start.max_stretch);
    let mut felt = Felt::default();
    for _ in 0..steps {
        if is_stopped() {
            return Ok(None);
        }
        match simulation.step(&mut NoStopwatch) {
            Ok(report) => {
                ran.energy = report.diagnostics.total_energy();
                ran.max_stretch = ran.max_stretch.max(report.diagnostics.max_stretch);
                felt.add(&report.loads);
            }
            Err(error) => {
                (ran.outcome, ran.cause) = ("failed", error.to_string());
                break;
            }
        }
    }
    (ran.steps, ran.time) = (simulation.step_count(), simulation.time());
    ran.measured = measure::values(&common.measures, &bodies, &felt, &simulation);
    ran.state_hash = simulation.state_hash();
    ran.seconds = begin.elapsed().as_secs_f64();
    if let Some(path) = end {
        keep(&simulation, path)?;
    }
    Ok(Some(ran))
}

/// A run before its first step.
struct Ready {
    simulation: Simulation,
    bodies: Bodies,
    steps: u64,
}

fn ready(scene: &Scene, common: &Common) -> std::result::Result<Ready, String> {
    let steps = common.end.steps(scene)?;
    let built = scene.build(&common.meshes, &SceneLimits::default()).map_err(|error| error.to_string())?;
    let bodies = Bodies::of(&built.setup);
    common.measures.iter().try_for_each(|measure| measure.check(&bodies))?;
    let (mut simulation, _) =
        Simulation::new(&built.setup, scene.precision).map_err(|error| error.to_string())?;
    simulation.apply(&built.initial_changes).map_err(|error| error.to_string())?;
    Ok(Ready { simulation, bodies, steps })
}

/// Refuses measures that a scene does not have. Of one that cannot be built nothing is said: its run is refused.
///
/// # Errors
/// The first of them, with what the scene has.
pub(crate) fn check_measures(scene: &Scene, common: &Common) -> Result<()> {
    if common.measures.is_empty() {
        return Ok(());
    }
    let Ok(built) = scene.build(&common.meshes, &SceneLimits::default()) else { return Ok(()) };
    let bodies = Bodies::of(&built.setup);
    common.measures.iter().try_for_each(|measure| measure.check(&bodies)).map_err(CliError::usage)
}

/// Writes where particles are as a PLY file, in the precision of the simulation.
fn keep(simulation: &Simulation, path: &Path) -> Result<()> {
    let count = Field::Positions.width() * simulation.particle_count();
    let (mut single, mut double): (Vec<f32>, Vec<f64>) = (Vec::new(), Vec::new());
    let positions = match simulation {
        Simulation::F32(_) => {
            single.resize(count, 0.0);
            simulation.read(Field::Positions, &mut single);
            PlyNumbers::F32(&single)
        }
        Simulation::F64(_) => {
            double.resize(count, 0.0);
            simulation.read(Field::Positions, &mut double);
            PlyNumbers::F64(&double)
        }
    };
    let triangles: Vec<[u32; 3]> =
        simulation.topology().into_iter().flat_map(|body| body.triangles).collect();
    let frame = PlyFrame {
        positions,
        properties: &[],
        triangles: &triangles,
        step: simulation.step_count(),
        time: simulation.time(),
        comments: &[],
    };
    let mut bytes = Vec::new();
    write_ply_frame(&frame, &mut bytes).map_err(|error| CliError::file("write", path, &error))?;
    // A run that was cut before its row has left one, which is the sweep's own.
    write::write_whole(path, &bytes, Existing::Overwritten)
}

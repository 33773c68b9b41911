//! One run of a sweep, from a scene to its row.

use std::{io::BufWriter, path::Path, time::Instant};

use nappe_scene::{
    Scene, SceneLimits, files,
    mesh::{PlyFrame, PlyNumbers, write_ply_frame},
};
use nappe_sim::{report::NoStopwatch, world::Simulation};

use crate::{
    error::{CliError, Result},
    output,
    study::files::quoted,
    write::{self, Existing},
};

/// What a run came to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ran {
    steps: u64,
    time: f64,
    energy: f64,
    max_stretch: f64,
    state_hash: u64,
    outcome: &'static str,
    cause: String,
    seconds: f64,
}

/// Names of the columns after the keys: they stay.
pub(crate) const COLUMNS: [&str; 8] =
    ["steps", "time_s", "energy_j", "max_stretch", "state_hash", "outcome", "cause", "seconds"];

impl Ran {
    /// Of a scene that cannot be built, and why.
    pub(crate) fn refused(cause: String) -> Self {
        Self { outcome: "refused", cause, ..Self::default() }
    }

    /// What stands in the columns after the keys.
    pub(crate) fn fields(&self) -> [String; COLUMNS.len()] {
        // A row is a line.
        let cause = self.cause.replace(['\n', '\r'], " ");
        [
            self.steps.to_string(),
            format!("{:?}", self.time),
            format!("{:?}", self.energy),
            format!("{:?}", self.max_stretch),
            output::hash(self.state_hash),
            self.outcome.to_owned(),
            quoted(&cause),
            format!("{:.3}", self.seconds),
        ]
    }
}

/// Runs a scene, whose meshes are in a folder, for so many steps on one thread, and keeps its end where that is asked for. None where
/// it was told to stop.
///
/// # Errors
/// An end that cannot be written. That a scene fails is a result.
pub(crate) fn run(
    scene: &Scene,
    meshes: &Path,
    steps: u64,
    end: Option<&Path>,
    is_stopped: &dyn Fn() -> bool,
) -> Result<Option<Ran>> {
    let begin = Instant::now();
    let mut simulation = match built(scene, meshes) {
        Ok(simulation) => simulation,
        Err(cause) => return Ok(Some(Ran::refused(cause))),
    };
    let mut ran = Ran { outcome: "ok", ..Ran::default() };
    let start = simulation.diagnose();
    (ran.energy, ran.max_stretch) = (start.total_energy(), start.max_stretch);
    for _ in 0..steps {
        if is_stopped() {
            return Ok(None);
        }
        match simulation.step(&mut NoStopwatch) {
            Ok(report) => {
                ran.energy = report.diagnostics.total_energy();
                ran.max_stretch = ran.max_stretch.max(report.diagnostics.max_stretch);
            }
            Err(error) => {
                (ran.outcome, ran.cause) = ("failed", error.to_string());
                break;
            }
        }
    }
    (ran.steps, ran.time) = (simulation.step_count(), simulation.time());
    ran.state_hash = simulation.state_hash();
    ran.seconds = begin.elapsed().as_secs_f64();
    if let Some(path) = end {
        keep(&simulation, path)?;
    }
    Ok(Some(ran))
}

fn built(scene: &Scene, meshes: &Path) -> std::result::Result<Simulation, String> {
    let source = files::Folder { folder: meshes.to_owned(), options: files::ReadOptions::default() };
    let built = scene.build(&source, &SceneLimits::default()).map_err(|error| error.to_string())?;
    let (mut simulation, _) =
        Simulation::new(&built.setup, scene.precision).map_err(|error| error.to_string())?;
    simulation.apply(&built.initial_changes).map_err(|error| error.to_string())?;
    Ok(simulation)
}

/// Writes where particles are as a PLY file, in the precision of the simulation.
fn keep(simulation: &Simulation, path: &Path) -> Result<()> {
    let (mut single, mut double) = (Vec::new(), Vec::new());
    let positions = match simulation {
        Simulation::F32(_) => {
            simulation.positions_f32(&mut single);
            PlyNumbers::F32(&single)
        }
        Simulation::F64(_) => {
            simulation.positions_f64(&mut double);
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
    };
    // A run that was cut before its row has left one, which is the sweep's own.
    let mut file = BufWriter::new(write::create(path, Existing::Overwritten)?);
    write_ply_frame(&frame, &mut file)
        .and_then(|()| std::io::Write::flush(&mut file))
        .map_err(|error| CliError::file("write", path, &error))
}

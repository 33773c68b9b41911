//! A sweep: runs of one scene with other values, side by side, a row per run.
//!
//! Enters: a scene and values of its keys. Leaves: sweep.csv, sweep.json, a picture, the ends of runs where they are kept.

mod part;
mod split;
mod combos;
mod end;
mod felt;
mod measure;
mod meshes;
mod run;
mod description;
pub(crate) mod lock;
mod table;
mod join;
mod picture;

use std::{
    path::{Path, PathBuf},
    sync::{
        atomic::{AtomicUsize, Ordering},
        mpsc,
    },
};

use nappe_scene::Scene;
use nappe_study::Budget;
use rayon::ThreadPoolBuilder;

pub(crate) use self::{
    combos::{Set, combinations},
    description::Description,
    end::End,
    join::Parts,
    measure::{Measure, check_distinct},
    meshes::{Meshes, named, named_by_any},
    part::Part,
    picture::picture_files,
    run::Common,
    table::{Columns, Table},
};
use crate::{
    studies::study::csv::quoted,
    words::error::{CliError, Result},
};

/// What is run.
pub(crate) struct Sweep {
    pub(crate) scene: Scene,
    pub(crate) keys: Vec<String>,
    /// Values of the keys in each run.
    pub(crate) values: Vec<Vec<String>>,
    /// Which of the runs are computed.
    pub(crate) part: Part,
    pub(crate) common: Common,
    /// Where ends of runs are kept, if they are.
    pub(crate) ends: Option<PathBuf>,
}

impl Sweep {
    /// The scene of a run.
    fn scene(&self, run: usize) -> std::result::Result<Scene, String> {
        let values: Vec<(String, String)> =
            self.keys.iter().cloned().zip(self.values[run].iter().cloned()).collect();
        self.scene.with_values(&values).map_err(|error| error.to_string())
    }

    /// Refuses measures that the first run does not have. Where others lack them, their rows say so.
    ///
    /// # Errors
    /// The first of them, with what the scene has.
    pub(crate) fn check_measures(&self) -> Result<()> {
        self.scene(0).map_or(Ok(()), |scene| run::check_measures(&scene, &self.common))
    }

    /// What becomes of a run; none where the sweep was told to stop.
    fn run(&self, run: usize, is_stopped: &dyn Fn() -> bool) -> Result<Option<Vec<String>>> {
        let end = self.ends.as_ref().map(|folder| folder.join(run::end_file(run)));
        let ran = match self.scene(run) {
            Ok(scene) => run::run(&scene, &self.common, end.as_deref(), is_stopped)?,
            Err(cause) => Some(run::Ran::refused(cause)),
        };
        let values = self.values[run].iter().map(|value| quoted(value));
        let measures = self.common.measures.len();
        Ok(ran.map(|ran| values.chain(ran.fields(measures)).collect()))
    }

    /// Runs all that have no row yet, as many side by side as there are threads, each on one, until it is told to stop. `tell` is
    /// called with what is done.
    ///
    /// # Errors
    /// Files that cannot be written, and threads that cannot be started.
    pub(crate) fn go(
        &self,
        table: &mut Table,
        threads: usize,
        budget: &Budget,
        tell: &dyn Fn(&str),
    ) -> Result<()> {
        let is_open = |run: &usize| self.part.has(*run) && !table.has(*run);
        let open: Vec<usize> = (0..self.values.len()).filter(is_open).collect();
        let next = AtomicUsize::new(0);
        let (sender, rows) = mpsc::channel();
        let work = |sender: mpsc::Sender<Result<(usize, Vec<String>)>>| {
            let is_stopped = || budget.is_stopped();
            while let Some(run) = open.get(next.fetch_add(1, Ordering::Relaxed)) {
                let row = match self.run(*run, &is_stopped) {
                    Ok(Some(fields)) => Ok((*run, fields)),
                    Ok(None) => return,
                    Err(error) => Err(error),
                };
                // Nobody reads on after an error.
                if sender.send(row).is_err() {
                    return;
                }
            }
        };
        let ended = std::thread::scope(|scope| {
            for _ in 0..threads.min(open.len()) {
                let sender = sender.clone();
                let refused = |error: &dyn std::fmt::Display| {
                    CliError::failure(format!("cannot start a thread: {error}"))
                };
                let pool =
                    ThreadPoolBuilder::new().num_threads(1).build().map_err(|error| refused(&error))?;
                std::thread::Builder::new()
                    .spawn_scoped(scope, move || pool.install(|| work(sender)))
                    .map_err(|error| refused(&error))?;
            }
            drop(sender);
            for row in rows {
                let (run, fields) = row?;
                table.add(run, &fields)?;
                tell(&format!("{} of {} runs", table.len(), table.runs()));
            }
            Ok(())
        });
        ended.and_then(|()| table.rewrite())
    }
}

/// The folder that meshes of a scene file are in.
pub(crate) fn folder_of(scene: &Path) -> PathBuf {
    scene.parent().unwrap_or(Path::new("")).to_owned()
}

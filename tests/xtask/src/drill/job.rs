//! A job of ranks that a server started: its processes, and what must not be left of it.

use std::{collections::BTreeSet, fs, path::PathBuf};

use crate::watch::descendants;

/// What a server with such jobs is started with; tests in containers run as root.
pub(super) const OPTIONS: [&str; 4] = [
    "--max-ranks",
    "3",
    "--launcher",
    "mpirun --allow-run-as-root -n {ranks} --oversubscribe --bind-to none -x NAPPE_LINK {program}",
];
/// Ranks of a job, as an option says it.
pub(super) const RANKS: &str = "3";
/// Programs of a job.
const LAUNCHER: &str = "mpirun";
const RANK: &str = "nappe-rank";

/// A sheet that hangs at two corners, and never ends.
pub(super) const SCENE: &str = r#"
version = 1
title = "drilled"
dt = 0.005

[[body]]
name = "sheet"
mesh = { grid = [30, 30], spacing = 0.05 }
mass = { particle = 0.01 }
pins = ["top_left", "top_right"]
[body.springs]
stretch = { stiffness = 200.0, damping = 0.01 }
shear = { stiffness = 100.0 }
bend = { stiffness = 20.0 }
"#;

/// A launcher, and what tells the processes of its job from all others.
pub(super) struct Job {
    pub(super) launcher: u32,
    /// The variable that says where its ranks find the server: no process of another job has it.
    link: String,
    /// The folders of its files.
    folders: BTreeSet<PathBuf>,
}

impl Job {
    /// Of the only launcher below a server; none if there is none yet.
    pub(super) fn below(server: u32) -> Option<Self> {
        let launcher = *named(server, LAUNCHER).first()?;
        let variables = variables(launcher);
        let link = variables.iter().find(|variable| variable.starts_with("NAPPE_LINK="))?.clone();
        let values = variables.iter().filter_map(|variable| Some(PathBuf::from(variable.split_once('=')?.1)));
        let is_own = |path: &PathBuf| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("nappe-ranks-"))
        };
        let folders: BTreeSet<PathBuf> = values.filter(is_own).collect();
        (!folders.is_empty()).then_some(Self { launcher, link, folders })
    }

    /// Whether no process and no file of it is left, nor the shell that guards it.
    pub(super) fn is_gone(&self) -> bool {
        let has_folder = |id: u32| {
            let words = words(id);
            self.folders.iter().any(|folder| words.iter().any(|word| *word == folder.to_string_lossy()))
        };
        !processes().any(|id| variables(id).contains(&self.link) || has_folder(id))
            && !self.folders.iter().any(|folder| folder.exists())
    }
}

/// The ranks below a server.
pub(super) fn ranks(server: u32) -> Vec<u32> {
    named(server, RANK)
}

/// Processes below another whose program has this name. One that has ended has no words any more.
fn named(ancestor: u32, program: &str) -> Vec<u32> {
    let is_named = |id: &u32| words(*id).first().is_some_and(|first| first.ends_with(program));
    descendants(ancestor).into_iter().filter(is_named).collect()
}

/// The numbers of all processes.
fn processes() -> impl Iterator<Item = u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten();
    entries.filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
}

/// Program and arguments of a process.
fn words(id: u32) -> Vec<String> {
    parts(id, "cmdline")
}

/// The environment of a process; nothing of one that has ended, or is of somebody else.
fn variables(id: u32) -> Vec<String> {
    parts(id, "environ")
}

fn parts(id: u32, file: &str) -> Vec<String> {
    let bytes = fs::read(format!("/proc/{id}/{file}")).unwrap_or_default();
    String::from_utf8_lossy(&bytes).split('\0').map(str::to_owned).collect()
}

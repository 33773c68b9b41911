//! Ranks that are killed, and sessions, commands and servers that end while ranks step: nothing is left.

use std::{
    collections::BTreeSet,
    fs,
    path::PathBuf,
    process::{Child, Stdio},
    thread,
    time::Duration,
};

use serde_json::Value;

use crate::{
    ranks::{LAUNCHER, has_ranks},
    support::{SMALL_SCENE, Server, command, end_by, folder, until, write_scene},
};

/// Numbers of the processes whose program has this name, below process `root`.
pub(crate) fn processes(root: u32, name: &str) -> Vec<u32> {
    let parent = |id: u32| {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).ok()?;
        let after = stat.rsplit_once(')')?.1;
        let mut words = after.split_whitespace();
        // A zombie is a process no more.
        (words.next()? != "Z").then_some(())?;
        words.next()?.parse::<u32>().ok()
    };
    let is_below = |id: u32| std::iter::successors(Some(id), |id| parent(*id)).any(|id| id == root);
    let is_named = |id: u32| {
        let line = fs::read(format!("/proc/{id}/cmdline")).unwrap_or_default();
        let program = line.split(|byte| *byte == 0).next().unwrap_or_default();
        String::from_utf8_lossy(program).ends_with(name)
    };
    let mut found: Vec<u32> = numbers().filter(|id| is_named(*id) && is_below(*id)).collect();
    found.sort_unstable();
    found
}

/// A launcher, its ranks, and the folders of their files.
pub(crate) struct Job {
    pub(crate) launcher: u32,
    pub(crate) ranks: Vec<u32>,
    /// The variable that says where its ranks find the server: no process of another job has it.
    link: String,
    folders: BTreeSet<PathBuf>,
}

impl Job {
    /// Of a launcher that runs.
    pub(crate) fn of(launcher: u32, ranks: Vec<u32>) -> Self {
        let variables = variables(launcher);
        let link = variables.iter().find(|variable| variable.starts_with("NAPPE_LINK="));
        let link = link.expect("a launcher is told of the link").clone();
        let values = variables.iter().filter_map(|variable| Some(PathBuf::from(variable.split_once('=')?.1)));
        let is_own = |path: &PathBuf| {
            path.file_name().is_some_and(|name| name.to_string_lossy().starts_with("nappe-ranks-"))
        };
        let folders: BTreeSet<PathBuf> = values.filter(is_own).collect();
        assert!(!folders.is_empty(), "its files have no folder of their own: {variables:?}");
        Self { launcher, ranks, link, folders }
    }

    /// Whether there are files in each of its folders.
    fn has_files(&self) -> bool {
        let has_one = |folder: &PathBuf| fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
        self.folders.iter().all(has_one)
    }

    /// Whether no process and no file of it is left.
    pub(crate) fn is_gone(&self) -> bool {
        let mut all = numbers();
        are_gone(&self.ranks)
            && are_gone(&[self.launcher])
            && !all.any(|id| variables(id).contains(&self.link))
            && !self.folders.iter().any(|folder| folder.exists())
    }
}

/// The numbers of all processes.
fn numbers() -> impl Iterator<Item = u32> {
    fs::read_dir("/proc").expect("Linux").filter_map(|entry| entry.ok()?.file_name().to_str()?.parse().ok())
}

/// The environment of a process; nothing of one that has ended, or is of somebody else.
fn variables(id: u32) -> Vec<String> {
    let environment = fs::read(format!("/proc/{id}/environ")).unwrap_or_default();
    String::from_utf8_lossy(&environment).split('\0').map(str::to_owned).collect()
}

/// Whether none of these runs any more.
fn are_gone(ids: &[u32]) -> bool {
    ids.iter().all(|id| {
        let stat = fs::read_to_string(format!("/proc/{id}/stat")).unwrap_or_default();
        stat.rsplit_once(')').is_none_or(|(_, after)| after.trim_start().starts_with('Z'))
    })
}

fn kill(id: u32) {
    send("KILL", id);
}

/// Sends a signal to a process.
pub(crate) fn send(signal: &str, id: u32) {
    let sent = command_of("kill").args([&format!("-{signal}"), &id.to_string()]).status();
    assert!(sent.expect("kill starts").success());
}

fn command_of(program: &str) -> std::process::Command {
    std::process::Command::new(program)
}

/// A server, and a scene that never ends.
struct Place {
    server: Server,
    scene: String,
    _folder: crate::support::Folder,
}

impl Place {
    fn new() -> Self {
        let folder = folder();
        let text = SMALL_SCENE.replace("steps = 40", "steps = 0").replace("[12, 12]", "[30, 30]");
        let scene = write_scene(folder.path(), &text);
        let server = Server::with(&["--launcher", LAUNCHER, "--max-ranks", "3"]);
        Self { server, scene, _folder: folder }
    }

    fn create(&self, id: &str, ranks: &[&str]) {
        self.server.nappe(&[&["create", &self.scene, "--id", id][..], ranks].concat()).ok();
    }

    fn session(&self, id: &str) -> Value {
        let all = self.server.nappe(&["list"]).ok().json();
        let mut all = all.as_array().expect("a list").iter();
        all.find(|session| session["session_id"] == id).expect("it is there").clone()
    }

    /// The only job, whose ranks have started.
    fn job(&self) -> Job {
        let launchers = processes(self.server.id(), "mpirun");
        let ranks = processes(self.server.id(), "nappe-rank");
        assert_eq!((launchers.len(), ranks.len()), (1, 3));
        let job = Job::of(launchers[0], ranks);
        assert!(job.has_files(), "MPI keeps its files elsewhere");
        job
    }

    /// A job that is so old, of a session that is made meanwhile; and who makes it.
    fn young_job(&self, id: &str, age: Duration) -> (Job, Child) {
        let args = ["create", &self.scene, "--id", id, "--ranks", "3", "--server", &self.server.url];
        let mut creates = command();
        creates.args(args).stdout(Stdio::null()).stderr(Stdio::null());
        let creates = creates.spawn().expect("it starts");
        let mut launchers = Vec::new();
        until("a launcher", || {
            launchers = processes(self.server.id(), "mpirun");
            !launchers.is_empty()
        });
        thread::sleep(age);
        (Job::of(launchers[0], processes(self.server.id(), "nappe-rank")), creates)
    }
}

#[test]
fn a_rank_or_a_launcher_that_is_killed_fails_its_session_alone() {
    if !has_ranks() {
        return;
    }
    let place = Place::new();
    place.create("other", &[]);
    place.server.nappe(&["play", "other"]).ok();
    for (number, is_playing) in [(0, true), (1, true), (2, true), (3, true), (1, false), (3, false)] {
        let id = format!("lost-{number}-{is_playing}");
        place.create(&id, &["--ranks", "3"]);
        if is_playing {
            place.server.nappe(&["play", &id]).ok();
            until("some steps", || place.session(&id)["step"].as_u64() > Some(5));
        }
        let job = place.job();
        kill(job.ranks.get(number).copied().unwrap_or(job.launcher));
        until("the session failed", || place.session(&id)["state"] == "failed");
        let failed = place.session(&id);
        assert_eq!(failed["failure"]["reason"], "RANK_LOST", "{failed}");
        until("nothing is left", || job.is_gone());

        let before = place.session("other")["step"].as_u64();
        until("the other goes on", || place.session("other")["step"].as_u64() > before);
        place.server.nappe(&["delete", &id]).ok();
    }
}

#[test]
fn ranks_end_with_their_session_and_with_the_server() {
    if !has_ranks() {
        return;
    }
    let place = Place::new();
    for end in ["stop", "delete"] {
        place.create("first", &["--ranks", "3"]);
        place.server.nappe(&["play", "first"]).ok();
        let job = place.job();
        place.server.nappe(&[end, "first"]).ok();
        until("nothing is left", || job.is_gone());
        if end == "stop" {
            let session = place.session("first");
            assert_eq!(session["state"], "finished");
            assert!(session["state_hash"].is_string(), "{session}");
            place.server.nappe(&["delete", "first"]).ok();
        }
    }
    for signal in ["KILL", "TERM"] {
        let place = Place::new();
        place.create("last", &["--ranks", "3"]);
        place.server.nappe(&["play", "last"]).ok();
        let job = place.job();
        place.server.end_by(signal);
        until("nothing is left", || job.is_gone());
    }
}

#[test]
fn a_job_that_is_killed_while_it_starts_leaves_nothing() {
    if !has_ranks() {
        return;
    }
    let place = Place::new();
    // Ranks take some tenths of a second to start.
    for age in [0, 50, 100, 200, 300, 400, 600] {
        let id = format!("young-{age}");
        let (job, mut creates) = place.young_job(&id, Duration::from_millis(age));
        kill(job.launcher);
        creates.wait().expect("it ends");
        until("nothing is left", || job.is_gone());
        // It is there if it was made in time.
        place.server.nappe(&["delete", &id]);
    }
    for age in [0, 200] {
        let place = Place::new();
        let (job, mut creates) = place.young_job("last", Duration::from_millis(age));
        place.server.end_by("KILL");
        creates.wait().expect("it ends");
        until("nothing is left", || job.is_gone());
    }
}

#[test]
fn ranks_end_with_an_interrupted_run() {
    if !has_ranks() {
        return;
    }
    let place = Place::new();
    let mut run = command()
        .args(["run", &place.scene, "--steps", "100000000", "--ranks", "2", "--launcher", LAUNCHER])
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .spawn()
        .expect("it starts");
    until("ranks run", || processes(run.id(), "nappe-rank").len() == 2);
    let job = Job::of(processes(run.id(), "mpirun")[0], processes(run.id(), "nappe-rank"));
    thread::sleep(Duration::from_millis(300));
    end_by(&mut run, "INT");
    until("nothing is left", || job.is_gone());
}

#[test]
fn a_step_that_takes_long_is_left_when_the_session_is_stopped() {
    if !has_ranks() {
        return;
    }
    let place = Place::new();
    let hard = SMALL_SCENE
        .replace("[12, 12]", "[150, 150]")
        .replace("steps = 40", "steps = 0")
        .replace("dt = 0.005", "dt = 0.5")
        + "[body.solver]\nfixed_iterations = 1000000\npreconditioner = \"identity\"\n";
    let folder = folder();
    let scene = write_scene(folder.path(), &hard);
    place.server.nappe(&["create", &scene, "--id", "long", "--precision", "f64", "--ranks", "3"]).ok();
    place.server.nappe(&["play", "long"]).ok();
    let job = place.job();
    thread::sleep(Duration::from_millis(300));
    let session = place.server.nappe(&["stop", "long"]).ok().json();
    assert_eq!((&session["state"], &session["step"]), (&"finished".into(), &0.into()));
    until("nothing is left", || job.is_gone());
}

//! `cargo xtask drill load [--minutes N]`: four clients and eight watchers, one of them stalled, against a server that was built;
//! at its end memory, threads and descriptors are those of its start, and every state has its hash.
//!
//! Clients are the `nappe` command, a process per call: what they leave behind is what strangers leave.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::{Duration, Instant},
};

use crate::shell::{Failure, Shell};

const CLIENTS: u64 = 4;
const WATCHERS: u32 = 8;
/// Steps whose hash is compared.
const STEPS: &str = "40";
const SCENE: &str = "hanging_sheet";
/// The server gives memory back when nothing has changed for ten seconds.
const SETTLES: Duration = Duration::from_secs(14);
/// What a server may hold at the end beyond its start: what the allocator keeps, and threads and files that come and go.
const MOST_MEMORY_KB: u64 = 100 << 10;
const MOST_OTHERS: u64 = 4;

/// Runs the drill that is named.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    let minutes = match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["load"] => 1.0,
        ["load", "--minutes", minutes] => minutes
            .parse::<f64>()
            .ok()
            .filter(|minutes| (0.1..=600.0).contains(minutes))
            .ok_or_else(|| Failure(format!("--minutes {minutes}: a number from 0.1 to 600 is needed")))?,
        _ => return Err(Failure("a drill is needed: load, or load --minutes N".to_owned())),
    };
    shell.cargo("programs", "build --release --bins")?;
    shell.step("load", |shell| load(&shell.target(), Duration::from_secs_f64(60.0 * minutes)))
}

/// A server, and the command that calls it.
struct Server {
    process: Child,
    nappe: PathBuf,
    folder: PathBuf,
}

/// What a process holds.
#[derive(Clone, Copy, Debug)]
struct Held {
    memory_kb: u64,
    threads: u64,
    descriptors: u64,
}

impl Server {
    fn start(target: &Path) -> Result<Self, Failure> {
        let folder = target.join(format!("drill-{}", std::process::id()));
        fs::create_dir_all(&folder).map_err(|error| Failure(format!("{}: {error}", folder.display())))?;
        let mut command = Command::new(target.join("release/nappe-server"));
        command.arg("--address").arg(format!("unix:{}", folder.join("socket").display()));
        command.arg("--no-token").stdout(Stdio::null()).stderr(Stdio::null());
        let process = command.spawn().map_err(|error| Failure(format!("nappe-server: {error}")))?;
        let server = Self { process, nappe: target.join("release/nappe"), folder };
        let begin = Instant::now();
        while server.call(&["list"]).is_err() {
            if begin.elapsed() > Duration::from_secs(20) {
                return Err(Failure("the server does not answer".to_owned()));
            }
            thread::sleep(Duration::from_millis(50));
        }
        Ok(server)
    }

    fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.nappe);
        command.args(arguments);
        command.env("NAPPE_SERVER", format!("unix:{}", self.folder.join("socket").display()));
        command
    }

    /// What a call says on standard output.
    fn call(&self, arguments: &[&str]) -> Result<String, Failure> {
        let done = self.command(arguments).output().map_err(|error| Failure(format!("nappe: {error}")))?;
        if done.status.success() {
            return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
        }
        let said = String::from_utf8_lossy(&done.stderr);
        Err(Failure(format!("nappe {}: {}", arguments.join(" "), said.trim())))
    }

    fn held(&self) -> Result<Held, Failure> {
        let place = format!("/proc/{}", self.process.id());
        let unread = |error| Failure(format!("{place}: {error}"));
        let status = fs::read_to_string(format!("{place}/status")).map_err(unread)?;
        let number = |name: &str| {
            let line = status.lines().find_map(|line| line.strip_prefix(name));
            line.and_then(|rest| rest.split_whitespace().next()?.parse().ok()).unwrap_or(0)
        };
        let descriptors = fs::read_dir(format!("{place}/fd")).map_err(unread)?.count() as u64;
        Ok(Held { memory_kb: number("VmRSS:"), threads: number("Threads:"), descriptors })
    }

    /// Eight that watch a session, the last of them stopped.
    fn watch(&self, session: &str) -> Result<Vec<Child>, Failure> {
        let watch = |_| {
            let mut command = self.command(&["watch", session, "--rate", "5", "--json"]);
            command.stdout(Stdio::null()).stderr(Stdio::null()).spawn()
        };
        let watchers = (0..WATCHERS).map(watch).collect::<Result<Vec<_>, _>>();
        let watchers = watchers.map_err(|error| Failure(format!("nappe watch: {error}")))?;
        thread::sleep(Duration::from_secs(1));
        if let Some(last) = watchers.last() {
            signal("STOP", last.id());
        }
        Ok(watchers)
    }

    /// Ends it as a service manager does.
    fn end(mut self) -> Result<(), Failure> {
        signal("TERM", self.process.id());
        let begin = Instant::now();
        let ended = loop {
            match self.process.try_wait() {
                Ok(Some(status)) => break Ok(status),
                Ok(None) if begin.elapsed() < Duration::from_mins(1) => {
                    thread::sleep(Duration::from_millis(50));
                }
                _ => break Err(Failure("the server does not end".to_owned())),
            }
        };
        // What is left of a drill that failed is in nobody's way.
        let _ = self.process.kill();
        let _ = fs::remove_dir_all(&self.folder);
        match ended? {
            status if status.success() => Ok(()),
            status => Err(Failure(format!("the server ended with {status}"))),
        }
    }
}

fn signal(name: &str, process: u32) {
    // A process that has ended needs none.
    let _ = Command::new("kill").args([&format!("-{name}"), &process.to_string()]).status();
}

/// The hash in what a command says.
fn hash(said: &str) -> Option<&str> {
    said.split_once("\"state_hash\":\"")?.1.split('"').next()
}

/// What a client does with its sessions once: states are compared with the hash of an ordinary run.
fn round(server: &Server, name: &str, expected: &str) -> Result<(), Failure> {
    let fork = format!("{name}-fork");
    server.call(&["create", SCENE, "--id", name])?;
    let said = server.call(&["step", name, STEPS, "--json"])?;
    if hash(&said) != Some(expected) {
        return Err(Failure(format!("a session has another hash than a run: {said}")));
    }
    server.call(&["fork", name, "--id", &fork])?;
    server.call(&["play", name])?;
    server.call(&["step", &fork, "5"])?;
    server.call(&["pause", name])?;
    server.call(&["stop", &fork])?;
    server.call(&["delete", &fork])?;
    server.call(&["delete", name]).map(drop)
}

fn load(target: &Path, time: Duration) -> Result<(), Failure> {
    let server = Server::start(target)?;
    let drilled = drill(&server, time);
    let ended = server.end();
    drilled.and(ended)
}

fn drill(server: &Server, time: Duration) -> Result<(), Failure> {
    let said = server.call(&["run", SCENE, "--steps", STEPS, "--json"])?;
    let expected = hash(&said).ok_or_else(|| Failure(format!("a run says no hash: {said}")))?.to_owned();
    round(server, "first-round", &expected)?;
    thread::sleep(SETTLES);
    let before = server.held()?;

    server.call(&["create", SCENE, "--id", "watched", "--steps", "1000000000"])?;
    server.call(&["play", "watched"])?;
    let mut watchers = server.watch("watched")?;
    let (end, rounds) = (Instant::now() + time, AtomicU64::new(0));
    let made = thread::scope(|scope| {
        let client = |client: u64| {
            let (rounds, expected) = (&rounds, &expected);
            move || {
                let mut made = 0;
                while Instant::now() < end {
                    round(server, &format!("client-{client}-{made}"), expected)?;
                    made += 1;
                    rounds.fetch_add(1, Ordering::Relaxed);
                }
                Ok(())
            }
        };
        let clients: Vec<_> = (0..CLIENTS).map(|number| scope.spawn(client(number))).collect();
        let ended = clients.into_iter().map(|client| client.join().expect("a client does not panic"));
        ended.collect::<Result<(), Failure>>()
    });
    for watcher in &mut watchers {
        let _ = watcher.kill();
        let _ = watcher.wait();
    }
    made?;
    server.call(&["delete", "watched"])?;
    thread::sleep(SETTLES);
    let after = server.held()?;
    println!("{} rounds of sessions; before: {before:?}, after: {after:?}", rounds.load(Ordering::Relaxed));
    let grew = |before: u64, after: u64, most: u64| after > before + most;
    if grew(before.memory_kb, after.memory_kb, MOST_MEMORY_KB)
        || grew(before.threads, after.threads, MOST_OTHERS)
        || grew(before.descriptors, after.descriptors, MOST_OTHERS)
    {
        return Err(Failure(format!("the server holds more than at its start: {before:?}, then {after:?}")));
    }
    Ok(())
}

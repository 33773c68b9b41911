//! The launcher of ranks: a job in a process group of its own, and the connection that rank 0 makes.
//!
//! Enters: a launcher's text, a program, a link. Leaves: rank 0, or why it did not come; the last lines that the job
//! said.

use std::{
    collections::VecDeque,
    io::{self, BufRead, BufReader, Read as _},
    net::{IpAddr, Ipv4Addr, TcpListener},
    os::unix::process::CommandExt as _,
    path::{Path, PathBuf},
    process::{Child, ChildStderr, Command, Stdio},
    sync::{Arc, Mutex, PoisonError},
    thread,
    time::{Duration, Instant},
};

use nappe_cluster::{LINK, Link, Meeting, Remote, RemoteError, VERSION};
use nappe_sim::interrupt::Interrupt;
use rustix::process::{Pid, Signal, WaitId, WaitIdOptions, kill_process_group, waitid};

use super::remains::Remains;
use crate::{
    config::RankSettings,
    error::{Reason, ServiceError},
    program::find_program,
};

/// How long ranks may take to start.
const START: Duration = Duration::from_secs(30);
/// How long what a job said last may be on its way.
const LAST_WORDS: Duration = Duration::from_millis(100);
/// How often is looked at what cannot be waited for.
pub(super) const TICK: Duration = Duration::from_millis(10);
/// Lines of a job that are kept, and characters of each.
const LINES: usize = 20;
const LINE: usize = 500;
/// Most bytes of a line that are kept for a moment: one without an end takes no more memory.
const LINE_BYTES: u64 = 64 << 10;

/// The option without which Open MPI starts no jobs of root, as it says itself.
const ROOT: &str = "--allow-run-as-root";

/// A launcher and all that it started.
pub(super) struct Job {
    child: Child,
    group: Group,
    guard: Child,
    ranks: u32,
    /// What it may leave behind; none once that is ended.
    remains: Option<Remains>,
    said: Arc<Mutex<VecDeque<String>>>,
    /// The text of the launcher as it starts jobs of root, if it asks for that option.
    for_root: String,
}

/// The process group of a job.
#[derive(Clone, Copy)]
pub(super) struct Group(Pid);

impl Group {
    /// Whether the launcher has ended. It stays a zombie, and the number of its group taken, until the job is dropped.
    pub(super) fn has_ended(self) -> bool {
        let look = WaitIdOptions::EXITED | WaitIdOptions::NOHANG | WaitIdOptions::NOWAIT;
        !matches!(waitid(WaitId::Pid(self.0), look), Ok(None))
    }
}

impl Job {
    /// Starts `ranks` processes of a program.
    ///
    /// # Errors
    /// When there is no such launcher, or no folder can be made for its files.
    pub(super) fn launch(
        settings: &RankSettings,
        program: &Path,
        ranks: u32,
        link: &Link,
    ) -> Result<Self, ServiceError> {
        let words = settings.launcher.split_whitespace().map(|word| {
            word.replace("{ranks}", &ranks.to_string()).replace("{program}", &program.to_string_lossy())
        });
        let words: Vec<String> = words.collect();
        let remains = Remains::new(link)
            .map_err(|error| not_started(&format!("no folder can be made for their files: {error}")))?;
        let mut command = Command::new(&words[0]);
        command.args(&words[1..]).env(LINK, link.to_string()).envs(remains.variables()).process_group(0);
        if std::env::var_os("OMPI_MCA_mpi_yield_when_idle").is_none() {
            // Without it ranks that share a core wait milliseconds for each other.
            command.env("OMPI_MCA_mpi_yield_when_idle", "1");
        }
        command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::piped());
        let unavailable = |error: io::Error| {
            let launcher = &words[0];
            let message = format!(
                "the launcher of ranks, '{launcher}', cannot be started: {error}. mpirun is in the Debian package \
                 openmpi-bin"
            );
            ServiceError::new(Reason::RanksUnavailable, message)
        };
        let mut child = command.spawn().map_err(unavailable)?;
        let group = Group(Pid::from_child(&child));
        let guard = guard(group, &remains).map_err(|error| {
            // Without a guard it would outlive a server that is killed.
            let _ = kill_process_group(group.0, Signal::KILL);
            let _ = child.wait();
            not_started(&format!("no shell (sh) can be started to guard the launcher: {error}"))
        })?;
        let stderr = child.stderr.take();
        // From here on, an error ends the job.
        let (said, for_root) = (Arc::default(), for_root(&settings.launcher));
        let job = Self { child, group, guard, ranks, remains: Some(remains), said, for_root };
        if let Some(stderr) = stderr {
            keep_lines(stderr, Arc::clone(&job.said)).map_err(|error| {
                not_started(&format!("the system starts no thread that reads what they say: {error}"))
            })?;
        }
        Ok(job)
    }

    /// Its process group.
    pub(super) fn group(&self) -> Group {
        self.group
    }

    /// Waits for rank 0.
    ///
    /// # Errors
    /// When it does not come in time, is of another version, or leads another number of ranks; when the job ends, or nobody
    /// wants it any more.
    pub(super) fn meet(&self, mut meeting: Meeting, interrupt: &Interrupt) -> Result<Remote, ServiceError> {
        let begin = Instant::now();
        loop {
            // Asked before the look: who came while this process was stopped is met all the same.
            let is_late = begin.elapsed() > START;
            match meeting.look() {
                Ok(Some(remote)) => return self.counted(remote),
                Ok(None) => thread::sleep(TICK),
                Err(error @ RemoteError::Version { .. }) => {
                    return Err(self.not_started(&format!("{error}, that of the server")));
                }
                Err(error) => return Err(self.not_started(&error)),
            }
            if self.group.has_ended() {
                return Err(self.not_started(&"the launcher ended"));
            }
            if is_late {
                let seconds = START.as_secs();
                return Err(
                    self.not_started(&format!("none of version {VERSION} connected within {seconds} s"))
                );
            }
            if interrupt.is_requested() {
                return Err(not_started(&"nobody waits for them any more"));
            }
        }
    }

    /// The ranks, if there are as many as were asked for.
    fn counted(&self, remote: Remote) -> Result<Remote, ServiceError> {
        let (found, asked) = (remote.hello().hosts.len(), self.ranks);
        if found == asked as usize {
            return Ok(remote);
        }
        let message = format!(
            "the launcher started a job of {found} instead of {asked}. Jobs of 1 are what the launcher of another MPI \
             starts: take that of the MPI with which nappe-rank was built (--launcher), and see that its text hands \
             {{ranks}} on"
        );
        Err(self.not_started(&message))
    }

    /// An error that ends with what the job said last.
    fn not_started(&self, what: &impl std::fmt::Display) -> ServiceError {
        let lines = self.last_lines();
        let hint = if lines.contains(ROOT) {
            format!(". It starts jobs of root with --launcher '{}'", self.for_root)
        } else {
            String::new()
        };
        not_started(&format!("{what}{hint}{lines}"))
    }

    /// What the job said last, as the end of a message.
    pub(super) fn last_lines(&self) -> String {
        thread::sleep(LAST_WORDS);
        let said = self.said.lock().unwrap_or_else(PoisonError::into_inner);
        let lines: Vec<&str> = said.iter().map(String::as_str).collect();
        if lines.is_empty() { String::new() } else { format!(". Its last lines:\n{}", lines.join("\n")) }
    }

    /// Waits for the launcher to end by itself, for so long at most.
    pub(super) fn wait(&self, patience: Duration) {
        let begin = Instant::now();
        while !self.group.has_ended() && begin.elapsed() < patience {
            thread::sleep(TICK);
        }
    }
}

impl Drop for Job {
    /// Ends the launcher and all that it left in its group, then what is left outside of it.
    fn drop(&mut self) {
        // The group may be empty by now, and each process may have ended.
        let _ = kill_process_group(self.group.0, Signal::KILL);
        // While the guard is there, since this process may be killed meanwhile.
        drop(self.remains.take());
        let _ = self.guard.kill();
        let _ = self.guard.wait();
        let _ = self.child.wait();
    }
}

/// Starts a process that ends the job when this one ends without doing so, as when it is killed: its input then closes. A
/// second later, since a launcher whose ranks do not hang ends by itself. What is then in the folders of the job is removed
/// once its processes have ended.
fn guard(Group(group): Group, remains: &Remains) -> io::Result<Child> {
    let group = group.as_raw_pid();
    let script = format!("read -r _; sleep 1; kill -s KILL -- -{group}; sleep 1; rm -rf -- \"$@\"");
    let mut command = Command::new("sh");
    command.args(["-c", &script, "sh"]).args(remains.folders()).process_group(0);
    command.stdin(Stdio::piped()).stdout(Stdio::null()).stderr(Stdio::null()).spawn()
}

/// Keeps the last lines that a job says, in a thread of its own; the log has them too.
///
/// # Errors
/// When the system starts no thread.
fn keep_lines(stderr: ChildStderr, said: Arc<Mutex<VecDeque<String>>>) -> io::Result<()> {
    let body = move || {
        let mut pipe = BufReader::new(stderr);
        while let Ok(Some(line)) = next_line(&mut pipe) {
            let line = String::from_utf8_lossy(&line);
            tracing::debug!("ranks: {line}");
            let mut said = said.lock().unwrap_or_else(PoisonError::into_inner);
            said.push_back(line.chars().take(LINE).collect());
            if said.len() > LINES {
                said.pop_front();
            }
        }
    };
    thread::Builder::new().spawn(body).map(drop)
}

/// The next line of a pipe, as far as [`LINE_BYTES`]; what follows until its end is read and left out. None at the end.
fn next_line(pipe: &mut impl BufRead) -> io::Result<Option<Vec<u8>>> {
    let mut line = Vec::new();
    let read = pipe.by_ref().take(LINE_BYTES).read_until(b'\n', &mut line)?;
    if line.pop_if(|byte| *byte == b'\n').is_none() {
        pipe.skip_until(b'\n')?;
    }
    Ok((read > 0).then_some(line))
}

/// Listens where ranks can reach it: on loopback alone where they are told to look there. The text is where they look.
///
/// # Errors
/// When the system gives no port.
pub(super) fn listen(host: &str) -> io::Result<(TcpListener, String)> {
    let address = host.trim_matches(['[', ']']).parse::<IpAddr>();
    let bound = match address {
        Ok(address) if address.is_loopback() => address,
        Err(_) if host == "localhost" => Ipv4Addr::LOCALHOST.into(),
        Ok(IpAddr::V6(_)) => std::net::Ipv6Addr::UNSPECIFIED.into(),
        _ => Ipv4Addr::UNSPECIFIED.into(),
    };
    let listener = TcpListener::bind((bound, 0))?;
    let port = listener.local_addr()?.port();
    let place = match address {
        Ok(IpAddr::V6(address)) => format!("[{address}]:{port}"),
        _ => format!("{host}:{port}"),
    };
    Ok((listener, place))
}

/// The program that each rank is.
///
/// # Errors
/// When there is none; the message says where it was looked for, and how it is built.
pub(super) fn program(settings: &RankSettings) -> Result<PathBuf, ServiceError> {
    let name = "nappe-rank";
    let found = match &settings.rank_program {
        Some(path) => Some(path.clone()).filter(|path| path.is_file()),
        None => find_program(name),
    };
    found.ok_or_else(|| {
        let missing = settings.rank_program.as_ref().map_or_else(
            || "no nappe-rank stands beside this program or on PATH".to_owned(),
            |path| format!("{} is not there", path.display()),
        );
        let message = format!(
            "{missing}: `cargo ranks` builds it, with the Debian packages libopenmpi-dev, openmpi-bin and libclang-dev"
        );
        ServiceError::new(Reason::RanksUnavailable, message)
    })
}

/// The text of a launcher with the option for root behind its first word.
fn for_root(launcher: &str) -> String {
    let launcher = launcher.trim();
    let (program, rest) = launcher.split_once(char::is_whitespace).unwrap_or((launcher, ""));
    format!("{program} {ROOT} {rest}")
}

/// An error of ranks that did not start.
pub(super) fn not_started(what: &impl std::fmt::Display) -> ServiceError {
    ServiceError::new(Reason::RanksNotStarted, format!("the ranks did not start: {what}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_without_an_end_is_kept_as_far_as_64_kb() {
        let text = format!("first\n\n{}\nlast", "x".repeat(1_000_000));
        let mut pipe = text.as_bytes();
        let mut lengths = Vec::new();
        while let Some(line) = next_line(&mut pipe).expect("it can be read") {
            lengths.push(line.len() as u64);
        }
        assert_eq!(lengths, [5, 0, LINE_BYTES, 4]);
    }
}

//! A server that was built, and the command that calls it.
//!
//! Clients are the `nappe` command, a process per call: what they leave behind is what strangers leave.

use std::{
    env, fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::atomic::{AtomicU32, Ordering},
    thread,
    time::{Duration, Instant},
};

use crate::shell::Failure;

/// How long something may take that comes in a moment where a machine does nothing else.
const PATIENCE: Duration = Duration::from_mins(1);
/// How often is looked whether it has come.
const LOOK: Duration = Duration::from_millis(5);
/// The folder of a server's temporary files, in its own.
const TEMPORARY: &str = "temporary";

/// A server, and the command that calls it. It is killed, and its files are removed, with this value.
pub(super) struct Server {
    process: Child,
    /// The command line that started it.
    command: Command,
    caller: Caller,
    folder: PathBuf,
}

/// The command, as it calls a server.
#[derive(Clone, Debug)]
pub(super) struct Caller {
    nappe: PathBuf,
    address: String,
}

/// What a process holds.
#[derive(Clone, Copy, Debug)]
pub(super) struct Held {
    pub(super) memory_kb: u64,
    pub(super) threads: u64,
    pub(super) descriptors: u64,
}

impl Server {
    /// Starts it with further arguments, in which `{folder}` is its own, and waits until it answers.
    pub(super) fn start(target: &Path, arguments: &[&str]) -> Result<Self, Failure> {
        static COUNT: AtomicU32 = AtomicU32::new(0);
        let number = COUNT.fetch_add(1, Ordering::Relaxed);
        // Paths of sockets are short.
        let folder = env::temp_dir().join(format!("nappe-drill-{}-{number}", std::process::id()));
        let temporary = folder.join(TEMPORARY);
        let made = fs::create_dir_all(&temporary);
        made.map_err(|error| Failure(format!("{}: {error}", temporary.display())))?;

        let mut command = Command::new(target.join("release/nappe-server"));
        let address = format!("unix:{}", folder.join("socket").display());
        let place = folder.display().to_string();
        let arguments = arguments.iter().map(|argument| argument.replace("{folder}", &place));
        command.args(["--address", address.as_str(), "--no-token"]).args(arguments).env("TMPDIR", temporary);
        command.stdout(Stdio::null()).stderr(Stdio::null());
        let process = spawn(&mut command)?;
        let caller = Caller { nappe: target.join("release/nappe"), address };
        let server = Self { process, command, caller, folder };
        server.caller.wait()?;
        Ok(server)
    }

    /// Starts it again after it was killed, and waits until it answers.
    pub(super) fn start_again(&mut self) -> Result<(), Failure> {
        self.process = spawn(&mut self.command)?;
        self.caller.wait()
    }

    /// The command that calls it.
    pub(super) fn caller(&self) -> &Caller {
        &self.caller
    }

    /// The folder of its files, which goes with it.
    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    /// Its number among the processes.
    pub(super) fn id(&self) -> u32 {
        self.process.id()
    }

    /// A call of the command to this server.
    pub(super) fn command(&self, arguments: &[&str]) -> Command {
        self.caller.command(arguments)
    }

    /// What a call says on standard output.
    pub(super) fn call(&self, arguments: &[&str]) -> Result<String, Failure> {
        self.caller.call(arguments)
    }

    /// Writes a scene beside its socket, and gives the path.
    pub(super) fn write_scene(&self, text: &str) -> Result<String, Failure> {
        let path = self.folder.join("scene.toml").display().to_string();
        fs::write(&path, text).map_err(|error| Failure(format!("{path}: {error}")))?;
        Ok(path)
    }

    /// What it holds now.
    pub(super) fn held(&self) -> Result<Held, Failure> {
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

    /// Whether it, and what it started, have left no temporary file.
    pub(super) fn has_left_nothing(&self) -> Result<bool, Failure> {
        let temporary = self.folder.join(TEMPORARY);
        let files = fs::read_dir(&temporary);
        let mut files = files.map_err(|error| Failure(format!("{}: {error}", temporary.display())))?;
        Ok(files.next().is_none())
    }

    /// Kills it, as a power cut would.
    pub(super) fn kill(&mut self) {
        // It may have ended by itself.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }

    /// Ends it as a service manager does.
    pub(super) fn end(mut self) -> Result<(), Failure> {
        signal("TERM", self.process.id());
        let mut ended = None;
        until("the server ends", || {
            let looked = self.process.try_wait();
            ended = looked.map_err(|error| Failure(format!("nappe-server: {error}")))?;
            Ok(ended.is_some())
        })?;
        match ended {
            Some(status) if !status.success() => Err(Failure(format!("the server ended with {status}"))),
            _ => Ok(()),
        }
    }
}

impl Caller {
    /// A call of the command.
    pub(super) fn command(&self, arguments: &[&str]) -> Command {
        let mut command = Command::new(&self.nappe);
        command.args(arguments).env("NAPPE_SERVER", &self.address);
        command
    }

    /// What a call says on standard output.
    pub(super) fn call(&self, arguments: &[&str]) -> Result<String, Failure> {
        let done = self.command(arguments).output().map_err(|error| Failure(format!("nappe: {error}")))?;
        if done.status.success() {
            return Ok(String::from_utf8_lossy(&done.stdout).into_owned());
        }
        let said = String::from_utf8_lossy(&done.stderr);
        Err(Failure(format!("nappe {}: {}", arguments.join(" "), said.trim())))
    }

    /// Waits until the server answers.
    pub(super) fn wait(&self) -> Result<(), Failure> {
        until("the server answers", || Ok(self.call(&["list"]).is_ok()))
    }
}

/// Starts a server.
fn spawn(command: &mut Command) -> Result<Child, Failure> {
    command.spawn().map_err(|error| Failure(format!("nappe-server: {error}")))
}

impl Drop for Server {
    fn drop(&mut self) {
        self.kill();
        // What cannot be removed is in nobody's way.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// Waits until something holds.
///
/// # Errors
/// When it does not hold within a minute, or cannot be looked at.
pub(super) fn until(what: &str, mut is_so: impl FnMut() -> Result<bool, Failure>) -> Result<(), Failure> {
    let begin = Instant::now();
    while !is_so()? {
        if begin.elapsed() > PATIENCE {
            return Err(Failure(format!("not within {} s: {what}", PATIENCE.as_secs())));
        }
        thread::sleep(LOOK);
    }
    Ok(())
}

/// Sends a signal to a process.
pub(super) fn signal(name: &str, process: u32) {
    // A process that has ended needs none.
    let _ = Command::new("kill").args([&format!("-{name}"), &process.to_string()]).status();
}

/// The hash in what a command says.
pub(crate) fn hash(said: &str) -> Option<&str> {
    said.split_once("\"state_hash\":\"")?.1.split('"').next()
}

/// The steps that the first session in what a command says has taken.
pub(super) fn step(said: &str) -> Option<u64> {
    number(said, "step")
}

/// The first number of a name in what a command says.
pub(super) fn number(said: &str, name: &str) -> Option<u64> {
    let (_, rest) = said.split_once(&format!("\"{name}\":"))?;
    rest.split(|c: char| !c.is_ascii_digit()).next()?.parse().ok()
}

#[test]
fn hash_and_steps_are_read_from_what_a_command_says() {
    let said = r#"[{"session_id":"a","failure":null,"step":42,"state_hash":"00ff","steps":7}]"#;
    assert_eq!((hash(said), step(said)), (Some("00ff"), Some(42)));
    assert_eq!((hash("[]"), step("[]")), (None, None));
    assert_eq!((number(said, "steps"), number(said, "frame")), (Some(7), None));
}

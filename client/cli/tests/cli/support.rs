//! Runs the built command and reads what it says.

use std::{
    fs,
    io::{BufRead as _, BufReader, Read},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        atomic::{AtomicU32, Ordering},
        mpsc,
    },
    thread,
    time::{Duration, Instant},
};

use serde_json::Value;

/// Whatever takes this long hangs, unless it computes.
pub(crate) const PATIENCE: Duration = Duration::from_mins(1);
/// What computes, on a machine that is busy.
const LONG: Duration = Duration::from_mins(5);

/// Waits until something is so, however busy the machine is.
#[track_caller]
pub(crate) fn until(what: &str, is_so: impl FnMut() -> bool) {
    assert!(within(PATIENCE, is_so), "not within a minute: {what}");
}

fn within(time: Duration, mut is_so: impl FnMut() -> bool) -> bool {
    let begin = Instant::now();
    loop {
        if is_so() {
            return true;
        }
        if begin.elapsed() > time {
            return false;
        }
        thread::sleep(Duration::from_millis(5));
    }
}

/// Lines of a pipe, as they come.
pub(crate) struct Lines(mpsc::Receiver<String>);

impl Lines {
    pub(crate) fn of(pipe: impl Read + Send + 'static) -> Self {
        let (said, lines) = mpsc::channel();
        thread::spawn(move || {
            // Until the program ends, or nobody listens any more.
            for line in BufReader::new(pipe).lines().map_while(Result::ok) {
                if said.send(line).is_err() {
                    return;
                }
            }
        });
        Self(lines)
    }

    /// The next line; none at the end.
    pub(crate) fn next(&self) -> Option<String> {
        match self.0.recv_timeout(PATIENCE) {
            Ok(line) => Some(line),
            Err(mpsc::RecvTimeoutError::Disconnected) => None,
            Err(mpsc::RecvTimeoutError::Timeout) => panic!("nothing is said for a minute"),
        }
    }

    /// The next line that has a part.
    pub(crate) fn with(&self, part: &str) -> String {
        let mut before = String::new();
        while let Some(line) = self.next() {
            if line.contains(part) {
                return line;
            }
            before = before + &line + "\n";
        }
        panic!("'{part}' is missing in: {before}");
    }

    /// All that follow, until the end.
    pub(crate) fn rest(&self) -> Vec<String> {
        std::iter::from_fn(|| self.next()).collect()
    }
}

/// How a command ended.
#[derive(Debug)]
pub(crate) struct Done {
    pub(crate) code: Option<i32>,
    pub(crate) stdout: String,
    pub(crate) stderr: String,
}

impl Done {
    /// The JSON value on the last line of standard output.
    pub(crate) fn json(&self) -> Value {
        let line = self.stdout.lines().last().unwrap_or_default();
        serde_json::from_str(line)
            .unwrap_or_else(|error| panic!("no JSON on the last line ({error}): {self:?}"))
    }

    /// The same command, which must have ended well.
    #[track_caller]
    pub(crate) fn ok(self) -> Self {
        assert_eq!(self.code, Some(0), "{self:?}");
        self
    }
}

/// The command, with the environment of the test but no server or viewer named in it.
pub(crate) fn command() -> Command {
    command_at(Path::new(env!("CARGO_BIN_EXE_nappe")))
}

/// The command in another place, with the same environment.
pub(crate) fn command_at(path: &Path) -> Command {
    let mut command = Command::new(path);
    for variable in ["NAPPE_SERVER", "NAPPE_TOKEN_FILE", "NAPPE_VIEWER", "NAPPE_BROWSER"] {
        command.env_remove(variable);
    }
    command.stdin(Stdio::null());
    command
}

/// Runs the command in a folder to its end.
pub(crate) fn nappe_in(folder: &Path, args: &[&str]) -> Done {
    run_to_end(command().current_dir(folder).args(args))
}

/// Runs a command to its end.
pub(crate) fn run_to_end(command: &mut Command) -> Done {
    let mut process =
        command.stdout(Stdio::piped()).stderr(Stdio::piped()).spawn().expect("the command starts");
    let stdout = whole(process.stdout.take().expect("a pipe"));
    let stderr = whole(process.stderr.take().expect("a pipe"));
    let ended = within(LONG, || process.try_wait().expect("it can be asked").is_some());
    if !ended {
        // What it said is read all the same.
        let _ = process.kill();
    }
    let status = process.wait().expect("it ends");
    let [stdout, stderr] = [stdout, stderr].map(|text| text.join().expect("UTF-8"));
    let done = Done { code: status.code(), stdout, stderr };
    assert!(ended, "{command:?} does not end: {done:?}");
    done
}

/// Reads a pipe to its end, in a thread.
fn whole(mut pipe: impl Read + Send + 'static) -> thread::JoinHandle<String> {
    thread::spawn(move || {
        let mut text = String::new();
        pipe.read_to_string(&mut text).expect("it is UTF-8");
        text
    })
}

/// Runs the command to its end.
pub(crate) fn nappe(args: &[&str]) -> Done {
    nappe_in(&std::env::temp_dir(), args)
}

/// A folder that goes away. (The crate `tempfile` would do, but asks for features that the command
/// does not: every crate below it would be built twice.)
#[derive(Debug)]
pub(crate) struct Folder(PathBuf);

impl Folder {
    pub(crate) fn path(&self) -> &Path {
        &self.0
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // What cannot be removed stays below the build's folder, in nobody's way.
        let _ = fs::remove_dir_all(&self.0);
    }
}

/// A new, empty folder.
pub(crate) fn folder() -> Folder {
    static COUNT: AtomicU32 = AtomicU32::new(0);
    let number = COUNT.fetch_add(1, Ordering::Relaxed);
    let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("cli-{}-{number}", std::process::id()));
    fs::create_dir_all(&path).expect("a temporary folder");
    Folder(path)
}

/// The course's data, or `None` with a message where they are not.
pub(crate) fn course() -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../../shared/course");
    if path.join("data").is_dir() {
        return Some(path);
    }
    skipped("the course's data are not in ../shared/course");
    None
}

#[allow(clippy::print_stderr, reason = "a test that does nothing says so")]
pub(crate) fn skipped(why: &str) {
    eprintln!("skipped: {why}");
}

/// A server in a process of its own; it is killed when the test ends.
pub(crate) struct Server {
    process: Child,
    pub(crate) url: String,
    /// Where it left its token.
    pub(crate) token_file: Option<String>,
}

impl Server {
    pub(crate) fn start() -> Self {
        Self::with(&[])
    }

    /// A server with these options.
    pub(crate) fn with(options: &[&str]) -> Self {
        Self::begin(options, Stdio::null())
    }

    /// A server whose log goes to a file.
    pub(crate) fn logging(options: &[&str], log: &Path) -> Self {
        Self::begin(options, fs::File::create(log).expect("the log is made").into())
    }

    /// A server with the environment of a login, whose token a session of ssh finds.
    pub(crate) fn plain(options: &[&str]) -> Self {
        let mut server = command();
        server.env_remove("XDG_RUNTIME_DIR").env_remove("TMPDIR");
        Self::spawn(server, options, Stdio::null())
    }

    /// A server that was told to outlive its terminal.
    pub(crate) fn by_nohup() -> Self {
        let nappe = command();
        let mut server = Command::new("nohup");
        server.arg(nappe.get_program()).stdin(Stdio::null());
        for (variable, _removed) in nappe.get_envs() {
            server.env_remove(variable);
        }
        Self::spawn(server, &[], Stdio::null())
    }

    /// A server whose log goes somewhere else.
    pub(crate) fn begin(options: &[&str], log: Stdio) -> Self {
        Self::spawn(command(), options, log)
    }

    fn spawn(mut server: Command, options: &[&str], log: Stdio) -> Self {
        server.args(["serve", "--json"]);
        if !options.contains(&"--address") {
            server.args(["--address", "127.0.0.1:0"]);
        }
        server.args(options).stdout(Stdio::piped()).stderr(log);
        let mut process = server.spawn().expect("the server starts");
        let stdout = process.stdout.take().expect("its standard output is a pipe");
        let line = Lines::of(stdout).next().expect("it says where it listens");
        let said: Value = serde_json::from_str(&line).expect("it says so in JSON");
        let url = said["url"].as_str().expect("the address is a text").to_owned();
        let token_file = said["token_file"].as_str().map(str::to_owned);
        Self { process, url, token_file }
    }

    /// Its number among the processes.
    pub(crate) fn id(&self) -> u32 {
        self.process.id()
    }

    /// Runs a verb against this server.
    pub(crate) fn nappe(&self, args: &[&str]) -> Done {
        nappe(&[args, &["--server", &self.url, "--json"]].concat())
    }

    /// Sends a signal and does not wait.
    pub(crate) fn signal(&self, signal: &str) {
        send(&self.process, signal);
    }

    /// Sends a signal; returns the code with which the process ended.
    pub(crate) fn end_by(mut self, signal: &str) -> Option<i32> {
        end_by(&mut self.process, signal)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended already; then there is nothing to kill.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Sends a signal to a process.
fn send(process: &Child, signal: &str) {
    let status = Command::new("kill")
        .args([&format!("-{signal}"), &process.id().to_string()])
        .status()
        .expect("the signal is sent");
    assert!(status.success());
}

/// Whether programs that are started here hear of a terminal that closes: not where the tests were started by nohup, whose
/// wish they follow. Says so then.
pub(crate) fn hears_of_hangups() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let ignored = status.lines().find_map(|line| line.strip_prefix("SigIgn:"));
    let ignored = ignored.and_then(|mask| u64::from_str_radix(mask.trim(), 16).ok()).unwrap_or(0);
    let hears = ignored & 1 == 0;
    if !hears {
        skipped("SIGHUP is ignored, as nohup has it");
    }
    hears
}

/// Sends a signal to a process and waits up to a minute for its end.
pub(crate) fn end_by(process: &mut Child, signal: &str) -> Option<i32> {
    send(process, signal);
    let mut ended = None;
    until(&format!("the end of the process after SIG{signal}"), || {
        ended = process.try_wait().expect("the process can be asked");
        ended.is_some()
    });
    ended.and_then(|status| status.code())
}

/// A scene small enough for a test: a sheet of 12 x 12 particles held at two corners.
pub(crate) const SMALL_SCENE: &str = r#"
version = 1
title = "small"
dt = 0.005
steps = 40
frame_interval = 2

[[body]]
name = "sheet"
mesh = { grid = [12, 12], spacing = 0.05 }
mass = { particle = 0.01 }
pins = ["top_left", "top_right"]
[body.springs]
stretch = { stiffness = 200.0, damping = 0.01 }
shear = { stiffness = 100.0 }
bend = { stiffness = 20.0 }
"#;

/// Writes a scene into a folder and gives its path.
pub(crate) fn write_scene(folder: &Path, text: &str) -> String {
    let path = folder.join("scene.toml");
    std::fs::write(&path, text).expect("the scene is written");
    path.to_str().expect("a temporary path is UTF-8").to_owned()
}

/// Files of a folder are written, pictures among them in their formats, with words for those who do not see them.
pub(crate) fn check_pictures(folder: &Path, files: &[&str]) {
    for file in files {
        let bytes = std::fs::read(folder.join(file)).expect("it is written");
        match file.rsplit('.').next() {
            Some("svg") => {
                let text = String::from_utf8(bytes).expect("a text");
                assert!(text.contains("<title>") && text.contains("<desc>"), "{file}");
            }
            Some("png") => assert!(bytes.starts_with(b"\x89PNG"), "{file}"),
            _ => {}
        }
    }
}

/// A study refuses a folder that holds one of the files of another, before anything is computed.
pub(crate) fn check_kept(folder: &Path, files: &[&str], args: &[&str]) {
    for (number, file) in files.iter().filter_map(|file| file.strip_prefix("out/")).enumerate() {
        let out = format!("taken-{number}");
        fs::create_dir(folder.join(&out)).expect("a folder");
        fs::write(folder.join(&out).join(file), "kept").expect("a file");
        let done = nappe_in(folder, &[args, &["--out", &out]].concat());
        assert_eq!(done.code, Some(1), "{file}: {done:?}");
        let part = format!("{out}/{file} is there already: --force overwrites it");
        assert!(done.stderr.contains(&part), "{}", done.stderr);
    }
}

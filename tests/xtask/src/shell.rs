//! Runs commands at the repository's root and remembers how long each took.

use std::{
    env,
    error::Error,
    ffi::OsString,
    fmt,
    path::{Path, PathBuf},
    process::Command,
    time::{Duration, Instant},
};

/// A command that could not be started or did not succeed, or a task asked for the wrong way.
#[derive(Debug)]
pub(crate) struct Failure(pub(crate) String);

impl fmt::Display for Failure {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

impl Error for Failure {}

/// Runs commands one after the other.
#[derive(Debug)]
pub(crate) struct Shell {
    root: PathBuf,
    ran: Vec<(String, Result<Duration, String>)>,
}

impl Shell {
    /// A shell whose commands run at the root of the repository.
    pub(crate) fn at_repository_root() -> Self {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = here.ancestors().nth(2).expect("this crate stands two folders below the root");
        Self { root: root.to_path_buf(), ran: Vec::new() }
    }

    /// Where built programs and installed tools are kept.
    pub(crate) fn target(&self) -> PathBuf {
        env::var_os("CARGO_TARGET_DIR").map_or_else(|| self.root.join("target"), |dir| self.root.join(dir))
    }

    /// Runs cargo with `arguments`, separated by blanks.
    ///
    /// # Errors
    /// When it does not succeed.
    pub(crate) fn cargo(&mut self, title: &str, arguments: &str) -> Result<(), Failure> {
        self.run(title, Command::new(cargo()).args(arguments.split_whitespace()))
    }

    /// Takes out of a command's environment what cargo told us of this crate.
    pub(crate) fn forget_this_crate(command: &mut Command) {
        for (name, _) in env::vars_os() {
            let told = name
                .to_str()
                .is_some_and(|n| n.starts_with("CARGO_PKG_") || n.starts_with("CARGO_MANIFEST_"));
            if told {
                command.env_remove(name);
            }
        }
    }

    /// The root of the repository.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Runs `command` at the root, its output going where ours goes.
    ///
    /// # Errors
    /// When it cannot be started or does not succeed.
    pub(crate) fn run(&mut self, title: &str, command: &mut Command) -> Result<(), Failure> {
        println!("\n=== {title}: {}", line_of(command));
        // What cargo told us of this crate is not for the crates below: some build scripts watch these
        // variables, and everything above them would be built again at the next cargo outside.
        Self::forget_this_crate(command);
        let start = Instant::now();
        let status = command.current_dir(&self.root).status();
        let outcome = match status {
            Ok(status) if status.success() => Ok(start.elapsed()),
            Ok(status) => Err(format!("{title} failed ({status}): {}", line_of(command))),
            Err(error) => Err(format!("{title}: cannot start {}: {error}", line_of(command))),
        };
        let (row, result) = match outcome {
            Ok(time) => (Ok(time), Ok(())),
            Err(reason) => (Err("failed".to_owned()), Err(Failure(reason))),
        };
        self.ran.push((title.to_owned(), row));
        result
    }

    /// Notes that a step was left out, and why.
    pub(crate) fn skip(&mut self, title: &str, reason: &str) {
        println!("\n=== {title}: skipped: {reason}");
        self.ran.push((title.to_owned(), Err(format!("skipped: {reason}"))));
    }

    /// The path of `program`, if it is installed: among the project's own tools first, then on PATH.
    pub(crate) fn find(&self, program: &str) -> Option<PathBuf> {
        let tools = self.target().join("tools");
        let own = [tools.join("node_modules/.bin"), tools.join("python/bin")];
        let path = env::var_os("PATH").unwrap_or_default();
        own.into_iter()
            .chain(env::split_paths(&path))
            .map(|dir| dir.join(program))
            .find(|file| file.is_file())
    }

    /// What ran, a line each.
    pub(crate) fn table(&self) -> String {
        let width = self.ran.iter().map(|(title, _)| title.chars().count()).max().unwrap_or(0);
        let outcome = |outcome: &Result<Duration, String>| match outcome {
            Ok(time) => format!("{:>7.1} s", time.as_secs_f64()),
            Err(reason) => format!("  {reason}"),
        };
        let line = |(title, result): &(String, _)| format!("\n{title:<width$} {}", outcome(result));
        self.ran.iter().map(line).collect::<Vec<_>>().concat()
    }
}

/// The cargo that runs us, or the one on PATH.
pub(crate) fn cargo() -> OsString {
    env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

fn line_of(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words = std::iter::once(program).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

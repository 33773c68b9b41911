//! Runs commands at the repository's root, says beforehand which, and remembers how long each took.

use std::{
    env,
    error::Error,
    ffi::OsString,
    fmt, io,
    path::{Path, PathBuf},
    process::{Command, Stdio},
    time::Duration,
};

use crate::{
    spent::{Spent, Start},
    times::Times,
    watch::{self, Ending},
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

/// What became of a step.
#[derive(Debug)]
enum Outcome {
    /// It will run, or runs.
    Planned,
    Took(Spent),
    Failed,
    Skipped(String),
}

/// A step: how deep it lies in others, its title, and what became of it.
#[derive(Debug)]
struct Row {
    depth: usize,
    title: String,
    outcome: Outcome,
}

/// Runs the steps of a task, or only lists them.
#[derive(Debug)]
pub(crate) struct Shell {
    root: PathBuf,
    rows: Vec<Row>,
    depth: usize,
    planning: bool,
}

impl Shell {
    /// A shell whose commands run at the root of the repository.
    pub(crate) fn at_repository_root() -> Self {
        let here = Path::new(env!("CARGO_MANIFEST_DIR"));
        let root = here.ancestors().nth(2).expect("this crate stands two folders below the root");
        Self { root: root.to_path_buf(), rows: Vec::new(), depth: 0, planning: false }
    }

    /// The same, but steps are listed and not taken.
    pub(crate) fn for_planning() -> Self {
        Self { planning: true, ..Self::at_repository_root() }
    }

    /// The root of the repository.
    pub(crate) fn root(&self) -> &Path {
        &self.root
    }

    /// Where built programs and installed tools are kept.
    pub(crate) fn target(&self) -> PathBuf {
        env::var_os("CARGO_TARGET_DIR").map_or_else(|| self.root.join("target"), |dir| self.root.join(dir))
    }

    /// Takes a step that is more than one command. All that a task does stands in a step or a command:
    /// a plan is made by calling the task with a shell that takes none.
    ///
    /// # Errors
    /// What `work` fails with.
    pub(crate) fn step(
        &mut self,
        title: &str,
        work: impl FnOnce(&mut Self) -> Result<(), Failure>,
    ) -> Result<(), Failure> {
        let row = self.rows.len();
        self.rows.push(Row { depth: self.depth, title: title.to_owned(), outcome: Outcome::Planned });
        if self.planning {
            return Ok(());
        }
        let start = Start::now();
        self.depth += 1;
        let result = work(self);
        self.depth -= 1;
        self.rows[row].outcome = if result.is_ok() { Outcome::Took(start.spent()) } else { Outcome::Failed };
        result
    }

    /// Runs cargo with `arguments`, separated by blanks.
    ///
    /// # Errors
    /// When it does not succeed.
    pub(crate) fn cargo(&mut self, title: &str, arguments: &str) -> Result<(), Failure> {
        self.run(title, Command::new(cargo()).args(arguments.split_whitespace()))
    }

    /// Runs `command`, at the root unless it names a folder, its output going where ours goes.
    ///
    /// # Errors
    /// When it cannot be started or does not succeed.
    pub(crate) fn run(&mut self, title: &str, command: &mut Command) -> Result<(), Failure> {
        self.waited_for(title, command, |command| command.status().map(Ending::Done))
    }

    /// Runs a program of tests in the same way, and ends it once no test has begun or ended for `patience`.
    ///
    /// # Errors
    /// When it cannot be started, does not succeed or was ended.
    pub(crate) fn watched(
        &mut self,
        title: &str,
        command: &mut Command,
        patience: Duration,
    ) -> Result<(), Failure> {
        self.waited_for(title, command, |command| watch::run(command, patience))
    }

    fn waited_for(
        &mut self,
        title: &str,
        command: &mut Command,
        wait: impl FnOnce(&mut Command) -> io::Result<Ending>,
    ) -> Result<(), Failure> {
        self.step(title, |shell| {
            println!("\n=== {title}: {}", line_of(command));
            // What cargo told us of this crate is not for the crates below: some build scripts watch these
            // variables, and everything above them would be built again at the next cargo outside.
            Self::forget_this_crate(command);
            if command.get_current_dir().is_none() {
                command.current_dir(&shell.root);
            }
            match wait(command) {
                Ok(Ending::Done(status)) if status.success() => Ok(()),
                Ok(Ending::Done(status)) => {
                    Err(Failure(format!("{title} failed ({status}): {}", line_of(command))))
                }
                Ok(Ending::Stalled(reason)) => Err(Failure(format!("{title} was ended: {reason}"))),
                Err(error) => {
                    Err(Failure(format!("{title}: {} cannot be started: {error}", line_of(command))))
                }
            }
        })
    }

    /// What `command` prints, at the root unless it names a folder.
    ///
    /// # Errors
    /// When it cannot be started or does not succeed; what it says on standard error is told.
    pub(crate) fn printed(&self, command: &mut Command) -> Result<String, Failure> {
        Self::forget_this_crate(command);
        if command.get_current_dir().is_none() {
            command.current_dir(&self.root);
        }
        let output =
            command.output().map_err(|error| Failure(format!("{command:?} cannot be started: {error}")))?;
        if !output.status.success() {
            return Err(Failure(format!("{command:?}: {}", String::from_utf8_lossy(&output.stderr))));
        }
        Ok(String::from_utf8_lossy(&output.stdout).into_owned())
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

    /// Notes that a step is left out, and why. The last lines of the task list it.
    pub(crate) fn skip(&mut self, title: &str, reason: &str) {
        if !self.planning {
            println!("\n=== {title}: skipped: {reason}");
        }
        let outcome = Outcome::Skipped(reason.to_owned());
        self.rows.push(Row { depth: self.depth, title: title.to_owned(), outcome });
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

    /// A Python that has these modules, their names apart by commas.
    pub(crate) fn python_with(&self, modules: &str) -> Option<PathBuf> {
        let python = self.find("python3")?;
        let mut imports = Command::new(&python);
        imports.args(["-c", &format!("import {modules}")]).stderr(Stdio::null());
        imports.status().is_ok_and(|status| status.success()).then_some(python)
    }

    /// What will run and how long each step took the last time, or when the tree was measured, a line each, and the sum.
    pub(crate) fn plan(&self, times: &Times, measured: &Times) -> String {
        let known = |row: &Row| times.of(&row.title).or(measured.of(&row.title));
        let told = |row: &Row| match (&row.outcome, times.of(&row.title), measured.of(&row.title)) {
            (Outcome::Skipped(reason), ..) => format!("skipped: {reason}"),
            (_, Some(spent), _) => format!("{} the last time", seconds(spent)),
            (_, None, Some(spent)) => {
                format!("{} when the tree was measured on such a processor", seconds(spent))
            }
            (_, None, None) => "not run here yet".to_owned(),
        };
        let sum = self.rows.iter().filter_map(known).fold(Spent::default(), added);
        format!("{}\n  in all {}", self.lines(self.rows.iter(), told), seconds(sum))
    }

    /// The titles of the steps that lie in no other.
    pub(crate) fn titles(&self) -> Vec<String> {
        self.rows.iter().filter(|row| row.depth == 0).map(|row| row.title.clone()).collect()
    }

    /// What ran, a line each, and the sum.
    pub(crate) fn table(&self) -> String {
        let told = |row: &Row| match &row.outcome {
            Outcome::Took(spent) => seconds(*spent),
            Outcome::Failed => "failed".to_owned(),
            Outcome::Skipped(reason) => format!("skipped: {reason}"),
            Outcome::Planned => "not run".to_owned(),
        };
        let of_all = self.rows.iter().filter(|row| row.depth == 0).filter_map(|row| match row.outcome {
            Outcome::Took(spent) => Some(spent),
            _ => None,
        });
        let sum = of_all.fold(Spent::default(), added);
        format!("{}\n  in all {}", self.lines(self.rows.iter(), told), seconds(sum))
    }

    /// What was not checked, and why, a line each.
    pub(crate) fn skipped(&self) -> Vec<String> {
        let line = |row: &Row| match &row.outcome {
            Outcome::Skipped(reason) => Some(format!("{}: {reason}", row.title)),
            _ => None,
        };
        self.rows.iter().filter_map(line).collect()
    }

    /// Title and seconds of every step that succeeded.
    pub(crate) fn took(&self) -> impl Iterator<Item = (&str, Spent)> {
        self.rows.iter().filter_map(|row| match row.outcome {
            Outcome::Took(spent) => Some((row.title.as_str(), spent)),
            _ => None,
        })
    }

    fn lines<'a>(&self, rows: impl Iterator<Item = &'a Row>, told: impl Fn(&Row) -> String) -> String {
        let title = |row: &Row| format!("{}{}", "  ".repeat(row.depth), row.title);
        let width = self.rows.iter().map(|row| title(row).chars().count()).max().unwrap_or(0);
        let line = |row| format!("\n  {:<width$}  {}", title(row), told(row));
        rows.map(line).collect::<Vec<_>>().concat()
    }
}

/// The cargo that runs us, or the one on PATH.
pub(crate) fn cargo() -> OsString {
    env::var_os("CARGO").unwrap_or_else(|| "cargo".into())
}

/// Seconds by the clock and of all processors, in columns.
fn seconds(spent: Spent) -> String {
    format!("{:>7.1} s, {:>7.1} processor seconds", spent.wall, spent.processor)
}

fn added(a: Spent, b: Spent) -> Spent {
    Spent { wall: a.wall + b.wall, processor: a.processor + b.processor }
}

fn line_of(command: &Command) -> String {
    let program = Path::new(command.get_program()).file_name().unwrap_or(command.get_program());
    let words = std::iter::once(program).chain(command.get_args());
    words.map(|word| word.to_string_lossy()).collect::<Vec<_>>().join(" ")
}

#[test]
fn a_plan_lists_every_step_and_takes_none() {
    let task = |shell: &mut Shell| {
        shell.cargo("no such command", "no-such-command")?;
        shell.skip("contract", "buf is not installed");
        shell.step("inner", |_| Err(Failure("taken".to_owned())))
    };
    let mut shell = Shell::for_planning();
    assert!(task(&mut shell).is_ok());
    let plan = shell.plan(&Times::default(), &Times::default());
    assert_eq!(plan.lines().filter(|line| !line.is_empty()).count(), 4, "{plan}");
    assert_eq!(shell.skipped(), ["contract: buf is not installed"]);
    assert_eq!(shell.took().count(), 0);
}

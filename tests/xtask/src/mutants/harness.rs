//! The copy with all mutants in it: built once, its tests run for one mutant at a time.

use std::{
    collections::BTreeMap,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
    process::{Command, ExitStatus},
    thread,
    time::{Duration, Instant},
};

use super::suite::{SUITES, Suite};
use crate::{
    copy::{Copy, cargo_in},
    shell::{Failure, Shell},
};

/// What the numerics of the copy are asked.
const SWITCH: &str = r#"
/// The mutant that is on: 0 for none.
static MUTANT: std::sync::OnceLock<u32> = std::sync::OnceLock::new();

/// Whether a mutant is on.
pub(crate) fn mutant(number: u32) -> bool {
    let read = || std::env::var("NAPPE_MUTANT").ok().and_then(|n| n.parse().ok()).unwrap_or(0);
    *MUTANT.get_or_init(read) == number
}
"#;

/// Longest run of the tests of one binary; they take some seconds.
const LIMIT: Duration = Duration::from_mins(5);

/// The tests of the copy, built.
pub(super) struct Harness {
    tree: PathBuf,
    /// Folder for the output of tests.
    logs: PathBuf,
    /// Programs by the name of their suite of tests.
    programs: BTreeMap<String, PathBuf>,
}

/// Which tests of a suite are run.
#[derive(Clone, Copy)]
pub(super) enum Tests<'a> {
    /// All but the slow ones.
    Quick,
    /// Some, by their names in the list.
    Named(&'a [&'a str]),
}

impl Harness {
    /// Makes the copy and builds its tests.
    ///
    /// # Errors
    /// When a patch does not fit its file any more, or the copy does not build.
    pub(super) fn build(shell: &Shell) -> Result<Self, Failure> {
        let mut copy = Copy::of(shell, "mutants")?;
        for suite in &SUITES {
            for patch in suite.patches {
                copy.edit(&format!("{}/{}", suite.folder, patch.file), |text| patch.apply(text))?;
            }
        }
        copy.with_one_instruction_set()?;
        copy.edit("server/sim/src/lib.rs", |text| Ok(format!("{text}{SWITCH}")))?;
        let tree = copy.write(shell)?;

        let mut build = cargo_in(shell, &tree);
        build.args([
            "test",
            "--release",
            "--locked",
            "--no-run",
            "-p",
            "nappe-tests",
            "--no-default-features",
        ]);
        for binary in SUITES.iter().flat_map(|suite| suite.binaries) {
            build.args(["--test", binary]);
        }
        let output = build.output().map_err(|error| Failure(format!("cargo cannot be started: {error}")))?;
        let text = String::from_utf8_lossy(&output.stderr);
        if !output.status.success() {
            return Err(Failure(format!("the copy does not build:\n{text}")));
        }
        let logs = shell.target().join("copies").join("mutants-logs");
        fs::create_dir_all(&logs).map_err(|error| Failure(format!("{}: {error}", logs.display())))?;
        Ok(Self { programs: programs(&text, &tree), tree, logs })
    }

    /// Names of the tests of a suite that fail with a mutant on (0: with none), sorted.
    ///
    /// # Errors
    /// When tests cannot be run to their end.
    pub(super) fn failures(
        &self,
        suite: &Suite,
        mutant: u32,
        tests: Tests<'_>,
    ) -> Result<Vec<String>, Failure> {
        let mut failed = Vec::new();
        for binary in suite.binaries {
            let mut arguments = Vec::new();
            match tests {
                Tests::Quick => {
                    arguments.extend(suite.only);
                    arguments.extend(suite.slow.iter().flat_map(|slow| ["--skip", slow]));
                }
                Tests::Named(names) => {
                    let own = format!("{binary}::");
                    arguments.extend(names.iter().filter_map(|name| name.strip_prefix(&own)));
                    if arguments.is_empty() {
                        continue;
                    }
                    arguments.push("--exact");
                }
            }
            failed.extend(self.run(binary, mutant, &arguments)?);
        }
        failed.sort();
        Ok(failed)
    }

    fn run(&self, binary: &str, mutant: u32, arguments: &[&str]) -> Result<Vec<String>, Failure> {
        let told = |reason: String| Failure(format!("tests of {binary} with mutant {mutant}: {reason}"));
        let program = self.programs.get(binary).ok_or_else(|| told("they were not built".to_owned()))?;
        let log_path = self.logs.join(format!("{binary}-{mutant}.log"));
        let log = File::create(&log_path).map_err(|error| told(error.to_string()))?;
        let mut command = Command::new(program);
        command.args(arguments).env("NAPPE_MUTANT", mutant.to_string()).stdout(log);
        command.stderr(std::process::Stdio::null()).current_dir(self.tree.join("tests"));

        wait(&mut command, LIMIT).map_err(|error| told(error.to_string()))?;
        let text = fs::read_to_string(&log_path).map_err(|error| told(error.to_string()))?;
        if !text.contains("\ntest result:") {
            return Err(told(format!("they stopped before their end:\n{text}")));
        }
        let failed = text.lines().filter_map(|line| line.strip_prefix("test ")?.strip_suffix(" ... FAILED"));
        Ok(failed.map(|test| format!("{binary}::{test}")).collect())
    }
}

/// The programs that cargo says it built: `Executable tests/snow/main.rs (path)`.
fn programs(text: &str, tree: &Path) -> BTreeMap<String, PathBuf> {
    let program = |line: &str| {
        let (source, path) = line.trim().strip_prefix("Executable ")?.split_once(" (")?;
        let binary = source.trim_start_matches("tests/").split('/').next()?;
        Some((binary.to_owned(), tree.join(path.strip_suffix(')')?)))
    };
    text.lines().filter_map(program).collect()
}

/// Waits for a command, and ends it after `limit`.
fn wait(command: &mut Command, limit: Duration) -> io::Result<ExitStatus> {
    let mut child = command.spawn()?;
    let start = Instant::now();
    loop {
        if let Some(status) = child.try_wait()? {
            return Ok(status);
        }
        if start.elapsed() > limit {
            child.kill()?;
            child.wait()?;
            return Err(io::Error::other(format!("they take longer than {} s", limit.as_secs())));
        }
        thread::sleep(Duration::from_millis(5));
    }
}

#[test]
fn programs_are_found_in_what_cargo_says() {
    let text = "    Finished `release` profile [optimized] target(s) in 0.05s\n  \
                Executable tests/snow/main.rs (/t/release/deps/snow-1)\n  Executable linalg/main.rs (l-2)\n";
    let found = programs(text, Path::new("/copy"));
    let expected = [("linalg", "/copy/l-2"), ("snow", "/t/release/deps/snow-1")];
    assert_eq!(found, expected.map(|(name, path)| (name.to_owned(), PathBuf::from(path))).into());
}

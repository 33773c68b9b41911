//! Suites of tests: built by one cargo, then run one after the other, each under watch and with its seconds.
//!
//! A suite that fails does not keep the others from running; all that failed are named at the end.

use std::{
    path::{Path, PathBuf},
    process::{Command, Stdio},
    thread,
    time::Duration,
};

use crate::shell::{Failure, Shell, cargo};

/// How long no test may begin or end: the slowest of the quick tests takes a ninth of it on an idle machine.
pub(crate) const QUICK: Duration = Duration::from_mins(3);
/// The same for slow tests, some of which take minutes.
pub(crate) const SLOW: Duration = Duration::from_mins(15);

/// A program of tests that cargo built.
#[derive(Debug, PartialEq)]
struct Program {
    /// Its main file, from the root.
    source: String,
    path: PathBuf,
    /// Folder of its crate, in which cargo runs it.
    folder: PathBuf,
}

/// Runs the tests that cargo selects by `selection`, with `arguments` for libtest, each program as a step of its own.
///
/// # Errors
/// When tests do not build, fail, or stand still for longer than `patience`.
pub(crate) fn run(
    shell: &mut Shell,
    title: &str,
    selection: &str,
    arguments: &[&str],
    patience: Duration,
) -> Result<(), Failure> {
    shell.step(title, |shell| {
        let mut failed = Vec::new();
        for program in programs(shell, title, selection)? {
            let mut command = Command::new(&program.path);
            command.args(arguments).arg("--test-threads").arg(threads()).current_dir(&program.folder);
            if let Err(Failure(reason)) = shell.watched(&program.source, &mut command, patience) {
                println!("\n{reason}");
                failed.push(reason);
            }
        }
        if failed.is_empty() { Ok(()) } else { Err(Failure(failed.join("\n"))) }
    })
}

/// As many tests at a time as there are cores, and two at least: libtest says in one line that a test ended only
/// where several run.
fn threads() -> String {
    thread::available_parallelism().map_or(2, |count| count.get().max(2)).to_string()
}

/// The programs of `selection`, in the order of their sources.
fn programs(shell: &Shell, title: &str, selection: &str) -> Result<Vec<Program>, Failure> {
    let mut build = Command::new(cargo());
    build.arg("test").args(selection.split_whitespace());
    build.args(["--no-run", "--message-format=json-render-diagnostics"]);
    Shell::forget_this_crate(&mut build);
    let output = build.current_dir(shell.root()).stderr(Stdio::inherit()).output();
    let output = output.map_err(|error| Failure(format!("{title}: cargo cannot be started: {error}")))?;
    if !output.status.success() {
        return Err(Failure(format!("{title}: the tests do not build")));
    }
    let messages = String::from_utf8_lossy(&output.stdout);
    let mut found: Vec<_> = messages.lines().filter_map(|line| program(line, shell.root())).collect();
    if found.is_empty() {
        return Err(Failure(format!("{title}: cargo built no tests")));
    }
    found.sort_by(|a, b| a.source.cmp(&b.source));
    Ok(found)
}

/// The program of tests that a message of cargo tells of.
fn program(message: &str, root: &Path) -> Option<Program> {
    let (_, profile) = message.split_once("\"profile\":{")?;
    if !profile.split('}').next()?.contains("\"test\":true") {
        return None;
    }
    let path = PathBuf::from(text(message, "executable")?);
    let folder = Path::new(text(message, "manifest_path")?).parent()?.to_path_buf();
    let source = Path::new(text(message, "src_path")?).strip_prefix(root).ok()?;
    let source = source.components().map(|part| part.as_os_str().to_string_lossy()).collect::<Vec<_>>();
    Some(Program { source: source.join("/"), path, folder })
}

/// The text of a key in a message. Paths hold no quotes.
fn text<'a>(message: &'a str, key: &str) -> Option<&'a str> {
    let (_, rest) = message.split_once(&format!("\"{key}\":\""))?;
    rest.split_once('"').map(|(text, _)| text)
}

#[test]
fn programs_are_found_in_what_cargo_tells() {
    let message = r#"{"reason":"compiler-artifact","manifest_path":"/r/tests/Cargo.toml","target":{"kind":["test"],"name":"snow","src_path":"/r/tests/snow/main.rs"},"profile":{"opt_level":"0","test":true},"executable":"/t/snow-1"}"#;
    let expected = Program {
        source: "tests/snow/main.rs".to_owned(),
        path: "/t/snow-1".into(),
        folder: "/r/tests".into(),
    };
    assert_eq!(program(message, Path::new("/r")), Some(expected));
    // Cargo says of a program that it can be tested, too.
    let program_itself =
        message.replace("\"test\":true", "\"test\":false").replace("main.rs\"", "main.rs\",\"test\":true");
    assert_eq!(program(&program_itself, Path::new("/r")), None);
    assert_eq!(program(&message.replace("\"/t/snow-1\"", "null"), Path::new("/r")), None);
}

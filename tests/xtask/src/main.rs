//! Project tasks: `cargo xtask check | test | bench | mutants | ci`.
//!
//! Reads the task's name; runs ordinary commands, each shown as it starts; ends with a table of
//! what ran and how long it took. Uses the standard library alone, so that it builds in seconds.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for a terminal")]

mod shell;
mod check;
mod test;
mod bench;
mod clients;
mod mutants;
mod ci;

use std::process::ExitCode;

use shell::{Failure, Shell};

/// A task: its name, what it does, and the function that does it.
type Task = (&'static str, &'static str, fn(&mut Shell, &[String]) -> Result<(), Failure>);

/// Every task, in the order of the help.
const TASKS: [Task; 5] = [
    ("check", "formatting, lints, documentation and the contract's style; changes nothing", check::run),
    ("test", "every test that needs nothing but Rust and a C compiler", test::run),
    ("bench", "the benchmarks named after it, or all: zara cloth snow stomakhin stream", bench::run),
    (
        "mutants",
        "mistakes made on purpose in a copy of the snow, and the tests that notice them",
        mutants::run,
    ),
    ("ci", "check, test, a short benchmark, and clients in other languages", ci::run),
];

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let Some((name, rest)) = arguments.split_first() else {
        eprintln!("{}", help());
        return ExitCode::from(2);
    };
    if matches!(name.as_str(), "help" | "--help" | "-h") {
        println!("{}", help());
        return ExitCode::SUCCESS;
    }
    let Some((_, _, task)) = TASKS.iter().find(|(known, _, _)| known == name) else {
        eprintln!("there is no task '{name}'\n\n{}", help());
        return ExitCode::from(2);
    };
    let mut shell = Shell::at_repository_root();
    let result = task(&mut shell, rest);
    println!("{}", shell.table());
    match result {
        Ok(()) => {
            println!("xtask {name}: ok");
            ExitCode::SUCCESS
        }
        Err(failure) => {
            eprintln!("xtask {name}: {failure}");
            ExitCode::FAILURE
        }
    }
}

fn help() -> String {
    let line = |(name, what, _): &Task| format!("  {name:<7} {what}");
    format!("usage: cargo xtask TASK\n\n{}", TASKS.iter().map(line).collect::<Vec<_>>().join("\n"))
}

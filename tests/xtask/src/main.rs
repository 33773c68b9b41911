//! Project tasks: `cargo xtask check | test | prove | drill | bench | mutants | additions | tutorials | picture | bless |
//! python | wheel | tarball | ci`.
//!
//! Reads the task's name; says what it will run and how long that took the last time; runs ordinary commands,
//! each shown as it starts; ends with a table of what ran and a list of what was not checked. Where the
//! environment says `CI=true`, the task fails if anything was not. Uses the standard library alone, so
//! that it builds in seconds.
#![allow(clippy::print_stdout, clippy::print_stderr, reason = "a program for a terminal")]

mod spent;
mod times;
mod watch;
mod shell;
mod copy;
mod contract;
mod suites;
mod viewer;
mod check;
mod ranks;
mod test;
mod bench;
mod clients;
mod nginx;
mod machine_code;
mod mutants;
mod tutorials;
mod typescript;
mod web;
mod moving;
mod picture;
mod python;
mod ci;
mod bless;
mod additions;
mod drill;
mod timed;
mod going_on;
mod saved;
mod ways;
mod install;
mod laws;
mod prove;

use std::process::ExitCode;

use shell::{Failure, Shell};
use times::Times;

/// A task: its name, what it does, and the function that does it.
type Task = (&'static str, &'static str, fn(&mut Shell, &[String]) -> Result<(), Failure>);

/// Every task, in the order of the help.
const TASKS: [Task; 14] = [
    ("check", "formatting, lints, documentation and the contract's style; changes nothing", check::run),
    (
        "test",
        "every quick test of the program, in the release profile; --viewer: the viewer's, too, though it has not changed",
        test::run,
    ),
    (
        "prove",
        "the proofs that take long, of the parts named after it or all: cloth snow laws service viewer \
         docs builds; laws takes --seeds N, --minutes M, --law NAME, --seed S",
        prove::run,
    ),
    (
        "drill",
        "a server under load, stopped for a while, killed, with jobs of ranks that are killed, or with a class: load, \
         load --minutes N, stops, jobs, class, kill, kill --count N",
        drill::run,
    ),
    (
        "bench",
        "the benchmarks named after it, or all: zara cloth solver snow stomakhin stream packed serve",
        bench::run,
    ),
    (
        "mutants",
        "errors made on purpose in a copy of the numerics, and the tests that catch them",
        mutants::run,
    ),
    (
        "additions",
        "patches that each add one thing to a copy of the program, which must build",
        additions::run,
    ),
    (
        "tutorials",
        "what docs/tutorials and docs/guides tell a reader to do; names after it choose pages",
        tutorials::run,
    ),
    (
        "picture",
        "draws the way of the data, the picture that moves and the page, in docs/images",
        picture::run,
    ),
    (
        "bless",
        "writes every file that is made from the code; names after it choose: pages hashes mutants new-mutants contract seconds",
        bless::run,
    ),
    (
        "python",
        "the package for Python: style, types, and its tests on the server that was built",
        python::run,
    ),
    (
        "wheel",
        "the package for Python with the programs, as one file that pip installs on machines without Rust",
        install::wheel::run,
    ),
    ("tarball", "the programs in one archive, with the README and the licences", install::tarball::run),
    (
        "ci",
        "all that must hold before a change lands: check, test, python, the client for TypeScript and the page",
        ci::run,
    ),
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
    match execute(name, *task, rest) {
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

/// Plans the task, runs it, and tells what ran and what did not.
fn execute(
    name: &str,
    task: fn(&mut Shell, &[String]) -> Result<(), Failure>,
    arguments: &[String],
) -> Result<(), Failure> {
    let mut plan = Shell::for_planning();
    task(&mut plan, arguments)?;
    let mut times = Times::read(&plan.target());
    let measured = Times::measured(plan.root(), &spent::processor());
    println!("xtask {name} will run{}", plan.plan(&times, &measured));

    let mut shell = Shell::at_repository_root();
    let result = task(&mut shell, arguments);
    times.keep(&shell.target(), shell.took());
    println!("\nxtask {name} ran{}", shell.table());

    let skipped = shell.skipped();
    if !skipped.is_empty() {
        println!("\nnot checked:\n  {}", skipped.join("\n  "));
    }
    result?;
    if !skipped.is_empty() && std::env::var_os("CI").is_some_and(|value| value == "true") {
        return Err(Failure(
            "with CI=true nothing may be left unchecked: install what is missing".to_owned(),
        ));
    }
    Ok(())
}

fn help() -> String {
    let line = |(name, what, _): &Task| format!("  {name:<9} {what}");
    format!("usage: cargo xtask TASK\n\n{}", TASKS.iter().map(line).collect::<Vec<_>>().join("\n"))
}

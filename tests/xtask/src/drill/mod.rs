//! `cargo xtask drill load [--minutes N] | stops | jobs | class | kill [--count N]`: a server that was built, under load, with
//! processes that are stopped for a while, with jobs of ranks that are killed, with a class of thirty pupils, and killed.

mod server;
mod random;
mod load;
mod job;
mod stops;
mod jobs;
mod watched;
mod changes;
mod kill;

pub(crate) use random::Random;
pub(crate) use server::hash;

use std::{path::Path, time::Duration};

use crate::{
    ranks,
    shell::{Failure, Shell},
    typescript,
};

/// Every drill, by its name.
pub(crate) const ALL: [&str; 5] = ["load", "stops", "jobs", "class", "kill"];

/// How often a server is killed, unless told otherwise.
const KILLS: usize = 20;

/// Runs the drill that is named.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    match arguments.iter().map(String::as_str).collect::<Vec<_>>().as_slice() {
        ["load"] => under_load(shell, 1.0),
        ["load", "--minutes", minutes] => {
            let number = minutes.parse::<f64>().ok().filter(|minutes| (0.1..=600.0).contains(minutes));
            let minutes = number
                .ok_or_else(|| Failure(format!("--minutes {minutes}: a number from 0.1 to 600 is needed")))?;
            under_load(shell, minutes)
        }
        ["stops"] => of_ranks(shell, "stops", stops::run),
        ["jobs"] => of_ranks(shell, "jobs", jobs::run),
        ["class"] => {
            programs(shell)?;
            typescript::class(shell)
        }
        ["kill"] => killed(shell, KILLS),
        ["kill", "--count", count] => {
            let number = count.parse::<usize>().ok().filter(|count| (1..=10_000).contains(count));
            let count = number.ok_or_else(|| {
                Failure(format!("--count {count}: a whole number from 1 to 10000 is needed"))
            })?;
            killed(shell, count)
        }
        _ => Err(Failure(format!(
            "a drill is needed: {}, or load --minutes N, or kill --count N",
            ALL.join(", ")
        ))),
    }
}

fn programs(shell: &mut Shell) -> Result<(), Failure> {
    shell.cargo("programs", "build --release --bins")
}

fn under_load(shell: &mut Shell, minutes: f64) -> Result<(), Failure> {
    programs(shell)?;
    shell.step("load", |shell| load::run(&shell.target(), Duration::from_secs_f64(60.0 * minutes)))
}

fn killed(shell: &mut Shell, count: usize) -> Result<(), Failure> {
    programs(shell)?;
    shell.step("kill", |shell| kill::run(&shell.target(), count))
}

/// A drill with ranks, if they can be built here.
fn of_ranks(shell: &mut Shell, title: &str, drill: fn(&Path) -> Result<(), Failure>) -> Result<(), Failure> {
    programs(shell)?;
    ranks::build(shell)?;
    if !ranks::is_possible(shell) {
        return Ok(());
    }
    shell.step(title, |shell| drill(&shell.target()))
}

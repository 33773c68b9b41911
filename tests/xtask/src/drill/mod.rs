//! `cargo xtask drill load [--minutes N] | stops | jobs`: a server that was built, under load, with processes that are stopped for
//! a while, and with jobs of ranks that are killed.

mod server;
mod random;
mod load;
mod job;
mod stops;
mod jobs;

pub(crate) use random::Random;
pub(crate) use server::hash;

use std::{path::Path, time::Duration};

use crate::{
    ranks,
    shell::{Failure, Shell},
};

/// Every drill, by its name.
pub(crate) const ALL: [&str; 3] = ["load", "stops", "jobs"];

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
        _ => Err(Failure(format!("a drill is needed: {}, or load --minutes N", ALL.join(", ")))),
    }
}

fn programs(shell: &mut Shell) -> Result<(), Failure> {
    shell.cargo("programs", "build --release --bins")
}

fn under_load(shell: &mut Shell, minutes: f64) -> Result<(), Failure> {
    programs(shell)?;
    shell.step("load", |shell| load::run(&shell.target(), Duration::from_secs_f64(60.0 * minutes)))
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

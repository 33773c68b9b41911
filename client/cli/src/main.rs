//! The `nappe` command: reads the command line, runs the verb, ends with an exit code.
//!
//! Results go to standard output, everything else to standard error. Modules in reading order:

mod error;
mod output;
mod remote;
mod embedded;
mod snow;
mod session;
mod progress;
mod meshes;
mod scene;
mod save;
mod contents;
mod drive;
mod summary;
mod compute;
mod follow;
mod args;
mod bench;
mod verbs;

use std::process::ExitCode;

use clap::Parser as _;

use crate::{
    args::{Cli, Verb},
    error::Result,
};

fn main() -> ExitCode {
    let cli = Cli::parse();
    match dispatch(&cli) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            output::note(&format!("nappe: {error}"));
            ExitCode::from(error.exit as u8)
        }
    }
}

fn dispatch(cli: &Cli) -> Result<()> {
    match &cli.verb {
        None => verbs::demo::run(&cli.demo),
        Some(Verb::Demo(args)) => verbs::demo::run(args),
        Some(Verb::Run(args)) => verbs::run::run(args),
        Some(Verb::Mecasim(args)) => verbs::mecasim::run(args),
        Some(Verb::Scenes(args)) => verbs::scenes::run(args),
        Some(Verb::Mesh(args)) => verbs::mesh::run(args),
        Some(Verb::Serve(args)) => verbs::serve::run(args),
        Some(Verb::Create(args)) => verbs::create::run(args),
        Some(Verb::List(args)) => verbs::list::run(args),
        Some(Verb::Play(args)) => verbs::play::run(args),
        Some(Verb::Pause(args)) => verbs::pause::run(args),
        Some(Verb::Step(args)) => verbs::step::run(args),
        Some(Verb::Update(args)) => verbs::update::run(args),
        Some(Verb::Watch(args)) => verbs::watch::run(args),
        Some(Verb::View(args)) => verbs::view::run(args),
        Some(Verb::Stop(args)) => verbs::stop::run(args),
        Some(Verb::Delete(args)) => verbs::delete::run(args),
        Some(Verb::Bench(args)) => bench::run(args),
        Some(Verb::Completions(args)) => verbs::completions::run(args),
    }
}

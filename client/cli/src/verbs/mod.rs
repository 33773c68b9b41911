//! The verbs of the command, one file each: options in, `run` out.
//!
//! To add a verb, write its file, with the help text on its options, and add three lines here: its `mod`, its
//! variant of `Verb`, its arm in `run`. Its name goes into a group of `help.rs` as well.

mod help;
mod demo;
mod run;
mod mecasim;
mod scenes;
mod mesh;
mod check;
mod serve;
mod class;
mod connect;
mod create;
mod list;
mod play;
mod pause;
mod step;
mod update;
mod reset;
mod changes;
mod fork;
mod save;
mod watch;
mod view;
mod stop;
mod delete;
mod chart;
mod plan;
mod stability;
mod sweep;
mod completions;

use std::path::Path;

use clap::{
    Command, Parser, Subcommand,
    error::{ContextKind, ContextValue},
};
use nappe_scene::shipped_scenes;

use crate::{
    bench,
    files::paths,
    words::{error::Result, version},
};

/// Cloth and snow, computed on a server and watched from elsewhere
#[derive(Parser, Debug)]
#[command(name = "nappe", version = version::text(), help_template = help::screen(&verbs()), after_help = help::BELOW,
          subcommand_value_name = "VERB", args_conflicts_with_subcommands = true,
          max_term_width = help::WIDEST)]
pub(crate) struct Cli {
    #[command(subcommand)]
    verb: Option<Verb>,
    #[command(flatten)]
    demo: demo::DemoArgs,
}

/// What nappe can do, in the order of the help.
#[derive(Subcommand, Debug)]
enum Verb {
    Demo(demo::DemoArgs),
    Run(run::RunArgs),
    Mecasim(mecasim::MecasimArgs),
    Scenes(scenes::ScenesArgs),
    Mesh(mesh::MeshArgs),
    Check(check::CheckArgs),
    Serve(serve::ServeArgs),
    Class(class::ClassArgs),
    Connect(connect::ConnectArgs),
    Create(create::CreateArgs),
    List(list::ListArgs),
    Play(play::PlayArgs),
    Pause(pause::PauseArgs),
    Step(step::StepArgs),
    Update(update::UpdateArgs),
    Reset(reset::ResetArgs),
    Changes(changes::ChangesArgs),
    Fork(fork::ForkArgs),
    Save(save::SaveArgs),
    Watch(watch::WatchArgs),
    View(view::ViewArgs),
    Stop(stop::StopArgs),
    Delete(delete::DeleteArgs),
    Chart(chart::ChartArgs),
    Plan(plan::PlanArgs),
    Stability(stability::StabilityArgs),
    Sweep(sweep::SweepArgs),
    Bench(bench::BenchArgs),
    Completions(completions::CompletionsArgs),
}

/// The verbs alone, without the options of the demo that the command takes without a verb.
fn verbs() -> Command {
    Verb::augment_subcommands(Command::new("nappe"))
}

/// An error of the command line. A scene in the place of a verb is told how it is run.
pub(crate) fn improved(mut error: clap::Error) -> clap::Error {
    if let Some(ContextValue::String(typed)) = error.get(ContextKind::InvalidSubcommand)
        && (paths::is_scene(Path::new(typed)) || shipped_scenes().iter().any(|(name, _)| name == typed))
    {
        let told = format!("'{typed}' is a scene: nappe run {typed}");
        error.remove(ContextKind::SuggestedSubcommand);
        error.insert(ContextKind::Suggested, ContextValue::StyledStrs(vec![told.into()]));
    }
    error
}

/// Runs what the command line asks for.
///
/// # Errors
/// The verb's.
pub(crate) fn run(cli: &Cli) -> Result<()> {
    match &cli.verb {
        None => demo::run(&cli.demo),
        Some(Verb::Demo(args)) => demo::run(args),
        Some(Verb::Run(args)) => run::run(args),
        Some(Verb::Mecasim(args)) => mecasim::run(args),
        Some(Verb::Scenes(args)) => scenes::run(args),
        Some(Verb::Mesh(args)) => mesh::run(args),
        Some(Verb::Check(args)) => check::run(args),
        Some(Verb::Serve(args)) => serve::run(args),
        Some(Verb::Class(args)) => class::run(args),
        Some(Verb::Connect(args)) => connect::run(args),
        Some(Verb::Create(args)) => create::run(args),
        Some(Verb::List(args)) => list::run(args),
        Some(Verb::Play(args)) => play::run(args),
        Some(Verb::Pause(args)) => pause::run(args),
        Some(Verb::Step(args)) => step::run(args),
        Some(Verb::Update(args)) => update::run(args),
        Some(Verb::Reset(args)) => reset::run(args),
        Some(Verb::Changes(args)) => changes::run(args),
        Some(Verb::Fork(args)) => fork::run(args),
        Some(Verb::Save(args)) => save::run(args),
        Some(Verb::Watch(args)) => watch::run(args),
        Some(Verb::View(args)) => view::run(args),
        Some(Verb::Stop(args)) => stop::run(args),
        Some(Verb::Delete(args)) => delete::run(args),
        Some(Verb::Chart(args)) => chart::run(args),
        Some(Verb::Plan(args)) => plan::run(args),
        Some(Verb::Stability(args)) => stability::run(args),
        Some(Verb::Sweep(args)) => sweep::run(args),
        Some(Verb::Bench(args)) => bench::run(args),
        Some(Verb::Completions(args)) => completions::run(args, verbs().version(version::text())),
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    #[test]
    fn the_command_line_holds_together() {
        Cli::command().debug_assert();
    }

    #[test]
    fn each_verb_stands_in_one_group_of_the_help() {
        let mut grouped: Vec<&str> =
            help::GROUPS.iter().flat_map(|(_, names)| names.iter().copied()).collect();
        let verbs = verbs();
        let mut visible: Vec<&str> =
            verbs.get_subcommands().filter(|verb| !verb.is_hide_set()).map(Command::get_name).collect();
        grouped.sort_unstable();
        visible.sort_unstable();
        assert_eq!(grouped, visible);
    }
}

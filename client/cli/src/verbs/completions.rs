//! `nappe completions`: the completion script of a shell, and the names that such a script asks for.

use std::time::Duration;

use clap::{Args, Command};
use clap_complete::Shell;
use tokio::time::timeout;

use crate::{
    options::{
        args::ServerArgs,
        completion::{self, Names},
    },
    outside::remote,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// How long a person who pressed Tab waits for a server.
const PATIENCE: Duration = Duration::from_millis(500);

/// Let Tab complete verbs, options, scenes and sessions
///
/// It prints the script of a shell, which asks nappe for the names of scenes and the server for its sessions.
#[derive(Args, Debug)]
#[command(mut_arg("server", |arg| arg.hide(true)), mut_arg("file", |arg| arg.hide(true)), after_help = "\
Examples, each for shells that start from then on:
  nappe completions bash > ~/.local/share/bash-completion/completions/nappe
  nappe completions zsh > ~/.zfunc/_nappe     a folder that fpath names before compinit runs
  nappe completions fish > ~/.config/fish/completions/nappe.fish

Sessions are those of the server at NAPPE_SERVER; one that does not answer within half a second has none.")]
pub(crate) struct CompletionsArgs {
    /// Shell that reads the script
    #[arg(required_unless_present = "names")]
    shell: Option<Shell>,
    /// Print these names, a line each, as the scripts ask for them
    #[arg(long, hide = true, conflicts_with = "shell")]
    names: Option<Names>,
    #[command(flatten)]
    server: ServerArgs,
}

/// Runs `nappe completions`, for the command line that has these verbs.
///
/// # Errors
/// When standard output cannot be written.
pub(crate) fn run(args: &CompletionsArgs, verbs: Command) -> Result<()> {
    if let Some(shell) = args.shell {
        return output::verbatim(completion::script(shell, verbs).trim_end());
    }
    let names = match args.names {
        Some(Names::Sessions) => sessions(&args.server)?,
        _ => nappe_scene::shipped_scenes().iter().map(|(name, _)| (*name).to_owned()).collect(),
    };
    if names.is_empty() { Ok(()) } else { output::line(&names.join("\n")) }
}

/// Ids of the server's sessions; none without a server, of which nobody wants to hear in the middle of a line.
fn sessions(server: &ServerArgs) -> Result<Vec<String>> {
    let ask = async {
        let client = remote::connect(server).await?;
        client.list_sessions().await.map_err(CliError::from)
    };
    let answer = remote::block_on(async { Ok(timeout(PATIENCE, ask).await) })?;
    let found = answer.ok().and_then(Result::ok).unwrap_or_default();
    // Shells expand what they are given: nothing but an id gets there, whatever a server says.
    let is_id = |id: &String| id.chars().all(|c| c.is_ascii_alphanumeric() || c == '-');
    Ok(found.into_iter().map(|session| session.session_id).filter(is_id).collect())
}

//! The completion script of a shell, which completes names of scenes and sessions as well.
//!
//! Enters: a shell and the verbs. Leaves: what clap writes of verbs and options, and calls of this command for names. An
//! argument takes names if it is called SCENE or SESSION in the help.

use clap::{Arg, Command, ValueEnum, ValueHint};
use clap_complete::Shell;

/// Names that are completed, as `nappe completions --names` takes them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub(crate) enum Names {
    /// Scenes that come with nappe
    Scenes,
    /// Ids of the server's sessions
    Sessions,
}

impl Names {
    /// The names that an argument takes.
    fn of(arg: &Arg) -> Option<Self> {
        let name = arg.get_value_names()?.first()?;
        match name.as_str() {
            "SCENE" if arg.is_positional() => Some(Self::Scenes),
            "SESSION" if arg.is_positional() => Some(Self::Sessions),
            _ => None,
        }
    }

    /// The verbs of which an argument takes these names, with a text between them.
    fn verbs(self, verbs: &Command, between: &str) -> String {
        let takes = |verb: &&Command| verb.get_positionals().any(|arg| Self::of(arg) == Some(self));
        verbs.get_subcommands().filter(takes).map(Command::get_name).collect::<Vec<_>>().join(between)
    }

    /// A hint that no argument of nappe has: in zsh it stands for these names until they replace it.
    fn placeholder(self) -> ValueHint {
        match self {
            Self::Scenes => ValueHint::Username,
            Self::Sessions => ValueHint::EmailAddress,
        }
    }
}

/// The script of a shell.
pub(crate) fn script(shell: Shell, verbs: Command) -> String {
    match shell {
        Shell::Bash => bash(verbs),
        Shell::Zsh => zsh(verbs),
        Shell::Fish => fish(verbs),
        // Verbs and options alone.
        _ => generated(shell, verbs),
    }
}

/// What clap writes.
fn generated(shell: Shell, mut verbs: Command) -> String {
    let mut script = Vec::new();
    clap_complete::generate(shell, &mut verbs, "nappe", &mut script);
    String::from_utf8_lossy(&script).into_owned()
}

/// In bash a function around that of clap puts names in place of options. Where there are none, bash completes files.
fn bash(verbs: Command) -> String {
    let [scenes, sessions] = [Names::Scenes, Names::Sessions].map(|names| names.verbs(&verbs, "|"));
    let around = format!(
        r#"
_nappe_with_names() {{
    _nappe "$@"
    local names=""
    case "${{COMP_WORDS[1]}}" in
        {scenes}) names=scenes ;;
        {sessions}) names=sessions ;;
    esac
    if [[ -n "$names" && "$COMP_CWORD" -gt 1 && "$2" != -* && "$3" != -* ]]; then
        names=$(compgen -W "$("$1" completions --names "$names" 2>/dev/null)" -- "$2")
        [[ -z "$names" ]] || COMPREPLY=( $names )
    fi
}}
"#
    );
    generated(Shell::Bash, verbs).replace("complete -F _nappe ", "complete -F _nappe_with_names ") + &around
}

/// In zsh each argument names the function that completes it.
fn zsh(verbs: Command) -> String {
    const FUNCTIONS: &str = r#"
_nappe_scenes() {
    local -a names=(${(f)"$(nappe completions --names scenes 2>/dev/null)"})
    _alternative 'scenes:scene:compadd -a names' 'files:scene file:_files -g "*.toml"'
}

_nappe_sessions() {
    local -a names=(${(f)"$(nappe completions --names sessions 2>/dev/null)"})
    _alternative 'sessions:session:compadd -a names'
}
"#;
    let marked = |arg: Arg| match Names::of(&arg) {
        Some(names) => arg.value_hint(names.placeholder()),
        None => arg,
    };
    let marked_verb = |verb: Command| verb.mut_args(marked).mut_subcommands(|inner| inner.mut_args(marked));
    generated(Shell::Zsh, verbs.mut_subcommands(marked_verb))
        .replace(":_users'", ":_nappe_scenes'")
        .replace(":_email_addresses'", ":_nappe_sessions'")
        .replacen("autoload -U is-at-least\n", &format!("autoload -U is-at-least\n{FUNCTIONS}"), 1)
}

/// In fish what is said of a verb is added to what clap said.
fn fish(verbs: Command) -> String {
    let [scenes, sessions] = [Names::Scenes, Names::Sessions].map(|names| names.verbs(&verbs, " "));
    let more = format!(
        r#"
complete -c nappe -n "__fish_nappe_using_subcommand {scenes}" -a "(nappe completions --names scenes 2>/dev/null)"
complete -c nappe -n "__fish_nappe_using_subcommand {sessions}" -f -a "(nappe completions --names sessions 2>/dev/null)"
"#
    );
    generated(Shell::Fish, verbs) + &more
}

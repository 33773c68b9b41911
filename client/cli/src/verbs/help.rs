//! What `nappe --help` shows on one screen: the verbs in groups, where to read on, and exit codes.
//!
//! Enters: the verbs with their texts. Leaves: a template of clap for the screen, and what stands below the groups.

use std::fmt::Write as _;

use clap::{Command, builder::Styles};

/// The widest that help becomes (columns); on a narrower terminal it wraps there.
pub(super) const WIDEST: usize = 110;

/// The verbs by what they are for. Within a group they stand in the order of `Verb`.
pub(super) const GROUPS: [(&str, &[&str]); 4] = [
    ("Compute in this command", &["demo", "run", "mecasim", "scenes"]),
    (
        "A server and its sessions",
        &[
            "serve", "class", "connect", "create", "list", "play", "pause", "step", "update", "reset",
            "changes", "fork", "save", "watch", "view", "stop", "delete",
        ],
    ),
    ("Study methods and parameters", &["chart", "plan", "stability", "sweep"]),
    ("Tools", &["mesh", "check", "bench", "completions"]),
];

/// Below the groups.
pub(super) const BELOW: &str = "\
`nappe VERB --help` says more, with examples; `nappe --version` says which one.
`nappe` alone is `nappe demo`; `nappe run flag --save flag.html` keeps a page.

Exit codes: 0 done, 1 failed, 2 wrong command line, 3 the simulation diverged,
4 no server answers, 5 the server refused, 130 ended by Ctrl-C or a signal.";

/// The screen, as a template: clap writes each group, with the texts that the verbs have themselves.
pub(super) fn screen(verbs: &Command) -> String {
    let header = *Styles::styled().get_header();
    let mut screen = "{about-with-newline}\n{usage-heading} {usage}".to_owned();
    for (title, names) in GROUPS {
        let found = names.iter().filter_map(|name| verbs.find_subcommand(name)).cloned();
        let mut group = Command::new("nappe")
            .help_template("{subcommands}")
            .max_term_width(WIDEST)
            .disable_help_subcommand(true)
            .subcommands(found);
        let lines = group.render_help().ansi().to_string();
        let _ = write!(screen, "\n\n{header}{title}:{header:#}\n{}", lines.trim_end());
    }
    screen + "{after-help}"
}

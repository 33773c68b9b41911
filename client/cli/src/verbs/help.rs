//! What `nappe --help` says below the list of verbs: examples, exit codes, environment.

/// Below the short help, `nappe -h`.
pub(crate) const EXAMPLES: &str = "\
Examples:
  nappe                                   see a cloth fall over a sphere: the demo, in one command
  nappe scenes                            list the scenes that come with nappe
  nappe run flag --save flag.html         compute a shipped scene and keep a page that any browser opens
  nappe run my.toml --steps 100 --json    compute a scene file and end with one JSON object
  nappe serve                             start a server for other programs and other machines
  nappe connect anna@cluster              reach a server on another machine through ssh
  nappe create demo --id first            make a session on that server
  nappe play first && nappe watch first   let the session run and follow its diagnostics
  nappe bench zara                        measure the table of Zara 2001 on this machine
  nappe bench snow                        measure particle-steps per second of snow

`nappe VERB --help` says more about a verb.";

const EXIT_CODES: &str = "\
Exit codes:
    0  done
    1  failed: a file, a scene or a mesh
    2  the command line is wrong
    3  the simulation diverged (with --json the result is printed all the same)
    4  no server answers at the address
    5  the server refused: the message ends with its reason, a word in capitals
  130  ended by Ctrl-C, SIGTERM or a terminal that closed; serve and connect, which run until then, end with 0

Environment:
  NAPPE_SERVER  address of the server for the verbs that talk to one
  NAPPE_TOKEN_FILE  file with the token that a server asks for and that verbs show
  NAPPE_VIEWER  the program that records and shows in Rerun [default: nappe-viewer, beside nappe or on PATH]
  NAPPE_LOG     what `nappe serve` logs";

/// Below the long help, `nappe --help`.
pub(crate) fn long() -> String {
    format!("{EXAMPLES}\n\n{EXIT_CODES}")
}

//! Completion: scripts of shells that complete verbs, options, scenes and sessions, and the names that they ask for.

use std::{net::TcpListener, path::Path, process::Command, time::Instant};

use crate::support::{
    Folder, PATIENCE, SMALL_SCENE, Server, command, folder, nappe, run_to_end, skipped, write_scene,
};

/// A folder with a file of the script of a shell, for a command that another one loads it in.
fn script(shell: &str) -> Folder {
    let folder = folder();
    let text = nappe(&["completions", shell]).ok().stdout;
    std::fs::write(folder.path().join("script"), text).expect("it is written");
    folder
}

/// A shell with the built command on its path, for which `server` is the server.
fn shell(program: &str, folder: &Folder, server: &str) -> Command {
    let built = Path::new(env!("CARGO_BIN_EXE_nappe")).parent().expect("a folder");
    let path = std::env::var("PATH").unwrap_or_default();
    let mut shell = Command::new(program);
    shell.current_dir(folder.path()).env("PATH", format!("{}:{path}", built.display()));
    shell.env_remove("NAPPE_TOKEN_FILE").env("NAPPE_SERVER", server);
    shell
}

/// What bash offers for the last of the words: it calls the function that the script has registered for nappe.
fn in_bash(folder: &Folder, server: &str, words: &[&str]) -> Vec<String> {
    const CALL: &str = r#"
source ./script
registered=$(complete -p nappe)
called=${registered##*-F }
COMP_WORDS=("$@")
COMP_CWORD=$(($# - 1))
"${called%% *}" nappe "${COMP_WORDS[COMP_CWORD]}" "${COMP_WORDS[COMP_CWORD - 1]}"
printf '%s\n' "${COMPREPLY[@]}"
"#;
    let done = run_to_end(shell("bash", folder, server).args(["-c", CALL, "bash"]).args(words)).ok();
    assert_eq!(done.stderr, "", "{words:?}");
    done.stdout.lines().filter(|line| !line.is_empty()).map(str::to_owned).collect()
}

/// Where no server is: port 1 is reserved.
const NOBODY: &str = "http://127.0.0.1:1";

/// A server with two sessions.
fn with_sessions() -> Server {
    let server = Server::start();
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    for id in ["first", "second"] {
        server.nappe(&["create", &scene, "--id", id]).ok();
    }
    server
}

#[test]
fn bash_completes_verbs_options_and_scenes() {
    let folder = script("bash");
    let offered = |words: &[&str]| in_bash(&folder, NOBODY, words);
    assert_eq!(offered(&["nappe", "mec"]), ["mecasim"]);
    assert!(!offered(&["nappe", ""]).iter().any(|word| word == "--steps"), "of the demo");
    for verb in ["run", "class", "create", "chart", "plan", "stability", "sweep", "scenes", "check"] {
        assert_eq!(offered(&["nappe", verb, "two_snow"]), ["two_snowballs"], "{verb}");
        assert!(offered(&["nappe", verb, ""]).len() > 5, "{verb}");
    }
    assert_eq!(offered(&["nappe", "run", "--steps", "5", "two_snow"]), ["two_snowballs"]);
    assert_eq!(offered(&["nappe", "run", "--prec"]), ["--precision"]);
    assert_eq!(offered(&["nappe", "run", "--precision", "f6"]), ["f64"]);
    assert!(offered(&["nappe", "run", "no_scene"]).is_empty(), "bash completes files then");
}

#[test]
fn bash_completes_the_sessions_of_the_server() {
    let folder = script("bash");
    let server = with_sessions();
    let verbs = [
        "play", "pause", "step", "update", "reset", "changes", "fork", "save", "watch", "view", "stop",
        "delete",
    ];
    for verb in verbs {
        assert_eq!(in_bash(&folder, &server.url, &["nappe", verb, ""]), ["first", "second"], "{verb}");
        assert_eq!(in_bash(&folder, &server.url, &["nappe", verb, "se"]), ["second"], "{verb}");
    }
    assert!(in_bash(&folder, NOBODY, &["nappe", "play", "fi"]).is_empty());
}

#[test]
fn fish_completes_scenes_and_sessions() {
    if Command::new("fish").arg("--version").output().is_err() {
        skipped("there is no fish");
        return;
    }
    let server = with_sessions();
    for (line, wanted) in [("run two_snow", "two_snowballs"), ("play se", "second"), ("mec", "mecasim")] {
        let folder = script("fish");
        let call = format!("source ./script; complete -C 'nappe {line}'");
        let done = run_to_end(shell("fish", &folder, &server.url).args(["--no-config", "-c", &call])).ok();
        let words: Vec<_> = done.stdout.lines().map(|line| line.split('\t').next().unwrap_or(line)).collect();
        assert_eq!(words, [wanted], "{line}");
    }
}

#[test]
fn scripts_of_other_shells_have_the_verbs_and_zsh_a_function_for_each_argument_with_names() {
    for shell in ["zsh", "elvish", "powershell"] {
        assert!(nappe(&["completions", shell]).ok().stdout.contains("mecasim"), "{shell}");
    }
    let zsh = nappe(&["completions", "zsh"]).ok().stdout;
    assert!(zsh.starts_with("#compdef nappe\n"), "{zsh}");
    for (function, count) in [("_nappe_scenes", 10), ("_nappe_sessions", 12)] {
        assert_eq!(zsh.matches(&format!(":{function}' \\\n")).count(), count, "{function}");
        assert_eq!(zsh.matches(&format!("\n{function}() {{\n")).count(), 1, "{function}");
    }
    assert!(!zsh.contains(":_users'") && !zsh.contains(":_email_addresses'"), "placeholders are replaced");
}

#[test]
fn names_of_sessions_are_none_and_without_a_word_where_no_server_answers() {
    // The system takes connections for it, and nobody answers them.
    let silent = TcpListener::bind("127.0.0.1:0").expect("a port");
    let silent = format!("http://{}", silent.local_addr().expect("an address"));
    for server in [NOBODY, silent.as_str(), "no address"] {
        let begin = Instant::now();
        let mut names = command();
        let done = run_to_end(names.args(["completions", "--names", "sessions"]).env("NAPPE_SERVER", server));
        assert_eq!((done.code, done.stdout.as_str(), done.stderr.as_str()), (Some(0), "", ""), "{server}");
        // Half a second, on a machine that is busy.
        assert!(begin.elapsed() < PATIENCE / 12, "{server}: {:?}", begin.elapsed());
    }
}

#[test]
fn a_shell_is_asked_for() {
    let done = nappe(&["completions"]);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("<SHELL>"), "{}", done.stderr);
    let help = nappe(&["completions", "--help"]).ok().stdout;
    assert!(help.contains("bash-completion/completions/nappe") && !help.contains("--names"), "{help}");
}

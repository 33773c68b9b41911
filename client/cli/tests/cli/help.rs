//! Help texts and usage errors.

use crate::support::{command, nappe};

const VERBS: [&str; 23] = [
    "demo",
    "run",
    "mecasim",
    "scenes",
    "mesh",
    "serve",
    "connect",
    "create",
    "list",
    "play",
    "pause",
    "step",
    "update",
    "changes",
    "fork",
    "watch",
    "view",
    "stop",
    "delete",
    "bench",
    "completions",
    "help",
    "--version",
];

#[test]
fn every_verb_explains_itself() {
    for verb in VERBS.iter().filter(|verb| !matches!(**verb, "help" | "--version")) {
        let done = nappe(&[verb, "--help"]).ok();
        assert!(done.stdout.contains("Usage: nappe"), "{verb}: {}", done.stdout);
    }
}

#[test]
fn the_help_lists_every_verb_every_exit_code_and_examples() {
    let help = nappe(&["--help"]).ok().stdout;
    for verb in VERBS {
        assert!(help.contains(verb), "{verb} is missing in:\n{help}");
    }
    for code in [
        "0  done",
        "1  failed",
        "2  the command line",
        "3  the simulation diverged",
        "4  no server",
        "5  the server refused",
        "130  ended by Ctrl-C",
    ] {
        assert!(help.contains(code), "'{code}' is missing in:\n{help}");
    }
    assert!(help.contains("nappe run flag"), "an example of run");
}

#[test]
fn verbs_that_print_take_json() {
    for verb in [
        "run", "mecasim", "scenes", "create", "list", "play", "pause", "step", "update", "changes", "fork",
        "watch", "stop", "delete", "serve", "connect", "view", "demo",
    ] {
        assert!(nappe(&[verb, "--help"]).ok().stdout.contains("--json"), "{verb}");
    }
    for verb in [
        ["mesh", "grid"],
        ["mesh", "convert"],
        ["mesh", "info"],
        ["bench", "zara"],
        ["bench", "cloth"],
        ["bench", "stream"],
        ["bench", "packed"],
        ["bench", "snow"],
        ["bench", "stomakhin"],
    ] {
        assert!(nappe(&[verb[0], verb[1], "--help"]).ok().stdout.contains("--json"), "{verb:?}");
    }
}

#[test]
fn a_wrong_command_line_ends_with_2_and_says_what_is_near() {
    let done = nappe(&["rum"]);
    assert_eq!(done.code, Some(2));
    assert!(done.stderr.contains("'run'"), "{}", done.stderr);
    assert_eq!(nappe(&["run"]).code, Some(2));
    assert_eq!(nappe(&["run", "demo", "--steps", "0"]).code, Some(2));
    assert_eq!(nappe(&["run", "demo", "--precision", "f16"]).code, Some(2));
    assert_eq!(nappe(&["play", "x", "--real-time-factor", "-1"]).code, Some(2));
    let still = nappe(&["play", "x", "--real-time-factor", "0"]);
    assert_eq!(still.code, Some(2));
    assert!(still.stderr.contains("--real-time-factor is 0"), "{}", still.stderr);
}

#[test]
fn an_old_name_of_an_option_is_not_in_the_help_and_does_not_go_with_the_new_one() {
    let help = nappe(&["play", "--help"]).ok().stdout;
    assert!(help.contains("--real-time-factor") && !help.contains("--pace"), "{help}");
    let both = nappe(&["play", "x", "--pace", "1", "--real-time-factor", "1"]);
    assert_eq!(both.code, Some(2));
    assert!(both.stderr.contains("--pace") && both.stderr.contains("--real-time-factor"), "{}", both.stderr);
}

#[test]
fn an_update_of_nothing_is_a_wrong_command_line() {
    let done = nappe(&["update", "some"]);
    assert_eq!(done.code, Some(2));
    assert!(done.stderr.contains("--gravity"), "{}", done.stderr);
}

#[test]
fn no_server_ends_with_4_and_says_how_to_start_one() {
    // Port 1 is reserved and never served.
    let done = nappe(&["list", "--server", "http://127.0.0.1:1"]);
    assert_eq!(done.code, Some(4), "{done:?}");
    assert!(done.stderr.contains("127.0.0.1:1") && done.stderr.contains("nappe serve"), "{}", done.stderr);
    assert!(done.stdout.is_empty());
}

#[cfg(target_arch = "x86_64")]
#[test]
fn a_processor_without_avx2_is_told_so_in_one_line() {
    let refused = command().arg("scenes").env("NAPPE_HIDE_AVX2", "1").output().expect("the command starts");
    let message = String::from_utf8_lossy(&refused.stderr).into_owned();
    assert_eq!(refused.status.code(), Some(1), "{message}");
    assert!(message.starts_with("nappe: this processor has no AVX2"), "{message}");
    assert_eq!(message.lines().count(), 1, "{message}");
}

#[test]
fn an_address_that_is_none_ends_with_2() {
    let done = nappe(&["list", "--server", "https://127.0.0.1:1"]);
    assert_eq!(done.code, Some(2), "{done:?}");
}

#[test]
fn shells_get_their_completions() {
    for shell in ["bash", "zsh", "fish"] {
        assert!(nappe(&["completions", shell]).ok().stdout.contains("mecasim"), "{shell}");
    }
}

#[test]
fn shipped_scenes_are_listed_and_shown() {
    let scenes = nappe(&["scenes", "--json"]).ok().json();
    let names: Vec<&str> =
        scenes.as_array().expect("an array").iter().filter_map(|s| s["name"].as_str()).collect();
    assert!(names.contains(&"demo"), "{names:?}");
    let text = nappe(&["scenes", "demo"]).ok().stdout;
    assert!(text.contains("[[body]]"), "{text}");
    let unknown = nappe(&["scenes", "dmo"]);
    assert_eq!(unknown.code, Some(1));
    assert!(unknown.stderr.contains("demo"), "{}", unknown.stderr);
}

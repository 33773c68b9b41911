//! Help texts and usage errors.

use crate::support::{command, folder, nappe, nappe_in, run_to_end};

/// The groups of the help, and how many verbs stand in each.
const GROUPS: [(&str, usize); 4] = [
    ("Compute in this command:", 4),
    ("A server and its sessions:", 17),
    ("Study methods and parameters:", 4),
    ("Tools:", 4),
];

/// What `nappe` writes for an argument on a terminal of so many columns.
fn help_at(columns: u16, args: &[&str]) -> String {
    run_to_end(command().args(args).env("COLUMNS", columns.to_string())).ok().stdout
}

/// The verbs of a group of the help, each with its text.
fn verbs<'a>(help: &'a str, group: &str) -> Vec<(&'a str, &'a str)> {
    let lines = help.lines().skip_while(|line| *line != group).skip(1);
    lines
        .take_while(|line| line.starts_with("  "))
        .map(|line| line.trim().split_once(' ').expect("a verb and its text"))
        .map(|(verb, text)| (verb, text.trim()))
        .collect()
}

#[test]
fn the_help_shows_the_verbs_in_four_groups_on_one_screen() {
    let help = help_at(80, &["--help"]);
    assert!(help.lines().count() <= 47, "{} lines:\n{help}", help.lines().count());
    assert!(help.lines().all(|line| line.chars().count() <= 80), "{help}");
    for (group, count) in GROUPS {
        assert_eq!(verbs(&help, group).len(), count, "{group}\n{help}");
    }
    assert_eq!(help_at(80, &["-h"]), help);
    assert_eq!(help_at(80, &["help"]), help);
}

#[test]
fn the_help_of_a_verb_begins_with_the_text_that_the_screen_has() {
    let help = help_at(80, &["--help"]);
    for (verb, text) in GROUPS.iter().flat_map(|(group, _)| verbs(&help, group)) {
        let own = help_at(80, &[verb, "--help"]);
        assert_eq!(own.lines().next(), Some(text), "{verb}: {own}");
        assert!(own.contains("Usage: nappe"), "{verb}: {own}");
    }
}

#[test]
fn the_help_wraps_at_the_width_of_the_terminal() {
    for columns in [60, 80, 100] {
        for args in [&["--help"][..], &["create", "--help"]] {
            let help = help_at(columns, args);
            let widest = help.lines().map(|line| line.chars().count()).max().unwrap_or(0);
            assert!(widest <= usize::from(columns), "{widest} of {columns} columns:\n{help}");
        }
    }
}

#[test]
fn options_of_the_demo_are_in_its_own_help_and_work_without_the_verb() {
    let [all, demo] = [&["--help"][..], &["demo", "--help"]].map(|args| help_at(80, args));
    for option in ["--steps", "--save", "--precision", "--ranks", "--fields", "--launcher"] {
        assert!(demo.contains(option) && !all.contains(&format!("{option} <")), "{option}: {all}");
    }
    let folder = folder();
    let shown = nappe_in(folder.path(), &["--steps", "2", "--save", "two.html", "--json"]).ok().json();
    assert_eq!((&shown["scene"], &shown["steps"]), (&"demo".into(), &2.into()), "{shown}");
    assert!(folder.path().join("two.html").is_file());
}

#[test]
fn the_help_says_every_exit_code_and_where_to_read_on() {
    let help = nappe(&["--help"]).ok().stdout;
    for part in [
        "0 done",
        "1 failed",
        "2 wrong command line",
        "3 the simulation diverged",
        "4 no server",
        "5 the server refused",
        "130 ended by Ctrl-C",
        "nappe run flag",
        "nappe VERB --help",
        "nappe --version",
    ] {
        assert!(help.contains(part), "'{part}' is missing in:\n{help}");
    }
}

#[test]
fn verbs_that_print_take_json() {
    for verb in [
        "run", "mecasim", "scenes", "create", "list", "play", "pause", "step", "update", "changes", "fork",
        "save", "watch", "stop", "delete", "serve", "class", "connect", "view", "demo", "check",
    ] {
        assert!(nappe(&[verb, "--help"]).ok().stdout.contains("--json"), "{verb}");
    }
    for verb in [
        ["mesh", "grid"],
        ["mesh", "convert"],
        ["mesh", "springs"],
        ["mesh", "frames"],
        ["mesh", "info"],
        ["scenes", "coarser"],
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
    assert_eq!(nappe(&["run", "demo", "--steps", "-1"]).code, Some(2));
    assert_eq!(nappe(&["run", "demo", "--precision", "f16"]).code, Some(2));
    assert_eq!(nappe(&["play", "x", "--real-time-factor", "-1"]).code, Some(2));
    let still = nappe(&["play", "x", "--real-time-factor", "0"]);
    assert_eq!(still.code, Some(2));
    assert!(still.stderr.contains("a number above 0 is needed, such as 1"), "{}", still.stderr);
}

#[test]
fn nobody_is_told_to_write_an_unknown_option_behind_two_dashes() {
    for args in
        [&["run", "flag", "--fps", "30"][..], &["check", "--colour"], &["sweep", "flag", "--until_s", "1"]]
    {
        let done = nappe(args);
        assert_eq!(done.code, Some(2), "{done:?}");
        assert!(done.stderr.contains("unexpected argument '--"), "{}", done.stderr);
        assert!(!done.stderr.contains("'-- -"), "{}", done.stderr);
    }
    // What is near to an option is named all the same.
    let done = nappe(&["run", "flag", "--step", "3"]);
    assert!(done.stderr.contains("'--steps'"), "{}", done.stderr);
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

//! Numbers that are typed wrongly: what is needed is said, with what was meant as an example.

use crate::support::{command, nappe, run_to_end};

/// The command refuses its arguments with 2, names the option and says what it needs.
fn refused(args: &[&str], option: &str, needed: &str) {
    let done = nappe(args);
    assert_eq!(done.code, Some(2), "{args:?}: {done:?}");
    for part in [option, needed] {
        assert!(done.stderr.contains(part), "'{part}' is missing after {args:?}: {}", done.stderr);
    }
    assert!(done.stdout.is_empty(), "{done:?}");
}

#[test]
fn a_whole_number_says_where_it_begins_and_what_was_meant() {
    for (typed, needed) in [
        ("-5", "a whole number from 0 is needed"),
        ("1e3", "a whole number from 0 is needed, such as 1000"),
        ("10 000", "a whole number from 0 is needed, such as 10000"),
        ("12,5", "a whole number from 0 is needed"),
        ("5 ms", "a whole number from 0 is needed"),
        ("many", "a whole number from 0 is needed"),
    ] {
        refused(&["run", "flag", "--steps", typed], "--steps", needed);
    }
    let from_1 = "a whole number from 1 is needed";
    refused(&["step", "first", "-5"], "N", from_1);
    refused(&["step", "first", "0"], "N", from_1);
    refused(&["step", "first", "1e3"], "N", "a whole number from 1 is needed, such as 1000");
    refused(&["run", "flag", "--threads", "1.5"], "--threads", from_1);
    refused(
        &["run", "flag", "--threads", "5000000000"],
        "--threads",
        "a whole number from 1 to 4294967295 is needed",
    );
    refused(&["update", "first", "--at-step", "-1"], "--at-step", "a whole number from 0 is needed");
    refused(&["fork", "first", "--steps", "-1"], "--steps", "a whole number from 0 is needed");
    refused(&["mecasim", "two", "a.simu", "b.objet"], "COUNT", from_1);
    refused(&["sweep", "flag", "--set", "dt=0.01", "--out", "x", "--steps", "-5"], "--steps", from_1);
    refused(&["bench", "cloth", "--side", "4"], "--side", "a whole number from 8 to 2000 is needed");
    refused(&["serve", "--max-sessions", "-1"], "--max-sessions", "a whole number from 0 is needed");
}

#[test]
fn a_real_number_says_its_unit_and_what_was_meant() {
    let plan = |until| ["plan", "drap10", "--tolerance", "1mm", "--until", until];
    for (typed, needed) in [
        ("5 ms", "a number of seconds above 0 is needed, such as 0.005"),
        ("12,5", "a number of seconds above 0 is needed, such as 12.5"),
        ("-5", "a number of seconds above 0 is needed, such as 0.5"),
        ("soon", "a number of seconds above 0 is needed, such as 0.5"),
    ] {
        refused(&plan(typed), "--until", needed);
    }
    refused(&["watch", "first", "--rate", "-1"], "--rate", "a number of hertz from 0 is needed, such as 5");
    refused(
        &["watch", "first", "--rate", "2kHz"],
        "--rate",
        "a number of hertz from 0 is needed, such as 2000",
    );
    refused(
        &["update", "first", "--drag", "0,5"],
        "--drag",
        "a number of N s/m from 0 is needed, such as 0.5",
    );
    refused(
        &["mesh", "grid", "70x70", "--spacing", "5cm", "--out", "x.obj"],
        "--spacing",
        "a number of metres above 0 is needed, such as 0.05",
    );
    refused(
        &["mesh", "convert", "a", "b.ply", "--missing-mass", "5g"],
        "--missing-mass",
        "a number of kilograms from 0 is needed, such as 0.005",
    );
    refused(
        &["serve", "--drain-seconds", "2min"],
        "--drain-seconds",
        "a number of seconds from 0 is needed, such as 120",
    );
    refused(&["play", "first", "--real-time-factor", "0,5"], "--real-time-factor", "such as 0.5");
}

#[test]
fn an_option_that_has_a_unit_of_its_own_says_so_of_a_negative_number_too() {
    refused(&["plan", "drap10", "--tolerance", "-1"], "--tolerance", "'-1' is not a length above 0");
    refused(&["chart", "drap10", "--budget", "-1"], "--budget", "'-1' is not a time above 0");
}

#[test]
fn a_variable_of_the_environment_is_read_as_its_option_is() {
    let done = run_to_end(command().arg("serve").env("NAPPE_DRAIN_SECONDS", "5 s"));
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("a number of seconds from 0 is needed, such as 5"), "{}", done.stderr);
}

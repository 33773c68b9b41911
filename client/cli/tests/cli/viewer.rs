//! `nappe-viewer` as the command starts it: where it is looked for, what it records, and how its end is told.

use std::{
    fs,
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

use crate::support::{
    Done, Lines, SMALL_SCENE, Server, command, command_at, end_by, folder, nappe_in, run_to_end, skipped,
    until, write_scene,
};

/// What builds a viewer, as the command says it.
const BUILD: &str = "cargo build --release --package nappe-viewer";

/// The viewer beside the command, or `None` with a message where it is not built.
fn viewer() -> Option<PathBuf> {
    let path = Path::new(command().get_program()).with_file_name("nappe-viewer");
    if path.is_file() {
        return Some(path);
    }
    skipped(&format!("there is no nappe-viewer beside the command: `{BUILD}`"));
    None
}

/// A program that is taken for a viewer of this version and, asked to show something, does as told. A shell writes it:
/// a file that a process of this test still holds open for writing cannot be started.
fn script(folder: &Path, version: &str, what: &str) -> PathBuf {
    let path = folder.join("viewer");
    let text = format!("#!/bin/sh\n[ \"$1\" = --version ] && echo nappe-viewer {version} && exit\n{what}\n");
    let write = ["-c", "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"", "sh", &text];
    let status = Command::new("sh").args(write).arg(&path).status();
    assert!(status.expect("there is a shell").success());
    path
}

const OURS: &str = env!("CARGO_PKG_VERSION");

/// The command in a folder, with another viewer.
fn nappe_with(viewer: &Path, folder: &Path) -> Command {
    let mut command = command();
    command.current_dir(folder).env("NAPPE_VIEWER", viewer);
    command
}

#[test]
fn without_a_viewer_each_way_to_rerun_says_one_line() {
    let here = folder();
    let path = here.path().join("nappe");
    let linked = fs::hard_link(command().get_program(), &path);
    linked.or_else(|_other_disk| fs::copy(command().get_program(), &path).map(drop)).expect("a second name");
    let alone = |args: &[&str]| {
        run_to_end(command_at(&path).current_dir(here.path()).env("PATH", here.path()).args(args))
    };

    for way in [
        &["run", "flag", "--save", "flag.rrd"][..],
        &["watch", "first", "--save", "first.rrd"],
        &["view", "first"],
        &["serve", "--rerun", "--address", "127.0.0.1:0"],
    ] {
        let done = alone(way);
        assert_eq!((done.code, done.stdout.as_str()), (Some(2), ""), "{way:?}: {done:?}");
        assert_eq!(
            (done.stderr.lines().count(), done.stderr.contains(BUILD)),
            (1, true),
            "{way:?}: {done:?}"
        );
    }
}

#[test]
fn what_is_no_viewer_of_this_version_is_refused_before_anything_runs() {
    let here = folder();
    let other = script(here.path(), "0.0.9", "");
    let command = command();
    let stranger = Path::new(command.get_program());
    let cases = [
        (Path::new("/nowhere/viewer"), "No such file"),
        (stranger, "no nappe-viewer"),
        (&other, "version 0.0.9"),
    ];
    for (viewer, part) in cases {
        let done = run_to_end(nappe_with(viewer, here.path()).args(["demo", "--save", "demo.rrd"]));
        assert_eq!(
            (done.code, done.stdout.lines().count()),
            (Some(2), 2),
            "no more than a heading: {done:?}"
        );
        let said = [part, "NAPPE_VIEWER", &viewer.display().to_string(), BUILD];
        assert!(said.iter().all(|part| done.stderr.contains(part)), "{done:?}");
        assert_eq!(done.stderr.lines().count(), 1, "{done:?}");
    }
}

#[test]
fn a_recording_has_every_frame_and_changes_no_bit() {
    if viewer().is_none() {
        return;
    }
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let run = |save: &[&str]| nappe_in(here.path(), &[&["run", &scene, "--json"], save].concat()).ok().json();
    let (plain, recorded) = (run(&[]), run(&["--save", "small.rrd"]));
    assert_eq!(plain["state_hash"], recorded["state_hash"]);
    assert_eq!((&recorded["saved"], &recorded["frames"]), (&"small.rrd".into(), &21.into()));
    let bytes = fs::read(here.path().join("small.rrd")).expect("the recording");
    // 21 frames of 144 particles, 12 bytes each, do not fit in less.
    assert!(bytes.starts_with(b"RRF") && bytes.len() > 21 * 144 * 12 / 2, "{} bytes", bytes.len());

    let diverging = SMALL_SCENE
        .replace("dt = 0.005", "dt = 0.5")
        .replace("pins =", "integrator = \"symplectic_euler\"\nunchecked = true\npins =");
    let diverging = write_scene(here.path(), &diverging);
    let done = nappe_in(here.path(), &["run", &diverging, "--json", "--save", "diverging.rrd"]);
    assert_eq!((done.code, &done.json()["saved"]), (Some(3), &"diverging.rrd".into()), "{done:?}");
    assert!(done.stderr.contains("step"), "the session's words: {done:?}");
}

/// A server with a session of the small scene: `steps`, or 0 for no end.
fn serving(id: &str, steps: u64) -> Server {
    let server = Server::start();
    let here = folder();
    let text = SMALL_SCENE.replace("steps = 40", &format!("steps = {steps}"));
    server.nappe(&["create", &write_scene(here.path(), &text), "--id", id]).ok();
    server
}

#[test]
fn a_session_elsewhere_is_viewed_and_watched_into_a_file() {
    if viewer().is_none() {
        return;
    }
    let server = serving("seen", 20);
    server.nappe(&["step", "seen", "20"]).ok();
    let here = folder();
    let file = |name: &str| here.path().join(name).to_str().expect("a UTF-8 path").to_owned();
    let shown = server.nappe(&["view", "seen", "--save", &file("seen.rrd")]).ok().json();
    // 20 steps, a frame every 2, and the initial state.
    assert_eq!((&shown["frames"], &shown["dropped"]), (&11.into(), &0.into()));
    assert_eq!((&shown["finished"], &shown["saved"]), (&true.into(), &file("seen.rrd").into()));
    for (options, frames) in [(&[][..], 1), (&["--from", "4"], 7), (&["--from", "4", "--count", "2"], 2)] {
        let path = file(&format!("{frames}.rrd"));
        let done = server.nappe(&[&["watch", "seen", "--save", &path], options].concat()).ok().json();
        assert_eq!((&done["frames"], &done["saved"]), (&frames.into(), &path.clone().into()), "{options:?}");
        assert!(fs::metadata(path).expect("the recording").len() > 0);
    }
    for verb in ["watch", "view"] {
        let refused = server.nappe(&[verb, "nobody", "--save", &file("nobody.rrd")]);
        assert_eq!(
            (refused.code, refused.stderr.contains("SESSION_NOT_FOUND")),
            (Some(5), true),
            "{refused:?}"
        );
        let nowhere = server.nappe(&[verb, "seen", "--save", "/nowhere/at/all.rrd"]);
        assert_eq!(
            (nowhere.code, nowhere.stderr.contains("/nowhere/at/all.rrd")),
            (Some(1), true),
            "{nowhere:?}"
        );
    }
}

/// The command recording a session that never ends, and the viewer beside it, which has begun to write.
fn endless(folder: &Path, viewer: &Path) -> (Child, String) {
    let noted = script(folder, OURS, &format!("echo $$ > pid\nexec '{}' \"$@\"", viewer.display()));
    let scene = write_scene(folder, &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let mut run = nappe_with(&noted, folder);
    run.args(["run", &scene, "--json", "--save", "endless.rrd"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped());
    let run = run.spawn().expect("it starts");
    let file = folder.join("endless.rrd.new");
    until("frames are written", || fs::metadata(&file).is_ok_and(|file| file.len() > 100_000));
    (run, fs::read_to_string(folder.join("pid")).expect("its number").trim().to_owned())
}

fn done(run: Child) -> Done {
    let output = run.wait_with_output().expect("it ends");
    let [stdout, stderr] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
    Done { code: output.status.code(), stdout, stderr }
}

#[test]
fn a_viewer_that_ends_in_the_middle_ends_the_run_which_says_so() {
    let Some(viewer) = viewer() else { return };
    for (signal, part, left) in [
        ("KILL", "what was written until then is endless.rrd.new", "endless.rrd.new"),
        ("TERM", "before the session", "endless.rrd"),
    ] {
        let here = folder();
        let (run, pid) = endless(here.path(), &viewer);
        let sent = Command::new("kill").args([&format!("-{signal}"), &pid]).status();
        assert!(sent.expect("the signal is sent").success());
        let done = done(run);
        assert_eq!((done.code, done.stdout.as_str()), (Some(1), ""), "{done:?}");
        assert!(done.stderr.contains(part) && done.stderr.contains("record"), "{done:?}");
        let files = ["endless.rrd", "endless.rrd.new"].map(|file| here.path().join(file).exists());
        assert_eq!(files, [left == "endless.rrd", left == "endless.rrd.new"], "{signal}");
    }
}

#[test]
fn a_run_that_is_ended_closes_its_recording_which_nobody_else_may_write() {
    let Some(viewer) = viewer() else { return };
    let here = folder();
    let (mut run, pid) = endless(here.path(), &viewer);
    for force in [&[][..], &["--force"]] {
        let second = nappe_in(here.path(), &[&["run", "flag", "--save", "endless.rrd"], force].concat());
        assert_eq!(
            (second.code, second.stderr.contains("endless.rrd is being written by another run")),
            (Some(1), true),
            "{second:?}"
        );
    }
    let stdout = Lines::of(run.stdout.take().expect("a pipe"));
    assert_eq!(end_by(&mut run, "TERM"), Some(130));
    assert!(stdout.with("\"interrupted\":true").contains("endless.rrd"));
    let is_there = Command::new("kill").args(["-0", &pid]).stderr(Stdio::null()).status();
    assert!(!is_there.expect("it can be asked").success(), "the viewer has ended");
    let [file, new] = ["endless.rrd", "endless.rrd.new"].map(|file| here.path().join(file));
    assert!(file.is_file() && !new.exists());
    let second = nappe_in(here.path(), &["run", "flag", "--save", "endless.rrd"]);
    let part = "endless.rrd is there already: --force overwrites it";
    assert_eq!((second.code, second.stderr.contains(part)), (Some(1), true), "{second:?}");
}

#[test]
fn a_viewer_without_an_answer_is_told_with_its_last_lines() {
    let here = folder();
    for (what, part) in [
        ("echo out of luck >&2; exit 7", "without an answer (exit status: 7)"),
        ("echo out of luck >&2; exec sleep 60", "does not watch the session 10 s"),
    ] {
        let viewer = script(here.path(), OURS, what);
        let done = run_to_end(nappe_with(&viewer, here.path()).args(["run", "flag", "--save", "flag.rrd"]));
        assert_eq!(done.code, Some(1), "{done:?}");
        assert!(done.stderr.contains(part) && done.stderr.contains("out of luck"), "{done:?}");
        assert!(!here.path().join("flag.rrd").exists() && !here.path().join("flag.rrd.new").exists());
    }
}

#[test]
fn a_server_outlives_what_shows_its_sessions() {
    if viewer().is_none() {
        return;
    }
    // Nobody may connect, so that the first call of the viewer fails already.
    let here = folder();
    let log = here.path().join("log");
    let told = |part: &str| {
        until(part, || fs::read_to_string(&log).is_ok_and(|told| told.contains(part)));
    };
    let connect = "rerun+http://127.0.0.1:1/proxy";
    let server = Server::logging(&["--rerun", connect, "--max-connections", "0"], &log);
    told("nappe: no new session is shown");
    assert_eq!(server.end_by("TERM"), Some(0), "it ran until it was asked to end");
}

//! Outputs that cannot be written: a log on a full disk or a pipe that nobody reads, and results that find no room.

use std::{
    fs::File,
    io::{self, Write as _},
    process::{Command, Stdio},
    thread,
};

use crate::{
    run::DIVERGING_SCENE,
    service::wait_for,
    support::{Done, SMALL_SCENE, Server, command, folder, run_to_end, write_scene},
};

/// A device that is always full.
fn full() -> Stdio {
    File::options().write(true).open("/dev/full").expect("Linux has one").into()
}

/// A pipe whose reader is gone.
fn gone() -> Stdio {
    let (reader, writer) = io::pipe().expect("a pipe");
    drop(reader);
    writer.into()
}

/// A command whose results go where they cannot be written.
fn nappe_to(output: Stdio, args: &[&str]) -> Done {
    let output = command().args(args).stdout(output).stderr(Stdio::piped()).output().expect("it ends");
    let [stdout, stderr] = [output.stdout, output.stderr].map(|text| String::from_utf8(text).expect("UTF-8"));
    Done { code: output.status.code(), stdout, stderr }
}

#[test]
fn a_server_whose_log_cannot_be_written_makes_and_steps_sessions_and_ends_with_0() {
    let [small, diverging] = [folder(), folder()];
    let scene = write_scene(small.path(), SMALL_SCENE);
    let diverging = write_scene(diverging.path(), DIVERGING_SCENE);
    for log in [full(), gone()] {
        let server = Server::begin(&["--log", "debug"], log);
        server.nappe(&["create", &scene, "--id", "first"]).ok();
        server.nappe(&["fork", "first", "--id", "second"]).ok();
        server.nappe(&["play", "second"]).ok();
        assert_eq!(wait_for(&server, "second", "finished")["step"], 40);

        server.nappe(&["create", &diverging, "--id", "third"]).ok();
        server.nappe(&["play", "third"]).ok();
        let failed = wait_for(&server, "third", "failed");
        for part in ["reason", "message"] {
            assert!(
                failed["failure"][part].as_str().is_some_and(|text| !text.is_empty()),
                "{part}: {failed}"
            );
        }
        assert_eq!(server.end_by("TERM"), Some(0));
    }
}

#[test]
fn a_server_whose_log_nobody_reads_answers_and_ends_with_0() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let (reader, log) = io::pipe().expect("a pipe");
    let mut filler = log.try_clone().expect("a second writer");
    // Until the reader is gone: whoever else writes to the pipe waits as long.
    let filling = thread::spawn(move || while filler.write_all(&[b'\n'; 4096]).is_ok() {});
    let server = Server::begin(&["--log", "trace"], log.into());
    server.nappe(&["create", &scene, "--id", "first"]).ok();
    assert_eq!(server.nappe(&["step", "first", "10"]).ok().json()["step"], 10);
    assert_eq!(server.end_by("TERM"), Some(0));
    drop(reader);
    filling.join().expect("it ends with the reader");
}

#[test]
fn a_filter_of_the_log_that_cannot_be_read_is_a_wrong_command_line() {
    let mut serve = command();
    let done = run_to_end(serve.args(["serve", "--address", "127.0.0.1:0", "--log", "nappe_server=loud"]));
    assert_eq!(done.code, Some(2), "{done:?}");
    for part in ["nappe_server=loud", "NAPPE_LOG", "off, error, warn"] {
        assert!(done.stderr.contains(part), "'{part}' is missing in: {}", done.stderr);
    }
}

#[test]
fn a_full_standard_output_is_told_in_one_line_and_ends_with_1() {
    for args in
        [&["scenes"][..], &["scenes", "--json"], &["--help"], &["--version"], &["completions", "bash"]]
    {
        let done = nappe_to(full(), args);
        assert_eq!(done.code, Some(1), "{args:?}: {done:?}");
        assert!(done.stderr.starts_with("nappe: cannot write on standard output: "), "{args:?}: {done:?}");
        assert_eq!(done.stderr.lines().count(), 1, "{args:?}: {done:?}");
    }
}

#[test]
fn a_reader_that_left_ends_the_command_without_a_word() {
    for args in [&["scenes"][..], &["--help"]] {
        let done = nappe_to(gone(), args);
        assert_eq!((done.code, done.stderr.as_str()), (Some(0), ""), "{args:?}");
    }
}

#[test]
fn a_file_beyond_the_limit_on_files_is_refused_in_a_sentence() {
    let folder = folder();
    let mut limited = Command::new("sh");
    limited.args(["-c", "ulimit -f 1 && exec \"$@\"", "sh"]).arg(command().get_program());
    limited.args(["mesh", "grid", "70x70", "--spacing", "0.1", "--out", "grid.obj"]);
    let done = run_to_end(limited.current_dir(folder.path()));
    assert_eq!(done.code, Some(1), "{done:?}");
    assert!(done.stderr.contains("grid.obj") && done.stderr.contains("too large"), "{done:?}");
}

#[test]
fn a_number_of_workers_that_tokio_refuses_changes_nothing() {
    for count in ["0", "many"] {
        let done = run_to_end(command().env("TOKIO_WORKER_THREADS", count).args([
            "list",
            "--server",
            "127.0.0.1:1",
        ]));
        assert_eq!(done.code, Some(4), "no server is there, and that is all that is wrong: {done:?}");
    }
}

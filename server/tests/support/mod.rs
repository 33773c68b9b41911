//! What the tests of the built program share.

use std::{
    io::{BufRead as _, BufReader},
    process::ChildStdout,
    sync::mpsc,
    thread,
    time::Duration,
};

/// The first line that a program says, for which it has two minutes.
pub(crate) fn first_line(output: ChildStdout) -> String {
    let (said, line) = mpsc::channel();
    thread::spawn(move || {
        let mut line = String::new();
        BufReader::new(output).read_line(&mut line).expect("it can be read");
        // Whoever asked may have given up.
        let _ = said.send(line);
    });
    line.recv_timeout(Duration::from_mins(2)).expect("a line in time")
}

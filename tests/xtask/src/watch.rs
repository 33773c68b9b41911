//! A program of tests under watch: passes on what it prints, and ends it when its tests stand still.
//!
//! Reads the lines of libtest on standard output: `test NAME ... ok` when a test ends, and `test NAME has been running
//! for over 60 seconds`, from which the tests that never end are known by name. Of pytest: `FILE::NAME PASSED`.

use std::{
    collections::BTreeSet,
    fs,
    io::{self, BufRead as _, BufReader},
    process::{Child, Command, ExitStatus, Stdio},
    sync::mpsc::{self, RecvTimeoutError},
    thread,
    time::{Duration, Instant},
};

/// How a program of tests ended.
#[derive(Debug)]
pub(crate) enum Ending {
    /// It ended by itself, with this status.
    Done(ExitStatus),
    /// It was ended, since no test had begun or ended for too long; this says for how long, and which were running.
    Stalled(String),
}

/// Runs a program of tests to its end, or ends it with all that it started once no test has begun or ended for
/// `patience`. A test begins when another has ended, so that ends are looked for.
///
/// # Errors
/// When it cannot be started or waited for.
pub(crate) fn run(command: &mut Command, patience: Duration) -> io::Result<Ending> {
    let mut child = command.stdout(Stdio::piped()).spawn()?;
    let output = BufReader::new(child.stdout.take().expect("its output is a pipe"));
    let (sender, lines) = mpsc::channel();
    thread::spawn(move || output.lines().map_while(Result::ok).try_for_each(|line| sender.send(line)));

    let mut watch = Watch { last: Instant::now(), running: BTreeSet::new() };
    loop {
        match lines.recv_timeout(Duration::from_millis(100)) {
            Ok(line) => {
                println!("{line}");
                watch.note(&line, Instant::now());
            }
            // What a test left running may keep the pipe open.
            Err(RecvTimeoutError::Timeout) => {
                if let Some(status) = child.try_wait()? {
                    return Ok(Ending::Done(status));
                }
            }
            Err(RecvTimeoutError::Disconnected) => return Ok(Ending::Done(child.wait()?)),
        }
        if let Some(reason) = watch.stall(Instant::now(), patience) {
            end(&mut child)?;
            return Ok(Ending::Stalled(reason));
        }
    }
}

/// What is known of the tests of a program.
struct Watch {
    /// When one ended last.
    last: Instant,
    /// Those that libtest has named as running.
    running: BTreeSet<String>,
}

impl Watch {
    fn note(&mut self, line: &str, now: Instant) {
        match event(line) {
            Some(Event::Ended(name)) => {
                self.running.remove(name);
                self.last = now;
            }
            Some(Event::Running(name)) => {
                self.running.insert(name.to_owned());
            }
            None => {}
        }
    }

    /// Says that no test has ended for longer than `patience`, and which were running.
    fn stall(&self, now: Instant, patience: Duration) -> Option<String> {
        if now.duration_since(self.last) <= patience {
            return None;
        }
        let names: Vec<_> = self.running.iter().map(String::as_str).collect();
        let running = if names.is_empty() { "none has said its name".to_owned() } else { names.join(", ") };
        Some(format!("no test began or ended for {} s; running: {running}", patience.as_secs()))
    }
}

/// What a line of libtest or of pytest says of a test.
#[derive(Debug, PartialEq)]
enum Event<'a> {
    Ended(&'a str),
    Running(&'a str),
}

fn event(line: &str) -> Option<Event<'_>> {
    let Some(line) = line.strip_prefix("test ") else {
        let outcome = [" PASSED", " FAILED", " ERROR", " SKIPPED"].into_iter().find_map(|end| line.find(end));
        return outcome.map(|end| &line[..end]).filter(|name| name.contains("::")).map(Event::Ended);
    };
    if let Some((name, _)) = line.split_once(" has been running for over ") {
        return Some(Event::Running(name));
    }
    let (name, _) = line.rsplit_once(" ... ")?;
    Some(Event::Ended(name.strip_suffix(" - should panic").unwrap_or(name)))
}

/// Ends a program and all that it started and that still runs.
fn end(child: &mut Child) -> io::Result<()> {
    // Programs that a test started would go on, and keep ports and pipes. The shell has `kill` wherever it runs.
    let started = descendants(child.id()).iter().map(u32::to_string).collect::<Vec<_>>().join(" ");
    child.kill()?;
    if !started.is_empty() {
        let _ = Command::new("sh").args(["-c", &format!("kill -KILL {started}")]).status();
    }
    child.wait().map(|_| ())
}

/// Processes below another, as Linux tells them; none elsewhere.
pub(crate) fn descendants(ancestor: u32) -> Vec<u32> {
    let entries = fs::read_dir("/proc").into_iter().flatten().filter_map(Result::ok);
    let process = |entry: fs::DirEntry| {
        let id: u32 = entry.file_name().to_str()?.parse().ok()?;
        let stat = fs::read_to_string(entry.path().join("stat")).ok()?;
        // The name stands in brackets and may hold anything; its state and its parent follow.
        let parent: u32 = stat.rsplit_once(')')?.1.split_whitespace().nth(1)?.parse().ok()?;
        Some((id, parent))
    };
    let parents: Vec<(u32, u32)> = entries.filter_map(process).collect();

    let mut found = vec![ancestor];
    let mut next = 0;
    while next < found.len() {
        let parent = found[next];
        found.extend(parents.iter().filter(|(_, of)| *of == parent).map(|(id, _)| *id));
        next += 1;
    }
    found.split_off(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn shell(script: &str) -> Command {
        let mut command = Command::new("sh");
        command.args(["-c", script]);
        command
    }

    #[test]
    fn lines_of_libtest_say_which_tests_run_and_which_ended() {
        assert_eq!(event("test a::b ... ok"), Some(Event::Ended("a::b")));
        assert_eq!(event("test a::b - should panic ... ok"), Some(Event::Ended("a::b")));
        let over = "test a::b has been running for over 60 seconds";
        assert_eq!(event(over), Some(Event::Running("a::b")));
        assert_eq!(event("test result: ok. 1 passed; 0 failed"), None);
        assert_eq!(event("running 2 tests"), None);
        assert_eq!(event("tests/x.py::y[a b] PASSED  [ 3%]"), Some(Event::Ended("tests/x.py::y[a b]")));
        assert_eq!(event("=== 1 PASSED ==="), None);
    }

    #[test]
    fn tests_that_stand_still_are_named() {
        let (start, patience) = (Instant::now(), Duration::from_mins(3));
        let mut watch = Watch { last: start, running: BTreeSet::new() };
        let at = |seconds| start + Duration::from_secs(seconds);
        watch.note("test slow has been running for over 60 seconds", at(60));
        watch.note("test stuck has been running for over 60 seconds", at(60));
        watch.note("test slow ... ok", at(100));
        assert_eq!(watch.stall(at(280), patience), None);
        let told = "no test began or ended for 180 s; running: stuck";
        assert_eq!(watch.stall(at(281), patience).as_deref(), Some(told));
    }

    #[test]
    fn tests_that_stand_still_are_ended_with_all_that_they_started() {
        // Both sleeps would take longer than any test may; the first is a process of its own, as a server is.
        let mut stuck = shell("sleep 1000 & echo $!; sleep 1000");
        let start = Instant::now();
        let ending = run(&mut stuck, Duration::from_secs(1)).expect("sh can be started");
        assert!(matches!(ending, Ending::Stalled(_)), "{ending:?}");
        assert!(start.elapsed() < Duration::from_secs(500), "it waited for what was started");
    }

    #[test]
    fn tests_that_end_tell_how() {
        for (script, succeeds) in [("echo 'test quick ... ok'", true), ("exit 3", false)] {
            let ending = run(&mut shell(script), Duration::from_secs(500)).expect("sh can be started");
            assert!(matches!(ending, Ending::Done(status) if status.success() == succeeds), "{ending:?}");
        }
    }
}

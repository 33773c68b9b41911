//! What a step took: seconds by the clock, and seconds of all processors, which other work on the machine hardly changes.

use std::{
    fs,
    time::{Duration, Instant},
};

/// Ticks in which Linux counts the time of processes, per second.
const TICKS: f64 = 100.0;

/// Seconds of a step.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Spent {
    /// By the clock.
    pub(crate) wall: f64,
    /// Of all processors together, in programs that have ended; 0 where the system does not tell.
    pub(crate) processor: f64,
}

/// The beginning of a step.
pub(crate) struct Start(Instant, f64);

impl Start {
    pub(crate) fn now() -> Self {
        Self(Instant::now(), of_children())
    }

    pub(crate) fn spent(&self) -> Spent {
        let Self(instant, before) = self;
        let wall: Duration = instant.elapsed();
        Spent { wall: wall.as_secs_f64(), processor: (of_children() - before).max(0.0) }
    }
}

/// Processor seconds of all programs that this one started and that have ended, and of those that they waited for.
fn of_children() -> f64 {
    fs::read_to_string("/proc/self/stat").ok().and_then(|stat| ticks(&stat)).unwrap_or(0.0) / TICKS
}

/// Ticks of children in user and kernel mode: fields 16 and 17 of a process. Its name, field 2, may hold anything.
fn ticks(stat: &str) -> Option<f64> {
    let mut fields = stat.rsplit_once(')')?.1.split_whitespace().skip(13);
    let mut next = || fields.next()?.parse::<f64>().ok();
    Some(next()? + next()?)
}

/// The processor, as Linux names it, with its family and model, since vendors give one name to several.
pub(crate) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let of = |key: &str| {
        let line = text.lines().find(|line| line.split(':').next().is_some_and(|name| name.trim() == key));
        line.and_then(|line| line.split_once(':')).map_or("unknown", |(_, value)| value.trim()).to_owned()
    };
    format!("{}, family {}, model {}", of("model name"), of("cpu family"), of("model"))
}

#[test]
fn ticks_of_children_are_found_behind_any_name() {
    let stat = "1 (a) b) S 2 3 4 5 6 7 8 9 10 11 12 13 150 50 20 0 1";
    assert_eq!(ticks(stat), Some(200.0));
    assert_eq!(ticks("1 (a"), None);
}

#[test]
fn a_program_that_computes_is_counted() {
    let start = Start::now();
    let count = "i=0; while [ $i -lt 300000 ]; do i=$((i+1)); done";
    let status = std::process::Command::new("sh").args(["-c", count]).status();
    assert!(status.expect("there is a shell").success());
    let spent = start.spent();
    assert!(spent.processor > 0.0 || !cfg!(target_os = "linux"), "{spent:?}");
}

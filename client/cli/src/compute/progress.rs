//! How far a simulation is, on standard error: a bar on a terminal, a line every 10 s in a file or a pipe.

use std::{
    convert::Infallible,
    future,
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use nappe_client::v1;

use super::pace::Pace;
use crate::words::{diagnostics, output};

/// Time between two lines.
const INTERVAL: Duration = Duration::from_secs(10);

/// Whether progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Shown {
    /// As standard error allows it.
    Progress,
    /// Not at all.
    Nothing,
}

/// How far a simulation is.
#[derive(Debug)]
pub(crate) enum Progress {
    /// For a person at a terminal.
    Bar(ProgressBar),
    /// For a file or a pipe.
    Lines(Pace),
    /// For nobody, who asked for nothing.
    Quiet,
}

impl Progress {
    /// Starts that of a session as it stands.
    pub(crate) fn start(session: &v1::Session, shown: Shown) -> Self {
        if shown == Shown::Nothing {
            return Self::Quiet;
        }
        let bar = bar(session.step_limit);
        if bar.is_hidden() {
            let steps = [session.step, session.step_limit];
            return Self::Lines(Pace::new(steps, INTERVAL, Instant::now()));
        }
        // Steps that were taken before tell nothing of how long the others take.
        bar.set_position(session.step);
        bar.reset_eta();
        Self::Bar(bar)
    }

    /// Shows the diagnostics of a step.
    pub(crate) fn show(&self, step: &v1::Diagnostics) {
        match self {
            Self::Bar(bar) => {
                bar.set_position(step.step);
                bar.set_message(format!(
                    "t = {}, {} per step{}",
                    output::moment(step.time_seconds),
                    output::time(step.step_seconds),
                    diagnostics::snow_phrase(step)
                ));
            }
            Self::Lines(pace) => pace.see(step.step, step.time_seconds, Instant::now()),
            Self::Quiet => {}
        }
    }

    /// Writes the lines as they are due, until nobody waits for it any more.
    pub(crate) async fn tell(&self) -> Infallible {
        let Self::Lines(pace) = self else { return future::pending().await };
        loop {
            tokio::time::sleep(pace.wait(Instant::now())).await;
            if let Some(line) = pace.line(Instant::now()) {
                output::note(&line);
            }
        }
    }

    /// Writes a sentence on standard error, above the bar if there is one.
    pub(crate) fn note(&self, text: &str) {
        match self {
            Self::Bar(bar) => bar.suspend(|| output::note(text)),
            Self::Lines(_) | Self::Quiet => output::note(text),
        }
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        if let Self::Bar(bar) = self {
            bar.finish_and_clear();
        }
    }
}

/// A bar of so many steps, which draws nothing where standard error is no terminal.
fn bar(step_limit: u64) -> ProgressBar {
    let (bar, template) = match step_limit {
        0 => (ProgressBar::no_length(), "{spinner} step {human_pos}  {elapsed}  {msg}"),
        limit => (
            ProgressBar::new(limit),
            "{wide_bar} step {human_pos} of {human_len}  {elapsed}, {eta} to go  {msg}",
        ),
    };
    let style = ProgressStyle::with_template(template).expect("the templates are right: a test parses them");
    bar.with_style(style)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_bars_can_be_drawn() {
        for step_limit in [0, 10] {
            let bar = bar(step_limit);
            let progress = Progress::Bar(bar.clone());
            progress.show(&v1::Diagnostics { step: 3, ..v1::Diagnostics::default() });
            assert_eq!(bar.position(), 3);
            progress.finish();
        }
        let session = v1::Session { step: 4, step_limit: 10, ..v1::Session::default() };
        assert!(matches!(Progress::start(&session, Shown::Nothing), Progress::Quiet));
    }

    #[tokio::test]
    async fn a_bar_and_nobody_are_told_no_lines() {
        for progress in [Progress::Bar(bar(3)), Progress::Quiet] {
            let told = tokio::time::timeout(Duration::from_millis(5), progress.tell()).await;
            assert!(told.is_err());
        }
    }
}

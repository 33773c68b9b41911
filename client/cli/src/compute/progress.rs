//! A progress bar on standard error; nothing where standard error is not a terminal.

use indicatif::{ProgressBar, ProgressStyle};
use nappe_client::v1;

use crate::{diagnostics, output};

/// How far a simulation is.
#[derive(Debug)]
pub(crate) struct Progress {
    bar: ProgressBar,
}

impl Progress {
    /// Starts a bar of `step_limit` steps; 0 when the simulation does not end by itself.
    pub(crate) fn start(step_limit: u64) -> Self {
        let (bar, template) = match step_limit {
            0 => (ProgressBar::no_length(), "{spinner} step {human_pos}  {elapsed}  {msg}"),
            limit => (
                ProgressBar::new(limit),
                "{wide_bar} step {human_pos} of {human_len}  {elapsed}, {eta} to go  {msg}",
            ),
        };
        let style =
            ProgressStyle::with_template(template).expect("the templates are right: a test parses them");
        Self { bar: bar.with_style(style) }
    }

    /// Shows the diagnostics of a step.
    pub(crate) fn show(&self, step: &v1::Diagnostics) {
        self.bar.set_position(step.step);
        self.bar.set_message(format!(
            "t = {}, {} per step{}",
            output::moment(step.time_seconds),
            output::time(step.step_seconds),
            diagnostics::snow_phrase(step)
        ));
    }

    /// Takes the bar away.
    pub(crate) fn finish(&self) {
        self.bar.finish_and_clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn both_bars_can_be_drawn() {
        for step_limit in [0, 10] {
            let progress = Progress::start(step_limit);
            progress.show(&v1::Diagnostics { step: 3, ..v1::Diagnostics::default() });
            assert_eq!(progress.bar.position(), 3);
            progress.finish();
        }
    }
}

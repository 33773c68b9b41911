//! How long each step took the last time it succeeded on this machine: kept under `target/`.

use std::{collections::BTreeMap, fs, path::Path};

/// File of the times: seconds, a tab, and the title of a step, a line each.
const FILE: &str = "xtask-times.txt";

/// Seconds by the title of a step.
#[derive(Debug, Default)]
pub(crate) struct Times(BTreeMap<String, f64>);

impl Times {
    /// The times of earlier runs; none where there were none.
    pub(crate) fn read(target: &Path) -> Self {
        Self::parse(&fs::read_to_string(target.join(FILE)).unwrap_or_default())
    }

    fn parse(text: &str) -> Self {
        let entry = |line: &str| {
            let (seconds, title) = line.split_once('\t')?;
            Some((title.to_owned(), seconds.parse().ok()?))
        };
        Self(text.lines().filter_map(entry).collect())
    }

    /// Seconds that a step took.
    pub(crate) fn of(&self, title: &str) -> Option<f64> {
        self.0.get(title).copied()
    }

    /// Remembers the steps that ran, by title and seconds.
    pub(crate) fn keep<'a>(&mut self, target: &Path, steps: impl Iterator<Item = (&'a str, f64)>) {
        self.0.extend(steps.map(|(title, seconds)| (title.to_owned(), seconds)));
        // Nothing depends on it: a folder that cannot be written to only makes the next plan say less.
        let _ = fs::write(target.join(FILE), self.text());
    }

    fn text(&self) -> String {
        let line = |(title, seconds): (&String, &f64)| format!("{seconds:.1}\t{title}\n");
        self.0.iter().map(line).collect::<Vec<_>>().concat()
    }
}

#[test]
fn times_are_read_as_they_were_written() {
    let text = "12.5\tbench zara\n340.0\ttests\n";
    let times = Times::parse(&format!("{text}no number\there\nneither\n"));
    assert_eq!(times.of("tests"), Some(340.0));
    assert_eq!(times.text(), text);
}

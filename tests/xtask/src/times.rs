//! How long each step took the last time it succeeded on this machine, kept under `target/`; and how long the parts of
//! `cargo xtask ci` took when the tree was last measured, on each processor: `tests/seconds.txt`.

use std::{collections::BTreeMap, fs, path::Path};

use crate::spent::Spent;

/// File of the times under `target/`: seconds, processor seconds and the title of a step, with tabs, a line each.
const FILE: &str = "xtask-times.txt";

/// File of the times in the tree: the same after the name of a processor.
pub(crate) const MEASURED: &str = "tests/seconds.txt";

/// How much more the sum of processor seconds may be than the tree says.
const GROWTH: f64 = 1.2;

/// What steps took, by title.
#[derive(Debug, Default)]
pub(crate) struct Times(BTreeMap<String, Spent>);

impl Times {
    /// The times of earlier runs; none where there were none.
    pub(crate) fn read(target: &Path) -> Self {
        Self::parse(&fs::read_to_string(target.join(FILE)).unwrap_or_default())
    }

    /// The times that the tree has of a processor; none where it was not measured on one.
    pub(crate) fn measured(root: &Path, processor: &str) -> Self {
        let text = fs::read_to_string(root.join(MEASURED)).unwrap_or_default();
        let of_this =
            |line: &str| line.strip_prefix(processor)?.strip_prefix('\t').map(|line| format!("{line}\n"));
        Self::parse(&text.lines().filter_map(of_this).collect::<String>())
    }

    fn parse(text: &str) -> Self {
        let entry = |line: &str| {
            let mut fields = line.splitn(3, '\t');
            let mut number = || fields.next()?.parse().ok();
            let spent = Spent { wall: number()?, processor: number()? };
            Some((fields.next()?.to_owned(), spent))
        };
        Self(text.lines().filter_map(entry).collect())
    }

    /// What a step took.
    pub(crate) fn of(&self, title: &str) -> Option<Spent> {
        self.0.get(title).copied()
    }

    /// Remembers the steps that ran.
    pub(crate) fn keep<'a>(&mut self, target: &Path, steps: impl Iterator<Item = (&'a str, Spent)>) {
        self.0.extend(steps.map(|(title, spent)| (title.to_owned(), spent)));
        // Nothing depends on it: a folder that cannot be written to only makes the next plan say less.
        let _ = fs::write(target.join(FILE), self.lines(""));
    }

    /// A line for each step, each after `prefix`.
    fn lines(&self, prefix: &str) -> String {
        let line = |(title, spent): (&String, &Spent)| {
            format!("{prefix}{:.1}\t{:.1}\t{title}\n", spent.wall, spent.processor)
        };
        self.0.iter().map(line).collect()
    }

    /// Those of `titles` alone.
    fn only(&self, titles: &[String]) -> Self {
        Self(titles.iter().filter_map(|title| Some((title.clone(), self.of(title)?))).collect())
    }

    fn sum(&self) -> f64 {
        self.0.values().map(|spent| spent.processor).sum()
    }

    /// What grew too much since the tree was measured: a sentence, with the parts; none where all is well or not known.
    pub(crate) fn growth(&self, measured: &Self) -> Option<String> {
        let titles: Vec<_> = measured.0.keys().filter(|title| self.0.contains_key(*title)).cloned().collect();
        let (now, before) = (self.only(&titles), measured.only(&titles));
        if titles.is_empty() || now.sum() <= GROWTH * before.sum() {
            return None;
        }
        let grown = titles.iter().filter_map(|title| {
            let [now, before] = [now.of(title)?.processor, before.of(title)?.processor];
            (now > GROWTH * before).then(|| format!("{title}: {before:.0} s, now {now:.0} s"))
        });
        let parts = grown.collect::<Vec<_>>().join("; ");
        let (now, before) = (now.sum(), before.sum());
        Some(format!(
            "cargo xtask ci took {now:.0} processor seconds here, and {before:.0} when {MEASURED} was written: {parts}. Make it \
             cheaper, or run ci again on an idle machine and write the file anew: cargo xtask bless seconds"
        ))
    }
}

/// Writes into the tree what the parts named `titles` took the last time on this processor.
pub(crate) fn write(root: &Path, target: &Path, processor: &str, titles: &[String]) -> std::io::Result<()> {
    let text = fs::read_to_string(root.join(MEASURED)).unwrap_or_default();
    let prefix = format!("{processor}\t");
    let mut lines: Vec<_> = text.lines().filter(|line| !line.starts_with(&prefix)).collect();
    let new = Times::read(target).only(titles).lines(&prefix);
    lines.extend(new.lines());
    fs::write(root.join(MEASURED), lines.join("\n") + "\n")
}

#[test]
fn times_are_read_as_they_were_written() {
    let text = "12.5\t20.0\tbench zara\n340.0\t600.0\ttests\n";
    let times = Times::parse(&format!("{text}no number\there\nneither\n"));
    assert_eq!(times.of("tests"), Some(Spent { wall: 340.0, processor: 600.0 }));
    assert_eq!(times.lines(""), text);
}

#[test]
fn growth_is_told_with_its_parts_and_noise_is_not() {
    let times = |build: f64, tests: f64| {
        Times::parse(&format!("1.0\t{build}\tbuild\n1.0\t{tests}\ttests\n9\t9\tother\n"))
    };
    let measured = Times::parse("1.0\t100.0\tbuild\n1.0\t300.0\ttests\n1.0\t50.0\tnot run here\n");
    assert_eq!(times(130.0, 340.0).growth(&measured), None);
    let told = times(300.0, 310.0).growth(&measured).expect("it grew");
    assert!(told.contains("build: 100 s, now 300 s") && !told.contains("tests:"), "{told}");
    assert_eq!(times(300.0, 300.0).growth(&Times::default()), None);
}

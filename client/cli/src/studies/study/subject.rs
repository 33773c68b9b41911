//! What is studied, on which machine, and for how long.

use std::{
    fs,
    time::{Duration, Instant},
};

/// What the hash of a scene is made from, and how.
pub(crate) const HASH_OF: &str = "the text of the scene file, xxh3 64";

/// What is studied, where and when.
pub(crate) struct Subject {
    /// The scene as the command line names it, without folder and extension.
    pub(crate) name: String,
    /// Where a coarser copy is studied in place of the scene, why, in a sentence.
    pub(crate) instead: Option<String>,
    /// Hash of its text, 16 hexadecimal digits.
    pub(crate) scene_hash: String,
    /// Whether all of the scene is studied, and no snow beside cloth is left out.
    pub(crate) is_whole: bool,
    /// What the system calls the processor.
    pub(crate) processor: String,
    pub(crate) threads: usize,
    pub(crate) budget: Duration,
    pub(crate) begin: Instant,
}

impl Subject {
    /// Words on it, after what is studied in place of the scene, where something is.
    pub(crate) fn said(&self, words: &str) -> String {
        self.instead.as_ref().map_or_else(|| words.to_owned(), |instead| format!("{instead}\n\n{words}"))
    }

    /// The same style, with that sentence before those of pictures.
    #[cfg(feature = "charts")]
    pub(crate) fn styled(&self, style: &nappe_charts::Style) -> nappe_charts::Style {
        nappe_charts::Style { before: self.instead.clone(), ..style.clone() }
    }

    /// What is left of its budget.
    pub(crate) fn left(&self) -> Duration {
        self.budget.saturating_sub(self.begin.elapsed())
    }
}

/// As many threads as are asked for, or as there are cores.
pub(crate) fn threads(asked: Option<u16>) -> usize {
    asked.map_or_else(rayon::current_num_threads, usize::from)
}

/// What the system calls the processor.
pub(super) fn processor() -> String {
    let text = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let name = text.lines().find_map(|line| line.strip_prefix("model name")?.split_once(':'));
    name.map_or_else(|| std::env::consts::ARCH.to_owned(), |(_, name)| name.trim().to_owned())
}

//! What is charted, on which machine, and for how long.

use std::time::{Duration, Instant};

/// What is charted, where and when.
pub(crate) struct Subject {
    /// The scene as the command line names it, without folder and extension.
    pub(crate) name: String,
    /// Hash of its text, 16 hexadecimal digits.
    pub(crate) scene_hash: String,
    /// What the system calls the processor.
    pub(crate) processor: String,
    pub(crate) threads: usize,
    pub(crate) budget: Duration,
    pub(crate) begin: Instant,
}

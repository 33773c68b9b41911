//! A row of a study of stability: one run, or the limit that some runs show.

use crate::{
    method::Method,
    run::{Cut, Verdict},
};

/// What the length of steps is varied for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Over {
    /// Small motions about the cloth as it lies, at rest.
    Rest,
    /// The scene itself.
    Load,
    /// A map, or the scene as the program runs it.
    Scene,
}

impl Over {
    /// Its name in tables: that of the axis.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Rest => "dt_at_rest",
            Self::Load => "dt_under_load",
            Self::Scene => "dt",
        }
    }
}

/// What a map varies beside the length of steps.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Across {
    /// The damping of everything elastic, times a factor.
    Damping,
    /// The same where the scene has none: a share of what is critical for the fastest mode.
    DampingRatio,
    /// By what share the start is pressed together along its longest side.
    Compression,
}

impl Across {
    /// Its name in tables: that of the axis.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Damping => "damping_factor",
            Self::DampingRatio => "damping_ratio",
            Self::Compression => "compression",
        }
    }
}

/// Whether a run takes its steps whatever is known of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stepping {
    /// Whatever is known of them.
    Raw,
    /// Certified before, or accepted after.
    Certified,
}

impl Stepping {
    /// Its name in tables.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Raw => "raw",
            Self::Certified => "certified",
        }
    }
}

/// One run, or the limit that some runs show.
#[derive(Clone, Debug, PartialEq)]
pub struct StabilityRow {
    /// How a step is made.
    pub method: Method,
    /// What the length of steps is varied for.
    pub over: Over,
    /// Length of its steps (s); of a limit, the longest that held; of one that is not known, it says nothing.
    pub dt: f64,
    /// What a map varies beside it, and its value.
    pub across: Option<(Across, f64)>,
    /// What became of it.
    pub verdict: Verdict,
    /// Why, in a sentence.
    pub cause: Option<String>,
    /// At rest: the largest energy over that of the start; where modes tell what becomes of explicit Euler, that of the mode
    /// that grows most, after as many steps. Otherwise: the greatest rise of the mechanical energy above that of
    /// a fine run at the same time, over the largest kinetic and elastic energy of that.
    pub growth: Option<f64>,
    /// Of a limit alone: the longest step that held (s), 0 where none did; none where all did that were tried, and where it is refused.
    pub limit: Option<f64>,
    /// Whether it is a limit.
    pub is_limit: bool,
    /// Of a limit under load: the longest step (s) that was tried, stable and right; 0 where none was, none where it is not known.
    pub right: Option<f64>,
    /// Why it was not followed to its end.
    pub cut: Option<Cut>,
    /// What theory says of it (s).
    pub theory: Option<f64>,
    /// Whether steps are taken whatever is known of them.
    pub stepping: Stepping,
    /// The step in which it showed, from 0.
    pub step: Option<u64>,
    /// The particle at which it showed, in the user's numbering.
    pub particle: Option<u64>,
    /// The certified bound of the method at the start (s), where it has one.
    pub bound: Option<f64>,
    /// Steps of the cloths, and those that were not accepted and taken again.
    pub taken: [u64; 2],
}

impl StabilityRow {
    /// A run of raw steps (s) that was not made yet.
    pub(super) fn new(method: Method, over: Over, dt: f64) -> Self {
        Self {
            method,
            over,
            dt,
            across: None,
            verdict: Verdict::NotKnown,
            cause: None,
            growth: None,
            limit: None,
            is_limit: false,
            right: None,
            cut: None,
            theory: None,
            stepping: Stepping::Raw,
            step: None,
            particle: None,
            bound: None,
            taken: [0; 2],
        }
    }

    /// Whether its first step was refused before it began: nothing is known of the method then.
    pub fn is_refused(&self) -> bool {
        self.verdict == Verdict::Refused && self.step.is_none() && self.across.is_none()
    }

    /// A limit that is not known, of a search that was given up.
    pub(super) fn unknown_limit(method: Method, over: Over, cut: Cut) -> Self {
        let cause = Some(cut.why().to_owned());
        Self { is_limit: true, cut: Some(cut), cause, ..Self::new(method, over, 0.0) }
    }
}

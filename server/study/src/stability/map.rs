//! Maps: the length of steps against damping, or against how far the start is pressed together.

use std::time::Instant;

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
};
use rayon::prelude::*;

use super::{
    ground::Ground,
    probe::{Probe, UnderLoad},
    row::{Across, Fate, Over, StabilityRow},
};
use crate::{
    budget::Phase,
    case::Case,
    method::Method,
    setting::{Setting, Steps},
};

/// Cells along each side of a map that is made first.
const COARSE: usize = 8;
/// The strongest compression.
const PRESSED: f64 = 0.4;
/// Decades of the factor on damping, from the smallest above 0.
const DECADES: [f64; 2] = [-3.0, 3.0];
/// Share of the time that is left which the cells of a finer map may be expected to take.
const SPARE: f64 = 0.7;
/// Share of its time that a column may take for its fine run.
const GROUND: f64 = 0.4;

/// What is mapped.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Map {
    /// Steps against damping, for the scene's own method and the best explicit one.
    Damping,
    /// Steps against compression, for implicit Euler with each Hessian, one solve per step.
    Compression,
}

impl Map {
    /// All of them.
    pub const ALL: [Self; 2] = [Self::Damping, Self::Compression];

    /// Its name in options and files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Damping => "damping",
            Self::Compression => "compression",
        }
    }
}

/// A method of a map, and the shortest and the longest of its steps (s).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Mapped {
    pub(super) method: Method,
    pub(super) range: [f64; 2],
}

/// A map on its way.
pub(super) struct Mapping<'a> {
    pub(super) case: &'a Case,
    pub(super) across: Across,
    pub(super) methods: Vec<Mapped>,
    /// Cells along each side.
    pub(super) cells: usize,
    /// Error (m) that matters.
    pub(super) tolerance: f64,
    /// The end of the scene (s).
    pub(super) end: f64,
}

/// Implicit Euler with each Hessian, one solve per step.
pub(super) fn hessians() -> impl Iterator<Item = Method> {
    Hessian::ALL.into_iter().map(|hessian| Method::new(Integrator::ImplicitEuler, hessian))
}

impl Mapping<'_> {
    /// Makes the cells: few of them first, then as many as the time allows. Says whether that is fewer than asked for.
    pub(super) fn make(&self, phase: &Phase) -> (Vec<StabilityRow>, bool) {
        let least = COARSE.min(self.cells);
        let begin = Instant::now();
        let is_whole = |rows: &[StabilityRow]| rows.iter().all(|row| row.fate != Fate::Stopped);
        let coarse = if phase.left().is_finite() { self.grid(least, phase) } else { Vec::new() };
        let ratio = (SPARE * phase.left() / begin.elapsed().as_secs_f64()).sqrt();
        let fitting = (least as f64 * ratio).min(self.cells as f64) as usize;
        if coarse.is_empty() || (fitting > least && is_whole(&coarse)) {
            let fine = self.grid(fitting, phase);
            if coarse.is_empty() || is_whole(&fine) {
                return (fine, fitting < self.cells);
            }
        }
        (coarse, least < self.cells)
    }

    /// So many cells along each side.
    fn grid(&self, cells: usize, phase: &Phase) -> Vec<StabilityRow> {
        let columns = (0..cells).map(|column| {
            let value = self.value(column, cells);
            self.column(value, cells, &phase.share(1.0 / (cells - column) as f64))
        });
        let mut rows: Vec<_> = columns.flatten().collect();
        let method = |row: &StabilityRow| self.methods.iter().position(|mapped| mapped.method == row.method);
        rows.sort_by_key(method);
        rows
    }

    /// Cells at one value of what is varied beside the step.
    fn column(&self, value: f64, cells: usize, phase: &Phase) -> Vec<StabilityRow> {
        let case = self.case.across(self.across, value);
        let of_method =
            |Mapped { method, range }: Mapped| (0..cells).map(move |i| (method, dt(range, i, cells)));
        let cells: Vec<_> = self.methods.iter().copied().flat_map(of_method).collect();
        let ground = match Ground::new(&case, self.end, self.tolerance, &phase.share(GROUND)) {
            Ok(ground) => ground,
            Err(cause) => {
                let refused = |(method, dt): (Method, f64)| StabilityRow {
                    across: Some((self.across, value)),
                    fate: Fate::Refused,
                    cause: Some(format!("no fine run to compare with: {cause}")),
                    ..Probe { case: &case, method, dt, steps: 0, over: Over::Scene }.row()
                };
                return cells.into_iter().map(refused).collect();
            }
        };
        let run = |(method, dt): (Method, f64)| {
            let probe = Probe { case: &case, method, dt, steps: ground.steps(dt), over: Over::Scene };
            let setting = Setting::new(method, Precision::F64, Steps::Divided(0));
            let setting = setting.solved(&case, self.tolerance, ground.window.max(dt));
            let row = probe.run_as(setting, &mut UnderLoad::new(&case, &ground, self.tolerance), phase);
            StabilityRow { across: Some((self.across, value)), ..row }
        };
        cells.into_par_iter().map(run).collect()
    }

    /// The value of what is varied beside the step, in one of so many columns.
    fn value(&self, column: usize, cells: usize) -> f64 {
        match self.across {
            Across::Compression => PRESSED * (column as f64 / (cells - 1).max(1) as f64),
            Across::Damping | Across::DampingRatio if column == 0 => 0.0,
            Across::Damping | Across::DampingRatio => {
                let share = (column - 1) as f64 / (cells.saturating_sub(2)).max(1) as f64;
                10_f64.powf(DECADES[0] + share * (DECADES[1] - DECADES[0]))
            }
        }
    }
}

/// One of so many steps (s) between the shortest and the longest, each as many times as long as the last.
fn dt([low, high]: [f64; 2], place: usize, cells: usize) -> f64 {
    low * (high / low).powf(place as f64 / (cells - 1).max(1) as f64)
}

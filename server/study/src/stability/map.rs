//! Maps: the length of steps against damping, or against how far the start is pressed together.

use nappe_sim::cloth::{Hessian, Integrator};
use rayon::prelude::*;

use super::{
    ground::Ground,
    probe::Probe,
    row::{Across, Over, StabilityRow},
};
use crate::{
    case::Case,
    method::Method,
    reference::NoReference,
    run::{Phase, Verdict},
};

/// Columns that are made first, at least.
const FEW: usize = 6;
/// The strongest compression.
const PRESSED: f64 = 0.4;
/// Decades of the factor on damping, from the smallest above 0.
const DECADES: [f64; 2] = [-3.0, 3.0];
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
    /// The fine run of the scene itself.
    pub(super) ground: &'a Ground,
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
    /// Makes the cells column by column, a few far apart first: those that there is no time for are not known.
    pub(super) fn make(&self, phase: &Phase) -> Vec<StabilityRow> {
        let mut columns = Vec::new();
        for column in order(self.cells) {
            columns.push((column, self.column(self.value(column, self.cells), phase)));
        }
        columns.sort_by_key(|(column, _)| *column);
        let mut rows: Vec<StabilityRow> = columns.into_iter().flat_map(|(_, rows)| rows).collect();
        let method = |row: &StabilityRow| self.methods.iter().position(|mapped| mapped.method == row.method);
        rows.sort_by_key(method);
        rows
    }

    /// Cells at one value of what is varied beside the step.
    fn column(&self, value: f64, phase: &Phase) -> Vec<StabilityRow> {
        let case = self.case.across(self.across, value);
        let of_method = |Mapped { method, range }: Mapped| {
            (0..self.cells).map(move |i| (method, dt(range, i, self.cells)))
        };
        let cells: Vec<_> = self.methods.iter().copied().flat_map(of_method).collect();
        let is_scene = case.setup == self.case.setup;
        let ground = if is_scene {
            Ok(self.ground.clone())
        } else if phase.is_over() {
            Err(NoReference::Time(f64::INFINITY))
        } else {
            Ground::new(&case, self.end, self.tolerance, self.ground.effort, phase)
        };
        let across = Some((self.across, value));
        let probe = |(method, dt): (Method, f64), steps: u64| Probe {
            case: &case,
            method,
            dt,
            steps,
            over: Over::Scene,
        };
        match ground {
            Ok(ground) => {
                let run = |cell: (Method, f64)| {
                    let row = probe(cell, ground.steps(cell.1)).judged(&ground, self.tolerance, phase);
                    StabilityRow { across, ..row }
                };
                cells.into_par_iter().map(run).collect()
            }
            Err(missing) => {
                let (verdict, cut, cause) = match missing {
                    NoReference::Time(_) => {
                        (Verdict::NotKnown, Some(phase.cut()), phase.cut().why().to_owned())
                    }
                    NoReference::Failed(cause) => {
                        (Verdict::Refused, None, format!("no fine run to compare with: {cause}"))
                    }
                };
                let without = |cell: (Method, f64)| StabilityRow {
                    across,
                    verdict,
                    cut,
                    cause: Some(cause.clone()),
                    ..probe(cell, 0).row()
                };
                cells.into_iter().map(without).collect()
            }
        }
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

/// Columns in the order in which they are made: every so many-th, then those halfway between them, and so on.
fn order(columns: usize) -> Vec<usize> {
    let mut stride = 1;
    while columns >= FEW * 2 * stride {
        stride *= 2;
    }
    let mut order: Vec<usize> = (0..columns).step_by(stride).collect();
    while stride > 1 {
        order.extend((stride / 2..columns).step_by(stride));
        stride /= 2;
    }
    order
}

/// One of so many steps (s) between the shortest and the longest, each as many times as long as the last.
fn dt([low, high]: [f64; 2], place: usize, cells: usize) -> f64 {
    low * (high / low).powf(place as f64 / (cells - 1).max(1) as f64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_column_is_made_once_and_the_first_ones_lie_far_apart() {
        for columns in [1, 4, 6, 11, 12, 24, 31] {
            let mut order = order(columns);
            let (first, second) = (order[0], order.get(1).copied());
            assert!(columns < 24 || second.is_some_and(|second| second - first >= 4), "{order:?}");
            order.sort_unstable();
            assert_eq!(order, (0..columns).collect::<Vec<_>>());
        }
    }
}

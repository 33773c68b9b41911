//! The longest step that is stable, and the rows of the search for it.

use super::{
    bisect::{Bisection, TimeIsOver},
    row::{Over, StabilityRow},
};
use crate::run::{Phase, Verdict};

/// The longest step whose error is within what is allowed and the shortest whose error is not are this near in the end.
const NEAR_RIGHT: f64 = 1.1;

/// Runs a step (s).
pub(super) type Run<'a> = dyn FnMut(f64, &Phase) -> StabilityRow + 'a;

/// A search for a limit, and the rows that it made.
pub(super) struct Search<'a> {
    pub(super) run: &'a mut Run<'a>,
    pub(super) rows: Vec<StabilityRow>,
    /// The shortest and the longest step that are tried (s).
    pub(super) range: [f64; 2],
}

impl Search<'_> {
    /// Looks for the limit from a step (s) on. The last row is the limit; it is not known where a run was not followed to its end, or
    /// was refused before its first step.
    pub(super) fn find(mut self, start: f64, phase: &Phase) -> Vec<StabilityRow> {
        let range = self.range;
        let mut holds = |dt: f64| self.verdict(dt, phase).map(Verdict::holds);
        let found = Bisection { holds: &mut holds, range }.lowest(start);
        let shown = |dt: f64| self.rows.iter().rfind(|row| row.dt == dt);
        let limit = match found {
            Ok([below, above]) => {
                shown(if below > 0.0 { below } else { above }).map(|row| limit_row(row, [below, above]))
            }
            Err(TimeIsOver) => self.rows.last().map(unknown),
        };
        self.rows.extend(limit);
        self.rows
    }

    fn verdict(&mut self, dt: f64, phase: &Phase) -> Result<Verdict, TimeIsOver> {
        let row = (self.run)(dt, phase);
        let verdict = row.verdict;
        // What is refused before its first step is so at any length of it.
        let is_open = verdict == Verdict::NotKnown || row.is_refused();
        self.rows.push(row);
        if is_open { Err(TimeIsOver) } else { Ok(verdict) }
    }

    /// Looks for the longest step whose error is within what is allowed, where the longest that holds is wrong: below it, by
    /// halves, until one is right, and between. That step (s), 0 where none is right; none where time was over.
    pub(super) fn find_right(mut self, from: f64, phase: &Phase) -> (Vec<StabilityRow>, Option<f64>) {
        let right = self.narrow_right(from, phase).ok();
        (self.rows, right)
    }

    fn narrow_right(&mut self, from: f64, phase: &Phase) -> Result<f64, TimeIsOver> {
        let mut above = from;
        let mut below = 0.5 * from;
        while self.verdict(below, phase)? != Verdict::Stable {
            (above, below) = (below, 0.5 * below);
            if below < self.range[0] {
                return Ok(0.0);
            }
        }
        while above > NEAR_RIGHT * below {
            let middle = (below * above).sqrt();
            let is_right = self.verdict(middle, phase)? == Verdict::Stable;
            *(if is_right { &mut below } else { &mut above }) = middle;
        }
        Ok(below)
    }
}

/// The limit that is not known, from the row of the run that ended the search.
fn unknown(last: &StabilityRow) -> StabilityRow {
    let StabilityRow { method, over, verdict, theory, bound, cause, cut, .. } = last.clone();
    StabilityRow {
        is_limit: true,
        verdict,
        theory,
        bound,
        cause,
        cut,
        ..StabilityRow::new(method, over, 0.0)
    }
}

/// The limit that lies between two steps (s), the first of which holds, from the row of one of them.
fn limit_row(row: &StabilityRow, [below, above]: [f64; 2]) -> StabilityRow {
    let (limit, cause) = if below == 0.0 {
        (Some(0.0), Some(format!("no step that was tried holds, down to {above:.3e} s")))
    } else if above.is_finite() {
        (Some(below), None)
    } else {
        (None, Some("it holds at the longest step that was tried".to_owned()))
    };
    let right = (row.over == Over::Load && row.verdict == Verdict::Stable).then_some(row.dt);
    StabilityRow { is_limit: true, limit, cause, right, ..row.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{method::Method, run::Budget, stability::row::Over};
    use nappe_sim::cloth::{Hessian, Integrator};

    fn row(dt: f64, verdict: Verdict) -> StabilityRow {
        let method = Method::new(Integrator::SymplecticEuler, Hessian::Absolute);
        StabilityRow { verdict, ..StabilityRow::new(method, Over::Rest, dt) }
    }

    fn found(edge: f64, start: f64) -> StabilityRow {
        let budget = Budget::new(None);
        let mut run = |dt: f64, _: &Phase| row(dt, if dt <= edge { Verdict::Stable } else { Verdict::Grows });
        let search = Search { run: &mut run, rows: Vec::new(), range: [1e-9, 1.0] };
        search.find(start, &budget.until(1.0)).pop().expect("a limit")
    }

    #[test]
    fn the_limit_is_found_from_above_and_from_below_to_a_fifth_of_a_percent() {
        for edge in [3e-7, 4.5e-3, 0.97] {
            for start in [1e-6, 1e-3, 0.9] {
                let found = found(edge, start);
                let limit = found.limit.expect("a limit");
                assert!(found.is_limit && limit <= edge && edge < 1.002 * limit, "{limit} of {edge}");
            }
        }
    }

    #[test]
    fn what_holds_beyond_a_step_that_does_not_is_no_limit() {
        let budget = Budget::new(None);
        let holds = |dt: f64| dt <= 0.031 || (0.0335..0.0345).contains(&dt);
        let mut run =
            |dt: f64, _: &Phase| row(dt, if holds(dt) { Verdict::Stable } else { Verdict::Indefinite });
        let search = Search { run: &mut run, rows: Vec::new(), range: [1e-9, 1.0] };
        let found = search.find(0.0344, &budget.until(1.0)).pop().and_then(|row| row.limit);
        assert!(found.is_some_and(|limit| (0.0308..=0.031).contains(&limit)), "{found:?}");
    }

    #[test]
    fn what_is_refused_before_its_first_step_has_no_limit_that_is_known() {
        let budget = Budget::new(None);
        let mut run = |dt: f64, _: &Phase| StabilityRow {
            cause: Some("it has a thickness".to_owned()),
            ..row(dt, Verdict::Refused)
        };
        let search = Search { run: &mut run, rows: Vec::new(), range: [1e-9, 1.0] };
        let rows = search.find(1e-3, &budget.until(1.0));
        assert_eq!(rows.len(), 2, "a run, and the limit");
        let limit = &rows[1];
        assert!(limit.is_limit && limit.is_refused() && limit.limit.is_none() && limit.cut.is_none());
        assert_eq!(limit.cause.as_deref(), Some("it has a thickness"));

        // A step that is refused later on does not hold, and is none of these.
        let mut run = |dt: f64, _: &Phase| StabilityRow { step: Some(3), ..row(dt, Verdict::Refused) };
        let search = Search { run: &mut run, rows: Vec::new(), range: [1e-9, 1.0] };
        let limit = search.find(1e-3, &budget.until(1.0)).pop().expect("a limit");
        assert_eq!((limit.limit, limit.is_refused()), (Some(0.0), false));
    }

    #[test]
    fn what_holds_at_every_step_and_what_holds_at_none_say_so() {
        let all = found(2.0, 1e-3);
        assert_eq!((all.limit, all.dt, all.verdict), (None, 1.0, Verdict::Stable));
        let none = found(0.0, 1e-3);
        assert_eq!((none.limit, none.dt, none.verdict), (Some(0.0), 1e-9, Verdict::Grows));
    }
}

//! The cheapest setting looked at again: timed beside the next two, with the longest step that is right enough, and with half of it.

use super::search::{RIGHT, Search};
use crate::{
    budget::Phase,
    row::Row,
    setting::{Setting, Steps},
    stepped::Stepped,
    timing,
};

/// Rows that are timed in turn, and how many times the evaluations and products of the cheapest they take at most.
const TIMED: usize = 3;
const NEAR: f64 = 1.5;
/// Seconds that differ by less decide nothing: counts do.
const TIE: f64 = 1.1;
/// Share of the tolerance that a step between two others may be off by: it was looked for at [`RIGHT`].
const ALMOST: f64 = 0.8;
/// How many times as large the error per step of the row before is, where steps are controlled.
const BETWEEN: f64 = 3.0;
/// Orders that two rows can show.
const ORDERS: std::ops::Range<f64> = 0.5..4.5;
/// The least share of the fall of the order that the error shows under half the step: it may fall faster.
const ASYMPTOTIC: f64 = 0.75;
/// The same of controlled steps, whose lengths do not halve alike.
const ASYMPTOTIC_CONTROLLED: f64 = 0.5;
/// How often a step is halved because its error does not fall as it should.
const TRIES: u32 = 2;

/// How the setting of a plan was verified.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Verified {
    /// Its error (m), run as a scene runs it over the whole window.
    pub error: f64,
    /// The same with half the step; none where there was no time for it.
    pub half_step_error: Option<f64>,
    /// The order that both show.
    pub order: Option<f64>,
    /// Whether the error falls as the order of the method says.
    pub is_asymptotic: bool,
    /// How often its step was halved because that of longer ones did not.
    pub halvings: u32,
}

/// The row to be recommended among those that are right enough, verified, with half the steps: the first that is within the
/// tolerance after that; none without any.
pub(super) fn verified(
    search: &mut Search<'_>,
    [timed, rest]: [&Phase; 2],
    tell: &dyn Fn(&str),
) -> Option<(Row, Verified)> {
    let mut right = search.right();
    let count = |place: usize| search.rows[place].count() as f64;
    let most = right.first().map_or(0.0, |place| NEAR * count(*place));
    let is_near = |place: &usize| count(*place) <= most;
    let mut later: Vec<usize> = right.extract_if(.., |place| !is_near(place)).collect();
    later.splice(..0, right.drain(TIMED.min(right.len())..));
    tell("timing the cheapest in turn");
    let mut rows: Vec<Row> =
        right.iter().map(|place| Row { front: true, ..search.rows[*place].clone() }).collect();
    timing::again(search.case, &mut rows, &search.times, timed);
    for (place, row) in right.iter().zip(&rows) {
        search.rows[*place] = Row { front: false, ..row.clone() };
    }
    if let Some(best) = cheapest(&rows) {
        rows[..=best].rotate_right(1);
    }
    rows.extend(later.iter().map(|place| search.rows[*place].clone()));
    tell("verifying the cheapest with half its step");
    let tolerance = search.tolerance;
    let mut verified = rows.into_iter().map(|row| {
        let row = longest(search, row, rest);
        halved(search, row, rest)
    });
    // An error that was small by chance may be large with half the step.
    verified.find(|(_, verified)| verified.error <= tolerance)
}

/// The place of the row that takes the fewest seconds; of those within a tenth of them that of the one that takes the fewest
/// counts, which rows are sorted by.
fn cheapest(rows: &[Row]) -> Option<usize> {
    let seconds = |row: &Row| row.seconds.unwrap_or(f64::INFINITY);
    let least = rows.iter().map(seconds).fold(f64::INFINITY, f64::min);
    rows.iter().position(|row| seconds(row) <= TIE * least)
}

/// The row with the longest step that is right enough: between it and the one before, by the order that both show; controlled
/// ones by that of the method.
fn longest(search: &mut Search<'_>, row: Row, phase: &Phase) -> Row {
    let (Stepped::Cloth(setting), Some(error)) = (row.stepped, row.error()) else { return row };
    let ratio = RIGHT * search.tolerance / error;
    let longer = match setting.steps {
        Steps::Fixed(parts) => {
            let order = shown_order(search, setting, parts, error);
            let wanted = f64::from(parts) * ratio.powf(-order.recip());
            let fewer = (wanted.ceil() as u32).max(parts / 2 + 1);
            (fewer < parts).then_some(Steps::Fixed(fewer))
        }
        Steps::Controlled(tolerance) => {
            let longer = ratio.powf(1.0 + setting.method.order(0.0).recip()).min(BETWEEN);
            (longer > TIE).then_some(Steps::Controlled(longer * tolerance))
        }
        Steps::Divided(_) | Steps::Certified(_) | Steps::Own => None,
    };
    let Some(steps) = longer.filter(|_| !phase.is_over()) else { return row };
    let longer = search.verify(Setting { steps, ..setting }, phase);
    if longer.error().is_some_and(|error| error <= ALMOST * search.tolerance) { longer } else { row }
}

/// The order that a setting shows which divides a step of the scene into so many parts, next to half of them.
fn shown_order(search: &Search<'_>, setting: Setting, parts: u32, error: f64) -> f64 {
    let twice = Setting { steps: Steps::Fixed(parts / 2), ..setting };
    let is_before = |other: &&Row| other.stepped == Stepped::Cloth(twice);
    let before = search.rows.iter().find(is_before).and_then(Row::error);
    let shown = before.map(|before| (before / error).log2()).filter(|order| ORDERS.contains(order));
    shown.unwrap_or_else(|| setting.method.order(0.0))
}

/// The setting of a row of cloth with half its steps: controlled ones are half as long for an error per step that is smaller by
/// an order more than that of the method.
fn finer(row: &Row) -> Option<Setting> {
    let Stepped::Cloth(setting) = row.stepped else { return None };
    let steps = match setting.steps {
        Steps::Fixed(parts) => Steps::Fixed(2 * parts),
        Steps::Controlled(tolerance) => {
            Steps::Controlled(tolerance / (setting.method.order(0.0) + 1.0).exp2())
        }
        Steps::Divided(_) | Steps::Certified(_) | Steps::Own => return None,
    };
    Some(Setting { steps, ..setting })
}

/// The row, or one with half or a quarter of its step, whose error falls as it should under half of it.
fn halved(search: &mut Search<'_>, mut row: Row, phase: &Phase) -> (Row, Verified) {
    let error = row.error().unwrap_or(f64::INFINITY);
    let mut verified =
        Verified { error, half_step_error: None, order: None, is_asymptotic: false, halvings: 0 };
    for attempt in 0..=TRIES {
        let Some(setting) = finer(&row).filter(|_| !phase.is_over()) else { break };
        let half = search.verify(setting, phase);
        let Some(smaller) = half.error() else { break };
        let ratio = verified.error / smaller;
        (verified.half_step_error, verified.order) = (Some(smaller), Some(ratio.log2()));
        // With damping an order may be lost.
        let share = match setting.steps {
            Steps::Controlled(_) => ASYMPTOTIC_CONTROLLED,
            _ => ASYMPTOTIC,
        };
        verified.is_asymptotic = ratio >= share * setting.method.order(1.0).exp2();
        if verified.is_asymptotic || attempt == TRIES {
            break;
        }
        row = half;
        verified = Verified {
            error: smaller,
            half_step_error: None,
            order: None,
            is_asymptotic: false,
            halvings: attempt + 1,
        };
    }
    (row, verified)
}

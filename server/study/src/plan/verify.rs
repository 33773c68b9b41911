//! A setting that is accurate enough looked at again: the longest step that is accurate enough, half of that, and the seconds of the next two.

use nappe_sim::math::Precision;

use super::search::{RIGHT, can_be_asked, cost};
use crate::{
    case::{Case, Times},
    chart::{Row, Search, timing},
    method::{Setting, Stepped, Steps},
    run::Phase,
};

/// Rows that are timed in turn, and how many times the cost of the cheapest they have at most.
const TIMED: usize = 3;
const NEAR: f64 = 1.5;
/// Share of the seconds of what is recommended below which another is quicker.
const QUICKER: f64 = 0.9;
/// How much longer the steps of controlled methods are at least, for another run to be worth it.
const LONGER: f64 = 1.1;
/// Share of the tolerance that a step between two others may be off by: it was looked for at [`RIGHT`].
const ALMOST: f64 = 0.8;
/// Share of the tolerance below which errors show no order: the reference is not known as well.
const NOTHING: f64 = 0.01;
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
    /// The same with half the step; none where such a run failed, or there was no time for it.
    pub half_step_error: Option<f64>,
    /// The order that both show; none where both are next to nothing, and of snow.
    pub order: Option<f64>,
    /// Whether the error falls as the order of the method says; of snow, whether it falls.
    pub is_asymptotic: bool,
    /// How often its step was halved because that of longer ones did not.
    pub halvings: u32,
    /// Whether half the step was not run to its end for want of time.
    pub is_cut: bool,
}

impl Verified {
    /// Of an error (m), and of nothing else yet.
    pub(super) const fn new(error: f64) -> Self {
        Self { error, half_step_error: None, order: None, is_asymptotic: false, halvings: 0, is_cut: false }
    }
}

/// Times a row in turn with the next two among others, whose places are in the order of their cost; gives the quickest of them where
/// it takes less than nine tenths of the seconds.
pub(super) fn quicker(
    (case, times): (&Case, &Times),
    row: &mut Row,
    others: &mut [Row],
    places: &[usize],
    phase: &Phase,
) -> Option<Row> {
    let (own, most) = (method(row), NEAR * cost(row));
    let is_other = |place: &usize| method(&others[*place]) != own && cost(&others[*place]) <= most;
    let places: Vec<usize> = places.iter().copied().filter(is_other).take(TIMED - 1).collect();
    let all = std::iter::once(&*row).chain(places.iter().map(|place| &others[*place]));
    let mut timed: Vec<Row> = all.map(|row| Row { front: true, ..row.clone() }).collect();
    timing::again(case, &mut timed, times, phase);
    (row.seconds, row.minimum_seconds) = (timed[0].seconds, timed[0].minimum_seconds);
    for (place, timed) in places.iter().zip(&timed[1..]) {
        let (seconds, minimum_seconds) = (timed.seconds, timed.minimum_seconds);
        others[*place] = Row { seconds, minimum_seconds, ..others[*place].clone() };
    }
    let limit = QUICKER * row.seconds?;
    let seconds = |place: &usize| others[*place].seconds.unwrap_or(f64::INFINITY);
    let quickest = places.iter().min_by(|a, b| seconds(a).total_cmp(&seconds(b)))?;
    (seconds(quickest) < limit).then(|| others[*quickest].clone())
}

/// The method of a row, in its precision.
fn method(row: &Row) -> (String, Precision) {
    (row.stepped.name(), row.stepped.precision())
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

/// Rows that verify what a search found, and what they are looked for in.
pub(super) struct Verification<'a> {
    pub(super) search: &'a Search<'a>,
    pub(super) rows: Vec<Row>,
}

impl Verification<'_> {
    /// A row that is accurate enough with the longest step that is, verified with half of it.
    pub(super) fn verified(&mut self, row: Row, phase: &Phase) -> (Row, Verified) {
        let row = self.longest(row, phase);
        self.halved(row, phase)
    }

    /// The row with the longest step that is accurate enough: between it and the one before, by the order that both show; controlled
    /// ones by that of the method.
    fn longest(&mut self, row: Row, phase: &Phase) -> Row {
        let (Stepped::Cloth(setting), Some(error)) = (row.stepped, row.error()) else { return row };
        let ratio = RIGHT * self.search.tolerance / error;
        let longer = match setting.steps {
            Steps::Fixed(parts) => {
                let order = shown_order(self.search, setting, parts, error);
                let wanted = f64::from(parts) * ratio.powf(-order.recip());
                let fewer = (wanted.ceil() as u32).max(parts / 2 + 1);
                (fewer < parts).then_some(Steps::Fixed(fewer))
            }
            Steps::Controlled(tolerance) => {
                let longer = ratio.powf(1.0 + setting.method.order(0.0).recip()).min(BETWEEN);
                (longer > LONGER).then_some(Steps::Controlled(longer * tolerance))
            }
            Steps::Divided(_) | Steps::Certified(_) | Steps::Own => None,
        };
        let wanted = longer.filter(|steps| can_be_asked(*steps) && !phase.is_over());
        let Some(steps) = wanted else { return row };
        let longer = self.run(Setting { steps, ..setting }, phase);
        if longer.error().is_some_and(|error| error <= ALMOST * self.search.tolerance) { longer } else { row }
    }

    /// The row, or one with half or a quarter of its step, whose error falls as it should under half of it.
    fn halved(&mut self, mut row: Row, phase: &Phase) -> (Row, Verified) {
        let mut verified = Verified::new(row.error().unwrap_or(f64::INFINITY));
        for attempt in 0..=TRIES {
            let Some(setting) = finer(&row) else { break };
            if phase.is_over() {
                verified.is_cut = true;
                break;
            }
            let half = self.run(setting, phase);
            verified.is_cut = half.end.cut().is_some();
            let Some(smaller) = half.error() else { break };
            let ratio = verified.error / smaller;
            // With damping an order may be lost.
            let share = match setting.steps {
                Steps::Controlled(_) => ASYMPTOTIC_CONTROLLED,
                _ => ASYMPTOTIC,
            };
            let is_nothing = verified.error.max(smaller) <= NOTHING * self.search.tolerance;
            verified.half_step_error = Some(smaller);
            verified.order = Some(ratio.log2()).filter(|order| !is_nothing && order.is_finite());
            verified.is_asymptotic = is_nothing || ratio >= share * setting.method.order(1.0).exp2();
            if verified.is_asymptotic || attempt == TRIES || !can_be_asked(setting.steps) {
                break;
            }
            row = half;
            verified = Verified { halvings: attempt + 1, ..Verified::new(smaller) };
        }
        (row, verified)
    }

    fn run(&mut self, setting: Setting, phase: &Phase) -> Row {
        let (row, _) = self.search.run(setting, phase, u64::MAX);
        self.rows.push(row.clone());
        row
    }
}

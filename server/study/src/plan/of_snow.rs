//! The plan of a scene of snow: its chart, the cheapest row on the scene's cells run as a scene runs it, and the terms of that.

use super::{
    answer::{Plan, most_accurate},
    of_cloth::steps,
    reach::Sought,
    search::by_cost,
    terms::{Looked, Recommended, SceneTerms, terms},
    verify::{Verified, quicker},
};
use crate::{
    case::{Case, Times},
    chart::{Chart, Request, Row},
    method::{SnowSetting, SnowSteps, Stepped},
    reference::Reference,
    run::{Budget, Phase, run},
};

/// Shares of the budget at whose end each part is over, after the chart.
const VERIFIED: f64 = 0.90;
const REACHED: f64 = 0.93;
const TIMED: f64 = 0.94;
const TERMS: f64 = 1.0;

/// The plan of a chart of snow: of its settings on the scene's cells. What its reference does not know is no promise.
pub(super) fn of_snow(
    case: &Case,
    mut chart: Chart,
    request: &Request,
    scene: &SceneTerms<'_>,
    budget: &Budget,
    tell: &dyn Fn(&str),
) -> Plan {
    let cell = chart.rows.iter().find(|row| row.own).and_then(|row| row.stepped.cell());
    let Some(reference) = chart.reference.clone() else { return Plan::nothing(chart) };
    let mut look = Look {
        case,
        reference: &reference,
        times: reference.times.in_steps(case.dt()),
        allowed: chart.tolerance - chart.floor,
        rows: Vec::new(),
    };
    let places = look.right(&chart.rows, cell);
    let steps = steps(case, request, chart.until());
    let allowed = [look.allowed; 2];
    let mut verify = |place: usize, phase: &Phase| look.verified(&chart.rows[place], phase);
    let within = (budget, [VERIFIED, REACHED]);
    let mut sought = Sought::of((case, steps), &places, allowed, &mut verify, within, tell);
    let quicker = sought.found.as_mut().and_then(|found| {
        tell("timing the cheapest in turn");
        let phase = budget.until(TIMED);
        quicker((case, &look.times), &mut found.row, &mut chart.rows, &places, &phase)
    });
    let all: Vec<usize> = (0..reference.states.len()).collect();
    let looked = sought.met().map_or_else(Looked::default, |found| {
        let (times, places, tolerance) = (&look.times, &all[..], look.allowed);
        let recommended = Recommended { case, found, reference: &reference, times, places, tolerance, steps };
        terms(&recommended, scene, &budget.until(TERMS), tell)
    });
    let nearest = most_accurate(&chart.rows, chart.floor, |row| row.stepped.cell() == cell);
    let searched = chart.rows.len();
    chart.rows.iter_mut().for_each(|row| row.front = false);
    chart.rows.append(&mut look.rows);
    let met_until = if sought.met().is_some() { chart.until() } else { 0.0 };
    Plan { searched, quicker, met_until, ..Plan::of(chart, sought, looked, nearest) }
}

/// Where rows of a chart are run again, in the steps of the scene.
struct Look<'a> {
    case: &'a Case,
    reference: &'a Reference,
    /// The times of the reference, in steps of the scene.
    times: Times,
    /// The error (m) that is allowed beside what the reference does not know.
    allowed: f64,
    /// What was run.
    rows: Vec<Row>,
}

impl Look<'_> {
    /// Places of the rows on cells (m) that are accurate enough, the cheapest first.
    fn right(&self, rows: &[Row], cell: Option<f64>) -> Vec<usize> {
        let is_right = |place: &usize| {
            let row = &rows[*place];
            let is_near = row.error().is_some_and(|error| error <= self.allowed);
            row.stepped.cell() == cell && !row.own && is_near
        };
        by_cost(rows, (0..rows.len()).filter(is_right))
    }

    /// The setting of a row in steps of the scene, and with half of its own steps: no order is known of these, but the error is to
    /// stay within what is allowed.
    fn verified(&mut self, known: &Row, phase: &Phase) -> (Row, Verified) {
        let error_of = |row: &Row| row.error().unwrap_or(f64::INFINITY);
        let Stepped::Snow(setting) = known.stepped else {
            return (known.clone(), Verified::new(f64::INFINITY));
        };
        let row = self.run(setting, phase);
        if row.end.cut().is_some() {
            return (known.clone(), Verified { is_cut: true, ..Verified::new(error_of(known)) });
        }
        let error = error_of(&row);
        let steps = match setting.steps {
            SnowSteps::Share(share) => SnowSteps::Share(0.5 * share),
            SnowSteps::Own => SnowSteps::Own,
        };
        let half = self.run(SnowSetting { steps, ..setting }, phase);
        let is_cut = half.end.cut().is_some();
        let half_step_error = half.error();
        let is_asymptotic = half_step_error.is_some_and(|smaller| smaller <= error);
        (row, Verified { half_step_error, is_asymptotic, is_cut, ..Verified::new(error) })
    }

    fn run(&mut self, setting: SnowSetting, phase: &Phase) -> Row {
        let made = run(self.case, &setting, &self.times, phase);
        let places: Vec<usize> = (0..self.reference.states.len()).collect();
        let row = Row::new(self.case, &setting, &made, (self.reference, &places));
        self.rows.push(row.clone());
        row
    }
}

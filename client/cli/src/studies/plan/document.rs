//! What a plan says, as JSON.

use nappe_study::{Dropped, Effort, End, Plan, Row, Term, Tried};
use serde::Serialize;
use serde_json::{Value, json};

use super::words;
use crate::{
    studies::{
        chart::document::compared,
        study::{HASH_OF, Subject},
    },
    words::output,
};

/// The first fields, which the last line of output begins with too. Their names and their order stay.
#[derive(Debug, Serialize)]
pub(super) struct First {
    scene: String,
    tolerance_m: f64,
    met: bool,
    method: Option<String>,
    precision: Option<String>,
    dt: Option<f64>,
    error_m: Option<f64>,
    seconds_per_simulated_second: Option<f64>,
}

/// The first fields, and others after them.
#[derive(Debug, Serialize)]
pub(super) struct Document {
    #[serde(flatten)]
    first: First,
    #[serde(flatten)]
    rest: Value,
}

impl Document {
    /// The first fields of a plan, and others.
    pub(super) fn new(subject: &Subject, plan: &Plan, rest: Value) -> Self {
        let row = plan.written();
        let first = First {
            scene: subject.name.clone(),
            tolerance_m: plan.chart.tolerance,
            met: plan.is_met,
            method: row.map(|row| row.stepped.name()),
            precision: row.map(|row| row.stepped.precision().to_string()),
            dt: row.map(|row| row.dt),
            error_m: row.and_then(Row::error),
            seconds_per_simulated_second: row.and_then(|row| row.seconds),
        };
        Self { first, rest }
    }
}

/// A row, as far as it takes to find it.
fn place(row: &Row) -> Value {
    json!({
        "method": row.stepped.name(),
        "precision": row.stepped.precision().to_string(),
        "dt": row.dt,
        "error_m": row.error(),
        "seconds_per_simulated_second": row.seconds,
    })
}

fn candidate(plan: &Plan, one: &Tried) -> Value {
    let row = one.row.and_then(|place| plan.chart.rows.get(place));
    json!({
        "method": one.name,
        "precision": one.precision.to_string(),
        "dt": row.map(|row| row.dt),
        "error_m": row.and_then(Row::error),
        "seconds_per_simulated_second": row.and_then(|row| row.seconds),
        "dropped": one.dropped.map(Dropped::why),
    })
}

fn term(term: &Term) -> Value {
    json!({
        "name": term.name,
        "change_m": term.change,
        "cause": term.failure,
        "looked_at": term.is_looked_at,
        "saving": term.saving,
        "saved_counts": term.saved_counts,
        "needed": term.is_needed,
        "left_out": term.is_left_out,
    })
}

/// The document. Its names stay.
pub(super) fn document(subject: &Subject, plan: &Plan) -> Document {
    let verified = plan.verified.map(|verified| {
        json!({
            "error_m": verified.error,
            "half_step_error_m": verified.half_step_error,
            "order": verified.order,
            "asymptotic": verified.is_asymptotic,
        })
    });
    let needed = plan.needed.map(|needed| {
        json!({ "dt": needed.dt, "cell_m": needed.cell, "seconds_per_simulated_second": needed.seconds })
    });
    let rested = plan.rested.map(|rested| {
        json!({
            "error_m": rested.error,
            "told_m": rested.told,
            "measured_m": rested.measured,
            "saved_counts": rested.saved_counts,
            "saving": rested.saving,
        })
    });
    let reach = plan.reach.as_ref();
    // What was not looked at is no promise.
    let known = reach.filter(|reach| reach.end.cut().is_none());
    // Snow that no plan looks at is part of the state of the scene that is written.
    let written = plan.written().filter(|_| subject.is_whole);
    let rest = json!({
        "until_s": plan.chart.until(),
        "compared": compared(&plan.chart),
        "compared_at": plan.compared_at(),
        "met_until_s": plan.met_until,
        "runs_until_s": known.map(|reach| reach.until),
        "runs_steps": known.map(|reach| reach.steps),
        "runs_end": reach.map(|reach| runs_end(&reach.end)),
        "runs_cause": reach.and_then(|reach| reach.end.failure()).map(|failure| &failure.cause),
        "state_hash": written.map(|row| output::hash(row.state_hash)),
        "cell_m": plan.written().and_then(|row| row.stepped.cell()),
        "step_tolerance_m": plan.row.as_ref().and_then(|row| row.stepped.step_tolerance()),
        "needed": needed,
        "together_change_m": plan.together_change,
        "terms": plan.terms.iter().map(term).collect::<Vec<_>>(),
        "candidates": plan.tried.iter().map(|one| candidate(plan, one)).collect::<Vec<_>>(),
        "verified": verified,
        "rest": rested,
        "quicker": plan.quicker.as_ref().map(place),
        "real_time": plan.real_time.as_ref().map(place),
        "reference_error_m": plan.chart.reference.as_ref().map(nappe_study::Reference::error),
        "floor_m": plan.chart.floor,
        "instead": subject.instead,
        "scene_hash": subject.scene_hash,
        "hash_of": HASH_OF,
        "version": env!("CARGO_PKG_VERSION"),
        "machine": { "processor": subject.processor, "threads": subject.threads },
        "budget_s": subject.budget.as_secs_f64(),
        "effort": plan.chart.effort.map(Effort::class),
        "elapsed_s": subject.begin.elapsed().as_secs_f64(),
        "cut": plan.chart.is_cut,
        "interrupted": plan.chart.is_stopped,
        "summary": words::answer(plan),
    });
    Document::new(subject, plan, rest)
}

/// Why it runs no further.
const fn runs_end(end: &End) -> &'static str {
    match end {
        End::Reached => "scene",
        End::Failed(_) => "failed",
        End::Cut(_) | End::Costly => "time",
    }
}

//! What a study of stability says beside its rows, as JSON.

use nappe_study::{DISPLACEMENT, Effort, NoReference, Over, SEED, Stability, StabilityRow, Verdict};
use serde_json::{Value, json};

use super::words;
use crate::studies::study::Subject;

/// The document. Its names stay.
pub(super) fn document(subject: &Subject, study: &Stability) -> Value {
    json!({
        "scene": subject.name,
        "scene_hash": subject.scene_hash,
        "version": env!("CARGO_PKG_VERSION"),
        "machine": { "processor": subject.processor, "threads": subject.threads },
        "seed": SEED,
        "tolerance_m": study.tolerance,
        "budget_s": subject.budget.as_secs_f64(),
        "effort": study.effort.map(Effort::class),
        "elapsed_s": subject.begin.elapsed().as_secs_f64(),
        "cut": study.is_cut,
        "interrupted": study.is_stopped,
        "window_s": study.window,
        "judged_until_s": study.judged,
        "displacement_m": DISPLACEMENT,
        "growth_rate_per_s": study.growth_rate,
        "certified_bound_s": study.bound.is_finite().then_some(study.bound),
        "frequency_rad_s": study.theory.as_ref().map(nappe_study::Theory::frequency),
        "missing": words::missing(study),
        "needed_s": match study.missing {
            Some(NoReference::Time(seconds)) if seconds.is_finite() => Some(seconds),
            _ => None,
        },
        "limits": {
            "at_rest": study.limits(Over::Rest).map(limit).collect::<Vec<_>>(),
            "under_load": study.limits(Over::Load).map(limit).collect::<Vec<_>>(),
        },
        "lost": study.lost().count(),
        "summary": words::summary(study),
    })
}

fn limit(row: &StabilityRow) -> Value {
    json!({
        "method": row.method.name(),
        "outcome": row.verdict.name(),
        "cut_reason": row.cut.map(nappe_study::Cut::why),
        "cause": row.is_refused().then_some(row.cause.as_deref()).flatten(),
        "limit_s": row.limit,
        "holds_up_to_s": (row.limit.is_none() && row.verdict.holds()).then_some(row.dt),
        "right_up_to_s": row.right,
        "theory_s": row.theory,
        "bound_s": row.bound,
        "finished": row.verdict != Verdict::NotKnown,
    })
}

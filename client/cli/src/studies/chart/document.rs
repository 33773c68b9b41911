//! What a chart says beside its rows, as JSON.

use nappe_study::{Chart, DISPLACEMENT, Effort, Limit, NoReference, Row, SEED};
use serde_json::{Value, json};

use super::words;
use crate::studies::study::{HASH_OF, Subject};

/// The document. Its names stay.
pub(crate) fn document(subject: &Subject, chart: &Chart) -> Value {
    let reference = chart.reference.as_ref();
    let finite = |value: f64| value.is_finite().then_some(value);
    json!({
        "scene": subject.name,
        "instead": subject.instead,
        "scene_hash": subject.scene_hash,
        "hash_of": HASH_OF,
        "version": env!("CARGO_PKG_VERSION"),
        "machine": { "processor": subject.processor, "threads": subject.threads },
        "seed": SEED,
        "displacement_m": DISPLACEMENT,
        "tolerance_m": chart.tolerance,
        "budget_s": subject.budget.as_secs_f64(),
        "effort": chart.effort.map(Effort::class),
        "elapsed_s": subject.begin.elapsed().as_secs_f64(),
        "cut": chart.is_cut,
        "interrupted": chart.is_stopped,
        "until_s": chart.until(),
        "compared": compared(chart),
        // Where nothing is known nothing limits it.
        "limit": chart.missing.is_none().then(|| limit(&chart.limit)),
        "interval_s": reference.map(|reference| reference.times.interval),
        "times_s": reference.map(|reference| {
            reference.times.marks.iter().map(|mark| reference.times.time(*mark)).collect::<Vec<_>>()
        }),
        "floor_m": reference.map(|_| chart.floor),
        "reference_error_m": reference.map(nappe_study::Reference::error),
        "reference": reference.map(|reference| json!({
            "method": reference.stepped.name(),
            "precision": reference.stepped.precision().to_string(),
            "dt": reference.step,
            "cell_m": reference.stepped.cell(),
            "own_error_m": reference.own_error,
            "order": reference.orders,
            "force_evaluations": reference.work.force_evaluations,
        })),
        "missing": chart.missing.as_ref().map(missing),
        "fits_until_s": chart.fits,
        "other_family": chart.other_family().map(place),
        "window": {
            "spacing_s": chart.scan.spacing,
            "spread_m": chart.scan.spread,
            "growth_rate_per_s": chart.growth_rate(),
            "dt": chart.scan.step,
            "certified_bound_s": finite(chart.scan.bound),
        },
        "front": chart.rows.iter().filter(|row| row.front).map(place).collect::<Vec<_>>(),
        "coarser": chart.coarser.as_ref().map(|copy| json!({
            "name": copy.name,
            "rows": copy.rows.iter().map(place).collect::<Vec<_>>(),
        })),
        "summary": words::summary(chart),
    })
}

/// What was compared, until when, of what, and at how many times.
pub(crate) fn compared(chart: &Chart) -> Value {
    json!({
        "measure": chart.measure.name(),
        "until_s": chart.until(),
        "of_s": chart.end,
        "times": chart.reference.as_ref().map_or(0, |reference| reference.times.marks.len()),
    })
}

/// A row, as far as it takes to find it.
fn place(row: &Row) -> Value {
    json!({
        "method": row.stepped.name(),
        "precision": row.stepped.precision().to_string(),
        "dt": row.dt,
        "rms_error_m": row.rms_error,
        "at_most_m": row.at_most,
        "seconds_per_simulated_second": row.seconds,
        "own": row.own,
    })
}

const fn limit(limit: &Limit) -> &'static str {
    match limit {
        Limit::Asked => "asked",
        Limit::Scene => "scene",
        Limit::Spread => "spread",
        Limit::Reference => "reference",
        Limit::Work => "work",
        Limit::Failed(_) => "failed",
    }
}

fn missing(missing: &NoReference) -> Value {
    match missing {
        NoReference::Time(seconds) => json!({ "cut_reason": "out of time", "needed_s": seconds }),
        NoReference::Failed(cause) => json!({ "cause": cause }),
    }
}

//! A session in words: as JSON for programs, as table rows for people; and what its failure means.
//!
//! Enters: `v1::Session`. Leaves: output, or an error of the command. The JSON is the contract's own: see
//! `nappe_proto`.

use nappe_client::{Reason, v1};

use crate::words::{
    error::{CliError, Exit, Result},
    output::{self, Column, Format},
};

/// The failure of a session as an error of this command; `None` while it has not failed.
pub(crate) fn failure(session: &v1::Session) -> Option<CliError> {
    let failure = session.failure.as_ref()?;
    let exit = if diverged(failure) { Exit::Diverged } else { Exit::Failure };
    Some(CliError::new(exit, format!("{} ({})", failure.message, failure.reason)))
}

/// Whether a failure comes from the numbers, and not from the program.
pub(crate) fn diverged(failure: &v1::Failure) -> bool {
    Reason::of(&failure.reason).is_some_and(Reason::is_divergence)
}

/// Prints one session.
///
/// # Errors
/// As [`output::line`].
pub(crate) fn print(session: &v1::Session, format: Format) -> Result<()> {
    match format {
        Format::Json => output::json(session),
        Format::Text => output::line(&text(std::slice::from_ref(session))),
    }
}

/// A table of sessions.
pub(crate) fn text(sessions: &[v1::Session]) -> String {
    let columns = [
        Column::Left("session"),
        Column::Left("state"),
        Column::Right("step"),
        Column::Right("time"),
        Column::Right("particles"),
        Column::Right("threads"),
        Column::Left("precision"),
        Column::Right("watchers"),
        Column::Left("title"),
    ];
    let rows: Vec<Vec<String>> = sessions
        .iter()
        .map(|session| {
            let step = match session.step_limit {
                0 => session.step.to_string(),
                limit => format!("{} of {limit}", session.step),
            };
            vec![
                session.session_id.clone(),
                session.state().word(),
                step,
                output::moment(session.time_seconds),
                output::count(session.particle_count),
                session.thread_count.to_string(),
                session.precision().word(),
                session.watcher_count.to_string(),
                session.title.clone(),
            ]
        })
        .collect();
    let failures: Vec<String> = sessions
        .iter()
        .filter_map(|session| {
            let failure = session.failure.as_ref()?;
            Some(format!("\n{}: {} ({})", session.session_id, failure.message, failure.reason))
        })
        .collect();
    output::table(&columns, &rows) + &failures.concat()
}

#[cfg(test)]
mod tests {
    use std::time::{Duration, SystemTime};

    use serde_json::{Value, json};

    use super::*;

    /// Diagnostics of a step with every part.
    fn diagnostics() -> v1::Diagnostics {
        let vector = |x, y, z| Some(v1::Vector3 { x, y, z });
        let mut snow = v1::SnowDiagnostics {
            substeps: 12,
            dt_seconds: 0.25,
            bound_seconds: f64::INFINITY,
            angular_momentum: vector(1.0, 2.0, 3.0),
            ..v1::SnowDiagnostics::default()
        };
        snow.set_bound(v1::TimeBound::ElasticWave);
        let mut solve =
            v1::SolveReport { iterations: 10, relative_residual: 0.5, ..v1::SolveReport::default() };
        solve.set_outcome(v1::SolveOutcome::Converged);
        v1::Diagnostics {
            step: 7,
            max_stretch: f64::NAN,
            momentum: vector(0.0, -1.0, 0.0),
            solve: Some(solve),
            stages: vec![v1::StageTime { stage: "force".to_owned(), seconds: 0.125 }],
            snow: Some(snow),
            ..v1::Diagnostics::default()
        }
    }

    fn json_of(value: &impl serde::Serialize) -> Value {
        serde_json::to_value(value).expect("it has a form in JSON")
    }

    #[test]
    fn a_session_in_json_has_the_contracts_fields_words_and_a_hash_of_16_digits() {
        let failure = v1::Failure { reason: "NOT_FINITE".to_owned(), step: 3, ..v1::Failure::default() };
        let mut session = v1::Session {
            session_id: "first".to_owned(),
            failure: Some(failure),
            state_hash: Some(255),
            create_time: Some((SystemTime::UNIX_EPOCH + Duration::from_mins(29_631_630)).into()),
            ..v1::Session::default()
        };
        session.set_state(v1::SessionState::Failed);
        session.set_precision(v1::Precision::F32);
        let expected = json!({
            "session_id": "first", "title": "", "state": "failed",
            "failure": {
                "reason": "NOT_FINITE", "message": "", "step": 3, "time_seconds": 0.0,
                "particle": null, "value": null,
            },
            "step": 0, "time_seconds": 0.0, "frame": 0, "oldest_frame": 0, "dt_seconds": 0.0, "step_limit": 0,
            "frame_interval_steps": 0, "precision": "f32", "thread_count": 0, "particle_count": 0,
            "spring_count": 0, "snow_particle_count": 0, "watcher_count": 0, "state_hash": "00000000000000ff",
            "diagnostics": null, "stepping_seconds": 0.0, "uid": "", "create_time": "2026-05-04T12:30:00Z",
            "parameters": null, "expires_in_seconds": null, "ranks": null,
            "largest_stretch": 0.0, "largest_stretch_seconds": 0.0, "durability": null,
        });
        assert_eq!(json_of(&session), expected);
        assert_eq!(json_of(&v1::Session::default())["state"], "unknown");
        assert_eq!(json_of(&v1::Session::default())["state_hash"], Value::Null);
    }

    #[test]
    fn diagnostics_in_json_hold_the_solver_beside_them_and_null_for_what_is_no_number() {
        let json = json_of(&diagnostics());
        assert_eq!((&json["step"], &json["iterations"]), (&7.into(), &10.into()));
        assert_eq!((&json["relative_residual"], &json["outcome"]), (&0.5.into(), &"converged".into()));
        assert_eq!(json["max_stretch"], Value::Null, "JSON has no NaN");
        assert_eq!(json["momentum"], json!([0.0, -1.0, 0.0]));
        assert_eq!(json["stages"], json!([{ "stage": "force", "seconds": 0.125 }]));
        assert_eq!((&json["snow"]["bound"], &json["snow"]["substeps"]), (&"elastic_wave".into(), &12.into()));
        assert_eq!(json["snow"]["bound_seconds"], Value::Null, "JSON has no infinity");
        assert_eq!(json["snow"]["angular_momentum"], json!([1.0, 2.0, 3.0]));
    }

    #[test]
    fn what_keeps_surfaces_apart_has_its_names_in_json() {
        let surface = v1::SurfaceReport { pairs: 5, active: 2, rounds: 3, ..v1::SurfaceReport::default() };
        let json = json_of(&v1::Diagnostics { surface: Some(surface), ..v1::Diagnostics::default() });
        let expected = json!({
            "pairs": 5, "active": 2, "rounds": 3, "least_gap_m": null, "failed": 0, "crossings": null,
            "yield_m": 0.0, "yielding": 0, "largest_push_n": 0.0,
        });
        assert_eq!(json["surface"], expected);
        assert_eq!(json_of(&v1::Diagnostics::default())["surface"], Value::Null);
    }

    #[test]
    fn what_lies_still_has_its_names_in_json() {
        let rest = v1::RestReport {
            calm_share: 0.5,
            pieces: 4,
            calm_pieces: 2,
            way_m: 0.25,
            change_m: 0.125,
            awake_share: 0.75,
            pieces_asleep: 1,
            told_m: 0.5,
            long_steps: 6,
            wakes: 3,
            wake_cause: Some(v1::WakeCause::Pin.into()),
        };
        let json = json_of(&v1::Diagnostics { rest: Some(rest), ..v1::Diagnostics::default() });
        let expected = json!({
            "calm_share": 0.5, "pieces": 4, "calm_pieces": 2, "way_m": 0.25, "change_m": 0.125,
            "awake_share": 0.75, "pieces_asleep": 1, "told_m": 0.5, "long_steps": 6, "wakes": 3,
            "wake_cause": "pin",
        });
        assert_eq!(json["rest"], expected);
        assert_eq!(json_of(&v1::Diagnostics::default())["rest"], Value::Null);
    }

    #[test]
    fn every_object_of_diagnostics_has_the_same_keys() {
        let keys = |diagnostics: &v1::Diagnostics| {
            let json = json_of(diagnostics);
            json.as_object().expect("an object").keys().cloned().collect::<Vec<_>>()
        };
        let explicit = v1::Diagnostics::default();
        assert_eq!(keys(&explicit), keys(&diagnostics()));
        assert_eq!(json_of(&explicit)["iterations"], Value::Null);
        for key in [
            "step",
            "time_seconds",
            "frame",
            "kinetic_energy",
            "elastic_energy",
            "gravitational_energy",
            "max_stretch",
            "contact_count",
            "step_seconds",
            "iterations",
            "relative_residual",
            "snow",
            "surface",
            "rest",
        ] {
            assert!(keys(&explicit).iter().any(|known| known == key), "{key}");
        }
    }
}

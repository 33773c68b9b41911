//! Fields whose shape in JSON is not that of their Rust type. `generate/build.rs` says which function writes which field.
#![allow(
    clippy::ref_option,
    clippy::trivially_copy_pass_by_ref,
    reason = "serde gives a reference to the field, whatever its type"
)]

use prost_types::Timestamp;
use serde::{Serialize as _, Serializer};

use crate::v1::{
    ForceUpdate, Precision, Quaternion, SessionState, SolveOutcome, SolveReport, SpringKind, TimeBound,
    Vector3, WakeCause,
};

/// Makes functions that write the number of a value of an enum as its word.
macro_rules! words {
    ($($name:ident: $kind:ident,)+) => {
        $(pub(crate) fn $name<S: Serializer>(value: &i32, serializer: S) -> Result<S::Ok, S::Error> {
            serializer.serialize_str(&$kind::try_from(*value).unwrap_or_default().word())
        })+
    };
}

words! {
    session_state: SessionState,
    precision: Precision,
    spring_kind: SpringKind,
    time_bound: TimeBound,
    solve_outcome: SolveOutcome,
}

/// Why cloth woke, as a word; null where none has.
pub(crate) fn wake_cause<S: Serializer>(value: &Option<i32>, serializer: S) -> Result<S::Ok, S::Error> {
    value.map(|cause| WakeCause::try_from(cause).unwrap_or_default().word()).serialize(serializer)
}

/// A hash of 64 bits as 16 hexadecimal digits: programs that read numbers as binary64 would lose its last bits.
pub(crate) fn state_hash<S: Serializer>(value: &Option<u64>, serializer: S) -> Result<S::Ok, S::Error> {
    value.map(|hash| format!("{hash:016x}")).serialize(serializer)
}

/// A time as RFC 3339 writes it: `2026-05-04T12:30:00Z`.
pub(crate) fn time<S: Serializer>(value: &Option<Timestamp>, serializer: S) -> Result<S::Ok, S::Error> {
    value.as_ref().map(ToString::to_string).serialize(serializer)
}

/// `[x, y, z]`; an absent vector is zero, as everywhere in proto3.
pub(crate) fn vector<S: Serializer>(value: &Option<Vector3>, serializer: S) -> Result<S::Ok, S::Error> {
    <[f64; 3]>::from(value.unwrap_or_default()).serialize(serializer)
}

/// `[x, y, z, w]`; an absent turn is none.
pub(crate) fn quaternion<S: Serializer>(
    value: &Option<Quaternion>,
    serializer: S,
) -> Result<S::Ok, S::Error> {
    value.map_or([0.0, 0.0, 0.0, 1.0], <[f64; 4]>::from).serialize(serializer)
}

/// Forces on bodies, each with its particles and with one force for all of them or a list; `null` where there is none.
pub(crate) fn forces<S: Serializer>(value: &[ForceUpdate], serializer: S) -> Result<S::Ok, S::Error> {
    serializer.collect_seq(value.iter().map(Acting::of))
}

/// Forces on a body.
#[derive(serde::Serialize)]
struct Acting<'a> {
    body: &'a str,
    particles: Option<Vec<u32>>,
    force: Option<[f64; 3]>,
    forces: Option<Vec<[f64; 3]>>,
}

impl<'a> Acting<'a> {
    fn of(update: &'a ForceUpdate) -> Self {
        Self {
            body: &update.body,
            particles: Some(update.particles()).filter(|particles| !particles.is_empty()),
            force: update.force.map(<[f64; 3]>::from),
            forces: Some(update.forces()).filter(|forces| !forces.is_empty()),
        }
    }
}

/// The fields of a solver's report; all `null` without one, so that every object has the same keys.
pub(crate) fn solve<S: Serializer>(value: &Option<SolveReport>, serializer: S) -> Result<S::Ok, S::Error> {
    #[derive(serde::Serialize)]
    struct Absent {
        outcome: (),
        iterations: (),
        relative_residual: (),
    }
    match value {
        Some(report) => report.serialize(serializer),
        None => Absent { outcome: (), iterations: (), relative_residual: () }.serialize(serializer),
    }
}

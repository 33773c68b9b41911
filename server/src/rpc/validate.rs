//! Checks of single fields of requests: ids, counts, rates, pages, fields of frames, nodes.
//!
//! Enters: a field of a request. Leaves: its meaning, or the reason why it is refused.

use std::time::Duration;

use nappe_proto::v1;

use crate::{
    config::Limits,
    error::{Reason, ServiceError},
    session::Steps,
    stream::{Delivery, EncodedField, FieldSet, GridChoice, Pace, Selection, Wanted},
};

/// Sessions in a page if the request names no size.
const PAGE_SIZE: usize = 50;
/// Sessions in the largest page.
const MAX_PAGE_SIZE: usize = 1000;

/// Simulated seconds per second at most; whoever wants more wants "as fast as possible".
const MAX_REAL_TIME_FACTOR: f64 = 1e6;

/// The id of a session: 1 to 63 letters (a-z, A-Z), digits and '-', which is not the first: a command takes it for an option.
///
/// # Errors
/// If it has another form.
pub(super) fn session_id(id: &str) -> Result<(), ServiceError> {
    id_in("session_id", id)
}

/// Checks an id that a request has in `field`, by the same rule.
///
/// # Errors
/// If it has another form.
pub(super) fn id_in(field: &str, id: &str) -> Result<(), ServiceError> {
    let allowed = |c: u8| c.is_ascii_alphanumeric() || c == b'-';
    if (1..=63).contains(&id.len()) && id.bytes().all(allowed) && !id.starts_with('-') {
        return Ok(());
    }

    let shown: String = id.chars().take(80).collect();
    let problem = format!(
        "is '{shown}': an id has 1 to 63 letters (a-z, A-Z), digits and '-', and does not start with '-'"
    );
    Err(ServiceError::field(field, problem).with("value", shown))
}

/// The number of sessions in a page.
///
/// # Errors
/// A negative size.
pub(super) fn page_size(asked: i32) -> Result<usize, ServiceError> {
    match usize::try_from(asked) {
        Ok(0) => Ok(PAGE_SIZE),
        Ok(size) => Ok(size.min(MAX_PAGE_SIZE)),
        Err(_negative) => {
            let problem =
                format!("is {asked}: 0 ({PAGE_SIZE}) or more, and {MAX_PAGE_SIZE} count as the most");
            Err(ServiceError::field("page_size", problem).with("value", asked))
        }
    }
}

/// A page token: empty, or the id of the last session of the page before.
///
/// # Errors
/// If it has another form.
pub(super) fn page_token(token: &str) -> Result<(), ServiceError> {
    if token.is_empty() || session_id(token).is_ok() {
        return Ok(());
    }
    Err(ServiceError::new(Reason::InvalidPageToken, "page_token was not made by this server")
        .at_field("page_token", "was not made by this server"))
}

/// Simulated seconds per second of wall clock.
///
/// # Errors
/// A number below 0, beyond the largest, or not finite.
pub(super) fn real_time_factor(factor: f64) -> Result<f64, ServiceError> {
    if (0.0..=MAX_REAL_TIME_FACTOR).contains(&factor) {
        return Ok(factor);
    }
    let problem = format!("is {factor}: allowed are 0 (as fast as possible) to {MAX_REAL_TIME_FACTOR}");
    Err(ServiceError::field("real_time_factor", problem).with("value", factor))
}

/// The steps of a call to a session that has taken `taken`; a count of 0 asks for one.
///
/// # Errors
/// More than are allowed, or both a count and a step to reach.
pub(super) fn steps(
    request: &v1::StepSessionRequest,
    taken: u64,
    limits: &Limits,
) -> Result<Steps, ServiceError> {
    let most = limits.max_steps_per_call;
    let (field, value, allowed, steps) = match request.to_step {
        None => ("step_count", request.step_count, most, Steps::More(request.step_count.max(1))),
        Some(_) if request.step_count > 0 => {
            return Err(ServiceError::field("to_step", "goes without step_count: give one of them"));
        }
        Some(step) => ("to_step", step, taken.saturating_add(most), Steps::Until(step)),
    };
    if value <= allowed {
        return Ok(steps);
    }
    let problem = format!("is {value}: allowed are at most {allowed}, {most} steps in one call");
    Err(ServiceError::field(field, problem).with("value", value).with("allowed", allowed))
}

/// Least time between two frames; `None` for rate 0, which is no limit.
///
/// # Errors
/// A rate below 0 or not finite.
pub(super) fn period(max_rate_hz: f64) -> Result<Option<Duration>, ServiceError> {
    if max_rate_hz == 0.0 {
        return Ok(None);
    }

    if !max_rate_hz.is_finite() || max_rate_hz < 0.0 {
        let problem = format!("is {max_rate_hz}: allowed are 0 (no limit) and finite rates above it (Hz)");
        return Err(ServiceError::field("max_rate_hz", problem).with("value", max_rate_hz));
    }

    let longest = Duration::from_hours(24);
    Ok(Some(Duration::try_from_secs_f64(1.0 / max_rate_hz).map_or(longest, |period| period.min(longest))))
}

/// What a watcher wants of frames; `snow_cell` (m) is the side of the grid's cells, none without snow.
///
/// # Errors
/// A field or an encoding that does not exist, or nodes that cannot be chosen.
pub(super) fn wanted(
    request: &v1::WatchFramesRequest,
    snow_cell: Option<f64>,
    limits: &Limits,
) -> Result<Wanted, ServiceError> {
    let grid = request.grid.as_ref().map(|grid| self::grid(grid, snow_cell, limits)).transpose()?;
    Ok(Wanted { fields: fields("", &request.fields, request.encoding)?, grid })
}

/// Bytes of a frame in an answer, at most: gRPC's usual limit of 4 MiB leaves room for the rest of it.
const MAX_ANSWER_BYTES: u64 = 3 << 20;

/// The fields of the frame that a call to step is answered with, for a session of so many particles.
///
/// # Errors
/// A field or an encoding that does not exist, a frame without waiting for it, or one that is too large.
pub(super) fn answered_fields(
    request: &v1::StepSessionRequest,
    particle_count: u64,
) -> Result<Option<FieldSet>, ServiceError> {
    let Some(frame) = &request.frame else { return Ok(None) };
    if !request.wait {
        return Err(ServiceError::field("frame", "goes with wait only: it is made after the steps"));
    }

    let fields = fields("frame.", &frame.fields, frame.encoding)?;
    let bytes = fields.fields().map(|field| field.stride() as u64 * particle_count).sum::<u64>();
    if bytes > MAX_ANSWER_BYTES {
        let message =
            format!("the frame has {bytes} bytes; allowed in an answer: at most {MAX_ANSWER_BYTES}");
        return Err(ServiceError::new(Reason::FrameTooLarge, message)
            .with("bytes", bytes)
            .with("allowed", MAX_ANSWER_BYTES));
    }
    Ok(Some(fields))
}

/// The nodes of the snow's grid that a watcher wants.
fn grid(
    request: &v1::GridRequest,
    snow_cell: Option<f64>,
    limits: &Limits,
) -> Result<GridChoice, ServiceError> {
    use v1::grid_request::Selection as Message;
    let selection = match &request.selection {
        None => return Err(ServiceError::field("grid.selection", "is missing: all or slice is needed")),
        Some(Message::All(v1::AllNodes {})) => Selection::All,
        Some(Message::Slice(slice)) => {
            let coordinate = finite("grid.slice.coordinate", slice.coordinate)?;
            let axis = match v1::Axis::try_from(slice.axis) {
                Ok(v1::Axis::X) => 0,
                Ok(v1::Axis::Y) => 1,
                Ok(v1::Axis::Z) => 2,
                Ok(v1::Axis::Unspecified) => {
                    let problem = "is missing: AXIS_X, AXIS_Y or AXIS_Z is needed";
                    return Err(ServiceError::field("grid.slice.axis", problem));
                }
                Err(_unknown) => return Err(unknown_value("grid.slice.axis", slice.axis)),
            };
            Selection::Slice { axis, coordinate }
        }
    };
    if snow_cell.is_none() {
        return Err(ServiceError::field("grid", "is set, but the session has no snow, and so no grid"));
    }

    let allowed = limits.max_grid_nodes.max(1);
    let max_nodes = if request.max_nodes == 0 { allowed } else { request.max_nodes.min(allowed) };
    Ok(GridChoice { selection, max_nodes, has_forces: request.force })
}

/// The fields that a request names, positions if it names none; `within` stands before their names in messages.
fn fields(within: &str, named: &[i32], encoding: i32) -> Result<FieldSet, ServiceError> {
    let encoding = match v1::Encoding::try_from(encoding) {
        Ok(v1::Encoding::Unspecified) => v1::Encoding::RawF32,
        Ok(encoding) => encoding,
        Err(_unknown) => return Err(unknown_value(&format!("{within}encoding"), encoding)),
    };

    let mut fields = FieldSet::NONE;
    for (i, number) in named.iter().enumerate() {
        let field = v1::Field::try_from(*number).ok();
        let encoded = field.and_then(|field| EncodedField::of(field, encoding));
        let encoded = encoded.ok_or_else(|| unknown_value(&format!("{within}fields[{i}]"), *number))?;
        fields = fields.with(encoded);
    }

    if fields == FieldSet::NONE {
        fields = EncodedField::of(v1::Field::Positions, encoding).map_or(fields, |field| fields.with(field));
    }
    Ok(fields)
}

/// Which frames a watcher wants, from the three fields of its request that say so.
///
/// # Errors
/// A delivery that does not exist, or a field that belongs to the other delivery.
pub(super) fn delivery(
    delivery: i32,
    from_frame: Option<u64>,
    max_rate_hz: f64,
) -> Result<Delivery, ServiceError> {
    let period = period(max_rate_hz)?;
    match v1::Delivery::try_from(delivery) {
        Ok(v1::Delivery::Unspecified | v1::Delivery::Latest) => match from_frame {
            None => Ok(Delivery::Latest { period }),
            Some(_) => Err(ServiceError::field("from_frame", "goes with DELIVERY_EVERY only")),
        },
        Ok(v1::Delivery::Every) => match period {
            None => Ok(Delivery::Every { from_frame, pace: Pace::Session }),
            Some(_) => Err(ServiceError::field("max_rate_hz", "goes with DELIVERY_LATEST only")),
        },
        Err(_unknown) => Err(unknown_value("delivery", delivery)),
    }
}

/// The delivery of frames: that of the three fields, and whether the session waits for the watcher.
///
/// # Errors
/// Those of [`delivery`], or a session that is to wait for a watcher of the newest.
pub(super) fn frame_delivery(request: &v1::WatchFramesRequest) -> Result<Delivery, ServiceError> {
    match delivery(request.delivery, request.from_frame, request.max_rate_hz)? {
        Delivery::Every { from_frame, .. } if request.pace_to_watcher => {
            Ok(Delivery::Every { from_frame, pace: Pace::Watcher })
        }
        Delivery::Latest { .. } if request.pace_to_watcher => {
            Err(ServiceError::field("pace_to_watcher", "goes with DELIVERY_EVERY only"))
        }
        delivery => Ok(delivery),
    }
}

/// A number that must be finite.
///
/// # Errors
/// Infinities and NaN.
pub(super) fn finite(field: &str, value: f64) -> Result<f64, ServiceError> {
    if value.is_finite() {
        return Ok(value);
    }
    Err(ServiceError::field(field, format!("is {value}: a finite number is needed")).with("value", value))
}

/// The error of an enum's number that this version does not know.
pub(super) fn unknown_value(field: &str, value: i32) -> ServiceError {
    ServiceError::field(field, format!("is {value}, which this version does not know")).with("value", value)
}

/// A vector of finite numbers.
///
/// # Errors
/// The first that is not.
pub(super) fn finite_vector(field: &str, vector: v1::Vector3) -> Result<[f64; 3], ServiceError> {
    let v1::Vector3 { x, y, z } = vector;
    Ok([
        finite(&format!("{field}.x"), x)?,
        finite(&format!("{field}.y"), y)?,
        finite(&format!("{field}.z"), z)?,
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ids_follow_the_rule() {
        for good in ["a", "Z", "7", "a-1-", "demo-2", "2nd-Try", &"z".repeat(63), &"Z".repeat(63)] {
            assert!(session_id(good).is_ok(), "{good}");
        }
        for bad in
            ["", "-", "-abc", "ab_d", "ab d", "a.b", "a/b", "abcé", "é", &"z".repeat(64), &"Z".repeat(64)]
        {
            assert!(session_id(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_grid_is_asked_for_with_a_selection_and_at_most_what_is_allowed() {
        use v1::grid_request::Selection as Message;
        let limits = Limits { max_grid_nodes: 100, ..Limits::default() };
        let asked = |selection, max_nodes| {
            grid(&v1::GridRequest { selection, max_nodes, force: false }, Some(0.1), &limits)
        };
        let all = Some(Message::All(v1::AllNodes {}));
        for (max_nodes, most) in [(0, 100), (7, 7), (100, 100), (u32::MAX, 100)] {
            let choice = GridChoice { selection: Selection::All, max_nodes: most, has_forces: false };
            assert_eq!(asked(all, max_nodes).expect("all nodes"), choice);
        }

        let slice = |axis, coordinate| Some(Message::Slice(v1::SliceNodes { axis, coordinate }));
        let selection = Selection::Slice { axis: 2, coordinate: -0.25 };
        let choice = GridChoice { selection, max_nodes: 5, has_forces: false };
        assert_eq!(asked(slice(v1::Axis::Z.into(), -0.25), 5).expect("a slice"), choice);
        let y = v1::Axis::Y.into();
        for bad in [None, slice(0, 0.0), slice(9, 0.0), slice(y, f64::NAN), slice(y, f64::INFINITY)] {
            assert_eq!(asked(bad, 0).expect_err("no choice").reason, Reason::InvalidField);
        }

        let request = v1::GridRequest { selection: all, max_nodes: 0, force: true };
        assert!(grid(&request, Some(0.1), &limits).expect("all nodes").has_forces);
        let refused = grid(&request, None, &limits).expect_err("cloth has no grid");
        assert!(refused.message.contains("no snow"), "{refused}");
    }

    #[test]
    fn numbers_out_of_range_are_refused() {
        assert!(page_size(-1).is_err());
        assert_eq!(page_size(0).expect("default"), PAGE_SIZE);
        assert_eq!(page_size(i32::MAX).expect("the most"), MAX_PAGE_SIZE);
        for bad in [-1.0, f64::NAN, f64::INFINITY] {
            assert!(real_time_factor(bad).is_err() && period(bad).is_err());
        }

        assert_eq!(period(0.0).expect("no limit"), None);
        assert_eq!(period(50.0).expect("a rate"), Some(Duration::from_millis(20)));
        assert!(period(f64::MIN_POSITIVE).expect("a tiny rate").is_some());
    }
}

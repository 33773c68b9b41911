//! Whether the numbers of changes are within their ranges, whatever the bodies are.

use super::{
    changes::{Change, ChangeError, allowed},
    collider_move::{ColliderMove, MoveKey},
};
use crate::world::setup::pulls::Pull;

/// Each body has one state at most, before the numbers of any are looked at.
pub(crate) fn check_bodies_put(changes: &[Change]) -> Result<(), ChangeError> {
    let bodies = changes.iter().filter_map(|change| match change {
        Change::State { body, .. } => Some(body),
        _ => None,
    });
    let mut put: Vec<(&String, usize)> = bodies.zip(0..).collect();
    put.sort_unstable();
    match put.windows(2).find(|pair| pair[0].0 == pair[1].0) {
        Some(pair) => {
            let [(body, first), (_, second)] = [pair[0], pair[1]];
            Err(ChangeError::StateTwice { body: body.clone(), first, second })
        }
        None => Ok(()),
    }
}

/// Times that grow, positions within their range.
pub(crate) fn check_path(particle: u32, points: &[(f64, [f64; 3])]) -> Result<(), ChangeError> {
    if points.is_empty() {
        return Err(ChangeError::EmptyPath { particle });
    }
    let mut after = 0.0;
    for (point, (time, target)) in points.iter().enumerate() {
        within("times", &[*time], allowed::DURATION)?;
        within("targets", target, allowed::LENGTH)?;
        if *time <= after {
            return Err(ChangeError::TimesOfPath { particle, point, time: *time, after });
        }
        after = *time;
    }
    Ok(())
}

/// Times and positions of a move within their ranges.
pub(crate) fn check_keys(ColliderMove { keys, .. }: &ColliderMove) -> Result<(), ChangeError> {
    let of_time = if keys.len() == 1 { "duration" } else { "times" };
    for MoveKey { time, position, .. } in keys.iter() {
        within(of_time, &[*time], allowed::DURATION)?;
        within("position", position.as_slice().as_flattened(), allowed::LENGTH)?;
    }
    Ok(())
}

/// Numbers within what is allowed, both ends included.
pub(crate) fn within(field: &'static str, values: &[f64], allowed: [f64; 2]) -> Result<(), ChangeError> {
    let [low, high] = allowed;
    let wrong = values.iter().find(|value| !(low..=high).contains(*value));
    wrong.map_or(Ok(()), |&value| Err(ChangeError::OutOfRange { field, value, allowed }))
}

/// Points (m), frequency (1/s), acceleration (m/s²) and time (s) of a pull within their ranges, in steps of `dt` (s). One that
/// ends pulls needs none of the others.
pub(crate) fn check_pull_numbers(asked: &Pull, dt: f64) -> Result<(), ChangeError> {
    let Pull { points, frequency, most, seconds, .. } = asked;
    if points.is_empty() {
        return Ok(());
    }
    within("points", points.as_flattened(), allowed::LENGTH)?;
    within("frequency", &[*frequency], Pull::frequencies(dt))?;
    within("most", &[*most], Pull::MOST)?;
    within("seconds", &[*seconds], Pull::SECONDS)
}

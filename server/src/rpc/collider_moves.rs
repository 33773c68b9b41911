//! Moves of colliders, as requests and as the list of what waits have them.
//!
//! Enters: where a collider is to go. Leaves: a change of the simulation, or the first invalid field; and back. Names,
//! ranges, lengths of turns, and that times grow, are the simulation's to check.

use nappe_proto::v1;
use nappe_sim::world::{Change, ColliderMove, MoveKey};

use super::validate::{finite, finite_vector};
use crate::error::ServiceError;

/// A move to one pose.
///
/// # Errors
/// Neither a position nor a turn, or a number that is not finite.
pub(super) fn update(field: &str, update: &v1::ColliderUpdate) -> Result<Change, ServiceError> {
    let v1::ColliderUpdate { name, position, turn, duration_seconds } = update;
    if position.is_none() && turn.is_none() {
        return Err(ServiceError::field(field, "has neither position nor turn: one is needed"));
    }
    let key = MoveKey {
        time: finite(&format!("{field}.duration_seconds"), *duration_seconds)?,
        position: position.map(|to| finite_vector(&format!("{field}.position"), to)).transpose()?,
        turn: turn.map(|to| finite_turn(&format!("{field}.turn"), to)).transpose()?,
    };
    Ok(Change::Collider(ColliderMove { collider: name.clone(), keys: [key].into() }))
}

/// A move through several poses.
///
/// # Errors
/// Lists that do not go with the times, a number that is not finite, or a first time that is not above 0.
pub(super) fn path(field: &str, path: &v1::ColliderPath) -> Result<Change, ServiceError> {
    let v1::ColliderPath { name, times_seconds: times, positions, turns } = path;
    if positions.is_empty() && turns.is_empty() {
        return Err(ServiceError::field(field, "has neither positions nor turns: one is needed"));
    }
    let of_times = format!("{field}.times_seconds");
    for (at, time) in times.iter().enumerate() {
        finite(&format!("{of_times}[{at}]"), *time)?;
    }
    if let Some(first) = times.first().filter(|first| **first <= 0.0) {
        let problem = format!("begins at {first} s: a time above 0 s is needed");
        return Err(ServiceError::field(of_times, problem).with("value", first));
    }

    let positions = listed::<3>(&format!("{field}.positions"), positions, times.len(), "three")?;
    let turns = listed::<4>(&format!("{field}.turns"), turns, times.len(), "four")?;
    let keys = times.iter().enumerate().map(|(at, time)| MoveKey {
        time: *time,
        position: positions.map(|positions| positions[at]),
        turn: turns.map(|turns| turns[at]),
    });
    Ok(Change::Collider(ColliderMove { collider: name.clone(), keys: keys.collect() }))
}

/// `N` finite numbers for each time; none where the list is empty.
fn listed<'a, const N: usize>(
    field: &str,
    numbers: &'a [f64],
    times: usize,
    words: &str,
) -> Result<Option<&'a [[f64; N]]>, ServiceError> {
    let (chunks, rest) = numbers.as_chunks::<N>();
    if numbers.is_empty() {
        return Ok(None);
    }
    if chunks.len() != times || !rest.is_empty() {
        let problem = format!("has {} numbers: {words} for each of {times} times are needed", numbers.len());
        return Err(ServiceError::field(field, problem).with("numbers", numbers.len()).with("times", times));
    }
    for (at, number) in numbers.iter().enumerate() {
        finite(&format!("{field}[{at}]"), *number)?;
    }
    Ok(Some(chunks))
}

fn finite_turn(field: &str, turn: v1::Quaternion) -> Result<[f64; 4], ServiceError> {
    let v1::Quaternion { x, y, z, w } = turn;
    Ok([
        finite(&format!("{field}.x"), x)?,
        finite(&format!("{field}.y"), y)?,
        finite(&format!("{field}.z"), z)?,
        finite(&format!("{field}.w"), w)?,
    ])
}

/// Puts a move that waits into the request that asked for it. A path of one pose is told as the update that it equals.
pub(super) fn tell(request: &mut v1::UpdateParametersRequest, asked: &ColliderMove) {
    let ColliderMove { collider, keys } = asked;
    match **keys {
        [MoveKey { time, position, turn }] => request.colliders.push(v1::ColliderUpdate {
            name: collider.clone(),
            position: position.map(Into::into),
            turn: turn.map(Into::into),
            duration_seconds: time,
        }),
        _ => request.collider_paths.push(v1::ColliderPath {
            name: collider.clone(),
            times_seconds: keys.iter().map(|key| key.time).collect(),
            positions: keys.iter().filter_map(|key| key.position).flatten().collect(),
            turns: keys.iter().filter_map(|key| key.turn).flatten().collect(),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TURN: [f64; 4] = [0.0, 0.6, 0.0, 0.8];

    fn told(change: Change) -> v1::UpdateParametersRequest {
        let Change::Collider(asked) = change else { panic!("no move of a collider: {change:?}") };
        let mut request = v1::UpdateParametersRequest::default();
        tell(&mut request, &asked);
        request
    }

    fn quarter() -> v1::ColliderPath {
        v1::ColliderPath {
            name: "box".into(),
            times_seconds: vec![0.1, 0.2],
            positions: vec![0.0, 1.0, 2.0, 3.0, 4.0, 5.0],
            turns: [TURN; 2].concat(),
        }
    }

    #[test]
    fn what_waits_is_told_as_it_was_asked_for() {
        let to = v1::ColliderUpdate {
            name: "box".into(),
            position: Some([1.0, 2.0, 3.0].into()),
            turn: Some(TURN.into()),
            duration_seconds: 0.5,
        };
        let straight = v1::ColliderUpdate { turn: None, ..to.clone() };
        let on_the_spot = v1::ColliderUpdate { position: None, ..to.clone() };
        for asked in [to, straight, on_the_spot] {
            assert_eq!(told(update("c", &asked).expect("a move")).colliders, [asked]);
        }

        let straight = v1::ColliderPath { turns: Vec::new(), ..quarter() };
        let on_the_spot = v1::ColliderPath { positions: Vec::new(), ..quarter() };
        for asked in [quarter(), straight, on_the_spot] {
            assert_eq!(told(path("c", &asked).expect("a move")).collider_paths, [asked]);
        }
    }

    #[test]
    fn lists_of_a_path_go_with_its_times() {
        let short = v1::ColliderPath { positions: vec![0.0; 5], ..quarter() };
        let long = v1::ColliderPath { turns: [TURN; 3].concat(), ..quarter() };
        let at_once = v1::ColliderPath { times_seconds: vec![0.0, 0.2], ..quarter() };
        let endless = v1::ColliderPath { times_seconds: vec![0.1, f64::INFINITY], ..quarter() };
        let nowhere = v1::ColliderPath { positions: Vec::new(), turns: Vec::new(), ..quarter() };
        for (bad, told) in [
            (short, "c.positions: has 5 numbers: three for each of 2 times are needed"),
            (long, "c.turns: has 12 numbers: four for each of 2 times are needed"),
            (at_once, "c.times_seconds: begins at 0 s: a time above 0 s is needed"),
            (endless, "c.times_seconds[1]: is inf: a finite number is needed"),
            (nowhere, "c: has neither positions nor turns: one is needed"),
        ] {
            assert_eq!(path("c", &bad).expect_err("no path").message, told);
        }
    }
}

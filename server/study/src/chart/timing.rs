//! Rows timed again in turn, interval by interval: whatever else the machine does disturbs all of them alike.

use super::row::Row;
use crate::{
    case::{Case, Times},
    run::{Phase, Runner},
};

/// Times the rows of the front and the scene's own again, until all reached their end or a phase is over.
pub(crate) fn again(case: &Case, rows: &mut [Row], times: &Times, phase: &Phase) {
    let mut turns = Vec::new();
    for (place, row) in
        rows.iter().enumerate().filter(|(_, row)| (row.front || row.own) && row.error().is_some())
    {
        let times = if row.own { times.coarser(case.dt()).0 } else { times.clone() };
        match Runner::start(case, row.stepped, &times, phase) {
            Ok(runner) => turns.push(Turn {
                place,
                runner,
                left: times.count(),
                seconds: Vec::new(),
                interval: times.interval,
            }),
            Err(_) => return,
        }
    }

    while turns.iter().any(|turn| turn.left > 0) {
        for turn in turns.iter_mut().filter(|turn| turn.left > 0) {
            match turn.runner.advance() {
                Ok(seconds) => turn.seconds.push(seconds),
                // Its time is over: what all of them have stands.
                Err(_) => return take(rows, &turns),
            }
            turn.left -= 1;
        }
    }
    take(rows, &turns);
}

/// A row that is timed again.
struct Turn {
    place: usize,
    runner: Runner,
    /// Intervals to go.
    left: u64,
    interval: f64,
    seconds: Vec<f64>,
}

/// Takes over the seconds, where all have some that count.
fn take(rows: &mut [Row], turns: &[Turn]) {
    if turns.iter().all(|turn| turn.seconds.len() > 1) {
        for turn in turns {
            rows[turn.place].time_again(&turn.seconds, turn.interval * turn.seconds.len() as f64);
        }
    }
}

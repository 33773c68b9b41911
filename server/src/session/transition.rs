//! What a session does with a command: a pure function from state and event to state and effect.
//!
//! Reads no clock and touches no simulation: the stepper carries out what it returns.

use crate::error::Reason;

/// What a session is doing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum State {
    /// Waiting for a command.
    Paused,
    /// Stepping until paused, stopped or at its end.
    Playing,
    /// Taking this many more steps (1 or more), then pausing.
    Stepping {
        /// Steps left to take.
        remaining: u64,
    },
    /// Came to its end, or was stopped.
    Finished,
    /// Ended by an error.
    Failed,
}

impl State {
    /// Whether more steps are to come.
    pub(super) fn is_stepping(self) -> bool {
        matches!(self, Self::Playing | Self::Stepping { .. })
    }
}

/// What happens to a session: a client's command, or the outcome of a step.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Event {
    Play,
    Pause,
    /// Take this many steps; 0 counts as 1.
    Step(u64),
    Stop,
    Update,
    /// A step was taken, and more may follow.
    Stepped,
    /// A step was taken, and it was the last that the session allows.
    SteppedLast,
}

/// What the stepper does on the way to the new state.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effect {
    None,
    /// Puts the changes into the queue.
    Enqueue,
    /// Makes the last frame and ends the streams without an error, since a call asked for it.
    Stopped,
    /// Makes the last frame and ends the streams without an error, since the last step was taken.
    Finish,
}

/// The state and effect that follow, or the reason why the event is refused.
///
/// # Errors
/// The reason to give to the client; the state stays as it is.
#[allow(clippy::match_same_arms, reason = "one line per rule, grouped by event")]
pub(crate) fn transition(state: State, event: Event) -> Result<(State, Effect), Reason> {
    use State::{Failed, Finished, Paused, Playing, Stepping};
    match (state, event) {
        (Paused | Playing | Stepping { .. }, Event::Play) => Ok((Playing, Effect::None)),
        (Paused | Playing | Stepping { .. }, Event::Pause) => Ok((Paused, Effect::None)),

        (Paused, Event::Step(count)) => Ok((Stepping { remaining: count.max(1) }, Effect::None)),
        (Stepping { remaining }, Event::Step(count)) => {
            Ok((Stepping { remaining: remaining.saturating_add(count.max(1)) }, Effect::None))
        }
        (Playing, Event::Step(_)) => Err(Reason::SessionPlaying),

        (Paused | Playing | Stepping { .. }, Event::Stop) => Ok((Finished, Effect::Stopped)),
        (Paused | Playing | Stepping { .. }, Event::Update) => Ok((state, Effect::Enqueue)),

        (Playing, Event::Stepped) => Ok((Playing, Effect::None)),
        (Stepping { remaining }, Event::Stepped) if remaining > 1 => {
            Ok((Stepping { remaining: remaining - 1 }, Effect::None))
        }
        (Stepping { .. }, Event::Stepped) => Ok((Paused, Effect::None)),
        // A session may be paused while its last step is in progress.
        (Paused | Playing | Stepping { .. }, Event::SteppedLast) => Ok((Finished, Effect::Finish)),

        // A pause or a stop that comes too late changes nothing; the answer shows the state.
        (Finished | Failed, Event::Pause | Event::Stop) => Ok((state, Effect::None)),
        (Finished, Event::Play | Event::Step(_) | Event::Update) => Err(Reason::SessionFinished),
        (Failed, Event::Play | Event::Step(_) | Event::Update) => Err(Reason::SessionFailed),

        (Paused, Event::Stepped) | (Finished | Failed, Event::Stepped | Event::SteppedLast) => {
            unreachable!("a session that is {state:?} takes no steps")
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The whole table: one row per state, one cell per command.
    #[test]
    fn every_command_in_every_state_does_what_the_table_says() {
        use State::{Failed, Finished, Paused, Playing, Stepping};
        let five = Stepping { remaining: 5 };
        let commands = [Event::Play, Event::Pause, Event::Step(3), Event::Stop, Event::Update];
        let (finished, failed) = (Err(Reason::SessionFinished), Err(Reason::SessionFailed));
        let table = [
            (
                Paused,
                [
                    Ok((Playing, Effect::None)),
                    Ok((Paused, Effect::None)),
                    Ok((Stepping { remaining: 3 }, Effect::None)),
                    Ok((Finished, Effect::Stopped)),
                    Ok((Paused, Effect::Enqueue)),
                ],
            ),
            (
                Playing,
                [
                    Ok((Playing, Effect::None)),
                    Ok((Paused, Effect::None)),
                    Err(Reason::SessionPlaying),
                    Ok((Finished, Effect::Stopped)),
                    Ok((Playing, Effect::Enqueue)),
                ],
            ),
            (
                five,
                [
                    Ok((Playing, Effect::None)),
                    Ok((Paused, Effect::None)),
                    Ok((Stepping { remaining: 8 }, Effect::None)),
                    Ok((Finished, Effect::Stopped)),
                    Ok((five, Effect::Enqueue)),
                ],
            ),
            (
                Finished,
                [finished, Ok((Finished, Effect::None)), finished, Ok((Finished, Effect::None)), finished],
            ),
            (Failed, [failed, Ok((Failed, Effect::None)), failed, Ok((Failed, Effect::None)), failed]),
        ];
        for (state, row) in table {
            for (command, expected) in commands.into_iter().zip(row) {
                assert_eq!(transition(state, command), expected, "{command:?} while {state:?}");
            }
        }
    }

    #[test]
    fn steps_run_down_to_a_pause_and_the_last_step_finishes() {
        use State::{Finished, Paused, Playing, Stepping};
        let one = Stepping { remaining: 1 };
        assert_eq!(transition(Stepping { remaining: 2 }, Event::Stepped), Ok((one, Effect::None)));
        assert_eq!(transition(one, Event::Stepped), Ok((Paused, Effect::None)));
        assert_eq!(transition(Playing, Event::Stepped), Ok((Playing, Effect::None)));
        for state in [Paused, Playing, one] {
            assert_eq!(transition(state, Event::SteppedLast), Ok((Finished, Effect::Finish)));
        }
    }

    #[test]
    fn a_step_of_zero_counts_as_one_and_sums_saturate() {
        assert_eq!(
            transition(State::Paused, Event::Step(0)),
            Ok((State::Stepping { remaining: 1 }, Effect::None))
        );
        assert_eq!(
            transition(State::Stepping { remaining: u64::MAX }, Event::Step(1)),
            Ok((State::Stepping { remaining: u64::MAX }, Effect::None))
        );
    }
}

//! The log of a session: what happened to it, and what it was asked, since a state of it was taken.
//!
//! Enters: one record after the other. Leaves: bytes with a checksum for each; and of bytes, the records before the first that is not
//! whole, or what a session that goes on from the state has to do again.

use std::borrow::Cow;

use nappe_proto::v1;
use nappe_sim::world::Change;
use prost::Message as _;
use serde::{Deserialize, Serialize};
use xxhash_rust::xxh3::xxh3_64;

use super::{
    format::{FileError, Section},
    write::{PendingGroup, Waiting},
};

/// Bytes before each record: its length (u32), and its XXH3 (u64), the lowest byte first.
const HEAD_BYTES: usize = 12;

/// What a session is to do.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Goal {
    /// It plays, at so many simulated seconds per second; 0: as fast as possible.
    Play { factor: f64 },
    /// It stands once it has taken so many steps.
    Stand { step: u64 },
    /// It came to its end, or was stopped, after so many steps.
    End { step: u64 },
}

/// Something that happened.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) enum Record<'a> {
    /// What it is to do from here.
    Goal(Goal),
    /// A call changes it, before step `step`.
    Changes { step: u64, order: u64, changes: Cow<'a, [Change]> },
    /// The changes of these calls, which waited, are dropped.
    Dropped(Vec<u64>),
    /// It goes back to its start after so many steps; so many calls had changed it then.
    Reset { step: u64, order: u64 },
    /// A frame is to be published, after so many steps.
    Frame { frame: u64, step: u64 },
    /// It failed: a `Failure` of the contract.
    Failed(Vec<u8>),
    /// Records before this one are missing: of an earlier state nobody can go on beyond here.
    Gap,
    /// Somebody may know of so many steps, of which perhaps no frame is made.
    Seen { step: u64 },
}

/// The bytes of a record.
///
/// # Errors
/// If it cannot be written.
pub(crate) fn encode(record: &Record<'_>) -> Result<Vec<u8>, FileError> {
    let refused = |error: &dyn std::fmt::Display| FileError::of(Section::Pending, error);
    let mut bytes = postcard::to_extend(record, vec![0_u8; HEAD_BYTES]).map_err(|error| refused(&error))?;
    let body = &bytes[HEAD_BYTES..];
    let length = u32::try_from(body.len()).map_err(|error| refused(&error))?;
    let hash = xxh3_64(body);
    bytes[..4].copy_from_slice(&length.to_le_bytes());
    bytes[4..HEAD_BYTES].copy_from_slice(&hash.to_le_bytes());
    Ok(bytes)
}

/// The records at the beginning of a log, and how many bytes they take: fewer than there are if what follows was cut or altered.
pub(crate) fn records(log: &[u8]) -> (Vec<Record<'static>>, usize) {
    let (mut records, mut at) = (Vec::new(), 0);
    while let Some((record, length)) = first(&log[at..]) {
        records.push(record);
        at += length;
    }
    (records, at)
}

/// The first record, and how many bytes it takes; none if it is not whole.
fn first(log: &[u8]) -> Option<(Record<'static>, usize)> {
    let (head, rest) = log.split_at_checked(HEAD_BYTES)?;
    let length = u32::from_le_bytes(*head.first_chunk()?) as usize;
    let hash = u64::from_le_bytes(*head.last_chunk()?);
    let body = rest.get(..length).filter(|body| xxh3_64(body) == hash)?;
    let (record, left) = postcard::take_from_bytes(body).ok()?;
    left.is_empty().then_some((record, HEAD_BYTES + length))
}

/// What a session does that goes on from a state, after what its log says happened since.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Replay {
    /// What it is to do in the end; none if no record says it.
    pub goal: Option<Goal>,
    /// After how many steps it goes back to its start, in order.
    pub resets: Vec<u64>,
    /// The last frame that somebody may have seen: its number and its step.
    pub last_frame: Option<(u64, u64)>,
    /// Steps of which somebody may know, by that frame or otherwise.
    pub seen: u64,
    /// Why it failed.
    pub failure: Option<v1::Failure>,
}

impl Replay {
    /// Takes records, which follow the state of a session that had taken `taken` steps: changes come to those that wait.
    pub(crate) fn of(records: Vec<Record<'static>>, taken: u64, waiting: &mut Waiting) -> Self {
        let mut replay = Self { goal: None, resets: Vec::new(), last_frame: None, seen: 0, failure: None };
        for record in records {
            match record {
                Record::Goal(goal) => replay.goal = Some(goal),
                Record::Changes { step, order, changes } => {
                    waiting.last_order = waiting.last_order.max(order);
                    waiting.groups.push(PendingGroup { step, order, changes: changes.into_owned() });
                }
                Record::Dropped(orders) => waiting.groups.retain(|group| !orders.contains(&group.order)),
                Record::Reset { step, order } => {
                    waiting.last_order = waiting.last_order.max(order);
                    replay.resets.extend((step >= taken).then_some(step));
                }
                // Frames that are made again have numbers that were there before.
                Record::Frame { frame, step } => {
                    replay.last_frame = replay.last_frame.max(Some((frame, step)));
                    replay.seen = replay.seen.max(step);
                }
                Record::Seen { step } => replay.seen = replay.seen.max(step),
                Record::Failed(failure) => replay.failure = v1::Failure::decode(&*failure).ok(),
                Record::Gap => break,
            }
        }
        waiting.groups.sort_by_key(|group| (group.step, group.order));
        replay
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn changes(step: u64, order: u64) -> Record<'static> {
        Record::Changes { step, order, changes: Cow::Owned(vec![Change::Drag(order as f64)]) }
    }

    /// One of each kind.
    fn all() -> Vec<Record<'static>> {
        let failure = v1::Failure { reason: "NOT_FINITE".to_owned(), ..v1::Failure::default() };
        vec![
            Record::Goal(Goal::Play { factor: 0.5 }),
            changes(7, 3),
            Record::Dropped(vec![3, 1]),
            Record::Reset { step: 9, order: 4 },
            Record::Frame { frame: 2, step: 10 },
            Record::Goal(Goal::Stand { step: 11 }),
            Record::Goal(Goal::End { step: 12 }),
            Record::Failed(failure.encode_to_vec()),
            Record::Gap,
            Record::Seen { step: 12 },
        ]
    }

    fn log(records: &[Record<'_>]) -> Vec<u8> {
        records.iter().flat_map(|record| encode(record).expect("it can be written")).collect()
    }

    #[test]
    fn records_that_were_written_are_read_and_no_part_of_one_is() {
        let written = all();
        let log = log(&written);
        assert_eq!(records(&log), (written.clone(), log.len()));
        let ends = written.iter().scan(0, |end, record| {
            *end += encode(record).expect("it can be written").len();
            Some(*end)
        });
        let ends: Vec<usize> = ends.collect();
        for cut in 0..log.len() {
            let whole = ends.iter().filter(|end| **end <= cut).count();
            let (read, taken) = records(&log[..cut]);
            assert_eq!(read, written[..whole], "cut after {cut} bytes");
            assert_eq!(taken, ends[..whole].last().copied().unwrap_or_default());
        }
    }

    #[test]
    fn a_record_with_a_flipped_bit_and_those_after_it_are_not_read() {
        let written = all();
        let log = log(&written);
        let second = encode(&written[0]).expect("it can be written").len();
        let third = second + encode(&written[1]).expect("it can be written").len();
        for at in second..third {
            for bit in 0..8 {
                let mut flipped = log.clone();
                flipped[at] ^= 1 << bit;
                assert_eq!(records(&flipped), (vec![written[0].clone()], second), "byte {at}, bit {bit}");
            }
        }
    }

    #[test]
    fn a_session_does_again_what_happened_and_waits_for_what_was_asked() {
        let group = |step, order| PendingGroup { step, order, changes: vec![Change::Drag(order as f64)] };
        let mut waiting = Waiting { groups: vec![group(20, 1), group(30, 2)], last_order: 2 };
        let happened = vec![
            changes(12, 3),
            Record::Reset { step: 11, order: 4 },
            changes(40, 5),
            // Changes that took effect are not among those that a call drops.
            Record::Dropped(vec![2, 5]),
            Record::Goal(Goal::Play { factor: 2.0 }),
            Record::Frame { frame: 6, step: 12 },
            Record::Frame { frame: 5, step: 10 },
            Record::Seen { step: 13 },
            changes(13, 6),
        ];
        let replay = Replay::of(happened, 10, &mut waiting);
        let places: Vec<_> = waiting.groups.iter().map(|group| (group.step, group.order)).collect();
        assert_eq!((places, waiting.last_order), (vec![(12, 3), (13, 6), (20, 1)], 6));
        let Replay { goal, resets, last_frame, seen, failure } = replay;
        assert_eq!((goal, resets), (Some(Goal::Play { factor: 2.0 }), vec![11]));
        assert_eq!((last_frame, seen, failure), (Some((6, 12)), 13, None));
    }

    #[test]
    fn nothing_is_done_again_beyond_records_that_are_missing() {
        let mut waiting = Waiting::default();
        let replay = Replay::of(vec![changes(5, 1), Record::Gap, changes(6, 2)], 0, &mut waiting);
        assert_eq!((waiting.groups.len(), waiting.last_order, replay.goal), (1, 1, None));
    }
}

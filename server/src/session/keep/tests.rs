//! When states of a session are due, and what its log begins with.

use std::{
    env, fs,
    path::PathBuf,
    process,
    sync::{
        Arc,
        mpsc::{self, Receiver},
    },
    thread,
};

use super::*;
use crate::state::{StateFolder, records};

const INTERVAL: Duration = Duration::from_secs(2);

/// What keeps a session in a folder of this test, and where orders to its writer go.
fn keep(name: &str) -> (Keep, PathBuf, Receiver<Order>) {
    let path = env::temp_dir().join(format!("nappe-keep-{}-{name}", process::id()));
    let _ = fs::remove_dir_all(&path);
    let folder = Arc::new(StateFolder::open(&path, 1 << 30).expect("it can be used")).session("one");
    let (sender, orders) = mpsc::channel();
    let place = StatePlace { number: 6, step: 0 };
    let keep = Keep::new(folder, (sender, thread::spawn(|| {})), place, Goal::Stand { step: 0 });
    (keep, path, orders)
}

/// Whether a state is due so many seconds after the last one, of a session that has taken so many steps.
fn is_due(keep: &mut Keep, seconds: f64, taken: u64) -> bool {
    let now = keep.taken_at + Duration::from_secs_f64(seconds);
    keep.ask_if_due(now, taken, INTERVAL)
}

#[test]
fn a_state_is_due_where_something_happened_and_costs_two_percent_at_most() {
    let (mut keep, path, _orders) = keep("due");
    assert_eq!(keep.begin_log(0).expect("begun"), StatePlace { number: 7, step: 0 });
    assert!(!is_due(&mut keep, 1000.0, 0), "nothing happened");
    keep.note(&Record::Frame { frame: 1, step: 0 });
    assert!(!is_due(&mut keep, 1.9, 0), "it is too early");
    assert!(is_due(&mut keep, 2.0, 0));
    assert!(!is_due(&mut keep, 9.0, 0), "it is asked for already");
    assert_eq!(keep.begin_state(5), Some(StatePlace { number: 8, step: 5 }));
    assert!(!is_due(&mut keep, 9.0, 6), "one is written");
    assert_eq!(keep.begin_state(6), None);
    assert!(!keep.kept(100), "it was kept before");

    // A step is something that happened; a state that takes a second is taken every 50 s.
    keep.cost = Duration::from_secs(1);
    assert!(!is_due(&mut keep, 49.0, 6) && !is_due(&mut keep, 60.0, 5));
    assert!(is_due(&mut keep, 50.0, 6));

    // What could not be kept is tried again, also if nothing happened; then it is kept again.
    keep.cost = Duration::ZERO;
    keep.not_kept("the disk is full");
    assert!(!is_due(&mut keep, 9.0, 5) && is_due(&mut keep, 10.0, 5));
    assert!(keep.kept(100) && !keep.kept(100));

    // A long log brings the next state forward.
    keep.logged[0] = LONG_LOG + 1;
    assert!(is_due(&mut keep, 0.0, 5));
    keep.end_states();
    assert!(!is_due(&mut keep, 1000.0, 99), "the state may be half changed");
    fs::remove_dir_all(path).expect("removed");
}

#[test]
fn a_log_begins_with_what_the_session_is_to_do() {
    let (mut keep, path, _orders) = keep("goal");
    let play = Record::Goal(Goal::Play { factor: 1.0 });
    let failed = Record::Failed(vec![1, 2, 3]);
    let frame = Record::Frame { frame: 4, step: 9 };
    let place = keep.begin_log(0).expect("begun");
    for record in [&frame, &play, &failed] {
        keep.note(record);
    }
    let read = |keep: &Keep, place| records(&keep.folder.read_log(place).expect("read")).0;
    let stand = Record::Goal(Goal::Stand { step: 0 });
    assert_eq!(read(&keep, place), [stand, frame.clone(), play.clone(), failed.clone()]);
    assert_eq!([keep.unsynced_logs().len(), keep.unsynced_logs().len()], [1, 0]);
    keep.note(&frame);
    let next = keep.begin_log(9).expect("begun");
    assert_eq!(read(&keep, next), [play, failed]);
    assert_eq!([keep.unsynced_logs().len(), keep.unsynced_logs().len()], [2, 0], "the one before, too");
    assert!(!keep.has_news(9) && keep.has_news(10));
    fs::remove_dir_all(path).expect("removed");
}

#[test]
fn the_log_knows_of_each_step_of_which_somebody_may_know() {
    let (mut keep, path, _orders) = keep("seen");
    let place = keep.begin_log(0).expect("begun");
    keep.note_seen(0);
    keep.note(&Record::Frame { frame: 1, step: 4 });
    for step in [3, 4, 5, 5] {
        keep.note_seen(step);
    }
    let read = records(&keep.folder.read_log(place).expect("read")).0;
    assert_eq!(read[1..], [Record::Frame { frame: 1, step: 4 }, Record::Seen { step: 5 }]);
    fs::remove_dir_all(path).expect("removed");
}

#[test]
fn without_any_state_no_log_stays() {
    let (mut keep, path, _orders) = keep("alone");
    keep.ask(None);
    assert_eq!(keep.begin_state(0), Some(StatePlace { number: 7, step: 0 }));
    keep.not_kept("the disk is full");
    keep.note(&Record::Frame { frame: 1, step: 1 });
    assert_eq!(fs::read_dir(keep.folder.path()).expect("a folder").count(), 0);
    let next = keep.begin_log(1).expect("begun");
    assert_eq!(records(&keep.folder.read_log(next).expect("read")).0[0], Record::Gap);
    fs::remove_dir_all(path).expect("removed");
}

#[test]
fn a_log_that_cannot_be_made_has_another_name_when_it_is_tried_again() {
    let (mut keep, path, _orders) = keep("name");
    keep.folder.make().expect("made");
    fs::write(keep.folder.path().join("log-7-0"), "not ours").expect("written");
    keep.begin_log(0).expect_err("there is a file of this name");
    assert_eq!(keep.begin_log(0).expect("begun"), StatePlace { number: 8, step: 0 });
    fs::remove_dir_all(path).expect("removed");
}

#[test]
fn records_that_could_not_be_written_leave_a_gap() {
    let (mut keep, path, _orders) = keep("gap");
    let first = keep.begin_log(0).expect("begun");
    // A log that can only be read.
    keep.log = Some(File::open(keep.folder.path().join("log-7-0")).expect("opened"));
    keep.note(&Record::Frame { frame: 1, step: 1 });
    assert!(keep.problem.as_ref().is_some_and(|problem| problem.contains("cannot be written")));
    keep.note(&Record::Goal(Goal::Stand { step: 3 }));
    let next = keep.begin_log(2).expect("begun");
    let read = |place| records(&keep.folder.read_log(place).expect("read")).0;
    assert_eq!(read(first), [Record::Goal(Goal::Stand { step: 0 })]);
    assert_eq!(read(next), [Record::Gap, Record::Goal(Goal::Stand { step: 3 })]);
    fs::remove_dir_all(path).expect("removed");
}

#[test]
fn who_asks_is_told_how_far_what_is_kept_is_behind() {
    let (mut keep, path, _orders) = keep("behind");
    let now = keep.taken_at;
    assert_eq!(keep.durability(now), v1::Durability::default(), "no state is there");
    keep.begin_log(0).expect("begun");
    keep.ask(None);
    assert!(keep.begin_state(5).is_some());
    let now = keep.taken_at + Duration::from_secs(3);
    assert_eq!(keep.durability(now).step, None, "it is not written yet");
    keep.kept(100);
    let told = keep.durability(now);
    assert_eq!((told.step, told.age_seconds, told.problem), (Some(5), Some(3.0), String::new()));

    keep.not_kept("the disk is full");
    let told = keep.durability(now);
    assert_eq!((told.step, told.problem.as_str()), (Some(5), "the disk is full"));
    keep.kept(100);
    assert!(keep.durability(now).problem.is_empty(), "it is kept again");
    fs::remove_dir_all(path).expect("removed");
}

//! The folder of a server: one server at a time, files that are whole, and no more of them than are needed.

use std::{
    env, fs,
    io::{ErrorKind, Write as _},
    os::unix::fs::PermissionsExt as _,
    path::{Path, PathBuf},
    process,
    sync::Arc,
};

use nappe_sim::math::Precision;

use super::{
    Digest, Opened, SavedSession, Section, StateFolder, StatePlace, format::altered, newest_state, records,
    setup_section, tests::example, write, write_without_setup,
};

const ROOM: u64 = 1 << 30;

/// A folder of this test that is not there.
fn folder(name: &str) -> PathBuf {
    let path = env::temp_dir().join(format!("nappe-state-{}-{name}", process::id()));
    let _ = fs::remove_dir_all(&path);
    path
}

fn open(path: &Path) -> Arc<StateFolder> {
    Arc::new(StateFolder::open(path, ROOM).expect("it can be used"))
}

const fn place(number: u64, step: u64) -> StatePlace {
    StatePlace { number, step }
}

/// A session as a whole file, the section of its setup, and the same file without that.
fn files() -> (Vec<u8>, Vec<u8>, Vec<u8>) {
    let (saved, _) = example(Precision::F32);
    let whole = write(&saved).expect("it can be written");
    let setup = setup_section(&saved.setup).expect("it can be written");
    let digest = Digest::of(&setup);
    let SavedSession { session, request, initial, state, pending, frame, positions, .. } = saved;
    let saved = SavedSession {
        session,
        request,
        setup: digest,
        initial,
        state,
        pending,
        frame,
        positions,
        state_hash: saved.state_hash,
        hash_interval: saved.hash_interval,
        colors: saved.colors,
    };
    let without = write_without_setup(&saved).expect("it can be written");
    (whole, setup, without)
}

fn names(path: &Path) -> Vec<String> {
    let entries = fs::read_dir(path).expect("a folder");
    let name = |entry: fs::DirEntry| entry.file_name().into_string().expect("a text");
    let mut names: Vec<_> = entries.map(|entry| name(entry.expect("an entry"))).collect();
    names.sort_unstable();
    names
}

#[test]
fn one_server_at_a_time_uses_a_folder_that_no_other_user_can_write() {
    let path = folder("lock");
    let first = open(&path);
    let mode = fs::metadata(&path).expect("it is there").permissions().mode();
    assert_eq!(mode & 0o777, 0o700);
    let refused = StateFolder::open(&path, ROOM).expect_err("it is used");
    assert!(refused.to_string().contains("another server"), "{refused}");
    drop(first);
    drop(open(&path));

    fs::set_permissions(&path, fs::Permissions::from_mode(0o770)).expect("it is ours");
    let refused = StateFolder::open(&path, ROOM).expect_err("a group can write it");
    assert_eq!(refused.kind(), ErrorKind::PermissionDenied, "{refused}");
    assert!(refused.to_string().contains("chmod go-w"), "{refused}");
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn a_token_is_for_this_user_alone() {
    let path = folder("token");
    let state = open(&path);
    state.put_token("0123456789abcdef").expect("written");
    let mode = fs::metadata(state.token_path()).expect("it is there").permissions().mode();
    assert_eq!(mode & 0o777, 0o600);
    assert_eq!(fs::read_to_string(state.token_path()).expect("a text"), "0123456789abcdef\n");
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn a_state_and_its_setup_make_the_whole_file() {
    let path = folder("whole");
    let state = open(&path);
    let (whole, setup, without) = files();
    assert_eq!(without.len() + setup.len(), whole.len());
    let session = state.session("one");
    session.make().expect("made");
    assert_eq!(session.put_setup(&setup).expect("written"), Digest::of(&setup));
    session.put_state(place(1, 7), &without).expect("written");
    assert_eq!(session.read_state(place(1, 7)).expect("read"), whole);
    assert_eq!(session.bytes(place(1, 7)).expect("known"), whole.len() as u64);
    let opened = Opened::of(&whole).expect("a good file");
    assert_eq!(opened.section(Section::Setup), setup);

    // A setup that was cut is named; one that is written again is whole again.
    let file = path.join("setups").join(&names(&path.join("setups"))[0]);
    fs::write(&file, &setup[1..]).expect("written");
    let refused = session.read_state(place(1, 7)).expect_err("it was cut").to_string();
    assert!(refused.contains(&file.display().to_string()), "{refused}");
    let mut altered = setup.clone();
    altered[9] ^= 1;
    fs::write(&file, &altered).expect("written");
    session.put_setup(&setup).expect("written");
    assert_eq!(session.read_state(place(1, 7)).expect("read"), whole);
    assert_eq!(names(&path.join("setups")).len(), 1);

    // A state whose beginning was cut or altered is refused before anything is read.
    let file = session.path().join("state-1-7");
    fs::write(&file, &without[..100]).expect("written");
    session.read_state(place(1, 7)).expect_err("it was cut");
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn the_newest_good_state_of_a_folder_is_a_file_of_a_session() {
    let path = folder("left");
    let state = open(&path);
    let (whole, setup, without) = files();
    let session = state.session("one");
    session.make().expect("made");
    let none = newest_state(session.path()).expect_err("no state is there");
    assert!(none.to_string().contains("DIR/sessions/UID"), "{none}");
    session.put_setup(&setup).expect("written");
    session.put_state(place(9, 90), &without).expect("written");
    assert_eq!(newest_state(session.path()).expect("read"), whole);

    // Of a newer one the last byte is another one; then both are damaged, and the newest is named.
    let mut altered = without;
    let last = altered.len() - 1;
    altered[last] ^= 1;
    session.put_state(place(10, 100), &altered).expect("written");
    assert_eq!(newest_state(session.path()).expect("read"), whole);
    session.put_state(place(9, 90), &altered).expect("written");
    let refused = newest_state(session.path()).expect_err("both are damaged").to_string();
    assert!(refused.contains("state-10-100") && refused.contains("section 'colors'"), "{refused}");
    newest_state(&path.join("sessions/other")).expect_err("there is no such folder");
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn a_state_that_cannot_tell_its_setup_keeps_all_of_them() {
    let path = folder("unknown");
    let state = open(&path);
    let (_, setup, without) = files();
    let session = state.session("one");
    session.make().expect("made");
    session.put_setup(&setup).expect("written");
    session.put_state(place(1, 0), &altered::with_format(&without, 99)).expect("written");
    state.sweep().expect("swept");
    assert_eq!(names(&path.join("setups")).len(), 1, "a later version may need it");
    session.set_aside(place(1, 0)).expect("renamed");
    assert_eq!(names(session.path()), ["damaged-1-0"]);
    state.sweep().expect("swept");
    assert_eq!(names(&path.join("setups")).len(), 1, "the session may be about to write another state");
    drop((session, state));
    open(&path).sweep().expect("swept");
    assert!(names(&path.join("setups")).is_empty(), "no state is there any more");
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn the_newest_two_states_and_the_logs_since_are_kept() {
    let path = folder("newest");
    let state = open(&path);
    let (_, setup, without) = files();
    let session = state.session("one");
    session.make().expect("made");
    session.put_setup(&setup).expect("written");
    for (number, step) in [(1, 0), (2, 90), (3, 90), (10, 100)] {
        session.new_log(place(number, step)).expect("made").write_all(b"x").expect("written");
        session.put_state(place(number, step), &without).expect("written");
        session.forget_older().expect("removed");
    }
    // Logs after a state that was not written.
    session.new_log(place(11, 120)).expect("made");
    fs::write(session.path().join("notes"), "not ours").expect("written");
    assert_eq!(session.states().expect("read"), [place(10, 100), place(3, 90)]);
    assert_eq!(
        session.logs_since(place(3, 90)).expect("read"),
        [place(3, 90), place(10, 100), place(11, 120)]
    );
    assert_eq!(session.last_number().expect("read"), 11);
    let left = names(session.path());
    assert_eq!(left, ["log-10-100", "log-11-120", "log-3-90", "notes", "state-10-100", "state-3-90"]);
    session.new_log(place(11, 120)).expect_err("no log is written twice");
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn a_sweep_leaves_what_is_needed_and_what_is_not_its_own() {
    let path = folder("sweep");
    let state = open(&path);
    let (_, setup, without) = files();
    let [kept, unwritten] = ["kept", "unwritten"].map(|uid| state.session(uid));
    for session in [&kept, &unwritten] {
        session.make().expect("made");
    }
    kept.put_setup(&setup).expect("written");
    kept.put_state(place(1, 0), &without).expect("written");
    unwritten.put_setup(b"a setup that nobody names").expect("written");
    unwritten.new_log(place(1, 0)).expect("made");
    for file in
        ["setups/0000000000000001-5.new", "setups/notes", "sessions/kept/state-2-9.new", "sessions/notes"]
    {
        fs::write(path.join(file), "text").expect("written");
    }
    assert_eq!(state.sessions().expect("read"), ["kept"]);
    state.sweep().expect("swept");
    let setups = names(&path.join("setups"));
    assert!(setups.len() == 2 && setups[1] == "notes", "{setups:?}");
    assert_eq!(names(&path.join("sessions")), ["kept", "notes"]);
    assert_eq!(names(kept.path()), ["state-1-0"]);

    kept.remove().expect("removed");
    kept.remove().expect("what is gone is removed");
    state.sweep().expect("swept");
    assert_eq!(names(&path.join("setups")), ["notes"]);
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn no_more_bytes_are_taken_than_are_allowed() {
    let path = folder("room");
    let (_, setup, without) = files();
    let state = Arc::new(StateFolder::open(&path, (setup.len() + without.len()) as u64).expect("usable"));
    let session = state.session("one");
    session.make().expect("made");
    session.put_setup(&setup).expect("there is room");
    session.put_setup(&setup).expect("it is there");
    session.put_state(place(1, 0), &without).expect("there is room");
    let full = session.put_state(place(2, 1), &without).expect_err("there is none");
    assert_eq!(full.kind(), ErrorKind::StorageFull);
    assert!(full.to_string().contains("--max-state-bytes"), "{full}");
    assert_eq!(names(session.path()), ["state-1-0"]);
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn setups_that_nobody_needs_make_room() {
    let path = folder("makes-room");
    let (_, setup, without) = files();
    let of_another = vec![7; 2 * without.len() + 1];
    let room = (setup.len() + 2 * without.len()) as u64;
    let state = Arc::new(StateFolder::open(&path, room).expect("usable"));
    let [first, second] = ["first", "second"].map(|uid| state.session(uid));
    for session in [&first, &second] {
        session.make().expect("made");
    }
    let digest = first.put_setup(&of_another).expect("there is room");
    second.put_setup(&setup).expect_err("no state names the first, which is about to be named");
    assert!(first.has_setup(digest));

    // The setup of a session that is gone makes room; that of one which has no state yet does not.
    first.remove().expect("removed");
    second.put_setup(&setup).expect("there is room");
    assert!(!first.has_setup(digest) && second.has_setup(Digest::of(&setup)));
    for step in 0..2 {
        second.put_state(place(step + 1, step), &without).expect("there is room");
    }
    second.put_state(place(3, 2), &without).expect_err("there is none");
    assert!(second.has_setup(Digest::of(&setup)));
    fs::remove_dir_all(&path).expect("removed");
}

#[test]
fn a_log_is_cut_where_it_is_damaged() {
    let path = folder("cut");
    let session = open(&path).session("one");
    session.make().expect("made");
    session.new_log(place(1, 0)).expect("made").write_all(&[7; 20]).expect("written");
    let log = session.read_log(place(1, 0)).expect("read");
    let (good, length) = records(&log);
    assert!(good.is_empty() && length == 0);
    session.cut_log(place(1, 0), length as u64).expect("cut");
    assert!(session.read_log(place(1, 0)).expect("read").is_empty());
    fs::remove_dir_all(&path).expect("removed");
}

//! Runs that are kept: killed in the middle and started again, they leave the files of a run that nobody disturbed.

use std::{
    collections::BTreeMap,
    fs,
    os::unix::fs::MetadataExt as _,
    path::{Path, PathBuf},
    process::Stdio,
};

use serde_json::Value;

use crate::{
    snow::SNOW_SCENE,
    support::{Folder, SMALL_SCENE, command, folder, nappe_in, until, write_scene},
};

/// A run whose states are kept as often as they may be.
const RUN: [&str; 10] = [
    "run",
    "scene.toml",
    "--quiet",
    "--json",
    "--save",
    "frames",
    "--state-dir",
    "states",
    "--checkpoint-seconds",
    "0.05",
];

/// The files of a folder of frames.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let entries = fs::read_dir(folder).expect("a folder").map(|entry| entry.expect("an entry").path());
    let named = |path: PathBuf| {
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        (name, fs::read(&path).expect("a file"))
    };
    // What a killed run was writing stands beside its name.
    entries
        .map(named)
        .filter(|(name, _)| Path::new(name).extension().is_none_or(|ending| ending != "new"))
        .collect()
}

/// What is kept of the only run of a folder.
fn kept(here: &Path) -> Option<PathBuf> {
    let mut runs = fs::read_dir(here.join("states/runs")).ok()?;
    Some(runs.next()?.expect("an entry").path())
}

/// Kills a run once a state of it is kept that is later than frame 20; whether that was before its end.
fn cut(here: &Path, options: &[&str]) -> bool {
    let mut run = command();
    run.current_dir(here).args(RUN).args(options).stdout(Stdio::null()).stderr(Stdio::null());
    let mut run = run.spawn().expect("it starts");
    let mut wait = |what: &str, is_so: &dyn Fn() -> bool| {
        until(what, || is_so() || run.try_wait().expect("it can be asked").is_some());
    };
    wait("frames are saved", &|| here.join("frames/frame-000020.ply").is_file());
    // Each state is a file of its own, which takes the place of the one before.
    let state = || Some(fs::metadata(kept(here)?.join("state")).ok()?.ino());
    let before = state();
    wait("a later state is kept", &|| state().is_some_and(|state| Some(state) != before));
    // It may have ended by itself.
    let _ = run.kill();
    run.wait().expect("it ends").code().is_none()
}

/// A folder with a run of a scene that was killed in the middle, and with the frames of a whole one, `whole`; the hash of that.
fn killed(text: &str, options: &[&str]) -> (Folder, Value) {
    let end = text.lines().find(|line| line.starts_with("steps = ")).expect("it has an end");
    for steps in [1_000, 10_000, 100_000] {
        let here = folder();
        write_scene(here.path(), &text.replace(end, &format!("steps = {steps}")));
        // One that was too short on this machine is followed by a longer one.
        if cut(here.path(), options) {
            let whole = ["run", "scene.toml", "--quiet", "--json", "--save", "whole"];
            let whole = nappe_in(here.path(), &[&whole[..], options].concat()).ok().json();
            return (here, whole["state_hash"].clone());
        }
    }
    panic!("no run was long enough to be killed before its end");
}

#[test]
fn a_run_that_was_killed_goes_on_and_leaves_the_files_of_an_undisturbed_one() {
    let cases: [(&str, &[&str]); 3] = [
        (SMALL_SCENE, &["--fields", "velocity"]),
        (SMALL_SCENE, &["--precision", "f64", "--frame-interval", "3", "--threads", "1"]),
        (SNOW_SCENE, &["--fields", "velocity,plastic_ratio,stress", "--grid", "smoke"]),
    ];
    for (text, options) in cases {
        let (here, hash) = killed(text, options);
        let again = nappe_in(here.path(), &[&RUN[..], options].concat()).ok();
        let said = again.stderr.split_once("scene.toml: the run goes on from step ");
        assert!(said.is_some_and(|(_, step)| !step.starts_with("0\n")), "{}", again.stderr);
        assert_eq!(again.json()["state_hash"], hash, "{options:?}");
        let [whole, frames] = ["whole", "frames"].map(|name| files(&here.path().join(name)));
        assert!(whole == frames, "{options:?}: {} and {} files", whole.len(), frames.len());

        // It has ended, and is computed once.
        let done = nappe_in(here.path(), &[&RUN[..], options].concat()).ok().json();
        assert_eq!((&done["ended"], &done["saved"]), (&true.into(), &"frames".into()), "{done}");
    }
}

#[test]
fn a_run_that_was_killed_before_its_first_state_begins_again() {
    let (here, hash) = killed(SMALL_SCENE, &[]);
    let run = kept(here.path()).expect("it is kept");
    fs::remove_file(run.join("state")).expect("it is there");
    let again = nappe_in(here.path(), &RUN).ok();
    assert!(!again.stderr.contains("goes on"), "{}", again.stderr);
    assert_eq!(again.json()["state_hash"], hash);
    assert!(files(&here.path().join("whole")) == files(&here.path().join("frames")));
}

#[test]
fn a_run_begins_anew_when_asked_to_and_mixes_no_frames() {
    let (here, hash) = killed(SMALL_SCENE, &[]);
    let kept = kept(here.path()).expect("it is kept");

    // The frames before its state are needed.
    let [first, away] = ["frames/frame-000000.ply", "away.ply"].map(|name| here.path().join(name));
    fs::rename(&first, &away).expect("it is there");
    let missing = nappe_in(here.path(), &RUN);
    assert_eq!(missing.code, Some(1), "{missing:?}");
    assert!(missing.stderr.contains("frames/frame-000000.ply is missing"), "{}", missing.stderr);
    fs::rename(&away, &first).expect("it is there");
    assert!(kept.join("state").is_file(), "nothing is lost");

    // Another run, and one that begins anew, do not take the place of frames that are there.
    for other in [&["--steps", "7"][..], &["--fresh"]] {
        let refused = nappe_in(here.path(), &[&RUN[..], other].concat());
        assert_eq!(refused.code, Some(1), "{other:?}: {refused:?}");
        assert!(refused.stderr.contains("holds frames already"), "{}", refused.stderr);
    }
    fs::write(here.path().join("frames/frame-999999.ply"), "of another run").expect("written");
    let fresh = nappe_in(here.path(), &[&RUN[..], &["--fresh", "--force"]].concat()).ok();
    assert!(!fresh.stderr.contains("goes on"), "{}", fresh.stderr);
    assert_eq!(fresh.json()["state_hash"], hash);
    assert!(files(&here.path().join("whole")) == files(&here.path().join("frames")));
}

#[test]
fn what_cannot_be_kept_is_refused_by_name() {
    let (here, _) = killed(SMALL_SCENE, &[]);
    let refused = |options: &[&str], code: i32, part: &str| {
        let done = nappe_in(here.path(), options);
        assert_eq!(done.code, Some(code), "{options:?}: {done:?}");
        assert!(done.stderr.contains(part), "{options:?}: {}", done.stderr);
    };
    let kept = ["run", "scene.toml", "--state-dir", "states"];
    refused(&[&kept[..], &["--save", "page.html"]].concat(), 2, "page.html");
    refused(&[&kept[..], &["--table", "a.csv"]].concat(), 2, "--table");
    refused(&[&kept[..], &["--server", "127.0.0.1:1"]].concat(), 2, "--server");
    refused(&["run", "scene.toml", "--fresh"], 2, "--state-dir");

    // Of one run, one at a time.
    let run = self::kept(here.path()).expect("it is kept");
    let lock = fs::File::options().write(true).open(run.join("lock")).expect("it is there");
    lock.try_lock().expect("nobody computes it");
    refused(&RUN, 1, "this run is computed already");
    drop(lock);

    // A state that is damaged is refused by its section, and stays.
    let state = run.join("state");
    let mut bytes = fs::read(&state).expect("it is there");
    let middle = bytes.len() / 2;
    bytes[middle] ^= 1;
    fs::write(&state, &bytes).expect("written");
    refused(&RUN, 5, "section '");
    assert!(fs::read(&state).expect("it stays") == bytes);
}

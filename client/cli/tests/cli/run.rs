//! `nappe run`: the JSON contract, the same bits for any thread count, saving, diverging, ending.

use std::{
    fs,
    path::Path,
    process::{Child, Command, Stdio},
    thread,
    time::Duration,
};

use serde_json::Value;

use crate::support::{
    Lines, SMALL_SCENE, command, end_by, folder, hears_of_hangups, nappe, nappe_in, until, write_scene,
};

/// A scene whose explicit step is ten times too long.
pub(crate) const DIVERGING_SCENE: &str = r#"
version = 1
title = "too long a step"
dt = 0.05
steps = 500

[[body]]
name = "sheet"
mesh = { grid = [8, 8], spacing = 0.05 }
mass = { particle = 0.001 }
pins = ["top_left"]
integrator = "symplectic_euler"
unchecked = true
[body.springs]
stretch = { stiffness = 1000.0 }
"#;

fn small(args: &[&str]) -> Value {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    nappe_in(folder.path(), &[&["run", &scene, "--json"], args].concat()).ok().json()
}

#[test]
fn a_run_ends_with_one_object_that_scripts_can_rely_on() {
    let result = small(&["--steps", "20"]);
    assert!(result["scene"].as_str().is_some_and(|scene| scene.ends_with("scene.toml")), "{result}");
    assert_eq!(result["steps"], 20);
    assert!((result["time"].as_f64().expect("a number") - 0.1).abs() < 1e-9);
    assert!(result["seconds"].as_f64().is_some_and(|seconds| seconds > 0.0));
    let hash = result["state_hash"].as_str().expect("a text");
    assert!(hash.len() == 16 && u64::from_str_radix(hash, 16).is_ok(), "{hash}");
    assert!(result["energy_at_end"].as_f64().is_some_and(f64::is_finite));
    assert!(result["max_stretch"].as_f64().is_some_and(|stretch| (0.5..2.0).contains(&stretch)));
    assert!(result["diverged"].is_null());
    assert_eq!(result["interrupted"], false);
    assert_eq!(result["particles"], 144);
}

#[test]
fn the_scene_says_how_long_unless_the_command_does() {
    assert_eq!(small(&[])["steps"], 40);
    assert_eq!(small(&["--steps", "7"])["steps"], 7);
}

#[test]
fn a_short_run_says_nothing_on_a_pipe_whether_it_is_quiet_or_not() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    for verb in [&["run", &scene][..], &["demo", "--steps", "4"]] {
        for quiet in [&[][..], &["--quiet"]] {
            let done = nappe_in(folder.path(), &[verb, quiet].concat()).ok();
            assert_eq!(done.stderr, "", "{verb:?} {quiet:?}");
        }
    }
}

#[test]
fn the_number_of_threads_and_saving_change_no_bit() {
    for precision in ["f32", "f64"] {
        let one = small(&["--threads", "1", "--precision", precision]);
        let two = small(&["--threads", "2", "--precision", precision, "--save", "frames"]);
        assert_eq!(one["state_hash"], two["state_hash"], "{precision}");
        assert_eq!(one["precision"], precision);
        assert_eq!((&one["threads"], &two["threads"]), (&Value::from(1), &Value::from(2)));
    }
}

#[test]
fn a_folder_gets_every_frame_as_a_mesh() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let result = nappe_in(folder.path(), &["run", &scene, "--json", "--save", "frames"]).ok().json();
    // 40 steps, a frame every 2, and the initial state.
    assert_eq!(result["frames"], 21);
    let files = fs::read_dir(folder.path().join("frames")).expect("the folder").count();
    assert_eq!(files, 21);
    let first = nappe_in(folder.path(), &["mesh", "info", "frames/frame-000000.ply", "--json"]).ok().json();
    assert_eq!(first["points"], 144);
    assert_eq!(first["triangles"], 2 * 11 * 11);
}

#[test]
fn frames_of_another_run_are_not_mixed_up() {
    let folder = folder();
    let scene = write_scene(folder.path(), SMALL_SCENE);
    let args = ["run", &scene, "--steps", "4", "--save", "frames"];
    nappe_in(folder.path(), &args).ok();
    let again = nappe_in(folder.path(), &args);
    assert_eq!(again.code, Some(1), "{again:?}");
    assert!(again.stderr.contains("frames") && again.stderr.contains("--force"), "{}", again.stderr);
    let fewer = ["run", &scene, "--steps", "2", "--save", "frames", "--force"];
    nappe_in(folder.path(), &fewer).ok();
    let files = fs::read_dir(folder.path().join("frames")).expect("the folder").count();
    assert_eq!(files, 2, "nothing is left of the longer run");
}

#[test]
fn a_save_path_that_is_neither_recording_nor_folder_is_refused_before_anything_runs() {
    let done = nappe(&["run", "demo", "--save", "movie.avi"]);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains(".rrd"), "{}", done.stderr);
}

#[test]
fn a_diverged_run_ends_with_3_and_still_prints_its_object() {
    let folder = folder();
    let scene = write_scene(folder.path(), DIVERGING_SCENE);
    for save in [&[][..], &["--save", "frames"]] {
        let done = nappe_in(folder.path(), &[&["run", &scene, "--json"], save].concat());
        assert_eq!(done.code, Some(3), "{done:?}");
        let result = done.json();
        let diverged = &result["diverged"];
        assert!(diverged["step"].as_u64().is_some_and(|step| step > 0), "{result}");
        assert!(diverged["particle"].as_u64().is_some_and(|particle| particle < 64), "{result}");
        assert!(diverged["cause"].as_str().is_some_and(|cause| !cause.is_empty()), "{result}");
        assert!(done.stderr.contains("step"), "{}", done.stderr);
    }
}

#[test]
fn a_scene_that_cannot_be_read_names_file_line_and_field() {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("frame_interval", "frame_intervall"));
    let done = nappe(&["run", &scene]);
    assert_eq!(done.code, Some(1), "{done:?}");
    for part in ["scene.toml:6", "frame_intervall", "frame_interval"] {
        assert!(done.stderr.contains(part), "'{part}' is missing in: {}", done.stderr);
    }
}

#[test]
fn what_a_server_says_of_a_scene_names_the_file_and_a_line_of_it() {
    let folder = folder();
    nappe_in(folder.path(), &["mesh", "grid", "12x12", "--spacing", "0.05", "--out", "sheet.obj"]).ok();
    let from_file = SMALL_SCENE.replace("{ grid = [12, 12], spacing = 0.05 }", "{ file = \"sheet.obj\" }");
    for text in [SMALL_SCENE, from_file.as_str()] {
        // The schema allows it, and only who builds the scene knows better.
        let text = text.replace("[\"top_left\", \"top_right\"]", "[0,\n144]");
        fs::write(folder.path().join("drap.toml"), text).expect("written");
        let done = nappe_in(folder.path(), &["run", "drap.toml"]);
        assert_eq!(done.code, Some(5), "{done:?}");
        let part = "drap.toml:13:1: body[0].pins[1]: is 144; allowed: 0 to 143, the particles of this body";
        assert!(done.stderr.contains(part), "{}", done.stderr);
    }
}

#[test]
fn a_scene_that_is_not_utf_8_is_named_with_line_and_column() {
    let folder = folder();
    let file = folder.path().join("a.toml");
    let in_utf_16: Vec<u8> = "\u{feff}dt = 1".encode_utf16().flat_map(u16::to_le_bytes).collect();
    for (bytes, part) in [
        (
            &b"# one\n# the\xe9\n"[..],
            "a.toml:2:6: is not UTF-8 from the byte 0xe9 on: save the file as UTF-8",
        ),
        (&in_utf_16[..], "a.toml:1:1: is UTF-16: save the file as UTF-8"),
    ] {
        fs::write(&file, bytes).expect("written");
        for args in [
            &["run", "a.toml"][..],
            &["chart", "a.toml"],
            &["sweep", "a.toml", "--set", "dt=1", "--out", "x"],
        ] {
            let done = nappe_in(folder.path(), args);
            assert_eq!(done.code, Some(1), "{done:?}");
            assert!(done.stderr.contains(part), "{}", done.stderr);
        }
    }
    let marked = format!("\u{feff}{SMALL_SCENE}");
    fs::write(&file, marked).expect("written");
    nappe_in(folder.path(), &["run", "a.toml", "--steps", "1"]).ok();
}

#[test]
fn a_scene_that_is_not_there_is_named_with_those_that_are() {
    let unknown = nappe(&["run", "dmo"]);
    assert_eq!(unknown.code, Some(1), "{unknown:?}");
    assert!(unknown.stderr.contains("demo"), "{}", unknown.stderr);
    let missing = nappe(&["run", "no/such.toml"]);
    assert_eq!(missing.code, Some(1));
    assert!(missing.stderr.contains("no/such.toml"), "{}", missing.stderr);
}

#[test]
fn meshes_beside_a_scene_file_are_uploaded() {
    let folder = folder();
    nappe_in(folder.path(), &["mesh", "grid", "9x9", "--spacing", "0.05", "--out", "sheet.obj"]).ok();
    let text = SMALL_SCENE
        .replace("{ grid = [12, 12], spacing = 0.05 }", "{ file = \"sheet.obj\" }")
        .replace("[\"top_left\", \"top_right\"]", "[0, 8]");
    let scene = write_scene(folder.path(), &text);
    // From another folder: the file's place counts, not the command's.
    let result = nappe(&["run", &scene, "--steps", "5", "--json"]).ok().json();
    assert_eq!(result["particles"], 81);
}

#[test]
fn an_old_key_of_a_scene_is_read_and_its_new_name_told_once() {
    let folder = folder();
    nappe_in(folder.path(), &["mesh", "grid", "12x12", "--spacing", "0.05", "--out", "sheet.obj"]).ok();
    let from_file = SMALL_SCENE
        .replace("{ grid = [12, 12], spacing = 0.05 }", "{ file = \"sheet.obj\" }")
        .replace("[\"top_left\", \"top_right\"]", "[0, 11]");
    for text in [SMALL_SCENE, from_file.as_str()] {
        let run = |key: &str| {
            let text = text.replace("pins =", &format!("{key} = 64\npins ="));
            nappe(&["run", &write_scene(folder.path(), &text), "--steps", "5", "--json"]).ok()
        };
        let (old, new) = (run("grain"), run("block_size"));
        assert_eq!(old.json()["state_hash"], new.json()["state_hash"]);
        let told = old.stderr.matches(":12:1: body[0].grain: the key is now called 'block_size'").count();
        assert_eq!(told, 1, "{}", old.stderr);
        assert!(!new.stderr.contains("block_size"), "{}", new.stderr);
    }
}

#[test]
fn ctrl_c_ends_a_run_with_130() {
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let frame = folder.path().join("frames/frame-000001.ply");
    let saved = |_: &Child| until("a frame is saved", || frame.exists());
    let result = interrupted(folder.path(), &["run", &scene, "--json", "--save", "frames"], "INT", saved);
    assert!(result["steps"].as_u64().is_some_and(|steps| steps > 0), "{result}");
    let files = fs::read_dir(folder.path().join("frames")).expect("the folder").count();
    assert_eq!(result["frames"], files, "each frame that is counted is there: {result}");

    // Nothing tells from outside that a step was taken: on a busy machine, it may need more time.
    let mut time = Duration::from_millis(200);
    loop {
        let caught = |process: &Child| {
            until("it catches Ctrl-C", || catches_ctrl_c(process));
            thread::sleep(time);
        };
        let result = interrupted(folder.path(), &["run", &scene, "--json"], "INT", caught);
        if result["steps"].as_u64().is_some_and(|steps| steps > 0) {
            break;
        }
        time *= 4;
        assert!(time < Duration::from_mins(1), "no step is taken: {result}");
    }
}

#[test]
fn a_terminal_that_closes_ends_a_run_whose_page_is_whole() {
    if !hears_of_hangups() {
        return;
    }
    let folder = folder();
    let scene = write_scene(folder.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let page = folder.path().join("page.html");
    // The terminal and its shell both say that it closes.
    let said_once = |process: &Child| {
        let written = || fs::metadata(folder.path().join("page.html.new")).is_ok_and(|page| page.len() > 0);
        until("something of the page is written", written);
        let status = Command::new("kill").args(["-HUP", &process.id().to_string()]).status();
        assert!(status.expect("the signal is sent").success());
    };
    let result =
        interrupted(folder.path(), &["run", &scene, "--json", "--save", "page.html"], "HUP", said_once);
    assert_eq!(result["saved"], "page.html", "{result}");
    let text = fs::read_to_string(&page).expect("the page");
    let last = text.lines().last().unwrap_or_default();
    assert!(last.contains("class=\"nappe-end\""), "{last}");
}

/// Runs the command in a folder, and ends it by a signal once it `runs`; gives its object.
fn interrupted(folder: &Path, args: &[&str], signal: &str, runs: impl FnOnce(&Child)) -> Value {
    let mut run = command();
    run.current_dir(folder).args(args).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut process = run.spawn().expect("the command starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    runs(&process);
    assert_eq!(end_by(&mut process, signal), Some(130));
    let line = lines.rest().pop().expect("the object, all the same");
    let result: Value = serde_json::from_str(&line).expect("JSON");
    assert_eq!(result["interrupted"], true);
    result
}

/// Whether Ctrl-C would be caught by a process, as Linux tells; elsewhere it has had a while.
fn catches_ctrl_c(process: &Child) -> bool {
    let Ok(status) = fs::read_to_string(format!("/proc/{}/status", process.id())) else {
        thread::sleep(Duration::from_millis(1500));
        return true;
    };
    let mask = status.lines().find_map(|line| line.strip_prefix("SigCgt:"));
    // A bit for each signal from 1 on, and SIGINT is 2.
    mask.is_some_and(|mask| u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask & 0b10 != 0))
}

#[test]
fn values_of_keys_are_set_as_if_the_scene_had_them() {
    let folder = folder();
    let here = folder.path();
    let run = |options: &[&str]| nappe_in(here, &[&["run", "scene.toml", "--json"], options].concat());
    let changed = SMALL_SCENE.replace("steps = 40", "steps = 12\ngravity = [0.0, -1.0, 0.0]");
    write_scene(here, &changed);
    let written = run(&[]).ok().json();
    write_scene(here, SMALL_SCENE);
    let sets = ["--set", "gravity=[0, -1, 0]", "--set", "steps=12"];
    let set = run(&sets).ok().json();
    assert_eq!((&set["steps"], &set["state_hash"]), (&12.into(), &written["state_hash"]), "{set}");
    let shipped = nappe_in(here, &["run", "hanging_sheet", "--set", "steps=3", "--json"]).ok().json();
    assert_eq!(shipped["steps"], 3, "{shipped}");

    // A run goes on with the values that it began with.
    let saved = ["--save", "frames", "--fields", "velocity", "--steps", "6"];
    run(&[&sets[..], &saved].concat()).ok();
    let other = run(&["--resume", "frames"]);
    assert_eq!(other.code, Some(1), "{other:?}");
    assert!(other.stderr.contains("is another one than when"), "{}", other.stderr);
    let resumed = run(&[&sets[..], &["--resume", "frames"]].concat()).ok().json();
    assert_eq!(resumed["state_hash"], written["state_hash"], "{resumed}");

    for (set, told) in [
        ("gravty=1", "scene.toml: gravty: the scene has no such key; did you mean 'gravity'?"),
        ("dt=-1", "dt = -1"),
        ("dt", "'dt' is no KEY=VALUE"),
        ("=1", "'=1' is no KEY=VALUE"),
    ] {
        let done = run(&["--set", set]);
        assert_eq!(done.code, Some(2), "{done:?}");
        assert!(done.stderr.contains(told), "{set}: {}", done.stderr);
    }
    let twice = run(&["--set", "dt=0.01", "--set", "dt=0.02"]);
    assert_eq!(twice.code, Some(2), "{twice:?}");
    assert!(twice.stderr.contains("--set dt: the key is set twice"), "{}", twice.stderr);
}

#[test]
fn the_demo_ends_by_itself_and_says_what_ran() {
    let folder = folder();
    let done = nappe_in(folder.path(), &["--steps", "10", "--save", "frames"]).ok();
    for part in ["particles", "per step", "state hash", "frames"] {
        assert!(done.stdout.contains(part), "'{part}' is missing in:\n{}", done.stdout);
    }
    assert!(folder.path().join("frames").is_dir());
}

//! Runs that go on from a saved frame: as the run that was never cut, to the bit, whatever goes by the clock of the scene.

use std::{collections::BTreeMap, fs, path::Path, process::Stdio};

use serde_json::Value;

use crate::support::{
    Done, Folder, Lines, SMALL_SCENE, command, end_by, folder, nappe_in, until, write_scene,
};

/// Methods of the bodies of [`timed`]; where they name no medium, wind does not act.
const METHODS: [&str; 11] = [
    "drag = 1e-3",
    "drag = 1e-3\nintegrator = \"symplectic_euler\"",
    "integrator = \"velocity_verlet\"",
    "integrator = \"velocity_verlet_pc\"",
    "drag = 1e-3\nminimizer = \"newton\"",
    "drag = 1e-3\nminimizer = \"vertex_block_descent\"",
    "drag = 1e-3\nthickness = 0.004",
    "air = { lift = 1.0 }",
    "drag = 1e-3\nsubsteps = 3",
    // Sub-steps that are taken again, and as short as the last ones ask for.
    "drag = 1e-3\ntolerance = 2e-5",
    "air = { density = 2 }\nintegrator = \"symplectic_euler\"",
];

/// A scene of two bodies in which pins, wind, forces and a collider go by the clock.
pub(crate) fn timed(method: &str) -> String {
    let springs = "springs = { stretch = { stiffness = 60, damping = 0.02 }, shear = { stiffness = 30, damping = 0.01 }, \
                   bend = { stiffness = 2, damping = 0.002 } }";
    format!(
        r#"
version = 1
title = "what goes by the clock"
dt = 0.005
steps = 47
frame_interval = 5
wind_at = [
    {{ time = 0.02, velocity = [0, 0, 0] }},
    {{ time = 0.09, velocity = [3, 1, 2] }},
    {{ time = 0.2, velocity = [0, 0, 1] }},
]

[[body]]
name = "hangs"
mesh = {{ grid = [8, 7], spacing = 0.05, ripple = 0.003 }}
transform = {{ translate = [0, 0.3, 0] }}
mass = {{ density = 0.25 }}
pins = ["top_left", "top_right"]
moving_pin = [{{ pin = "top_left", offset = [0.04, 0.05, 0.02], duration = 0.16 }}]
force = [{{ on = 30, force = [0.01, 0.03, 0], from = 0.03, until = 0.113 }}]
{method}
{springs}

[[body]]
name = "falls"
mesh = {{ grid = [9, 9], spacing = 0.03 }}
transform = {{ translate = [0.08, 0.2, 0.08] }}
mass = {{ density = 0.25 }}
{method}
{springs}

[[collider]]
name = "ball"
sphere = {{ center = [0.2, 0, 0.2], radius = 0.15 }}
friction = 0.3
margin = 0.01
key = [
    {{ time = 0.02, position = [0.2, 0, 0.2] }},
    {{ time = 0.1, position = [0.22, 0.02, 0.2], turn = [0, 0.1, 0, 1] }},
    {{ time = 0.3, position = [0.15, 0, 0.25] }},
]
"#
    )
}

/// The header of a frame, and what follows it.
fn parts(path: &Path) -> (String, Vec<u8>) {
    let bytes = fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
    let end = b"end_header\n";
    let at = bytes.windows(end.len()).position(|window| window == end).expect("a header") + end.len();
    (String::from_utf8_lossy(&bytes[..at]).into_owned(), bytes[at..].to_vec())
}

/// The frames of a folder, by their steps: name and numbers.
fn frames(folder: &Path) -> BTreeMap<u64, (String, Vec<u8>)> {
    let mut found = BTreeMap::new();
    for entry in fs::read_dir(folder).expect("the folder") {
        let path = entry.expect("an entry").path();
        let name = path.file_name().expect("a name").to_string_lossy().into_owned();
        if name.starts_with("frame-") {
            let (header, numbers) = parts(&path);
            let step = header.lines().find_map(|line| line.strip_prefix("comment step ")).expect("a step");
            let before = found.insert(step.parse().expect("a number"), (name, numbers));
            assert!(before.is_none(), "two frames of step {step}");
        }
    }
    found
}

/// The numbers of the frames from a step on.
fn numbers_from(folder: &Path, first: u64) -> BTreeMap<u64, Vec<u8>> {
    let all = frames(folder).into_iter().map(|(step, (_, numbers))| (step, numbers));
    all.filter(|(step, _)| *step >= first).collect()
}

/// Runs a scene as a whole and keeps its frames; gives its object.
fn whole(here: &Folder, scene: &str, options: &[&str]) -> Value {
    let run = ["run", scene, "--quiet", "--json", "--save", "whole", "--fields", "velocity"];
    nappe_in(here.path(), &[&run[..], options].concat()).ok().json()
}

/// Has a run begin at a frame of the whole one: all later frames and the end are the same.
fn begin_at(here: &Folder, scene: &str, options: &[&str], frame: usize, end: &Value) {
    let (start, rest) = (format!("whole/frame-{frame:06}.ply"), format!("rest-{frame}"));
    let run = ["run", scene, "--quiet", "--json", "--save", &rest, "--fields", "velocity", "--start", &start];
    let done = nappe_in(here.path(), &[&run[..], options].concat()).ok();
    assert_eq!(done.stderr, "", "nothing is missing");
    let done = done.json();
    for number in ["state_hash", "steps", "time", "energy_at_end", "poses_at_end"] {
        assert_eq!(done[number], end[number], "{number} from frame {frame} on: {scene} {options:?}");
    }
    let (folder, name) = (here.path().join(&rest), format!("frame-{frame:06}.ply"));
    let first = *frames(&folder).first_key_value().expect("frames").0;
    let of_whole = frames(&here.path().join("whole"));
    assert_eq!(of_whole[&first].0, name, "it begins with the frame that was saved");
    let (rest, whole) = (numbers_from(&folder, first), numbers_from(&here.path().join("whole"), first));
    assert_eq!(rest.keys().collect::<Vec<_>>(), whole.keys().collect::<Vec<_>>(), "{scene} {options:?}");
    for (step, numbers) in &rest {
        assert!(*numbers == whole[step], "{scene} {options:?}: step {step}, begun at {first}");
    }
    assert_eq!(done["frames"], rest.len());
}

#[test]
fn whatever_goes_by_the_clock_goes_on_where_it_was_cut() {
    for (index, method) in METHODS.iter().enumerate() {
        let here = folder();
        let scene = write_scene(here.path(), &timed(method));
        for precision in ["f32", "f64"] {
            let options = ["--precision", precision, "--threads", "1"];
            let end = whole(&here, &scene, &options);
            assert_eq!(end["steps"], 47, "{method}: {end}");
            for frame in [1 + index % 4, 5 + index % 4] {
                begin_at(&here, &scene, &options, frame, &end);
                fs::remove_dir_all(here.path().join(format!("rest-{frame}"))).expect("it goes");
            }
            fs::remove_dir_all(here.path().join("whole")).expect("it goes");
        }
    }
}

#[test]
fn a_chain_whose_end_moves_arrives_where_the_scene_sends_it() {
    let here = folder();
    let chain = r#"
version = 1
title = "a chain whose end moves"
dt = 0.005
steps = 500
frame_interval = 20
precision = "f64"

[[body]]
name = "chain"
mesh = { chain = 41, spacing = 0.05 }
mass = { particle = 0.01 }
pins = ["first", "last"]
moving_pin = [{ pin = "last", offset = [-0.8, 0, 0], duration = 1.5 }]
springs = { stretch = { stiffness = 200, damping = 0.02 } }
"#;
    let scene = write_scene(here.path(), chain);
    let end = whole(&here, &scene, &[]);
    begin_at(&here, &scene, &[], 5, &end);
    let last = frames(&here.path().join("rest-5")).pop_last().expect("frames");
    // Six doubles a particle, of which the last is sent from x = 2 m.
    let (step, (_, numbers)) = last;
    let x: [u8; 8] = numbers[40 * 48..40 * 48 + 8].try_into().expect("eight bytes");
    assert!(step == 500 && (f64::from_le_bytes(x) - 1.2).abs() < 1e-9, "{} m", f64::from_le_bytes(x));
}

#[test]
fn shipped_scenes_of_cloth_go_on_where_they_were_cut_and_snow_is_refused_by_name() {
    for (scene, options, frame) in [
        ("hanging_sheet", ["--steps", "70", "--precision", "f64"], 7),
        ("flag", ["--steps", "60", "--precision", "f32"], 4),
        ("drap10", ["--steps", "120", "--precision", "f32"], 11),
        ("cloth_over_sphere", ["--steps", "120", "--precision", "f64"], 20),
        ("gripper", ["--steps", "760", "--precision", "f32"], 13),
    ] {
        let here = folder();
        let end = whole(&here, scene, &options);
        begin_at(&here, scene, &options, frame, &end);
    }
    for (scene, body) in [("two_snowballs", "left"), ("snow_and_cloth", "block")] {
        let here = folder();
        let options = ["--steps", "2", "--frame-interval", "1"];
        whole(&here, scene, &options);
        let run = ["run", scene, "--save", "rest", "--start", "whole/frame-000001.ply"];
        let done = nappe_in(here.path(), &[&run[..], &options].concat());
        assert_eq!(done.code, Some(1), "{done:?}");
        let told = format!("whole/frame-000001.ply: '{body}' is snow");
        assert!(done.stderr.contains(&told) && !here.path().join("rest").exists(), "{}", done.stderr);
    }
}

/// The line that an interrupted run says goes on, as words behind `nappe`.
fn told_line(stderr: &str) -> Vec<String> {
    let line = stderr.lines().find_map(|line| line.trim().strip_prefix("it goes on with: nappe "));
    let line = line.unwrap_or_else(|| panic!("no line that goes on: {stderr}"));
    line.split(' ').map(str::to_owned).collect()
}

#[test]
fn a_run_that_is_ended_by_ctrl_c_says_the_line_that_goes_on_in_its_folder() {
    let here = folder();
    let endless = write_scene(here.path(), &SMALL_SCENE.replace("steps = 40", "steps = 0"));
    let mut run = command();
    let args = ["run", &endless, "--save", "frames", "--fields", "velocity", "--precision=f64", "--force"];
    run.current_dir(here.path()).args(args).stdout(Stdio::null()).stderr(Stdio::piped());
    let mut process = run.spawn().expect("the command starts");
    let lines = Lines::of(process.stderr.take().expect("a pipe"));
    let third = here.path().join("frames/frame-000003.ply");
    until("a frame is saved", || third.exists());
    assert_eq!(end_by(&mut process, "INT"), Some(130));

    let words = told_line(&lines.rest().join("\n"));
    let expected = ["run", &endless, "--fields", "velocity", "--precision=f64", "--resume", "frames"];
    assert_eq!(words, expected);
    let reached = *frames(&here.path().join("frames")).last_key_value().expect("frames").0;
    let steps = (reached + 7).to_string();
    let words: Vec<&str> = words.iter().map(String::as_str).chain(["--steps", &steps, "--json"]).collect();
    let done = nappe_in(here.path(), &words).ok().json();
    let end = whole(&here, &endless, &["--precision", "f64", "--steps", &steps]);
    assert_eq!((&done["state_hash"], &done["steps"]), (&end["state_hash"], &end["steps"]));
    assert!(frames(&here.path().join("frames")) == frames(&here.path().join("whole")), "the same frames");

    // Frames without velocities are none to go on from, and no line says so.
    let mut run = command();
    run.current_dir(here.path()).args(["run", &endless, "--save", "plain"]);
    let mut process = run.stdout(Stdio::null()).stderr(Stdio::piped()).spawn().expect("it starts");
    let lines = Lines::of(process.stderr.take().expect("a pipe"));
    let second = here.path().join("plain/frame-000002.ply");
    until("a frame is saved", || second.exists());
    assert_eq!(end_by(&mut process, "INT"), Some(130));
    assert!(!lines.rest().join("\n").contains("--resume"));
}

#[test]
fn a_folder_in_which_a_run_goes_on_is_that_of_a_run_that_was_not_cut() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let run = |more: &[&str]| -> Done {
        nappe_in(
            here.path(),
            &[&["run", &scene, "--quiet", "--json", "--fields", "velocity"][..], more].concat(),
        )
    };
    let end = run(&["--save", "whole"]).ok().json();
    // A frame every two steps: that of step 13 gives way to the next one.
    run(&["--save", "frames", "--steps", "13"]).ok();
    assert_eq!(frames(&here.path().join("frames"))[&13].0, "frame-000007.ply");
    let done = run(&["--resume", "frames"]).ok();
    assert_eq!(done.stderr, "");
    let told = done.json();
    assert_eq!((&told["state_hash"], &told["steps"]), (&end["state_hash"], &end["steps"]));
    assert_eq!((&told["frames"], &told["saved"]), (&14.into(), &"frames".into()));
    assert!(frames(&here.path().join("frames")) == frames(&here.path().join("whole")), "the same frames");

    // It has ended.
    let again = run(&["--resume", "frames"]).ok().json();
    assert_eq!((&again["ended"], &again["steps"]), (&true.into(), &40.into()), "{again}");
    let text = nappe_in(here.path(), &["run", &scene, "--resume", "frames"]).ok().stdout;
    assert!(text.contains("The run in frames has ended: its last frame is that of step 40"), "{text}");
    assert!(frames(&here.path().join("frames")) == frames(&here.path().join("whole")), "nothing has changed");
    // It may go on beyond its end.
    let longer = run(&["--resume", "frames", "--steps", "44"]).ok().json();
    let end = run(&["--save", "longer", "--steps", "44"]).ok().json();
    assert_eq!(longer["state_hash"], end["state_hash"]);
}

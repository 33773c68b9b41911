//! Ranks of an MPI job that step sessions: the bits of one process, and what is said where they cannot start.

use std::{fs, path::Path};

use serde_json::Value;

use crate::support::{Done, SMALL_SCENE, Server, command, folder, nappe_in, skipped, until, write_scene};

/// The command, which may start jobs as root, as tests in containers do.
fn nappe(args: &[&str]) -> Done {
    let there = std::env::temp_dir();
    nappe_in(&there, &[args, &["--launcher", LAUNCHER, "--json"]].concat())
}

/// The usual launcher, for root too.
pub(crate) const LAUNCHER: &str =
    "mpirun --allow-run-as-root -n {ranks} --oversubscribe --bind-to none -x NAPPE_LINK {program}";

/// Whether ranks can be started here.
pub(crate) fn has_ranks() -> bool {
    let paths = std::env::var_os("PATH").unwrap_or_default();
    let has_launcher = std::env::split_paths(&paths).any(|folder| folder.join("mpirun").is_file());
    let has_program = Path::new(command().get_program()).with_file_name("nappe-rank").is_file();
    if !has_launcher || !has_program {
        skipped("there is no mpirun (Debian: openmpi-bin) or no nappe-rank (`cargo ranks` builds it)");
    }
    has_launcher && has_program
}

/// Bytes of all files of a folder, by name.
fn files(folder: &Path) -> Vec<(String, Vec<u8>)> {
    let read = |entry: Result<fs::DirEntry, _>| {
        let path = entry.expect("an entry").path();
        (path.file_name().expect("a name").to_string_lossy().into_owned(), fs::read(&path).expect("a file"))
    };
    let mut all: Vec<_> = fs::read_dir(folder).expect("a folder").map(read).collect();
    all.sort();
    all
}

#[test]
fn a_run_over_ranks_gives_the_files_of_a_run_without() {
    if !has_ranks() {
        return;
    }
    for (scene, steps) in [("hanging_sheet", "20"), ("cloth_over_sphere", "40"), ("drap10", "40")] {
        let alone = folder();
        let run = |to: &Path, ranks: &[&str]| {
            let to = to.to_str().expect("UTF-8");
            nappe(&[&["run", scene, "--steps", steps, "--save", to][..], ranks].concat()).ok().json()
        };
        let expected = run(alone.path(), &[]);
        assert_eq!((&expected["ranks"], &expected["hosts"]), (&0.into(), &Value::Array(Vec::new())));
        assert_eq!([&expected["messages"], &expected["gathers"]], [0, 0]);
        for ranks in 1..=4 {
            let there = folder();
            let done = run(there.path(), &["--ranks", &ranks.to_string()]);
            assert_eq!(done["state_hash"], expected["state_hash"], "{scene} on {ranks} ranks");
            assert_eq!(done["frames"], expected["frames"]);
            assert_eq!(
                (&done["ranks"], done["hosts"].as_array().map(Vec::len)),
                (&ranks.into(), Some(ranks))
            );
            assert!(files(there.path()) == files(alone.path()), "{scene} on {ranks} ranks: other files");
            let [messages, bytes, gathers] =
                ["messages", "message_bytes", "gathers"].map(|name| done[name].as_u64().expect("a count"));
            // All 100 particles of drap10 belong to one rank, which has no neighbours.
            assert_eq!((messages > 0, bytes > 0), (ranks > 1 && scene != "drap10", messages > 0));
            assert_eq!(gathers > 0, ranks > 1);
        }
    }
}

#[test]
fn a_stiff_scene_takes_two_levels_over_ranks_with_the_bits_of_one_process() {
    if !has_ranks() {
        return;
    }
    let folder = folder();
    // More than 64 blocks, from which on ranks divide the finest level, and 50, which they all do alike.
    for (side, block_size) in [(130, 256), (40, 32)] {
        let stiff = SMALL_SCENE.replace("[12, 12]", &format!("[{side}, {side}]"));
        let stiff = stiff.replace("mass =", &format!("block_size = {block_size}\nmass ="));
        let stiff = stiff.replace("steps = 40", "steps = 3").replace("stiffness = 200.0", "stiffness = 2e5");
        let scene = write_scene(folder.path(), &stiff);
        let expected = nappe(&["run", &scene]).ok().json();
        assert_eq!(expected["cloth_at_end"]["preconditioner"], "two_level", "what \"auto\" chooses");
        for ranks in ["1", "2", "4"] {
            let done = nappe(&["run", &scene, "--ranks", ranks]).ok().json();
            assert_eq!(done["state_hash"], expected["state_hash"], "{side} x {side} on {ranks} ranks");
            assert_eq!(done["cloth_at_end"], expected["cloth_at_end"], "{side} x {side} on {ranks} ranks");
        }
    }
}

/// A heap of snow that falls.
const SNOW: &str = r#"
version = 1
title = "heap"
dt = 0.01
steps = 6

[snow]
cell = 0.05

[[snow.object]]
name = "heap"
sphere = { center = [0, 0.6, 0], radius = 0.25 }
velocity = [3, -2, 0]
seed = 1

[[collider]]
name = "floor"
plane = { point = [0, 0, 0], normal = [0, 1, 0] }
friction = 0.5
"#;

#[test]
fn snow_over_ranks_gives_the_files_of_a_run_without() {
    if !has_ranks() {
        return;
    }
    let folder_of_scene = folder();
    let heap = write_scene(folder_of_scene.path(), SNOW);
    let more = ["--fields", "velocity,plastic_ratio,stress", "--grid", "slice:z=0"];
    for (scene, steps) in
        [(&*heap, "6"), ("snowball_wall", "6"), ("sphere_in_bed", "2"), ("snow_and_cloth", "10")]
    {
        let alone = folder();
        let run = |to: &Path, ranks: &[&str]| {
            let to = to.to_str().expect("UTF-8");
            nappe(&[&["run", scene, "--steps", steps, "--save", to][..], &more, ranks].concat()).ok().json()
        };
        let expected = run(alone.path(), &[]);
        for ranks in ["1", "2", "4"] {
            let there = folder();
            let done = run(there.path(), &["--ranks", ranks]);
            assert_eq!(done["state_hash"], expected["state_hash"], "{scene} on {ranks} ranks");
            assert_eq!(done["snow_at_end"], expected["snow_at_end"], "{scene} on {ranks} ranks");
            assert!(files(there.path()) == files(alone.path()), "{scene} on {ranks} ranks: other files");
        }
    }
}

/// The session, described after what the command did.
fn session(server: &Server, id: &str) -> Value {
    let all = server.nappe(&["list"]).ok().json();
    let mut all = all.as_array().expect("a list").iter();
    all.find(|session| session["session_id"] == id).expect("it is there").clone()
}

#[test]
fn a_session_with_ranks_is_paused_changed_watched_and_forked_like_one_without() {
    if !has_ranks() {
        return;
    }
    let server = Server::with(&["--launcher", LAUNCHER, "--max-ranks", "3"]);
    let folder = folder();
    let scene = write_scene(
        folder.path(),
        &SMALL_SCENE.replace("[12, 12]", "[30, 30]").replace("steps = 40", "steps = 0"),
    );
    let hashes = |id: &str, ranks: &[&str]| {
        server.nappe(&[&["create", &scene, "--id", id][..], ranks].concat()).ok();
        let mut hashes = Vec::new();
        let mut step = |count: &str| {
            let session = server.nappe(&["step", id, count]).ok().json();
            assert_eq!(session["state"], "paused");
            hashes.push(session["state_hash"].clone());
        };
        step("5");
        server.nappe(&["update", id, "--wind", "3,0,1", "--pin", "0=0.1,0.1,0:0.05"]).ok();
        step("5");
        server.nappe(&["update", id, "--stiffness", "bend=40", "--at-step", "12"]).ok();
        step("7");
        let fork = format!("{id}-fork");
        server.nappe(&["fork", id, "--id", &fork]).ok();
        step("3");
        hashes.push(server.nappe(&["step", &fork, "3"]).ok().json()["state_hash"].clone());

        server.nappe(&["play", id]).ok();
        until("some steps", || session(&server, id)["step"].as_u64() > Some(30));
        let paused = server.nappe(&["pause", id]).ok().json();
        assert_eq!(paused["state"], "paused");
        let watched = server.nappe(&["watch", id, "--count", "1"]).ok();
        assert!(watched.stdout.contains("energy"), "{watched:?}");
        let session = session(&server, id);
        server.nappe(&["stop", id]).ok();
        (hashes, session["ranks"].clone())
    };
    let (expected, none) = hashes("alone", &[]);
    assert_eq!(none, Value::Null);
    assert!(expected.iter().all(Value::is_string), "{expected:?}");
    assert_eq!(expected[3], expected[4]);
    let (found, ranks) = hashes("together", &["--ranks", "3"]);
    assert_eq!(found, expected);
    assert_eq!((&ranks["rank_count"], ranks["hosts"].as_array().map(Vec::len)), (&3.into(), Some(3)));
    assert!(ranks["gather_count"].as_u64() > Some(0), "{ranks}");
    assert_eq!(session(&server, "together")["state"], "finished");
    assert_eq!(session(&server, "together-fork")["ranks"], Value::Null);
}

#[test]
fn ranks_that_cannot_start_are_said_to() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let says = |args: &[&str], parts: &[&str]| {
        let done = nappe_in(here.path(), &[&["run", "--ranks", "2"][..], args].concat());
        assert!(done.code.is_some_and(|code| code > 0), "{done:?}");
        for part in parts {
            assert!(done.stderr.contains(part), "'{part}' is missing: {done:?}");
        }
    };
    // A program that is there, whatever it is.
    let program = env!("CARGO_BIN_EXE_nappe");
    says(&[&scene, "--rank-program", "nowhere"], &["RANKS_UNAVAILABLE", "nowhere", "cargo ranks"]);
    let launched = |launcher: &str, parts: &[&str]| {
        says(&[&scene, "--rank-program", program, "--launcher", launcher], parts);
    };
    launched("no-such-mpirun {ranks} {program}", &["RANKS_UNAVAILABLE", "no-such-mpirun", "openmpi-bin"]);
    launched("mpirun {program}", &["mpirun {program}", "{ranks}"]);
    launched("mpirun {ranks}", &["mpirun {ranks}", "{program}"]);
    launched("ls /{ranks}{program}", &["RANKS_NOT_STARTED", "the launcher ended", "No such file"]);
    // A launcher that asks for the option that Open MPI asks for.
    let refusal = "echo 'This can be overridden by adding the --allow-run-as-root option.' >&2\nexit 1\n";
    fs::write(here.path().join("refuse.sh"), refusal).expect("a script");
    let told = "It starts jobs of root with --launcher 'sh --allow-run-as-root refuse.sh {ranks} {program}'";
    launched("sh refuse.sh {ranks} {program}", &["RANKS_NOT_STARTED", told, "This can be overridden"]);
    let solved = SNOW.replace("cell = 0.05", "cell = 0.05\nbeta = 0.5");
    says(
        &[&write_scene(here.path(), &solved), "--rank-program", program],
        &["RANKS_UNSUPPORTED", "'heap'", "semi-implicit", "beta"],
    );
    let descent = SMALL_SCENE.replace("mass =", "minimizer = \"vertex_block_descent\"\nmass =");
    says(&[&write_scene(here.path(), &descent)], &["RANKS_UNSUPPORTED", "sheet", "vertex_block_descent"]);
    let thick = SMALL_SCENE.replace("mass =", "thickness = 0.01\nmass =");
    says(&[&write_scene(here.path(), &thick)], &["RANKS_UNSUPPORTED", "'sheet'", "thickness"]);
    let counted = SMALL_SCENE.replace("steps = 40", "steps = 40\ncontact = { surface = \"count\" }");
    says(&[&write_scene(here.path(), &counted)], &["RANKS_UNSUPPORTED", "'sheet'", "surface"]);

    let server = Server::with(&["--max-ranks", "1"]);
    let done = server.nappe(&["create", "flag", "--ranks", "2"]);
    assert!(done.stderr.contains("TOO_MANY_RANKS") && done.stderr.contains("at most 1"), "{done:?}");
    let server = Server::with(&["--max-ranks", "0"]);
    let done = server.nappe(&["create", "flag", "--ranks", "1"]);
    assert!(done.stderr.contains("TOO_MANY_RANKS"), "{done:?}");
}

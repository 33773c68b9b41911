//! Names that are typed wrongly: what is near is said, or what there is.

use std::fs;

use crate::support::{SMALL_SCENE, Server, folder, nappe, nappe_in, write_scene};

/// The command ends with this code and says all of these parts.
#[track_caller]
fn says(args: &[&str], code: i32, parts: &[&str]) {
    let done = nappe(args);
    assert_eq!(done.code, Some(code), "{args:?}: {done:?}");
    for part in parts {
        assert!(done.stderr.contains(part), "'{part}' is missing after {args:?}: {}", done.stderr);
    }
    assert!(done.stdout.is_empty(), "{done:?}");
}

#[test]
fn a_scene_that_is_not_there_gets_the_nearest_one() {
    for verb in [&["run"][..], &["scenes"], &["chart"], &["stability"], &["plan", "--tolerance", "1mm"]] {
        for (typed, near) in [("flga", "flag"), ("FLAG", "flag"), ("two-snowballs", "two_snowballs")] {
            let wanted = format!("no scene '{typed}' comes with nappe; did you mean '{near}'?");
            says(&[verb, &[typed]].concat(), 1, &[&wanted, "`nappe scenes` lists them"]);
        }
    }
    says(&["run", "nothing"], 1, &["no scene 'nothing' comes with nappe; allowed: demo, ", ", flag, "]);
}

#[test]
fn a_file_that_is_not_there_and_is_called_as_a_scene_is_told_so() {
    let here = folder();
    for verb in [&["run"][..], &["chart"], &["plan", "--tolerance", "1mm"]] {
        for typed in ["flag.toml", "FLAG.toml"] {
            let done = nappe_in(here.path(), &[verb, &[typed]].concat());
            assert_eq!(done.code, Some(1), "{done:?}");
            let told = format!("there is no file {typed}; 'flag' is a scene that comes with nappe");
            assert!(done.stderr.contains(&told), "{}", done.stderr);
        }
    }
    let own = nappe_in(here.path(), &["run", "own.toml"]);
    assert_eq!(own.code, Some(1), "{own:?}");
    assert!(own.stderr.contains("own.toml: ") && !own.stderr.contains("comes with"), "{}", own.stderr);
    fs::write(here.path().join("own.toml"), SMALL_SCENE).expect("a scene");
    let own = nappe_in(here.path(), &["run", "own"]);
    assert_eq!(own.code, Some(1), "{own:?}");
    assert!(own.stderr.contains("there is a file own.toml"), "{}", own.stderr);
}

#[test]
fn a_verb_that_is_not_there_gets_those_that_are_near() {
    for (typed, near) in
        [("server", "'serve'"), ("srve", "'serve'"), ("forc", "'fork'"), ("watchh", "'watch'")]
    {
        says(&[typed], 2, &[near]);
    }
}

#[test]
fn a_place_for_frames_says_which_endings_there_are() {
    let all = "an HTML page ends in .html, a Rerun recording in .rrd";
    for (typed, near) in [
        ("x.htm", "--save x.htm: no frames are kept in a .htm; did you mean '.html'?"),
        ("x.rdr", "did you mean '.rrd'?"),
        ("x.mp4", "allowed: .html, .rrd"),
    ] {
        says(&["run", "flag", "--save", typed], 2, &[near, all]);
        says(&["watch", "first", "--save", typed], 2, &[near, all]);
    }
}

#[test]
fn a_key_of_a_sweep_gets_the_nearest_one_wherever_it_stands() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    for (set, told) in [
        ("gravty=1", "did you mean 'gravity'?"),
        ("body.sheet.springs.bend.stifness=1", "did you mean 'body.sheet.springs.bend.stiffness'?"),
        ("springs.bend.stiffness=1", "did you mean 'body.sheet.springs.bend.stiffness'?"),
        ("drga=1", "did you mean 'body.sheet.drag'?"),
        ("gravity.y=1", "allowed: gravity.0, gravity.1, gravity.2"),
    ] {
        let done = nappe_in(here.path(), &["sweep", &scene, "--set", set, "--out", "out"]);
        assert_eq!(done.code, Some(2), "{done:?}");
        assert!(done.stderr.contains(told), "{}", done.stderr);
    }
    assert!(!here.path().join("out").exists(), "nothing was computed");
}

#[test]
fn an_address_needs_no_scheme() {
    let server = Server::with(&["--address", "localhost:0"]);
    let place = server.url.strip_prefix("http://127.0.0.1:").expect("it listens on loopback");
    for typed in [format!("localhost:{place}"), format!("127.0.0.1:{place}"), server.url.clone()] {
        let listed = nappe(&["list", "--json", "--server", &typed]).ok();
        assert_eq!(listed.json(), serde_json::json!([]), "{typed}");
        let run = nappe(&["run", "flag", "--steps", "2", "--json", "--server", &typed]).ok();
        assert_eq!(run.json()["steps"], 2, "{typed}");
    }
    says(&["serve", "--address", "localhost"], 2, &["localhost:6277", "unix:PATH"]);
    says(
        &["view", "first", "--connect", "http://localhost:9876"],
        2,
        &["a Rerun viewer is reached at localhost:9876"],
    );
}

//! `nappe class`: what it prints, how often its links are good, what a pupil can do, and how it ends.

use std::{fs, os::unix::fs::PermissionsExt as _, process::Stdio};

use serde_json::Value;

use crate::{
    links::opened,
    support::{Done, Lines, SMALL_SCENE, command, end_by, folder, nappe, run_to_end, write_scene},
};

/// The token in what a server answers to a code: the only word of 32 hexadecimal digits.
fn token(answer: &str) -> Option<String> {
    let words = answer.split(|c: char| !c.is_ascii_digit() && !('a'..='f').contains(&c));
    let mut tokens = words.filter(|word| word.len() == 32);
    let found = tokens.next()?.to_owned();
    assert!(tokens.next().is_none(), "{answer}");
    Some(found)
}

/// The ids of sessions in what `nappe list --json` says.
fn ids(listed: &Value) -> Vec<&str> {
    let sessions = listed.as_array().expect("an array");
    sessions.iter().map(|session| session["session_id"].as_str().expect("an id")).collect()
}

#[test]
fn a_class_has_a_link_for_the_teacher_and_one_that_each_pupil_opens_twice() {
    let here = folder();
    let scene = write_scene(here.path(), SMALL_SCENE);
    let mut class = command();
    class.args(["class", &scene, "--pupils", "2", "--address", "127.0.0.1:0", "--json"]);
    let mut process = class.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the class starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    let said: Value = serde_json::from_str(&lines.next().expect("a line")).expect("it is JSON");
    let mut keys: Vec<&String> = said.as_object().expect("an object").keys().collect();
    keys.sort_unstable();
    assert_eq!(keys, ["class_link", "link", "url"], "{said}");
    let [url, link, class_link] =
        ["url", "link", "class_link"].map(|key| said[key].as_str().expect("an address"));
    for link in [link, class_link] {
        assert!(link.starts_with(&format!("{url}/?session=class#")), "{said}");
    }

    // The teacher's is good once, and is the server's own token, which sees what there is.
    let whole = token(&opened(link)).expect("the token");
    assert!(opened(link).contains("grpc-status: 5"), "once");
    let listed = nappe(&["list", "--json", "--server", url]).ok().json();
    assert_eq!(ids(&listed), ["class"]);
    let session = &listed[0];
    let facts = [&session["state"], &session["step_limit"], &session["thread_count"]];
    assert_eq!(facts, [&Value::from("playing"), &Value::from(0), &Value::from(1)], "{session}");

    // The class's is good four times, each time for a token of its own.
    let mut tokens: Vec<String> =
        (0..4).map(|_| token(&opened(class_link)).expect("a pupil's token")).collect();
    assert!(opened(class_link).contains("grpc-status: 5"), "no fifth time");
    let files: Vec<String> =
        (0..4).map(|i| here.path().join(format!("pupil-{i}")).display().to_string()).collect();
    for (file, token) in files.iter().zip(&tokens) {
        fs::write(file, token).expect("a file");
        fs::set_permissions(file, fs::Permissions::from_mode(0o600)).expect("it is its owner's alone");
    }
    tokens.push(whole);
    tokens.sort_unstable();
    tokens.dedup();
    assert_eq!(tokens.len(), 5, "all are different");

    let by = |pupil: usize, args: &[&str]| -> Done {
        nappe(&[args, &["--json", "--server", url, "--token", &files[pupil]]].concat())
    };
    let copy = by(0, &["fork", "class"]).ok().json()["session_id"].as_str().expect("an id").to_owned();
    let mut seen = vec!["class", copy.as_str()];
    seen.sort_unstable();
    assert_eq!(ids(&by(0, &["list"]).ok().json()), seen);
    assert_eq!(ids(&by(1, &["list"]).ok().json()), ["class"], "nobody else's copy is there");
    by(0, &["step", &copy, "3"]).ok();
    for (pupil, args) in [(0, ["fork", "class"]), (0, ["pause", "class"]), (1, ["delete", "class"])] {
        let refused = by(pupil, &args);
        assert_eq!(refused.code, Some(5), "{args:?}: {refused:?}");
        assert!(refused.stderr.contains("LINK_TOO_NARROW"), "{args:?}: {}", refused.stderr);
    }
    let hidden = by(1, &["delete", &copy]);
    assert!(hidden.code == Some(5) && hidden.stderr.contains("SESSION_NOT_FOUND"), "{hidden:?}");
    by(1, &["fork", "class"]).ok();

    assert_eq!(end_by(&mut process, "INT"), Some(0));
    assert!(lines.rest().is_empty(), "and nothing else is said");
}

#[test]
fn a_class_says_in_words_what_its_copies_need_and_draws_nothing_into_a_pipe() {
    let mut class = command();
    class.args(["class", "hanging_sheet", "--pupils", "30", "--address", "127.0.0.1:0"]);
    let mut process = class.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the class starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    let first = lines.next().expect("a line");
    assert!(
        first.contains("shows 'A hanging sheet' to a class of 30 pupils on http://127.0.0.1:"),
        "{first}"
    );
    assert!(lines.next().expect("a line").contains("--allow-remote --address 0.0.0.0:6277"));
    let need = lines.next().expect("a line");
    assert!(need.starts_with("30 copies in real time need about "), "{need}");
    // 1 600 particles of 12 bytes, 50 pictures a second: the scene has a frame every 4 steps of 5 ms.
    assert!(need.ends_with("Pages need 28.8 MB/s of the network at most"), "{need}");
    assert!(lines.next().expect("a line").starts_with("the teacher, "));
    let link = lines.next().expect("a line");
    assert!(link.starts_with("the class, 60 times within 12 hours: http://127.0.0.1:"), "{link}");
    assert_eq!(end_by(&mut process, "TERM"), Some(0));
    assert!(lines.rest().is_empty(), "no picture");
}

#[test]
fn a_class_that_cannot_be_is_refused_by_name() {
    for (pupils, needed) in [
        ("0", "a whole number from 1 to 200 is needed"),
        ("201", "a whole number from 1 to 200 is needed"),
        ("-3", "a whole number from 1 to 200 is needed"),
        ("1e2", "a whole number from 1 to 200 is needed, such as 100"),
        ("many", "a whole number from 1 to 200 is needed"),
    ] {
        let done = nappe(&["class", "flag", &format!("--pupils={pupils}")]);
        assert_eq!((done.code, done.stdout.as_str()), (Some(2), ""), "{pupils}: {done:?}");
        assert!(done.stderr.contains("--pupils") && done.stderr.contains(needed), "{}", done.stderr);
    }
    assert_eq!(nappe(&["class", "flag"]).code, Some(2), "pupils are asked for");
    let unknown = nappe(&["class", "flg", "--pupils", "3", "--address", "127.0.0.1:0"]);
    assert!(unknown.code == Some(1) && unknown.stderr.contains("no scene 'flg'"), "{unknown:?}");
    let unix = nappe(&["class", "flag", "--pupils", "3", "--address", "unix:/nowhere/socket"]);
    assert!(unix.code == Some(2) && unix.stderr.contains("browsers cannot reach a Unix socket"), "{unix:?}");
    let mut open = command();
    open.args(["class", "flag", "--pupils", "3", "--address", "0.0.0.0:0"]).env_remove("NAPPE_ALLOW_REMOTE");
    let open = run_to_end(&mut open);
    assert!(open.code == Some(1) && open.stderr.contains("--allow-remote"), "{open:?}");
}

#[test]
fn a_scene_that_fails_in_its_first_steps_ends_the_class_and_says_why() {
    let here = folder();
    // A spring below a pin is longer than that after the first step.
    let fails = "integrator = \"symplectic_euler\"\nunchecked = true\nlimits = { max_stretch = 1.001 }\n";
    let text = SMALL_SCENE.replace("[body.springs]", &format!("{fails}[body.springs]"));
    let scene = write_scene(here.path(), &text);
    let done = nappe(&["class", &scene, "--pupils", "2", "--address", "127.0.0.1:0"]);
    assert_eq!((done.code, done.stdout.as_str()), (Some(3), ""), "{done:?}");
    assert!(done.stderr.contains("STRETCH_LIMIT"), "{}", done.stderr);
}

#[test]
fn a_class_on_a_network_says_what_a_listener_could_do_and_gives_pupils_an_address_that_they_reach() {
    let mut class = command();
    class.args(["class", "hanging_sheet", "--pupils", "1", "--allow-remote", "--address", "0.0.0.0:0"]);
    let mut process = class.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the class starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    lines.with("a class of 1 pupil on ");
    assert!(lines.next().expect("a line").contains("whoever listens on the way can do what a pupil can"));
    assert!(lines.with("the teacher, ").contains(": http://127.0.0.1:"), "it never leaves this machine");
    let line = lines.with("the class, 2 times ");
    let link = line.rsplit(' ').next().expect("an address");
    assert!(!link.contains("0.0.0.0"), "{link}");
    assert!(opened(link).contains("grpc-status:0"), "it is reached: {link}");
    assert_eq!(end_by(&mut process, "INT"), Some(0));
}

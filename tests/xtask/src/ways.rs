//! `cargo xtask prove builds`: after the README's first command, no other way into the workspace compiles again what is
//! there.
//!
//! Each way is built in a target folder of its own, and cargo tells what it found fresh. The quick tier compares features
//! alone (`tests/architecture/builds.rs`), in seconds; this is what they are compared for.

use std::{collections::BTreeSet, fs, path::Path, process::Command};

use crate::shell::{Failure, Shell, cargo};

/// The first command, as cargo builds it.
const FIRST: &str = "build --release --locked -p nappe-cli";

/// Every other way in.
const WAYS: [(&str, &str); 5] = [
    ("the command in the workspace", "build --release --locked --bin nappe"),
    ("the server", "build --release --locked -p nappe-server"),
    ("ranks", "build --release --locked --features nappe-cluster/mpi --bin nappe-rank"),
    ("tests", "test --release --locked --no-run"),
    ("slow tests", "test --release --locked --no-run --features nappe-tests/slow"),
];

/// Crates that a way has with features of its own.
const APART: [(&str, &str); 1] = [("ranks", "/server/cluster#")];

/// Builds all ways, one after the other.
pub(crate) fn prove(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("builds: each crate once", |shell| {
        let folder = shell.target().join("ways");
        if folder.is_dir() {
            fs::remove_dir_all(&folder)
                .map_err(|error| Failure(format!("{} cannot be removed: {error}", folder.display())))?;
        }
        let first = built(shell, FIRST, &folder)?;
        if first.len() < 100 {
            return Err(Failure(format!(
                "cargo tells of {} crates of the first build: too few to compare",
                first.len()
            )));
        }
        let mut complaints = Vec::new();
        for (title, way) in WAYS {
            let again = built(shell, way, &folder)?;
            let apart = |crate_: &str| APART.iter().any(|(of, name)| *of == title && crate_.contains(name));
            let twice = again.intersection(&first).filter(|crate_| !apart(crate_));
            complaints.extend(twice.map(|crate_| format!("{title}: compiled a second time: {crate_}")));
        }
        fs::remove_dir_all(&folder)
            .map_err(|error| Failure(format!("{} cannot be removed: {error}", folder.display())))?;
        if complaints.is_empty() { Ok(()) } else { Err(Failure(complaints.join("\n"))) }
    })
}

/// What cargo compiled, and did not find fresh: of the workspace each library, of a registry each crate with its features.
fn built(shell: &Shell, way: &str, folder: &Path) -> Result<BTreeSet<String>, Failure> {
    println!("\n=== cargo {way}");
    let mut build = Command::new(cargo());
    build.args(way.split_whitespace()).arg("--message-format=json-render-diagnostics");
    build.arg("--target-dir").arg(folder).current_dir(shell.root());
    Shell::forget_this_crate(&mut build);
    let output = build.output().map_err(|error| Failure(format!("cargo cannot be started: {error}")))?;
    if !output.status.success() {
        return Err(Failure(format!("cargo {way}: {}", String::from_utf8_lossy(&output.stderr))));
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().filter_map(compiled).collect())
}

/// The crate that a message of cargo says was compiled: where it is from, its kind, its level of optimisation, and of a
/// registry its features.
fn compiled(message: &str) -> Option<String> {
    if !message.contains("\"reason\":\"compiler-artifact\"") || !message.contains("\"fresh\":false") {
        return None;
    }
    let between = |start: &str, end: &str| Some(message.split_once(start)?.1.split_once(end)?.0);
    let id = between("\"package_id\":\"", "\"")?;
    let kind = between("\"kind\":[", "]")?;
    // Of the target cargo says whether it can be tested; of the profile, whether this is its test.
    let is_test = between("\"profile\":{", "}")?.contains("\"test\":true");
    if is_test || ["\"test\"", "\"bin\"", "custom-build"].iter().any(|other| kind.contains(other)) {
        return None;
    }
    let level = between("\"opt_level\":\"", "\"")?;
    let features = if id.starts_with("path+") { "" } else { between("\"features\":[", "]")? };
    Some(format!("{id} {kind} at level {level} {features}"))
}

#[test]
fn what_was_compiled_is_found_in_what_cargo_tells() {
    let message = r#"{"reason":"compiler-artifact","package_id":"registry+x#smallvec@1.1.0","target":{"kind":["lib"],"test":true},"profile":{"opt_level":"3","test":false},"features":["union"],"fresh":false}"#;
    let found = compiled(message).expect("it was compiled");
    assert!(found.contains("smallvec") && found.ends_with("at level 3 \"union\""), "{found}");
    assert_eq!(compiled(&message.replace("\"fresh\":false", "\"fresh\":true")), None);
    assert_eq!(compiled(&message.replace("[\"lib\"]", "[\"bin\"]")), None);
    assert_eq!(compiled(&message.replace("\"test\":false", "\"test\":true")), None);
    let ours = message.replace("registry+x#smallvec", "path+file:///r/proto#nappe-proto");
    assert!(compiled(&ours).is_some_and(|found| !found.contains("union")));
}

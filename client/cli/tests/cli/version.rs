//! What the command says of itself: version, commit and processor level.

use std::{path::Path, process::Command};

use crate::support::{command, nappe, run_to_end};

/// The first twelve digits of the commit that is checked out; `unknown` where the sources are no repository.
fn commit() -> String {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut git = Command::new("git");
    git.args(["rev-parse", "--short=12", "HEAD"]).current_dir(&root);
    let answer = git.output().ok().filter(|answer| answer.status.success() && root.join(".git").exists());
    let text = answer.map(|answer| String::from_utf8(answer.stdout).expect("digits"));
    text.map_or_else(|| "unknown".to_owned(), |text| text.trim().to_owned())
}

fn level() -> &'static str {
    let wide = std::arch::is_x86_feature_detected!("avx512f")
        && std::arch::is_x86_feature_detected!("avx512dq")
        && std::arch::is_x86_feature_detected!("avx512vl");
    if wide { "avx512 of this processor" } else { "avx2 of this processor" }
}

#[test]
fn the_version_says_commit_and_processor_level() {
    let version = env!("CARGO_PKG_VERSION");
    let whole = format!("nappe {version} (commit {}, {})\n", commit(), level());
    assert_eq!(nappe(&["--version"]).ok().stdout, whole);
    assert_eq!(nappe(&["-V"]).ok().stdout, whole);
}

#[test]
fn a_processor_without_avx2_has_a_version_all_the_same() {
    let done = run_to_end(command().arg("--version").env("NAPPE_HIDE_AVX2", "1")).ok();
    assert!(done.stdout.ends_with("no avx2 in this processor)\n"), "{}", done.stdout);
}

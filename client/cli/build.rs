//! Tells the command the commit that it is built from, and leaves out the names of its functions: enters HEAD, leaves `NAPPE_COMMIT`.

use std::{env, path::Path, process::Command};

/// The repository, from the folder of this crate. Sources without one, of a package or a copy, may lie inside another.
const REPOSITORY: &str = "../../.git";

fn main() {
    println!("cargo:rerun-if-changed=build.rs");
    // Both change with a checkout, and the log with every commit as well; cargo runs this again for no other change.
    for file in ["HEAD", "logs/HEAD"] {
        let path = git(&["rev-parse", "--git-path", file]);
        if let Some(path) = path.filter(|path| Path::new(path).exists()) {
            println!("cargo:rerun-if-changed={path}");
        }
    }
    // Names of functions are a third of the program. Who profiles it asks for them: CARGO_PROFILE_RELEASE_DEBUG=1.
    let is = |name: &str, value: &str| env::var(name).is_ok_and(|found| found == value);
    if is("PROFILE", "release") && is("DEBUG", "false") && is("CARGO_CFG_TARGET_OS", "linux") {
        println!("cargo:rustc-link-arg-bins=-Wl,--strip-all");
    }
    let commit = git(&["rev-parse", "--short=12", "HEAD"]).unwrap_or_else(|| "unknown".to_owned());
    println!("cargo:rustc-env=NAPPE_COMMIT={commit}");
}

/// What git answers; nothing without git, a repository or a commit.
fn git(arguments: &[&str]) -> Option<String> {
    if !Path::new(REPOSITORY).exists() {
        return None;
    }
    let answer = Command::new("git").args(arguments).output().ok()?;
    let text = String::from_utf8(answer.stdout).ok()?;
    answer.status.success().then(|| text.trim().to_owned())
}

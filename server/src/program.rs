//! A program of nappe that another one starts: it stands beside it, or on PATH.

use std::{env, path::PathBuf};

/// The program of this name beside the one that runs, or else the first on PATH; `None` where there is none.
#[must_use]
pub fn find_program(name: &str) -> Option<PathBuf> {
    let file = format!("{name}{}", env::consts::EXE_SUFFIX);
    let beside = || Some(env::current_exe().ok()?.with_file_name(&file)).filter(|path| path.is_file());
    let on_path = || {
        let folders = env::var_os("PATH")?;
        env::split_paths(&folders).map(|folder| folder.join(&file)).find(|path| path.is_file())
    };
    beside().or_else(on_path)
}

//! A folder beside a picture, for what its making needs: the page, the browser's own files, what programs say.
//!
//! It goes when the picture is made, or failed. What a killed run left of it goes with the next run.

use std::{
    fs::{self, File},
    io::{self, Read as _, Seek as _, SeekFrom},
    path::{Path, PathBuf},
    thread,
    time::Duration,
};

use nappe_scene::printable;

use crate::{
    files::write,
    words::error::{CliError, Result},
};

/// Files that it has.
const PAGE: &str = "page.html";
const FILM: &str = "film.mp4";
/// Who says something on standard error.
pub(super) const BROWSER: &str = "browser";
pub(super) const FFMPEG: &str = "ffmpeg";
/// The folder of the browser.
const PROFILE: &str = "profile";
/// A browser that was killed may still write for a moment: how often its folder is removed, and how long apart.
const TRIES: u32 = 10;
const APART: Duration = Duration::from_millis(50);
/// Most that is told of what a program said (bytes, lines).
const SAID_BYTES: u64 = 4096;
const SAID_LINES: usize = 10;

/// The folder; it goes with this.
#[derive(Debug)]
pub(super) struct Scratch(PathBuf);

impl Scratch {
    /// Makes it for a picture whose name this run holds.
    ///
    /// # Errors
    /// When the system does not let it, or something else has its name.
    pub(super) fn beside(path: &Path) -> Result<Self> {
        let mut name = write::beside(path).into_os_string();
        name.push(".page");
        let folder = PathBuf::from(name);
        clear(&folder);
        let made = fs::create_dir(&folder);
        made.map_err(|error| CliError::file("make the folder", &folder, &error))?;
        Ok(Self(folder))
    }

    /// The page that is drawn.
    pub(super) fn page(&self) -> PathBuf {
        self.0.join(PAGE)
    }

    /// Where a film is made.
    pub(super) fn film(&self) -> PathBuf {
        self.0.join(FILM)
    }

    /// What the browser keeps.
    pub(super) fn profile(&self) -> PathBuf {
        self.0.join(PROFILE)
    }

    /// A file for what a program says on standard error; gives it, and where it is.
    ///
    /// # Errors
    /// When the system does not let it.
    pub(super) fn log(&self, program: &str) -> Result<(File, PathBuf)> {
        let path = self.0.join(log_of(program));
        let log = File::options().create(true).append(true).open(&path);
        log.map(|log| (log, path.clone())).map_err(|error| CliError::file("write", &path, &error))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        for _ in 0..TRIES {
            clear(&self.0);
            if !self.0.exists() {
                return;
            }
            thread::sleep(APART);
        }
    }
}

fn log_of(program: &str) -> String {
    format!("{program}.log")
}

/// Removes what a folder has of this, and the folder, if nothing else is in it.
fn clear(folder: &Path) {
    // What is not there need not go, and what cannot be removed is told when the folder is made anew.
    let files = [PAGE.to_owned(), format!("{PAGE}.new"), FILM.to_owned(), log_of(BROWSER), log_of(FFMPEG)];
    for file in files {
        let _ = fs::remove_file(folder.join(file));
    }
    let _ = fs::remove_dir_all(folder.join(PROFILE));
    let _ = fs::remove_dir(folder);
}

/// The last lines of a log, as the end of a message; nothing where there are none.
pub(super) fn last_lines(log: &Path) -> String {
    let text = tail(log).unwrap_or_default();
    let lines: Vec<&str> = text.lines().map(str::trim).filter(|line| !line.is_empty()).collect();
    let last: Vec<_> =
        lines[lines.len().saturating_sub(SAID_LINES)..].iter().map(|line| printable(line)).collect();
    if last.is_empty() { String::new() } else { format!(". Its last lines:\n{}", last.join("\n")) }
}

fn tail(log: &Path) -> io::Result<String> {
    let mut file = File::open(log)?;
    let size = file.metadata()?.len();
    file.seek(SeekFrom::Start(size.saturating_sub(SAID_BYTES)))?;
    let mut bytes = Vec::new();
    file.take(SAID_BYTES).read_to_end(&mut bytes)?;
    Ok(String::from_utf8_lossy(&bytes).into_owned())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_a_killed_run_left_goes_and_what_others_put_there_stays() {
        let place = std::env::temp_dir().join(format!("nappe-scratch-{}", std::process::id()));
        fs::create_dir_all(&place).expect("a temporary folder");
        let picture = place.join("a.png");
        let left = place.join("a.png.new.page");
        fs::create_dir_all(left.join("profile/Default")).expect("a folder");
        fs::write(left.join("page.html.new"), "half").expect("a file");
        let scratch = Scratch::beside(&picture).expect("what was left goes");
        assert_eq!(fs::read_dir(&left).expect("it is new").count(), 0);
        let (_, log) = scratch.log(BROWSER).expect("a file");
        fs::write(&log, format!("{}\n\nlast \u{1b}[2J\n", "x\n".repeat(99))).expect("a file");
        let said = last_lines(&log);
        assert!(said.ends_with("x\nlast \\u{1b}[2J") && said.lines().count() == 11, "{said}");
        fs::write(scratch.page(), "page").expect("a file");
        drop(scratch);
        assert_eq!((left.exists(), last_lines(&log).as_str()), (false, ""));

        fs::create_dir(&left).expect("a folder");
        fs::write(left.join("mine"), "mine").expect("a file");
        let error = Scratch::beside(&picture).expect_err("it is not empty").to_string();
        assert!(error.contains("cannot make the folder") && error.contains("a.png.new.page"), "{error}");
        assert_eq!(fs::read(left.join("mine")).expect("it is there"), b"mine");
        fs::remove_dir_all(place).expect("it goes");
    }
}

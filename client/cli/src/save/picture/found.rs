//! The programs that draw: a browser of the family of Chromium, and ffmpeg for a film.
//!
//! Enters: `NAPPE_BROWSER`, what is on PATH, the usual places of macOS. Leaves: paths of programs.

use std::path::{Path, PathBuf};

use nappe_server::find_program;

use crate::words::error::{CliError, Result};

/// The variable that names a browser.
const VARIABLE: &str = "NAPPE_BROWSER";
/// What browsers are called on PATH.
const BROWSERS: [&str; 7] = [
    "chromium",
    "chromium-browser",
    "google-chrome",
    "google-chrome-stable",
    "chrome",
    "microsoft-edge",
    "microsoft-edge-stable",
];
/// Where macOS has them, which is not on PATH.
const PLACES: &[&str] = if cfg!(target_os = "macos") {
    &[
        "/Applications/Google Chrome.app/Contents/MacOS/Google Chrome",
        "/Applications/Chromium.app/Contents/MacOS/Chromium",
        "/Applications/Microsoft Edge.app/Contents/MacOS/Microsoft Edge",
    ]
} else {
    &[]
};
const FILMS: &str = "ffmpeg";

/// The browser that `NAPPE_BROWSER` names, or else the first that is found.
///
/// # Errors
/// When there is none, with what to install; on systems where none is spoken to.
pub(super) fn browser() -> Result<PathBuf> {
    if cfg!(not(unix)) {
        return Err(CliError::usage("pictures and films are drawn on Linux and macOS alone")
            .hint("the page of --save FILE.html saves pictures: its button Save"));
    }
    if let Some(named) = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from) {
        if named.is_file() {
            // A name without a folder would be looked for on PATH.
            return Ok(std::path::absolute(&named).unwrap_or(named));
        }
        let name = named.display();
        return Err(CliError::usage(format!("{VARIABLE} names {name}, and no such program is there")));
    }
    let usual = || PLACES.iter().map(Path::new).find(|path| path.is_file()).map(Path::to_owned);
    BROWSERS.into_iter().find_map(find_program).or_else(usual).ok_or_else(|| {
        CliError::usage(format!(
            "a picture needs a browser that draws it, and none of these is on PATH: {}",
            BROWSERS.join(", ")
        ))
        .hint(format!(
            "install Chromium, Chrome or Edge (Debian: apt install chromium), or name one by {VARIABLE}=PATH; the page of --save FILE.html saves pictures too"
        ))
    })
}

/// The program that makes a film of pictures.
///
/// # Errors
/// When there is none, with what to install.
pub(super) fn ffmpeg() -> Result<PathBuf> {
    find_program(FILMS).ok_or_else(|| {
        CliError::usage(format!("a film is made by {FILMS}, which is not on PATH"))
            .hint("install it (Debian: apt install ffmpeg); a picture FILE.png does not need it")
    })
}

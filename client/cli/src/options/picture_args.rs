//! What a picture or a film of a run is asked for: which instant, how large, in which colours.
//!
//! Enters: options of `run`, `mecasim`, the demo and `watch`. Leaves: what was checked against where the frames go.

use std::{fmt, path::Path};

use clap::{Args, ValueEnum};
use nappe_server::numbers::{Least, SECONDS, real};

use crate::{
    files::paths,
    words::error::{CliError, Result},
};

/// Sides of a picture (pixels) that browsers draw.
const LEAST: u32 = 16;
const MOST: u32 = 8192;

/// What a picture or a film is asked for.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct PictureArgs {
    /// Simulated time of a picture FILE.png (s), of which the nearest frame is drawn [default: that of the last frame]
    #[arg(long, value_name = "SECONDS", value_parser = real(SECONDS, Least::From0))]
    at: Option<f64>,
    /// Width and height of a picture or a film (pixels) [default: 1280x720]
    #[arg(long, value_name = "WIDTHxHEIGHT", value_parser = size)]
    size: Option<Size>,
    /// Colours of a picture or a film [default: light]
    #[arg(long, value_enum)]
    theme: Option<Theme>,
}

/// Width and height (pixels).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Size {
    pub(crate) width: u32,
    pub(crate) height: u32,
}

impl Default for Size {
    fn default() -> Self {
        Self { width: 1280, height: 720 }
    }
}

impl fmt::Display for Size {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

/// Colours of a page.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, ValueEnum)]
pub(crate) enum Theme {
    /// Before a dark background
    Dark,
    /// Before a light background
    #[default]
    Light,
}

impl Theme {
    /// As pages ask a browser for it.
    pub(crate) const fn name(self) -> &'static str {
        match self {
            Self::Dark => "dark",
            Self::Light => "light",
        }
    }
}

impl PictureArgs {
    /// Checks the choices against where the frames go.
    ///
    /// # Errors
    /// When no picture is made there, or a film cannot be so large.
    pub(crate) fn check(&self, save: Option<&Path>) -> Result<()> {
        let (is_picture, is_film) = (save.is_some_and(paths::is_picture), save.is_some_and(paths::is_film));
        let is_none = !is_picture && !is_film;
        let any = "a picture FILE.png or a film FILE.mp4";
        let choices = [
            ("--at", self.at.is_some() && !is_picture, "a picture FILE.png"),
            ("--size", self.size.is_some() && is_none, any),
            ("--theme", self.theme.is_some() && is_none, any),
        ];
        if let Some((option, _, place)) = choices.into_iter().find(|(_, is_wrong, _)| *is_wrong) {
            let there = save
                .map_or_else(|| "--save is missing".to_owned(), |path| format!("{} is none", path.display()));
            return Err(CliError::usage(format!("{option} belongs to {place}, and {there}")));
        }

        let Size { width, height } = self.size();
        if is_film && (width % 2 == 1 || height % 2 == 1) {
            return Err(CliError::usage(format!(
                "--size {width}x{height}: width and height of a film are even numbers"
            )));
        }
        Ok(())
    }

    /// Simulated time of the picture (s); none: that of the last frame.
    pub(crate) fn at(&self) -> Option<f64> {
        self.at
    }

    /// How large it is.
    pub(crate) fn size(&self) -> Size {
        self.size.unwrap_or_default()
    }

    /// The colours of the page, light unless they were chosen.
    pub(crate) fn theme(&self) -> Theme {
        self.theme.unwrap_or_default()
    }
}

/// Reads `WIDTHxHEIGHT`, in pixels.
fn size(text: &str) -> std::result::Result<Size, String> {
    let side = |typed: &str| typed.parse::<u32>().ok().filter(|side| (LEAST..=MOST).contains(side));
    let sides = text.split_once('x').and_then(|(width, height)| Some((side(width)?, side(height)?)));
    sides.map(|(width, height)| Size { width, height }).ok_or_else(|| {
        format!("'{text}' is no WIDTHxHEIGHT, as 1280x720, of two numbers from {LEAST} to {MOST}")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_size_has_two_sides_that_browsers_draw() {
        assert_eq!(size("640x480"), Ok(Size { width: 640, height: 480 }));
        assert_eq!(Size::default().to_string(), "1280x720");
        for wrong in ["640", "640x", "x480", "15x480", "640x8193", "640X480", "640x480x3", "-640x480", ""] {
            assert!(size(wrong).is_err_and(|error| error.contains("from 16 to 8192")), "{wrong}");
        }
    }

    #[test]
    fn what_is_asked_of_a_picture_needs_one() {
        let at = PictureArgs { at: Some(1.0), ..PictureArgs::default() };
        let odd = PictureArgs { size: Some(Size { width: 641, height: 480 }), ..PictureArgs::default() };
        let dark = PictureArgs { theme: Some(Theme::Dark), ..PictureArgs::default() };
        let places = |args: PictureArgs| {
            [None, Some("folder"), Some("a.html"), Some("a.png"), Some("A.PNG"), Some("a.mp4")]
                .map(|path| args.check(path.map(Path::new)).is_ok())
        };
        assert_eq!(places(at), [false, false, false, true, true, false]);
        assert_eq!(places(odd), [false, false, false, true, true, false]);
        assert_eq!(places(dark), [false, false, false, true, true, true]);
        assert_eq!(places(PictureArgs::default()), [true; 6]);
    }
}

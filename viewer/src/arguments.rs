//! The command line of the display program.

use std::{
    path::{Path, PathBuf},
    str::FromStr,
};

use clap::Parser;
use nappe_client::{Delivery, Field, GridOptions, WatchOptions};
use nappe_rerun::{ColorBy, ShowOptions, Sink};

use crate::tell::Audience;

/// Shows sessions of a nappe server in Rerun, or records one.
///
/// Exit codes are those of `nappe`: 1 a failure, 2 a wrong command line, 3 a simulation that diverged, 4 no server, 5 a
/// refusal of the server.
#[derive(Debug, Parser)]
#[command(
    name = "nappe-viewer",
    version,
    max_term_width = 110,
    after_help = "\
Examples:
  nappe-viewer --session first                       a viewer on this screen, started if none is running
  nappe-viewer --session first --save first.rrd      every frame that the server keeps and those to come
  nappe-viewer --every-session --connect rerun+http://192.168.1.5:9876/proxy

With --json standard output has an object per line: {\"watching\"} when the session's frames come, {\"note\"} while it
runs, and last {\"session_id\", \"frames\", \"dropped\", \"finished\", \"saved\"} or {\"error\", \"reason\"}."
)]
#[allow(clippy::struct_excessive_bools, reason = "each is a switch of the command line")]
pub(crate) struct Arguments {
    /// Address of the server
    #[arg(long, value_name = "URL", default_value = "http://127.0.0.1:6277", env = "NAPPE_SERVER")]
    pub(crate) server: String,
    /// File with the token of the server, or - for the first line of standard input [default: found, if the server is
    /// yours and on this machine]
    #[arg(long, value_name = "FILE|-", env = "NAPPE_TOKEN_FILE")]
    pub(crate) token: Option<PathBuf>,
    /// Id of the session
    #[arg(long, value_name = "ID", required_unless_present = "every_session")]
    pub(crate) session: Option<String>,
    /// Show every session of the server, those there and those to come, until Ctrl-C
    #[arg(
        long,
        conflicts_with_all = ["session", "save", "paced", "from", "count", "name", "fields", "color", "grid"]
    )]
    every_session: bool,
    /// Write every frame to this file (.rrd) instead of opening a viewer
    #[arg(long, value_name = "FILE", conflicts_with = "connect")]
    pub(crate) save: Option<PathBuf>,
    /// Show the session in the viewer at this address, for example rerun+http://127.0.0.1:9876/proxy
    #[arg(long, value_name = "URL")]
    connect: Option<String>,
    /// Record every frame from the session's start, which waits for them; one that is missing at its end is a failure
    #[arg(long, requires = "save", conflicts_with = "from")]
    pub(crate) paced: bool,
    /// First frame to record, or newest [default: the oldest that the server keeps]
    #[arg(long, value_name = "FRAME|newest", requires = "save")]
    from: Option<First>,
    /// End after N frames
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u64).range(1..))]
    count: Option<u64>,
    /// What the recording is called in Rerun [default: the session's title]
    #[arg(long, value_name = "TEXT")]
    name: Option<String>,
    /// Ask for these arrays as well: velocity, plastic_ratio or stress, the first of which is shown as colour; force or
    /// acceleration, which are shown as arrows
    #[arg(long, value_name = "ARRAY,...", value_delimiter = ',')]
    fields: Vec<Field>,
    /// What the colour of snow shows: plastic_ratio, speed, stress or body
    #[arg(long, value_name = "WHAT")]
    color: Option<ColorBy>,
    /// Show the snow's grid as well: its mass as smoke, or its velocities on a plane, slice:y=0.5 (m)
    #[arg(long, value_name = "smoke|slice:AXIS=METRES")]
    grid: Option<GridOptions>,
    /// Most nodes of the grid per frame [default: as many as the server allows]
    #[arg(long, value_name = "N", requires = "grid", value_parser = clap::value_parser!(u32).range(1..))]
    grid_nodes: Option<u32>,
    /// Print JSON on standard output, for programs
    #[arg(long)]
    json: bool,
    /// End, and close the recording, when standard input is closed: a program that starts this one holds it open
    #[arg(long)]
    pub(crate) until_stdin_closes: bool,
}

/// The first frame of a recording.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum First {
    /// The newest when the watching begins.
    Newest,
    /// The one with this number.
    Frame(u64),
}

impl FromStr for First {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        match text {
            "newest" => Ok(Self::Newest),
            number => number
                .parse()
                .map(Self::Frame)
                .map_err(|_wrong| "a frame's number, from 0, or newest".to_owned()),
        }
    }
}

impl Arguments {
    /// Whether the token is the first line of standard input.
    pub(crate) fn reads_token(&self) -> bool {
        self.token.as_deref() == Some(Path::new("-"))
    }

    /// Who reads what the program says.
    pub(crate) fn audience(&self) -> Audience {
        if self.json { Audience::Program } else { Audience::Person }
    }

    /// Where it is shown.
    pub(crate) fn sink(&self) -> Sink {
        match (&self.save, &self.connect) {
            (Some(path), _) => Sink::Save(path.clone()),
            (None, Some(url)) => Sink::Connect(url.clone()),
            (None, None) => Sink::Spawn,
        }
    }

    /// How a session is shown whose oldest frame is `oldest_frame`.
    pub(crate) fn options(&self, oldest_frame: u64) -> ShowOptions {
        let mut options = ShowOptions::for_sink(&self.sink(), oldest_frame);
        let watch = &mut options.watch;
        if self.paced {
            *watch = WatchOptions { pace_to_watcher: true, ..WatchOptions::every_from(0) };
        }
        match self.from {
            Some(First::Frame(frame)) => watch.from_frame = Some(frame),
            Some(First::Newest) => {
                *watch = WatchOptions { delivery: Delivery::Every, ..WatchOptions::default() };
            }
            None => {}
        }
        watch.fields = self.fields.iter().copied().collect();
        watch.grid = self
            .grid
            .map(|grid| GridOptions { max_nodes: self.grid_nodes.unwrap_or(grid.max_nodes), ..grid });
        options.color_by = self.color.or_else(|| self.fields.iter().copied().find_map(ColorBy::of));
        options.name.clone_from(&self.name);
        options.frame_limit = self.count;
        options
    }
}

#[cfg(test)]
mod tests {
    use clap::CommandFactory as _;

    use super::*;

    fn parsed(words: &[&str]) -> Result<Arguments, clap::Error> {
        Arguments::try_parse_from(["nappe-viewer"].iter().chain(words))
    }

    #[test]
    fn the_command_line_holds_together() {
        Arguments::command().debug_assert();
        assert!(parsed(&["--session", "first"]).is_ok() && parsed(&["--every-session"]).is_ok());
        for wrong in [
            &[][..],
            &["--every-session", "--session", "first"],
            &["--session", "first", "--paced"],
            &["--session", "first", "--save", "a.rrd", "--from", "soon"],
            &["--session", "first", "--save", "a.rrd", "--count", "0"],
            &["--session", "first", "--fields", "weight"],
        ] {
            assert!(parsed(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn what_is_asked_for_reaches_the_options() {
        let save = ["--session", "first", "--save", "a.rrd"];
        let of = |words: &[&str]| parsed(&[&save, words].concat()).expect("it parses").options(7);
        let plain = of(&[]).watch;
        assert_eq!((plain.delivery, plain.from_frame), (Delivery::Every, Some(7)));
        let paced = of(&["--paced"]).watch;
        assert_eq!((paced.pace_to_watcher, paced.from_frame), (true, Some(0)));
        let newest = of(&["--from", "newest"]).watch;
        assert_eq!((newest.delivery, newest.from_frame), (Delivery::Every, None));
        assert_eq!(of(&["--from", "3"]).watch.from_frame, Some(3));
        let shown = of(&["--fields", "stress,velocity", "--grid", "smoke", "--grid-nodes", "9"]);
        assert_eq!(shown.color_by, Some(ColorBy::Stress));
        assert!(shown.watch.fields.contains(Field::Velocities));
        assert_eq!(shown.watch.grid.map(|grid| grid.max_nodes), Some(9));
        assert_eq!(of(&["--fields", "stress", "--color", "speed"]).color_by, Some(ColorBy::Speed));
        assert_eq!(of(&["--fields", "force,velocity"]).color_by, Some(ColorBy::Speed));
        let arrows = of(&["--fields", "force,acceleration"]);
        assert_eq!(arrows.color_by, None);
        assert!(
            arrows.watch.fields.contains(Field::Forces) && arrows.watch.fields.contains(Field::Accelerations)
        );
    }
}

//! `cargo xtask picture`: the way of the data through nappe, drawn into `docs/images/data-flow.svg`, and the pictures
//! of pages.
//!
//! Reads nothing; gives the text of an SVG. [`run`] writes it, and a test compares it with the committed
//! file, so that the picture and the words in this file cannot part.

use std::{fmt::Write as _, fs};

use crate::{
    moving,
    shell::{Failure, Shell},
};

/// Where the picture is kept.
pub(crate) const FILE: &str = "docs/images/data-flow.svg";

/// Width and height of the picture (pixels).
const SIZE: [u32; 2] = [1130, 420];

/// A box: left, top, width, height (pixels), its colour, its title, and lines of small print.
struct Room {
    place: [u32; 4],
    fill: &'static str,
    title: &'static str,
    lines: &'static [&'static str],
}

/// A line with an arrow's head at its end: its corners (pixels), and words with the place of their middle.
struct Arrow {
    corners: &'static [[u32; 2]],
    words: &'static str,
    at: [u32; 2],
}

/// Colours of what a user holds, of the numerics, of the service, and of programs that watch.
const USER: &str = "#fff4d6";
const NUMERICS: &str = "#dcebfb";
const SERVICE: &str = "#e4f3e1";
const READER: &str = "#f3e4f5";

/// Processes, drawn behind everything: place and title.
const PROCESSES: [([u32; 4], &str); 2] = [
    ([180, 20, 680, 380], "the server: a program of its own, or inside the command"),
    ([895, 20, 220, 380], "clients, on any machine"),
];

const ROOMS: [Room; 11] = [
    Room { place: [15, 70, 135, 62], fill: USER, title: "scene file", lines: &["TOML: units, ranges"] },
    Room { place: [15, 152, 135, 62], fill: USER, title: "meshes", lines: &["OBJ, OFF, PLY, .eti"] },
    Room {
        place: [200, 95, 130, 96],
        fill: SERVICE,
        title: "nappe-scene",
        lines: &["reads and checks", "fills solids", "builds the world"],
    },
    Room {
        place: [372, 70, 175, 150],
        fill: NUMERICS,
        title: "nappe-sim: World",
        lines: &[
            "cloth and snow, one clock",
            "Model: never changes",
            "State: what is saved",
            "Workspace: scratch",
            "step(&model, &mut state,",
            "     &mut workspace)",
        ],
    },
    Room { place: [610, 70, 115, 62], fill: SERVICE, title: "frame", lines: &["encoded once"] },
    Room {
        place: [610, 175, 115, 78],
        fill: SERVICE,
        title: "history",
        lines: &["a ring, bounded", "by bytes"],
    },
    Room {
        place: [755, 70, 90, 183],
        fill: SERVICE,
        title: "watchers",
        lines: &["a task each,", "which waits", "for its reader", "", "(the step", "never waits)"],
    },
    Room {
        place: [915, 70, 185, 62],
        fill: READER,
        title: "nappe-viewer",
        lines: &["draws frames with Rerun"],
    },
    Room {
        place: [915, 147, 185, 62],
        fill: READER,
        title: "nappe run --save",
        lines: &["a recording, or PLY meshes"],
    },
    Room {
        place: [915, 224, 185, 62],
        fill: READER,
        title: "your program",
        lines: &["Rust, Python, a web page"],
    },
    Room {
        place: [372, 312, 473, 62],
        fill: SERVICE,
        title: "service",
        lines: &["create, play, pause, step, update, stop, delete"],
    },
];

const ARROWS: [Arrow; 11] = [
    Arrow { corners: &[[150, 101], [200, 125]], words: "", at: [0, 0] },
    Arrow { corners: &[[150, 183], [200, 160]], words: "", at: [0, 0] },
    Arrow { corners: &[[330, 143], [372, 143]], words: "", at: [0, 0] },
    Arrow { corners: &[[430, 70], [430, 50], [484, 50], [484, 70]], words: "every step", at: [457, 44] },
    Arrow { corners: &[[547, 101], [610, 101]], words: "positions", at: [578, 94] },
    Arrow { corners: &[[667, 132], [667, 175]], words: "", at: [0, 0] },
    Arrow { corners: &[[725, 214], [755, 214]], words: "", at: [0, 0] },
    Arrow { corners: &[[845, 101], [915, 101]], words: "gRPC", at: [877, 94] },
    Arrow { corners: &[[845, 178], [915, 178]], words: "", at: [0, 0] },
    Arrow { corners: &[[845, 240], [915, 240]], words: "", at: [0, 0] },
    Arrow { corners: &[[1007, 286], [1007, 343], [845, 343]], words: "commands", at: [935, 336] },
];

/// The one arrow against the stream: commands reach the session's thread between two steps.
const COMMANDS: Arrow =
    Arrow { corners: &[[457, 312], [457, 220]], words: "read between steps", at: [520, 272] };

/// Writes the picture, and draws those of pages.
pub(crate) fn run(shell: &mut Shell, _: &[String]) -> Result<(), Failure> {
    data_flow(shell)?;
    moving::draw(shell)
}

/// Writes the way of the data.
pub(crate) fn data_flow(shell: &mut Shell) -> Result<(), Failure> {
    shell.step(FILE, |shell| {
        fs::write(shell.root().join(FILE), svg()).map_err(|error| Failure(format!("{FILE}: {error}")))
    })
}

/// The picture as SVG. A background of its own keeps it readable on dark pages.
fn svg() -> String {
    let [width, height] = SIZE;
    let mut out = format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"{width}\" \
         height=\"{height}\" font-family=\"Helvetica, Arial, sans-serif\" font-size=\"12\" fill=\"#1b1f24\">\n\
         <title>The way of the data: scene file, world, frames, history, watchers, clients</title>\n\
         <defs><marker id=\"head\" viewBox=\"0 0 8 8\" refX=\"7\" refY=\"4\" markerWidth=\"8\" markerHeight=\"8\" \
         orient=\"auto\"><path d=\"M0 0 8 4 0 8z\" fill=\"#57606a\"/></marker></defs>\n\
         <rect width=\"{width}\" height=\"{height}\" fill=\"#ffffff\"/>\n"
    );

    for (place, title) in PROCESSES {
        rectangle(&mut out, place, "#f6f8fa\" stroke-dasharray=\"5 4");
        text(
            &mut out,
            [place[0] + 10, place[1] + place[3] - 8],
            "font-style=\"italic\" fill=\"#57606a\"",
            title,
        );
    }
    for room in ROOMS {
        draw(&mut out, &room);
    }
    for arrow in ARROWS.iter().chain([&COMMANDS]) {
        point(&mut out, arrow);
    }

    out.push_str("</svg>\n");
    out
}

fn draw(out: &mut String, room: &Room) {
    let [left, top, ..] = room.place;
    rectangle(out, room.place, room.fill);
    text(out, [left + 9, top + 20], "font-weight=\"bold\" font-size=\"13\"", room.title);
    for (line, words) in (1..).zip(room.lines) {
        text(out, [left + 9, top + 22 + 17 * line], "xml:space=\"preserve\"", words);
    }
}

fn point(out: &mut String, arrow: &Arrow) {
    let corners: Vec<_> = arrow.corners.iter().map(|[x, y]| format!("{x},{y}")).collect();
    let line = "fill=\"none\" stroke=\"#57606a\" stroke-width=\"1.6\" marker-end=\"url(#head)\"";
    put(out, &format!("<polyline points=\"{}\" {line}/>", corners.join(" ")));
    if !arrow.words.is_empty() {
        text(out, arrow.at, "text-anchor=\"middle\" font-size=\"11\"", arrow.words);
    }
}

fn rectangle(out: &mut String, [left, top, width, height]: [u32; 4], fill: &str) {
    let place = format!("x=\"{left}\" y=\"{top}\" width=\"{width}\" height=\"{height}\"");
    put(out, &format!("<rect {place} rx=\"7\" stroke=\"#8c959f\" fill=\"{fill}\"/>"));
}

fn text(out: &mut String, [x, y]: [u32; 2], style: &str, words: &str) {
    let words = words.replace('&', "&amp;");
    put(out, &format!("<text x=\"{x}\" y=\"{y}\" {style}>{words}</text>"));
}

fn put(out: &mut String, element: &str) {
    writeln!(out, "{element}").expect("a text takes what is written to it");
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_committed_picture_is_the_one_that_is_drawn() {
        let file = Shell::at_repository_root().root().join(FILE);
        let there = fs::read_to_string(file).expect("the picture is committed");
        assert!(there == svg(), "{FILE} is another: run `cargo xtask picture`");
    }

    #[test]
    fn nothing_is_drawn_outside_of_the_picture() {
        let [width, height] = SIZE;
        let corners = ROOMS.iter().map(|room| room.place).chain(PROCESSES.map(|(place, _)| place));
        let corners = corners.map(|[left, top, wide, high]| [left + wide, top + high]);
        let ends = ARROWS.iter().flat_map(|arrow| arrow.corners.iter().copied());
        assert!(corners.chain(ends).all(|[x, y]| x <= width && y <= height));
    }
}

//! What the command writes on standard output: JSON for programs, tables and sentences for people.
//!
//! All of it is made printable here: titles and names come from others, and have no say over a terminal.
//! A reader that closes the pipe early (`nappe list | head`) ends the output without an error.

use std::io::{self, Write};

use clap::Args;
use comfy_table::{CellAlignment, Table};
use nappe_scene::{printable, printable_json};
/// Lengths, times and counts are written here as pictures have them.
pub(crate) use nappe_study::quantity::{count, length, moment, several, three, time};
use serde::Serialize;

use crate::words::error::{CliError, Result};

/// The option that every verb which prints has.
#[derive(Args, Clone, Copy, Debug, Default)]
pub(crate) struct OutputArgs {
    /// Print JSON on standard output, for programs
    #[arg(long, help_heading = "Output")]
    json: bool,
}

/// Who reads the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Format {
    /// A person, who gets tables and sentences.
    Text,
    /// A program, which gets JSON.
    Json,
}

impl OutputArgs {
    /// Who reads the output.
    pub(crate) fn format(self) -> Format {
        if self.json { Format::Json } else { Format::Text }
    }
}

/// Writes a line on standard output, or several.
///
/// # Errors
/// When standard output cannot be written, a full disk for instance.
pub(crate) fn line(text: &str) -> Result<()> {
    verbatim(&shown(text))
}

/// A text of several lines, each of them printable.
fn shown(text: &str) -> String {
    text.split('\n').map(printable).collect::<Vec<_>>().join("\n")
}

/// Writes a text that this program made itself, as it is.
///
/// # Errors
/// As [`line()`].
pub(crate) fn verbatim(text: &str) -> Result<()> {
    let mut out = io::stdout().lock();
    // In one piece: who reads the first line of several and leaves has got them all.
    match out.write_all(format!("{text}\n").as_bytes()).and_then(|()| out.flush()) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::BrokenPipe => std::process::exit(0),
        Err(error) => Err(CliError::failure(format!("cannot write on standard output: {error}"))),
    }
}

/// Writes one JSON value on one line.
///
/// # Errors
/// As [`line()`].
pub(crate) fn json(value: &impl Serialize) -> Result<()> {
    let text = serde_json::to_string(value)
        .map_err(|error| CliError::failure(format!("cannot write the answer as JSON: {error}")))?;
    verbatim(&printable_json(&text))
}

/// Writes a sentence for the person at the terminal on standard error, where it cannot mix with
/// output that a program reads.
pub(crate) fn note(text: &str) {
    // Nobody is left to be told when standard error is closed.
    let _ = writeln!(io::stderr().lock(), "{}", shown(text));
}

/// The name of a column, and to which side its cells go.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Column {
    Left(&'static str),
    Right(&'static str),
}

/// A table without frames: columns apart by two blanks, numbers to the right.
pub(crate) fn table(columns: &[Column], rows: &[Vec<String>]) -> String {
    let mut table = Table::new();
    table.load_style(comfy_table::presets::NOTHING);
    table.set_header(columns.iter().map(|column| match column {
        Column::Left(name) | Column::Right(name) => *name,
    }));
    for row in rows {
        // A line end in a name would make rows of its own.
        table.add_row(row.iter().map(|cell| printable(cell)));
    }

    for (index, column) in columns.iter().enumerate() {
        if let Some(cells) = table.column_mut(index) {
            let (alignment, padding) = match column {
                Column::Left(_) => (CellAlignment::Left, (0, 2)),
                Column::Right(_) => (CellAlignment::Right, (0, 2)),
            };
            cells.set_cell_alignment(alignment);
            cells.set_padding(padding);
        }
    }

    table.lines().map(|line| line.trim_end().to_owned()).collect::<Vec<_>>().join("\n")
}

/// A state hash as scripts see it: 16 hexadecimal digits.
pub(crate) fn hash(value: u64) -> String {
    format!("{value:016x}")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_stand_to_the_right_and_lines_end_without_blanks() {
        let text = table(
            &[Column::Left("name"), Column::Right("count")],
            &[vec!["a".into(), "1".into()], vec!["bc".into(), "1 000".into()]],
        );
        assert_eq!(text, "name  count\na         1\nbc    1 000");
    }

    #[test]
    fn hashes_have_sixteen_digits() {
        assert_eq!(hash(255), "00000000000000ff");
    }

    #[test]
    fn names_of_others_have_no_say_over_a_terminal() {
        let text = table(&[Column::Left("title")], &[vec!["a\nb\u{1b}[2J\u{202e}".into()]]);
        assert_eq!(text, "title\na\\u{a}b\\u{1b}[2J\\u{202e}");
        assert_eq!(shown("one\ntwo\u{9b}\n"), "one\ntwo\\u{9b}\n");
    }
}

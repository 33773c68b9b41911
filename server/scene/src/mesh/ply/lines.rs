//! Lines of bytes with any end of line, LF, CR LF or CR, and their numbers.

use crate::{error::excerpt, mesh::numbers::line_length};

/// The lines of a text, behind which binary numbers may follow.
#[derive(Clone, Debug)]
pub(super) struct Lines<'a> {
    /// What follows the line that was read last.
    pub(super) rest: &'a [u8],
    /// Number of the line that was read last, from 1; 0: none was.
    pub(super) number: usize,
    /// A CR ends a line by itself: an LF behind it is the first binary number.
    has_cr_alone: bool,
}

impl<'a> Lines<'a> {
    /// The lines of a text, without a byte order mark. The first end of line tells whether a CR stands alone.
    pub(super) fn new(bytes: &'a [u8]) -> Self {
        let rest = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
        let first = &rest[line_length(rest)..];
        let has_cr_alone = first.starts_with(b"\r") && !first.starts_with(b"\r\n");
        Self { rest, number: 0, has_cr_alone }
    }

    /// The next bytes, so many, if they are there.
    pub(super) fn take_bytes(&mut self, count: usize) -> Option<&'a [u8]> {
        let (bytes, rest) = self.rest.split_at_checked(count)?;
        self.rest = rest;
        Some(bytes)
    }
}

impl<'a> Iterator for Lines<'a> {
    type Item = &'a [u8];

    fn next(&mut self) -> Option<&'a [u8]> {
        if self.rest.is_empty() {
            return None;
        }
        let (line, end) = self.rest.split_at(line_length(self.rest));
        let end_length = match end {
            [] => 0,
            [b'\r', b'\n', ..] if !self.has_cr_alone => 2,
            _ => 1,
        };
        self.rest = &end[end_length..];
        self.number += 1;
        Some(line)
    }
}

/// The words of a line.
pub(super) fn words(line: &[u8]) -> impl Iterator<Item = &[u8]> {
    line.split(u8::is_ascii_whitespace).filter(|word| !word.is_empty())
}

/// At most 40 characters of what was found, for a message.
pub(super) fn quoted(found: &[u8]) -> String {
    // So many bytes hold more than 40 characters.
    excerpt(&String::from_utf8_lossy(&found[..found.len().min(200)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_end_of_line_gives_the_same_lines_and_leaves_the_same_bytes() {
        for end in ["\n", "\r\n", "\r"] {
            for mark in ["", "\u{feff}"] {
                let text = format!("{mark}ply{end}{end} a b{end}\n\r");
                let mut lines = Lines::new(text.as_bytes());
                let read: Vec<&[u8]> = lines.by_ref().take(3).collect();
                assert_eq!(read, [&b"ply"[..], b"", b" a b"], "{text:?}");
                assert_eq!((lines.rest, lines.number), (&b"\n\r"[..], 3), "{text:?}");
            }
        }
    }

    #[test]
    fn a_quotation_is_short_and_says_that_it_was_cut() {
        assert_eq!(quoted(b"ply"), "ply");
        for long in [vec![b'a'; 1000], vec![0xff; 1000], "é".repeat(100).into_bytes()] {
            let short = quoted(&long);
            assert!(short.chars().count() == 43 && short.ends_with("..."), "{short}");
        }
    }
}

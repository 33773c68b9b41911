//! Numbers in text: the six significant digits of a C++ stream, and tokens with their line.

use std::str::FromStr;

use crate::error::{ErrorKind, SceneError, excerpt};

/// Writes a number as a C++ stream does by default: 6 significant digits, no trailing zeros,
/// an exponent below 1e-4 and from 1e6 on, `-0` for a negative zero.
pub fn six_digits(value: f64) -> String {
    if value == 0.0 || !value.is_finite() {
        return format!("{value}");
    }
    let scientific = format!("{value:.5e}");
    let (digits, exponent) = scientific.split_once('e').expect("the format has an exponent");
    let exponent: i32 = exponent.parse().expect("the format's exponent is a number");
    if (-4..6).contains(&exponent) {
        let fixed = format!("{value:.*}", usize::try_from(5 - exponent).expect("exponent is below 6"));
        return trim_zeros(&fixed).to_owned();
    }

    let sign = if exponent < 0 { '-' } else { '+' };
    format!("{}e{sign}{:02}", trim_zeros(digits), exponent.abs())
}

fn trim_zeros(digits: &str) -> &str {
    if digits.contains('.') { digits.trim_end_matches('0').trim_end_matches('.') } else { digits }
}

/// The number that [`six_digits`] writes: `value` rounded to 6 significant digits.
pub fn to_six_digits(value: f64) -> f64 {
    six_digits(value).parse().unwrap_or(value)
}

/// A line of a text with its number, from 1.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Line<'a> {
    pub(crate) file: &'a str,
    pub(crate) number: usize,
    pub(crate) text: &'a str,
}

/// The lines of a text that hold something once `comment` (to the end of the line) is taken away.
pub(crate) fn lines<'a>(
    file: &'a str,
    text: &'a str,
    comment: Option<char>,
) -> impl Iterator<Item = Line<'a>> + Clone {
    (1..)
        .zip(ended(text))
        .map(move |(number, text)| {
            let text = comment.and_then(|c| text.split_once(c)).map_or(text, |(before, _)| before);
            Line { file, number, text: text.trim_ascii() }
        })
        .filter(|line| !line.text.is_empty())
}

/// The lines of a text, each of which ends with LF, CR LF or CR.
fn ended(text: &str) -> impl Iterator<Item = &str> + Clone {
    let mut rest = text;
    std::iter::from_fn(move || {
        if rest.is_empty() {
            return None;
        }
        let (line, after) = rest.split_at(line_length(rest.as_bytes()));
        rest = after.strip_prefix("\r\n").or_else(|| after.get(1..)).unwrap_or("");
        Some(line)
    })
}

/// Bytes before the first end of a line, LF or CR. Sixteen bytes without one are passed over together.
pub(super) fn line_length(bytes: &[u8]) -> usize {
    let is_end = |byte: u8| matches!(byte, b'\n' | b'\r');
    let (chunks, _) = bytes.as_chunks::<16>();
    let has_none = |chunk: &&[u8; 16]| !chunk.iter().fold(false, |has, byte| has | is_end(*byte));
    let from = 16 * chunks.iter().take_while(has_none).count();
    bytes[from..].iter().position(|byte| is_end(*byte)).map_or(bytes.len(), |at| from + at)
}

impl<'a> Line<'a> {
    pub(crate) fn error(&self, kind: ErrorKind, message: impl Into<String>) -> SceneError {
        SceneError::new(kind, self.file, message).at_line(self.number)
    }

    pub(crate) fn words(&self) -> Vec<&'a str> {
        self.text.split_ascii_whitespace().collect()
    }

    /// Puts its words in place of those of another line, so that one vector serves all lines of a file.
    pub(crate) fn words_into(&self, words: &mut Vec<&'a str>) {
        words.clear();
        words.extend(self.text.split_ascii_whitespace());
    }

    /// A finite number. `what` names it in the message.
    pub(crate) fn number(&self, word: &str, what: &str) -> Result<f64, SceneError> {
        f64::from_str(word).ok().filter(|x| x.is_finite()).ok_or_else(|| {
            self.error(ErrorKind::Syntax, format!("{what} is '{}'; allowed: a finite number", excerpt(word)))
        })
    }

    /// So many finite numbers from the first words; more words are left alone.
    pub(crate) fn numbers<const N: usize>(&self, words: &[&str], what: &str) -> Result<[f64; N], SceneError> {
        let mut out = [0.0; N];
        if words.len() < N {
            let message = format!("{what} has {} numbers; allowed: {N}", words.len());
            return Err(self.error(ErrorKind::Syntax, message));
        }
        for (value, word) in out.iter_mut().zip(words) {
            *value = self.number(word, what)?;
        }
        Ok(out)
    }

    /// The index of a point, from 0, below `count`.
    pub(crate) fn index(&self, word: &str, count: usize) -> Result<u32, SceneError> {
        let index = u32::from_str(word).ok().filter(|i| (*i as usize) < count);
        index.ok_or_else(|| {
            let allowed = match count {
                0 => "none, there are no points".to_owned(),
                _ => format!("0 to {}, the points of this mesh", count - 1),
            };
            self.error(ErrorKind::OutOfRange, format!("names point '{}'; allowed: {allowed}", excerpt(word)))
        })
    }

    /// A count. It is what a file says of itself: take no memory for it.
    pub(crate) fn count(&self, word: &str, what: &str) -> Result<usize, SceneError> {
        usize::from_str(word).ok().ok_or_else(|| {
            let message = format!("the number of {what} is '{}'; allowed: a whole number", excerpt(word));
            self.error(ErrorKind::Syntax, message)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_ends_at_its_first_end_wherever_that_stands() {
        for end in [b'\n', b'\r'] {
            for length in 0..50 {
                let mut bytes = vec![b'0'; length];
                assert_eq!(line_length(&bytes), length, "without an end");
                bytes.push(end);
                bytes.extend_from_slice(b"1\n\r2");
                assert_eq!(line_length(&bytes), length);
            }
        }
    }
}

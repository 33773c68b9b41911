//! Text from users that is safe to show: without control characters, escape sequences, line ends and the marks
//! that reverse the direction of a text, with which a name can pass for another or move a terminal's cursor.

use std::borrow::Cow;

/// Whether a text may be shown as it is.
pub fn is_printable(text: &str) -> bool {
    text.chars().all(is_harmless)
}

/// A text with everything that is not harmless as an escape: `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    if is_printable(text) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_harmless(c) { shown.push(c) } else { shown.extend(c.escape_unicode()) }
    }
    Cow::Owned(shown)
}

fn is_harmless(c: char) -> bool {
    let is_invisible = matches!(
        c,
        // Marks, embeddings, overrides and isolates of direction.
        '\u{61c}' | '\u{200e}' | '\u{200f}' | '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}'
        // Ends of lines and paragraphs, and what takes no width.
        | '\u{2028}' | '\u{2029}' | '\u{200b}' | '\u{feff}'
    );
    !c.is_control() && !is_invisible
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_any_language_pass_and_escapes_do_not() {
        for good in ["", "cloth", "Schürze 3", "布", "نسيج", "\u{1f9e3}"] {
            assert!(is_printable(good), "{good}");
            assert_eq!(printable(good), good);
        }
        for (bad, shown) in [
            ("\u{1b}[31mred", "\\u{1b}[31mred"),
            ("a\nb", "a\\u{a}b"),
            ("\u{202e}tnuom", "\\u{202e}tnuom"),
            ("\u{9b}2J", "\\u{9b}2J"),
            ("x\u{7f}", "x\\u{7f}"),
        ] {
            assert!(!is_printable(bad));
            assert_eq!(printable(bad), shown);
        }
    }
}

//! Text from users that is safe to show: without control characters, escape sequences, line ends and characters that
//! show nothing or reverse the direction of a text, with which a name can pass for another or move a terminal's cursor.

use std::{borrow::Cow, fmt::Write as _, ops::RangeInclusive};

/// What shows nothing by itself: Unicode's property Default_Ignorable_Code_Point, which holds joiners, selectors, tags
/// and all marks, embeddings, overrides and isolates of direction.
static IGNORABLE: [RangeInclusive<char>; 17] = [
    '\u{ad}'..='\u{ad}',
    '\u{34f}'..='\u{34f}',
    '\u{61c}'..='\u{61c}',
    '\u{115f}'..='\u{1160}',
    '\u{17b4}'..='\u{17b5}',
    '\u{180b}'..='\u{180f}',
    '\u{200b}'..='\u{200f}',
    '\u{202a}'..='\u{202e}',
    '\u{2060}'..='\u{206f}',
    '\u{3164}'..='\u{3164}',
    '\u{fe00}'..='\u{fe0f}',
    '\u{feff}'..='\u{feff}',
    '\u{ffa0}'..='\u{ffa0}',
    '\u{fff0}'..='\u{fff8}',
    '\u{1bca0}'..='\u{1bca3}',
    '\u{1d173}'..='\u{1d17a}',
    '\u{e0000}'..='\u{e0fff}',
];

/// Whether a text may be shown as it is.
pub fn is_printable(text: &str) -> bool {
    text.chars().all(is_harmless)
}

/// A text with everything that is not harmless as an escape: `\u{1b}`.
pub fn printable(text: &str) -> Cow<'_, str> {
    escaped(text, |shown, c| shown.extend(c.escape_unicode()))
}

/// A text of JSON that says the same, with everything that is not harmless as an escape of JSON: `\u001b`. It must be
/// on one line; outside of its strings nothing stands that has to be escaped.
pub fn printable_json(json: &str) -> Cow<'_, str> {
    escaped(json, |shown, c| {
        for unit in c.encode_utf16(&mut [0; 2]) {
            // A text takes everything.
            let _ = write!(shown, "\\u{unit:04x}");
        }
    })
}

fn escaped(text: &str, escape: impl Fn(&mut String, char)) -> Cow<'_, str> {
    if is_printable(text) {
        return Cow::Borrowed(text);
    }
    let mut shown = String::with_capacity(text.len() + 16);
    for c in text.chars() {
        if is_harmless(c) { shown.push(c) } else { escape(&mut shown, c) }
    }
    Cow::Owned(shown)
}

fn is_harmless(c: char) -> bool {
    // Ends of lines and of paragraphs, which are no control characters.
    let ends_line = matches!(c, '\u{2028}' | '\u{2029}');
    !c.is_control() && !ends_line && !IGNORABLE.iter().any(|range| range.contains(&c))
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
            ("sn\u{ad}ow", "sn\\u{ad}ow"),
            ("\u{e0041}", "\\u{e0041}"),
        ] {
            assert!(!is_printable(bad));
            assert_eq!(printable(bad), shown);
        }
    }

    #[test]
    fn the_table_is_that_of_unicode() {
        // DerivedCoreProperties.txt counts them.
        let all = ('\0'..=char::MAX).filter(|c| IGNORABLE.iter().any(|range| range.contains(c)));
        assert_eq!(all.count(), 4174);
        assert!(IGNORABLE.is_sorted_by(|one, next| one.end() < next.start()));
    }

    #[test]
    fn json_says_the_same_when_it_is_escaped() {
        assert_eq!(printable_json("{\"title\":\"布 3\"}"), "{\"title\":\"布 3\"}");
        assert_eq!(printable_json("[\"a\u{202e}b\u{e0041}\u{7f}\"]"), "[\"a\\u202eb\\udb40\\udc41\\u007f\"]");
    }
}

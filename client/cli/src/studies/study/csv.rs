//! Comma-separated values (RFC 4180): rows below the names of their columns, and fields read back.

use std::fmt::{Debug, Write as _};

/// Rows below the names of their columns, each field in quotes where it needs them.
pub(crate) fn text<const N: usize>(columns: [&str; N], rows: impl Iterator<Item = [String; N]>) -> String {
    let mut text = columns.join(",") + "\n";
    for row in rows {
        // Writing into a string does not fail.
        let _ = writeln!(text, "{}", row.map(|field| quoted(&field)).join(","));
    }
    text
}

/// A number with all its digits.
pub(crate) fn number(value: f64) -> String {
    format!("{value:?}")
}

/// A number with all its digits, or nothing where it is not known.
pub(crate) fn known(value: Option<impl Debug>) -> String {
    value.map(|value| format!("{value:?}")).unwrap_or_default()
}

/// A field of comma-separated values, in quotes where it needs them (RFC 4180).
pub(crate) fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// The fields of a row of comma-separated values, as they were before they were quoted.
pub(crate) fn fields(row: &str) -> Vec<String> {
    let (mut fields, mut field, mut is_quoted) = (Vec::new(), String::new(), false);
    let mut letters = row.chars().peekable();
    while let Some(letter) = letters.next() {
        match letter {
            '"' if is_quoted && letters.next_if_eq(&'"').is_some() => field.push('"'),
            '"' => is_quoted = !is_quoted,
            ',' if !is_quoted => fields.push(std::mem::take(&mut field)),
            letter => field.push(letter),
        }
    }
    fields.push(field);
    fields
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_would_end_a_field_is_quoted_and_read_back() {
        assert_eq!(quoted("plain"), "plain");
        assert_eq!(quoted("a, \"b\""), "\"a, \"\"b\"\"\"");
        for row in [&["plain", "", "a, \"b\"", "[1,2]"][..], &["\"", "\"\"", ","], &[""]] {
            let text: Vec<String> = row.iter().map(|field| quoted(field)).collect();
            assert_eq!(fields(&text.join(",")), row);
        }
    }
}

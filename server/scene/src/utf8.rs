//! The text of a scene file from its bytes: UTF-8, or what it is instead and where.

use crate::error::{ErrorKind, SceneError};

/// The text of a file; `file` is its name in messages. A byte order mark at its beginning stays.
///
/// # Errors
/// Bytes that are UTF-16 or no UTF-8, with line and column of the first that tells.
pub(crate) fn utf8(bytes: &[u8], file: &str) -> Result<String, SceneError> {
    let refused = |at: usize, what: &str| {
        // All before is UTF-8.
        let before = String::from_utf8_lossy(&bytes[..at]);
        let column =
            before.rsplit('\n').next().map_or(0, |line| line.trim_start_matches('\u{feff}').chars().count());
        let message = format!("{what}: save the file as UTF-8");
        let error = SceneError::new(ErrorKind::Syntax, file, message);
        Err(error.at_line(before.matches('\n').count() + 1).at_column(column + 1))
    };

    if bytes.starts_with(&[0xfe, 0xff]) || bytes.starts_with(&[0xff, 0xfe]) {
        return refused(0, "is UTF-16");
    }
    let valid = match std::str::from_utf8(bytes) {
        Ok(text) => text.len(),
        Err(error) => error.valid_up_to(),
    };
    if let Some(zero) = bytes[..valid].iter().position(|byte| *byte == 0) {
        return refused(zero, "holds a byte that is zero, as UTF-16 does");
    }
    match bytes.get(valid) {
        Some(byte) => refused(valid, &format!("is not UTF-8 from the byte {byte:#04x} on")),
        None => Ok(String::from_utf8_lossy(bytes).into_owned()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refusal(bytes: &[u8]) -> String {
        utf8(bytes, "a.toml").expect_err("no UTF-8").to_string()
    }

    #[test]
    fn text_in_utf_8_is_read_whole() {
        for text in ["", "title = \"é\"\n", "\u{feff}dt = 1"] {
            assert_eq!(utf8(text.as_bytes(), "a.toml").as_deref(), Ok(text));
        }
    }

    #[test]
    fn text_in_utf_16_is_refused_by_name() {
        let big = "dt = 1\n".encode_utf16().flat_map(u16::to_be_bytes).collect::<Vec<_>>();
        let little = "dt = 1\n".encode_utf16().flat_map(u16::to_le_bytes).collect::<Vec<_>>();
        for bytes in [[&[0xfe, 0xff][..], &big[..]].concat(), [&[0xff, 0xfe][..], &little[..]].concat()] {
            assert_eq!(refusal(&bytes), "a.toml:1:1: is UTF-16: save the file as UTF-8");
        }
        let told = |column: usize| {
            format!("a.toml:1:{column}: holds a byte that is zero, as UTF-16 does: save the file as UTF-8")
        };
        assert_eq!((refusal(&big), refusal(&little)), (told(1), told(2)));
    }

    #[test]
    fn a_byte_that_is_not_utf_8_is_named_with_its_line_and_column() {
        assert_eq!(
            refusal(b"dt = 1\ntitle = \"the\xe9\"\n"),
            "a.toml:2:13: is not UTF-8 from the byte 0xe9 on: save the file as UTF-8"
        );
        let second = "# \u{e9}\n".as_bytes();
        assert!(refusal(&[second, b"# \xc3\xa9 \xff"].concat()).starts_with("a.toml:2:5: "));
        assert!(refusal(b"\xef\xbb\xbf# \xff").starts_with("a.toml:1:3: "), "the mark takes no column");
    }
}

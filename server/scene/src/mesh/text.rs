//! Mesh files as text: byte order marks, other encodings than UTF-8, pointers in place of files.

use std::borrow::Cow;

use crate::error::{ErrorKind, SceneError};

/// How a pointer of Git LFS begins, which stands in a clone in place of a file that was not fetched.
const LFS_POINTER: &[u8] = b"version https://git-lfs.github.com/spec/";
/// How a pointer of git-annex begins, from the folder of the repository on.
const ANNEX_POINTER: &[u8] = b"/annex/objects/";

/// A file without the byte order mark of UTF-8, where it has one.
pub(super) fn without_mark(bytes: &[u8]) -> &[u8] {
    bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes)
}

/// A file as text. Bytes that are not UTF-8 become U+FFFD: comments and names may be in any encoding of bytes, and
/// numbers are ASCII.
///
/// # Errors
/// UTF-16, which has two bytes for each character, and a pointer of a large-file store.
pub(crate) fn text<'a>(bytes: &'a [u8], file: &str) -> Result<Cow<'a, str>, SceneError> {
    // Without a mark, one byte of an ASCII character is 0.
    if matches!(bytes, [0xff, 0xfe, ..] | [0xfe, 0xff, ..] | [0, 1..=255, ..] | [1..=255, 0, ..]) {
        let message = "is text in UTF-16; allowed: UTF-8, of which ASCII is a part. Save it as UTF-8";
        return Err(SceneError::new(ErrorKind::Unsupported, file, message).at_line(1));
    }
    refuse_pointer(bytes, file)?;
    Ok(String::from_utf8_lossy(without_mark(bytes)))
}

/// Refuses a file that only says where a large-file store has the real one.
///
/// # Errors
/// If it does.
pub(super) fn refuse_pointer(bytes: &[u8], file: &str) -> Result<(), SceneError> {
    let bytes = without_mark(bytes);
    let (store, command) = if bytes.starts_with(LFS_POINTER) {
        ("Git LFS", "git lfs pull")
    } else if is_of_annex(bytes) {
        ("git-annex", "git annex get")
    } else {
        return Ok(());
    };
    let message = format!(
        "is a pointer of a large-file store ({store}), which holds the file itself; allowed: that file, which `{command}` fetches"
    );
    Err(SceneError::new(ErrorKind::Unsupported, file, message))
}

/// Whether it is a pointer of git-annex, or a link of it that a file system without links has as a text: `../.git/annex/objects/...`.
fn is_of_annex(bytes: &[u8]) -> bool {
    let mut rest = bytes;
    while let Some(inner) = rest.strip_prefix(b"../") {
        rest = inner;
    }
    rest.strip_prefix(b".git").unwrap_or(rest).starts_with(ANNEX_POINTER)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mark_of_utf_8_is_no_part_of_the_text_and_latin_1_stays_readable() {
        let cases: [(&[u8], &str); 5] = [
            (b"\xef\xbb\xbfv 0 0 0\n", "v 0 0 0\n"),
            (b"v 0 0 0\n", "v 0 0 0\n"),
            (b"\xef\xbb\xbf", ""),
            (b"", ""),
            (b"o \xe9\nv 0 0 0", "o \u{fffd}\nv 0 0 0"),
        ];
        for (bytes, wanted) in cases {
            assert_eq!(text(bytes, "a.obj").expect("it is text"), wanted);
        }
    }

    #[test]
    fn a_pointer_of_a_large_file_store_is_refused_as_such_with_a_mark_and_without_one() {
        let lfs = "version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
        let annex = "/annex/objects/SHA256E-s12345--4d7a214614ab2935.obj\n";
        let link = "../../.git/annex/objects/zk/8J/SHA256E-s12345--4d7a.obj/SHA256E-s12345--4d7a.obj";
        for (pointer, store, command) in [
            (lfs, "Git LFS", "git lfs pull"),
            (annex, "git-annex", "git annex get"),
            (link, "git-annex", "git annex get"),
        ] {
            for bytes in [pointer.to_owned(), format!("\u{feff}{pointer}")] {
                let error = text(bytes.as_bytes(), "a.obj").expect_err("no mesh").to_string();
                assert_eq!(
                    error,
                    format!(
                        "a.obj: is a pointer of a large-file store ({store}), which holds the file itself; allowed: that file, \
                         which `{command}` fetches"
                    )
                );
            }
        }
        // What merely names the store is a text like any other.
        for bytes in [
            &b"# version https://git-lfs.github.com/spec/v1\nv 0 0 0\n"[..],
            b"version 1\n",
            b"# /annex/objects/\nv 0 0 0\n",
        ] {
            assert!(text(bytes, "a.obj").is_ok());
        }
    }

    #[test]
    fn utf_16_is_refused_by_name_with_a_mark_and_without_one() {
        for bytes in [&b"\xff\xfev\0 \0"[..], b"\xfe\xff\0v\0 ", b"v\0 \0", b"\0v\0 "] {
            let error = text(bytes, "a.obj").expect_err("two bytes for each character").to_string();
            assert_eq!(
                error,
                "a.obj:1: is text in UTF-16; allowed: UTF-8, of which ASCII is a part. Save it as UTF-8"
            );
        }
    }
}

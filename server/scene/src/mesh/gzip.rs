//! Files that gzip has packed: known by their first bytes, and unpacked within a limit.

use std::io::Read as _;

use flate2::read::MultiGzDecoder;

use crate::error::{ErrorKind, SceneError};

/// Whether gzip has packed a file.
pub(super) fn is_packed(bytes: &[u8]) -> bool {
    bytes.starts_with(&[0x1f, 0x8b])
}

/// A file as it was before gzip packed it, at most `max_bytes` bytes; one that was not packed stays as it is.
///
/// # Errors
/// A file that gzip cannot have written, or one that becomes larger.
pub(crate) fn unpacked(bytes: Vec<u8>, max_bytes: u64, file: &str) -> Result<Vec<u8>, SceneError> {
    if !is_packed(&bytes) {
        return Ok(bytes);
    }
    let mut out = Vec::new();
    let mut decoder = MultiGzDecoder::new(bytes.as_slice()).take(max_bytes.saturating_add(1));
    decoder.read_to_end(&mut out).map_err(|error| {
        let message = format!(
            "is packed by gzip and cannot be unpacked ({error}): it may be cut, which `gzip -t` tells; allowed: a whole file"
        );
        SceneError::new(ErrorKind::Syntax, file, message)
    })?;
    if out.len() as u64 > max_bytes {
        let message =
            format!("has more than {max_bytes} bytes once gzip has unpacked it; allowed: at most so many");
        return Err(SceneError::new(ErrorKind::TooLarge, file, message));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use flate2::{Compression, write::GzEncoder};

    use super::*;

    fn packed(bytes: &[u8]) -> Vec<u8> {
        let mut encoder = GzEncoder::new(Vec::new(), Compression::default());
        encoder.write_all(bytes).expect("memory takes it");
        encoder.finish().expect("memory takes it")
    }

    #[test]
    fn a_file_is_what_it_was_before_it_was_packed_also_in_several_parts() {
        let text = b"v 0 0 0\n".repeat(1000);
        let parts = [packed(&text), packed(b"v 1 1 1\n")].concat();
        let whole = [text.as_slice(), b"v 1 1 1\n"].concat();
        assert_eq!(unpacked(parts, 1 << 20, "a"), Ok(whole.clone()));
        assert_eq!(unpacked(whole.clone(), 1, "a"), Ok(whole), "it was not packed");
    }

    #[test]
    fn a_small_file_does_not_become_larger_than_the_limit() {
        let bomb = packed(&vec![0; 1 << 20]);
        assert!(bomb.len() < 1 << 12, "{}", bomb.len());
        assert!(unpacked(bomb.clone(), 1 << 20, "a").is_ok());
        let error = unpacked(bomb, (1 << 20) - 1, "a").expect_err("a byte too many");
        assert_eq!(error.kind, ErrorKind::TooLarge);
        assert!(error.to_string().contains("1048575"), "{error}");
    }

    #[test]
    fn no_file_that_was_cut_is_taken_for_a_whole_one() {
        let whole = packed(b"OFF\n1 0 0\n0 0 0\n");
        for length in 2..whole.len() {
            let error = unpacked(whole[..length].to_vec(), 1 << 20, "a").expect_err("it was cut");
            assert!(error.to_string().contains("gzip -t"), "{length}: {error}");
        }
    }
}

//! Lines of a pipe, each as far as 64 kB: one without an end takes no more memory than that.

use std::io;

use tokio::io::{AsyncBufReadExt as _, AsyncRead, BufReader};

/// Most bytes of a line that are kept. What follows them until its end is read, so that nobody waits to write it, and left
/// out.
const LINE_BYTES: usize = 64 << 10;

/// Lines of a pipe, as they come.
#[derive(Debug)]
pub(super) struct Lines<P> {
    pipe: BufReader<P>,
    /// What has come of the next one.
    line: Vec<u8>,
}

impl<P: AsyncRead + Unpin> Lines<P> {
    pub(super) fn of(pipe: P) -> Self {
        Self { pipe: BufReader::new(pipe), line: Vec::new() }
    }

    /// The next line; none at the end. If the wait for it is given up, the next wait goes on where it was.
    ///
    /// # Errors
    /// When the pipe cannot be read.
    pub(super) async fn next(&mut self) -> io::Result<Option<String>> {
        loop {
            let bytes = self.pipe.fill_buf().await?;
            let is_over = bytes.is_empty();
            let end = bytes.iter().position(|byte| *byte == b'\n');
            let of_line = &bytes[..end.unwrap_or(bytes.len())];
            let room = LINE_BYTES.saturating_sub(self.line.len());
            self.line.extend_from_slice(&of_line[..of_line.len().min(room)]);
            let read = end.map_or(bytes.len(), |end| end + 1);
            self.pipe.consume(read);

            if end.is_some() || (is_over && !self.line.is_empty()) {
                let line = std::mem::take(&mut self.line);
                return Ok(Some(String::from_utf8_lossy(&line).into_owned()));
            }
            if is_over {
                return Ok(None);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[tokio::test]
    async fn lines_come_one_after_the_other_and_none_has_more_than_64_kb() {
        let text = format!("first\n\n{}\nthird\nlast", "x".repeat(1_000_000));
        let mut lines = Lines::of(text.as_bytes());
        let mut lengths = Vec::new();
        while let Some(line) = lines.next().await.expect("it can be read") {
            assert!(lines.line.is_empty() && line.len() <= LINE_BYTES);
            lengths.push(line.len());
        }
        assert_eq!(lengths, [5, 0, LINE_BYTES, 5, 4]);

        let endless = "y".repeat(10 * LINE_BYTES);
        let mut lines = Lines::of(endless.as_bytes());
        assert_eq!(lines.next().await.expect("it can be read").map(|line| line.len()), Some(LINE_BYTES));
        assert_eq!(lines.next().await.expect("it can be read"), None);
    }
}

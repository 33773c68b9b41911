//! What standard input tells: the token in its first line, and its end; and the signals that end the program.

use std::io::{self, BufRead as _, BufReader, Read};

use nappe_client::{Exit, Token};
use tokio::sync::oneshot;

use crate::{arguments::Arguments, tell::Failure};

/// Longest first line that is read (bytes); no token is as long.
const LINE_LIMIT: u64 = 4096;

/// Standard input, read by a thread of its own as far as it is asked for.
pub(crate) struct Input {
    /// The first line, if a token was asked for.
    line: Option<oneshot::Receiver<io::Result<String>>>,
    /// The end, if it counts.
    closed: Option<oneshot::Receiver<()>>,
}

impl Input {
    /// Begins to read: a token in the first line, the end, both or neither.
    ///
    /// # Errors
    /// When the system starts no thread.
    pub(crate) fn read(arguments: &Arguments) -> Result<Self, Failure> {
        let (has_token, ends) = (arguments.reads_token(), arguments.until_stdin_closes);
        let (told, line) = oneshot::channel();
        let (ended, closed) = oneshot::channel();
        if has_token || ends {
            let reader = std::thread::Builder::new().spawn(move || {
                let mut input = BufReader::new(io::stdin());
                if has_token {
                    // Nobody listens only when the program ends.
                    let _ = told.send(first_line(&mut input));
                }
                if ends {
                    // Whatever else comes, the end of it is what counts.
                    let _ = io::copy(&mut input, &mut io::sink());
                    let _ = ended.send(());
                }
            });
            reader.map_err(|error| {
                Failure::new(format!("the system starts no thread that reads standard input: {error}"))
            })?;
        }
        Ok(Self { line: has_token.then_some(line), closed: ends.then_some(closed) })
    }

    /// The token in the first line.
    pub(crate) async fn token(&mut self) -> Result<Token, Failure> {
        let line = match self.line.take() {
            Some(line) => line.await.map_err(Failure::new)?,
            None => Err(io::Error::other("it is not read")),
        };
        let token = line.and_then(|line| Token::parse(line.trim_end()));
        token
            .map_err(|error| Failure::usage(format!("no token in the first line of standard input: {error}")))
    }

    /// Completes when the input is closed, if that ends the program, or on Ctrl-C or SIGTERM: a recording is then
    /// closed properly. A second signal ends the program at once.
    pub(crate) async fn end(self) {
        let closed = async {
            match self.closed {
                Some(closed) => drop(closed.await),
                None => std::future::pending().await,
            }
        };
        tokio::select! {
            () = closed => {}
            () = interrupted() => {}
        }
    }
}

/// The first line, as far as a token can go.
fn first_line(input: &mut impl io::BufRead) -> io::Result<String> {
    let mut line = String::new();
    input.by_ref().take(LINE_LIMIT).read_line(&mut line)?;
    Ok(line)
}

/// Has a write beyond the limit on the size of files fail from now on, as one onto a full disk does: SIGXFSZ would end the
/// program without a word. To be called in a runtime.
///
/// # Errors
/// If the system does not let the program catch it.
#[cfg(unix)]
pub(crate) fn outlive_file_limits() -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    /// The number of SIGXFSZ on Linux, macOS and the BSDs.
    const FILE_SIZE: i32 = 25;
    signal(SignalKind::from_raw(FILE_SIZE)).map(drop)
}

/// Does nothing: such a write fails by itself on this system.
#[cfg(not(unix))]
pub(crate) fn outlive_file_limits() -> io::Result<()> {
    Ok(())
}

/// Completes on Ctrl-C or SIGTERM. A second signal ends the program at once.
async fn interrupted() {
    if signal().await.is_err() {
        // No signal can be had on this system: the session's end stops the program.
        std::future::pending::<()>().await;
    }
    tokio::spawn(async {
        if signal().await.is_ok() {
            std::process::exit(Exit::Interrupted as i32);
        }
    });
}

/// Waits for a signal that asks the program to end.
#[cfg(unix)]
async fn signal() -> io::Result<()> {
    use tokio::signal::unix::{SignalKind, signal};
    let mut interrupt = signal(SignalKind::interrupt())?;
    let mut terminate = signal(SignalKind::terminate())?;
    tokio::select! {
        _ = interrupt.recv() => Ok(()),
        _ = terminate.recv() => Ok(()),
    }
}

/// Waits for a signal that asks the program to end.
#[cfg(not(unix))]
async fn signal() -> io::Result<()> {
    tokio::signal::ctrl_c().await
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_first_line_is_read_as_far_as_a_token_can_go() {
        let read = |text: &[u8]| first_line(&mut { text });
        assert_eq!(read(b"secret\nmore").expect("a line"), "secret\n");
        assert_eq!(read(&[b'x'; 10_000]).expect("a line").len(), 4096);
        assert_eq!(read(b"").expect("nothing"), "");
    }
}

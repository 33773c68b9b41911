//! A socket whose time limits hold through signals and through stops of this process.
//!
//! The system ends a call that has a time limit when a signal comes, and when a process goes on that was stopped (Ctrl-Z, a
//! debugger). So calls are short here, and one that ended with nothing is made again until the limit is over. None uses up
//! more of the limit than a short call may take: a stop does not, and what came during it is read.

use std::{
    io::{self, ErrorKind, Read, Write},
    net::{Shutdown, TcpStream},
    sync::Arc,
    time::{Duration, Instant},
};

/// How long a call waits.
const CALL: Duration = Duration::from_millis(25);
/// How much of the limit a call uses up at most: it may end late on a busy machine.
const MOST: Duration = Duration::from_millis(50);

/// A socket, and how long each read and each write of it may take.
#[derive(Clone, Debug)]
pub(crate) struct Timed {
    stream: Arc<TcpStream>,
    pub(crate) limit: Duration,
}

impl Timed {
    /// A socket with a limit; it waits from now on, if it did not before.
    ///
    /// # Errors
    /// When the system cannot set it so.
    pub(crate) fn new(stream: TcpStream, limit: Duration) -> io::Result<Self> {
        stream.set_nonblocking(false)?;
        stream.set_read_timeout(Some(CALL))?;
        stream.set_write_timeout(Some(CALL))?;
        Ok(Self { stream: Arc::new(stream), limit })
    }

    /// Closes it: who reads or writes waits no longer.
    pub(crate) fn close(&self) {
        // It may be closed already.
        let _ = self.stream.shutdown(Shutdown::Both);
    }
}

impl Read for &Timed {
    fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
        within(self.limit, || (&*self.stream).read(bytes))
    }
}

impl Write for &Timed {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        within(self.limit, || (&*self.stream).write(bytes))
    }

    fn flush(&mut self) -> io::Result<()> {
        (&*self.stream).flush()
    }
}

/// Makes a call again as long as it ends with nothing and the limit is not over.
fn within<T>(limit: Duration, mut call: impl FnMut() -> io::Result<T>) -> io::Result<T> {
    let mut waited = Duration::ZERO;
    loop {
        let begin = Instant::now();
        match call() {
            Err(error) if matches!(error.kind(), ErrorKind::Interrupted | ErrorKind::WouldBlock) => {
                if waited >= limit {
                    return Err(ErrorKind::TimedOut.into());
                }
                waited += begin.elapsed().min(MOST);
            }
            done => return done,
        }
    }
}

#[cfg(test)]
mod tests {
    use std::{net::TcpListener, thread};

    use super::*;

    #[test]
    fn what_signals_interrupt_is_tried_again_and_the_limit_stays() {
        let mut calls = 0;
        let done = within(Duration::from_mins(1), || {
            calls += 1;
            if calls < 1000 { Err(ErrorKind::Interrupted.into()) } else { Ok(calls) }
        });
        assert_eq!(done.expect("the limit is long"), 1000);

        let begin = Instant::now();
        let late = within::<()>(2 * MOST, || {
            thread::sleep(Duration::from_millis(1));
            Err(ErrorKind::Interrupted.into())
        });
        assert_eq!(late.expect_err("signals come without end").kind(), ErrorKind::TimedOut);
        assert!(begin.elapsed() >= 2 * MOST);
    }

    #[test]
    fn a_stop_that_is_longer_than_the_limit_does_not_use_it_up() {
        for kind in [ErrorKind::Interrupted, ErrorKind::WouldBlock] {
            let mut calls = 0;
            let done = within(MOST, || {
                calls += 1;
                if calls > 1 {
                    return Ok(calls);
                }
                thread::sleep(3 * MOST);
                Err(kind.into())
            });
            assert_eq!(done.expect("it comes after the stop"), 2);
        }
    }

    #[test]
    fn who_says_nothing_and_reads_nothing_is_waited_for_as_long_as_the_limit_says() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let _other = TcpStream::connect(listener.local_addr().expect("an address")).expect("it listens");
        let (stream, _) = listener.accept().expect("somebody connects");
        let timed = Timed::new(stream, 2 * MOST).expect("it takes limits");
        let begin = Instant::now();
        let late = (&timed).read(&mut [0; 8]).expect_err("nothing is said");
        assert_eq!(late.kind(), ErrorKind::TimedOut);
        assert!(begin.elapsed() >= 2 * MOST);
        // More than the system keeps for who does not read.
        let late = (&timed).write_all(&vec![0; 64 << 20]).expect_err("nobody reads");
        assert_eq!(late.kind(), ErrorKind::TimedOut);
    }
}

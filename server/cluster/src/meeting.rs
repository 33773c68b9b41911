//! Who connects to a server while ranks start: all are met side by side, until rank 0 is among them.
//!
//! A stranger costs a few bytes and five seconds at most: the token comes first, and only who has shown it may say more.

use std::{
    io::{self, ErrorKind, Read as _},
    net::{TcpListener, TcpStream},
    time::{Duration, Instant},
};

use crate::{
    link::{HEAD_BYTES, Head, LinkError, MOST_BYTES, Receiver},
    message::{Hello, Token, VERSION},
    remote::{Remote, RemoteError},
};

/// How long who connects may take to say who it is.
const GREETING_TIME: Duration = Duration::from_secs(5);
/// Bytes of a greeting with its token, at most.
const GREETING_BYTES: usize = 1 << 16;
/// Connections that may be about to say who they are.
const MOST_ARRIVALS: usize = 64;
/// Bytes of a token.
const TOKEN_BYTES: usize = size_of::<Token>();

/// Those who have connected and have not said yet who they are.
#[derive(Debug)]
pub struct Meeting {
    listener: TcpListener,
    token: Token,
    silence: Duration,
    /// In the order in which they came.
    arrivals: Vec<Arrival>,
}

#[derive(Debug)]
struct Arrival {
    stream: TcpStream,
    begin: Instant,
    heard: Vec<u8>,
}

impl Meeting {
    /// Waits for who shows this token. Ranks may say nothing for `silence` while they work.
    ///
    /// # Errors
    /// When the system does not let the listener be asked without waiting.
    pub fn new(listener: TcpListener, token: Token, silence: Duration) -> io::Result<Self> {
        listener.set_nonblocking(true)?;
        Ok(Self { listener, token, silence, arrivals: Vec::new() })
    }

    /// Looks who has come and what they say, without waiting; the ranks, once rank 0 has said all.
    ///
    /// # Errors
    /// When rank 0 is of another version, or what it says cannot be read; when the system takes no connection.
    pub fn look(&mut self) -> Result<Option<Remote>, RemoteError> {
        self.accept()?;
        let mut index = 0;
        while index < self.arrivals.len() {
            match self.arrivals[index].hear(&self.token) {
                Ok(None) => index += 1,
                Ok(Some(hello)) if hello.version != VERSION => {
                    return Err(RemoteError::Version { found: hello.version });
                }
                Ok(Some(hello)) => {
                    let Arrival { stream, .. } = self.arrivals.remove(index);
                    // The greeting was the first message of its direction.
                    let receiver = Receiver::after_greeting(MOST_BYTES);
                    return Ok(Some(Remote::new(stream, receiver, hello, self.silence)?));
                }
                Err(RemoteError::Stranger) => drop(self.arrivals.remove(index)),
                Err(error) => return Err(error),
            }
        }
        Ok(None)
    }

    /// Takes the connections that wait, a bounded number at a time. Where too many say nothing, the oldest goes.
    fn accept(&mut self) -> Result<(), LinkError> {
        for _ in 0..MOST_ARRIVALS {
            match self.listener.accept() {
                Ok((stream, _)) => {
                    if self.arrivals.len() == MOST_ARRIVALS {
                        let oldest = self.arrivals.iter().position(|arrival| !arrival.is_known());
                        drop(self.arrivals.remove(oldest.unwrap_or(0)));
                    }
                    stream.set_nonblocking(true)?;
                    self.arrivals.push(Arrival { stream, begin: Instant::now(), heard: Vec::new() });
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                Err(error)
                    if matches!(error.kind(), ErrorKind::ConnectionAborted | ErrorKind::Interrupted) => {}
                Err(error) => return Err(error.into()),
            }
        }
        Ok(())
    }
}

impl Arrival {
    /// Hears what has come; the greeting, once it is whole.
    fn hear(&mut self, token: &Token) -> Result<Option<Hello>, RemoteError> {
        loop {
            let due = self.due(token)?;
            if self.heard.len() == due {
                let mut greeting = &self.heard[TOKEN_BYTES..];
                return Ok(Receiver::new(GREETING_BYTES as u64).receive(&mut greeting)?);
            }
            let mut piece = [0; 4096];
            let wanted = piece.len().min(due - self.heard.len());
            // Asked before it is read: what came while this process was stopped is heard all the same.
            let is_late = self.begin.elapsed() >= GREETING_TIME;
            match self.stream.read(&mut piece[..wanted]) {
                Ok(0) => return Err(self.or_stranger(RemoteError::OutOfTurn)),
                Ok(count) => self.heard.extend_from_slice(&piece[..count]),
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(error) if error.kind() != ErrorKind::WouldBlock => {
                    return Err(self.or_stranger(LinkError::from(error).into()));
                }
                Err(_nothing) if !is_late => return Ok(None),
                Err(_nothing) => {
                    return Err(self.or_stranger(RemoteError::Late { seconds: GREETING_TIME.as_secs() }));
                }
            }
        }
    }

    /// How many bytes it is to have said before more can be told.
    fn due(&self, token: &Token) -> Result<usize, RemoteError> {
        let Some((shown, rest)) = self.heard.split_first_chunk::<TOKEN_BYTES>() else {
            return Ok(TOKEN_BYTES);
        };
        if shown != token {
            return Err(RemoteError::Stranger);
        }
        let Some(head) = rest.first_chunk::<HEAD_BYTES>() else {
            return Ok(TOKEN_BYTES + HEAD_BYTES);
        };
        let head = Head::read(head, 0, (GREETING_BYTES - TOKEN_BYTES - HEAD_BYTES) as u64)?;
        Ok(TOKEN_BYTES + HEAD_BYTES + head.length as usize)
    }

    /// Whether it has shown the token: another one is not kept.
    fn is_known(&self) -> bool {
        self.heard.len() >= TOKEN_BYTES
    }

    /// What happened to rank 0; what happens to others is of no interest.
    fn or_stranger(&self, error: RemoteError) -> RemoteError {
        if self.is_known() { error } else { RemoteError::Stranger }
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write as _;

    use super::*;

    const TOKEN: Token = [3; TOKEN_BYTES];

    /// Who has connected, so long ago; and the other end.
    fn arrival(ago: Duration) -> (Arrival, TcpStream) {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let other = TcpStream::connect(listener.local_addr().expect("an address")).expect("it listens");
        let (stream, _) = listener.accept().expect("somebody connects");
        stream.set_nonblocking(true).expect("it is set");
        let begin = Instant::now().checked_sub(ago).expect("the machine runs for longer");
        (Arrival { stream, begin, heard: Vec::new() }, other)
    }

    #[test]
    fn who_does_not_say_all_in_time_is_not_waited_for() {
        let (mut arrival, _other) = self::arrival(GREETING_TIME);
        assert!(matches!(arrival.hear(&TOKEN), Err(RemoteError::Stranger)));

        let (mut arrival, mut other) = self::arrival(Duration::ZERO);
        other.write_all(&TOKEN).expect("it is taken");
        while arrival.heard.len() < TOKEN_BYTES {
            assert!(matches!(arrival.hear(&TOKEN), Ok(None)), "it has time left");
        }
        arrival.begin = Instant::now().checked_sub(GREETING_TIME).expect("the machine runs for longer");
        assert!(matches!(arrival.hear(&TOKEN), Err(RemoteError::Late { seconds: 5 })));
    }

    #[test]
    fn who_says_nothing_makes_room_for_others_before_who_has_shown_the_token() {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let mut meeting = Meeting::new(listener, TOKEN, GREETING_TIME).expect("it can be asked");
        let connect = || TcpStream::connect(address).expect("it listens");
        let mut known = connect();
        known.write_all(&TOKEN).expect("it is taken");
        while !meeting.arrivals.first().is_some_and(Arrival::is_known) {
            assert!(matches!(meeting.look(), Ok(None)), "it has not said all");
        }
        for _ in 0..2 * MOST_ARRIVALS {
            let silent = connect();
            while meeting
                .arrivals
                .iter()
                .all(|arrival| arrival.stream.peer_addr().ok() != silent.local_addr().ok())
            {
                meeting.accept().expect("it accepts");
            }
            assert!(meeting.arrivals.len() <= MOST_ARRIVALS);
        }
        assert!(meeting.arrivals.first().is_some_and(Arrival::is_known));
    }
}

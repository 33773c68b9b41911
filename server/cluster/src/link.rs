//! Messages over a stream, each counted and checked: a head of 32 bytes, then postcard's form of the message.
//!
//! A head is four numbers of eight bytes, the lowest first: bytes of the message, its number among those of its direction,
//! XXH3 of its bytes, and XXH3 of the three before. So a bit that is altered anywhere shows at once.

use std::io::{self, Read, Write};

use serde::{Serialize, de::DeserializeOwned};
use thiserror::Error;
use xxhash_rust::xxh3::xxh3_64;

/// Bytes of a message, at most, where no scene says less: the state of a thousand million particles.
pub(crate) const MOST_BYTES: u64 = 1 << 37;
/// Bytes before each message.
pub(crate) const HEAD_BYTES: usize = 32;
/// Bytes of a head that its last number is the checksum of.
const CHECKED_BYTES: usize = HEAD_BYTES - 8;
/// Bytes that are read at a time, so that a length that is announced takes no memory.
const PIECE_BYTES: u64 = 1 << 20;

/// Why a message does not come through.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The connection failed, or ended.
    #[error("the link to the ranks failed: {0}")]
    Io(#[from] io::Error),
    /// A message of another version, or none at all.
    #[error("a message over the link to the ranks cannot be read: {0}")]
    Form(#[from] postcard::Error),
    /// A length that no message of this scene has.
    #[error("a message of {length} bytes over the link to the ranks: at most {allowed} are allowed")]
    TooLong {
        /// Bytes that its head announces.
        length: u64,
        /// Bytes of a message, at most.
        allowed: u64,
    },
    /// Bytes that are not those that were sent.
    #[error("message {number} over the link to the ranks was altered on its way: its checksum does not fit")]
    Altered {
        /// Its number among those of its direction, from 0.
        number: u64,
    },
    /// A message that is missing, or came twice.
    #[error("message {found} came over the link to the ranks, and {expected} was due")]
    OutOfOrder {
        /// The number of the one that came.
        found: u64,
        /// The number of the one that was due.
        expected: u64,
    },
}

/// What stands before a message.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Head {
    /// Bytes of the message.
    pub(crate) length: u64,
    number: u64,
    checksum: u64,
}

impl Head {
    fn of(number: u64, message: &[u8]) -> Self {
        Self { length: message.len() as u64, number, checksum: xxh3_64(message) }
    }

    fn bytes(self) -> [u8; HEAD_BYTES] {
        let mut bytes = [0; HEAD_BYTES];
        let numbers = [self.length, self.number, self.checksum];
        for (place, number) in bytes.as_chunks_mut::<8>().0.iter_mut().zip(numbers) {
            *place = number.to_le_bytes();
        }
        let checksum = xxh3_64(&bytes[..CHECKED_BYTES]);
        bytes[CHECKED_BYTES..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }

    /// Reads the head of message `expected`, which has at most so many bytes.
    ///
    /// # Errors
    /// When it was altered, is that of another message, or announces more.
    pub(crate) fn read(bytes: &[u8; HEAD_BYTES], expected: u64, allowed: u64) -> Result<Self, LinkError> {
        let number = |index: usize| {
            bytes.as_chunks::<8>().0.get(index).map_or(0, |digits| u64::from_le_bytes(*digits))
        };
        let head = Self { length: number(0), number: number(1), checksum: number(2) };
        if head.bytes() != *bytes {
            return Err(LinkError::Altered { number: expected });
        }
        if head.number != expected {
            return Err(LinkError::OutOfOrder { found: head.number, expected });
        }
        if head.length > allowed {
            return Err(LinkError::TooLong { length: head.length, allowed });
        }
        Ok(head)
    }
}

/// One end of a direction: counts what it sends.
#[derive(Debug, Default)]
pub(crate) struct Sender {
    sent: u64,
}

impl Sender {
    /// Sends a message.
    ///
    /// # Errors
    /// When the stream fails.
    pub(crate) fn send(
        &mut self,
        stream: &mut impl Write,
        message: &impl Serialize,
    ) -> Result<(), LinkError> {
        let bytes = postcard::to_stdvec(message)?;
        stream.write_all(&Head::of(self.sent, &bytes).bytes())?;
        stream.write_all(&bytes)?;
        stream.flush()?;
        self.sent += 1;
        Ok(())
    }
}

/// The other end: counts what it receives, and checks it.
#[derive(Debug)]
pub(crate) struct Receiver {
    received: u64,
    /// Bytes of a message, at most.
    pub(crate) allowed: u64,
}

impl Receiver {
    /// One of messages of at most so many bytes.
    pub(crate) fn new(allowed: u64) -> Self {
        Self { received: 0, allowed }
    }

    /// The same, where the first message was read by somebody else.
    pub(crate) fn after_greeting(allowed: u64) -> Self {
        Self { received: 1, allowed }
    }

    /// Receives a message; none when the stream ends before it.
    ///
    /// # Errors
    /// When the stream fails or ends within the message, or that is not the one that was sent.
    pub(crate) fn receive<T: DeserializeOwned>(
        &mut self,
        stream: &mut impl Read,
    ) -> Result<Option<T>, LinkError> {
        let cut = || io::Error::from(io::ErrorKind::UnexpectedEof);
        // Reads to an end go on where a signal interrupts them, which a single read does not.
        let mut head = Vec::with_capacity(HEAD_BYTES);
        stream.by_ref().take(HEAD_BYTES as u64).read_to_end(&mut head)?;
        if head.is_empty() {
            return Ok(None);
        }
        let head = Head::read(head.first_chunk().ok_or_else(cut)?, self.received, self.allowed)?;
        let mut bytes = Vec::with_capacity(head.length.min(PIECE_BYTES) as usize);
        let found = stream.take(head.length).read_to_end(&mut bytes)? as u64;
        if found < head.length {
            return Err(cut().into());
        }
        if Head::of(self.received, &bytes) != head {
            return Err(LinkError::Altered { number: self.received });
        }
        self.received += 1;
        Ok(Some(postcard::from_bytes(&bytes)?))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn receive<T: DeserializeOwned>(mut stream: &[u8]) -> Result<Option<T>, LinkError> {
        Receiver::new(1000).receive(&mut stream)
    }

    #[test]
    fn messages_come_out_as_they_went_in() {
        let (mut stream, mut sender, mut receiver) = (Vec::new(), Sender::default(), Receiver::new(1000));
        sender.send(&mut stream, &(1.5, "two")).expect("memory does not fail");
        sender.send(&mut stream, &vec![f64::NAN, -0.0]).expect("memory does not fail");
        let mut stream = &stream[..];
        let first: Option<(f64, String)> = receiver.receive(&mut stream).expect("it is whole");
        assert_eq!(first, Some((1.5, "two".to_owned())));
        let second: Vec<f64> = receiver.receive(&mut stream).expect("it is whole").expect("there is one");
        assert_eq!(
            second.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            [f64::NAN, -0.0].map(f64::to_bits)
        );
        assert_eq!(receiver.receive::<()>(&mut stream).expect("an end is no failure"), None);
    }

    /// A stream that takes and gives a byte at a time, and of which a signal interrupts every other call.
    struct Disturbed<S> {
        stream: S,
        is_interrupted: bool,
    }

    impl<S> Disturbed<S> {
        fn of(stream: S) -> Self {
            Self { stream, is_interrupted: false }
        }

        fn call(&mut self) -> io::Result<&mut S> {
            self.is_interrupted = !self.is_interrupted;
            if self.is_interrupted { Err(io::ErrorKind::Interrupted.into()) } else { Ok(&mut self.stream) }
        }
    }

    impl<S: Read> Read for Disturbed<S> {
        fn read(&mut self, bytes: &mut [u8]) -> io::Result<usize> {
            let count = bytes.len().min(1);
            self.call()?.read(&mut bytes[..count])
        }
    }

    impl<S: Write> Write for Disturbed<S> {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            self.call()?.write(&bytes[..bytes.len().min(1)])
        }

        fn flush(&mut self) -> io::Result<()> {
            self.stream.flush()
        }
    }

    #[test]
    fn signals_disturb_neither_who_sends_nor_who_receives() {
        let (mut sent, mut sender) = (Disturbed::of(Vec::new()), Sender::default());
        sender.send(&mut sent, &vec![1.0, 2.0]).expect("memory does not fail");
        sender.send(&mut sent, &3_u8).expect("memory does not fail");
        let (mut stream, mut receiver) = (Disturbed::of(&sent.stream[..]), Receiver::new(1000));
        let first: Option<Vec<f64>> = receiver.receive(&mut stream).expect("it is whole");
        assert_eq!(first, Some(vec![1.0, 2.0]));
        assert_eq!(receiver.receive(&mut stream).expect("it is whole"), Some(3_u8));
        assert_eq!(receiver.receive::<()>(&mut stream).expect("an end is no failure"), None);
    }

    #[test]
    fn one_altered_bit_anywhere_is_noticed() {
        let mut sent = Vec::new();
        Sender::default().send(&mut sent, &vec![1.0, 2.0]).expect("memory does not fail");
        assert_eq!(receive::<Vec<f64>>(&sent).expect("it is whole"), Some(vec![1.0, 2.0]));
        for bit in 0..8 * sent.len() {
            let mut altered = sent.clone();
            altered[bit / 8] ^= 1 << (bit % 8);
            let error = receive::<Vec<f64>>(&altered).expect_err("a bit is another one");
            assert!(matches!(error, LinkError::Altered { number: 0 }), "bit {bit}: {error}");
        }
    }

    #[test]
    fn what_is_cut_too_long_or_out_of_order_is_refused() {
        let (mut stream, mut sender) = (Vec::new(), Sender::default());
        sender.send(&mut stream, &1_u8).expect("memory does not fail");
        for end in [1, HEAD_BYTES - 1, HEAD_BYTES] {
            assert!(matches!(receive::<u8>(&stream[..end]), Err(LinkError::Io(_))), "{end} bytes");
        }
        stream.clear();
        sender.send(&mut stream, &2_u8).expect("memory does not fail");
        let twice = receive::<u8>(&stream);
        assert!(matches!(twice, Err(LinkError::OutOfOrder { found: 1, expected: 0 })), "{twice:?}");
        let long = Head { length: 1 << 37, number: 0, checksum: 0 }.bytes();
        let refused = receive::<Vec<u8>>(&long);
        assert!(
            matches!(refused, Err(LinkError::TooLong { length: 0x20_0000_0000, allowed: 1000 })),
            "{refused:?}"
        );
        let other = {
            let mut stream = Vec::new();
            // The length of a list that is longer than its message.
            Sender::default().send(&mut stream, &200_u8).expect("memory does not fail");
            stream
        };
        assert!(matches!(receive::<Vec<u8>>(&other), Err(LinkError::Form(_))));
    }
}

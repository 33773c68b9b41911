//! Messages over a stream: the length of each in eight bytes, the lowest first, then postcard's form of it.

use std::io::{self, Read, Write};

use serde::{Serialize, de::DeserializeOwned};
use thiserror::Error;

/// Bytes of a message, at most: the state of a thousand million particles is less.
const MOST: u64 = 1 << 37;
/// Bytes that are read at a time, so that a length that is wrong takes no memory.
const PIECE: u64 = 1 << 26;

/// Why a message does not come through.
#[derive(Debug, Error)]
pub enum LinkError {
    /// The connection failed, or ended.
    #[error("the link to the ranks failed: {0}")]
    Io(#[from] io::Error),
    /// A message of another version, or none at all.
    #[error("a message over the link to the ranks cannot be read: {0}")]
    Form(#[from] postcard::Error),
    /// A length that no message has.
    #[error("a message of {0} bytes over the link to the ranks: at most {MOST} are allowed")]
    TooLong(u64),
}

/// Sends a message.
///
/// # Errors
/// When the stream fails.
pub(crate) fn send(stream: &mut impl Write, message: &impl Serialize) -> Result<(), LinkError> {
    let bytes = postcard::to_stdvec(message)?;
    stream.write_all(&(bytes.len() as u64).to_le_bytes())?;
    stream.write_all(&bytes)?;
    stream.flush()?;
    Ok(())
}

/// Receives a message; none when the stream ends before it.
///
/// # Errors
/// When the stream fails or ends within the message, or that is not of this form.
pub(crate) fn receive<T: DeserializeOwned>(stream: &mut impl Read) -> Result<Option<T>, LinkError> {
    let mut length = [0; 8];
    if stream.read(&mut length[..1])? == 0 {
        return Ok(None);
    }
    stream.read_exact(&mut length[1..])?;
    let length = u64::from_le_bytes(length);
    if length > MOST {
        return Err(LinkError::TooLong(length));
    }
    let mut bytes = Vec::with_capacity(length.min(PIECE) as usize);
    let found = stream.take(length).read_to_end(&mut bytes)? as u64;
    if found < length {
        return Err(io::Error::from(io::ErrorKind::UnexpectedEof).into());
    }
    Ok(Some(postcard::from_bytes(&bytes)?))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn messages_come_out_as_they_went_in() {
        let mut stream = Vec::new();
        send(&mut stream, &(1.5, "two")).expect("memory does not fail");
        send(&mut stream, &vec![f64::NAN, -0.0]).expect("memory does not fail");
        let mut stream = &stream[..];
        let first: Option<(f64, String)> = receive(&mut stream).expect("it is whole");
        assert_eq!(first, Some((1.5, "two".to_owned())));
        let second: Vec<f64> = receive(&mut stream).expect("it is whole").expect("there is one");
        assert_eq!(
            second.iter().map(|x| x.to_bits()).collect::<Vec<_>>(),
            [f64::NAN, -0.0].map(f64::to_bits)
        );
        assert_eq!(receive::<()>(&mut stream).expect("an end is no failure"), None);
    }

    #[test]
    fn what_is_no_message_is_refused() {
        let cut = [3, 0, 0, 0, 0, 0, 0, 0, 1];
        assert!(matches!(receive::<Vec<u8>>(&mut &cut[..]), Err(LinkError::Io(_))));
        let long = u64::MAX.to_le_bytes();
        assert!(matches!(receive::<Vec<u8>>(&mut &long[..]), Err(LinkError::TooLong(u64::MAX))));
        let other = [1, 0, 0, 0, 0, 0, 0, 0, 200];
        assert!(matches!(receive::<Vec<u8>>(&mut &other[..]), Err(LinkError::Form(_))));
    }
}

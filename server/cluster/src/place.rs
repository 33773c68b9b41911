//! Where ranks find the server, as they are told in their environment.

use std::fmt;

use crate::message::Token;

/// The variable of the environment that ranks read it from.
pub const LINK: &str = "NAPPE_LINK";

/// The variables that tell Open MPI, version 4 and version 5, in which folder ranks of a host share memory.
pub const SHARED_FOLDER: [&str; 2] =
    ["OMPI_MCA_btl_vader_backing_directory", "OMPI_MCA_btl_sm_backing_directory"];

/// Where ranks find the server, what rank 0 shows there, and how many threads each rank has: HOST:PORT/TOKEN/THREADS.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Link {
    /// Host and port, with a colon between them.
    pub address: String,
    /// What shows that a connection is that of rank 0.
    pub token: Token,
    /// Threads of each rank, 1 or more.
    pub threads: usize,
}

impl Link {
    /// Reads its text.
    ///
    /// # Errors
    /// What is wrong with it, as a sentence.
    pub fn read(text: &str) -> Result<Self, String> {
        let wrong =
            || format!("{LINK} is to be HOST:PORT/TOKEN/THREADS, as a server that starts ranks sets it");
        let [threads, token, address] = text.rsplitn(3, '/').collect::<Vec<_>>()[..] else {
            return Err(wrong());
        };
        let mut bytes = Token::default();
        if token.len() != 2 * bytes.len() {
            return Err(wrong());
        }
        let digit = |byte: u8| char::from(byte).to_digit(16);
        for (byte, digits) in bytes.iter_mut().zip(token.as_bytes().as_chunks::<2>().0) {
            let [high, low] = digits.map(digit);
            *byte = high.zip(low).map(|(high, low)| (16 * high + low) as u8).ok_or_else(wrong)?;
        }
        let threads = threads.parse().ok().filter(|threads| *threads > 0).ok_or_else(wrong)?;
        Ok(Self { address: address.to_owned(), token: bytes, threads })
    }
}

impl fmt::Display for Link {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/", self.address)?;
        self.token.iter().try_for_each(|byte| write!(f, "{byte:02x}"))?;
        write!(f, "/{}", self.threads)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_is_read_as_it_is_written() {
        let mut token = [0xab; 16];
        token[1] = 2;
        let link = Link { address: "[::1]:6000".to_owned(), token, threads: 3 };
        assert_eq!(Link::read(&link.to_string()), Ok(link));
        let token = "ab".repeat(16);
        for wrong in [
            "",
            "host:1",
            "host:1/12/1",
            &format!("h:1/{token}/0"),
            &format!("h:1/{token}"),
            &format!("h:1/zz{}/1", "ab".repeat(15)),
        ] {
            assert!(Link::read(wrong).is_err(), "{wrong}");
        }
    }
}

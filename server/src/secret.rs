//! Secrets that the system draws: tokens, and codes that are traded for them.

use std::io;

use nappe_proto::token::Token;

/// 128 random bits as 32 hexadecimal digits.
///
/// # Errors
/// If the system has no random numbers.
pub(crate) fn draw() -> io::Result<Token> {
    let mut bytes = [0; 16];
    getrandom::fill(&mut bytes).map_err(io::Error::other)?;
    Token::parse(&bytes.map(|byte| format!("{byte:02x}")).concat())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn secrets_are_drawn_anew() {
        let [a, b] = [draw(), draw()].map(|secret| secret.expect("random numbers"));
        assert!(a != b && a.reveal().len() == 32);
    }
}

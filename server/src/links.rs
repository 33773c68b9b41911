//! Links that work once: a code that is traded for the token.
//!
//! Enters: the wish of somebody who has the token, or a code. Leaves: a code, or whether it is good, which it is once.

use std::{
    collections::VecDeque,
    io,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use nappe_proto::token::Token;
use subtle::ConstantTimeEq as _;

use crate::secret;

/// Codes that are good at a time: as many as a class has browsers.
pub(crate) const MOST: usize = 64;

/// The links of a server.
#[derive(Debug)]
pub(crate) struct Links {
    token: Option<Token>,
    /// How long a code is good.
    time: Duration,
    /// The oldest first.
    codes: Mutex<VecDeque<Code>>,
}

#[derive(Debug)]
struct Code {
    text: Token,
    made: Instant,
}

impl Links {
    /// Links to a server that asks for this token, or for none.
    pub(crate) fn new(token: Option<Token>, time: Duration) -> Self {
        Self { token, time, codes: Mutex::default() }
    }

    /// How long a code is good.
    pub(crate) fn time(&self) -> Duration {
        self.time
    }

    /// The token that a good code is traded for; none where the server asks for none.
    pub(crate) fn token(&self) -> Option<&Token> {
        self.token.as_ref()
    }

    /// A new code. The oldest gives way to it where there are as many as may be.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub(crate) fn make(&self, now: Instant) -> io::Result<Token> {
        let text = secret::draw()?;
        let mut codes = self.good(now);
        if codes.len() == MOST {
            codes.pop_front();
        }
        codes.push_back(Code { text: text.clone(), made: now });
        Ok(text)
    }

    /// Whether a code is good, which it no longer is then. The time of the comparison tells nothing of where two codes differ.
    pub(crate) fn open(&self, code: &str, now: Instant) -> bool {
        let mut codes = self.good(now);
        let before = codes.len();
        codes.retain(|known| !bool::from(known.text.reveal().as_bytes().ct_eq(code.as_bytes())));
        codes.len() < before
    }

    /// The codes that are not too old.
    fn good(&self, now: Instant) -> MutexGuard<'_, VecDeque<Code>> {
        // No code that holds the lock can leave it half changed.
        let mut codes = self.codes.lock().unwrap_or_else(PoisonError::into_inner);
        codes.retain(|code| now.saturating_duration_since(code.made) < self.time);
        codes
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const TIME: Duration = Duration::from_mins(10);

    #[test]
    fn a_code_is_good_once_and_for_its_time() {
        let (links, begin) = (Links::new(None, TIME), Instant::now());
        let make = |now| links.make(now).expect("random numbers");
        let [once, late] = [make(begin), make(begin)];
        let almost = begin + TIME.saturating_sub(Duration::from_nanos(1));
        assert!(links.open(once.reveal(), almost) && !links.open(once.reveal(), almost));
        assert!(!links.open(late.reveal(), begin + TIME));

        let good = make(begin + TIME);
        for bad in ["", &good.reveal()[1..], &format!("{}0", good.reveal()), &good.reveal().to_uppercase()] {
            // A code of digits alone has no upper case.
            assert!(bad == good.reveal() || !links.open(bad, begin + TIME), "{bad}");
        }
        assert!(links.open(good.reveal(), begin + TIME));
        assert!(!format!("{links:?}").contains(good.reveal()));
    }

    #[test]
    fn the_oldest_code_gives_way_where_there_are_too_many() {
        let (links, now) = (Links::new(None, TIME), Instant::now());
        let codes: Vec<_> = (0..=MOST).map(|_| links.make(now).expect("random numbers")).collect();
        let opened = codes.iter().filter(|code| links.open(code.reveal(), now)).count();
        assert!(opened == MOST && !links.open(codes[0].reveal(), now));
        assert_eq!(links.good(now).len(), 0, "nothing is left");
    }
}

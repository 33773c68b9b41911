//! Links: a code that is traded for the token, once, or for tokens that are good for one session, a number of times.
//!
//! Enters: the wish of somebody who has the token, or a code. Leaves: a code, or what it is good for.

use std::{
    collections::VecDeque,
    io,
    sync::{Mutex, MutexGuard, PoisonError},
    time::{Duration, Instant},
};

use nappe_proto::token::Token;
use subtle::ConstantTimeEq as _;

use crate::{passes::Grant, secret};

/// Codes that are good at a time: as many as a class has browsers.
pub(crate) const MOST: usize = 64;

/// The links of a server.
#[derive(Debug)]
pub(crate) struct Links {
    token: Option<Token>,
    /// How long a code is good that is traded for the token.
    time: Duration,
    /// The oldest first.
    codes: Mutex<VecDeque<Code>>,
}

#[derive(Debug)]
struct Code {
    text: Token,
    made: Instant,
    /// How long it is good.
    time: Duration,
    /// How often it can still be opened.
    uses_left: u32,
    /// None: it is good for the token of the server.
    grant: Option<Grant>,
}

/// What a code was good for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) enum Opened {
    /// The token of the server.
    Everything,
    /// One session, and copies of it.
    Session(Grant),
}

impl Links {
    /// Links to a server that asks for this token, or for none.
    pub(crate) fn new(token: Option<Token>, time: Duration) -> Self {
        Self { token, time, codes: Mutex::default() }
    }

    /// How long a code is good that is traded for the token.
    pub(crate) fn time(&self) -> Duration {
        self.time
    }

    /// The token that a good code is traded for; none where the server asks for none.
    pub(crate) fn token(&self) -> Option<&Token> {
        self.token.as_ref()
    }

    /// A new code for the token, good once. The oldest gives way to it where there are as many as may be.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub(crate) fn make(&self, now: Instant) -> io::Result<Token> {
        self.add(None, self.time, 1, now)
    }

    /// A new code for a session, which can be opened so often until what it gives ends.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub(crate) fn make_for(&self, grant: Grant, uses: u32, now: Instant) -> io::Result<Token> {
        let time = grant.until.saturating_duration_since(now);
        self.add(Some(grant), time, uses, now)
    }

    fn add(&self, grant: Option<Grant>, time: Duration, uses_left: u32, now: Instant) -> io::Result<Token> {
        let text = secret::draw()?;
        let mut codes = self.good(now);
        if codes.len() == MOST {
            codes.pop_front();
        }
        codes.push_back(Code { text: text.clone(), made: now, time, uses_left, grant });
        Ok(text)
    }

    /// What a code is good for, which it is once less then. The time of the comparison tells nothing of where two codes differ.
    /// `places`: how many tokens of links to one session can be
    /// given; without any no use of such a link is lost.
    pub(crate) fn open(&self, code: &str, now: Instant, places: usize) -> Option<Opened> {
        let mut opened = None;
        self.good(now).retain_mut(|known| {
            if bool::from(known.text.reveal().as_bytes().ct_eq(code.as_bytes())) {
                opened = Some(known.grant.clone().map_or(Opened::Everything, Opened::Session));
                let is_used = places > 0 || known.grant.is_none();
                known.uses_left -= u32::from(is_used);
            }
            known.uses_left > 0
        });
        opened
    }

    /// The codes that are not too old.
    fn good(&self, now: Instant) -> MutexGuard<'_, VecDeque<Code>> {
        // No code that holds the lock can leave it half changed.
        let mut codes = self.codes.lock().unwrap_or_else(PoisonError::into_inner);
        codes.retain(|code| now.saturating_duration_since(code.made) < code.time);
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
        assert_eq!(links.open(once.reveal(), almost, 1), Some(Opened::Everything));
        assert_eq!(links.open(once.reveal(), almost, 1), None);
        assert_eq!(links.open(late.reveal(), begin + TIME, 1), None);

        let good = make(begin + TIME);
        for bad in ["", &good.reveal()[1..], &format!("{}0", good.reveal()), &good.reveal().to_uppercase()] {
            // A code of digits alone has no upper case.
            assert!(bad == good.reveal() || links.open(bad, begin + TIME, 1).is_none(), "{bad}");
        }
        assert!(links.open(good.reveal(), begin + TIME, 1).is_some());
        assert!(!format!("{links:?}").contains(good.reveal()));
    }

    #[test]
    fn the_oldest_code_gives_way_where_there_are_too_many() {
        let (links, now) = (Links::new(None, TIME), Instant::now());
        let codes: Vec<_> = (0..=MOST).map(|_| links.make(now).expect("random numbers")).collect();
        let opened = codes.iter().filter(|code| links.open(code.reveal(), now, 1).is_some()).count();
        assert!(opened == MOST && links.open(codes[0].reveal(), now, 1).is_none());
        assert_eq!(links.good(now).len(), 0, "nothing is left");
    }

    #[test]
    fn a_code_for_a_session_is_good_so_often_and_until_what_it_gives_ends() {
        let (links, now) = (Links::new(None, TIME), Instant::now());
        let grant = Grant { session_uid: "u-1".to_owned(), forks: 1, until: now + 3 * TIME };
        let make = || links.make_for(grant.clone(), 3, now).expect("random numbers");
        let (often, late) = (make(), make());
        for _ in 0..3 {
            assert_eq!(links.open(often.reveal(), now + 2 * TIME, 1), Some(Opened::Session(grant.clone())));
        }
        assert_eq!(links.open(often.reveal(), now + 2 * TIME, 1), None);
        assert_eq!(links.open(late.reveal(), now + 3 * TIME, 1), None);
    }
}

//! Why calls are refused, for whoever runs the server: counted by reason, and told to the log.
//!
//! Enters: a reason, with the caller and the session of the call. Leaves: how often each reason was given since the start, and
//! lines of the log, at most one per second for each reason and address. What comes between two of them is counted, and the
//! next one says how many refusals it stands for.

use std::{
    collections::{BTreeMap, btree_map::Entry},
    mem,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError},
    time::{Duration, Instant},
};

use http::Extensions;

use crate::{caller::Caller, error::Reason};

/// Time between two lines of the same reason and address.
const PAUSE: Duration = Duration::from_secs(1);
/// Reasons and addresses that are told apart within this time: whoever has many addresses takes no more memory.
const MOST_ORIGINS: usize = 1024;
/// Characters that are shown of a session's id, which nobody has checked; 63 are allowed.
const ID_CHARS: usize = 64;

/// A call, as the log tells of it.
#[derive(Clone, Debug, Default)]
pub(crate) struct Call {
    caller: Caller,
    /// The session that its message names, once that was read.
    session: Arc<OnceLock<String>>,
    refusals: Arc<Refusals>,
}

impl Call {
    pub(crate) fn new(caller: Caller, refusals: &Arc<Refusals>) -> Self {
        Self { caller, session: Arc::default(), refusals: Arc::clone(refusals) }
    }

    /// The call of a request.
    pub(crate) fn of(request: &Extensions) -> Self {
        request.get().cloned().unwrap_or_default()
    }

    /// Notes which session it is about, once; an empty id names none.
    pub(crate) fn note_session(&self, id: &str) {
        if !id.is_empty() {
            self.session.get_or_init(|| id.chars().take(ID_CHARS).collect());
        }
    }

    pub(crate) fn caller(&self) -> Caller {
        self.caller
    }

    /// The session that it is about, if that is known.
    pub(crate) fn session(&self) -> Option<&str> {
        self.session.get().map(String::as_str)
    }

    /// Counts that it was refused, or that its stream was cut, and tells the log.
    pub(crate) fn refused(&self, reason: Reason) {
        let line = self.refusals.lock().add(reason, self, Instant::now());
        if let Some(line) = line {
            line.tell();
        }
    }
}

/// The refusals of a server.
#[derive(Debug, Default)]
pub(crate) struct Refusals(Mutex<State>);

impl Refusals {
    /// How often each reason was given since the start.
    pub(crate) fn counts(&self) -> Vec<(Reason, u64)> {
        let state = self.lock();
        let count = |reason: &Reason| (*reason, state.counts.get(reason).copied().unwrap_or_default());
        Reason::ALL.iter().map(count).collect()
    }

    /// Tells the log what was counted until now and is due: to be called about every second.
    pub(crate) fn tell_due(&self, now: Instant) {
        let due = self.lock().due(now);
        for line in due {
            line.tell();
        }
    }

    /// Tells the log all that was counted, at the end.
    pub(crate) fn tell_rest(&self) {
        let recent = mem::take(&mut self.lock().recent);
        for line in recent.into_values().filter_map(|recent| recent.counted) {
            line.tell();
        }
    }

    fn lock(&self) -> MutexGuard<'_, State> {
        // No code that holds the lock can leave it half changed.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

#[derive(Debug, Default)]
struct State {
    /// Refusals by reason, since the start.
    counts: BTreeMap<Reason, u64>,
    /// What the log was told lately.
    recent: BTreeMap<Origin, Recent>,
}

/// What lines of the log are told apart by.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
struct Origin {
    reason: Reason,
    address: Address,
}

/// Where callers are. A connection is soon made anew, so that ports tell nobody apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
enum Address {
    Ip(IpAddr),
    Unix,
    /// Any of those for whom there is no room.
    Other,
}

/// The newest line of an origin, and what came after it.
#[derive(Debug)]
struct Recent {
    told: Instant,
    counted: Option<Line>,
}

/// A line of the log.
#[derive(Clone, Debug, PartialEq, Eq)]
struct Line {
    reason: Reason,
    /// That of the last call for which it stands.
    session: Option<String>,
    /// That of the last call; none where several addresses are counted together.
    caller: Option<Caller>,
    /// Calls for which it stands.
    count: u64,
}

impl State {
    /// Counts a refusal. What is returned is to be told.
    fn add(&mut self, reason: Reason, call: &Call, now: Instant) -> Option<Line> {
        *self.counts.entry(reason).or_default() += 1;
        let mut origin = Origin { reason, address: Address::of(call.caller) };
        if self.recent.len() >= MOST_ORIGINS && !self.recent.contains_key(&origin) {
            origin.address = Address::Other;
        }
        let is_known = origin.address != Address::Other;
        let line = Line {
            reason,
            session: call.session().filter(|_| is_known).map(str::to_owned),
            caller: is_known.then_some(call.caller),
            count: 1,
        };

        match self.recent.entry(origin) {
            Entry::Vacant(first) => {
                first.insert(Recent { told: now, counted: None });
                Some(line)
            }
            Entry::Occupied(mut known) => {
                let recent = known.get_mut();
                let before = recent.counted.take().map_or(0, |counted| counted.count);
                recent.counted = Some(Line { count: before + 1, ..line });
                recent.due(now)
            }
        }
    }

    /// What is to be told now. Origins of which nothing came for a while are forgotten.
    fn due(&mut self, now: Instant) -> Vec<Line> {
        let due = self.recent.values_mut().filter_map(|recent| recent.due(now)).collect();
        self.recent.retain(|_, recent| recent.counted.is_some() || !recent.is_over(now));
        due
    }
}

impl Recent {
    /// Whether there may be another line.
    fn is_over(&self, now: Instant) -> bool {
        now.saturating_duration_since(self.told) >= PAUSE
    }

    fn due(&mut self, now: Instant) -> Option<Line> {
        let is_over = self.is_over(now);
        let line = self.counted.take_if(|_| is_over)?;
        self.told = now;
        Some(line)
    }
}

impl Address {
    fn of(caller: Caller) -> Self {
        match caller {
            Caller::Tcp(address) => Self::Ip(address.ip().to_canonical()),
            Caller::Unix => Self::Unix,
        }
    }
}

impl Line {
    fn tell(&self) {
        let what = match self.reason {
            Reason::WatcherTooSlow | Reason::WatcherStalled => "watcher cut",
            _ => "refused",
        };
        let (reason, session) = (self.reason.name(), self.session.as_deref());
        let caller = self.caller.map_or_else(|| "many".to_owned(), |caller| caller.to_string());
        let count = (self.count > 1).then_some(self.count);
        tracing::info!(reason, session, %caller, count, "{what}");
    }
}

#[cfg(test)]
mod tests {
    use std::net::{Ipv4Addr, SocketAddr};

    use super::*;

    const MILLISECOND: Duration = Duration::from_millis(1);

    fn call(address: u32, port: u16, session: &str) -> Call {
        let caller = Caller::Tcp(SocketAddr::from((Ipv4Addr::from(address), port)));
        let call = Call::new(caller, &Arc::default());
        call.note_session(session);
        call
    }

    fn line(reason: Reason, call: &Call, count: u64) -> Line {
        let session = call.session().map(str::to_owned);
        Line { reason, session, caller: Some(call.caller), count }
    }

    #[test]
    fn a_reason_and_an_address_have_a_line_a_second_with_the_last_session_and_caller() {
        let (mut state, start) = (State::default(), Instant::now());
        let (missing, token) = (Reason::SessionNotFound, Reason::TokenWrong);
        let [first, second, third] = [(1, 10, "a"), (1, 11, "b"), (2, 10, "")].map(|(a, p, s)| call(a, p, s));
        assert_eq!(state.add(missing, &first, start), Some(line(missing, &first, 1)));
        assert_eq!(state.add(missing, &first, start), None);
        assert_eq!(state.add(missing, &second, start), None, "another port of the same address");
        assert_eq!(state.add(missing, &third, start), Some(line(missing, &third, 1)));
        assert_eq!(state.add(token, &first, start), Some(line(token, &first, 1)));

        assert!(state.due(start + PAUSE / 2).is_empty());
        assert_eq!(state.due(start + PAUSE), [line(missing, &second, 2)]);
        assert_eq!(state.recent.len(), 1, "the others are forgotten");

        // That line is the one of the second that begins with it.
        assert_eq!(state.add(missing, &first, start + PAUSE + MILLISECOND), None);
        assert_eq!(state.add(missing, &second, start + 2 * PAUSE), Some(line(missing, &second, 2)));
        assert!(state.due(start + 3 * PAUSE).is_empty() && state.recent.is_empty());
        assert_eq!(state.counts, BTreeMap::from([(missing, 6), (token, 1)]));
    }

    #[test]
    fn addresses_beyond_those_for_which_there_is_room_are_counted_together() {
        let (mut state, start) = (State::default(), Instant::now());
        let told =
            (0..5000).filter_map(|address| state.add(Reason::TokenWrong, &call(address, 1, "a"), start));
        let told: Vec<Line> = told.collect();
        assert_eq!((told.len(), state.recent.len()), (MOST_ORIGINS + 1, MOST_ORIGINS + 1));
        let of_many = |count| Line { reason: Reason::TokenWrong, session: None, caller: None, count };
        assert_eq!(told.last(), Some(&of_many(1)));
        assert_eq!(state.due(start + PAUSE), [of_many(5000 - MOST_ORIGINS as u64 - 1)]);
    }

    #[test]
    fn every_reason_has_a_count_and_an_id_is_cut() {
        let refusals = Arc::new(Refusals::default());
        let call = Call::new(Caller::Unix, &refusals);
        for id in ["", &"x".repeat(1000), "later"] {
            call.note_session(id);
        }
        assert_eq!(call.session().map(str::len), Some(ID_CHARS));
        call.refused(Reason::InvalidField);
        call.clone().refused(Reason::InvalidField);
        let counts = refusals.counts();
        assert_eq!(counts.len(), Reason::ALL.len());
        assert!(
            counts.iter().all(|(reason, count)| *count == 2 * u64::from(*reason == Reason::InvalidField))
        );

        refusals.tell_rest();
        assert!(refusals.lock().recent.is_empty());
    }
}

//! Memory that clients make the server hold, counted against a limit before it is taken.
//!
//! Enters: a limit (bytes), then claims. Leaves: a claim, which gives its bytes back when it is dropped, or how
//! much is left.

use std::sync::{
    Arc,
    atomic::{AtomicU64, Ordering},
};

use crate::error::{Reason, ServiceError};

/// What a claim may hold and still count as small (bytes).
const SMALL_BYTES: u64 = 64 << 10;
/// Small claims alone may take the last part in so many of an account that keeps room for them.
const SMALL_SHARE: u64 = 8;

/// An account of bytes: how many are in use, and how many may be.
#[derive(Debug)]
pub(crate) struct MemoryAccount {
    /// Bytes at most.
    limit: u64,
    /// Bytes that small claims alone may take.
    kept_for_small: u64,
    used: AtomicU64,
    /// The account of which this is a part.
    whole: Option<Arc<Self>>,
    /// The reason of an error when it is full.
    reason: Reason,
    /// What it counts, in messages.
    noun: &'static str,
    /// The option that raises the limit.
    option: &'static str,
}

impl MemoryAccount {
    /// All that clients make the server hold.
    pub(crate) fn of_server(limit: u64) -> Arc<Self> {
        Arc::new(Self {
            limit,
            kept_for_small: 0,
            used: AtomicU64::new(0),
            whole: None,
            reason: Reason::ServerMemoryFull,
            noun: "sessions, meshes and requests",
            option: "--max-server-bytes",
        })
    }

    /// The requests in progress, a part of `whole`: large ones leave room for small ones.
    pub(crate) fn of_requests(limit: u64, whole: &Arc<Self>) -> Arc<Self> {
        Arc::new(Self {
            limit,
            kept_for_small: limit / SMALL_SHARE,
            used: AtomicU64::new(0),
            whole: Some(Arc::clone(whole)),
            reason: Reason::RequestMemoryFull,
            noun: "requests in progress",
            option: "--max-request-bytes",
        })
    }

    /// A claim of no bytes yet.
    pub(crate) fn claim(self: &Arc<Self>) -> Claim {
        Claim { account: Arc::clone(self), bytes: AtomicU64::new(0) }
    }

    /// Bytes in use.
    pub(crate) fn used(&self) -> u64 {
        self.used.load(Ordering::Relaxed)
    }

    /// Bytes that may be in use.
    pub(crate) fn limit(&self) -> u64 {
        self.limit
    }

    /// Takes bytes as long as no more than `limit` are in use then.
    fn take(&self, bytes: u64, limit: u64) -> Result<(), ServiceError> {
        let fits = |used: u64| used.checked_add(bytes).filter(|sum| *sum <= limit);
        if let Err(used) = self.used.fetch_update(Ordering::Relaxed, Ordering::Relaxed, fits) {
            return Err(self.full(bytes, limit.saturating_sub(used)));
        }
        let whole = self.whole.as_ref().map_or(Ok(()), |whole| whole.take(bytes, whole.limit));
        whole.inspect_err(|_full| {
            self.used.fetch_sub(bytes, Ordering::Relaxed);
        })
    }

    fn give_back(&self, bytes: u64) {
        self.used.fetch_sub(bytes, Ordering::Relaxed);
        if let Some(whole) = &self.whole {
            whole.give_back(bytes);
        }
    }

    /// Bytes that a claim of more than a small one may hold while there is no other.
    fn most(&self) -> u64 {
        self.limit - self.kept_for_small
    }

    /// The error of a claim that is refused and comes to `bytes` in all. Where these never fit, however little else is in
    /// use, it says by how much they are too many, and what raises the limit.
    fn refused(&self, error: ServiceError, bytes: u64) -> ServiceError {
        let accounts = [Some(self), self.whole.as_deref()];
        let Some(account) = accounts.into_iter().flatten().find(|account| bytes > account.most()) else {
            return error;
        };
        let (most, option) = (account.most(), account.option);
        let over = bytes - most;
        let message = format!(
            "{bytes} bytes are needed at a time, {over} more than the {most} that one may have of those for {}: {option} \
             raises the limit",
            account.noun
        );
        ServiceError { message, ..error }.with("over_bytes", over).with("option", option)
    }

    fn full(&self, needed: u64, left: u64) -> ServiceError {
        let Self { limit, noun, .. } = self;
        let message =
            format!("{needed} bytes are needed, {left} are left for {noun}; allowed: {limit} in all");
        ServiceError::new(self.reason, message)
            .with("needed_bytes", needed)
            .with("left_bytes", left)
            .with("allowed_bytes", limit)
    }
}

/// Bytes of an account that are in use until this is dropped.
#[derive(Debug)]
pub(crate) struct Claim {
    account: Arc<MemoryAccount>,
    bytes: AtomicU64,
}

impl Claim {
    /// Takes more bytes.
    ///
    /// # Errors
    /// If the account has not as many left; nothing is taken then.
    pub(crate) fn grow(&self, bytes: u64) -> Result<(), ServiceError> {
        let account = &self.account;
        let all = self.bytes.load(Ordering::Relaxed).saturating_add(bytes);
        let allowed = if all <= SMALL_BYTES { account.limit } else { account.most() };
        account.take(bytes, allowed).map_err(|full| account.refused(full, all))?;
        self.bytes.fetch_add(bytes, Ordering::Relaxed);
        Ok(())
    }

    /// A claim of no bytes yet on the same account.
    pub(crate) fn another(&self) -> Self {
        self.account.claim()
    }

    /// Takes bytes for a moment, of all that the server holds, beside those of this claim.
    ///
    /// # Errors
    /// If there are not as many left.
    pub(crate) fn beside(&self, bytes: u64) -> Result<Self, ServiceError> {
        let beside = self.account.whole.as_ref().unwrap_or(&self.account).claim();
        beside.grow(bytes)?;
        Ok(beside)
    }

    /// Bytes of all claims of the account.
    pub(crate) fn of_all(&self) -> u64 {
        self.account.used()
    }

    /// Gives back all but `bytes`.
    pub(crate) fn shrink_to(&mut self, bytes: u64) {
        let held = self.bytes.get_mut();
        self.account.give_back(held.saturating_sub(bytes));
        *held = bytes.min(*held);
    }
}

impl Drop for Claim {
    fn drop(&mut self) {
        self.shrink_to(0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_account_is_never_exceeded_and_gets_everything_back() {
        let server = MemoryAccount::of_server(1 << 30);
        let account = MemoryAccount::of_requests(8 << 20, &server);
        let large = account.claim();
        large.grow(7 << 20).expect("seven eighths are for everyone");
        let refused = large.grow(1).expect_err("the last eighth is for small requests");
        assert_eq!(refused.reason, Reason::RequestMemoryFull);
        assert!(refused.metadata.contains(&("left_bytes", "0".to_owned())), "{refused:?}");

        let small: Vec<Claim> = (0..16).map(|_| account.claim()).collect();
        for claim in &small {
            claim.grow(SMALL_BYTES).expect("room for small ones");
        }
        assert_eq!(account.used(), 8 << 20);
        account.claim().grow(1).expect_err("full");

        drop((large, small));
        assert_eq!((account.used(), server.used()), (0, 0));
        account.claim().grow(u64::MAX).expect_err("more than there is");
    }

    #[test]
    fn what_never_fits_is_told_with_how_much_is_too_much_and_what_raises_the_limit() {
        let server = MemoryAccount::of_server(2 << 20);
        let requests = MemoryAccount::of_requests(1 << 20, &server);
        let claim = requests.claim();
        claim.grow(500_000).expect("room");
        let later = requests.claim().grow(500_000).expect_err("full for now");
        assert!(!later.metadata.iter().any(|(key, _)| *key == "option"), "{later:?}");
        let never = claim.grow(500_000).expect_err("seven eighths are 917504 bytes");
        for wanted in ["1000000 bytes", "82496 more", "917504", "--max-request-bytes"] {
            assert!(never.message.contains(wanted), "{never:?}");
        }
        assert!(never.metadata.contains(&("over_bytes", "82496".to_owned())), "{never:?}");
        let never = server.claim().grow(3 << 20).expect_err("more than there is");
        assert!(never.message.contains("--max-server-bytes"), "{never:?}");
    }

    #[test]
    fn a_part_takes_from_the_whole_and_nothing_where_that_is_full() {
        let server = MemoryAccount::of_server(1000);
        let requests = MemoryAccount::of_requests(1000, &server);
        let mut session = server.claim();
        session.grow(900).expect("room");
        let request = requests.claim();
        let refused = request.grow(200).expect_err("the server is full");
        assert_eq!(refused.reason, Reason::ServerMemoryFull);
        assert_eq!((requests.used(), server.used()), (0, 900));

        session.shrink_to(300);
        request.grow(200).expect("room now");
        assert!(request.beside(501).is_err(), "500 are left");
        let beside = request.beside(500).expect("room");
        assert_eq!((requests.used(), server.used()), (200, 1000));
        drop(beside);
        assert_eq!((requests.used(), server.used()), (200, 500));
        drop((session, request));
        assert_eq!((requests.used(), server.used()), (0, 0));
    }
}

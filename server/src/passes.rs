//! What links to one session give: tokens that are good for that session and for copies of it, and for nothing else.
//!
//! Enters: what a link was made for, tokens that are shown, sessions that end. Leaves: a pass, and what its bearer may do.

use std::{
    io,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
    time::Instant,
};

use http::Extensions;
use nappe_proto::token::Token;
use subtle::ConstantTimeEq as _;
use tokio_util::sync::CancellationToken;

use crate::{
    error::{Reason, ServiceError},
    secret,
};

/// Tokens of links that are good at a time.
pub(crate) const MOST: usize = 1024;

/// What somebody who shows the token of a link may do with a method.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Right {
    /// Not call it.
    Never,
    /// Call it: it is about no session, or shows those alone that there are for the caller.
    Always,
    /// Call it about the session of the link, and about copies of the caller's own.
    Shared,
    /// Call it about copies of the caller's own.
    Own,
}

/// What a link to one session is good for.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(crate) struct Grant {
    /// Uid of the session that may be watched and copied.
    pub session_uid: String,
    /// Copies that each who opened it may have at a time.
    pub forks: u32,
    /// When all ends that it gave.
    pub until: Instant,
}

/// What one opening of a link gave.
#[derive(Debug)]
pub(crate) struct Pass {
    token: Token,
    grant: Grant,
    copies: Mutex<Copies>,
    /// Cancelled when it ends.
    ended: CancellationToken,
}

/// The copies of a bearer's own.
#[derive(Debug, Default)]
struct Copies {
    uids: Vec<String>,
    /// Those that are being made.
    coming: u32,
}

impl Pass {
    fn owns(&self, uid: &str) -> bool {
        self.copies().uids.iter().any(|own| own == uid)
    }

    fn copies(&self) -> MutexGuard<'_, Copies> {
        // No code that holds the lock can leave them half changed.
        self.copies.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// The passes of a server, which are in memory alone.
#[derive(Debug, Default)]
pub(crate) struct Passes {
    given: Mutex<Vec<Arc<Pass>>>,
    /// Uids of copies whose bearer's pass has ended.
    left: Mutex<Vec<String>>,
}

impl Passes {
    /// The token of a new pass; none where as many are good as may be.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub(crate) fn give(&self, grant: Grant, now: Instant) -> io::Result<Option<Token>> {
        let token = secret::draw()?;
        let mut given = self.good(now);
        if given.len() >= MOST {
            return Ok(None);
        }
        let (copies, ended) = (Mutex::default(), CancellationToken::new());
        given.push(Arc::new(Pass { token: token.clone(), grant, copies, ended }));
        Ok(Some(token))
    }

    /// The pass whose token is shown. All are compared, and the time of a comparison tells nothing of where two differ.
    pub(crate) fn find(&self, shown: &[u8], now: Instant) -> Option<Arc<Pass>> {
        self.good(now).iter().fold(None, |found, pass| {
            let is_shown = bool::from(pass.token.reveal().as_bytes().ct_eq(shown));
            if is_shown { Some(Arc::clone(pass)) } else { found }
        })
    }

    /// Ends the passes whose time is over, and those to sessions that are not there any more.
    pub(crate) fn end_over(&self, now: Instant, is_there: impl Fn(&str) -> bool) {
        self.good(now).retain(|pass| {
            let is_good = is_there(&pass.grant.session_uid);
            if !is_good {
                self.end(pass);
            }
            is_good
        });
    }

    /// The uids of copies that nobody steers any more, each told once.
    pub(crate) fn take_left(&self) -> Vec<String> {
        std::mem::take(&mut *self.left.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn end(&self, pass: &Pass) {
        pass.ended.cancel();
        let mut left = self.left.lock().unwrap_or_else(PoisonError::into_inner);
        left.append(&mut pass.copies().uids);
    }

    /// How many more can be given.
    pub(crate) fn places(&self, now: Instant) -> usize {
        MOST.saturating_sub(self.good(now).len())
    }

    /// Those whose time is not over.
    fn good(&self, now: Instant) -> MutexGuard<'_, Vec<Arc<Pass>>> {
        // No code that holds the lock can leave it half changed.
        let mut given = self.given.lock().unwrap_or_else(PoisonError::into_inner);
        given.retain(|pass| {
            let is_good = now < pass.grant.until;
            if !is_good {
                self.end(pass);
            }
            is_good
        });
        given
    }
}

/// Who calls: the bearer of a pass, with what that allows of the method, or somebody who may do everything.
#[derive(Clone, Debug, Default)]
pub(crate) struct Visitor(Option<(Arc<Pass>, Right)>);

impl Visitor {
    /// The bearer of a pass, who calls a method of which it allows so much.
    pub(crate) fn new(pass: Arc<Pass>, right: Right) -> Self {
        Self(Some((pass, right)))
    }

    /// Who made a request.
    pub(crate) fn of(request: &Extensions) -> Self {
        request.get().cloned().unwrap_or_default()
    }

    /// Whether a pass bounds what it may do.
    pub(crate) fn is_bound(&self) -> bool {
        self.0.is_some()
    }

    /// What is cancelled when its pass ends; none where none bounds it.
    pub(crate) fn ended(&self) -> Option<CancellationToken> {
        self.0.as_ref().map(|(pass, _)| pass.ended.clone())
    }

    /// Whether there is the session of a uid for it.
    pub(crate) fn sees(&self, uid: &str) -> bool {
        self.0.as_ref().is_none_or(|(pass, _)| pass.grant.session_uid == uid || pass.owns(uid))
    }

    /// Whether it may do everything with the session of a uid.
    pub(crate) fn owns(&self, uid: &str) -> bool {
        self.0.as_ref().is_none_or(|(pass, _)| pass.owns(uid))
    }

    /// Checks that it may call the method about the session of a uid, which it sees.
    ///
    /// # Errors
    /// If the method is for copies of its own, and that is none.
    pub(crate) fn check(&self, uid: &str) -> Result<(), ServiceError> {
        match &self.0 {
            Some((pass, right)) if *right != Right::Shared && !pass.owns(uid) => Err(too_narrow(
                "your link lets you watch this session and copy it: do that with a copy of your own",
            )),
            _ => Ok(()),
        }
    }

    /// A place for one more copy of its own; `is_there` says of which uids there are sessions.
    ///
    /// # Errors
    /// If it has as many as its pass allows.
    pub(crate) fn copy_place(&self, is_there: impl Fn(&str) -> bool) -> Result<CopyPlace, ServiceError> {
        let Some((pass, _)) = &self.0 else { return Ok(CopyPlace(None)) };
        let mut copies = pass.copies();
        copies.uids.retain(|uid| is_there(uid));
        let (count, allowed) = (copies.uids.len() + copies.coming as usize, pass.grant.forks as usize);
        if count >= allowed {
            let message =
                format!("you have {count} copies; your link allows {allowed} at a time: delete one");
            return Err(too_narrow(message).with("allowed", allowed));
        }
        copies.coming += 1;
        drop(copies);
        Ok(CopyPlace(Some(Arc::clone(pass))))
    }
}

/// A place for a copy that is being made; free again if it is dropped.
#[derive(Debug)]
pub(crate) struct CopyPlace(Option<Arc<Pass>>);

impl CopyPlace {
    /// The copy has this uid, and is there.
    pub(crate) fn fill(self, uid: &str) {
        if let Some(pass) = &self.0 {
            pass.copies().uids.push(uid.to_owned());
        }
    }
}

impl Drop for CopyPlace {
    fn drop(&mut self) {
        if let Some(pass) = &self.0 {
            pass.copies().coming -= 1;
        }
    }
}

/// The refusal of what a pass does not allow.
pub(crate) fn too_narrow(message: impl Into<String>) -> ServiceError {
    ServiceError::new(Reason::LinkTooNarrow, message)
}

/// Why a call of a bearer ends whose pass has ended.
pub(crate) fn over() -> ServiceError {
    let message = "the link that gave the token has ended: its time is over, or its session is deleted";
    ServiceError::new(Reason::TokenWrong, message)
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use super::*;

    const TIME: Duration = Duration::from_mins(10);

    fn grant(session_uid: &str, until: Instant) -> Grant {
        Grant { session_uid: session_uid.to_owned(), forks: 2, until }
    }

    fn give(passes: &Passes, session_uid: &str, now: Instant) -> Token {
        passes.give(grant(session_uid, now + TIME), now).expect("random numbers").expect("a place")
    }

    #[test]
    fn a_pass_is_found_by_its_token_until_its_time_or_its_session_ends() {
        let (passes, now) = (Passes::default(), Instant::now());
        let [one, other] = ["u-1", "u-2"].map(|uid| give(&passes, uid, now));
        let find = |token: &Token, now| passes.find(token.reveal().as_bytes(), now);
        let (pass, second) = (find(&one, now).expect("it is good"), find(&other, now).expect("it is good"));
        assert_eq!((&*pass.grant.session_uid, &*second.grant.session_uid), ("u-1", "u-2"));
        for bad in ["", &one.reveal()[1..], &format!("{}0", one.reveal())] {
            assert!(passes.find(bad.as_bytes(), now).is_none(), "{bad}");
        }
        assert!(!format!("{passes:?}").contains(one.reveal()));
        passes.end_over(now, |uid| uid == "u-1");
        assert!(find(&other, now).is_none() && second.ended.is_cancelled() && !pass.ended.is_cancelled());
        assert!(find(&one, now + TIME).is_none() && pass.ended.is_cancelled());
    }

    #[test]
    fn as_many_passes_are_good_as_may_be() {
        let (passes, now) = (Passes::default(), Instant::now());
        for _ in 0..MOST {
            give(&passes, "u-1", now);
        }
        assert!(passes.give(grant("u-1", now + TIME), now).expect("random numbers").is_none());
        give(&passes, "u-1", now + TIME);
    }

    #[test]
    fn a_bearer_sees_one_session_and_its_own_copies_and_has_so_many() {
        let (passes, now) = (Passes::default(), Instant::now());
        let [one, other] = [(); 2].map(|()| {
            let token = give(&passes, "u-1", now);
            passes.find(token.reveal().as_bytes(), now).expect("it is good")
        });
        let visitor = |right| Visitor::new(Arc::clone(&one), right);
        let stranger = Visitor::new(other, Right::Own);
        let place = visitor(Right::Shared).copy_place(|_| true).expect("a place");
        drop(visitor(Right::Shared).copy_place(|_| true).expect("a second place"));
        place.fill("u-2");
        assert!(
            visitor(Right::Own).sees("u-1")
                && visitor(Right::Own).sees("u-2")
                && !visitor(Right::Own).sees("u-3")
        );
        assert!(!stranger.sees("u-2") && stranger.copy_place(|_| true).is_ok());
        assert!(visitor(Right::Own).check("u-2").is_ok() && visitor(Right::Shared).check("u-1").is_ok());
        let refused = visitor(Right::Own).check("u-1").expect_err("it is shared");
        assert_eq!(refused.reason, Reason::LinkTooNarrow);

        let second = visitor(Right::Shared).copy_place(|_| true).expect("a second place");
        let refused = visitor(Right::Shared).copy_place(|_| true).expect_err("as many as may be");
        assert_eq!(refused.reason, Reason::LinkTooNarrow);
        drop(second);
        // One that was deleted leaves its place.
        visitor(Right::Shared).copy_place(|_| true).expect("a place").fill("u-4");
        assert!(visitor(Right::Shared).copy_place(|_| true).is_err());
        assert!(visitor(Right::Shared).copy_place(|uid| uid != "u-2").is_ok());
        assert!(!visitor(Right::Own).owns("u-2") && visitor(Right::Own).owns("u-4"));
        let everybody = Visitor::default();
        assert!(everybody.sees("u-9") && everybody.owns("u-9") && everybody.check("u-9").is_ok());
        assert!(everybody.copy_place(|_| false).is_ok() && everybody.ended().is_none());
    }
}

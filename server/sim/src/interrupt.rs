//! A request to give up what is in progress: a build or a step that would take long.
//!
//! A step looks at the request itself and fails. A build has loops at every depth, whose results cannot fail
//! otherwise: it comes to a [`point`] in each, and is left there by unwinding, as queries of rust-analyzer are
//! (salsa's `Cancelled`).

use std::{
    cell::RefCell,
    panic::{AssertUnwindSafe, catch_unwind, resume_unwind},
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
};

use thiserror::Error;

/// Shared by those who compute and those who may ask them to give up. Who computes looks at it between the
/// steps of snow within a step of the world, between the iterations of a solver, and in the loops of a build.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

/// The work was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("given up, as was asked")]
pub struct Interrupted;

thread_local! {
    /// What the work of this thread obeys.
    static OBEYED: RefCell<Option<Interrupt>> = const { RefCell::new(None) };
}

impl Interrupt {
    /// Asks to give up, for good.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked to give up.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }

    /// Whether a request to one is a request to the other.
    pub fn is_same(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }

    /// Does work that is left at the next [`point`] to which it comes on this thread once it is asked to give up.
    ///
    /// # Errors
    /// If it was left.
    ///
    /// # Panics
    /// As the work does.
    pub fn leave_at_points<T>(&self, work: impl FnOnce() -> T) -> Result<T, Interrupted> {
        let before = OBEYED.replace(Some(self.clone()));
        // What the work leaves half done is dropped with it.
        let done = catch_unwind(AssertUnwindSafe(work));
        OBEYED.set(before);
        done.or_else(|cause| if cause.is::<Interrupted>() { Err(Interrupted) } else { resume_unwind(cause) })
    }
}

/// A point at which a build can be left. Every loop over particles, springs or triangles that takes long has one.
pub fn point() {
    let is_requested = OBEYED.with_borrow(|obeyed| obeyed.as_ref().is_some_and(Interrupt::is_requested));
    if is_requested {
        // No panic, so that no hook reports one.
        resume_unwind(Box::new(Interrupted));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn work_is_left_at_a_point_once_that_is_asked() {
        let interrupt = Interrupt::default();
        let mut turns = 0;
        let left = interrupt.leave_at_points(|| {
            loop {
                point();
                turns += 1;
                if turns == 3 {
                    interrupt.request();
                }
            }
        });
        assert_eq!((left, turns), (Err::<(), _>(Interrupted), 3));

        // Others go on, and so does this thread.
        point();
        assert_eq!(Interrupt::default().leave_at_points(point), Ok(()));
    }

    #[test]
    fn a_panic_within_the_work_stays_a_panic() {
        let work = || Interrupt::default().leave_at_points(|| resume_unwind(Box::new("a bug")));
        let cause = catch_unwind(work).expect_err("it panics");
        assert_eq!(cause.downcast_ref(), Some(&"a bug"));
        point();
    }
}

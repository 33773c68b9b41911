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
/// steps of snow within a step of the world, between the iterations of a solver, in looks at surfaces, and in the loops of a build.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<Request>);

#[derive(Debug, Default)]
struct Request {
    is_made: AtomicBool,
    /// What the work belongs to: to give that up gives up all of it.
    whole: Option<Interrupt>,
}

/// The work was given up.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
#[error("given up, as was asked")]
pub struct Interrupted;

thread_local! {
    /// What the work of this thread obeys.
    static OBEYED: RefCell<Option<Interrupt>> = const { RefCell::new(None) };
}

impl Interrupt {
    /// That of a part of some work: it can be given up alone, and is where the whole is.
    #[must_use]
    pub fn of_part(&self) -> Self {
        Self(Arc::new(Request { is_made: AtomicBool::new(false), whole: Some(self.clone()) }))
    }

    /// Asks to give up, for good.
    pub fn request(&self) {
        self.0.is_made.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked to give up.
    pub fn is_requested(&self) -> bool {
        let Request { is_made, whole } = &*self.0;
        is_made.load(Ordering::Relaxed) || whole.as_ref().is_some_and(Self::is_requested)
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
        leave(Interrupted);
    }
}

/// Does work that threads share, each of which looks at what this thread obeys. Where it was given up, this is a [`point`].
pub fn shared<T>(work: impl FnOnce(&Interrupt) -> Result<T, Interrupted>) -> T {
    let obeyed = OBEYED.with_borrow(|obeyed| obeyed.clone().unwrap_or_default());
    work(&obeyed).unwrap_or_else(|interrupted| leave(interrupted))
}

/// Leaves the work of this thread.
fn leave(interrupted: Interrupted) -> ! {
    // No panic, so that no hook reports one.
    resume_unwind(Box::new(interrupted))
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
    fn work_that_threads_share_is_left_where_it_was_given_up() {
        let interrupt = Interrupt::default();
        let mut is_done = false;
        let left = interrupt.leave_at_points(|| {
            assert!(shared(|obeyed| Ok(obeyed.is_same(&interrupt))));
            interrupt.request();
            shared(|obeyed| if obeyed.is_requested() { Err(Interrupted) } else { Ok(()) });
            is_done = true;
        });
        assert_eq!((left, is_done), (Err(Interrupted), false));
        // Here nothing is obeyed.
        assert!(shared(|obeyed| Ok(!obeyed.is_requested())));
    }

    #[test]
    fn a_part_is_given_up_alone_or_with_the_whole() {
        let whole = Interrupt::default();
        let [one, other] = [whole.of_part(), whole.of_part()];
        one.request();
        let asked = || [&whole, &one, &other, &other.of_part()].map(Interrupt::is_requested);
        assert_eq!(asked(), [false, true, false, false]);
        whole.request();
        assert_eq!(asked(), [true; 4]);
    }

    #[test]
    fn a_panic_within_the_work_stays_a_panic() {
        let work = || Interrupt::default().leave_at_points(|| resume_unwind(Box::new("a bug")));
        let cause = catch_unwind(work).expect_err("it panics");
        assert_eq!(cause.downcast_ref(), Some(&"a bug"));
        point();
    }
}

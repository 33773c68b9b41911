//! What is in use compared with what is allowed, at each allocation; and clients, whose own memory is left out.
//!
//! Enters: what is allowed, as it is at any time. Leaves: the most bytes in use beyond that.

use std::{
    cell::Cell,
    panic::resume_unwind,
    sync::{
        PoisonError, RwLock,
        atomic::{AtomicBool, AtomicUsize, Ordering},
    },
    thread,
};

/// Bytes that may be in use now.
type Allowed = Box<dyn Fn() -> usize + Send + Sync>;

static ALLOWED: RwLock<Option<Allowed>> = RwLock::new(None);
static IS_WATCHED: AtomicBool = AtomicBool::new(false);
/// Most bytes in use beyond those that were allowed then.
static EXCESS: AtomicUsize = AtomicUsize::new(0);

thread_local! {
    static IS_OF_CLIENT: Cell<bool> = const { Cell::new(false) };
}

/// Whether this thread works for a client.
pub(crate) fn is_of_client() -> bool {
    // A thread that ends has no mark any more.
    IS_OF_CLIENT.try_with(Cell::get).unwrap_or(false)
}

/// Notes by how much more is in use than is allowed. It allocates nothing and waits for nobody, since an allocation calls it.
pub(crate) fn look(used: usize) {
    if !IS_WATCHED.load(Ordering::Relaxed) {
        return;
    }
    if let Ok(allowed) = ALLOWED.try_read()
        && let Some(allowed) = &*allowed
    {
        EXCESS.fetch_max(used.saturating_sub(allowed()), Ordering::Relaxed);
    }
}

/// A watch over what is in use, until it is dropped.
pub(crate) struct Watch(());

impl Watch {
    /// Begins; `allowed` gives the bytes that may be in use, and allocates nothing.
    pub(crate) fn begin(allowed: impl Fn() -> usize + Send + Sync + 'static) -> Self {
        let allowed: Allowed = Box::new(allowed);
        *ALLOWED.write().unwrap_or_else(PoisonError::into_inner) = Some(allowed);
        EXCESS.store(0, Ordering::Relaxed);
        IS_WATCHED.store(true, Ordering::Relaxed);
        Self(())
    }
}

impl Drop for Watch {
    fn drop(&mut self) {
        IS_WATCHED.store(false, Ordering::Relaxed);
        let allowed = ALLOWED.write().unwrap_or_else(PoisonError::into_inner).take();
        drop(allowed);
    }
}

/// Most bytes in use beyond those that were allowed, since the watch began.
pub(crate) fn excess() -> usize {
    EXCESS.load(Ordering::Relaxed)
}

/// Does the work of a client on threads of its own, whose memory is left out: they give back what they take.
pub(crate) fn as_client<T: Send>(work: impl Future<Output = T> + Send) -> T {
    let mark = || IS_OF_CLIENT.set(true);
    thread::scope(|scope| {
        let client = scope.spawn(move || {
            mark();
            let mut threads = tokio::runtime::Builder::new_multi_thread();
            let runtime = threads.worker_threads(1).on_thread_start(mark).enable_all().build();
            runtime.expect("a runtime").block_on(work)
        });
        client.join().unwrap_or_else(|panic| resume_unwind(panic))
    })
}

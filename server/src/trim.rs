//! Memory that ended sessions leave behind, given back to the system.
//!
//! The allocator keeps what is freed for what may be asked for next: after sessions of gigabytes that can be gigabytes.

use std::{sync::Arc, time::Duration};

use tokio_util::sync::CancellationToken;

use crate::memory::MemoryAccount;

/// Time between two looks.
const LOOK: Duration = Duration::from_secs(1);
/// Bytes that have to be given back before the allocator is asked at once.
const LARGE: u64 = 32 << 20;
/// Looks without a change after which the server is idle.
const IDLE: u32 = 10;

/// When the allocator is asked: what an account held at most since it was, and how long nothing changed.
#[derive(Debug, Default)]
struct Watch {
    most: u64,
    last: u64,
    same: u32,
    /// Whether anything changed since the server was idle last.
    is_open: bool,
}

impl Watch {
    /// Looks at the bytes that are in use; whether the allocator is to be asked now.
    fn look(&mut self, used: u64) -> bool {
        self.most = self.most.max(used);
        let is_same = used == self.last;
        self.same = if is_same { self.same.saturating_add(1) } else { 0 };
        self.is_open |= !is_same;
        self.last = used;
        let is_idle = self.is_open && self.same >= IDLE;
        if is_idle {
            self.is_open = false;
        }
        let is_large = self.most - used >= LARGE;
        if is_large || is_idle {
            self.most = used;
        }
        is_large || is_idle
    }
}

/// Gives memory back when a large part of an account was, and when nothing of it has changed for ten seconds; ends with the
/// server.
pub(crate) async fn keep(account: Arc<MemoryAccount>, draining: CancellationToken) {
    let (mut times, mut watch) = (tokio::time::interval(LOOK), Watch::default());
    loop {
        tokio::select! {
            _ = times.tick() => {}
            () = draining.cancelled() => return,
        }
        if watch.look(account.used()) {
            // It walks through all that is free, which can take milliseconds; a panic in it was told where it happened.
            let _ = tokio::task::spawn_blocking(give_back).await;
        }
    }
}

/// Asks the allocator for what it keeps.
#[cfg(all(target_os = "linux", target_env = "gnu"))]
#[allow(unsafe_code, reason = "the C library offers it as a function alone")]
fn give_back() {
    // SAFETY: it takes no pointer, and may be called from any thread at any time (malloc_trim(3)).
    unsafe {
        libc::malloc_trim(0);
    }
}

/// Other allocators give back by themselves.
#[cfg(not(all(target_os = "linux", target_env = "gnu")))]
fn give_back() {}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_allocator_is_asked_after_a_large_session_and_once_when_nothing_changes() {
        let mut watch = Watch::default();
        assert!(!watch.look(LARGE));
        assert!(!watch.look(LARGE / 2), "half of it is still in use");
        assert!(watch.look(0));
        // Threads of the session may give back more after that.
        let asked: Vec<u32> = (1..3 * IDLE).filter(|_| watch.look(0)).collect();
        assert_eq!(asked, [IDLE]);
        // Small sessions come and go.
        assert!(!watch.look(100) && !watch.look(0));
        let asked: Vec<u32> = (1..3 * IDLE).filter(|_| watch.look(0)).collect();
        assert_eq!(asked, [IDLE]);
    }
}

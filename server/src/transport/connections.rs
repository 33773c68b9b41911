//! Places for connections: so many in all, and so many from one address. Once they are taken, the oldest stranger's goes
//! to whoever comes.
//!
//! Enters: the address of a peer. Leaves: a place, held until it is dropped or given to another, or why there is none.

use std::{
    collections::BTreeMap,
    net::IpAddr,
    sync::{
        Arc, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
    time::Duration,
};

use http::Extensions;
use tokio::time::{Instant, sleep_until};

use crate::stream::Cut;

/// Which connections are open.
#[derive(Debug)]
pub(super) struct Connections {
    limit: usize,
    limit_per_address: usize,
    open: Mutex<Open>,
}

/// The connections that have places.
#[derive(Debug, Default)]
struct Open {
    /// By their numbers: the oldest first.
    peers: BTreeMap<u64, Peer>,
    /// The number of the next one.
    next: u64,
}

/// The other end of a connection.
#[derive(Debug)]
struct Peer {
    /// None for one of a Unix socket.
    address: Option<IpAddr>,
    standing: Standing,
    cut: Cut,
}

/// Why a connection is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Full {
    /// As many are open as are allowed, and no stranger is among them.
    Everywhere,
    /// The same of those from the peer's address.
    FromThere,
}

/// The place of a connection.
#[derive(Debug)]
pub(super) struct Place {
    connections: Arc<Connections>,
    number: u64,
    taken: Instant,
    standing: Standing,
    cut: Cut,
}

/// Whether the peer of a connection is known, which goes with each of its requests: it showed the token or, where none is
/// asked for, sent a whole request. Until then it is a stranger.
#[derive(Clone, Debug, Default)]
pub(super) struct Standing(Arc<AtomicBool>);

impl Standing {
    /// That of the peer who sent a request.
    pub(super) fn of(request: &Extensions) -> Self {
        request.get().cloned().unwrap_or_default()
    }

    pub(super) fn becomes_known(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    fn is_known(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

impl Connections {
    pub(super) fn new(limit: u32, limit_per_address: u32) -> Arc<Self> {
        let (limit, limit_per_address) = (limit as usize, limit_per_address as usize);
        Arc::new(Self { limit, limit_per_address, open: Mutex::default() })
    }

    /// A place for a peer at an address, or for one of a Unix socket.
    ///
    /// # Errors
    /// If there is none, and no stranger who could give way.
    pub(super) fn place(self: &Arc<Self>, address: Option<IpAddr>) -> Result<Place, Full> {
        // An IPv4 peer of a listener for both is the same peer.
        let address = address.map(|address| address.to_canonical());
        let mut open = self.lock();
        let here = open.peers.values().filter(|peer| peer.address == address).count();
        // Who opens a Unix socket is the server's own user.
        if address.is_some() && here >= self.limit_per_address {
            open.make_room(Full::FromThere, |peer| peer.address == address)?;
        }
        if open.peers.len() >= self.limit {
            open.make_room(Full::Everywhere, |_| true)?;
        }

        let (number, standing, cut) = (open.next, Standing::default(), Cut::default());
        open.next += 1;
        open.peers.insert(number, Peer { address, standing: standing.clone(), cut: cut.clone() });
        Ok(Place { connections: Arc::clone(self), number, taken: Instant::now(), standing, cut })
    }

    fn lock(&self) -> MutexGuard<'_, Open> {
        // No code that holds the lock can leave it half changed.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Open {
    /// Closes the oldest connection of a stranger among some peers.
    ///
    /// # Errors
    /// What is full, if all of them are known.
    fn make_room(&mut self, full: Full, among: impl Fn(&Peer) -> bool) -> Result<(), Full> {
        let oldest = self.peers.iter().find(|(_, peer)| !peer.standing.is_known() && among(peer));
        let number = *oldest.ok_or(full)?.0;
        let stranger = self.peers.remove(&number).ok_or(full)?;
        tracing::debug!(address = ?stranger.address, "a stranger's connection gives way to a new one");
        stranger.cut.0.cancel();
        Ok(())
    }
}

impl Place {
    /// Leaves with a request what it may change of its connection.
    pub(super) fn go_with(&self, request: &mut Extensions) {
        request.insert(self.standing.clone());
        request.insert(self.cut.clone());
    }

    /// Waits until the connection is to be cut: it gives way, or a watcher takes nothing.
    pub(super) async fn cut(&self) {
        self.cut.0.cancelled().await;
    }

    /// Waits until the connection has been open for `time`, and without end if its peer is known by then.
    pub(super) async fn overstayed(&self, time: Duration) {
        sleep_until(self.taken + time).await;
        self.strange().await;
    }

    /// Waits without end if the peer is known.
    pub(super) async fn strange(&self) {
        if self.standing.is_known() {
            std::future::pending::<()>().await;
        }
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        // One that gave way has none any more.
        self.connections.lock().peers.remove(&self.number);
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use tokio::time::timeout;

    use super::*;

    fn addresses() -> [Option<IpAddr>; 2] {
        [1, 2].map(|last| Some(IpAddr::V4(Ipv4Addr::new(127, 0, 0, last))))
    }

    /// A place whose peer is known.
    fn known(connections: &Arc<Connections>, address: Option<IpAddr>) -> Place {
        let place = connections.place(address).expect("a place");
        place.standing.becomes_known();
        place
    }

    fn is_cut(place: &Place) -> bool {
        place.cut.0.is_cancelled()
    }

    #[test]
    fn places_are_bounded_in_all_and_from_each_address_and_come_back() {
        let connections = Connections::new(3, 2);
        let [here, there] = addresses();
        let first = known(&connections, here);
        let second = known(&connections, here);
        assert_eq!(connections.place(here).expect_err("two are there"), Full::FromThere);
        let mapped = Some(IpAddr::V6(Ipv4Addr::LOCALHOST.to_ipv6_mapped()));
        assert_eq!(connections.place(mapped).expect_err("it is the same peer"), Full::FromThere);
        let third = known(&connections, there);
        assert_eq!(connections.place(there).expect_err("three in all"), Full::Everywhere);
        assert!(![&first, &second, &third].into_iter().any(is_cut), "who is known never gives way");
        drop(first);
        connections.place(here).expect("a place came back");
        assert_eq!(connections.lock().peers.len(), 2, "who is gone is forgotten");
    }

    #[test]
    fn the_oldest_stranger_of_the_address_gives_way_or_else_the_oldest_of_all() {
        let connections = Connections::new(4, 3);
        let [here, there] = addresses();
        let elsewhere = connections.place(there).expect("a place");
        let own = known(&connections, here);
        let [old, new] = [(); 2].map(|()| connections.place(here).expect("a place"));
        let next = connections.place(here).expect("a stranger gives way");
        assert_eq!([&elsewhere, &own, &old, &new, &next].map(is_cut), [false, false, true, false, false]);
        drop(old);
        assert_eq!(connections.lock().peers.len(), 4, "it took no place with it");

        let late = connections.place(there).expect("a stranger gives way");
        assert_eq!([&elsewhere, &own, &new, &next, &late].map(is_cut), [true, false, false, false, false]);
    }

    #[tokio::test]
    async fn a_stranger_overstays_and_who_is_known_does_not() {
        let (patience, short) = (Duration::from_mins(1), Duration::from_millis(50));
        let connections = Connections::new(2, 2);
        let stranger = connections.place(None).expect("a place");
        timeout(patience, stranger.overstayed(short)).await.expect("it said nothing");
        assert!(stranger.taken.elapsed() >= short);

        let known = known(&connections, None);
        timeout(short * 2, known.overstayed(short)).await.expect_err("it stays");
        let mut request = Extensions::new();
        stranger.go_with(&mut request);
        Standing::of(&request).becomes_known();
        timeout(short, stranger.overstayed(short)).await.expect_err("its request made it known");
    }
}

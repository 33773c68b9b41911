//! Places for connections: so many in all, and so many from one address.
//!
//! Enters: the address of a peer. Leaves: a place, held until it is dropped, or why there is none.

use std::{
    collections::HashMap,
    net::IpAddr,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Which connections are open.
#[derive(Debug)]
pub(super) struct Connections {
    limit: usize,
    limit_per_address: usize,
    /// By address; those of a Unix socket have none.
    open: Mutex<HashMap<Option<IpAddr>, usize>>,
}

/// Why a connection is refused.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Full {
    /// As many are open as are allowed.
    Everywhere,
    /// As many are open from the peer's address as are allowed.
    FromThere,
}

/// The place of a connection.
#[derive(Debug)]
pub(super) struct Place {
    connections: Arc<Connections>,
    address: Option<IpAddr>,
}

impl Connections {
    pub(super) fn new(limit: u32, limit_per_address: u32) -> Arc<Self> {
        let (limit, limit_per_address) = (limit as usize, limit_per_address as usize);
        Arc::new(Self { limit, limit_per_address, open: Mutex::default() })
    }

    /// A place for a peer at an address, or for one of a Unix socket.
    ///
    /// # Errors
    /// If there is none.
    pub(super) fn place(self: &Arc<Self>, address: Option<IpAddr>) -> Result<Place, Full> {
        // An IPv4 peer of a listener for both is the same peer.
        let address = address.map(|address| address.to_canonical());
        let mut open = self.lock();
        if open.values().sum::<usize>() >= self.limit {
            return Err(Full::Everywhere);
        }
        let here = open.entry(address).or_default();
        // Who opens a Unix socket is the server's own user.
        if address.is_some() && *here >= self.limit_per_address {
            return Err(Full::FromThere);
        }
        *here += 1;
        Ok(Place { connections: Arc::clone(self), address })
    }

    fn lock(&self) -> MutexGuard<'_, HashMap<Option<IpAddr>, usize>> {
        // No code that holds the lock can leave it half changed.
        self.open.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl Drop for Place {
    fn drop(&mut self) {
        let mut open = self.connections.lock();
        if let Some(here) = open.get_mut(&self.address) {
            *here -= 1;
            if *here == 0 {
                open.remove(&self.address);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use std::net::Ipv4Addr;

    use super::*;

    #[test]
    fn places_are_bounded_in_all_and_from_each_address_and_come_back() {
        let connections = Connections::new(3, 2);
        let [here, there] = [1, 2].map(|last| Some(IpAddr::V4(Ipv4Addr::new(127, 0, 0, last))));
        let first = connections.place(here).expect("the first");
        let _second = connections.place(here).expect("the second");
        assert_eq!(connections.place(here).expect_err("two are there"), Full::FromThere);
        let mapped = Some(IpAddr::V6(Ipv4Addr::LOCALHOST.to_ipv6_mapped()));
        assert_eq!(connections.place(mapped).expect_err("it is the same peer"), Full::FromThere);
        let _third = connections.place(there).expect("another address");
        assert_eq!(connections.place(there).expect_err("three in all"), Full::Everywhere);
        drop(first);
        connections.place(here).expect("a place came back");
        assert_eq!(connections.lock().len(), 2, "who is gone is forgotten");
    }
}

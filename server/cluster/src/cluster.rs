//! What ranks ask of each other beside what a step asks.

use nappe_sim::parallel::Communicator;

/// The ranks of a job.
pub trait Cluster: Communicator {
    /// Hands what rank 0 has to all others. A rank that waits for it sleeps: between two steps hours may pass.
    fn broadcast(&self, bytes: &mut Vec<u8>);

    /// The name of the host of each rank, on rank 0; nothing on the others.
    fn hosts(&self) -> Vec<String>;
}

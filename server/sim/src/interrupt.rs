//! A request to give up what is in progress: a build or a step that would take long.

use std::sync::{
    Arc,
    atomic::{AtomicBool, Ordering},
};

/// Shared by those who compute and those who may ask them to give up. Who computes looks at it between the
/// steps of snow within a step of the world, and between the iterations of a solver.
#[derive(Clone, Debug, Default)]
pub struct Interrupt(Arc<AtomicBool>);

impl Interrupt {
    /// Asks to give up, for good.
    pub fn request(&self) {
        self.0.store(true, Ordering::Relaxed);
    }

    /// Whether somebody asked to give up.
    pub fn is_requested(&self) -> bool {
        self.0.load(Ordering::Relaxed)
    }
}

//! Counts particles and springs against the caller's limits, before memory is taken for them.

use super::{SceneLimits, body::Context};
use crate::error::{Fault, SceneError};

/// What the bodies so far hold.
pub(super) struct Size<'a> {
    limits: &'a SceneLimits,
    particles: u64,
    springs: u64,
}

impl<'a> Size<'a> {
    pub(super) fn new(limits: &'a SceneLimits) -> Self {
        Self { limits, particles: 0, springs: 0 }
    }

    pub(super) fn particles(&self) -> u64 {
        self.particles
    }

    pub(super) fn add_particles(&mut self, context: &Context<'_>, count: u64) -> Result<(), SceneError> {
        self.particles = self.particles.saturating_add(count);
        // A particle's index has 32 bits.
        let allowed = self.limits.max_particles.min(u64::from(u32::MAX / 4));
        check(context, "mesh", "particles", count, self.particles, allowed)
    }

    /// Springs that are sure to come, or have come: called with a bound first, and the rest later.
    pub(super) fn add_springs(&mut self, context: &Context<'_>, count: u64) -> Result<(), SceneError> {
        self.springs = self.springs.saturating_add(count);
        check(context, "springs", "springs", count, self.springs, self.limits.max_springs)
    }
}

fn check(
    context: &Context<'_>,
    field: &str,
    what: &str,
    here: u64,
    total: u64,
    allowed: u64,
) -> Result<(), SceneError> {
    if total <= allowed {
        return Ok(());
    }
    let with = if here == total { String::new() } else { format!(", {total} with the bodies before it") };
    let message = format!("this body has {here} {what}{with}; allowed: at most {allowed}");
    Err(context.source.error(Fault::TooLarge, &context.path.key(field), message))
}

/// Springs of a lattice of `columns` x `rows`: stretch, shear, bend.
pub(super) fn lattice_springs(columns: u64, rows: u64) -> [u64; 3] {
    let (c, r) = (columns, rows);
    [
        c * r.saturating_sub(1) + r * c.saturating_sub(1),
        2 * c.saturating_sub(1) * r.saturating_sub(1),
        c * r.saturating_sub(2) + r * c.saturating_sub(2),
    ]
}

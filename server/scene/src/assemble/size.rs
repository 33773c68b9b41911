//! Counts particles and springs against the caller's limits, before memory is taken for them.

use super::SceneLimits;
use crate::{
    error::{Fault, SceneError},
    source::{Path, Source},
};

/// Who takes memory.
pub(super) struct Owner<'a> {
    pub(super) path: &'a Path,
    pub(super) source: &'a Source,
    /// What it calls itself in messages.
    pub(super) noun: &'static str,
}

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

    /// Particles that are there, or are about to be; `field` says where they come from.
    pub(super) fn add_particles(
        &mut self,
        owner: &Owner<'_>,
        field: &str,
        count: u64,
    ) -> Result<(), SceneError> {
        self.check_particles(owner, field, count)?;
        self.particles += count;
        Ok(())
    }

    /// Holds particles against the limit without adding them: for an estimate.
    pub(super) fn check_particles(
        &self,
        owner: &Owner<'_>,
        field: &str,
        count: u64,
    ) -> Result<(), SceneError> {
        // A particle's index has 32 bits.
        let allowed = self.limits.max_particles.min(u64::from(u32::MAX / 4));
        check(owner, [field, "particles"], count, self.particles.saturating_add(count), allowed)
    }

    /// Springs that are sure to come, or have come: called with a bound first, and the rest later.
    pub(super) fn add_springs(&mut self, owner: &Owner<'_>, count: u64) -> Result<(), SceneError> {
        self.springs = self.springs.saturating_add(count);
        check(owner, ["springs", "springs"], count, self.springs, self.limits.max_springs)
    }
}

fn check(
    owner: &Owner<'_>,
    [field, what]: [&str; 2],
    here: u64,
    total: u64,
    allowed: u64,
) -> Result<(), SceneError> {
    if total <= allowed {
        return Ok(());
    }
    let noun = owner.noun;
    let with = if here == total {
        String::new()
    } else {
        format!(", {total} with the {before} before it", before = plural(noun))
    };
    let message = format!("this {noun} has {here} {what}{with}; allowed: at most {allowed}");
    Err(owner.source.error(Fault::TooLarge, &owner.path.key(field), message))
}

fn plural(noun: &str) -> &'static str {
    if noun == "body" { "bodies" } else { "bodies and objects" }
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

//! Snow as a body of a world: a model, its state and what a step works with, in one hand.

use super::{
    attached::Attached,
    grid::{REACH, SIDE},
    init::{build, check_first_step},
    model::SnowModel,
    ranks::SnowRanks,
    settings::SnowSettings,
    setup::{SnowError, SnowSetup, check},
    state::{SnowState, SnowWorkspace},
    step::{NOTHING, SnowStep, step, sums_of},
};
use crate::{
    collide::Collider,
    math::Real,
    parallel::Ranks,
    report::{Diagnostics, Load, StepFailure, Stopwatch},
    surroundings::Surroundings,
};

/// Blocks at the end of the grid where nothing is put: in binary32 a place is rounded there by half a cell.
const MARGIN: i32 = 4;

/// Snow: the particles of all objects on one grid.
#[derive(Clone, Debug)]
pub struct Snow<R: Real> {
    pub(super) model: SnowModel<R>,
    pub(super) state: SnowState<R>,
    pub(super) work: SnowWorkspace<R>,
}

impl<R: Real> Snow<R> {
    /// Builds snow; the strings are warnings that do not stop it.
    ///
    /// # Errors
    /// What is wrong with the setup.
    pub fn new(setup: &SnowSetup) -> Result<(Self, Vec<String>), SnowError> {
        Self::over(setup, None)
    }

    /// The same for one of several ranks, of which each has all until its first step.
    pub(crate) fn over(setup: &SnowSetup, ranks: Option<&Ranks>) -> Result<(Self, Vec<String>), SnowError> {
        let mut warnings = check(setup)?;
        let (model, state, mut work) = build(setup)?;
        let (size, blocks) = (ranks.map_or(1, |ranks| ranks.size_and_rank().0), work.grid.blocks.len());
        if size > blocks {
            warnings.push(format!(
                "snow: {size} ranks share {blocks} blocks of its grid, so that some begin with nothing"
            ));
        }
        work.ranks = ranks.filter(|ranks| ranks.size_and_rank().0 > 1).cloned().map(SnowRanks::new);
        Ok((Self { model, state, work }, warnings))
    }

    /// Holds particles to colliders, as the setup that it was built from asks for.
    ///
    /// # Errors
    /// When a collider is not there, moves or does not stick, or no particle of an object is near it.
    pub(crate) fn attach(&mut self, setup: &SnowSetup, colliders: &[Collider]) -> Result<(), SnowError> {
        self.model.attached = Attached::of(setup, colliders)?;
        Ok(())
    }

    /// Names of objects that are held to a collider, each with that of the collider.
    pub(crate) fn attached(&self) -> &[[String; 2]] {
        self.model.attached.names()
    }

    /// Refuses a fixed step above the bound at the start.
    pub(crate) fn check_step(&self, colliders: &[Collider]) -> Result<(), SnowError> {
        check_first_step(&self.model, &self.state, &self.work, colliders)
    }

    /// Advances by one step of the world: see [`step()`].
    ///
    /// # Errors
    /// When a step of the snow cannot be taken: particles are then as before that step.
    pub fn step(
        &mut self,
        around: &Surroundings<'_>,
        watch: &mut dyn Stopwatch,
    ) -> Result<SnowStep, StepFailure> {
        step(&self.model, &mut self.state, &mut self.work, around, watch)
    }

    /// Adds what it gave to colliders in its last step of the world, which began as this one, to their loads.
    pub(crate) fn add_to(&self, around: &Surroundings<'_>, loads: &mut [Load]) {
        for ((felt, load), collider) in self.work.loads.felt.iter().zip(loads).zip(around.colliders) {
            felt.add_to(load, collider, around.whole());
        }
    }

    /// How it is stepped.
    pub fn settings(&self) -> &SnowSettings {
        &self.model.settings
    }

    /// How far from the origin (m) a call may put a particle along an axis: there the numbers of the grid end, but for blocks that
    /// rounding may take a particle to.
    pub(crate) fn reach(&self) -> f64 {
        f64::from(REACH - MARGIN) * SIDE as f64 * self.model.settings.cell
    }

    /// Bytes in use by particles, order and grid.
    pub fn memory_bytes(&self) -> usize {
        self.state.particles.bytes() + self.work.bytes()
    }

    /// Energies and momentum of the state as it is.
    pub fn diagnose(&self, gravity: [f64; 3]) -> Diagnostics {
        let sorted = (self.work.sorter.sorted(), self.work.divided());
        let scratch = (&mut Vec::new(), NOTHING);
        sums_of(&self.model, &self.state.particles, sorted, gravity, scratch).diagnostics
    }
}

//! Snow as a body of a world: all of its objects on one grid, after the cloths.

use super::{report::BodyReport, setup::SetupError, topology::BodyTopology};
use crate::{
    collide::Collider,
    field::Field,
    math::Real,
    parallel::Ranks,
    report::{Diagnostics, Notices, StepFailure, Stopwatch},
    snow::{Snow, SnowSetup},
    surroundings::Surroundings,
};

/// The snow of a world.
#[derive(Clone, Debug)]
pub(super) struct SnowBody<R: Real> {
    /// Index of its first particle among all.
    pub(super) first_particle: u32,
    pub(super) snow: Snow<R>,
}

impl<R: Real> SnowBody<R> {
    /// Builds the snow; the strings are warnings that do not stop it.
    pub(super) fn new(
        setup: &SnowSetup,
        colliders: &[Collider],
        first_particle: u32,
        ranks: Option<&Ranks>,
    ) -> Result<(Self, Vec<String>), SetupError> {
        let (snow, warnings) = Snow::over(setup, ranks)?;
        snow.check_step(colliders)?;
        Ok((Self { first_particle, snow }, warnings))
    }

    pub(super) fn step(
        &mut self,
        around: &Surroundings<'_>,
        watch: &mut dyn Stopwatch,
    ) -> Result<BodyReport, StepFailure> {
        let step = self.snow.step(around, watch)?;
        let first = u64::from(self.first_particle);
        Ok(BodyReport {
            diagnostics: step.diagnostics,
            contact_count: step.contact_count,
            solve: step.solve,
            snow: Some(step.report.shifted(first)),
            notices: Notices {
                first_passed: step.notices.first_passed.map(|particle| particle + first),
                ..step.notices
            },
            work: step.work,
        })
    }

    pub(super) fn diagnose(&self, around: &Surroundings<'_>) -> Diagnostics {
        self.snow.diagnose(around.gravity)
    }

    pub(super) fn particle_count(&self) -> usize {
        self.snow.particle_count()
    }

    /// The object that the particle of a failure belongs to.
    pub(super) fn name_for(&self, failure: &StepFailure) -> &str {
        failure.particle().map_or("snow", |particle| self.snow.object_of(particle))
    }

    pub(super) fn read<T: Real>(&self, field: Field, out: &mut [T]) {
        self.snow.read(field, out);
    }

    pub(super) fn hash(&self) -> u64 {
        self.snow.hash(u64::from(self.first_particle))
    }

    pub(super) fn topology(&self, out: &mut Vec<BodyTopology>) {
        let mut first_particle = self.first_particle;
        for (name, count) in self.snow.objects() {
            let (name, particle_count) = (name.to_owned(), count as u32);
            out.push(BodyTopology { name, first_particle, particle_count, ..BodyTopology::default() });
            first_particle += particle_count;
        }
    }
}

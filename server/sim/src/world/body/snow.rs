//! Snow as a body of a world: all of its objects on one grid, after the cloths.

use std::sync::Arc;

use crate::{
    collide::Collider,
    field::Field,
    math::Real,
    parallel::Ranks,
    report::{Diagnostics, Notices, StepFailure, Stopwatch},
    snow::{Place, Snow, SnowObject, SnowSetup},
    surroundings::Surroundings,
    world::setup::{
        SetupError,
        forces::{CalledForces, Forces},
        report::BodyReport,
        topology::BodyTopology,
    },
};

/// Where particles are, and C (1/s) of those of each object, by rows.
type Start<R> = (Vec<Place<R>>, Vec<[[f64; 3]; 3]>);

/// The snow of a world.
#[derive(Clone, Debug)]
pub(crate) struct SnowBody<R: Real> {
    /// Index of its first particle among all.
    pub(crate) first_particle: u32,
    pub(crate) snow: Snow<R>,
    /// Where its particles are at the start, and C (1/s) of those of each object; none over ranks.
    start: Arc<Start<R>>,
}

impl<R: Real> SnowBody<R> {
    /// Builds the snow; the strings are warnings that do not stop it.
    pub(crate) fn new(
        setup: &SnowSetup,
        colliders: &[Collider],
        first_particle: u32,
        ranks: Option<&Ranks>,
    ) -> Result<(Self, Vec<String>), SetupError> {
        let (mut snow, warnings) = Snow::over(setup, ranks)?;
        snow.attach(setup, colliders)?;
        snow.check_step(colliders)?;
        let places = if ranks.is_some() { Vec::new() } else { snow.places() };
        let affine = setup.objects.iter().map(SnowObject::affine_velocity).collect();
        let start = Arc::new((places, affine));
        Ok((Self { first_particle, snow, start }, warnings))
    }

    pub(crate) fn step(
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
            surface: None,
            snow: Some(step.report.shifted(first)),
            notices: Notices {
                first_passed: step.notices.first_passed.map(|particle| particle + first),
                first_torn: step.notices.first_torn.map(|particle| particle + first),
                ..step.notices
            },
            work: step.work,
        })
    }

    /// The first particle of an object, in the snow's numbering, and how many it has.
    fn object(&self, name: &str) -> Option<(usize, usize)> {
        let mut first = 0;
        for (object, count) in self.snow.objects() {
            if object == name {
                return Some((first, count));
            }
            first += count;
        }
        None
    }

    /// Sets forces on particles of the object of that name, if it is one; on all where there are none.
    pub(crate) fn set_forces(&mut self, name: &str, particles: &[u32], forces: &Forces) {
        let Some((first, count)) = self.object(name) else { return };
        if particles.is_empty() {
            self.snow.set_forces((0..count).map(|place| (first + place, forces.at(place))));
        } else {
            let listed = particles.iter().enumerate();
            self.snow.set_forces(listed.map(|(place, at)| (first + *at as usize, forces.at(place))));
        }
    }

    /// Adds the forces that calls have set on its objects, each with its first particle; so many particles as are `left` are listed.
    pub(crate) fn called_forces(&self, left: &mut usize, out: &mut Vec<(u32, CalledForces)>) {
        let called = self.snow.forces();
        if called.is_empty() {
            return;
        }
        let mut first = 0;
        for (name, count) in self.snow.objects() {
            let told = CalledForces::of(name, &called[first..first + count], |_| false, left);
            out.extend(told.map(|told| (self.first_particle + first as u32, told)));
            first += count;
        }
    }

    /// Puts the particles of the object of that name, if it is one, elsewhere (m), with these velocities (m/s).
    pub(crate) fn place(&mut self, name: &str, positions: &[[f64; 3]], velocities: Option<&[[f64; 3]]>) {
        let Some((first, _)) = self.object(name) else { return };
        let place = |at: usize| {
            let v = velocities.map_or([0.0; 3], |velocities| velocities[at]);
            [positions[at], v].map(|vector| vector.map(R::of))
        };
        let places: Vec<Place<R>> = (0..positions.len()).map(place).collect();
        self.snow.put_at(first, &places, &|_| [[0.0; 3]; 3]);
    }

    /// Puts it back to its start.
    pub(crate) fn reset(&mut self) {
        let start = self.start.clone();
        let (places, affine) = &*start;
        let ends: Vec<usize> = self
            .snow
            .objects()
            .scan(0, |end, (_, count)| {
                *end += count;
                Some(*end)
            })
            .collect();
        self.snow.set_forces((0..places.len()).map(|at| (at, [0.0; 3])));
        self.snow.put_at(0, places, &|id| affine[ends.partition_point(|end| *end <= id)]);
    }

    /// Memory of the forces that calls have set (bytes).
    pub(crate) fn changed_bytes(&self) -> usize {
        size_of_val(self.snow.forces())
    }

    /// Adds forces that calls have set to a hash.
    pub(crate) fn hash_forces(&self, hasher: &mut xxhash_rust::xxh3::Xxh3) {
        self.snow.forces().as_flattened().iter().for_each(|c| hasher.update(&c.to_le_bytes()));
    }

    pub(crate) fn diagnose(&self, around: &Surroundings<'_>) -> Diagnostics {
        self.snow.diagnose(around.gravity)
    }

    pub(crate) fn particle_count(&self) -> usize {
        self.snow.particle_count()
    }

    /// The object that the particle of a failure belongs to.
    pub(crate) fn name_for(&self, failure: &StepFailure) -> &str {
        failure.particle().map_or("snow", |particle| self.snow.object_of(particle))
    }

    /// Writes its part of a field over that of all bodies.
    pub(crate) fn read<T: Real>(&self, field: Field, around: &Surroundings<'_>, out: &mut [T]) {
        let [first, count] = [self.first_particle as usize, self.particle_count()].map(|n| field.width() * n);
        self.snow.read(field, around, &mut out[first..first + count]);
    }

    pub(crate) fn hash(&self) -> u64 {
        self.snow.hash(u64::from(self.first_particle))
    }

    pub(crate) fn topology(&self, out: &mut Vec<BodyTopology>) {
        let mut first_particle = self.first_particle;
        let all = self.snow.weights();
        let mut rest = all.as_slice();
        for (name, count) in self.snow.objects() {
            let (name, particle_count) = (name.to_owned(), count as u32);
            let (own, others) = rest.split_at(count);
            rest = others;
            let masses = own.iter().map(|[mass, _]| *mass).collect();
            let volumes = own.iter().map(|[_, volume]| *volume).collect();
            let none = BodyTopology::default();
            out.push(BodyTopology { name, first_particle, particle_count, masses, volumes, ..none });
            first_particle += particle_count;
        }
    }
}

//! A world that begins elsewhere than at the start of its setup: at a frame that was saved of it.
//!
//! Enters: steps taken, positions, velocities, and numbers that the frame carries. Leaves: a world whose clock stands there.

use std::ops::Range;

use thiserror::Error;

use super::{World, carried::CarriedError, pace::Pace};
use crate::{
    math::{Padded, Real, vec3},
    world::{
        body::{Body, cloth::Cloth},
        calls::changes::{Change, ChangeError},
        setup::vectors::Vectors,
    },
};

/// Where a simulation begins instead of at the start of its setup.
#[derive(Clone, Debug, PartialEq)]
pub struct Beginning {
    /// Steps taken before: wind, forces, pins and colliders of the setup are where they are then.
    pub step: u64,
    /// Positions (m) of all particles, in the user's numbering.
    pub positions: Vectors,
    /// Velocities (m/s), as many. Those of pins that rest count as 0.
    pub velocities: Vectors,
    /// The numbers of a [`Carried`](crate::world::Carried) that was told then; none: as if steps before had left nothing else.
    pub numbers: Option<Vec<f64>>,
}

/// Why a simulation cannot begin there.
#[derive(Clone, Debug, PartialEq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum BeginError {
    #[error("'{body}' is snow, and no frame holds how it is deformed: snow begins at the start of its scene")]
    Snow { body: String },
    #[error(
        "has {found} particles, and the scene has {needed} ({bodies}): a frame of the same scene is needed"
    )]
    Count { found: usize, needed: usize, bodies: String },
    #[error(transparent)]
    Change(#[from] ChangeError),
    #[error(transparent)]
    Carried(#[from] CarriedError),
}

impl<R: Real> World<R> {
    pub(crate) fn begin(&mut self, at: &Beginning) -> Result<(), BeginError> {
        if let Some((body, _)) = self.snow().and_then(|snow| snow.objects().next()) {
            return Err(BeginError::Snow { body: body.to_owned() });
        }
        let mut bodies: Vec<(String, Range<usize>)> =
            self.bodies.iter().filter_map(Body::as_cloth).flat_map(Cloth::ranges).collect();
        bodies.sort_by_key(|(_, own)| own.start);
        let needed = self.particle_count();
        for found in [at.positions.len(), at.velocities.len()] {
            if found != needed {
                let told: Vec<String> =
                    bodies.iter().map(|(body, own)| format!("{body} {}", own.len())).collect();
                return Err(BeginError::Count { found, needed, bodies: told.join(", ") });
            }
        }
        let state = |(body, own): &(String, Range<usize>)| Change::State {
            body: body.clone(),
            positions: at.positions.part(own.clone()),
            velocities: Some(at.velocities.part(own.clone())),
        };
        let states: Vec<Change> = bodies.iter().map(state).collect();
        self.rules.check_but_for_figures(&states)?;
        self.bodies.iter().filter_map(Body::as_cloth).try_for_each(|cloth| cloth.check_apart(&states))?;

        let dt = self.dt;
        for cloth in self.bodies.iter_mut().filter_map(Body::as_cloth_mut) {
            cloth.begin(at, dt);
        }
        (self.step_count, self.pace) = (at.step, Pace::default());
        if let Some(numbers) = &at.numbers {
            self.take_over(numbers)?;
        }
        Ok(())
    }
}

impl<R: Real> Cloth<R> {
    /// Its bodies, each with its particles among all.
    fn ranges(&self) -> impl Iterator<Item = (String, Range<usize>)> {
        self.parts.iter().map(|part| {
            let first = part.first_particle as usize;
            (part.name.clone(), first..first + part.count())
        })
    }

    /// Puts its bodies where they are then, with pins as far on their ways, in steps of the world of `dt` (s).
    fn begin(&mut self, at: &Beginning, dt: f64) {
        self.sort_pins();
        let motions = std::mem::take(&mut self.state.motions);
        let bodies: Vec<(String, Range<usize>)> = self.ranges().collect();
        for (body, own) in bodies {
            self.place(&body, &at.positions[own.clone()], Some(&at.velocities[own]));
        }

        let taken = at.step as f64 * self.substeps(dt);
        let Self { state, model, parts, .. } = self;
        state.motions = motions.into_iter().filter_map(|motion| motion.after(taken)).collect();
        // A body that is put somewhere has its pins at rest.
        for motion in &state.motions {
            let row = motion.particle as usize;
            let particle = parts.of_all(model.user[row]) as usize;
            state.v[row] = Padded::new(&vec3(at.velocities[particle]));
        }
        self.go_on_with_figures(&at.velocities);
        self.watch_anew();
    }
}

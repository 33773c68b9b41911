//! A book of the energy of snow: what it gains that nothing gave, over the steps of a run.
//!
//! Enters: sums over the particles after each step of the world, and what colliders and the medium by their motion, given forces
//! and hardening gave within it. Leaves: why the run ends, where more is owed than the method swings by (docs/laws/snow.md).

use serde::{Deserialize, Serialize};

use super::settings::{Integration, SnowSettings};
use crate::{math::array::dot, report::StepFailure};

/// Roundings of all that moves and is lifted by which a run may be above what it had.
const FLOOR: f64 = 64.0;
/// Share of the motion that semi-implicit steps may gain: they damp, and swing by nothing.
const SEMI_IMPLICIT: f64 = 0.1;

/// What particles add up to.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Entry {
    /// Kinetic energy, that of affine velocities too, and elastic energy (J).
    pub(super) moved: f64,
    /// Of all particles (kg).
    pub(super) mass: f64,
    /// Mass times velocity (kg m/s).
    pub(super) momentum: [f64; 3],
    /// Mass times position (kg m).
    pub(super) moment: [f64; 3],
    /// Gravitational energy of each particle without its sign (J).
    pub(super) lifted: f64,
}

impl Entry {
    /// Kinetic and elastic energy (J) as it is seen from what moves with a velocity (m/s).
    fn moved_from(&self, frame: [f64; 3]) -> f64 {
        self.moved - dot(frame, self.momentum) + 0.5 * self.mass * dot(frame, frame)
    }

    /// The same as it is seen from its own middle.
    fn inner(&self) -> f64 {
        self.moved_from(self.momentum.map(|c| c / self.mass))
    }

    /// Kinetic, elastic and gravitational energy (J), as a fall by steps of `dt` (s) keeps it: symplectic Euler keeps
    /// v² / 2 - g x + dt g v / 2 per mass.
    fn energy(&self, gravity: [f64; 3], dt: f64) -> f64 {
        self.moved - dot(gravity, self.moment) + 0.5 * dt * dot(gravity, self.momentum)
    }
}

/// What is known of the energy over a run: part of the state.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Book {
    /// After the last step; none where particles were changed since.
    last: Option<Entry>,
    /// What was gained and not lost again (J).
    owed: f64,
    /// The most that moved so far (J), less what was owed then.
    motion: f64,
    /// The longest step so far over the bound of elastic motion, 1 at most.
    ratio: f64,
}

/// What a step of the world tells the book.
#[derive(Clone, Copy, Debug)]
pub(super) struct Taken {
    pub(super) gravity: [f64; 3],
    /// Steps of the snow, and the length of the last (s).
    pub(super) substeps: u32,
    pub(super) dt: f64,
    /// What colliders and the medium by their motion, given forces and hardening gave (J).
    pub(super) given: f64,
    /// The velocity (m/s) of the surfaces that were touched, or of the whole where none was: what moves is seen from it.
    pub(super) frame: [f64; 3],
    /// Unit round-off of the state.
    pub(super) rounding: f64,
}

impl Book {
    /// Whether it knows the state that the next step starts from.
    pub(super) fn is_open(&self) -> bool {
        self.last.is_some()
    }

    /// Takes over the state that a step starts from.
    pub(super) fn open(&mut self, entry: Entry) {
        self.last = Some(entry);
        self.motion = self.motion.max(entry.inner() - self.owed);
    }

    /// Takes over that particles are changed by something else than a step.
    pub(super) fn close(&mut self) {
        self.last = None;
    }

    /// Takes over a step of the snow, by its length over the bound of elastic motion.
    pub(super) fn note(&mut self, ratio: f64) {
        self.ratio = self.ratio.max(ratio.min(1.0));
    }

    /// Takes over a step of the world, after which a particle is the fastest; says if more is owed than may be.
    pub(super) fn enter(
        &mut self,
        settings: &SnowSettings,
        entry: Entry,
        taken: &Taken,
        particle: u64,
    ) -> Result<(), StepFailure> {
        let Taken { gravity, substeps, dt, given, frame, rounding } = *taken;
        let Some(before) = self.last.replace(entry) else { return Ok(()) };
        if settings.time_step.is_unchecked() {
            return Ok(());
        }
        let gain = entry.energy(gravity, dt) - before.energy(gravity, dt) - given;
        let scale = entry.moved.max(before.moved) + entry.lifted;
        let gain = gain - f64::from(substeps) * rounding * scale;
        self.owed = (self.owed + gain).max(0.0);
        self.motion = self.motion.max(entry.moved_from(frame) - self.owed);

        let limit = self.share(settings) * self.motion + FLOOR * rounding * scale;
        if self.owed <= limit {
            return Ok(());
        }
        Err(StepFailure::EnergyGain { particle, value: self.owed, limit })
    }

    /// Share of the motion by which the energy may swing: of one mode symplectic Euler keeps v² + w² x² - y w x v,
    /// y = w dt, and the energy swings about a mean by s = y / 2 of it.
    fn share(&self, settings: &SnowSettings) -> f64 {
        match settings.integration {
            Integration::SemiImplicit { beta, .. } if beta > 0.0 => SEMI_IMPLICIT,
            _ => 2.0 * self.ratio / (1.0 + self.ratio),
        }
    }

    /// Whether it may be the book of a run.
    pub(super) fn is_sound(&self) -> bool {
        let Self { last, owed, motion, ratio } = self;
        let is_amount = |number: f64| number.is_finite() && number >= 0.0;
        let is_entry = |entry: &Entry| {
            let Entry { moved, mass, momentum, moment, lifted } = entry;
            let vectors = momentum.iter().chain(moment);
            mass.is_finite()
                && *mass > 0.0
                && [moved, lifted].into_iter().chain(vectors).all(|n| n.is_finite())
        };
        is_amount(*owed)
            && is_amount(*motion)
            && (0.0..=1.0).contains(ratio)
            && last.as_ref().is_none_or(is_entry)
    }

    /// Its numbers for a hash of the state, where it owes something.
    pub(super) fn numbers(&self) -> Option<[f64; 3]> {
        (self.owed > 0.0).then_some([self.owed, self.motion, self.ratio])
    }
}

#[cfg(test)]
mod tests {
    use super::{Book, Entry, Taken};
    use crate::{report::StepFailure, snow::settings::SnowSettings, time_step::TimeStep};

    const GRAVITY: [f64; 3] = [0.0, -10.0, 0.0];

    /// A mass of 2 kg at a height (m) with a speed upwards (m/s) and elastic energy (J).
    fn sums(height: f64, speed: f64, elastic_energy: f64) -> Entry {
        Entry {
            moved: speed * speed + elastic_energy,
            mass: 2.0,
            momentum: [0.0, 2.0 * speed, 0.0],
            moment: [0.0, 2.0 * height, 0.0],
            lifted: (20.0 * height).abs(),
        }
    }

    fn step(book: &mut Book, settings: &SnowSettings, after: Entry, given: f64) -> Result<(), StepFailure> {
        let rounding = f64::from(f32::EPSILON);
        let taken = Taken { gravity: GRAVITY, substeps: 1, dt: 1e-3, given, frame: [0.0; 3], rounding };
        book.enter(settings, after, &taken, 0)
    }

    /// A book that knows a state, of steps of half the bound: 2/3 of the motion may be gained.
    fn opened(sums: Entry) -> Book {
        let mut book = Book::default();
        book.open(sums);
        book.note(0.5);
        book
    }

    #[test]
    fn a_book_that_no_run_has_is_known() {
        let sound = opened(sums(0.5, 1.0, 0.0));
        assert!(sound.is_sound() && Book::default().is_sound());
        for wrong in [
            Book { owed: -1.0, ..sound },
            Book { motion: f64::NAN, ..sound },
            Book { ratio: 1.5, ..sound },
            Book { last: Some(Entry { mass: 0.0, ..sums(0.5, 1.0, 0.0) }), ..sound },
            Book { last: Some(Entry { moment: [0.0, f64::INFINITY, 0.0], ..sums(0.5, 1.0, 0.0) }), ..sound },
        ] {
            assert!(!wrong.is_sound(), "{wrong:?}");
        }
    }

    #[test]
    fn what_falls_and_what_is_thrown_owes_nothing() {
        let settings = SnowSettings::new(0.1);
        for start in [0.0, 3.0] {
            let (mut height, mut speed) = (0.5, start);
            let mut book = opened(sums(height, speed, 0.0));
            for _ in 0..600 {
                speed -= 1e-3 * 10.0;
                height += 1e-3 * speed;
                step(&mut book, &settings, sums(height, speed, 0.0), 0.0).expect("a fall");
                assert!(book.owed < 1e-9, "{book:?}");
            }
        }
    }

    #[test]
    fn what_rises_without_a_source_is_owed_until_it_is_lost_and_ends_the_run_above_the_swing() {
        let settings = SnowSettings::new(0.1);
        let mut book = opened(sums(0.0, 1.0, 0.0));
        for elastic in [0.3, 0.1, 0.6, 0.0, 0.64] {
            step(&mut book, &settings, sums(0.0, 1.0, elastic), 0.0).expect("a swing");
        }
        let failure =
            step(&mut book, &settings, sums(0.0, 1.0, 0.7), 0.0).expect_err("more than it swings by");
        let StepFailure::EnergyGain { value, limit, .. } = failure else { panic!("{failure}") };
        assert!((value - 0.7).abs() < 1e-6 && (limit - 2.0 / 3.0).abs() < 2e-5, "{value} J, {limit} J");

        // The same without end, by little each time: the motion that was there counts, not what was gained.
        let mut book = opened(sums(0.0, 1.0, 0.0));
        let ended = (1..1000)
            .find(|n| step(&mut book, &settings, sums(0.0, 1.0, 1e-2 * f64::from(*n)), 0.0).is_err());
        assert!(ended.is_some_and(|n| (60..80).contains(&n)), "{ended:?}");
    }

    #[test]
    fn what_was_given_is_not_owed_and_unchecked_steps_are_not_judged() {
        let mut settings = SnowSettings::new(0.1);
        let mut book = opened(sums(0.0, 1.0, 0.0));
        step(&mut book, &settings, sums(0.0, 3.0, 0.0), 8.0).expect("it was given");
        assert!(step(&mut book.clone(), &settings, sums(0.0, 5.0, 0.0), 0.0).is_err(), "it was not");
        settings.time_step = TimeStep::Unchecked(1e-3);
        step(&mut book, &settings, sums(0.0, 5.0, 0.0), 0.0).expect("nobody asks");
    }
}

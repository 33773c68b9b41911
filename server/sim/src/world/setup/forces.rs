//! Forces on the particles of a body: those of the scene, each for a time, and those that calls set, until others do.

use std::sync::Arc;

use serde::{Deserialize, Serialize};

/// What share of a step is nothing.
const ROUNDING: f64 = 1e-9;

/// A force of a scene.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct TimedForce {
    /// Particles on which it acts, in the user's numbering of the body, each once.
    pub particles: Vec<u32>,
    /// The force on each of them (N).
    pub force: [f64; 3],
    /// When it begins to act (s).
    pub from: f64,
    /// When it ends to (s): infinite if it does not.
    pub until: f64,
}

impl TimedForce {
    /// Which share of a step from `start` (s) on, of `dt` (s), it acts.
    fn share(&self, start: f64, dt: f64) -> f64 {
        let (from, until) = ((self.from - start) / dt, (self.until - start) / dt);
        let share = until.min(1.0) - from.max(0.0);
        // Times of whole steps are not exact.
        if share < ROUNDING {
            0.0
        } else if share > 1.0 - ROUNDING {
            1.0
        } else {
            share
        }
    }

    /// The same in a numbering in which the body begins with particle `first`.
    pub(crate) fn moved(&self, first: u32) -> Self {
        let particles = self.particles.iter().map(|particle| first + particle).collect();
        Self { particles, ..*self }
    }

    /// What is wrong with it, on a body of so many particles, as a sentence.
    pub(crate) fn invalid(&self, count: usize, is_pinned: impl Fn(u32) -> bool) -> Option<String> {
        let Self { particles, force, from, until } = self;
        if force.iter().any(|c| !c.is_finite()) || !from.is_finite() {
            return Some(format!("the force {force:?} N from {from} s on is not finite"));
        }
        if until.is_nan() || until <= from {
            return Some(format!(
                "a force acts from {from} s until {until} s: a time after {from} s is needed"
            ));
        }
        if let Some(beyond) = particles.iter().find(|particle| **particle as usize >= count) {
            return Some(format!("a force acts on particle {beyond}: there are {count}, from 0"));
        }
        let pinned = particles.iter().find(|particle| is_pinned(**particle))?;
        Some(format!("a force acts on particle {pinned}, which is pinned"))
    }
}

/// Forces that a call sets.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Forces {
    /// The same on each (N).
    One([f64; 3]),
    /// One for each (N).
    Each(Arc<[[f64; 3]]>),
}

impl Forces {
    /// The force on the particle at a place of the list (N).
    pub(crate) fn at(&self, place: usize) -> [f64; 3] {
        match self {
            Self::One(force) => *force,
            Self::Each(forces) => forces[place],
        }
    }

    /// All of them.
    pub(crate) fn all(&self) -> &[[f64; 3]] {
        match self {
            Self::One(force) => std::slice::from_ref(force),
            Self::Each(forces) => forces,
        }
    }
}

/// Forces that calls have set on a body, as a call would set them again.
#[derive(Clone, Debug, PartialEq)]
pub struct CalledForces {
    /// Name of the cloth, or of the object of snow.
    pub body: String,
    /// The particles that feel one, in the user's numbering of the body; none where all that are free feel the same.
    pub particles: Vec<u32>,
    /// The forces on them (N); none where they are too many to be listed.
    pub forces: Option<Forces>,
}

impl CalledForces {
    /// Those of a body, which are given (N) for each of its particles; none where nothing acts on it. So many particles as
    /// are `left` may be listed.
    pub(crate) fn of(
        body: &str,
        called: &[[f64; 3]],
        is_pinned: impl Fn(usize) -> bool,
        left: &mut usize,
    ) -> Option<Self> {
        let first = *called.iter().find(|force| **force != [0.0; 3])?;
        let body = body.to_owned();
        let is_like_first = |(at, force): (usize, &[f64; 3])| *force == first || is_pinned(at);
        if called.iter().enumerate().all(is_like_first) {
            return Some(Self { body, particles: Vec::new(), forces: Some(Forces::One(first)) });
        }

        let acting = || called.iter().enumerate().filter(|(_, force)| **force != [0.0; 3]);
        let Some(rest) = left.checked_sub(acting().count()) else {
            return Some(Self { body, particles: Vec::new(), forces: None });
        };
        *left = rest;
        let particles = acting().map(|(at, _)| at as u32).collect();
        let forces = if acting().all(|(_, force)| *force == first) {
            Forces::One(first)
        } else {
            Forces::Each(acting().map(|(_, force)| *force).collect())
        };
        Some(Self { body, particles, forces: Some(forces) })
    }
}

/// What acts on a cloth, by the particles of its user's numbering.
#[derive(Clone, Debug, Default)]
pub(crate) struct Acting {
    timed: Arc<[TimedForce]>,
    /// What calls have set (N), of each particle; none where that is 0 for all.
    called: Vec<[f64; 3]>,
    /// Whether what calls have set was taken over by a step.
    is_known: bool,
}

impl Acting {
    /// With the forces of a scene.
    pub(crate) fn new(timed: &[TimedForce]) -> Self {
        Self { timed: timed.into(), called: Vec::new(), is_known: timed.is_empty() }
    }

    /// Takes over what a call sets (N) on particles, of so many. Those that are pinned stay without.
    pub(crate) fn set(
        &mut self,
        forces: impl Iterator<Item = (u32, [f64; 3])>,
        count: usize,
        is_pinned: impl Fn(u32) -> bool,
    ) {
        self.called.resize(count, [0.0; 3]);
        for (particle, force) in forces {
            self.called[particle as usize] = if is_pinned(particle) { [0.0; 3] } else { force };
        }
        if self.called.iter().all(|force| *force == [0.0; 3]) {
            self.called = Vec::new();
        }
        self.is_known = false;
    }

    /// What calls have set (N), of each particle, or none.
    pub(crate) fn called(&self) -> &[[f64; 3]] {
        &self.called
    }

    /// Lets the next step take everything over again.
    pub(crate) fn renew(&mut self) {
        self.is_known = false;
    }

    /// Puts what calls have set.
    pub(crate) fn put(&mut self, called: Vec<[f64; 3]>) {
        (self.called, self.is_known) = (called, false);
    }

    /// Whether timed forces in a step from `start` (s) on, of `dt` (s), are others than in the step before it.
    pub(crate) fn has_changed(&self, start: f64, dt: f64) -> bool {
        self.timed.iter().any(|timed| timed.share(start, dt) != timed.share(start - dt, dt))
    }

    /// Whether the step has to take the forces over: they changed, or are not known.
    pub(crate) fn is_new(&mut self, start: f64, dt: f64) -> bool {
        !std::mem::replace(&mut self.is_known, true) || self.has_changed(start, dt)
    }

    /// Particles with the forces (N) in that step, some more than once.
    pub(crate) fn now(&self, start: f64, dt: f64) -> impl Iterator<Item = (u32, [f64; 3])> {
        let timed = self.timed.iter().map(move |timed| (timed, timed.share(start, dt)));
        let timed = timed.filter(|(_, share)| *share > 0.0).flat_map(|(timed, share)| {
            let force = timed.force.map(|c| c * share);
            timed.particles.iter().map(move |particle| (*particle, force))
        });
        let called = self.called.iter().enumerate().filter(|(_, force)| **force != [0.0; 3]);
        timed.chain(called.map(|(particle, force)| (particle as u32, *force)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_force_acts_for_its_share_of_a_step_and_calls_add_to_it() {
        let timed = TimedForce { particles: vec![1, 2], force: [4.0, 0.0, 0.0], from: 0.15, until: 0.3 };
        let mut acting = Acting::new(&[timed]);
        assert!(acting.is_new(0.0, 0.1) && acting.now(0.0, 0.1).next().is_none());
        assert!(acting.is_new(0.1, 0.1) && acting.has_changed(0.1, 0.1));
        let found: Vec<_> = acting.now(0.1, 0.1).collect();
        assert_eq!(found.len(), 2);
        assert!((found[0].1[0] - 2.0).abs() < 1e-12 && found[1].0 == 2, "{found:?}");
        assert!(acting.is_new(0.2, 0.1));
        let upwards = [0, 2].map(|particle| (particle, [0.0, 1.0, 0.0]));
        acting.set(upwards.into_iter(), 3, |particle| particle == 0);
        assert!(acting.is_new(0.2, 0.1));
        let found: Vec<_> = acting.now(0.2, 0.1).collect();
        assert_eq!(found, [(1, [4.0, 0.0, 0.0]), (2, [4.0, 0.0, 0.0]), (2, [0.0, 1.0, 0.0])]);
        acting.set((0..3).map(|particle| (particle, [0.0; 3])), 3, |_| false);
        assert!(acting.called().is_empty() && acting.is_new(0.3, 0.1));
        assert!(acting.now(0.3, 0.1).next().is_none());
        assert!(!acting.is_new(0.4, 0.1) && !acting.has_changed(0.4, 0.1));
    }

    #[test]
    fn what_calls_have_set_is_told_as_one_call_would_set_it() {
        let [none, up, back] = [[0.0; 3], [0.0, 1.0, 0.0], [0.0, 0.0, -2.0]];
        let told = |called: &[[f64; 3]], left: &mut usize| {
            CalledForces::of("sheet", called, |particle| particle == 2, left)
        };
        let forces = |particles: &[u32], forces| {
            Some(CalledForces { body: "sheet".to_owned(), particles: particles.to_vec(), forces })
        };
        let mut left = 4;
        assert_eq!(told(&[], &mut left), None);
        assert_eq!(told(&[none; 4], &mut left), None);
        // Particle 2 is pinned.
        assert_eq!(told(&[up, up, none, up], &mut left), forces(&[], Some(Forces::One(up))));
        assert_eq!(left, 4, "no particle was listed");
        assert_eq!(told(&[none, up, none, up], &mut left), forces(&[1, 3], Some(Forces::One(up))));
        let each = Some(Forces::Each([up, back].into()));
        assert_eq!(told(&[up, back, none, none], &mut left), forces(&[0, 1], each));
        assert_eq!(left, 0);
        assert_eq!(told(&[none, up, none, none], &mut left), forces(&[], None));
        assert_eq!(told(&[back, back, none, back], &mut left), forces(&[], Some(Forces::One(back))));
    }
}

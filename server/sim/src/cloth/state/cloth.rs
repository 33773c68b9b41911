//! The state of a cloth, what a checkpoint saves.

use serde::{Deserialize, Serialize};

use std::sync::Arc;

use super::{gain::Gain, kept::Kept};
use crate::{
    math::{LANES, Padded, Real, Sixteen, Vec3, bytes, vec3},
    parallel::{Share, hash_numbers, size},
};

/// States that a cloth keeps: the present one, that before its step, and one that is tried.
const STATES: usize = 3;

/// A pinned particle on its way from point to point.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PinMotion {
    /// The particle, in the model's numbering.
    pub particle: u32,
    /// Where it goes one after the other; at least one. Shared, so that a step copies none of them.
    pub points: Arc<[PathPoint]>,
    /// Index of the point that it goes to now.
    pub next: usize,
    /// Sub-steps until it arrives there: those that the scene asks for, of which rejected ones are parts.
    pub steps_left: f64,
}

/// Where a pin goes, and how long it takes from the point before.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PathPoint {
    /// Where it arrives (m).
    pub target: [f64; 3],
    /// Sub-steps that it takes, 1 or more: those that the scene asks for.
    pub steps: u64,
}

impl PinMotion {
    /// Takes a pin along points, from where it is.
    pub(crate) fn along(particle: u32, points: Arc<[PathPoint]>) -> Self {
        let steps_left = points[0].steps as f64;
        Self { particle, points, next: 0, steps_left }
    }

    /// Memory of it (bytes): its points once, and itself in the lists of every state that is kept, which grow by doubling.
    pub(crate) fn bytes(&self) -> usize {
        2 * STATES * size_of::<Self>() + size_of_val(&*self.points)
    }

    /// What is left of it after so many sub-steps of those that the scene asks for, a whole number; none if it has arrived.
    pub(crate) fn after(mut self, mut steps: f64) -> Option<Self> {
        while steps >= self.steps_left {
            steps -= self.steps_left;
            self.next += 1;
            self.steps_left = self.points.get(self.next)?.steps as f64;
        }
        self.steps_left -= steps;
        Some(self)
    }

    /// Hash of what is left of it, a link per point.
    pub(crate) fn hash(&self, seed: u64) -> u64 {
        let start = hash_numbers(seed, [self.steps_left]);
        self.points[self.next..].iter().fold(start, |hash, PathPoint { target: [x, y, z], steps }| {
            hash_numbers(hash, [*x, *y, *z, *steps as f64])
        })
    }
}

/// The start of the sub-step before, and how long that was.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct Past<R: Real> {
    /// Positions (m) and velocities (m/s), as those of the state.
    #[serde(with = "bytes")]
    pub x: Vec<Padded<R>>,
    /// Velocities then (m/s); as many.
    #[serde(with = "bytes")]
    pub v: Vec<Padded<R>>,
    /// Length of the sub-step (s); 0 where there is none that the next one may go on from.
    pub dt: f64,
}

impl<R: Real> Past<R> {
    fn size_for(&mut self, count: usize) {
        size(&mut self.x, count);
        size(&mut self.v, count);
    }
}

/// What changes from step to step.
#[derive(Clone, Debug, PartialEq, Default, Serialize, Deserialize)]
#[serde(bound = "")]
pub struct State<R: Real> {
    /// Positions (m), in the model's numbering: a multiple of sixteen, 0 beyond the last particle, as all fields.
    #[serde(with = "bytes")]
    pub x: Vec<Padded<R>>,
    /// Velocities (m/s), in the model's numbering.
    #[serde(with = "bytes")]
    pub v: Vec<Padded<R>>,
    /// Change of velocity of the step before (m/s), where a step solves for it: a warm start begins there.
    #[serde(with = "bytes")]
    pub dv: Vec<Sixteen<R>>,
    /// Pins on their way, in the order of their particles.
    pub motions: Vec<PinMotion>,
    /// When the frames of figures began (s): 0, or at the last reset.
    pub(crate) led_since: f64,
    /// For integrators that know of the step before.
    pub past: Past<R>,
    /// What explicit steps gained.
    pub(crate) gain: Gain,
    /// Solves since one came to its cap and went on with patches, that one counted; 0 where none did.
    pub(crate) since_cap: u32,
    /// What patches are set up for that the next solves may go on with.
    pub(crate) kept: Kept<R>,
}

impl<R: Real> State<R> {
    /// Makes room for what a step from `other` leads to, and takes over what it does not write.
    pub(crate) fn succeed(&mut self, other: &Self) {
        size(&mut self.x, other.x.len());
        size(&mut self.v, other.v.len());
        size(&mut self.dv, other.dv.len());
        self.motions.clone_from(&other.motions);
        self.led_since = other.led_since;
        self.gain = other.gain;
        self.since_cap = other.since_cap;
        self.kept.follow(&other.kept);
    }

    /// Completes its fields on rank 0.
    pub(crate) fn gather(&mut self, share: &Share) {
        let Past { x, v, dt } = &mut self.past;
        let past = if *dt > 0.0 { vec![x, v] } else { Vec::new() };
        for field in [&mut self.x, &mut self.v].into_iter().chain(past) {
            share.gather_field(field);
        }
        let lanes = |dv: &Sixteen<R>| std::array::from_fn::<_, LANES, _>(|lane| Padded::new(&dv.get(lane)));
        let mut dv: Vec<Padded<R>> = self.dv.iter().flat_map(lanes).collect();
        share.gather_field(&mut dv);
        for (sixteen, vectors) in self.dv.iter_mut().zip(dv.chunks_exact(LANES)) {
            vectors.iter().enumerate().for_each(|(lane, vector)| sixteen.set(lane, vector.vector()));
        }
    }

    /// Makes room for a past.
    pub(crate) fn size_past(&mut self) {
        self.past.size_for(self.x.len());
    }

    /// Gives moving pins the velocity that brings them to their targets in the steps left, of `dt` (s) each, or at the
    /// end of this one, which is a `part` of such a step; says whether any velocity changed.
    pub(crate) fn aim_pins(&mut self, share: &Share, dt: f64, part: f64) -> bool {
        let has_changed = self.look_at_pins(share, dt, part);
        self.motions.iter_mut().for_each(|motion| motion.steps_left -= part);
        has_changed
    }

    /// Gives rows that frames lead the velocity that brings them in `dt` (s) to where they are to be then (m).
    pub(crate) fn lead(&mut self, corners: impl Iterator<Item = (usize, [f64; 3])>, dt: f64) {
        for (row, place) in corners {
            // What stands there, as numbers of the state have it, stays.
            let to: Vec3<R> = vec3(place);
            let way = to.map(R::to_f64) - self.x[row].vector().map(R::to_f64);
            self.v[row] = Padded::new(&(way / dt).map(R::of));
        }
    }

    /// Gives pins the velocity with which they begin the next sub-step, of which the length is not known yet; says whether that
    /// changes any.
    pub(crate) fn look_ahead(&mut self, share: &Share, dt: f64) -> bool {
        self.look_at_pins(share, dt, 0.0)
    }

    fn look_at_pins(&mut self, share: &Share, dt: f64, part: f64) -> bool {
        if self.motions.is_empty() {
            return false;
        }
        let mut has_changed = false;
        for motion in &self.motions {
            let (i, left) = (motion.particle as usize, motion.steps_left);
            // Where others are is known to who computes them.
            if !share.has(i) {
                continue;
            }
            let target = motion.points[motion.next].target;
            let way = vec3::<f64>(target) - self.x[i].vector().map(R::to_f64);
            let v: Vec3<R> = (way / (left.max(part) * dt)).map(R::of);

            let v = Padded::new(&v);
            has_changed |= v != self.v[i];
            self.v[i] = v;
        }
        let mut has_any = false;
        share.tell([f64::from(u8::from(has_changed))], |[of_rank]| has_any |= of_rank > 0.0);
        has_any
    }

    /// Sends pins that stand at a point to the next one, and forgets those that stand at their last; says whether any
    /// stands.
    pub(crate) fn rest_pins(&mut self) -> bool {
        let (v, mut stands) = (&mut self.v, false);
        self.motions.retain_mut(|motion| {
            // Parts of a step add up to it but for rounding.
            if motion.steps_left > 1e-6 {
                return true;
            }
            stands = true;

            // It stands at every point, so that a path has the bits of its moves made one by one.
            v[motion.particle as usize] = Padded::default();
            motion.next += 1;
            let next = motion.points.get(motion.next);
            motion.steps_left = next.map_or(0.0, |point| point.steps as f64);
            next.is_some()
        });
        stands
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pin_is_as_far_on_its_way_as_after_its_steps() {
        let point = |x: f64, steps: u64| PathPoint { target: [x, 0.0, 0.0], steps };
        let motion = PinMotion::along(3, [point(1.0, 4), point(2.0, 1), point(3.0, 6)].into());
        let after = |steps: f64| motion.clone().after(steps).map(|left| (left.next, left.steps_left));
        assert_eq!([0.0, 3.0, 4.0].map(after), [Some((0, 4.0)), Some((0, 1.0)), Some((1, 1.0))]);
        assert_eq!([5.0, 10.0, 11.0].map(after), [Some((2, 6.0)), Some((2, 1.0)), None]);
        assert_eq!(after(1e12), None);
    }
}

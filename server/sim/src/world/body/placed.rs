//! What calls do to a cloth beside its parameters: ways of pins, forces on particles, pulls, another state, its start again.

use super::cloth::Cloth;
use crate::{
    cloth::{PathPoint, PinMotion, State},
    math::{Padded, Real, Sixteen, Vec3, vec3},
    world::setup::{
        forces::{CalledForces, Forces},
        pulls::Pull,
    },
};

impl<R: Real> Cloth<R> {
    /// Sends a pinned particle through `points`, each a time from now (s), growing, and a position (m); `dt` is the
    /// world's (s). It takes a step of the world to the first at least, and a sub-step to each other.
    pub(crate) fn send_pin(&mut self, particle: u32, points: impl Iterator<Item = (f64, [f64; 3])>, dt: f64) {
        let particle = self.model.place[particle as usize];
        let substeps = self.substeps(dt);
        let dt = dt / substeps;
        let (mut taken, mut least) = (0, substeps as u64);
        let points = points.map(|(time, target)| {
            // A time of a whole number of steps stays one when the quotient is rounded.
            let arrival = ((time / dt - 1e-9).ceil() as u64).max(taken + least);
            let steps = arrival - taken;
            (taken, least) = (arrival, 1);
            PathPoint { target, steps }
        });
        self.sent.push(PinMotion::along(particle, points.collect()));
    }

    /// Sets forces on particles of the body of that name, if it is one of its own; on all free ones where there are none.
    pub(crate) fn set_forces(&mut self, name: &str, particles: &[u32], forces: &Forces) {
        let Self { acting, model, parts, .. } = self;
        let Some(part) = parts.named(name) else { return };
        let is_pinned = |own: u32| model.inv_m[model.place[own as usize] as usize] == R::zero();
        if particles.is_empty() {
            let all = part.own.clone().enumerate();
            acting.set(all.map(|(place, own)| (own, forces.at(place))), model.count, is_pinned);
        } else {
            let listed = particles.iter().enumerate();
            let first = part.own.start;
            acting.set(listed.map(|(place, at)| (first + at, forces.at(place))), model.count, is_pinned);
        }
    }

    /// Pulls at particles of a body, if it is one of its own, in steps of the world of `dt` (s), or no longer. A step goes on
    /// from the one before it unless a pull begins or ends.
    pub(crate) fn set_pulls(&mut self, asked: &Pull, dt: f64) {
        let Self { acting, pulls, model, parts, .. } = self;
        let Some(part) = parts.named(&asked.body) else { return };
        let is_pinned = |own: u32| model.inv_m[model.place[own as usize] as usize] == R::zero();
        if pulls.set(asked, &part.own, dt, is_pinned) {
            acting.renew();
            self.forget_past();
        }
    }

    /// Counts a step of the world that was taken: pulls end with it.
    pub(crate) fn pass_pulls(&mut self) {
        if self.pulls.pass() {
            self.acting.renew();
            self.forget_past();
        }
    }

    /// Adds the forces that calls have set on its bodies, each with its first particle; so many particles as are `left` are listed.
    pub(crate) fn called_forces(&self, left: &mut usize, out: &mut Vec<(u32, CalledForces)>) {
        let called = self.acting.called();
        if called.is_empty() {
            return;
        }
        for part in self.parts.iter() {
            let first = part.own.start;
            let own = &called[first as usize..part.own.end as usize];
            let is_pinned = |at: usize| self.is_pinned(first + at as u32);
            let told = CalledForces::of(&part.name, own, is_pinned, left);
            out.extend(told.map(|told| (part.first_particle, told)));
        }
    }

    /// Takes over the forces in a step of the world from a time (s) on, of `dt` (s), where they are others than before: those of
    /// pulls always are.
    pub(crate) fn renew_forces(&mut self, time: f64, dt: f64) {
        let is_new = self.acting.is_new(time, dt);
        if !is_new && self.pulls.is_empty() {
            return;
        }
        let Self { acting, pulls, model, state, memory, .. } = self;
        pulls.renew(model, state);
        memory.set_forces(model, acting.now(time, dt).chain(pulls.now()));
        // Changes of calls have done so.
        if self.acting.has_changed(time, dt) {
            self.forget_past();
        }
    }

    /// Puts the particles of the body of that name, if it is one of its own, elsewhere (m), with these velocities (m/s). Its pins
    /// stand; those of others go on.
    pub(crate) fn place(&mut self, name: &str, positions: &[[f64; 3]], velocities: Option<&[[f64; 3]]>) {
        let Self { parts, model, state, sent, memory, .. } = self;
        let Some(part) = parts.named(name) else { return };
        let State { mut x, mut v, mut motions, mut dv, gain, led_since, .. } = std::mem::take(state);
        let mut others = State::default();
        for (place, own) in part.own.clone().enumerate() {
            let row = model.place[own as usize] as usize;
            x[row] = Padded::new(&vec3(positions[place]));
            let velocity = velocities.map_or([0.0; 3], |velocities| velocities[place]);
            let is_pinned = model.inv_m[row] == R::zero();
            v[row] = Padded::new(&vec3(if is_pinned { [0.0; 3] } else { velocity }));
            if let Some(dv) = dv.get_mut(row / Sixteen::<R>::LANES) {
                dv.set(row % Sixteen::<R>::LANES, Vec3::zeros());
            }
        }
        let goes_on = |motion: &PinMotion| !part.own.contains(&model.user[motion.particle as usize]);
        motions.retain(goes_on);
        sent.retain(goes_on);
        // What solves and contacts left of other bodies stays.
        if parts.iter().nth(1).is_some() {
            (others.dv, others.gain) = (dv, gain);
        }
        *state = State { x, v, motions, led_since, ..others };
        memory.forget();
    }

    /// Puts it back to its start.
    pub(crate) fn reset(&mut self) {
        let start = self.start.clone();
        let ([x, v], parameters) = &*start;
        self.parameters.clone_from(parameters);
        self.acting.put(Vec::new());
        self.pulls.put(Vec::new());
        self.state = State { x: x.clone(), v: v.clone(), ..State::default() };
        self.sent.clear();
        self.still_pins();
        self.watch_anew();
        self.memory.forget();
    }
}

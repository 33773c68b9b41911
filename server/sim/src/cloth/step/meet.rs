//! A sub-step of one cloth that meets colliders, and how it is judged once it has.
//!
//! What colliders give is known: in the frame of its surface a contact gives nothing, so that one with a surface that moves gives
//! the impulse times the velocity of the surface.

use super::{attempt::Attempt, memory::StepMemory, stepping::Stepping};
use crate::{
    cloth::{
        evaluate::{Allowance, Common, Judged, Led, kinetic_of, sums},
        judge::{most_owed, risen_most},
        settings::{Integrator, OnPass, Purpose},
        state::State,
    },
    collide::{Contacts, Met, Passed, resolve},
    math::{Real, Vec3},
    report::{Stage, StepFailure, Stopwatch},
};

impl<R: Real> Stepping<'_, R> {
    /// Lets what was tried meet colliders, and judges what contacts made of it.
    pub(super) fn meet(&mut self, watch: &mut dyn Stopwatch) -> Result<(), StepFailure> {
        if !self.settings.integrator.is_implicit() {
            self.look_at_parts();
        }
        let met = self.touch(watch)?;
        self.memory.attempt.start.impulse = met.carried.impulse;
        if self.settings.integrator == Integrator::SymplecticEuler && self.model.parts.all().len() > 1 {
            self.memory.attempt.start.fall = self.fall();
        }
        let parts = self.model.parts.all();
        if !self.settings.integrator.is_implicit() && met.touched > 0 && parts.len() > 1 {
            self.sum_parts();
            let Attempt { common, of_parts, .. } = &mut self.memory.attempt;
            common.touch(parts, &of_parts.sums, Vec3::from(met.carried.velocity()));
        }
        // What bounces add, because a method's velocities are not those of its way, the method takes in flight.
        let given = met.swing + met.carried.work;
        let surfaces = Vec3::from(met.carried.velocity());
        let StepMemory { attempt, evaluated, .. } = &mut *self.memory;
        // What comes to rest on a surface does not lose what the medium takes of its fall on to it.
        let back = -evaluated.numbers.sub_step.dt * attempt.common.slowed(surfaces);
        attempt.met = met;
        attempt.start.own += given;
        if let Some(allowed) = attempt.allowed.as_mut().filter(|_| met.touched > 0) {
            let given = given + allowed.at_rest + back;
            allowed.limit += given;
            allowed.given += given;
        }
        attempt.judged = match attempt.allowed {
            Some(allowed) if allowed.judged == Judged::No => Judged::No,
            Some(allowed) if met.touched == 0 => allowed.owes.into(),
            _ => (met.touched == 0 || met.inside == 0).into(),
        };
        let is_told = attempt.judged == Judged::Yes && met.touched > 0;
        match attempt.allowed {
            Some(allowed) if is_told => self.judge_contacts(&allowed, watch),
            _ => Ok(()),
        }
    }

    /// Takes over what parts do as a whole in an explicit sub-step, where that does not follow from the momentum of all.
    fn look_at_parts(&mut self) {
        let Self { model, .. } = *self;
        self.memory.attempt.common.clear();
        if Common::is_any(model, self.state) && !model.is_loose() {
            self.sum_parts();
            let Attempt { common, of_parts, .. } = &mut self.memory.attempt;
            common.set_explicit(model, &of_parts.sums);
        }
    }

    /// What symplectic Euler makes of the fall of several parts that no pin holds (J): each is moved by its velocity at the end of the
    /// sub-step in place of the mean, - h g.(P' - P) / 2.
    fn fall(&self) -> f64 {
        let Attempt { common, of_parts, .. } = &self.memory.attempt;
        let numbers = &self.memory.evaluated.numbers;
        let (gravity, h) = (numbers.gravity.map(R::to_f64), numbers.sub_step.dt);
        let loose = self.model.parts.all().iter().zip(&of_parts.sums).zip(&common.momenta);
        let loose = loose.filter(|((part, _), _)| !part.is_held);
        let gained: Vec3<f64> = loose.map(|((_, sums), momentum)| momentum - sums.before()).sum();
        -0.5 * h * gravity.dot(&gained)
    }

    /// Adds up the rows of each part, from the state to where it leads so far.
    fn sum_parts(&mut self) {
        let StepMemory { turns, evaluated, attempt, .. } = &mut *self.memory;
        let (led, of_parts) = (Led::To(&turns.next.v), &mut attempt.of_parts);
        sums(self.model, &evaluated.numbers, self.state, led, of_parts);
    }

    /// Refuses what contacts made of a sub-step, if more is owed for their energy after it than may be.
    fn judge_contacts(&mut self, allowed: &Allowance, watch: &mut dyn Stopwatch) -> Result<(), StepFailure> {
        let Self { model, settings, .. } = *self;
        let mut parts = model.parts.all();
        if parts.len() > 1 {
            self.sum_parts();
        }
        let StepMemory { turns, evaluated, contact, attempt, .. } = &mut *self.memory;
        evaluated.evaluate(model, Purpose::of(settings), &mut turns.next);
        watch.lap(Stage::Force);
        let Attempt { start, common, of_parts, met, .. } = attempt;
        if model.thick_surface().is_some() {
            let groups = &contact.groups;
            of_parts.join(groups.of_part(), groups.all.len());
        }
        let mut sums = &of_parts.sums;
        if model.thick_surface().is_some() {
            (parts, sums) = (&contact.groups.all, &of_parts.of_groups);
        }
        let most = most_owed(allowed, (parts, sums, common), Vec3::from(met.carried.velocity()));
        let value = evaluated.evaluation.total.energy() - start.energy;
        let limit = allowed.limit + (most - self.state.gain.energy).max(0.0);
        if value > limit {
            let particle = risen_most(model, &evaluated.numbers, [&*self.state, &turns.next]);
            return Err(StepFailure::EnergyGain { particle, value, limit });
        }
        Ok(())
    }

    /// Of an explicit sub-step that was taken: the mean velocity (m/s) of the pins, and the greatest energy (J) that moved and was stretched at
    /// its start and its end, without what parts do as a whole. What touched a surface is seen from it.
    pub(super) fn moved(&self) -> (Vec3<f64>, f64) {
        let Attempt { start, common, met, .. } = &self.memory.attempt;
        let totals = [&start.total, &self.memory.evaluated.evaluation.total];
        let is_touched = met.touched > 0;
        let whole = match self.model.parts.all() {
            [part] => totals.map(|total| {
                let momentum = Vec3::from(total.momentum);
                let own = if part.is_held { common.pins } else { momentum / part.mass };
                let surfaces = Vec3::from(met.carried.velocity());
                kinetic_of(part, momentum, if is_touched { surfaces } else { own })
            }),
            _ => common.kinetic,
        };
        let [first, last] = [0, 1].map(|i| totals[i].moved() - whole[i]);
        (common.pins, if is_touched { first.max(last) } else { last })
    }

    /// Lets what was tried meet colliders.
    fn touch(&mut self, watch: &mut dyn Stopwatch) -> Result<Met, StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let StepMemory { turns, evaluated, contact, attempt, .. } = &mut *self.memory;
        let Attempt { tried, contacts: kept, .. } = attempt;
        let colliders = around.colliders;
        // What keeps surfaces apart has met them in its last round.
        let met = contact.take(&mut turns.next).unwrap_or_else(|| {
            let (sub_step, share, user) = (evaluated.numbers.sub_step, &model.share, &model.user);
            let State { x, v, past, .. } = &mut turns.next;
            let past = (past.dt > 0.0).then_some([&mut past.x[..], &mut past.v[..]]);
            let from = [&self.state.x[..], &self.state.v[..]];
            let contacts = Contacts { colliders, sub_step, share, user };
            resolve(contacts, &model.inv_m, from, [x, v], past, kept)
        });
        let Met { touched, passed, first_passed, pinched, first_pinched, .. } = met;
        watch.lap(Stage::Collide);

        tried.contact_count = touched;
        tried.notices.passed_count = passed;
        tried.notices.first_passed = first_passed.map(|first| u64::from(first.particle));
        tried.notices.pinched_count = pinched;
        tried.notices.first_pinched = first_pinched.map(u64::from);
        if touched > 0 {
            self.memory.forget();
        }
        let rejects = settings.on_pass == OnPass::Reject && !settings.time_step.is_unchecked();
        match first_passed {
            Some(Passed { particle, collider }) if rejects => {
                let collider = colliders[collider as usize].name.clone();
                Err(StepFailure::Passed { particle: particle.into(), collider })
            }
            _ => Ok(met),
        }
    }
}

//! A sub-step of one cloth that meets colliders, and how it is judged once it has.
//!
//! What colliders give is known: in the frame of its surface a contact gives nothing, so that one with a surface that moves gives
//! the impulse times the velocity of the surface.

use super::{
    contact::Contact,
    evaluate::{Allowance, Judged, Led, Workspace, kinetic_of, sums},
    judge::{most_owed, risen_most},
    settings::{Integrator, OnPass, Purpose},
    state::State,
    step::Stepping,
};
use crate::{
    collide::{Contacts, Met, Passed, resolve},
    math::{Real, Vec3},
    report::{Stage, StepFailure, Stopwatch},
};

impl<R: Real> Stepping<'_, R> {
    /// Lets what was tried meet colliders, at `time` (s), and judges what contacts made of it.
    pub(super) fn meet(&mut self, time: f64, watch: &mut dyn Stopwatch) -> Result<(), StepFailure> {
        if !self.settings.integrator.is_implicit() {
            self.look_at_parts();
        }
        let met = self.touch(time, watch)?;
        self.work.start.impulse = met.carried.impulse;
        if self.settings.integrator == Integrator::SymplecticEuler && self.model.parts.all().len() > 1 {
            self.work.start.fall = self.fall();
        }
        let parts = self.model.parts.all();
        if !self.settings.integrator.is_implicit() && met.touched > 0 && parts.len() > 1 {
            self.sum_parts();
            let Workspace { common, of_parts, .. } = &mut *self.work;
            common.touch(parts, &of_parts.sums, Vec3::from(met.carried.velocity()));
        }
        // What bounces add, because a method's velocities are not those of its way, the method takes in flight.
        let given = met.swing + met.carried.work;
        self.work.met = met;
        self.work.start.own += given;
        if let Some(allowed) = self.work.allowed.as_mut().filter(|_| met.touched > 0) {
            let given = given + allowed.at_rest;
            allowed.limit += given;
            allowed.given += given;
        }
        self.work.judged = match self.work.allowed {
            Some(allowed) if met.touched == 0 => allowed.owes.into(),
            _ => (met.touched == 0 || met.inside == 0).into(),
        };
        let is_told = self.work.judged == Judged::Yes && met.touched > 0;
        match self.work.allowed {
            Some(allowed) if is_told => self.judge_contacts(&allowed, watch),
            _ => Ok(()),
        }
    }

    /// Takes over what parts do as a whole in an explicit sub-step, where that does not follow from the momentum of all.
    fn look_at_parts(&mut self) {
        let Self { model, .. } = *self;
        self.work.common.clear();
        if Workspace::has_common_motion(model, self.state) && !model.is_loose() {
            self.sum_parts();
            let Workspace { common, of_parts, .. } = &mut *self.work;
            common.set_explicit(model, &of_parts.sums);
        }
    }

    /// What symplectic Euler makes of the fall of several parts that no pin holds (J): each is moved by its velocity at the end of the
    /// sub-step in place of the mean, - h g.(P' - P) / 2.
    fn fall(&self) -> f64 {
        let Workspace { numbers, common, of_parts, .. } = &*self.work;
        let (gravity, h) = (numbers.gravity.map(R::to_f64), numbers.dt);
        let loose = self.model.parts.all().iter().zip(&of_parts.sums).zip(&common.momenta);
        let loose = loose.filter(|((part, _), _)| !part.is_held);
        let gained: Vec3<f64> = loose.map(|((_, sums), momentum)| momentum - sums.before()).sum();
        -0.5 * h * gravity.dot(&gained)
    }

    /// Adds up the rows of each part, from the state to where it leads so far.
    fn sum_parts(&mut self) {
        let Workspace { numbers, next, of_parts, .. } = &mut *self.work;
        sums(self.model, numbers, self.state, Led::To(&next.v), of_parts);
    }

    /// Refuses what contacts made of a sub-step, if more is owed for their energy after it than may be.
    fn judge_contacts(&mut self, allowed: &Allowance, watch: &mut dyn Stopwatch) -> Result<(), StepFailure> {
        let Self { model, settings, .. } = *self;
        let mut parts = model.parts.all();
        if parts.len() > 1 {
            self.sum_parts();
        }
        self.work.evaluate_next(model, Purpose::of(settings));
        watch.lap(Stage::Force);
        let Workspace { of_parts, contact: Contact { groups, .. }, .. } = &mut *self.work;
        if model.thick_surface().is_some() {
            of_parts.join(groups.of_part(), groups.all.len());
        }
        let Workspace { evaluation, next, numbers, start, common, of_parts, met, contact, .. } = &*self.work;
        let mut sums = &of_parts.sums;
        if model.thick_surface().is_some() {
            (parts, sums) = (&contact.groups.all, &of_parts.of_groups);
        }
        let most = most_owed(allowed, (parts, sums, common), Vec3::from(met.carried.velocity()));
        let value = evaluation.total.energy() - start.energy;
        let limit = allowed.limit + (most - self.state.gain.energy).max(0.0);
        if value > limit {
            let particle = risen_most(model, numbers, [&*self.state, next]);
            return Err(StepFailure::EnergyGain { particle, value, limit });
        }
        Ok(())
    }

    /// Of an explicit sub-step that was taken: the mean velocity (m/s) of the pins, and the greatest energy (J) that moved and was stretched at
    /// its start and its end, without what parts do as a whole. What touched a surface is seen from it.
    pub(super) fn moved(&mut self) -> (Vec3<f64>, f64) {
        let Workspace { evaluation, start, common, met, .. } = &*self.work;
        let totals = [&start.total, &evaluation.total];
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

    /// Lets what was tried meet colliders, at `time` (s).
    fn touch(&mut self, time: f64, watch: &mut dyn Stopwatch) -> Result<Met, StepFailure> {
        let Self { model, settings, around, .. } = *self;
        let Workspace { next: State { x, v, past, .. }, numbers, tried, contacts: kept, contact, .. } =
            &mut *self.work;
        let is_thick = model.thick_surface().is_some();
        if is_thick {
            contact.rub(model, around.colliders, (&self.state.x, numbers.dt), [x, v]);
        }
        let (colliders, share, user) = (around.colliders, &model.share, &model.user);
        let contacts = Contacts { colliders, time, dt: numbers.dt, share, user };
        let past = (past.dt > 0.0).then_some([&mut past.x[..], &mut past.v[..]]);
        let from = [&self.state.x[..], &self.state.v[..]];
        let mut met = resolve(contacts, &model.inv_m, from, [x, v], past, kept);
        if is_thick && !colliders.is_empty() {
            kept.add(contact.given());
            met.touched = met.touched.max(contact.pushed());
            met.carried = met.carried.and(contact.carried(model));
        }
        let Met { touched, passed, first_passed, pinched, first_pinched, .. } = met;
        watch.lap(Stage::Collide);

        tried.contact_count = touched;
        tried.notices.passed_count = passed;
        tried.notices.first_passed = first_passed.map(|first| u64::from(first.particle));
        tried.notices.pinched_count = pinched;
        tried.notices.first_pinched = first_pinched.map(u64::from);
        if touched > 0 {
            self.work.forget();
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

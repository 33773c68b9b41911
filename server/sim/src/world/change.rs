//! Changes are applied between two steps: all of a list, or none.

use std::sync::Arc;

use super::{
    body::{Body, cloth::Cloth},
    calls::{
        changes::{Change, ChangeError},
        collider_move::ColliderMove,
        rules::ChangeRules,
    },
    clock::{World, pace::Pace},
};
use crate::{cloth::Air, collide::Motion, math::Real, report::WakeCause};

impl<R: Real> World<R> {
    pub(crate) fn rules(&self) -> &Arc<ChangeRules> {
        &self.rules
    }

    pub(crate) fn check(&self, changes: &[Change]) -> Result<(), ChangeError> {
        self.rules.check(changes)?;
        self.bodies.iter().filter_map(Body::as_cloth).try_for_each(|cloth| cloth.check_apart(changes))
    }

    pub(crate) fn apply(&mut self, changes: &[Change]) -> Result<(), ChangeError> {
        self.check(changes)?;
        for change in changes {
            self.apply_one(change);
        }

        Ok(())
    }

    fn apply_one(&mut self, change: &Change) {
        // Where forces jump, the past says nothing of them. Pulls jump where they begin and end: they see to it themselves.
        let goes_on = matches!(
            change,
            Change::Pin { .. } | Change::PinPath { .. } | Change::Collider(_) | Change::Pull(_)
        );
        if !goes_on {
            self.cloths_mut().for_each(Cloth::forget_past);
        }
        self.wake_for(change);
        if matches!(change, Change::State { .. } | Change::Reset) {
            self.pace = Pace::default();
        }
        match change {
            Change::Gravity(value) => self.gravity = *value,
            Change::Wind(value) => self.wind.set(*value),
            Change::Drag(value) => self.cloths_mut().for_each(|cloth| cloth.set_drag(*value)),
            Change::Air { body: name, density, normal, lift, tangential } => {
                let named = |cloth: &&mut Cloth<R>| {
                    name.as_ref().is_none_or(|name| cloth.parts.named(name).is_some())
                };
                self.cloths_mut().filter(named).for_each(|cloth| {
                    cloth.change_air(|air| Air {
                        density: density.unwrap_or(air.density),
                        normal: normal.unwrap_or(air.normal),
                        lift: lift.unwrap_or(air.lift),
                        tangential: tangential.unwrap_or(air.tangential),
                    });
                });
            }
            Change::Springs { body: name, kind, stiffness, damping } => {
                let name = name.as_deref();
                self.cloths_mut().for_each(|cloth| cloth.set_springs(name, *kind, *stiffness, *damping));
            }
            Change::Pin { particle, target, duration } => {
                self.send_pin(*particle, std::iter::once((*duration, *target)));
            }
            Change::PinPath { particle, points } => self.send_pin(*particle, points.iter().copied()),
            Change::Collider(asked) => self.send_collider(asked),
            Change::Force { body, particles, forces } => {
                for it in &mut self.bodies {
                    it.set_forces(body, particles, forces);
                }
            }
            Change::Pull(asked) => {
                let dt = self.dt;
                self.cloths_mut().for_each(|cloth| cloth.set_pulls(asked, dt));
            }
            Change::State { body, positions, velocities } => {
                for it in &mut self.bodies {
                    it.place(body, positions, velocities.as_deref());
                }
            }
            Change::Reset => {
                self.gravity = self.start.0;
                self.wind.clone_from(&self.start.1);
                let own = self.colliders.iter_mut().zip(&self.start.2);
                own.for_each(|(collider, motion)| collider.put_motion(motion));
                self.bodies.iter_mut().for_each(Body::reset);
                let time = self.time();
                self.cloths_mut().for_each(|cloth| cloth.lead_from(time));
            }
        }
    }

    /// Wakes what a change acts on. A collider that is sent wakes what it comes near.
    fn wake_for(&mut self, change: &Change) {
        let step = self.step_count;
        let cause = match change {
            Change::Pin { .. } | Change::PinPath { .. } => WakeCause::Pin,
            Change::Force { .. } | Change::Pull(_) => WakeCause::Force,
            _ => WakeCause::Call,
        };
        let is_changed = |cloth: &&mut Cloth<R>| match change {
            Change::Collider(_) => false,
            Change::Gravity(_) | Change::Wind(_) | Change::Drag(_) | Change::Reset => true,
            Change::Air { body: name, .. } | Change::Springs { body: name, .. } => {
                name.as_ref().is_none_or(|name| cloth.parts.named(name).is_some())
            }
            Change::Pin { particle, .. } | Change::PinPath { particle, .. } => {
                cloth.parts.own(*particle).is_some()
            }
            Change::Force { body, .. } | Change::State { body, .. } => cloth.parts.named(body).is_some(),
            Change::Pull(asked) => cloth.parts.named(&asked.body).is_some(),
        };
        self.cloths_mut().filter(is_changed).for_each(|cloth| cloth.wake(cause, step));
    }

    fn send_pin(&mut self, particle: u32, points: impl Iterator<Item = (f64, [f64; 3])>) {
        let dt = self.dt;
        let mut owners = self.cloths_mut().filter_map(|cloth| Some((cloth.parts.own(particle)?, cloth)));
        if let Some((own, cloth)) = owners.next() {
            cloth.send_pin(own, points, dt);
        }
    }

    fn send_collider(&mut self, asked: &ColliderMove) {
        let (time, steps, dt) = (self.time(), self.step_count, self.dt);
        let mut colliders = self.colliders.iter_mut();
        if let Some(collider) = colliders.find(|collider| collider.name == asked.collider) {
            let way = Some(asked.way(collider.pose(time), steps, dt));
            collider.put_motion(&Motion { velocity: [0.0; 3], way });
        }
    }

    fn cloths_mut(&mut self) -> impl Iterator<Item = &mut Cloth<R>> {
        self.bodies.iter_mut().filter_map(Body::as_cloth_mut)
    }
}

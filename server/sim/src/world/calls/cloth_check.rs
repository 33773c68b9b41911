//! Whether a cloth can go on from a state, of which nobody may know who wrote it.
//!
//! Enters: what was taken of a cloth. Leaves: what keeps another one from going on from it, as a sentence.

use super::changes::allowed;
use crate::{
    cloth::{Air, Gain, LawEntry, Parameters, PinMotion, State, Watch},
    math::{Padded, Real, Sixteen, array3},
    world::{
        body::cloth::{Cloth, Taken},
        setup::pulls::{self, Held},
    },
};

impl<R: Real> Cloth<R> {
    /// What keeps this cloth from going on from what was taken of another one, as a sentence.
    pub(crate) fn unfit(&self, taken: &Taken<R>) -> Option<String> {
        let Taken { state, parameters, sent, forces, pulls, watch } = taken;
        self.unfit_state(state)
            .or_else(|| state.motions.iter().chain(sent).find_map(|motion| self.unfit_pin(motion)))
            .or_else(|| self.unfit_forces(forces))
            .or_else(|| self.unfit_parameters(parameters))
            .or_else(|| self.unfit_pulls(pulls))
            .or_else(|| self.unfit_watch(watch.as_ref()))
    }

    /// Lists as long as its own, of finite numbers; pins in the order of their particles.
    fn unfit_state(&self, state: &State<R>) -> Option<String> {
        let State { x, v, dv, past, motions, led_since, gain, since_cap, kept } = state;
        let count = self.state.x.len();
        let lengths = [
            ("positions", x.len(), [count; 2]),
            ("velocities", v.len(), [count; 2]),
            ("positions of the sub-step before", past.x.len(), [0, count]),
            ("velocities of the sub-step before", past.v.len(), [0, count]),
            ("sixteens of changes of velocity", dv.len(), [0, count / Sixteen::<R>::LANES]),
        ];
        for (what, found, allowed) in lengths {
            if !allowed.contains(&found) {
                return Some(format!("it has {found} {what}: {} are needed", allowed[1]));
            }
        }
        let has_past = past.x.len() == count && past.v.len() == count;
        if !past.dt.is_finite() || past.dt < 0.0 || (past.dt > 0.0 && !has_past) {
            return Some(format!("the sub-step before cannot have taken {} s", past.dt));
        }

        let is_finite = |row: &Padded<R>| array3(&row.vector()).iter().all(|c| c.is_finite());
        let rows =
            [("position", x), ("velocity", v), ("position before", &past.x), ("velocity before", &past.v)];
        for (what, rows) in rows {
            if let Some(row) = rows.iter().position(|row| !is_finite(row)) {
                return Some(format!("the {what} of particle {} is not finite", self.number(row)));
            }
        }
        if !dv.iter().flat_map(|dv| dv.0.as_flattened()).all(|c| c.to_f64().is_finite()) {
            return Some("a change of velocity is not finite".to_owned());
        }
        let Gain { energy, kept: keeps, ratio, motion } = *gain;
        if ![energy, keeps, ratio, motion].iter().all(|number| number.is_finite()) {
            return Some("what is known of its energy is not finite".to_owned());
        }
        if !led_since.is_finite() || *led_since < 0.0 {
            return Some(format!("its frames cannot have begun at {led_since} s"));
        }
        if *since_cap == u32::MAX || !kept.is_sound(count) {
            return Some("its solves cannot go on with what they kept".to_owned());
        }
        let back = motions.windows(2).find(|pair| pair[0].particle >= pair[1].particle)?;
        let [first, second] = [&back[0], &back[1]].map(|motion| self.number(motion.particle as usize));
        Some(format!("pin {second} is listed after pin {first}, out of order or twice"))
    }

    /// A pin on its way to a point that its way has.
    fn unfit_pin(&self, motion: &PinMotion) -> Option<String> {
        let PinMotion { particle, points, next, steps_left } = motion;
        let row = *particle as usize;
        let Some(user) = self.model.user.get(row) else {
            return Some(format!(
                "particle {particle} of its layout is on its way: there are {}, from 0",
                self.model.count
            ));
        };
        let pin = self.parts.of_all(*user);
        if self.model.inv_m[row] != R::zero() {
            return Some(format!("particle {pin} is on its way, and not pinned"));
        }
        let Some(point) = points.get(*next) else {
            return Some(format!("pin {pin} is on its way to point {next}: its way has {}", points.len()));
        };
        let is_point = |steps: u64, target: [f64; 3]| steps > 0 && target.iter().all(|c| c.is_finite());
        if !points.iter().all(|point| is_point(point.steps, point.target)) {
            return Some(format!("a point of the way of pin {pin} is not finite, or takes no time"));
        }
        // What is left of a step may be less than nothing by rounding.
        let is_left = (-1.0..=point.steps as f64).contains(steps_left);
        (!is_left).then(|| {
            format!("pin {pin} has {steps_left} sub-steps left to a point that takes {}", point.steps)
        })
    }

    /// A pull on each of some particles that are free, in their order.
    fn unfit_pulls(&self, pulls: &[Held]) -> Option<String> {
        let is_free = |particle: u32| (particle as usize) < self.model.count && !self.is_pinned(particle);
        let first = pulls::unsound(pulls, is_free)?;
        Some(format!(
            "the pull on particle {first} of its layout is out of order, on a pin, or out of its range"
        ))
    }

    /// A watch of a cloth of as many particles in the same pieces, where this one is watched; asleep where this one may sleep.
    fn unfit_watch(&self, watch: Option<&Watch<R>>) -> Option<String> {
        let may_sleep = self.settings.rest.is_some_and(|rest| rest.sleep) && self.model.figures.is_empty();
        let is_sound = match (watch, &self.watch) {
            (None, None) => true,
            (Some(watch), Some(own)) => watch.is_sound(own) && (may_sleep || !watch.is_asleep()),
            _ => false,
        };
        (!is_sound).then(|| "what is known of how still it lies is not that of this cloth".to_owned())
    }

    /// A force that may act on each particle, none on pins; or none at all.
    fn unfit_forces(&self, forces: &[[f64; 3]]) -> Option<String> {
        let count = self.model.count;
        if ![0, count].contains(&forces.len()) {
            return Some(format!("{} forces act on it: none, or {count}, are needed", forces.len()));
        }
        let [low, high] = allowed::FORCE;
        (0_u32..).zip(forces).find_map(|(particle, force)| {
            let is_free = !self.is_pinned(particle);
            let may_act = force.iter().all(|c| *c == 0.0 || (is_free && (low..=high).contains(c)));
            (!may_act).then(|| {
                let particle = self.parts.of_all(particle);
                format!(
                    "{force:?} N act on particle {particle}: allowed are {low:e} to {high:e}, and 0 on pins"
                )
            })
        })
    }

    /// As many laws of the same kinds as its own.
    fn unfit_parameters(&self, parameters: &Parameters) -> Option<String> {
        let (Parameters { laws, elements, drag, air }, own) = (parameters, &self.parameters);
        let has_kinds = laws.len() == own.laws.len()
            && laws.iter().zip(&own.laws).all(|(found, own)| found.kind == own.kind);
        if !has_kinds || elements.len() != own.elements.len() || air.is_some() != own.air.is_some() {
            return Some("its parameters are those of a cloth with other laws".to_owned());
        }
        let is_amount = |number: f64| number.is_finite() && number >= 0.0;
        let mut of_laws = laws.iter().map(|LawEntry { law, .. }| law).chain(elements);
        if !is_amount(*drag) || !of_laws.all(|law| is_amount(law.stiffness) && is_amount(law.damping)) {
            return Some("its drag, a stiffness or a damping is no finite number from 0".to_owned());
        }
        let numbers = air.as_ref().map(Air::numbers)?;
        numbers.into_iter().find_map(|(name, value)| {
            let [least, most] = Air::allowed(name);
            let is_allowed = (least..=most).contains(&value);
            (!is_allowed).then(|| format!("the {name} of air is {value}: allowed are {least} to {most}"))
        })
    }

    /// The number among all particles of the one in a row of its layout, as a message has it.
    fn number(&self, row: usize) -> String {
        let user = self.model.user.get(row);
        user.map_or_else(
            || format!("in row {row}, where none is,"),
            |user| self.parts.of_all(*user).to_string(),
        )
    }
}

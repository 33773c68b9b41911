//! The energy of active pairs, by which a sub-step is judged.
//!
//! A pair that pulls has none: what comes from afar is not pressed before it is there. What moves by itself, a pin or a collider, gives its impulse
//! times its velocity, and what is given back of a thickness is given like the work of a wall that goes so far.

use super::{groups::Groups, pushing::Pushing, ways::wide};
use crate::{
    cloth::layout::Model,
    math::{Padded, Real, Vec3},
};

/// Energies (J) of the pairs that were active in the last solve, with the linear gaps that it had.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PairEnergy {
    /// Where each group goes on as a whole, and pins and colliders have gone their way.
    pub(crate) start: f64,
    /// Where all went on at its velocity, with what friction takes there.
    pub(crate) at_velocity: f64,
    /// Where the solve led.
    pub(crate) end: f64,
    /// What pins and colliders give by pushing, beside carrying groups along, and what is given back of lost thickness.
    pub(crate) given: f64,
    /// What the motion of colliders gives of that, and of what carries groups along.
    pub(crate) of_colliders: f64,
    /// Whether any pushed.
    pub(crate) has_any: bool,
}

impl PairEnergy {
    /// That of what pushes in a sub-step of `dt` (s), from velocities (m/s) at its start and its end.
    pub(crate) fn of<'a, R: Real>(
        (model, groups): (&Model<R>, &Groups),
        pushing: impl Iterator<Item = Pushing<'a>>,
        [before, after]: [&[Padded<R>]; 2],
        dt: f64,
    ) -> Self {
        let mut sum = Self::default();
        for push in pushing {
            let Pushing { stencil, hold, surface } = push;
            let frame = groups.frames[groups.of_row(model, stencil.corners[0] as usize)];
            let driven = stencil.corners.map(|corner| {
                let is_free = model.inv_m[corner as usize] > R::zero();
                if is_free { Vec3::zeros() } else { wide(&before[corner as usize]) - frame }
            });
            let moved = stencil.relative(&driven) - surface.map_or(Vec3::zeros(), |surface| surface - frame);
            let [went_on, went] = [before, after].map(|field| push.relative(|corner| wide(&field[corner])));
            let energy = |across: f64| hold.energy(across, dt);
            let pressed = |across: f64| if hold.pulls(across) { 0.0 } else { energy(across) };
            let across = push.across(&went, dt);
            sum.start += pressed(push.across(&moved, dt));
            sum.at_velocity +=
                energy(push.across(&went_on, dt)) + hold.rub.potential(&stencil.along(&went_on));
            sum.end += pressed(across);
            let impulse = push.impulse(&went, dt);
            let given_back = hold.impulse(across, dt).max(0.0) * hold.regained() / dt;
            sum.given += given_back - impulse.dot(&moved);
            sum.of_colliders += impulse.dot(&surface.unwrap_or_default());
            sum.has_any = true;
        }
        sum
    }
}

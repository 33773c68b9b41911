//! Coulomb's friction in a solve: what slides is pushed back by mu N along the way that it slides, and across it by mu N over its speed, which is
//! Newton's method for mu N |v|; what does not slide is held by what is viscous up to 1 mm/s.
//!
//! N is that of the solve before. The first solve of a sub-step has none, and says how hard parts push each other.

use super::rules::SETTLING;
use crate::math::Vec3;

/// Speed (m/s) along each other below which friction is less than its bound: what rests creeps.
pub(super) const CREEP: f64 = 1e-3;

/// Friction of what pushes, as the solve has it.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Friction {
    /// The unit vector along which it slides; 0 of what is held.
    pub(super) way: Vec3<f64>,
    /// h times the bound on the force (N s).
    bound: f64,
    /// Over which speed (m/s) it is divided; 0 where no solve has said yet whether it slides.
    speed: f64,
}

/// By how much friction that a solve had is off what Coulomb's law says of it, and how much it is (N s).
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Off {
    pub(super) by: f64,
    pub(super) of: f64,
}

impl Off {
    /// The same with that of others.
    pub(super) fn and(self, other: Self) -> Self {
        Self { by: self.by + other.by, of: self.of + other.of }
    }
}

/// What a solve led to, as friction sees it.
#[derive(Clone, Copy, Debug)]
pub(super) struct Seen {
    /// h times the bound on the force (N s).
    pub(super) bound: f64,
    /// The velocity along each other (m/s).
    pub(super) along: Vec3<f64>,
    /// How fast (m/s) it was at the start.
    pub(super) came: f64,
    /// The reduced mass of what touches (kg).
    pub(super) mass: f64,
}

impl Friction {
    /// That of what is added to those that push.
    pub(super) fn guess(seen: Seen) -> Self {
        let mut guess = Self::default();
        guess.look(seen, 0);
        guess
    }

    /// Takes over what the solve of a round led to. What slides at the last look is held back by what is viscous: nobody sees whether it turns round.
    pub(super) fn look(&mut self, Seen { bound, along, came, mass }: Seen, round: u32) -> Off {
        let (before, speed) = (*self, along.norm());
        let (is_known, slid) = (before.speed > 0.0, before.way != Vec3::zeros());
        let slides = match (is_known, slid) {
            // As if it were alone.
            (false, _) => came > CREEP && bound < mass * speed,
            (true, false) => speed > CREEP,
            (true, true) => before.way.dot(&along) > 0.0,
        };
        self.way = if slides && round + 2 < SETTLING { along / speed } else { Vec3::zeros() };
        (self.bound, self.speed) = (bound, if slides { speed.max(CREEP) } else { CREEP });
        let had = before.impulse(&along);
        let is_held = is_known && !slid && !slides;
        let by = if slides {
            (had + along * (bound / speed)).norm()
        } else if is_held {
            (had.norm() - bound).max(0.0)
        } else {
            bound.max(before.bound)
        };
        Off { by, of: bound }
    }

    /// h times force over speed (kg) of what moves across the way that it slides, or in every way.
    pub(super) fn per_speed(&self) -> f64 {
        if self.speed > 0.0 { self.bound / self.speed } else { 0.0 }
    }

    /// h times the force (N s) at a velocity along each other (m/s).
    pub(super) fn impulse(&self, along: &Vec3<f64>) -> Vec3<f64> {
        let Self { way, bound, .. } = self;
        -(way * *bound + (along - way * along.dot(way)) * self.per_speed())
    }

    /// What it takes (J) within a step at a velocity along each other (m/s).
    pub(super) fn potential(&self, along: &Vec3<f64>) -> f64 {
        let forth = along.dot(&self.way);
        self.bound * forth + 0.5 * self.per_speed() * (along.norm_squared() - forth * forth)
    }
}

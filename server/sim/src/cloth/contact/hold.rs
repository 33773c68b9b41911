//! What keeps two points apart within a sub-step: the stencil that they are mixed of, and how it is held.
//!
//! With n the normal and w the weights, the gap at the end is linear: that of what stands still, and n.(sum w_i way_i), less the way of a collider
//! where that is the other side. What is active adds the energy k (t - g)² / 2 to what the step minimises, so h² k n nᵀ times w wᵀ to its matrix.

use super::{
    friction::Friction,
    place::mixed,
    rules::{LATE, PULL, SHORT},
};
use crate::math::Vec3;

/// Two points that are mixed of corners, and the direction in which they are held apart.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Stencil {
    pub(super) corners: [u32; 4],
    /// 1 in sum on the first side, and -1 on the second where that has corners; 0 of a corner that has no part in it.
    pub(super) weights: [f64; 4],
    /// From the second side to the first: a unit vector.
    pub(super) normal: Vec3<f64>,
}

impl Stencil {
    /// That of one particle, on a side of a collider of which this is the normal.
    pub(super) fn of_one(particle: u32, normal: Vec3<f64>) -> Self {
        Self { corners: [particle; 4], weights: [1.0, 0.0, 0.0, 0.0], normal }
    }

    /// The way or velocity of the first point relative to the second, from those of the corners.
    pub(super) fn relative(&self, of_corners: &[Vec3<f64>; 4]) -> Vec3<f64> {
        mixed(of_corners, &self.weights)
    }

    /// What of a relative way or velocity is along the surfaces.
    pub(super) fn along(&self, relative: &Vec3<f64>) -> Vec3<f64> {
        relative - self.normal * relative.dot(&self.normal)
    }
}

/// How the points of a stencil are held apart. Its methods take by how much (m) they have come farther apart along the normal.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Hold {
    /// Distance (m) at the start of the sub-step.
    pub(super) began: f64,
    /// The linear gap (m) of what stands still.
    pub(super) gap: f64,
    /// The gap that the solve aims at (m).
    pub(super) target: f64,
    /// h² k (kg); 0 where nothing is free, which does not push.
    pub(super) stiffness: f64,
    pub(super) rub: Friction,
    pub(super) activity: Activity,
}

/// Whether a stencil pushes.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) enum Activity {
    /// It is not near, and is not kept.
    #[default]
    Far,
    Idle,
    Active,
    /// It was dropped once in this sub-step.
    Dropped,
    /// It was dropped once in this sub-step, and is active again.
    Again,
    /// It was dropped twice in this sub-step.
    Gone,
}

impl Activity {
    pub(super) fn pushes(self) -> bool {
        matches!(self, Self::Active | Self::Again)
    }
}

impl Hold {
    /// One that does not push, of points at a distance (m).
    pub(super) fn idle(distance: f64, target: f64, stiffness: f64) -> Self {
        let activity = Activity::Idle;
        Self { began: distance, gap: distance, target, stiffness, activity, ..Self::default() }
    }

    /// The linear gap (m).
    pub(super) fn gap_after(&self, across: f64) -> f64 {
        self.gap + across
    }

    /// By how much (m) the linear gap falls short of the target.
    pub(super) fn short(&self, across: f64) -> f64 {
        self.target - self.gap_after(across)
    }

    /// Whether the linear gap is beyond the target.
    pub(super) fn pulls(&self, across: f64) -> bool {
        self.gap_after(across) >= self.target
    }

    /// How much (m) of what was lost of the distance it gives back.
    pub(super) fn regained(&self) -> f64 {
        (self.target - self.began).max(0.0)
    }

    /// h times the force (N s) with which it pushes in a sub-step of `dt` (s).
    pub(super) fn impulse(&self, across: f64, dt: f64) -> f64 {
        self.stiffness / dt * self.short(across)
    }

    /// Energy (J) of its push in a sub-step of `dt` (s), on both sides of its target as the solve has it.
    pub(super) fn energy(&self, across: f64, dt: f64) -> f64 {
        let short = self.short(across);
        0.5 * self.stiffness / (dt * dt) * short * short
    }

    /// Pushes from now on, where it may; whether it did not.
    pub(super) fn add(&mut self) -> bool {
        self.activity = match self.activity {
            Activity::Idle if self.stiffness > 0.0 => Activity::Active,
            Activity::Dropped if self.stiffness > 0.0 => Activity::Again,
            _ => return false,
        };
        true
    }

    /// Does not push any more after a round in which it pulled by a share of the thickness; whether it goes. One that was dropped before stays, since
    /// sets of pairs may alternate for ever; late on, what pulls hard is dropped for good.
    pub(super) fn let_go(&mut self, pull: f64, round: u32) -> bool {
        self.activity = match self.activity {
            Activity::Active if pull > PULL => Activity::Dropped,
            Activity::Again if pull > SHORT && round >= LATE => Activity::Gone,
            _ => return false,
        };
        self.rub = Friction::default();
        true
    }
}

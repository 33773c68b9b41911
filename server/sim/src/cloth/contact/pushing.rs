//! All that pushes in a solve, seen alike: a pair of parts of cloth, and a particle at a collider, whose surface goes its own way.

use super::{
    hold::{Hold, Stencil},
    pair::Pair,
    wall::Wall,
};
use crate::{
    cloth::layout::Pushed,
    math::{Mat3, Vec3},
};

/// What pushes in a solve.
#[derive(Clone, Copy)]
pub(crate) struct Pushing<'a> {
    pub(super) stencil: &'a Stencil,
    pub(super) hold: &'a Hold,
    /// Velocity (m/s) of the surface, where the other side is a collider.
    pub(super) surface: Option<Vec3<f64>>,
}

/// All that push, pairs before walls.
pub(super) fn pushing<'a>(
    pairs: &'a [Pair],
    walls: &'a [Vec<Wall>],
) -> impl Iterator<Item = Pushing<'a>> + Clone {
    let pairs = pairs.iter().map(|Pair { stencil, hold, .. }| Pushing { stencil, hold, surface: None });
    let walls = walls.iter().flatten();
    let walls = walls.map(|wall| {
        let Wall { stencil, hold, velocity, .. } = wall;
        Pushing { stencil, hold, surface: Some(*velocity) }
    });
    pairs.chain(walls).filter(|push| push.hold.activity.pushes())
}

impl Pushing<'_> {
    /// How fast (m/s) the first side goes beside the second, from the velocity (m/s) of each particle.
    pub(super) fn relative(&self, velocity: impl Fn(usize) -> Vec3<f64>) -> Vec3<f64> {
        let of_corners = self.stencil.corners.map(|corner| velocity(corner as usize));
        self.stencil.relative(&of_corners) - self.surface.unwrap_or_default()
    }

    /// By how much (m) its sides come farther apart in `dt` (s) at a relative velocity (m/s).
    pub(super) fn across(&self, relative: &Vec3<f64>, dt: f64) -> f64 {
        (relative * dt).dot(&self.stencil.normal)
    }

    /// h times the force (N s) on the first side at a relative velocity (m/s), friction with it.
    pub(super) fn impulse(&self, relative: &Vec3<f64>, dt: f64) -> Vec3<f64> {
        let rubbed = self.hold.rub.impulse(&self.stencil.along(relative));
        self.stencil.normal * self.hold.impulse(self.across(relative, dt), dt) + rubbed
    }

    /// The same, and by how much less it is per relative velocity.
    pub(super) fn pushed(&self, relative: &Vec3<f64>, dt: f64) -> Pushed {
        let across = self.stencil.normal * self.stencil.normal.transpose();
        let way = self.hold.rub.way;
        let beside = Mat3::identity() - across - way * way.transpose();
        let matrix = across * self.hold.stiffness + beside * self.hold.rub.per_speed();
        Pushed { impulse: self.impulse(relative, dt), matrix }
    }
}

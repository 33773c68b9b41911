//! The energy of active pairs, by which a sub-step is judged.

use super::{pair::Pair, wall::Wall, ways::wide};
use crate::{
    cloth::layout::Model,
    math::{Padded, Real, Vec3},
};

/// Energies (J) of the pairs that were active in the last solve, with the linear gaps that it had.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct PairEnergy {
    /// Where what is free stands still, and pins and colliders have gone their way.
    pub(crate) start: f64,
    /// Where all went on at its velocity, with what friction takes there.
    pub(crate) at_velocity: f64,
    /// Where the solve led.
    pub(crate) end: f64,
    /// Whether any pair is pushed by something that moves by itself.
    pub(crate) is_driven: bool,
    /// Whether any pushed.
    pub(crate) has_any: bool,
}

impl PairEnergy {
    /// That of pairs and walls in a sub-step of `dt` (s), from velocities (m/s) at its start and its end.
    pub(crate) fn of<'a, R: Real>(
        model: &Model<R>,
        pairs: &[Pair],
        walls: impl Iterator<Item = &'a Wall>,
        [before, after]: [&[Padded<R>]; 2],
        dt: f64,
    ) -> Self {
        let mut sum = Self::default();
        for pair in pairs.iter().filter(|pair| pair.activity.pushes()) {
            let velocity =
                |field: &[Padded<R>]| pair.candidate.corners.map(|corner| wide(&field[corner as usize]));
            let driven = pair.candidate.corners.map(|corner| {
                let is_free = model.inv_m[corner as usize] > R::zero();
                if is_free { Vec3::zeros() } else { wide(&before[corner as usize]) }
            });
            let [moved, went_on, went] =
                [driven, velocity(before), velocity(after)].map(|v| pair.relative(v));
            let along = went_on - pair.normal * went_on.dot(&pair.normal);
            sum.is_driven |= moved != Vec3::zeros();
            sum.start += pair.energy(&(moved * dt), dt);
            sum.at_velocity += pair.energy(&(went_on * dt), dt) + 0.5 * pair.rub * along.norm_squared();
            sum.end += pair.energy(&(went * dt), dt);
            sum.has_any = true;
        }
        for wall in walls.filter(|wall| wall.activity.pushes()) {
            let [went_on, went] = [before, after].map(|field| wide(&field[wall.particle as usize]));
            sum.is_driven |= wall.velocity != Vec3::zeros();
            sum.start += wall.energy(&Vec3::zeros(), dt);
            sum.at_velocity +=
                wall.energy(&went_on, dt) + 0.5 * wall.rub * wall.along(&went_on).norm_squared();
            sum.end += wall.energy(&went, dt);
            sum.has_any = true;
        }
        sum
    }
}

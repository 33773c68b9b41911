//! Where particles would go freely in a sub-step, where they are expected, and boxes about their ways.

use super::pair::furthest;
use crate::{
    cloth::layout::{Model, Surface},
    math::{Padded, Real, Sixteen, Vec3},
    parallel::{per_row, per_row_mut},
    sub_step::SubStep,
    surface::PairKind,
};

/// Share of the thickness by which a particle may end elsewhere than expected before pairs are looked for again. Half of it on both
/// sides finds all that is nearer than the thickness at the start.
const REACH: f64 = 0.5;
/// Share of the reach beyond which a particle has left: parts whose boxes do not meet stay apart by what is left of it.
const WITHIN: f64 = 0.999;

/// The box about a way: its least and its greatest corner (m).
pub(crate) type WayBox = [[f64; 3]; 2];

/// The free and the expected way (m) of a particle, from its row and where it begins (m).
type TwoWays<'a> = dyn Fn(usize, &Vec3<f64>) -> [Vec3<f64>; 2] + Sync + 'a;

/// The ways of all particles in the sub-step that is tried.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ways {
    /// Where each begins (m).
    starts: Vec<Vec3<f64>>,
    /// The way (m) of each without forces but gravity.
    free: Vec<Vec3<f64>>,
    /// The way (m) that is expected of each: by its last change of velocity, where it is known.
    expected: Vec<Vec3<f64>>,
    /// The box about each way to where it is expected, wider by the reach on each side.
    boxes: Vec<WayBox>,
    /// How far (m) from there each particle may end.
    reaches: Vec<f64>,
}

/// Positions and velocities at the start of a sub-step, the changes of velocity of the one before, or none, and gravity (m/s²).
#[derive(Clone, Copy)]
pub(crate) struct Start<'a, R: Real> {
    pub(crate) x: &'a [Padded<R>],
    pub(crate) v: &'a [Padded<R>],
    pub(crate) dv: &'a [Sixteen<R>],
    pub(crate) sub_step: SubStep,
    pub(crate) gravity: Vec3<f64>,
}

impl Ways {
    /// Ways without forces, x to x + h v + h² g, pins without gravity; and those that are expected, x to x + h (v + dv).
    pub(crate) fn predict<R: Real>(&mut self, model: &Model<R>, surface: &Surface, start: Start<'_, R>) {
        let Start { sub_step: SubStep { dt, .. }, gravity, dv, .. } = start;
        self.reaches.clear();
        let reach_of = |row| REACH * surface.thickness_of(row as u32);
        self.reaches.extend((0..model.count).map(reach_of));
        self.go(model, start.x, &|row, _| {
            let v = wide(&start.v[row]);
            let fall = if model.inv_m[row] > R::zero() { gravity * dt } else { Vec3::zeros() };
            let change = match dv.get(row / Sixteen::<R>::LANES) {
                Some(dv) => dv.get(row % Sixteen::<R>::LANES).map(R::to_f64),
                None => fall,
            };
            [(v + fall) * dt, (v + change) * dt]
        });
    }

    /// Ways to where a solve led.
    pub(crate) fn follow<R: Real>(&mut self, model: &Model<R>, from: &[Padded<R>], to: &[Padded<R>]) {
        self.go(model, from, &|row, start| [wide(&to[row]) - start; 2]);
    }

    /// `way` gives the two ways (m) of a particle, from its row and where it begins.
    fn go<R: Real>(&mut self, model: &Model<R>, from: &[Padded<R>], way: &TwoWays<'_>) {
        for field in [&mut self.starts, &mut self.free, &mut self.expected] {
            field.resize(model.count, Vec3::zeros());
        }
        self.boxes.resize(model.count, WayBox::default());
        let ways = [&mut self.starts, &mut self.free, &mut self.expected].map(|field| per_row_mut(field));
        let given = (per_row(from), per_row(&self.reaches));
        let fields = (ways, per_row_mut(&mut self.boxes), given);
        model.share.own().each(fields, |block, ([starts, free, expected], boxes, (from, reaches))| {
            let first = block * model.block_size;
            for row in 0..boxes.len() {
                let x = wide(&from[row]);
                let [freely, expectedly] = way(first + row, &x);
                (starts[row], free[row], expected[row]) = (x, freely, expectedly);
                let to = x + expectedly;
                for c in 0..3 {
                    boxes[row][0][c] = x[c].min(to[c]) - reaches[row];
                    boxes[row][1][c] = x[c].max(to[c]) + reaches[row];
                }
            }
        });
    }

    /// The box about the ways of particles.
    pub(crate) fn around(&self, particles: &[u32]) -> WayBox {
        let [mut least, mut greatest] = self.boxes[particles[0] as usize];
        for particle in &particles[1..] {
            let [low, high] = &self.boxes[*particle as usize];
            for c in 0..3 {
                least[c] = least[c].min(low[c]);
                greatest[c] = greatest[c].max(high[c]);
            }
        }
        [least, greatest]
    }

    /// The way (m) of a particle without forces but gravity.
    #[inline]
    pub(crate) fn free(&self, particle: u32) -> Vec3<f64> {
        self.free[particle as usize]
    }

    /// Where a particle is (m) after a share of its way without forces.
    #[inline]
    pub(crate) fn freely(&self, particle: u32, share: f64) -> Vec3<f64> {
        self.starts[particle as usize] + self.free(particle) * share
    }

    /// The way (m) that is expected of a particle.
    #[inline]
    pub(crate) fn expected(&self, particle: u32) -> Vec3<f64> {
        self.expected[particle as usize]
    }

    /// How far (m) from where it is expected a particle may end.
    #[inline]
    pub(crate) fn reach(&self, particle: u32) -> f64 {
        self.reaches[particle as usize]
    }

    /// By how much (m) a pair of parts may come nearer: what a corner of one goes beside one of the other, given what is expected of them (m), and how
    /// far both may end from there.
    #[inline(always)]
    pub(crate) fn room(&self, kind: PairKind, corners: &[u32; 4], expected: &[Vec3<f64>; 4]) -> f64 {
        // Each part is of one sheet.
        furthest(kind, expected) + (self.reach(corners[0]) + self.reach(corners[3]))
    }

    /// Where all begin, and the ways that are expected of them (m).
    pub(crate) fn fields(&self) -> [&[Vec3<f64>]; 2] {
        [&self.starts, &self.expected]
    }

    /// Where four particles begin, and the ways that are expected of them (m).
    #[inline(always)]
    pub(crate) fn starts_and_expected(&self, &[a, b, c, d]: &[u32; 4]) -> [[Vec3<f64>; 4]; 2] {
        let [a, b, c, d] = [a as usize, b as usize, c as usize, d as usize];
        let (x, to) = (&self.starts, &self.expected);
        [[x[a], x[b], x[c], x[d]], [to[a], to[b], to[c], to[d]]]
    }

    /// The first particle that ended farther from the end of its way than pairs were looked for, if any did.
    pub(crate) fn left<R: Real>(&self, ends: &[Padded<R>]) -> Option<u32> {
        let has_stayed = |(row, end): (usize, &Padded<R>)| {
            let reach = WITHIN * self.reaches[row];
            (wide(end) - (self.starts[row] + self.expected[row])).norm_squared() <= reach * reach
        };
        // What is not a number has left.
        let left = ends.iter().enumerate().position(|row_and_end| !has_stayed(row_and_end));
        left.map(|particle| particle as u32)
    }
}

/// A vector in binary64.
pub(crate) fn wide<R: Real>(vector: &Padded<R>) -> Vec3<f64> {
    vector.vector().map(R::to_f64)
}

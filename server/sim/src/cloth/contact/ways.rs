//! Where particles would go in a sub-step without forces, where they are expected, and boxes about their ways.

use crate::{
    cloth::layout::Model,
    math::{Padded, Real, Sixteen, Vec3},
    parallel::{per_row, per_row_mut},
};

/// The box about a way: its least and its greatest corner (m).
pub(crate) type WayBox = [[f64; 3]; 2];

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
    /// How far (m) from there a particle may end.
    pub(crate) reach: f64,
}

/// Positions and velocities at the start of a sub-step, the changes of velocity of the one before, or none, its length (s), and gravity (m/s²).
#[derive(Clone, Copy)]
pub(crate) struct Start<'a, R: Real> {
    pub(crate) x: &'a [Padded<R>],
    pub(crate) v: &'a [Padded<R>],
    pub(crate) dv: &'a [Sixteen<R>],
    pub(crate) dt: f64,
    pub(crate) gravity: Vec3<f64>,
}

impl Ways {
    /// Ways without forces, x to x + h v + h² g, pins without gravity; and those that are expected, x to x + h (v + dv).
    pub(crate) fn predict<R: Real>(&mut self, model: &Model<R>, start: Start<'_, R>, reach: f64) {
        let Start { dt, gravity, dv, .. } = start;
        self.go(model, start.x, reach, &|row, _| {
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
        let reach = self.reach;
        self.go(model, from, reach, &|row, start| [wide(&to[row]) - start; 2]);
    }

    /// `way` gives the two ways (m) of a particle, from its row and where it begins.
    fn go<R: Real>(
        &mut self,
        model: &Model<R>,
        from: &[Padded<R>],
        reach: f64,
        way: &(dyn Fn(usize, &Vec3<f64>) -> [Vec3<f64>; 2] + Sync),
    ) {
        self.reach = reach;
        for field in [&mut self.starts, &mut self.free, &mut self.expected] {
            field.resize(model.count, Vec3::zeros());
        }
        self.boxes.resize(model.count, WayBox::default());
        let ways = [&mut self.starts, &mut self.free, &mut self.expected].map(|field| per_row_mut(field));
        let fields = (ways, per_row_mut(&mut self.boxes), per_row(from));
        model.share.own().each(fields, |block, ([starts, free, expected], boxes, from)| {
            let first = block * model.block_size;
            for row in 0..boxes.len() {
                let x = wide(&from[row]);
                let [freely, expectedly] = way(first + row, &x);
                (starts[row], free[row], expected[row]) = (x, freely, expectedly);
                let to = x + expectedly;
                for c in 0..3 {
                    boxes[row][0][c] = x[c].min(to[c]) - reach;
                    boxes[row][1][c] = x[c].max(to[c]) + reach;
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

    /// The way (m) that is expected of a particle.
    #[inline]
    pub(crate) fn expected(&self, particle: u32) -> Vec3<f64> {
        self.expected[particle as usize]
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
        let square = self.reach * self.reach;
        let ways = self.starts.iter().zip(&self.expected);
        // What is not a number has left.
        let has_stayed = |((x, way), end): ((&Vec3<f64>, &Vec3<f64>), &Padded<R>)| {
            (wide(end) - (x + way)).norm_squared() <= square
        };
        let left = ways.zip(ends).position(|way_and_end| !has_stayed(way_and_end));
        left.map(|particle| particle as u32)
    }
}

/// A vector in binary64.
pub(crate) fn wide<R: Real>(vector: &Padded<R>) -> Vec3<f64> {
    vector.vector().map(R::to_f64)
}

//! Where particles would go in a sub-step without forces but gravity, and boxes about their ways.

use crate::{
    cloth::layout::Model,
    math::{Padded, Real, Vec3},
    parallel::per_row_mut,
};

/// The box about a way: its least and its greatest corner (m).
pub(crate) type WayBox = [[f64; 3]; 2];

/// The ways of all particles in the sub-step that is tried.
#[derive(Clone, Debug, Default)]
pub(crate) struct Ways {
    /// Where each would end (m).
    ends: Vec<Vec3<f64>>,
    /// The box about each way, wider by the thickness on each side.
    boxes: Vec<WayBox>,
    /// How far (m) from there a particle may end.
    reach: f64,
}

/// Positions and velocities at the start of a sub-step, its length (s), and gravity (m/s²).
#[derive(Clone, Copy)]
pub(crate) struct Start<'a, R: Real> {
    pub(crate) x: &'a [Padded<R>],
    pub(crate) v: &'a [Padded<R>],
    pub(crate) dt: f64,
    pub(crate) gravity: Vec3<f64>,
}

impl Ways {
    /// Ways without forces: x to x + h v + h² g, pins without gravity.
    pub(crate) fn predict<R: Real>(&mut self, model: &Model<R>, start: Start<'_, R>, reach: f64) {
        let Start { dt, gravity, .. } = start;
        self.go(model, start.x, reach, &|row| {
            let [x, v] = [start.x, start.v].map(|field| wide(&field[row]));
            let fall = if model.inv_m[row] > R::zero() { gravity * dt } else { Vec3::zeros() };
            x + (v + fall) * dt
        });
    }

    /// Ways to where a solve led.
    pub(crate) fn follow<R: Real>(&mut self, model: &Model<R>, from: &[Padded<R>], to: &[Padded<R>]) {
        let reach = self.reach;
        self.go(model, from, reach, &|row| wide(&to[row]));
    }

    fn go<R: Real>(
        &mut self,
        model: &Model<R>,
        from: &[Padded<R>],
        reach: f64,
        end: &(dyn Fn(usize) -> Vec3<f64> + Sync),
    ) {
        self.reach = reach;
        self.ends.resize(model.count, Vec3::zeros());
        self.boxes.resize(model.count, WayBox::default());
        let fields = (per_row_mut(&mut self.ends), per_row_mut(&mut self.boxes));
        model.share.own().each(fields, |block, (ends, boxes)| {
            let first = block * model.block_size;
            for (row, (to, around)) in ends.iter_mut().zip(boxes).enumerate() {
                *to = end(first + row);
                let x = wide(&from[first + row]);
                *around = std::array::from_fn(|side| {
                    std::array::from_fn(|c| match side {
                        0 => x[c].min(to[c]) - reach,
                        _ => x[c].max(to[c]) + reach,
                    })
                });
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

    /// The way (m) of a particle from its start.
    pub(crate) fn of<R: Real>(&self, x: &[Padded<R>], particle: u32) -> Vec3<f64> {
        self.ends[particle as usize] - wide(&x[particle as usize])
    }

    /// The first particle that ended farther from the end of its way than pairs were looked for, if any did.
    pub(crate) fn left<R: Real>(&self, ends: &[Padded<R>]) -> Option<u32> {
        let square = self.reach * self.reach;
        // What is not a number has left.
        let has_stayed = |(way, end): (&Vec3<f64>, &Padded<R>)| (wide(end) - way).norm_squared() <= square;
        let left = self.ends.iter().zip(ends).position(|way_and_end| !has_stayed(way_and_end));
        left.map(|particle| particle as u32)
    }
}

/// A vector in binary64.
pub(crate) fn wide<R: Real>(vector: &Padded<R>) -> Vec3<f64> {
    vector.vector().map(R::to_f64)
}

//! The figures of a cloth: in which row of the layout each corner is that frames lead, and how far corners that give way are off their frames.

use crate::{
    cloth::network::{Frames, Joined},
    math::{Padded, Real, Vec3, vec3},
};

/// How far (m) a corner is off its frame that counts as yielding.
const YIELDING: f64 = 1e-3;
/// The least mass (kg) of a corner that gives way, whose inverse is within the range of binary32: those that are lighter are pins.
const LIGHTEST: f64 = 1e-37;

/// A figure: its frames, and the row of each of its corners, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    frames: Frames,
    rows: Vec<u32>,
}

/// How far the corners of figures are off their frames.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Yield {
    /// The farthest of them (m).
    pub(crate) farthest: f64,
    /// Corners that are off by more than 1 mm.
    pub(crate) count: u64,
    /// The row of the first of these, in the order of figures and corners.
    pub(crate) first: Option<usize>,
}

impl Figure {
    /// Those of networks; `place` gives the model's numbering.
    pub(crate) fn all_of(joined: &Joined<'_>, place: &[u32]) -> Vec<Self> {
        let mut all = Vec::new();
        for (part, network) in joined.parts.iter().enumerate() {
            if let Some(frames) = network.frames.clone() {
                let rows = joined.particles(part).map(|own| place[own as usize]).collect();
                all.push(Self { frames, rows });
            }
        }
        all
    }

    /// The row of each corner, and where that is (m) at a time (s).
    pub(crate) fn at(&self, time: f64) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        self.rows().zip(self.frames.at(time))
    }

    /// The row of each corner.
    pub(crate) fn rows(&self) -> impl Iterator<Item = usize> + '_ {
        self.rows.iter().map(|row| *row as usize)
    }

    /// The row of each corner that gives way, and its mass (kg).
    pub(crate) fn giving(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.rows().zip(self.frames.masses.iter().copied()).filter(|(_, mass)| *mass > LIGHTEST)
    }
}

impl Yield {
    /// That of figures whose rows are at `x` (m), at a time (s).
    pub(crate) fn of<R: Real>(figures: &[Figure], x: &[Padded<R>], time: f64) -> Self {
        let mut found = Self::default();
        for (row, place) in figures.iter().flat_map(|figure| figure.at(time)) {
            let place: Vec3<f64> = vec3(place);
            let off = (x[row].vector().map(R::to_f64) - place).norm();
            found.farthest = found.farthest.max(off);
            if off > YIELDING {
                found.count += 1;
                found.first = found.first.or(Some(row));
            }
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloth::network::Repeat;

    #[test]
    fn a_corner_yields_that_is_farther_than_a_millimetre_from_its_frame() {
        let frames = Frames {
            places: [[0.0_f32; 3], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]].into(),
            corners: 3,
            rate: 1.0,
            start: 0.0,
            repeat: Repeat::Hold,
            masses: [0.5, 0.0, 0.25].into(),
        };
        let figure = Figure { frames, rows: vec![4, 0, 2] };
        assert_eq!(figure.giving().collect::<Vec<_>>(), [(4, 0.5), (2, 0.25)]);
        let mut x = vec![Padded::<f64>::default(); 5];
        x[0] = Padded::new(&Vec3::new(1.0, 0.0009, 0.0));
        x[2] = Padded::new(&Vec3::new(0.0, 0.0, 1.003));
        let found = Yield::of(&[figure], &x, 0.5);
        assert!((found.farthest - 0.003).abs() < 1e-12, "{found:?}");
        assert_eq!((found.count, found.first), (1, Some(2)));
        assert_eq!(Yield::of::<f64>(&[], &x, 0.5), Yield::default());
    }
}

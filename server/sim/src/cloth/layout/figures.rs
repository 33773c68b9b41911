//! The figures of a cloth: in which row of the layout each corner is that frames lead.

use crate::cloth::network::{Frames, Joined};

/// A figure: its frames, and the row of each of its corners, in their order.
#[derive(Clone, Debug)]
pub(crate) struct Figure {
    frames: Frames,
    rows: Vec<u32>,
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

    /// The row of each corner.
    pub(crate) fn rows(&self) -> impl Iterator<Item = u32> {
        self.rows.iter().copied()
    }

    /// The row of each corner, and where that is (m) at a time (s).
    pub(crate) fn at(&self, time: f64) -> impl Iterator<Item = (usize, [f64; 3])> + '_ {
        self.rows.iter().map(|row| *row as usize).zip(self.frames.at(time))
    }
}

//! What further steps of snow depend on, as bytes: taken from one, whole on rank 0 of several, and put into another of the same
//! setup.

use serde::{Deserialize, Serialize};

use super::{body::Snow, book::Book, grid::CELLS, init::settle, particles::Particles};
use crate::{
    held_length::HeldLength,
    math::{Real, bytes::raw},
};

/// What further steps depend on, and the nodes of the grid, to be looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TakenSnow {
    #[serde(with = "raw")]
    particles: Vec<u8>,
    #[serde(with = "raw")]
    nodes: Vec<u8>,
    hold: HeldLength,
    book: Book,
}

impl<R: Real> Snow<R> {
    /// Bytes of those of all ranks, on rank 0.
    fn gather(&self, own: Vec<u8>) -> Vec<u8> {
        match self.work.divided() {
            Some(ranks) => ranks.ranks.gather(&own),
            None => own,
        }
    }

    /// What further steps depend on. All ranks that step it call this together.
    pub(crate) fn take(&self) -> TakenSnow {
        let (mut particles, mut nodes) = (Vec::new(), Vec::new());
        self.work.sorter.order.iter().for_each(|at| self.state.particles.pack(*at as usize, &mut particles));
        let grid = &self.work.grid;
        let written = grid.written_blocks.iter().zip(&grid.nodes);
        for (key, block) in written.filter(|(key, _)| grid.own_keys.contains(key)) {
            nodes.extend(key.to_le_bytes());
            let start = nodes.len();
            nodes.resize(start + 4 * CELLS * R::BYTES, 0);
            let numbers = block.as_flattened().iter().zip(nodes[start..].chunks_exact_mut(R::BYTES));
            numbers.for_each(|(number, bytes)| number.write(bytes));
        }
        let [particles, nodes] = [particles, nodes].map(|own| self.gather(own));
        TakenSnow { particles, nodes, hold: self.state.hold, book: self.state.book }
    }

    /// Goes on from what was taken of the same snow.
    pub(crate) fn put(&mut self, taken: &TakenSnow) {
        (self.state.hold, self.state.book) = (taken.hold, taken.book);
        self.unpack(&taken.particles);
        settle(&self.model, &mut self.state, &mut self.work);
        // Their stresses as they were.
        self.unpack(&taken.particles);
        let grid = &mut self.work.grid;
        grid.written_blocks.clear();
        grid.nodes.clear();
        for bytes in taken.nodes.chunks_exact(8 + 4 * CELLS * R::BYTES) {
            let (key, numbers) = bytes.split_at(8);
            grid.written_blocks.push(u64::from_le_bytes(key.try_into().expect("eight bytes")));
            let mut block = [[R::zero(); 4]; CELLS];
            let out = block.as_flattened_mut().iter_mut().zip(numbers.chunks_exact(R::BYTES));
            out.for_each(|(out, bytes)| *out = R::read(bytes));
            grid.nodes.push(block);
        }
    }

    /// Takes particles over from bytes, by the user's numbers.
    fn unpack(&mut self, particles: &[u8]) {
        let place_of = self.place_of();
        for one in particles.chunks_exact(Particles::<R>::PACKED) {
            self.state.particles.unpack(one, &place_of);
        }
    }

    /// The place of each particle, by the user's number.
    fn place_of(&self) -> Vec<u32> {
        let id = &self.state.particles.id;
        let mut place_of = vec![0; id.len()];
        (0..).zip(id).for_each(|(place, id)| place_of[*id as usize] = place);
        place_of
    }

    /// Positions of all particles, with their numbers. All ranks that step it call this together.
    pub(crate) fn take_positions(&self) -> Vec<u8> {
        let (particles, mut bytes) = (&self.state.particles, Vec::new());
        for at in self.work.sorter.order.iter().map(|at| *at as usize) {
            bytes.extend(particles.id[at].to_le_bytes());
            for x in particles.x(at) {
                let start = bytes.len();
                bytes.resize(start + R::BYTES, 0);
                x.write(&mut bytes[start..]);
            }
        }
        self.gather(bytes)
    }

    /// Takes positions over, to be looked at.
    pub(crate) fn put_positions(&mut self, bytes: &[u8]) {
        let place_of = self.place_of();
        for one in bytes.chunks_exact(4 + 3 * R::BYTES) {
            let (id, x) = one.split_at(4);
            let at = place_of[u32::from_le_bytes(id.try_into().expect("four bytes")) as usize] as usize;
            let x = std::array::from_fn(|c| R::read(&x[c * R::BYTES..(c + 1) * R::BYTES]));
            let particles = &mut self.state.particles;
            particles.set_motion(at, [x, particles.v(at)], particles.plastic_ratio(at));
        }
    }
}

//! What further steps of snow depend on, as bytes: taken from one, whole on rank 0 of several, and put into another of the same
//! setup.

use serde::{Deserialize, Serialize};

use super::{
    body::Snow,
    book::Book,
    grid::{CELLS, REACH, SIDE},
    init::settle,
    particles::Particles,
};
use crate::{
    held_length::HeldLength,
    math::{Real, bytes::raw},
};

/// Blocks at the end of the grid where no particle of a state is: a step ends with an error there.
const MARGIN: i32 = 2;

/// What further steps depend on, and the nodes of the grid, to be looked at.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct TakenSnow {
    #[serde(with = "raw")]
    particles: Vec<u8>,
    #[serde(with = "raw")]
    nodes: Vec<u8>,
    hold: HeldLength,
    book: Book,
    /// Forces that calls have set (N), of each particle in the user's numbering; none where all are 0. Ranks refuse them.
    forces: Vec<[f64; 3]>,
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
        let forces = self.work.forces.clone();
        TakenSnow { particles, nodes, hold: self.state.hold, book: self.state.book, forces }
    }

    /// What keeps this snow from going on from what was taken of another one, as a sentence. It is one of a simulation that no
    /// other rank steps.
    pub(crate) fn unfit(&self, taken: &TakenSnow) -> Option<String> {
        let TakenSnow { particles, nodes, hold, book, forces } = taken;
        if HeldLength::of_numbers(hold.all_numbers()) != Some(*hold) {
            return Some(format!("no step of it is held at {hold:?}"));
        }
        if !book.is_sound() {
            return Some(format!("no energy of it is known as {book:?}"));
        }
        let count = self.state.particles.len();
        if ![0, count].contains(&forces.len()) {
            return Some(format!("{} forces act on it: none, or {count}, are needed", forces.len()));
        }
        if forces.as_flattened().iter().any(|c| !c.is_finite()) {
            return Some("a force on it is not finite".to_owned());
        }
        self.unfit_particles(particles).or_else(|| unfit_nodes::<R>(nodes))
    }

    fn unfit_particles(&self, bytes: &[u8]) -> Option<String> {
        let (count, size) = (self.state.particles.len(), Particles::<R>::PACKED);
        if bytes.len() != count * size {
            return Some(format!(
                "its particles take {} bytes: {count} of {size} bytes each are needed",
                bytes.len()
            ));
        }
        let place_of = self.place_of();
        let reach = f64::from(REACH - MARGIN) * SIDE as f64 * self.settings().cell;
        let mut has_come = vec![false; count];
        for one in bytes.chunks_exact(size) {
            match self.state.particles.check_packed(one, &place_of, reach) {
                Ok(id) if std::mem::replace(&mut has_come[id as usize], true) => {
                    return Some(format!("particle {id} is there twice"));
                }
                Ok(_) => {}
                Err(message) => return Some(message),
            }
        }
        None
    }

    /// Goes on from what was taken of the same snow.
    pub(crate) fn put(&mut self, taken: &TakenSnow) {
        (self.state.hold, self.state.book) = (taken.hold, taken.book);
        self.work.forces.clone_from(&taken.forces);
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

/// What is wrong with nodes of the grid, as a sentence. Of one without mass the velocity means nothing.
fn unfit_nodes<R: Real>(bytes: &[u8]) -> Option<String> {
    let size = 8 + 4 * CELLS * R::BYTES;
    if !bytes.len().is_multiple_of(size) {
        return Some(format!("its grid takes {} bytes: a multiple of {size} is needed", bytes.len()));
    }
    let is_sound = |node: &[u8]| {
        let numbers = [0, 1, 2, 3].map(|c| R::read(&node[c * R::BYTES..(c + 1) * R::BYTES]).to_f64());
        let has_mass = numbers[3] > 0.0;
        !has_mass || numbers.iter().all(|number| number.is_finite())
    };
    let mut blocks = bytes.chunks_exact(size).map(|block| &block[8..]);
    let all_sound = blocks.all(|block| block.chunks_exact(4 * R::BYTES).all(is_sound));
    (!all_sound).then(|| "a node of its grid has a number that is not finite".to_owned())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::snow::{Preset, SnowObject, SnowSettings, SnowSetup};

    fn made() -> Snow<f32> {
        let Preset { density, material, .. } = Preset::ALL[0];
        let x: Vec<[f64; 3]> =
            (0..8).map(|i| [i % 2, i / 2 % 2, i / 4].map(|c| 0.05 * f64::from(c))).collect();
        let object = SnowObject {
            name: "ball".to_owned(),
            v: vec![[0.0; 3]; x.len()],
            angular_velocity: [0.0; 3],
            mass: vec![1e-3 * density; x.len()],
            volume: vec![1e-3; x.len()],
            stiffness: Vec::new(),
            material,
            x,
            attach: None,
        };
        let setup = SnowSetup { objects: vec![object], settings: SnowSettings::new(0.1) };
        Snow::new(&setup).expect("good snow").0
    }

    #[test]
    fn forces_by_call_are_taken_and_put() {
        let (mut before, mut after) = (made(), made());
        before.set_forces([(3, [0.0, 2.0, 0.0])].into_iter());
        let taken = before.take();
        assert_eq!(after.unfit(&taken), None);
        after.put(&taken);
        assert_eq!(after.forces(), before.forces());
        after.put(&made().take());
        assert!(after.forces().is_empty());
    }

    #[test]
    fn what_no_snow_can_go_on_from_is_told() {
        type Spoil = fn(&mut TakenSnow);
        /// Bytes of a particle in binary32.
        const ONE: usize = Particles::<f32>::PACKED;
        let spoiled: [(Spoil, &str); 9] = [
            (|taken| taken.particles.truncate(7 * ONE), "8 of 140 bytes"),
            (|taken| taken.particles[..4].copy_from_slice(&u32::MAX.to_le_bytes()), "4294967295"),
            (|taken| taken.particles.copy_within(..ONE, ONE), "twice"),
            (|taken| taken.particles[4..8].copy_from_slice(&1e9_f32.to_le_bytes()), "number 0"),
            (|taken| taken.particles[4..8].copy_from_slice(&f32::NAN.to_le_bytes()), "NaN"),
            (|taken| taken.particles[16..20].copy_from_slice(&1e9_f32.to_le_bytes()), "never change"),
            (|taken| taken.nodes.push(0), "a multiple of 1032"),
            (|taken| taken.forces.push([0.0; 3]), "1 forces"),
            (|taken| taken.forces = vec![[f64::NAN; 3]; 8], "not finite"),
        ];
        let snow = made();
        for (spoil, named) in spoiled {
            let mut taken = snow.take();
            spoil(&mut taken);
            let told = snow.unfit(&taken).expect(named);
            assert!(told.contains(named), "{named}: {told}");
        }
    }
}

//! All that a particle carries, as bytes: its number, and 34 of the state's precision.

use super::Particles;
use crate::math::Real;

impl<R: Real> Particles<R> {
    /// Bytes of a particle that is packed.
    pub(crate) const PACKED: usize = 4 + 34 * R::BYTES;

    /// Adds a particle to bytes.
    pub(crate) fn pack(&self, at: usize, bytes: &mut Vec<u8>) {
        bytes.extend(self.id[at].to_le_bytes());
        for number in self.numbers(at) {
            let start = bytes.len();
            bytes.resize(start + R::BYTES, 0);
            number.write(&mut bytes[start..]);
        }
    }

    /// Takes over a particle from such bytes; returns its place, which `place_of` tells by its number.
    pub(crate) fn unpack(&mut self, bytes: &[u8], place_of: &[u32]) -> usize {
        let (id, numbers) = bytes.split_at(4);
        let id = u32::from_le_bytes(id.try_into().expect("four bytes"));
        let at = place_of[id as usize] as usize;
        self.numbers_mut(at)
            .zip(numbers.chunks_exact(R::BYTES))
            .for_each(|(out, bytes)| *out = R::read(bytes));
        at
    }
}

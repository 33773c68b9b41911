//! All that a particle carries, as bytes: its number, and 34 of the state's precision.

use super::Particles;
use crate::math::Real;

/// Places among the numbers of a packed particle of those that no step changes: mass, volume at rest, factor on the stiffness.
const FIXED: [usize; 3] = [3, 32, 33];

impl<R: Real> Particles<R> {
    /// Bytes of a particle that is packed.
    pub(crate) const PACKED: usize = 4 + 34 * R::BYTES;

    /// The number of a packed particle, if it may be put in place of an own one: whose place `place_of` tells by its number,
    /// with coordinates below `reach` (m).
    ///
    /// # Errors
    /// Why it may not, as a sentence.
    pub(crate) fn check_packed(&self, bytes: &[u8], place_of: &[u32], reach: f64) -> Result<u32, String> {
        let (id, numbers) = bytes.split_at(4);
        let id = u32::from_le_bytes(id.try_into().expect("four bytes"));
        let Some(at) = place_of.get(id as usize) else {
            return Err(format!("it has a particle {id}: there are {}, from 0", place_of.len()));
        };
        let own = self.numbers(*at as usize).zip(numbers.chunks_exact(R::BYTES));
        for (index, (own, bytes)) in own.enumerate() {
            let number = R::read(bytes).to_f64();
            if FIXED.contains(&index) && number != own.to_f64() {
                return Err(format!("particle {id} has other numbers that never change than this snow"));
            }
            if !number.is_finite() || (index < 3 && number.abs() >= reach) {
                return Err(format!(
                    "number {index} of particle {id} is {number}: finite ones are needed, and coordinates below {reach} m"
                ));
            }
        }
        Ok(id)
    }

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

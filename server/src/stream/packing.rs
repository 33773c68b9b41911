//! Numbers as they are on the wire, little-endian. A number that is not finite is never sent.
//!
//! Enters: numbers of the state, or of what is derived from it. Leaves: the same, or the first one that the encoding
//! cannot hold, with the particle or node that it belongs to.

use std::fmt;

use bytes::Bytes;
use rayon::prelude::*;

use super::arrays::Number;

/// Numbers that a thread checks at a time.
const BLOCK_SIZE: usize = 1 << 14;

/// What a number belongs to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Owner {
    /// A particle, over all particles of the session.
    Particle(u64),
    /// A node of the snow's grid.
    Node([i32; 3]),
}

/// A number that cannot be sent: it is not finite in the encoding asked for.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct NotFinite {
    pub owner: Owner,
    /// What the number is: position, velocity, ...
    pub quantity: &'static str,
    pub value: f64,
}

impl NotFinite {
    /// The particle whose number it is; none for a node.
    pub(crate) fn particle(&self) -> Option<u64> {
        match self.owner {
            Owner::Particle(particle) => Some(particle),
            Owner::Node(_) => None,
        }
    }
}

impl fmt::Display for NotFinite {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { owner, quantity, value } = self;
        match owner {
            Owner::Particle(particle) => write!(f, "the {quantity} of particle {particle}")?,
            Owner::Node(index) => write!(f, "the {quantity} of the grid's node {index:?}")?,
        }
        write!(f, " is not finite in the frame's encoding: {value}")
    }
}

/// Numbers of four bytes each, one after the other.
pub(super) fn packed(numbers: impl Iterator<Item = [u8; 4]>) -> Bytes {
    numbers.flatten().collect::<Vec<u8>>().into()
}

/// Checks an array over the particles, `width` numbers each, and turns it into what is on the wire; by all threads of
/// the caller's pool.
///
/// # Errors
/// The first number that is not finite.
pub(super) fn pack<T: Number>(
    numbers: &mut [T],
    width: usize,
    quantity: &'static str,
) -> Result<(), NotFinite> {
    let is_finite = |number: &T| number.to_f64().is_finite();
    let all_finite = numbers.par_chunks_mut(BLOCK_SIZE).map(|numbers| {
        let all_finite = numbers.iter().all(is_finite);
        if all_finite && cfg!(target_endian = "big") {
            for number in numbers {
                *number = number.to_wire();
            }
        }
        all_finite
    });
    if all_finite.reduce(|| true, |a, b| a && b) {
        return Ok(());
    }

    let first = numbers.iter().position(|number| !is_finite(number)).expect("one of them is not finite");
    let (owner, value) = (Owner::Particle((first / width) as u64), numbers[first].to_f64());
    Err(NotFinite { owner, quantity, value })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_number_that_is_not_finite_is_named_with_its_particle() {
        let mut numbers = [0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0];
        for (width, particle) in [(3, 1), (1, 4)] {
            let error = pack(&mut numbers, width, "position").expect_err("not finite");
            assert_eq!(error.particle(), Some(particle));
            assert!(error.to_string().contains(&format!("position of particle {particle} ")), "{error}");
        }
    }
}

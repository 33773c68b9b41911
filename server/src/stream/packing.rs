//! Numbers to little-endian bytes. A number that is not finite is never sent.
//!
//! Enters: components of the state, or of what is derived from it. Leaves: bytes, or the first
//! number that the encoding cannot hold, with the particle or node that it belongs to.

use std::fmt;

use bytes::Bytes;

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

/// A number of the state, and its little-endian bytes.
pub(crate) trait Component: Copy {
    const BYTES: usize;

    fn to_f64(self) -> f64;

    /// Writes its bytes over `out`, which has [`Self::BYTES`].
    fn write(self, out: &mut [u8]);
}

impl Component for f32 {
    const BYTES: usize = 4;

    fn to_f64(self) -> f64 {
        f64::from(self)
    }

    fn write(self, out: &mut [u8]) {
        out.copy_from_slice(&self.to_le_bytes());
    }
}

impl Component for f64 {
    const BYTES: usize = 8;

    fn to_f64(self) -> f64 {
        self
    }

    fn write(self, out: &mut [u8]) {
        out.copy_from_slice(&self.to_le_bytes());
    }
}

/// Packs an array over the particles, `width` components each.
///
/// # Errors
/// The first component that is not finite.
pub(crate) fn pack<T: Component>(
    components: &[T],
    width: usize,
    quantity: &'static str,
) -> Result<Bytes, NotFinite> {
    if let Some(i) = components.iter().position(|c| !c.to_f64().is_finite()) {
        let (owner, value) = (Owner::Particle((i / width) as u64), components[i].to_f64());
        return Err(NotFinite { owner, quantity, value });
    }

    let mut packed = vec![0; components.len() * T::BYTES];
    for (bytes, component) in packed.chunks_exact_mut(T::BYTES).zip(components) {
        component.write(bytes);
    }
    Ok(packed.into())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn arrays_are_little_endian() {
        let packed = pack(&[1.0_f32, -0.0, 2.5], 3, "position").expect("finite");
        assert_eq!(packed[..4], [0, 0, 0x80, 0x3f]);
        assert_eq!(packed[4..8], [0, 0, 0, 0x80]);
        let packed = pack(&[1.0_f64], 1, "stress norm").expect("finite");
        assert_eq!(packed[..], [0, 0, 0, 0, 0, 0, 0xf0, 0x3f]);
    }

    #[test]
    fn a_number_that_is_not_finite_is_named_with_its_particle() {
        let numbers = [0.0, 0.0, 0.0, 0.0, f64::NAN, 0.0];
        for (width, particle) in [(3, 1), (1, 4)] {
            let error = pack(&numbers, width, "position").expect_err("not finite");
            assert_eq!(error.particle(), Some(particle));
            assert!(error.to_string().contains(&format!("position of particle {particle} ")), "{error}");
        }
    }
}

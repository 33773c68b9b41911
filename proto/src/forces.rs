//! Forces and pulls of the contract as lists of numbers.

use crate::v1;

impl v1::ForceUpdate {
    /// The particles that are named, by their indices within the body; none where all are meant, or left out.
    pub fn particles(&self) -> Vec<u32> {
        numbers(&self.particles_u32)
    }

    /// The force on each of them (N), where these are not the same.
    pub fn forces(&self) -> Vec<[f64; 3]> {
        vectors(&self.forces_f64)
    }
}

impl v1::PullUpdate {
    /// The particles that are named, by their indices within the body; none where all are meant, or left out.
    pub fn particles(&self) -> Vec<u32> {
        numbers(&self.particles_u32)
    }

    /// Where each of them is drawn to (m); none where their pulls end, or left out.
    pub fn points(&self) -> Vec<[f64; 3]> {
        vectors(&self.points_f64)
    }
}

fn numbers(bytes: &[u8]) -> Vec<u32> {
    bytes.as_chunks::<4>().0.iter().map(|bytes| u32::from_le_bytes(*bytes)).collect()
}

fn vectors(bytes: &[u8]) -> Vec<[f64; 3]> {
    let numbers = bytes.as_chunks::<8>().0.iter();
    let numbers: Vec<f64> = numbers.map(|bytes| f64::from_le_bytes(*bytes)).collect();
    numbers.as_chunks::<3>().0.to_vec()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_are_what_was_packed() {
        let forces = [[0.0, -1.5, 1e9], [f64::MIN_POSITIVE, 0.1, -0.0]];
        let update = v1::ForceUpdate {
            particles_u32: [7_u32, u32::MAX].iter().flat_map(|particle| particle.to_le_bytes()).collect(),
            forces_f64: forces.as_flattened().iter().flat_map(|number| number.to_le_bytes()).collect(),
            ..v1::ForceUpdate::default()
        };
        assert_eq!((update.particles(), update.forces()), (vec![7, u32::MAX], forces.to_vec()));
        let v1::ForceUpdate { particles_u32, forces_f64: points_f64, .. } = update;
        let pull = v1::PullUpdate { particles_u32, points_f64, ..v1::PullUpdate::default() };
        assert_eq!((pull.particles(), pull.points()), (vec![7, u32::MAX], forces.to_vec()));
        let all = v1::ForceUpdate::default();
        assert!(all.particles().is_empty() && all.forces().is_empty());
    }
}

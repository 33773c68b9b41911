//! Seeded random numbers: hashes of a seed and indices, the same bits on every platform.
//!
//! The finalizer of splitmix64 (Steele, Lea, Flood 2014) over integers; uniform numbers keep the
//! upper 53 bits, so that each is exact. Committed hashes depend on these bits: tests and benchmarks that
//! need other random numbers use `fastrand`.

/// What a number is drawn for: streams of one seed do not meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u64)]
pub(crate) enum Stream {
    Position = 1,
    Dart = 2,
    Thin = 3,
    Density = 4,
    Stiffness = 5,
}

fn mix(value: u64) -> u64 {
    let value = value.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let value = (value ^ (value >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    value ^ (value >> 31)
}

/// A hash of a seed, a stream and indices.
pub(super) fn hash(seed: u32, stream: Stream, indices: [i64; 3]) -> u64 {
    let start = mix(u64::from(seed) | (stream as u64) << 32);
    indices.iter().fold(start, |hash, index| mix(hash ^ *index as u64))
}

/// From 0 and below 1.
fn unit(bits: u64) -> f64 {
    (bits >> 11) as f64 / (1u64 << 53) as f64
}

/// From -1 and below 1.
pub(super) fn signed(bits: u64) -> f64 {
    2.0 * unit(bits) - 1.0
}

/// A sequence of numbers, each from 0 and below 1.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sequence(u64);

impl Sequence {
    pub(super) fn new(seed: u32, stream: Stream, indices: [i64; 3]) -> Self {
        Self(hash(seed, stream, indices))
    }

    pub(super) fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        unit(mix(self.0))
    }

    /// Three numbers, each from 0 and below 1.
    pub(super) fn point(&mut self) -> [f64; 3] {
        [self.next(), self.next(), self.next()]
    }

    /// A whole number below `count`, at least 1.
    pub(super) fn below(&mut self, count: usize) -> usize {
        ((self.next() * count as f64) as usize).min(count - 1)
    }
}

#[cfg(test)]
mod tests {
    use super::{Sequence, Stream, hash, signed, unit};

    #[test]
    fn the_bits_are_those_of_splitmix64() {
        // The generator's published first output for the seed 1234567.
        let mut state: u64 = 1_234_567;
        assert_eq!(super::mix(state), 6_457_827_717_110_365_317);
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        assert_eq!(super::mix(state), 3_203_168_211_198_807_973);
    }

    #[test]
    fn numbers_fill_their_range_evenly() {
        let mut sequence = Sequence::new(7, Stream::Dart, [0; 3]);
        let values: Vec<f64> = (0..20_000).map(|_| sequence.next()).collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        // Standard deviation of the mean: sqrt(1/12/20000) = 0.002; five of them.
        assert!((mean - 0.5).abs() < 0.01, "{mean}");
        assert!(values.iter().all(|v| (0.0..1.0).contains(v)));
        assert_eq!((unit(0), signed(0)), (0.0, -1.0));
        assert!(unit(u64::MAX) < 1.0);
        assert!((0..1000).map(|_| sequence.below(3)).all(|i| i < 3));
    }

    #[test]
    fn seeds_streams_and_indices_give_other_numbers() {
        let one = hash(0, Stream::Position, [1, 2, 3]);
        assert_ne!(one, hash(1, Stream::Position, [1, 2, 3]));
        assert_ne!(one, hash(0, Stream::Density, [1, 2, 3]));
        assert_ne!(one, hash(0, Stream::Position, [2, 1, 3]));
        assert_ne!(one, hash(0, Stream::Position, [1, 2, -3]));
    }
}

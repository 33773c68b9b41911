//! Numbers at random from a seed: SplitMix64.

/// What the next number is drawn from.
pub(crate) struct Random(u64);

impl Random {
    pub(crate) fn new(seed: u64) -> Self {
        Self(seed)
    }

    fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        mixed ^ (mixed >> 31)
    }

    /// A number from 0 on, below 1.
    pub(super) fn share(&mut self) -> f64 {
        (self.draw() >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of so many places.
    pub(crate) fn below(&mut self, count: usize) -> usize {
        (self.draw() % count as u64) as usize
    }
}

#[test]
fn numbers_are_those_of_splitmix64_and_cover_their_range() {
    let mut random = Random::new(1_234_567);
    // The first numbers of the reference by Vigna.
    assert_eq!([random.draw(), random.draw()], [6_457_827_717_110_365_317, 3_203_168_211_198_807_973]);
    let shares: Vec<f64> = (0..1000).map(|_| random.share()).collect();
    assert!(shares.iter().all(|share| (0.0..1.0).contains(share)));
    assert!(shares.iter().any(|share| *share < 0.01) && shares.iter().any(|share| *share > 0.99));
    assert!((0..5).all(|place| (0..1000).any(|_| random.below(5) == place)));
}

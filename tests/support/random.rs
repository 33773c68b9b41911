//! Random numbers to test with, the same in every run.

use nappe_sim::math::Mat3;

/// Numbers that follow from a seed.
#[derive(Clone, Debug)]
pub struct Random(fastrand::Rng);

impl Random {
    /// The numbers of `seed`.
    pub fn seeded(seed: u64) -> Self {
        Self(fastrand::Rng::with_seed(seed))
    }

    /// A number in -1..1.
    pub fn number(&mut self) -> f64 {
        2.0 * self.0.f64() - 1.0
    }

    /// A number between two others.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.0.f64()
    }

    /// A number between two others above 0, even over their decades.
    pub fn decades(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.0.f64())
    }

    /// A whole number between two others, both included.
    pub fn whole(&mut self, low: u32, high: u32) -> u32 {
        self.0.u32(low..=high)
    }

    /// Whether something happens that has a chance of so much.
    pub fn chance(&mut self, of: f64) -> bool {
        self.0.f64() < of
    }

    /// One of a list.
    pub fn pick<T: Copy>(&mut self, of: &[T]) -> T {
        of[self.0.usize(..of.len())]
    }

    /// A vector of length 1.
    pub fn direction(&mut self) -> [f64; 3] {
        loop {
            let vector = self.vector();
            let length = vector.iter().map(|c| c * c).sum::<f64>().sqrt();
            if (0.1..=1.0).contains(&length) {
                return vector.map(|c| c / length);
            }
        }
    }

    /// Three numbers in -1..1.
    pub fn vector(&mut self) -> [f64; 3] {
        [self.number(), self.number(), self.number()]
    }

    /// Nine numbers in -1..1.
    pub fn matrix(&mut self) -> Mat3<f64> {
        Mat3::from_fn(|_, _| self.number())
    }

    /// A rotation: of a random quaternion.
    pub fn rotation(&mut self) -> Mat3<f64> {
        let [[a, b, c], [d, ..]] = [self.vector(), self.vector()];
        let length = (a * a + b * b + c * c + d * d).sqrt();
        let [w, x, y, z] = [a, b, c, d].map(|n| n / length);

        Mat3::new(
            1.0 - 2.0 * (y * y + z * z),
            2.0 * (x * y - w * z),
            2.0 * (x * z + w * y),
            2.0 * (x * y + w * z),
            1.0 - 2.0 * (x * x + z * z),
            2.0 * (y * z - w * x),
            2.0 * (x * z - w * y),
            2.0 * (y * z + w * x),
            1.0 - 2.0 * (x * x + y * y),
        )
    }

    /// A rotated and sheared deformation whose singular values lie between two numbers.
    pub fn deformation(&mut self, low: f64, high: f64) -> Mat3<f64> {
        let stretches = [0; 3].map(|_| self.between(low, high));
        self.rotation() * Mat3::from_diagonal(&stretches.into()) * self.rotation()
    }
}

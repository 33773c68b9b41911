//! A particle on an anchored spring, undamped: x(t) = L + A cos ωt.

use nappe_sim::{cloth::Integrator, math::Precision};

use crate::{
    Scene,
    networks::chain,
    scene::{advance, positions},
};

/// A particle of 1 kg on a spring of rest length 1 m, pulled by `amplitude` and let go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Oscillator {
    /// Angular frequency ω (rad/s).
    pub omega: f64,
    /// Amplitude A (m).
    pub amplitude: f64,
}

impl Oscillator {
    const REST_LENGTH: f64 = 1.0;

    /// The position (m) at `time` (s).
    pub fn position(&self, time: f64) -> f64 {
        Self::REST_LENGTH + self.amplitude * (self.omega * time).cos()
    }

    /// Distance (m) from the closed form after `count` steps that last `time` (s) together.
    pub fn error(&self, integrator: Integrator, time: f64, count: u32) -> f64 {
        let start = [[0.0; 3], [self.position(0.0), 0.0, 0.0]];
        let mut network = chain(&start, Self::REST_LENGTH, self.omega * self.omega, 0.0, 1.0);
        network.pins = vec![0];
        let mut scene = Scene::new(network, time / f64::from(count));
        scene.settings.integrator = integrator;
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, u64::from(count));
        (positions(&simulation)[1][0] - self.position(time)).abs()
    }
}

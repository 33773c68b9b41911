//! Seeded noise: a factor for each particle, from 1 - amplitude to 1 + amplitude.
//!
//! Without a length each particle has a number of its own. With one, numbers stand on a lattice of
//! that spacing and are blended between, so that neighbours are alike.

use nappe_sim::interrupt;

use super::hash::{Stream, hash, signed};

/// How one quantity varies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Noise {
    pub(crate) seed: u32,
    pub(crate) stream: Stream,
    /// Largest relative difference from the mean.
    pub(crate) amplitude: f64,
    /// Distance over which it changes (m); none: each particle alone.
    pub(crate) length: Option<f64>,
}

impl Noise {
    /// A factor for each position.
    pub(crate) fn factors(&self, points: &[[f64; 3]]) -> Vec<f64> {
        let value = |(i, point): (usize, &[f64; 3])| match self.length {
            Some(length) => self.smooth(point.map(|c| c / length)),
            None => self.at([i as i64, 0, 0]),
        };
        points
            .iter()
            .enumerate()
            .inspect(|_| interrupt::point())
            .map(|p| 1.0 + self.amplitude * value(p))
            .collect()
    }

    /// From -1 and below 1.
    fn at(&self, indices: [i64; 3]) -> f64 {
        signed(hash(self.seed, self.stream, indices))
    }

    /// Between eight values, with the weights t² (3 - 2 t): continuous slope.
    fn smooth(&self, scaled: [f64; 3]) -> f64 {
        let low = scaled.map(f64::floor);
        let weight = [0, 1, 2].map(|c| {
            let t = scaled[c] - low[c];
            t * t * (3.0 - 2.0 * t)
        });

        let mut sum = 0.0;
        for corner in 0..8_i64 {
            let bits = [corner & 1, corner >> 1 & 1, corner >> 2];
            let share: f64 = (0..3).map(|c| if bits[c] == 1 { weight[c] } else { 1.0 - weight[c] }).product();
            sum += share * self.at([0, 1, 2].map(|c| low[c] as i64 + bits[c]));
        }

        sum
    }
}

#[cfg(test)]
mod tests {
    use super::{Noise, Stream};

    const ALONE: Noise = Noise { seed: 3, stream: Stream::Density, amplitude: 0.3, length: None };

    fn line(count: i32, spacing: f64) -> Vec<[f64; 3]> {
        (0..count).map(|i| [f64::from(i) * spacing - 1.0, 0.2, 0.1]).collect()
    }

    #[test]
    fn factors_stay_within_the_amplitude_and_reach_most_of_it() {
        for noise in [ALONE, Noise { length: Some(0.1), ..ALONE }] {
            let factors = noise.factors(&line(5000, 0.037));
            let (low, high) = factors.iter().fold((2.0_f64, 0.0_f64), |(l, h), f| (l.min(*f), h.max(*f)));
            assert!((0.7..0.8).contains(&low) && (1.2..=1.3).contains(&high), "{low} {high}");
        }
    }

    #[test]
    fn smooth_noise_changes_little_over_a_little_way() {
        let noise = Noise { length: Some(0.5), ..ALONE };
        let factors = noise.factors(&line(2000, 0.001));
        let jump = factors.windows(2).map(|w| (w[1] - w[0]).abs()).fold(0.0, f64::max);
        // The steepest slope is 3/2 of the largest difference, 2 amplitudes, over a length.
        assert!(jump > 0.0 && jump <= 1.5 * 2.0 * 0.3 / 0.5 * 0.001, "{jump}");
    }

    #[test]
    fn a_particle_of_a_still_lattice_keeps_its_value() {
        let noise = Noise { length: Some(1.0), ..ALONE };
        let at_node = noise.factors(&[[2.0, -1.0, 0.0]])[0];
        assert_eq!(at_node, 1.0 + 0.3 * noise.at([2, -1, 0]));
    }
}

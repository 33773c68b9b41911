//! Times at which runs are compared.

use thiserror::Error;

/// Times at which runs are compared: multiples of an interval, which steps divide.
#[derive(Clone, Debug, PartialEq)]
pub struct Times {
    /// The interval (s): the time step of the scene times a power of two.
    pub interval: f64,
    /// Multiples of it, growing.
    pub marks: Vec<u64>,
}

/// A time that no step ends at, or that is none.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum TimesError {
    /// Not above 0.
    #[error("{0} s is no time to compare at: a number of seconds above 0 is needed")]
    NotAbove0(f64),
    /// Between two steps.
    #[error("{time} s is no multiple of the time step of the scene, {dt} s: the nearest are {} s and {} s", nearest[0], nearest[1])]
    BetweenSteps {
        /// What was asked for (s).
        time: f64,
        /// Time step of the scene (s).
        dt: f64,
        /// The multiples around it (s).
        nearest: [f64; 2],
    },
}

/// Least number of comparison times that a window is divided into, if it can be.
const LEAST: u64 = 16;

impl Times {
    /// Evenly spaced: as many intervals.
    pub(crate) fn even(interval: f64, count: u64) -> Self {
        Self { interval, marks: (1..=count).collect() }
    }

    /// These times (s), for a time step of the scene (s).
    ///
    /// # Errors
    /// One that is no multiple of the time step.
    pub fn at(times: &[f64], dt: f64) -> Result<Self, TimesError> {
        let mut steps = times.iter().map(|time| steps(*time, dt)).collect::<Result<Vec<_>, _>>()?;
        steps.sort_unstable();
        steps.dedup();
        Ok(Self::of_steps(&steps, dt))
    }

    /// 16 to 31 times until a time (s) that ends them, fewer where there are fewer steps.
    ///
    /// # Errors
    /// A time that is no multiple of the time step (s).
    pub fn until(end: f64, dt: f64) -> Result<Self, TimesError> {
        let end = steps(end, dt)?;
        let stride = 1 << (end / LEAST).max(1).ilog2();
        let marks: Vec<u64> = (0..end / stride).rev().map(|k| end - k * stride).collect();
        Ok(Self::of_steps(&marks, dt))
    }

    /// 16 to 31 times within so many steps (s), fewer where there are fewer.
    pub(crate) fn of_first(steps: u64, dt: f64) -> Self {
        let stride = 1 << (steps / LEAST).max(1).ilog2();
        Self::even(dt * stride as f64, steps / stride)
    }

    /// Every step (s) until a time (s); every second, fourth, ... of them where all are more than so many.
    pub(crate) fn every_step(end: f64, dt: f64, most: u64) -> Self {
        let steps = (end / dt + 1e-6) as u64;
        let mut stride = 1;
        while steps / stride > most.max(1) {
            stride *= 2;
        }
        Self::even(dt * stride as f64, steps / stride)
    }

    /// The same times in steps (s) that divide the interval.
    pub(crate) fn in_steps(&self, dt: f64) -> Self {
        let ratio = (self.interval / dt).round().max(1.0) as u64;
        Self { interval: dt, marks: self.marks.iter().map(|mark| mark * ratio).collect() }
    }

    /// The longest interval, a power of two of steps, that all of these numbers of steps are multiples of.
    fn of_steps(steps: &[u64], dt: f64) -> Self {
        let zeros = steps.iter().map(|step| step.trailing_zeros()).min().unwrap_or(0);
        let marks = steps.iter().map(|step| step >> zeros).collect();
        Self { interval: dt * (1_u64 << zeros) as f64, marks }
    }

    /// The intervals until the last time.
    pub fn count(&self) -> u64 {
        self.marks.last().copied().unwrap_or(0)
    }

    /// The last time (s).
    pub fn end(&self) -> f64 {
        self.time(self.count())
    }

    /// The time (s) of a multiple of the interval.
    pub fn time(&self, mark: u64) -> f64 {
        self.interval * mark as f64
    }

    /// The times that are multiples of a longer interval (s), a power of two times this one; with their places among these.
    pub(crate) fn coarser(&self, interval: f64) -> (Self, Vec<usize>) {
        let ratio = (interval / self.interval).round().max(1.0) as u64;
        let kept = self.marks.iter().enumerate().filter(|(_, mark)| mark.is_multiple_of(ratio));
        let (places, marks) = kept.map(|(place, mark)| (place, mark / ratio)).unzip();
        (Self { interval: self.interval * ratio as f64, marks }, places)
    }
}

/// The steps of `dt` (s) until a time (s).
fn steps(time: f64, dt: f64) -> Result<u64, TimesError> {
    if !(time.is_finite() && time > 0.0) {
        return Err(TimesError::NotAbove0(time));
    }
    let steps = (time / dt).round();
    // A time is written in a few digits.
    if steps < 1.0 || (time / dt - steps).abs() > 1e-6 * steps {
        let below = (time / dt).floor().max(1.0);
        // In as few digits as tell them apart, not in all that binary numbers have.
        let nearest = [below, below + 1.0].map(|steps| (steps * dt * 1e9).round() / 1e9);
        return Err(TimesError::BetweenSteps { time, dt, nearest });
    }
    Ok(steps as u64)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_are_multiples_of_the_longest_interval_that_steps_of_two_divide() {
        let dt = 1.0 / 60.0;
        let times = Times::at(&[0.2, 0.4, 0.2], dt).expect("12 and 24 steps");
        assert_eq!((times.interval, &times.marks[..]), (4.0 * dt, &[3, 6][..]));
        assert!((times.end() - 0.4).abs() < 1e-12);
        assert_eq!(Times::at(&[0.2], 0.008).expect("25 steps").marks, [25]);

        for (end, count, interval) in
            [(32, 16, 2.0), (51, 25, 1.0), (16, 16, 1.0), (5, 5, 1.0), (1000, 31, 8.0)]
        {
            let times = Times::until(f64::from(end) * dt, dt).expect("a multiple");
            assert_eq!((times.marks.len(), times.interval / dt), (count, interval), "{end} steps");
            assert!((times.end() - f64::from(end) * dt).abs() < 1e-12);
        }

        let (coarse, places) = Times { interval: 0.25, marks: vec![1, 2, 3, 4] }.coarser(0.5);
        assert_eq!((coarse.interval, coarse.marks, places), (0.5, vec![1, 2], vec![1, 3]));
    }

    #[test]
    fn a_window_of_every_step_ends_at_the_last_step_within_it() {
        for (end, dt, most, count, interval) in [
            (0.145, 0.01, 1000, 14, 0.01),
            (0.15, 0.01, 1000, 15, 0.01),
            (0.009, 0.01, 1000, 0, 0.01),
            (1.0, 0.001, 300, 250, 0.004),
            (1.0, 0.001, 0, 1, 0.512),
        ] {
            let times = Times::every_step(end, dt, most);
            assert_eq!((times.count(), times.interval), (count, interval), "{end} s in steps of {dt} s");
            assert!(times.end() <= end * (1.0 + 1e-9), "{end} s in steps of {dt} s");
        }
        let times = Times { interval: 0.04, marks: vec![1, 3] };
        assert_eq!(times.in_steps(0.01), Times { interval: 0.01, marks: vec![4, 12] });
    }

    #[test]
    fn a_time_between_steps_is_refused_with_the_two_nearest() {
        let message = Times::at(&[0.11], 0.02).expect_err("5.5 steps").to_string();
        assert_eq!(
            message,
            "0.11 s is no multiple of the time step of the scene, 0.02 s: the nearest are 0.1 s and 0.12 s"
        );
        assert_eq!(
            Times::until(0.001, 0.02).expect_err("no step"),
            TimesError::BetweenSteps { time: 0.001, dt: 0.02, nearest: [0.02, 0.04] }
        );
        assert_eq!(
            Times::until(f64::NAN, 0.02).map_err(|error| error.to_string().contains("above 0")),
            Err(true)
        );
    }
}

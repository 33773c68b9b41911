//! The velocity of the medium: one, or keys over time.

use serde::{Deserialize, Serialize};

/// What the medium does.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Wind {
    /// Its velocity (m/s) where there are no keys.
    steady: [f64; 3],
    /// Times (s), growing, each with the velocity then (m/s): straight between them, and as at the nearest one before the
    /// first and after the last.
    keys: Vec<(f64, [f64; 3])>,
}

impl Wind {
    /// Along keys, which grow in time; the same at all times where there are none.
    pub(crate) fn new(steady: [f64; 3], keys: &[(f64, [f64; 3])]) -> Self {
        Self { steady, keys: keys.to_vec() }
    }

    /// The same velocity (m/s) from now on.
    pub(crate) fn set(&mut self, steady: [f64; 3]) {
        *self = Self { steady, keys: Vec::new() };
    }

    /// Velocity (m/s) at a time (s).
    pub(crate) fn at(&self, time: f64) -> [f64; 3] {
        let next = self.keys.partition_point(|(at, _)| *at <= time);
        let after = self.keys.get(next);
        let before = next.checked_sub(1).map(|before| &self.keys[before]);
        match (before, after) {
            (Some((from, a)), Some((to, b))) => {
                let share = (time - from) / (to - from);
                std::array::from_fn(|c| a[c] + share * (b[c] - a[c]))
            }
            (Some((_, velocity)), None) | (None, Some((_, velocity))) => *velocity,
            (None, None) => self.steady,
        }
    }

    /// Its numbers, for a hash.
    pub(crate) fn numbers(&self) -> impl Iterator<Item = f64> {
        let keys = self.keys.iter().flat_map(|(time, [x, y, z])| [*time, *x, *y, *z]);
        self.steady.into_iter().chain(keys)
    }

    /// What is wrong with it, as a sentence.
    pub(crate) fn unsound(&self) -> Option<String> {
        if self.steady.iter().any(|c| !c.is_finite()) {
            return Some(format!("the velocity of the wind is not finite: {:?}", self.steady));
        }
        Self::invalid(&self.keys)
    }

    /// What is wrong with keys, as a sentence.
    pub(crate) fn invalid(keys: &[(f64, [f64; 3])]) -> Option<String> {
        let is_finite = |(time, velocity): &(f64, [f64; 3])| {
            time.is_finite() && *time >= 0.0 && velocity.iter().all(|c| c.is_finite())
        };
        if let Some(key) = keys.iter().position(|key| !is_finite(key)) {
            return Some(format!(
                "key {key} of the wind is {:?}: finite numbers from time 0 on are needed",
                keys[key]
            ));
        }
        let back = (1..keys.len()).find(|key| keys[*key].0 <= keys[key - 1].0)?;
        let (time, after) = (keys[back].0, keys[back - 1].0);
        Some(format!("key {back} of the wind is at {time} s: a time after {after} s is needed"))
    }
}

#[cfg(test)]
mod tests {
    use super::Wind;

    #[test]
    fn wind_is_straight_between_keys_and_stays_before_the_first_and_after_the_last() {
        let gust = [(1.0, [1.0, 0.0, 0.0]), (2.0, [5.0, 0.0, 2.0]), (4.0, [1.0, 0.0, 0.0])];
        let mut wind = Wind::new([9.0; 3], &gust);
        for (time, expected) in [
            (0.0, [1.0, 0.0, 0.0]),
            (1.0, [1.0, 0.0, 0.0]),
            (1.5, [3.0, 0.0, 1.0]),
            (2.0, [5.0, 0.0, 2.0]),
            (3.5, [2.0, 0.0, 0.5]),
            (4.0, [1.0, 0.0, 0.0]),
            (1e9, [1.0, 0.0, 0.0]),
        ] {
            assert_eq!(wind.at(time), expected, "at {time} s");
        }
        wind.set([2.0; 3]);
        assert_eq!((wind.at(0.0), wind.at(3.0)), ([2.0; 3], [2.0; 3]));
        assert_eq!(Wind::new([9.0; 3], &[]).at(1.0), [9.0; 3]);
    }

    #[test]
    fn keys_that_do_not_grow_are_told() {
        let key = |time: f64| (time, [0.0; 3]);
        assert_eq!(Wind::invalid(&[key(0.0), key(1.0)]), None);
        for wrong in [vec![key(1.0), key(1.0)], vec![key(-1.0)], vec![(0.0, [0.0, f64::NAN, 0.0])]] {
            assert!(Wind::invalid(&wrong).is_some(), "{wrong:?}");
        }
    }
}

//! What is known of cloth that sleeps, or did: how seldom it is stepped, and how far off that may have made it.

use serde::{Deserialize, Serialize};

use crate::report::{Wake, WakeCause};

/// Steps of the scene from one long step to the next at first, and at most; powers of two.
const PERIODS: [u32; 2] = [8, 1024];
/// How many times what long steps add up to is told: it is an estimate, and the largest change of one particle is not the error of another.
const TOLD: f64 = 4.0;

/// What a long step did, or what it may do, of the particle that it did most to (m).
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Found {
    /// How far it went.
    pub(super) way: f64,
    /// H |dv| / 2: the leading error of an implicit step of length H.
    pub(super) change: f64,
}

/// How a cloth sleeps. Lengths are in m.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub(super) struct Sleep {
    /// Steps of the scene from one long step to the next; 0 of what is awake.
    period: u32,
    /// Steps of the scene since the last long step, or since it fell asleep.
    behind: u32,
    /// Steps of the scene in the last long step; of what has not taken one, in a window.
    length: u32,
    /// The largest way within these.
    way: f64,
    /// What all long steps may have been off, with what was left out when it woke.
    sum: f64,
    /// The wind (m/s) that it fell asleep in.
    wind: [f64; 3],
    /// Whether it stays awake, since its error has come above that of the scene.
    is_barred: bool,
    long_steps: u64,
    wakes: u64,
    wake: Option<Wake>,
}

impl Sleep {
    /// Whether it sleeps.
    pub(super) fn is_asleep(&self) -> bool {
        self.period > 0
    }

    /// Whether it may fall asleep where it may be so far off (m).
    pub(super) fn may_fall(&self, error: f64) -> bool {
        !self.is_asleep() && !self.is_barred && self.told() <= error
    }

    /// Falls asleep after a window with that largest way, in a wind (m/s).
    pub(super) fn fall(&mut self, way: f64, wind: [f64; 3]) {
        let [first, _] = PERIODS;
        (self.period, self.behind, self.length) = (first, 0, first);
        (self.way, self.wind) = (way, wind);
    }

    /// Counts the step of the scene with this number, from 1; how many steps the long one covers that is due after it, if one is.
    pub(super) fn pass(&mut self, step: u64) -> Option<u32> {
        if !self.is_asleep() {
            return None;
        }
        self.behind += 1;
        step.is_multiple_of(self.period.into()).then_some(self.behind)
    }

    /// Takes a long step over, which did no more than it may: the next one comes after twice the time where it did half as much.
    pub(super) fn take(&mut self, found: Found, may: Found) {
        let [_, most] = PERIODS;
        let is_whole = self.behind == self.period;
        (self.length, self.behind) = (self.behind, 0);
        self.way = found.way;
        self.sum += found.change;
        self.long_steps += 1;
        if is_whole && 2.0 * found.change <= may.change && 2.0 * found.way <= may.way {
            self.period = (2 * self.period).min(most);
        }
    }

    /// Wakes, where positions may be off by so much (m) since a long step is not taken, or by the way that is likely.
    pub(super) fn wake(&mut self, wake: Wake, off: f64) {
        self.sum += self.way_of(self.behind).max(off);
        (self.period, self.behind) = (0, 0);
        self.is_barred |= wake.cause == WakeCause::Error;
        self.wakes += 1;
        self.wake = Some(wake);
    }

    /// An estimate of how far off positions are.
    pub(super) fn told(&self) -> f64 {
        TOLD * (self.sum + self.way_of(self.period))
    }

    /// The way that so many steps of the scene are likely to take.
    fn way_of(&self, steps: u32) -> f64 {
        self.way * (f64::from(steps) / f64::from(self.length.max(1)))
    }

    /// The wind (m/s) that it fell asleep in.
    pub(super) fn wind(&self) -> [f64; 3] {
        self.wind
    }

    /// Long steps, how often it woke, and the last time.
    pub(super) fn counts(&self) -> (u64, u64, Option<Wake>) {
        (self.long_steps, self.wakes, self.wake)
    }

    /// Whether it can be gone on with.
    pub(super) fn is_sound(&self) -> bool {
        let [first, most] = PERIODS;
        let is_period = (first..=most).contains(&self.period) && self.period.is_power_of_two();
        let is_counted = self.behind < self.period.max(1) && self.length <= most;
        let lengths = [self.way, self.sum];
        (self.period == 0 || is_period)
            && is_counted
            && lengths.into_iter().all(|length| length.is_finite() && length >= 0.0)
            && self.wind.iter().all(|c| c.is_finite())
    }

    /// What steps depend on, as numbers; none of what never slept.
    pub(super) fn numbers(&self) -> Option<[f64; 11]> {
        let [x, y, z] = self.wind;
        let counts = [self.period, self.behind, self.length].map(f64::from);
        let [period, behind, length] = counts;
        let barred = f64::from(u8::from(self.is_barred));
        let [long_steps, wakes] = [self.long_steps, self.wakes].map(|count| count as f64);
        let numbers = [period, behind, length, self.way, self.sum, barred, long_steps, wakes, x, y, z];
        (*self != Self::default()).then_some(numbers)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const STILL: Found = Found { way: 0.0, change: 0.0 };
    const MAY: Found = Found { way: 1e-3, change: 1e-4 };

    fn asleep() -> Sleep {
        let mut sleep = Sleep::default();
        sleep.fall(1e-5, [0.0; 3]);
        sleep
    }

    /// Steps of the scene, of `count` from 1 on, after which long steps are due that find the same.
    fn due(sleep: &mut Sleep, count: u64, found: Found) -> Vec<(u64, u32)> {
        let mut due = Vec::new();
        for step in 1..=count {
            if let Some(steps) = sleep.pass(step) {
                due.push((step, steps));
                sleep.take(found, MAY);
            }
        }
        due
    }

    #[test]
    fn periods_double_up_to_1024_while_long_steps_do_half_of_what_they_may() {
        let found = due(&mut asleep(), 4096, STILL);
        let first: Vec<u64> = found.iter().map(|(step, _)| *step).take(8).collect();
        assert_eq!(first, [8, 16, 32, 64, 128, 256, 512, 1024]);
        assert_eq!(found.last(), Some(&(4096, 1024)));
        // Every step of the scene is covered once.
        assert_eq!(found.iter().map(|(_, steps)| u64::from(*steps)).sum::<u64>(), 4096);
        for lively in [Found { way: 0.6e-3, ..STILL }, Found { change: 0.6e-4, ..STILL }] {
            let found = due(&mut asleep(), 64, lively);
            assert!(found.len() == 8 && found.iter().all(|(_, steps)| *steps == 8), "{found:?}");
        }
    }

    #[test]
    fn what_is_told_is_four_times_the_sum_with_the_way_of_the_last_long_step() {
        let mut sleep = asleep();
        assert!((sleep.told() - 4e-5).abs() < 1e-12, "the way of a window");
        due(&mut sleep, 8, Found { way: 0.6e-3, change: 1e-5 });
        assert!((sleep.told() - 4.0 * (1e-5 + 0.6e-3)).abs() < 1e-12, "{}", sleep.told());
        due(&mut sleep, 4, STILL);
        let mut strays = sleep;
        sleep.wake(Wake { step: 12, cause: WakeCause::Call }, 0.0);
        // Half of the way of a long step was left out.
        assert!((sleep.told() - 4.0 * (1e-5 + 0.3e-3)).abs() < 1e-12, "{}", sleep.told());
        strays.wake(Wake { step: 12, cause: WakeCause::Motion }, 2e-3);
        assert!((strays.told() - 4.0 * (1e-5 + 2e-3)).abs() < 1e-12, "it went farther: {}", strays.told());
        assert_eq!(sleep.counts(), (1, 1, Some(Wake { step: 12, cause: WakeCause::Call })));
    }

    #[test]
    fn what_is_off_too_far_stays_awake() {
        let mut sleep = asleep();
        sleep.wake(Wake { step: 0, cause: WakeCause::Motion }, 0.0);
        assert!(sleep.may_fall(1e-3) && sleep.told() == 0.0);
        sleep.fall(0.0, [0.0; 3]);
        assert!(!sleep.may_fall(1e-3), "it sleeps");
        sleep.wake(Wake { step: 0, cause: WakeCause::Motion }, 1e-3);
        assert!(!sleep.may_fall(1e-3) && sleep.may_fall(5e-3));
        sleep.fall(0.0, [0.0; 3]);
        sleep.wake(Wake { step: 0, cause: WakeCause::Error }, 0.0);
        assert!(!sleep.may_fall(1.0));
    }

    #[test]
    fn what_no_cloth_does_is_known() {
        assert!(Sleep::default().is_sound() && asleep().is_sound());
        assert_eq!(Sleep::default().numbers(), None);
        assert!(asleep().numbers().is_some());
        let spoiled: [fn(&mut Sleep); 6] = [
            |sleep| sleep.period = 12,
            |sleep| sleep.period = 2048,
            |sleep| sleep.behind = 8,
            |sleep| sleep.way = f64::NAN,
            |sleep| sleep.sum = -1.0,
            |sleep| sleep.wind[1] = f64::INFINITY,
        ];
        for spoil in spoiled {
            let mut sleep = asleep();
            spoil(&mut sleep);
            assert!(!sleep.is_sound(), "{sleep:?}");
        }
    }
}

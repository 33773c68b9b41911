//! A watched cloth that falls asleep, is stepped seldom, and wakes.
//!
//! Reads positions (m) and velocities (m/s) before and after a long step; says whether that step may be taken.

use super::{
    sleep::Found,
    watch::{WINDOW, Watch},
};
use crate::{
    cloth::settings::RestSettings,
    math::{Padded, Real, Vec3, array3},
    parallel::{hash_numbers, sum_hashes},
    report::{Wake, WakeCause},
};

/// The share of what the rules divide that a particle may go in a long step.
const SHARE_OF_WAY: f64 = 0.25;
/// How many times that share a particle may go in a long step that is taken although it wakes: where it leads is nearer than where it began.
const FARTHEST: f64 = 4.0;

/// Positions (m) and velocities (m/s).
type Fields<'a, R> = [&'a [Padded<R>]; 2];

/// What becomes of a long step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Long {
    /// It is taken, and sleep goes on.
    Rests,
    /// It is taken, and more moves than may while it sleeps.
    Moves,
    /// It is not taken: positions are off by so much (m) where they stay, as far as is known.
    Strays(f64),
}

impl<R: Real> Watch<R> {
    /// Whether it sleeps.
    pub(crate) fn is_asleep(&self) -> bool {
        self.sleep.is_asleep()
    }

    /// Whether a window has just ended after which all of it is calm, and may sleep.
    pub(crate) fn may_sleep(&self, rest: RestSettings) -> bool {
        rest.sleep
            && self.taken == 0
            && self.sleep.may_fall(rest.error)
            && self.pieces.iter().all(|piece| piece.ladder.is_calm())
    }

    /// The wind (m/s) that it sleeps in.
    pub(crate) fn wind(&self) -> [f64; 3] {
        self.sleep.wind()
    }

    /// The acceleration (m/s²) of each particle, with these velocities (m/s) at the end of a window of steps of `dt` (s) that were made in steps
    /// of `asked` (s); 0 where it does not differ from rounding.
    pub(crate) fn accelerations(&self, v: &[Padded<R>], [dt, asked]: [f64; 2]) -> Vec<Vec3<f64>> {
        let window = f64::from(WINDOW) * dt;
        let largest = self.pieces.iter().map(|piece| piece.coordinate).fold(0.0, f64::max);
        let rounding = Self::ROUNDINGS * R::ROUNDING * largest;
        let seen = |(way, v): (&Padded<R>, &Padded<R>)| {
            let mean = way.vector().map(R::to_f64) / window;
            // The mean is that of the velocities at the ends of steps.
            let acceleration = (v.vector().map(R::to_f64) - mean) / (0.5 * (window - asked));
            let is_seen = 0.5 * window * window * acceleration.norm() > rounding;
            if is_seen { acceleration } else { Vec3::zeros() }
        };
        self.before.iter().zip(v).map(seen).collect()
    }

    /// Gives what is free its mean velocity (m/s) within the window of steps of `dt` (s) that has just ended.
    pub(crate) fn slow(&self, dt: f64, (inv_m, v): (&[R], &mut [Padded<R>])) {
        let window = f64::from(WINDOW) * dt;
        for ((v, inv_m), way) in v.iter_mut().zip(inv_m).zip(&self.before) {
            if *inv_m > R::zero() {
                *v = Padded::new(&way.vector().map(|c| R::of(c.to_f64() / window)));
            }
        }
    }

    /// Falls asleep in a wind (m/s), after a window that has just ended; `held`: the forces (N) of colliders on each particle, or none.
    pub(crate) fn fall_asleep(&mut self, wind: [f64; 3], held: Vec<Padded<R>>) {
        let way = self.pieces.iter().map(|piece| piece.way).fold(0.0, f64::max);
        self.sleep.fall(way, wind);
        self.held = held;
        self.told = self.report();
    }

    /// The forces (N) of colliders while it sleeps, by the user's numbers of particles.
    pub(crate) fn held(&self, user: &[u32]) -> impl Iterator<Item = (u32, [f64; 3])> {
        user.iter().zip(&self.held).map(|(user, force)| (*user, array3(&force.vector())))
    }

    /// Counts the step of the scene with this number, from 1; how many steps the long one covers that is due after it, if one is.
    pub(crate) fn pass(&mut self, step: u64) -> Option<u32> {
        self.sleep.pass(step)
    }

    /// Takes over a long step of `dt` (s) between two states, whose solve left so much (m), unless it did far more than it may.
    pub(crate) fn take_long(
        &mut self,
        rest: RestSettings,
        [before, after]: [Fields<'_, R>; 2],
        [dt, of_solve]: [f64; 2],
    ) -> Long {
        let (mut found, mut largest) = (Found { way: 0.0, change: of_solve }, 0.0_f64);
        let mut is_finite = of_solve.is_finite();
        let rows = before[0].iter().zip(before[1]).zip(after[0].iter().zip(after[1]));
        for ((x, v), (to, velocity)) in rows {
            let [x, v, to, velocity] = [x, v, to, velocity].map(|row| row.vector().map(R::to_f64));
            let [way, change] = [(to - x).norm(), 0.5 * dt * (velocity - v).norm()];
            is_finite &= way.is_finite() && change.is_finite();
            found = Found { way: found.way.max(way), change: found.change.max(change) };
            largest = largest.max(to.amax());
        }
        if !is_finite {
            return Long::Strays(Self::most_off(rest));
        }
        let share = rest.share();
        let rounding = Self::ROUNDINGS * R::ROUNDING * largest;
        let may = Found { way: SHARE_OF_WAY * share, change: (share * (dt / rest.within)).max(rounding) };
        if found.way > FARTHEST * may.way || found.change > may.way.max(may.change) {
            return Long::Strays(found.way.max(found.change));
        }
        let rests = found.way <= may.way && found.change <= may.change;
        self.sleep.take(found, may);
        self.told = self.report();
        if rests { Long::Rests } else { Long::Moves }
    }

    /// Wakes at these positions (m), which may be off by so much (m) since a long step is not taken. What moves by itself takes longer to be
    /// calm again.
    pub(crate) fn wake(&mut self, x: &[Padded<R>], wake: Wake, off: f64) {
        self.sleep.wake(wake, off);
        for piece in &mut self.pieces {
            if wake.cause == WakeCause::Motion {
                piece.ladder.fall();
            } else {
                piece.ladder.begin_again();
            }
        }
        self.begun.copy_from_slice(x);
        self.farthest.fill(0.0);
        self.held = Vec::new();
        self.taken = 0;
        self.told = self.report();
    }

    /// By how much (m) a long step that fails is said to be off at most.
    pub(crate) fn most_off(rest: RestSettings) -> f64 {
        SHARE_OF_WAY * rest.share()
    }

    /// A hash of what steps depend on; 0 of what never slept.
    pub(crate) fn hash(&self, seed: u64) -> u64 {
        let of_forces = sum_hashes(&self.held, |row, force| {
            hash_numbers(seed.wrapping_add(row as u64), array3(&force.vector()))
        });
        self.sleep.numbers().map_or(0, |numbers| hash_numbers(seed, numbers).wrapping_add(of_forces))
    }
}

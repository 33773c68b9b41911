//! A step of the world in sub-steps of the cloths: equal ones for as long as nothing asks for others.

use crate::time_step::TimeStep;

/// How far a step of the world has come, in equal parts of what was left when they were chosen.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Division {
    /// Where these parts begin (s from the start of the step).
    start: f64,
    /// How long they are together (s).
    length: f64,
    /// How many there are, and how many of them are done: whole numbers.
    total: f64,
    done: f64,
}

impl Division {
    /// A step of the world (s) in one part.
    pub(crate) fn of(dt: f64) -> Self {
        Self { start: 0.0, length: dt, total: 1.0, done: 0.0 }
    }

    /// Whether the step is done.
    pub(crate) fn is_done(&self) -> bool {
        self.done >= self.total
    }

    /// Length of the next sub-step (s).
    pub(crate) fn dt(&self) -> f64 {
        self.length / self.total
    }

    /// When the next sub-step ends (s from the start of the step).
    pub(crate) fn end(&self) -> f64 {
        self.start + self.dt() * (self.done + 1.0)
    }

    /// Sub-steps that are left.
    pub(crate) fn left(&self) -> f64 {
        self.total - self.done
    }

    /// The next sub-step is done.
    pub(crate) fn go_on(&mut self) {
        self.done += 1.0;
    }

    /// Divides what is left into as few sub-steps as `allowed` (s) lets it.
    pub(crate) fn fit(&mut self, allowed: f64) {
        let left = self.left();
        let needed = TimeStep::divide(self.dt() * left, allowed);
        if needed > left && needed % left == 0.0 {
            // Parts of equal parts: their ends and lengths stay what they are.
            let share = needed / left;
            (self.total, self.done) = (self.total * share, self.done * share);
        } else if needed != left && !self.join(left / needed) {
            (self.start, self.length) = (self.start + self.dt() * self.done, self.dt() * left);
            (self.total, self.done) = (needed, 0.0);
        }
    }

    /// Whether sub-steps of twice the length would end where these do.
    pub(crate) fn is_even(&self) -> bool {
        self.is_done() || (self.total % 2.0 == 0.0 && self.done % 2.0 == 0.0)
    }

    /// Joins so many sub-steps to one, where all are whole numbers.
    fn join(&mut self, count: f64) -> bool {
        let fits = count % 1.0 == 0.0 && self.total % count == 0.0 && self.done % count == 0.0;
        if fits {
            (self.total, self.done) = (self.total / count, self.done / count);
        }
        fits
    }
}

#[cfg(test)]
mod tests {
    use super::Division;

    #[test]
    fn halves_of_steps_keep_their_bits_and_join_again() {
        let dt = 1.0 / 60.0;
        let mut division = Division::of(dt);
        division.fit(dt / 4.0);
        assert_eq!(division.dt(), dt / 4.0);
        division.go_on();
        division.fit(dt / 8.0);
        assert_eq!((division.dt(), division.left()), (dt / 8.0, 6.0));
        division.go_on();
        assert!(!division.is_even());
        division.go_on();
        assert!(division.is_even());
        division.fit(dt / 4.0);
        assert_eq!((division.dt(), division.left(), division.end()), (dt / 4.0, 2.0, dt / 4.0 * 3.0));
        division.go_on();
        division.go_on();
        assert!(division.is_done());
    }

    #[test]
    fn what_is_left_is_divided_into_the_fewest_steps_that_are_allowed() {
        let mut division = Division::of(1.0);
        division.fit(0.3);
        assert_eq!((division.dt(), division.left()), (0.25, 4.0));
        division.go_on();
        division.fit(0.2);
        assert_eq!((division.dt(), division.left()), (0.1875, 4.0));
        division.fit(f64::INFINITY);
        assert_eq!((division.dt(), division.left(), division.end()), (0.75, 1.0, 1.0));
    }
}

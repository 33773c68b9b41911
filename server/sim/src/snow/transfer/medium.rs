//! The medium on the nodes of the grid: a force of -drag m (v - wind), by the velocity at the end of the step.
//!
//! Reads and writes the velocity of a node (m/s); tells what the medium did to it (J).

use crate::math::{
    Real,
    array::{dot, minus},
};

/// What the medium does in a step to a node, whatever its mass.
#[derive(Clone, Copy)]
pub(super) struct Medium<R> {
    /// Velocity of the medium (m/s).
    wind: [R; 3],
    /// Share of the way to that velocity which a node goes: dt drag / (1 + dt drag).
    share: R,
}

impl<R: Real> Medium<R> {
    /// What a drag (1/s) and a wind (m/s) do in a step of `dt` (s); none without a drag.
    pub(super) fn over(drag: f64, wind: [f64; 3], dt: f64) -> Option<Self> {
        let change = dt * drag;
        (change > 0.0).then(|| Self { wind: wind.map(R::of), share: R::of(change / (1.0 + change)) })
    }

    /// Brings the velocity (m/s) of a node of a mass (kg) to (v + dt drag wind) / (1 + dt drag), which is written so that a small
    /// drag keeps its digits. Returns the work (J): the impulse times the velocity after it, and times the wind.
    pub(super) fn act(&self, v: &mut [R; 3], mass: R) -> [f64; 2] {
        let before = *v;
        for (v, wind) in v.iter_mut().zip(self.wind) {
            *v += self.share * (wind - *v);
        }
        let [before, after, wind] = [before, *v, self.wind].map(|v| v.map(Real::to_f64));
        let impulse = minus(after, before).map(|dv| mass.to_f64() * dv);
        [dot(impulse, after), dot(impulse, wind)]
    }
}

#[cfg(test)]
mod tests {
    use super::Medium;

    #[test]
    fn a_small_drag_keeps_its_digits_in_binary32() {
        // A share of 2e-5 in each step: the factor 1 / (1 + 2e-5) has an error of a thousandth of it in binary32, which adds up.
        let (drag, dt, wind) = (0.2, 1e-4, [0.0, 3.0, -1.0]);
        let medium = Medium::<f32>::over(drag, wind, dt).expect("a drag");
        let start = [2.0, 0.7, -0.4];
        let mut v = start;
        for _ in 0..5000 {
            medium.act(&mut v, 1.0);
        }
        let left = (1.0 + dt * drag).powi(-5000);
        for c in 0..3 {
            let exact = wind[c] + left * (f64::from(start[c]) - wind[c]);
            assert!((f64::from(v[c]) - exact).abs() < 3e-6, "{v:?} m/s, not {exact} along axis {c}");
        }
    }

    #[test]
    fn its_work_is_its_impulse_times_the_velocity_after_it_and_times_the_wind() {
        let medium = Medium::<f64>::over(4.0, [3.0, 0.0, -2.0], 0.25).expect("a drag");
        let mut v = [1.0, 8.0, 0.0];
        let [work, of_wind] = medium.act(&mut v, 2.0);
        // Half of the way to the wind.
        assert_eq!(v, [2.0, 4.0, -1.0]);
        let impulse = [2.0, -8.0, -2.0];
        assert_eq!(work, impulse[0] * v[0] + impulse[1] * v[1] + impulse[2] * v[2]);
        assert_eq!(of_wind, impulse[0] * 3.0 + impulse[2] * -2.0);
        assert!(
            Medium::<f64>::over(0.0, [3.0; 3], 0.25).is_none()
                && Medium::<f64>::over(4.0, [3.0; 3], 0.0).is_none()
        );
    }
}

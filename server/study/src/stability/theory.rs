//! What theory says of explicit steps: the longest that is stable, in closed form.
//!
//! A mode of frequency w (rad/s) and damping c (1/s) is an oscillator x'' = -w² x - c x'. A step of h (s) of it is a matrix of
//! two rows, whose eigenvalues lie within the unit circle where its determinant is at most 1 and its trace at most 1 + the
//! determinant in magnitude. With C = h c, Y = h² w² and b = 1 - C / 2 that is
//!
//! - for explicit Euler Y <= C and Y >= 2 C - 4,
//! - for symplectic Euler Y + 2 C <= 4,
//! - for velocity Verlet, which damps with the velocity of the half step, (1 + b) Y <= 4 (1 + b²) and C <= 4,
//! - with the velocity predicted Y <= 4 - 2 C + C² and C <= 2.
//!
//! Springs that have one damping over stiffness t (s) give every mode c = t w².

use nappe_sim::cloth::Integrator;

/// The longest stable step (s) for one mode of a frequency (rad/s) and a damping ratio; 0 where every step grows, none where
/// none does.
pub fn critical_step(integrator: Integrator, frequency: f64, ratio: f64) -> Option<f64> {
    let limit = match integrator {
        Integrator::ExplicitEuler if ratio < 1.0 => 2.0 * ratio,
        Integrator::ExplicitEuler => 2.0 / (ratio + (ratio * ratio - 1.0).sqrt()),
        Integrator::SymplecticEuler => symplectic(ratio),
        // With y = h w: 8 - 8 r y + (4 r² - 2) y² + r y³ >= 0 up to y = 2 / r.
        Integrator::VelocityVerlet => first_root(2.0_f64.min(2.0 / ratio), |y| {
            8.0 - 8.0 * ratio * y + (4.0 * ratio * ratio - 2.0) * y * y + ratio * y * y * y
        })
        .unwrap_or(2.0 / ratio),
        // 4 - 4 r y + (4 r² - 1) y² >= 0 up to y = 1 / r.
        Integrator::VelocityVerletPredicted => first_root(2.0_f64.min(1.0 / ratio), |y| {
            4.0 - 4.0 * ratio * y + (4.0 * ratio * ratio - 1.0) * y * y
        })
        .unwrap_or(1.0 / ratio),
        Integrator::ImplicitEuler | Integrator::ImplicitMidpoint | Integrator::Bdf2 => return None,
    };
    Some(limit / frequency)
}

/// The longest step (s) at which no mode grows, of all up to a frequency (rad/s), for springs of one damping over stiffness
/// (s); 0 where every step grows, none where none does.
pub fn critical_step_of_all(integrator: Integrator, frequency: f64, damping_time: f64) -> Option<f64> {
    let ratio = 0.5 * damping_time * frequency;
    let [all, cap] = [2.0 * damping_time, damping_time * frequency * frequency];
    match integrator {
        // Of modes that swing each has the same limit; of those that creep the fastest has the least.
        Integrator::ExplicitEuler if ratio >= 1.0 => {
            critical_step(integrator, frequency, ratio).map(|h| h.min(damping_time))
        }
        Integrator::ExplicitEuler => Some(damping_time),
        // With Y = h² w² and k = t / (2 h): 8 - (8 k + 2) Y + (4 k² + k) Y² >= 0, whose roots are real for h >= 2 t.
        Integrator::VelocityVerlet => Some(first_unstable(frequency, all, 4.0 / cap, |h| {
            let k = 0.5 * damping_time / h;
            let root = (1.0 - 16.0 * k * k).max(0.0).sqrt();
            // The smaller root, without a difference of near numbers.
            8.0 / (4.0 * k + 1.0 + root)
        })),
        // With k = t / h: 4 - (1 + 2 k) Y + k² Y² >= 0, likewise.
        Integrator::VelocityVerletPredicted => Some(first_unstable(frequency, all, 2.0 / cap, |h| {
            let k = damping_time / h;
            let root = ((1.0 - 2.0 * k) * (1.0 + 6.0 * k)).max(0.0).sqrt();
            8.0 / (1.0 + 2.0 * k + root)
        })),
        _ => critical_step(integrator, frequency, ratio),
    }
}

/// h w of the longest stable step of symplectic Euler, without a difference of near numbers.
fn symplectic(ratio: f64) -> f64 {
    2.0 / ((1.0 + ratio * ratio).sqrt() + ratio)
}

/// The first step (s) from `from` on of which `Y`, for the fastest of all modes (rad/s), reaches the least that is unstable; at
/// most `cap` (s).
fn first_unstable(frequency: f64, from: f64, cap: f64, least: impl Fn(f64) -> f64) -> f64 {
    let is_unstable = |h: f64| (h * frequency).powi(2) >= least(h);
    // At twice the undamped limit it is unstable, and no root is above 4.
    let [mut below, mut above] = [from, from.max(4.0 / frequency)];
    if !is_unstable(below) {
        for _ in 0..100 {
            let middle = f64::midpoint(below, above);
            *(if is_unstable(middle) { &mut above } else { &mut below }) = middle;
        }
    }
    below.min(cap)
}

/// The first root from 0 to `end` of what is above 0 at 0: looked for on a thousand places.
fn first_root(end: f64, of: impl Fn(f64) -> f64) -> Option<f64> {
    let at = |i: u32| end * f64::from(i) / 1000.0;
    let first = (1..=1000).find(|&i| of(at(i)) <= 0.0)?;
    let [mut below, mut above] = [at(first - 1), at(first)];
    for _ in 0..60 {
        let middle = f64::midpoint(below, above);
        *(if of(middle) > 0.0 { &mut below } else { &mut above }) = middle;
    }
    Some(below)
}

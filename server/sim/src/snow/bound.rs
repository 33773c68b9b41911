//! The certified time step: the smallest of named bounds, in closed form (docs/laws/snow.md).
//!
//! Reads extremes over particles, gathered block by block after each step; writes the largest dt,
//! which bound binds, and the particle that sets it.

use super::{
    law::{Moduli, stiffness_of},
    settings::{Integration, Kernel, SnowSettings, Transfer},
};
use crate::{
    collide::Collider,
    math::{
        Columns, Pack,
        array::{length, minus},
    },
    report::BoundKind,
};

/// Cells that a particle may move in a step; a collider too, or as large a part of its thickness.
const MOVE: f64 = 0.5;
/// Cells beside what both may go that a collider is farther away than which bounds nothing.
const FAR: f64 = 4.0;
/// Largest norm of dt grad v: I + dt grad v keeps its orientation below 1.
const TURN: f64 = 0.2;
/// Share of the product of the elastic bound and that of the velocity gradient which the square of a
/// semi-implicit step takes: a free turn then gains 0.5 % of its energy, at most (docs/laws/snow.md).
const STRETCH: f64 = 0.5;

/// omega dt = sqrt(3) in place of 2: a mode that symplectic Euler turns by a third of a circle per step returns to its
/// nonlinear force always at the same three places, and grows without end however small it is (Schlick, Mandziuk, Skeel and
/// Srinivas 1998, "Nonlinear resonance artifacts in molecular dynamics simulations").
const THIRD_ORDER: f64 = 0.866_025_403_784_438_6;

/// Greatest values over particles, each of which bounds dt.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Extremes {
    /// (c_p)² of the elastic wave, and of a particle alone (m²/s²).
    pub(super) wave2: f64,
    pub(super) alone2: f64,
    /// |v|² (m²/s²).
    pub(super) speed2: f64,
    /// |grad v|² (1/s²), Frobenius.
    pub(super) gradient2: f64,
    /// Square of an upper bound of the largest singular value of F_E.
    pub(super) stretch2: f64,
}

impl Extremes {
    /// Greater of both, one by one.
    pub(super) fn max(self, other: Self) -> Self {
        Self {
            wave2: self.wave2.max(other.wave2),
            alone2: self.alone2.max(other.alone2),
            speed2: self.speed2.max(other.speed2),
            gradient2: self.gradient2.max(other.gradient2),
            stretch2: self.stretch2.max(other.stretch2),
        }
    }

    /// From the same numbers in the order of the fields, as [`extremes`] has them.
    pub(super) fn of([wave2, alone2, speed2, gradient2, stretch2]: [f64; 5]) -> Self {
        Self { wave2, alone2, speed2, gradient2, stretch2 }
    }

    /// All of them, in the order of the fields.
    pub(super) fn values(&self) -> [f64; 5] {
        [self.wave2, self.alone2, self.speed2, self.gradient2, self.stretch2]
    }
}

/// The particle of each extreme: the first, in the user's numbering, of the greatest value.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(super) struct Culprits(pub(super) [Option<u64>; 5]);

impl Culprits {
    /// The particle that bounds dt by `kind`.
    pub(super) fn of(&self, kind: BoundKind) -> Option<u64> {
        match kind {
            BoundKind::ElasticWave => self.0[0],
            BoundKind::IsolatedParticle => self.0[1],
            BoundKind::ParticleSpeed => self.0[2],
            BoundKind::VelocityGradient => self.0[3],
            BoundKind::ColliderSpeed
            | BoundKind::Fixed
            | BoundKind::Frame
            | BoundKind::Stiffness
            | BoundKind::Damping
            | BoundKind::SpringSpeed
            | BoundKind::Medium
            | BoundKind::Acceptance
            | BoundKind::Tolerance => None,
        }
    }

    /// The fastest particle.
    pub(super) fn fastest(&self) -> u64 {
        self.0[2].unwrap_or_default()
    }

    /// The most stretched particle.
    pub(super) fn stretched(&self) -> u64 {
        self.0[4].unwrap_or_default()
    }
}

/// What bounds the next step, from what is stored: F_E and C by columns, volume over mass.
#[inline(always)]
pub(super) fn extremes<P: Pack>(
    f: &Columns<P>,
    hardening: P,
    v: &[P; 3],
    c: &Columns<P>,
    specific: P,
    moduli: &Moduli<P>,
) -> [P; 5] {
    let ([wave, alone], stretch2) = stiffness_of(f, hardening, moduli);
    let speed2 = v[0] * v[0] + v[1] * v[1] + v[2] * v[2];
    let mut gradient2 = P::zero();
    for axis in 0..3 {
        for k in 0..3 {
            gradient2 += c[axis][k] * c[axis][k];
        }
    }
    [wave * specific, alone * specific, speed2, gradient2, stretch2]
}

/// Largest c dt / h of waves in full blocks, and of a particle alone in units of h sqrt(rho / (2 mu + 3 lambda))
/// (docs/laws/snow.md). A particle alone by MLS damps nothing: its step stays below the resonance of third order,
/// [`THIRD_ORDER`] of where its linear motion ends. The linear kernel has no bound for a particle alone: its slope
/// does not fall off with its weight; the number is for full blocks.
pub(super) fn courant(kernel: Kernel, transfer: Transfer) -> [f64; 2] {
    match (kernel, transfer) {
        (Kernel::Linear, _) => [0.5, 0.35],
        (Kernel::Quadratic, Transfer::Mls) => [1.306, THIRD_ORDER],
        (Kernel::Quadratic, Transfer::Apic) => [1.306, std::f64::consts::FRAC_1_SQRT_2],
        (Kernel::Quadratic, Transfer::PicFlip(_)) => [1.324, 0.577],
        (Kernel::Cubic, Transfer::Mls) => [1.739, 1.154_700_538 * THIRD_ORDER],
        (Kernel::Cubic, Transfer::Apic) => [1.7, 1.10],
        (Kernel::Cubic, Transfer::PicFlip(_)) => [1.543, 0.796],
    }
}

/// Colliders from one time (s) to another, and a box around all particles, given by its least and its greatest coordinates (m).
pub(super) struct Around<'a> {
    pub(super) colliders: &'a [Collider],
    pub(super) times: [f64; 2],
    pub(super) reach: [[f64; 3]; 2],
}

/// The smallest bound, without safety, and the kind that binds.
pub(super) fn smallest(
    settings: &SnowSettings,
    extremes: &Extremes,
    &Around { colliders, times, reach }: &Around<'_>,
) -> (BoundKind, f64) {
    let h = settings.cell;
    let [wave, alone] = courant(settings.kernel, settings.transfer);
    let per = |length: f64, speed2: f64| if speed2 > 0.0 { length / speed2.sqrt() } else { f64::INFINITY };
    let [low, high] = reach;
    let middle = [0, 1, 2].map(|c| 0.5 * (low[c] + high[c]));
    let radius = 0.5 * length(minus(high, low));
    let by_collider = |collider: &Collider| {
        let speed = match &collider.way {
            None => length(collider.velocity),
            Some(way) => way.fastest(times, reach),
        };
        // What cannot come near in this time bounds nothing.
        let nearer = (times[1] - times[0]) * (speed + 2.0 * extremes.speed2.sqrt()) + FAR * h;
        if speed == 0.0 || collider.distance(middle, times[0]).0 - radius - collider.margin > nearer {
            return f64::INFINITY;
        }
        per(MOVE * h.min(collider.shape.thickness()), speed * speed)
    };
    let mut elastic = [
        per(wave * h, extremes.wave2),
        // Ballistic particles have no stress: full blocks alone bound the step.
        if settings.ballistic_below > 0.0 { f64::INFINITY } else { per(alone * h, extremes.alone2) },
    ];
    let mut gradient = per(TURN, extremes.gradient2);
    let beta = match settings.integration {
        Integration::Explicit => 0.0,
        Integration::SemiImplicit { beta, .. } => beta,
    };
    if beta >= Integration::LEAST_BETA {
        // A step along straight lines stretches what turns: its stress is not to give more than motion has.
        gradient = gradient.min((STRETCH * gradient * elastic[0].min(elastic[1])).sqrt());
        elastic = [f64::INFINITY; 2];
    }
    [
        (BoundKind::ElasticWave, elastic[0]),
        (BoundKind::IsolatedParticle, elastic[1]),
        (BoundKind::ParticleSpeed, per(MOVE * h, extremes.speed2)),
        (BoundKind::VelocityGradient, gradient),
        (BoundKind::ColliderSpeed, colliders.iter().map(by_collider).fold(f64::INFINITY, f64::min)),
    ]
    .into_iter()
    .fold((BoundKind::Frame, f64::INFINITY), |least, bound| if bound.1 < least.1 { bound } else { least })
}

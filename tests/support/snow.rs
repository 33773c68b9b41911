//! Snow to test with: lattices, balls and bars of particles, worlds that hold nothing else, and
//! what is measured on their particles.
//!
//! Reads sizes and materials; gives setups, simulations, centres, momenta and energies.

use std::f64::consts::PI;

use nappe_sim::{
    collide::{Collider, Contact, Shape, StartInside, shape::Plane},
    report::{NoStopwatch, StepReport},
    snow::{Kernel, Law, Material, ParticleState},
    world::Simulation,
};

pub use nappe_study::{
    Variant,
    gallery::snow::{SnowScene, elastic, lattice, object, rework},
};

use crate::{scene::cross, threads::on_one_thread};

/// The same by another law.
#[must_use]
pub const fn with_law(material: Material, law: Law) -> Material {
    Material { law, ..material }
}

/// Stiffness lambda + 2 mu (Pa) of a plane wave.
pub fn wave_modulus(material: &Material) -> f64 {
    material.lambda() + 2.0 * material.mu()
}

/// Points of a lattice of `spacing` (m), symmetric about `center` (m), that lie within `radius`
/// (m) of it; only the first `axes` coordinates count.
pub fn round(
    center: [f64; 3],
    radius: f64,
    spacing: f64,
    half_extent: [f64; 3],
    axes: usize,
) -> Vec<[f64; 3]> {
    let counts = half_extent.map(|half| 2 * (half / spacing).round() as usize);
    let low = [0, 1, 2].map(|a| center[a] - 0.5 * counts[a] as f64 * spacing);
    let mut x = lattice(low, counts, [spacing; 3]);
    x.retain(|x| (0..axes).map(|a| (x[a] - center[a]).powi(2)).sum::<f64>() < radius * radius);
    x
}

/// A ball of particles of `spacing` (m).
pub fn ball(center: [f64; 3], radius: f64, spacing: f64) -> Vec<[f64; 3]> {
    round(center, radius, spacing, [radius + spacing; 3], 3)
}

/// A resting plane.
pub fn plane(point: [f64; 3], normal: [f64; 3], contact: Contact, friction: f64) -> Collider {
    Collider {
        name: format!("plane {point:?} {normal:?}"),
        shape: Shape::Plane(Plane { point, normal }),
        velocity: [0.0; 3],
        way: None,
        friction,
        restitution: 0.0,
        margin: 0.0,
        contact,
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::Warn,
    }
}

/// Brings everything to a stop where it is.
pub fn stop(simulation: &mut Simulation) {
    let mut particles = simulation.snow_particles();
    for particle in &mut particles {
        (particle.v, particle.affine) = ([0.0; 3], [[0.0; 3]; 3]);
    }
    simulation.restore_snow(&particles);
}

/// Lets a body settle: each time its kinetic energy has passed a peak, it is stopped. `before`
/// comes before every step. Gives the number of steps until `peaks` stops were made.
pub fn settle(
    simulation: &mut Simulation,
    peaks: usize,
    max_steps: usize,
    mut before: impl FnMut(&mut Simulation),
) -> usize {
    let (mut last, mut stops) = (0.0, 0);
    for step in 1..=max_steps {
        before(simulation);
        let report = step_once(simulation);
        let energy = report.diagnostics.kinetic_energy;
        if energy < last {
            stop(simulation);
            stops += 1;
            last = 0.0;
        } else {
            last = energy;
        }
        if stops == peaks {
            return step;
        }
    }

    panic!("only {stops} of {peaks} peaks of kinetic energy within {max_steps} steps");
}

/// One step, which must succeed.
pub fn step_once(simulation: &mut Simulation) -> StepReport {
    on_one_thread(|| simulation.step(&mut NoStopwatch)).unwrap_or_else(|error| panic!("{error}"))
}

/// Centre of mass (m) of chosen particles.
pub fn center(particles: &[ParticleState], masses: &[f64], chosen: impl Fn(usize) -> bool) -> [f64; 3] {
    let (mut sum, mut mass) = ([0.0; 3], 0.0);
    for (_, (p, m)) in particles.iter().zip(masses).enumerate().filter(|(index, _)| chosen(*index)) {
        mass += m;
        (0..3).for_each(|a| sum[a] += m * p.x[a]);
    }
    sum.map(|s| s / mass)
}

/// Momentum (kg m/s).
pub fn momentum(particles: &[ParticleState], masses: &[f64]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (p, m) in particles.iter().zip(masses) {
        (0..3).for_each(|a| sum[a] += m * p.v[a]);
    }
    sum
}

/// Angular momentum (kg m²/s) about the origin, with that of the affine velocities: a particle
/// stands for weights of second moment `moment` (m²) around it.
pub fn angular_momentum(particles: &[ParticleState], masses: &[f64], moment: f64) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for (p, m) in particles.iter().zip(masses) {
        let (orbit, c) = (cross(p.x, p.v), &p.affine);
        let spin = [c[2][1] - c[1][2], c[0][2] - c[2][0], c[1][0] - c[0][1]];
        (0..3).for_each(|a| sum[a] += m * (orbit[a] + moment * spin[a]));
    }
    sum
}

/// Kinetic energy (J), with that of the affine velocities.
pub fn kinetic_energy(particles: &[ParticleState], masses: &[f64], moment: f64) -> f64 {
    let of = |(p, m): (&ParticleState, &f64)| {
        let v2: f64 = p.v.iter().map(|v| v * v).sum();
        let c2: f64 = p.affine.as_flattened().iter().map(|c| c * c).sum();
        0.5 * m * (v2 + moment * c2)
    };
    particles.iter().zip(masses).map(of).sum()
}

/// Second moment (m²) of a kernel's weights along an axis.
pub fn second_moment(kernel: Kernel, cell: f64) -> f64 {
    cell * cell / kernel.inverse_moment()
}

/// Amplitude, and mean, of the best a + b cos(w t) + c sin(w t) through samples, and the rms of
/// what is left.
pub fn fit_wave(samples: &[[f64; 2]], omega: f64) -> [f64; 3] {
    let mut normal = [[0.0; 4]; 3];
    for [t, value] in samples {
        let basis = [1.0, (omega * t).cos(), (omega * t).sin()];
        for i in 0..3 {
            (0..3).for_each(|j| normal[i][j] += basis[i] * basis[j]);
            normal[i][3] += basis[i] * value;
        }
    }

    for pivot in 0..3 {
        for row in (0..3).filter(|row| *row != pivot) {
            let factor = normal[row][pivot] / normal[pivot][pivot];
            (pivot..4).for_each(|column| normal[row][column] -= factor * normal[pivot][column]);
        }
    }

    let [mean, b, c] = [0, 1, 2].map(|i| normal[i][3] / normal[i][i]);
    let left = |[t, value]: &[f64; 2]| (value - mean - b * (omega * t).cos() - c * (omega * t).sin()).powi(2);
    let rms = (samples.iter().map(left).sum::<f64>() / samples.len() as f64).sqrt();
    [b.hypot(c), mean, rms]
}

/// Angular frequency (1/s) of the best wave through samples, sought within 20 % of a guess.
pub fn best_frequency(samples: &[[f64; 2]], guess: f64) -> f64 {
    let rms = |omega: f64| fit_wave(samples, omega)[2];
    let (mut low, mut high) = (0.8 * guess, 1.2 * guess);
    let golden = 0.5 * (5.0_f64.sqrt() - 1.0);
    for _ in 0..60 {
        let (a, b) = (high - golden * (high - low), low + golden * (high - low));
        if rms(a) < rms(b) { high = b } else { low = a }
    }
    f64::midpoint(low, high)
}

/// Times at which samples cross `level`, by straight lines between them.
pub fn crossings(samples: &[[f64; 2]], level: f64) -> Vec<f64> {
    let crossing = |pair: &[[f64; 2]]| {
        let (a, b) = (pair[0][1] - level, pair[1][1] - level);
        (a.signum() != b.signum()).then(|| pair[0][0] + (pair[1][0] - pair[0][0]) * a / (a - b))
    };
    samples.windows(2).filter_map(crossing).collect()
}

/// Period of a wave 2 pi / omega (s).
pub fn period_of(omega: f64) -> f64 {
    2.0 * PI / omega
}

/// Order of convergence between two errors of grids whose cells differ by `ratio`.
pub fn order(coarse: f64, fine: f64, ratio: f64) -> f64 {
    (coarse / fine).ln() / ratio.ln()
}

//! Manufactured solutions: motions with the body force that makes them exact, on periodic grids.
//!
//! Steffen et al. 2008 in one dimension, Wallstedt and Guilkey 2008 in three, for both laws. Reads
//! `mms_1d.csv` and `mms_axis_aligned.csv`, which hold the forces below to the motion; asks for the
//! order of convergence.
#![allow(clippy::print_stdout, reason = "the table of errors")]

use std::f64::consts::{PI, TAU};

use nappe_sim::{
    math::Precision,
    snow::{Advection, Blend, Kernel, Law, Material, Transfer},
};
use nappe_tests::{
    golden,
    snow::{SnowScene, Variant, elastic, lattice, object, order, rework, step_once, wave_modulus, with_law},
};

const YOUNG: f64 = 1e4;
const DENSITY: f64 = 1.0;
const AMPLITUDE: f64 = 0.05;
/// sqrt(E / rho) (m/s).
const SPEED: f64 = 100.0;

/// A motion of which displacement, velocity and stretch along each axis are known.
trait Motion: Sync {
    /// Displacement (m) along `axis` of the particle that was at `x`.
    fn u(&self, axis: usize, x: [f64; 3], t: f64) -> f64;
    /// Its derivative in time (m/s).
    fn v(&self, axis: usize, x: [f64; 3], t: f64) -> f64;
    /// Stretch along `axis`: F is diagonal.
    fn stretch(&self, axis: usize, x: [f64; 3], t: f64) -> f64;
    /// Derivative of the velocity by the material coordinate (1/s).
    fn rate(&self, axis: usize, x: [f64; 3], t: f64) -> f64;
    /// Body force a mass (m/s²).
    fn force(&self, axis: usize, x: [f64; 3], t: f64) -> f64;
}

/// u = A sin(2 pi X / L) cos(c pi t / L), L = 1 m, without lateral contraction.
struct Line {
    law: Law,
}

impl Motion for Line {
    fn u(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        if axis > 0 { 0.0 } else { AMPLITUDE * (TAU * x[0]).sin() * (SPEED * PI * t).cos() }
    }

    fn v(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        if axis > 0 { 0.0 } else { -AMPLITUDE * SPEED * PI * (TAU * x[0]).sin() * (SPEED * PI * t).sin() }
    }

    fn stretch(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        if axis > 0 { 1.0 } else { 1.0 + AMPLITUDE * TAU * (TAU * x[0]).cos() * (SPEED * PI * t).cos() }
    }

    fn rate(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        let along = -AMPLITUDE * SPEED * PI * TAU * (TAU * x[0]).cos() * (SPEED * PI * t).sin();
        if axis > 0 { 0.0 } else { along }
    }

    fn force(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        let u = self.u(axis, x, t);
        match self.law {
            Law::FixedCorotated => PI * PI * u * (4.0 * YOUNG / DENSITY - SPEED * SPEED),
            Law::NeoHookean => PI * PI * SPEED * SPEED * u * (1.0 + 2.0 / self.stretch(axis, x, t).powi(2)),
        }
    }
}

/// u_i = A sin(pi X_i) sin(c pi t + phi_i) in the cube from -1 to 1: odd, so that walls between
/// unit cubes do not move.
struct Axes {
    material: Material,
}

impl Axes {
    fn phase(axis: usize, t: f64) -> f64 {
        SPEED * PI * t + TAU / 3.0 * axis as f64
    }
}

impl Motion for Axes {
    fn u(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        AMPLITUDE * (PI * x[axis]).sin() * Self::phase(axis, t).sin()
    }

    fn v(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        AMPLITUDE * SPEED * PI * (PI * x[axis]).sin() * Self::phase(axis, t).cos()
    }

    fn stretch(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        1.0 + AMPLITUDE * PI * (PI * x[axis]).cos() * Self::phase(axis, t).sin()
    }

    fn rate(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        AMPLITUDE * SPEED * PI * PI * (PI * x[axis]).cos() * Self::phase(axis, t).cos()
    }

    fn force(&self, axis: usize, x: [f64; 3], t: f64) -> f64 {
        let (mu, lambda) = (self.material.mu(), self.material.lambda());
        let f = [0, 1, 2].map(|a| self.stretch(a, x, t));
        let j = f[0] * f[1] * f[2];
        let stiffness = match self.material.law {
            Law::FixedCorotated => 2.0 * mu + lambda * (j / f[axis]).powi(2),
            Law::NeoHookean => mu - (lambda * (j.ln() - 1.0) - mu) / f[axis].powi(2),
        };
        PI * PI * self.u(axis, x, t) * (stiffness / DENSITY - SPEED * SPEED)
    }
}

/// The forces above are those of the tables, and so are the motions.
#[test]
fn the_tables_hold_these_motions_and_forces() {
    let near = |what: &str, found: f64, table: f64, scale: f64| {
        assert!((found - table).abs() < 1e-12 * scale, "{what}: {found}, not {table}");
    };

    for row in golden::table("mpm/mms_1d.csv") {
        let (x, t) = ([row.number("X_m"), 0.0, 0.0], row.number("t_s"));
        let [corotated, neo_hookean] = [Law::FixedCorotated, Law::NeoHookean].map(|law| Line { law });
        near("u", corotated.u(0, x, t), row.number("u_m"), AMPLITUDE);
        near("v", corotated.v(0, x, t), row.number("v_m_s"), AMPLITUDE * SPEED * TAU);
        near("F", corotated.stretch(0, x, t), row.number("F"), 1.0);
        near("b", corotated.force(0, x, t), row.number("FCR_nu0_b_m_s2"), 1e5);
        near("b", neo_hookean.force(0, x, t), row.number("NH_b_m_s2"), 1e5);
    }

    let material = elastic(YOUNG, 0.3);

    for row in golden::table("mpm/mms_axis_aligned.csv") {
        let (x, t) = (["X", "Y", "Z"].map(|name| row.number(name)), row.number("t"));
        let laws = [("FCR", Law::FixedCorotated), ("NH", Law::NeoHookean)];
        for (prefix, law) in laws {
            let motion = Axes { material: with_law(material, law) };
            for (axis, [u, letter]) in [["u", "x"], ["v", "y"], ["w", "z"]].into_iter().enumerate() {
                near("u", motion.u(axis, x, t), row.number(u), AMPLITUDE);
                near("v", motion.v(axis, x, t), row.number(&format!("vel_{letter}")), 16.0);
                near("F", motion.stretch(axis, x, t), row.number(&format!("F{letter}{letter}")), 1.0);
                near("b", motion.force(axis, x, t), row.number(&format!("{prefix}_b{letter}")), 1e5);
            }
        }
    }
}

/// Rms error of the displacement over the amplitude after the last step.
fn error(motion: &dyn Motion, mut scene: SnowScene, steps: u32) -> f64 {
    let (dt, end) = (scene.dt, scene.dt * f64::from(steps));
    let start = std::mem::take(&mut scene.objects[0].x);
    scene.objects[0].x = start.iter().map(|x| [0, 1, 2].map(|a| x[a] + motion.u(a, *x, 0.0))).collect();
    let mut simulation = scene.simulate(Precision::F64);
    rework(&mut simulation, |i, p| {
        for a in 0..3 {
            // Velocities of symplectic Euler belong to half a step before.
            p.v[a] = motion.v(a, start[i], -0.5 * dt);
            p.elastic[a][a] = motion.stretch(a, start[i], 0.0);
            p.affine[a][a] = motion.rate(a, start[i], -0.5 * dt) / motion.stretch(a, start[i], -0.5 * dt);
        }
    });

    for step in 0..steps {
        let t = f64::from(step) * dt;
        simulation.kick_snow(|i, _, _| [0, 1, 2].map(|a| dt * motion.force(a, start[i as usize], t)));
        step_once(&mut simulation);
    }

    let (mut sum, mut axes) = (0.0, 0.0);

    for (p, x) in simulation.snow_particles().iter().zip(&start) {
        for a in 0..3 {
            sum += (p.x[a] - x[a] - motion.u(a, *x, end)).powi(2);
        }
        axes += 1.0;
    }

    (sum / axes).sqrt() / AMPLITUDE
}

/// Transfers that the order is asked of: FLIP that moves particles with the grid, and APIC.
fn transfers() -> [(Transfer, Advection); 2] {
    [(Transfer::PicFlip(Blend::PerStep(1.0)), Advection::Grid), (Transfer::Apic, Advection::Grid)]
}

fn line(kernel: Kernel, (transfer, advection): (Transfer, Advection), law: Law, cells: usize) -> f64 {
    let h = 1.0 / cells as f64;
    let material = with_law(elastic(YOUNG, 0.0), law);
    // Four particles a cell along x, one across.
    let x = lattice([0.0; 3], [4 * cells, 4, 4], [0.25 * h, h, h]);
    let body = object("line", x, 0.25 * h.powi(3), DENSITY, material);
    // Half a period, a fifth of a cell a step.
    let (steps, end) = (5 * cells as u32, 0.01);
    let scene = SnowScene::new(vec![body], h, end / f64::from(steps)).by(Variant { kernel, transfer });
    let mut scene = scene.periodic([cells as u32 / 4, 1, 1]);
    scene.settings.advection = advection;
    error(&Line { law }, scene, steps)
}

fn axes(kernel: Kernel, (transfer, advection): (Transfer, Advection), law: Law, cells: usize) -> f64 {
    let h = 2.0 / cells as f64;
    let material = with_law(elastic(YOUNG, 0.3), law);
    let x = lattice([-1.0; 3], [2 * cells; 3], [0.5 * h; 3]);
    let body = object("cube", x, (0.5 * h).powi(3), DENSITY, material);
    let end = 0.005;
    let steps = (end * (wave_modulus(&material) / DENSITY).sqrt() / (0.25 * h)).ceil() as u32;
    let scene = SnowScene::new(vec![body], h, end / f64::from(steps)).by(Variant { kernel, transfer });
    let mut scene = scene.periodic([cells as u32 / 4; 3]);
    scene.settings.advection = advection;
    error(&Axes { material }, scene, steps)
}

/// Prints a row of the table; gives the orders from grid to grid, and that over all.
fn orders(what: &str, cells: &[usize], errors: &[f64]) -> (Vec<f64>, f64) {
    let last = errors.len() - 1;
    let between = |i: usize, j: usize| order(errors[i], errors[j], cells[j] as f64 / cells[i] as f64);
    let each: Vec<f64> = (0..last).map(|i| between(i, i + 1)).collect();
    let errors: Vec<String> = errors.iter().map(|e| format!("{e:.2e}")).collect();
    println!("{what}: {} (orders {each:.2?}, overall {:.2})", errors.join(" "), between(0, last));
    (each, between(0, last))
}

/// FLIP 1.0 keeps second order until particle quadrature limits it: the quadratic kernel from 64
/// cells on (1.4 to 1.5 there), the cubic not yet. APIC with the quadratic kernel is limited from
/// 32 cells on, so that its order over all is only reported.
#[test]
fn the_line_converges() {
    let cells = [16, 32, 64, 128];
    println!("cells {cells:?}");
    for law in Law::ALL {
        for kernel in [Kernel::Quadratic, Kernel::Cubic] {
            for transfer in transfers() {
                // The finest grid shows where quadrature limits FLIP with snow's own law, and no more elsewhere.
                let is_finest = transfer.0 != Transfer::Apic && law == Law::FixedCorotated;
                let cells = if is_finest { &cells[..] } else { &cells[..3] };
                let errors: Vec<f64> = cells.iter().map(|n| line(kernel, transfer, law, *n)).collect();
                let what = format!("line, {}, {} {}", law.name(), kernel.name(), transfer.0.name());
                let (each, overall) = orders(&what, cells, &errors);
                assert!(each[0] >= 1.9, "{what}: order {:.2} on the coarse grids", each[0]);
                assert!(overall >= 1.6, "{what}: order {overall:.2}");
            }
        }
    }
}

/// Two particles a cell and axis. The coarse grids of FLIP 1.0 are not in the range of the order yet.
#[test]
fn the_cube_converges() {
    let cells = [8, 12, 16, 24];
    println!("cells {cells:?}");
    for law in Law::ALL {
        for kernel in [Kernel::Quadratic, Kernel::Cubic] {
            for transfer in transfers() {
                // Both transfers for snow's law, the better of the two for the other.
                let is_flip = transfer.0 != Transfer::Apic;
                if is_flip && law == Law::NeoHookean {
                    continue;
                }
                let errors: Vec<f64> = cells.iter().map(|n| axes(kernel, transfer, law, *n)).collect();
                let what = format!("cube, {}, {} {}", law.name(), kernel.name(), transfer.0.name());
                let (each, overall) = orders(&what, &cells, &errors);
                assert!(overall >= 1.6, "{what}: order {overall:.2} over three refinements");
                assert!(is_flip || each[0] >= 1.9, "{what}: order {:.2} on the coarse grids", each[0]);
            }
        }
    }
}

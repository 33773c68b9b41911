//! Standing waves in uniaxial strain, exact at finite amplitude: a fixed-free bar, and the bars of
//! `vibrating_bar.csv`. A fixed end is a point of odd symmetry: walls are met in `statics`.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use std::f64::consts::PI;

use nappe_sim::{
    math::Precision,
    snow::{Kernel, Material, ParticleState, Transfer},
    world::Simulation,
};
use nappe_tests::{
    golden,
    scene::advance,
    snow::{SnowScene, Variant, crossings, elastic, lattice, object, rework, step_once, wave_modulus},
};

/// A bar along x, one block of four cells thick, endless across.
struct Bar {
    /// Cells along x.
    cells: usize,
    low: f64,
    cell: f64,
    density: f64,
    material: Material,
    /// Blocks of the period along x; 0: free ends.
    period: u32,
    /// Wave number (1/m) of the velocity v0 sin(k x).
    wave_number: f64,
    speed: f64,
}

impl Bar {
    fn wave_speed(&self) -> f64 {
        (wave_modulus(&self.material) / self.density).sqrt()
    }

    /// Two particles a cell along x, one a cell across, moving.
    fn scene(&self, variant: Variant, steps_a_period: u32) -> SnowScene {
        let h = self.cell;
        let x = lattice([self.low, 0.0, 0.0], [2 * self.cells, 4, 4], [0.5 * h, h, h]);
        let body = object("bar", x, 0.5 * h.powi(3), self.density, self.material);
        let (k, v0) = (self.wave_number, self.speed);
        let dt = 2.0 * PI / (self.wave_speed() * k) / f64::from(steps_a_period);
        let scene = SnowScene::new(vec![body], h, dt).by(variant).periodic([self.period, 1, 1]);
        scene.moving(|x| [v0 * (k * x[0]).sin(), 0.0, 0.0])
    }

    fn simulate(&self, scene: &SnowScene) -> Simulation {
        let mut simulation = scene.simulate(Precision::F64);
        let (k, v0) = (self.wave_number, self.speed);
        rework(&mut simulation, |_, p| p.affine[0][0] = v0 * k * (k * p.x[0]).cos());
        simulation
    }
}

/// The fixed-free bar of the table: 25 m and 50 cells from the fixed end, two particles a cell.
fn fixed_free(h: f64) -> Bar {
    Bar {
        cells: (50.0 / h) as usize,
        low: -25.0,
        cell: h,
        density: 1.0,
        material: elastic(100.0, 0.0),
        period: 0,
        wave_number: PI / 50.0,
        speed: 0.1,
    }
}

/// Period, L2 error of the velocity of the centre of mass over a period, and change of energy a
/// period, each relative.
fn figures(bar: &Bar, scene: &SnowScene, periods: u32, steps: u32) -> [f64; 3] {
    let mut simulation = bar.simulate(scene);
    let half = |p: &&ParticleState| p.x[0] > 0.0;
    let (mut cm, mut energies) = (Vec::new(), Vec::new());

    for step in 1..=periods * steps {
        let report = step_once(&mut simulation);
        energies.push(report.diagnostics.total_energy());
        if step % 4 != 0 {
            continue;
        }
        let particles = simulation.snow_particles();
        let moving: Vec<f64> = particles.iter().filter(half).map(|p| p.v[0]).collect();

        // Velocities of symplectic Euler belong to the middle of the step.
        let t = (f64::from(step) - 0.5) * scene.dt;
        cm.push([t, moving.iter().sum::<f64>() / moving.len() as f64]);
    }

    let omega = bar.wave_speed() * bar.wave_number;
    let zeros = crossings(&cm, 0.0);
    let count = zeros.len() - 1;
    let period = 2.0 * (zeros[count] - zeros[0]) / count as f64 * omega / (2.0 * PI);
    let exact = |t: f64| bar.speed * 2.0 / PI * (omega * t).cos();
    let one = &cm[..steps as usize / 4];
    let off: f64 = one.iter().map(|[t, v]| (v - exact(*t)).powi(2)).sum();
    let all: f64 = one.iter().map(|[t, _]| exact(*t).powi(2)).sum();
    let mean = |e: &[f64]| e.iter().sum::<f64>() / e.len() as f64;
    let (first, last) = energies.split_at(energies.len() - steps as usize);
    let drift = (mean(last) / mean(&first[..steps as usize]) - 1.0) / f64::from(periods - 1);
    [period - 1.0, (off / all).sqrt(), drift]
}

#[test]
fn a_fixed_free_bar_keeps_its_period_its_motion_and_its_energy() {
    let (bar, steps) = (fixed_free(0.5), 400);
    for variant in Variant::affine() {
        let [period, motion, drift] = figures(&bar, &bar.scene(variant, steps), 3, steps);
        println!(
            "fixed-free bar, {}: period {period:+.2e}, centre of mass {motion:.2e}, energy {drift:+.2e} per period",
            variant.name()
        );
        assert!(period.abs() < 5e-3, "{}: the period is off by {period:e}", variant.name());
        assert!(motion < 1e-2, "{}: the motion is off by {motion:e}", variant.name());
        assert!((-1e-3..1e-4).contains(&drift), "{}: energy changes by {drift:e}", variant.name());
    }
}

/// A bar of the table by name, with `n` cells between its ends.
fn of_table(case: &str, n: usize) -> (Bar, u32) {
    let bar = |length: f64, young, poisson, density| Bar {
        cells: 2 * n,
        low: -length,
        cell: length / n as f64,
        density,
        material: elastic(young, poisson),
        period: (2 * n / 4) as u32,
        wave_number: PI / length,
        speed: 0.1,
    };
    match case {
        "fixed_fixed_nu0" => (bar(1.0, 1e6, 0.0, 1000.0), 200),
        "snow_confined" => (bar(1.0, 1.4e5, 0.2, 400.0), 200),
        "fixed_free_nu0" => (fixed_free(25.0 / n as f64), 400),
        other => panic!("no bar is named {other}"),
    }
}

/// Value at material point `at` by straight lines between particles of one row.
fn at(points: &[(f64, f64)], at: f64) -> f64 {
    let right = points.partition_point(|(x, _)| *x < at).clamp(1, points.len() - 1);
    let ((x0, y0), (x1, y1)) = (points[right - 1], points[right]);
    y0 + (y1 - y0) * (at - x0) / (x1 - x0)
}

#[test]
fn every_bar_of_the_table_moves_as_it_says() {
    let rows = golden::table("mpm/vibrating_bar.csv");
    let quadratic = Variant { kernel: Kernel::Quadratic, transfer: Transfer::Mls };
    let cubic = Variant { kernel: Kernel::Cubic, transfer: Transfer::Apic };

    for case in ["fixed_fixed_nu0", "fixed_free_nu0", "snow_confined"] {
        for variant in [quadratic, cubic] {
            let (bar, steps) = of_table(case, 64);
            let scene = bar.scene(variant, steps);
            let mut simulation = bar.simulate(&scene);

            // One row of particles along x: every sixteenth.
            let start: Vec<f64> = scene.objects[0].x.iter().step_by(16).map(|x| x[0]).collect();
            let row = |s: &Simulation| s.snow_particles().into_iter().step_by(16).collect::<Vec<_>>();
            let of = |p: &[ParticleState], f: &dyn Fn(&ParticleState) -> f64| -> Vec<(f64, f64)> {
                start.iter().copied().zip(p.iter().map(f)).collect()
            };
            let omega = bar.wave_speed() * bar.wave_number;
            let (mut step, mut compared, mut worst) = (0_u32, 0, [0.0_f64; 2]);
            let (mut now, mut next) = (row(&simulation), Vec::new());

            for line in rows.iter().filter(|line| line.text("case") == case && line.number("t_s") > 0.0) {
                let t = line.number("t_over_period");
                let target = (t * f64::from(steps)).round() as u32;
                if step <= target {
                    advance(&mut simulation, u64::from(target - step));
                    now = row(&simulation);
                    // Velocities belong to the middle of steps: those of two are needed.
                    step_once(&mut simulation);
                    next = row(&simulation);
                    step = target + 1;
                }

                let x = line.number("X_m");
                let displacement: Vec<_> = start.iter().zip(&now).map(|(x, p)| (*x, p.x[0] - x)).collect();
                let (old, new) = (of(&now, &|p| p.v[0]), of(&next, &|p| p.v[0]));
                let stretch = of(&now, &|p| p.elastic[0][0]);
                let off = [
                    (at(&displacement, x) - line.number("u_m")) * omega / bar.speed,
                    (f64::midpoint(at(&old, x), at(&new, x)) - line.number("v_m_s")) / bar.speed,
                    (at(&stretch, x) - line.number("F11")) * bar.wave_speed() / bar.speed,
                ];

                // The amplitude, and a period that is right to 5e-4.
                let limit = 5e-3 + 2.0 * PI * t * 5e-4;

                for (what, off) in ["displacement", "velocity", "F"].iter().zip(off) {
                    let place = format!("{case} {} at {t:.1} periods, X = {x}", variant.name());
                    assert!(off.abs() < limit, "{place}: {what} is off by {off:e}");
                }
                worst[usize::from(t > 1.0)] = worst[usize::from(t > 1.0)].max(off[0].abs());
                compared += 1;
            }

            println!("{case} {}: off by {:.1e}, after 10 periods {:.1e}", variant.name(), worst[0], worst[1]);
            assert!(compared > 60, "the table has rows of {case}");
        }
    }
}

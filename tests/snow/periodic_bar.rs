//! A standing wave on a periodic bar: the error that a correct explicit method has, by kernel,
//! transfer, amplitude and grid (`expected_1d_convergence.csv`), linear kernel included.
//!
//! A single row of particles is enough: the transverse weights are a common factor of masses and
//! momenta, so nodes across have the velocities of the bar in one dimension.

use std::f64::consts::TAU;

use nappe_sim::{
    math::Precision,
    snow::{Advection, Blend, Kernel, Transfer},
};
use nappe_tests::{
    golden::{self, Row},
    scene::advance,
    snow::{SnowScene, Variant, elastic, lattice, object},
    threads::with_threads,
};

const YOUNG: f64 = 100.0;
const DENSITY: f64 = 1.0;
const SPEED: f64 = 10.0;

/// A run: the kernel, the share of FLIP, what moves particles, amplitude, cells.
struct Run {
    variant: Variant,
    advection: Advection,
    amplitude: f64,
    cells: u32,
    particles_a_cell: u32,
    steps: u32,
}

impl Run {
    fn of(row: &Row) -> Self {
        let kernel = Kernel::ALL.into_iter().find(|k| k.name() == row.text("kernel")).expect("a kernel");
        // The name of the scheme holds a comma: the table's last fields are one further.
        let (share, advection) = match row.text("scheme") {
            "FLIP 1.0" => (1.0, Advection::Grid),
            "PIC/FLIP 0.95" => (0.95, Advection::Particle),
            other => panic!("no scheme is named '{other}'"),
        };
        Self {
            variant: Variant { kernel, transfer: Transfer::PicFlip(Blend::PerStep(share)) },
            advection,
            amplitude: row.number("A_over_L"),
            cells: row.count("n_cells") as u32,
            particles_a_cell: row.count("particles_per_cell") as u32,
            steps: row.count("n_steps") as u32,
        }
    }

    /// rms error of displacement over the amplitude, after a quarter period; particles lie at
    /// `across` (m) of the nodes.
    fn error(&self, across: [f64; 2]) -> f64 {
        let h = 1.0 / f64::from(self.cells);
        let spacing = h / f64::from(self.particles_a_cell);
        let count = (self.cells * self.particles_a_cell) as usize;
        let low = [0.0, across[0] - 0.5 * h, across[1] - 0.5 * h];
        let x = lattice(low, [count, 1, 1], [spacing, h, h]);
        let body = object("bar", x, spacing * h * h, DENSITY, elastic(YOUNG, 0.0));
        let peak = self.amplitude * TAU * SPEED;
        let mut scene = SnowScene::new(vec![body], h, 0.1 * h / SPEED)
            .by(self.variant)
            .periodic([self.cells / 4, 0, 0])
            .moving(|x| [peak * (TAU * x[0]).sin(), 0.0, 0.0]);
        scene.settings.advection = self.advection;

        // A row is too small to be shared out.
        let particles = with_threads(1, || {
            let mut simulation = scene.simulate(Precision::F64);
            advance(&mut simulation, u64::from(self.steps));
            simulation.snow_particles()
        });

        let off = |(p, x): (&nappe_sim::snow::ParticleState, &[f64; 3])| {
            let moved = p.x[0] - x[0];
            assert!(p.x[1] == x[1] && p.x[2] == x[2], "the bar leaves its line: {:?}", p.x);
            (moved - self.amplitude * (TAU * x[0]).sin()).powi(2)
        };

        let sum: f64 = particles.iter().zip(&scene.objects[0].x).map(off).sum();
        (sum / count as f64).sqrt() / self.amplitude
    }
}

/// The table, with the comma of the scheme's name out of the way.
fn rows() -> Vec<Row> {
    golden::table_with("mpm/expected_1d_convergence.csv", |line| {
        line.replace(", x moved with grid velocity", "").replace(", x moved with v_p (paper)", "")
    })
}

#[test]
fn expected_errors_of_every_kernel_scheme_amplitude_and_grid() {
    let rows = rows();
    assert_eq!(rows.len(), 60);
    for row in &rows {
        let run = Run::of(row);
        let across = [0.3, 0.7].map(|c| c / f64::from(run.cells));
        let (own, golden) = (run.error(across), row.number("rms_displacement_error_over_A"));
        let what = format!(
            "{} {} A = {} on {} cells",
            row.text("scheme"),
            row.text("kernel"),
            run.amplitude,
            run.cells
        );
        assert!((own / golden - 1.0).abs() < 0.01, "{what}: {own:.6e}, not {golden:.6e}");
    }
}

#[test]
fn expected_errors_do_not_depend_on_where_the_row_lies() {
    for row in rows().iter().filter(|row| row.text("n_cells") == "16") {
        let run = Run::of(row);
        let h = 1.0 / 16.0;
        let reference = run.error([0.25 * h, 0.5 * h]);
        // Near a node the slope of the linear kernel is not small against its weight, and rounding of
        // the stress across would be seen.
        for across in [[0.4, 0.6], [0.5, -7.25], [0.3, 13.7]].map(|across| across.map(|c| c * h)) {
            let off = (run.error(across) / reference - 1.0).abs();
            assert!(
                off < 1e-9,
                "{} {}: at {across:?} off by {off:e}",
                row.text("scheme"),
                row.text("kernel")
            );
        }
    }
}

#[test]
fn the_linear_kernel_grows_worse_as_the_grid_grows_finer() {
    let error = |kernel: Kernel, cells: u32| {
        let variant = Variant { kernel, transfer: Transfer::PicFlip(Blend::PerStep(1.0)) };
        let steps = cells * 10 / 4;
        Run { variant, advection: Advection::Grid, amplitude: 0.02, cells, particles_a_cell: 4, steps }
            .error([0.3, 0.7].map(|c| c / f64::from(cells)))
    };

    let linear = [32, 64, 128].map(|cells| error(Kernel::Linear, cells));
    assert!(linear[0] < linear[1] && linear[1] < linear[2], "errors {linear:?}");
    let cubic = [32, 64, 128].map(|cells| error(Kernel::Cubic, cells));
    assert!(cubic[0] > 2.5 * cubic[1] && cubic[1] > 2.5 * cubic[2], "errors {cubic:?}");

    // And a scene that asks for it is told so.
    let body = object("snow", vec![[0.0; 3]], 1.0, 1.0, elastic(YOUNG, 0.0));
    let variant = Variant { kernel: Kernel::Linear, transfer: Transfer::PicFlip(Blend::PerStep(1.0)) };
    let scene = SnowScene::new(vec![body], 1.0, 1e-3).by(variant);
    let (_, remarks) =
        nappe_sim::world::Simulation::new(&scene.setup(), Precision::F64).expect("it is built");
    assert!(remarks.iter().any(|remark| remark.contains("linear kernel")), "{remarks:?}");
}

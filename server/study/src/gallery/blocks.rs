//! Blocks of snow in which material point methods fail.

use nappe_sim::{
    math::Precision,
    report::NoStopwatch,
    snow::{Material, ParticleState, Plasticity},
    time_step::TimeStep,
    world::Simulation,
};

use super::{
    finding::Finding,
    row::Row,
    snow::{SnowScene, elastic, lattice, object, rework},
};
use crate::{method::Variant, run::Verdict};

/// Side of a cell (m); particles are half of it apart.
const CELL: f64 = 0.1;
/// The longest step (s) of the material at J_P = 1 that is certified on these cells, rounded down.
const STEP: f64 = 2e-3;
/// Share of the kinetic and elastic energy that a run may gain.
const GAIN: f64 = 0.1;

/// The snow of Stomakhin et al. 2013, compacted to half of its volume at most.
fn snow() -> Material {
    let plasticity = Plasticity {
        critical_compression: 0.025,
        critical_stretch: 0.0075,
        hardening: 10.0,
        plastic_ratio_range: [0.5, 1.2],
    };
    Material { plasticity: Some(plasticity), ..elastic(1.4e5, 0.2) }
}

/// So many particles along each axis, in certified steps.
fn block(count: usize, variant: Variant) -> SnowScene {
    let x = lattice([0.0; 3], [count; 3], [0.5 * CELL; 3]);
    let volume = (0.5 * CELL).powi(3);
    let mut scene = SnowScene::new(vec![object("block", x, volume, 400.0, snow())], CELL, STEP).by(variant);
    scene.settings.time_step = TimeStep::default();
    scene
}

/// Runs a scene whose particles are changed before the first step. All must stay finite, and no energy may come from nowhere.
pub(super) fn run(
    scene: &SnowScene,
    steps: u64,
    change: impl FnMut(usize, &mut ParticleState),
) -> (Finding, Option<Simulation>) {
    let (mut simulation, warnings) = match Simulation::new(&scene.setup(), Precision::F64) {
        Ok(built) => built,
        Err(error) => return (Finding::new(Verdict::Detected, error.to_string()), None),
    };
    rework(&mut simulation, change);
    let start = simulation.diagnose().total_energy();
    let [mut substeps, mut inverted] = [0_u64; 2];
    for step in 0..steps {
        let report = match simulation.step(&mut NoStopwatch) {
            Ok(report) => report,
            Err(error) => return (Finding::stopped(&error), None),
        };
        let now = report.diagnostics;
        let gain = now.total_energy() - start - GAIN * (now.kinetic_energy + now.elastic_energy);
        let is_finite =
            simulation.snow_particles().iter().all(|p| p.x.iter().chain(&p.v).all(|c| c.is_finite()));
        if !is_finite || gain.is_nan() || gain > 1e-9 * start.abs() {
            return (Finding::new(Verdict::Lost, format!("{gain:.1e} J gained at step {step}")), None);
        }
        if let Some(snow) = report.snow {
            substeps += u64::from(snow.substeps);
            inverted = inverted.max(snow.inverted_count);
        }
    }
    let taken = if substeps > steps {
        Finding::new(Verdict::Recovered, "shorter steps")
    } else {
        Finding::new(Verdict::Survived, "")
    };
    let told = if inverted > 0 { taken.with(&format!("{inverted} inverted, told")) } else { taken };
    let finding = if warnings.is_empty() { told } else { Finding::new(Verdict::Warned, "the kernel") };
    (finding, Some(simulation))
}

fn compacted(variant: Variant) -> Finding {
    run(&block(6, variant), 50, |_, particle| particle.plastic_ratio = 0.5).0
}

fn out_of_range(variant: Variant) -> Finding {
    let scene = block(4, variant);
    run(&scene, 20, |index, particle| {
        if index == 0 {
            particle.x[0] = 1e9 * CELL;
        }
    })
    .0
}

/// A particle in the middle of a block has a deformation of its own.
fn deformed(variant: Variant, across: f64) -> Finding {
    run(&block(5, variant), 100, |index, particle| {
        if index == 62 {
            particle.elastic = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, across]];
        }
    })
    .0
}

fn lone(variant: Variant) -> Finding {
    let scene = block(1, variant).under([0.0, -9.81, 0.0]);
    let (finding, simulation) = run(&scene, 100, |_, _| {});
    let Some(simulation) = simulation else { return finding };
    let fallen = 0.25 * CELL - simulation.snow_particles()[0].x[1];
    let share = fallen / (0.5 * 9.81 * simulation.time().powi(2));
    // Symplectic Euler falls g t h / 2 farther.
    finding
        .with(&format!("{share:.3} of g t² / 2"))
        .only_if(|| (share - 1.0).abs() < 0.011, || format!("{share:.3} of g t² / 2"))
}

/// A block that moves across cells at a constant speed, slightly pressed together.
fn across_cells(variant: Variant) -> Finding {
    let scene = block(4, variant).moving(|_| [2.0, 0.5, 0.0]);
    run(&scene, 100, |_, particle| particle.elastic = [[0.99, 0.0, 0.0], [0.0, 0.99, 0.0], [0.0, 0.0, 0.99]])
        .0
}

/// Scenes over every transfer with the kernels that go with it.
pub(super) const SCENES: [Row<Variant>; 6] = [
    Row { number: 32, what: "compacted to J_P = 0.5, in steps for J_P = 1", run: compacted },
    Row { number: 33, what: "a particle beyond the range of the grid", run: out_of_range },
    Row {
        number: 34,
        what: "F nearly singular, 1e-6 along one axis",
        run: |variant| deformed(variant, 1e-6),
    },
    Row { number: 35, what: "F inverted, -0.5 along one axis", run: |variant| deformed(variant, -0.5) },
    Row { number: 36, what: "one lone particle that falls", run: lone },
    Row { number: 37, what: "a block that moves across cells", run: across_cells },
];

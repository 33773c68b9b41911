//! Scenes of snow that between them use every kernel, transfer and integration; runs that were
//! interrupted and put back.
//!
//! Each has two sizes. The whole scene has a committed hash, which every build compares. Without optimisation
//! a step costs many times as much, so there the small scene takes its place where a run is repeated: for
//! every number of threads, every width of vector instructions, and an interruption.

use nappe_sim::{
    collide::{Collider, Contact, Shape, shape::Sphere},
    linalg::Stop,
    math::{Precision, SimdLevel, force_simd_level, simd_level},
    snow::{Integration, ParticleState, Preset, SnowObject},
    time_step::TimeStep,
    world::Simulation,
};
use nappe_tests::{
    networks::scatter,
    scene::advance,
    snow::{SnowScene, Variant, ball, lattice, object, plane, rework},
    threads::{THREAD_COUNTS, with_threads},
};

/// Side of a cell (m).
const H: f64 = 0.05;

/// How much snow there is, and for how long.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Size {
    /// Some 1400 particles for 4 steps of the world.
    Whole,
    /// Some 200 particles for 2 steps.
    Small,
}

/// How a run is stepped: a kernel with a transfer, and the integration.
#[derive(Clone, Copy, Debug)]
pub(crate) struct SnowRun {
    variant: Variant,
    integration: Integration,
    pub(crate) precision: Precision,
    size: Size,
}

impl SnowRun {
    /// Every combination that a hash is committed for.
    pub(crate) fn all() -> Vec<Self> {
        Self::of(Size::Whole)
    }

    /// Every combination, as large as this build can afford to repeat it.
    pub(crate) fn repeated() -> Vec<Self> {
        Self::of(if cfg!(debug_assertions) { Size::Small } else { Size::Whole })
    }

    fn of(size: Size) -> Vec<Self> {
        let stop = Stop::Residual { tolerance: 1e-4, max_iterations: 200 };
        let implicit = Integration::SemiImplicit { beta: 1.0, stop };
        let mut runs = Vec::new();
        for precision in Precision::ALL {
            for variant in Variant::all() {
                runs.push(Self { variant, integration: Integration::Explicit, precision, size });
            }
            for variant in Variant::affine() {
                runs.push(Self { variant, integration: implicit, precision, size });
            }
        }

        runs
    }

    /// Whether velocities are not solved for.
    pub(crate) fn is_explicit(&self) -> bool {
        self.integration == Integration::Explicit
    }

    /// Steps of the world.
    pub(crate) fn steps(&self) -> u64 {
        match self.size {
            Size::Whole => 4,
            Size::Small => 2,
        }
    }

    /// `snow mls_quadratic_explicit f32 4`, ...
    pub(crate) fn key(&self) -> String {
        let integration = match self.integration {
            Integration::Explicit => "explicit",
            Integration::SemiImplicit { .. } => "semi_implicit",
        };
        format!("snow {}_{integration} {} {}", self.variant.name(), self.precision, self.steps())
    }

    /// A ball of snow that hits a harder block on a slope beside a post that moves.
    pub(crate) fn scene(&self) -> SnowScene {
        let h = H;
        let (center, radius, counts) = match self.size {
            Size::Whole => ([-0.31, 0.33, 0.02], 0.16, [5, 7, 9]),
            Size::Small => ([-0.16, 0.24, -0.06], 0.09, [3, 3, 4]),
        };
        let soft = Preset::from_name("stomakhin").expect("a preset");
        let mut thrown =
            object("thrown", ball(center, radius, 0.5 * h), (0.5 * h).powi(3), soft.density, soft.material);
        thrown.v.fill([6.0, -3.0, 0.5]);
        thrown.stiffness = (0..thrown.x.len()).map(|i| 1.0 + 0.5 * scatter(i)).collect();
        let hard = Preset::from_name("brasseur_neo_hookean").expect("a preset");
        let x = lattice([-0.1, 0.02, -0.12], counts, [0.5 * h; 3]);
        // Its volumes come from the grid.
        let block = SnowObject {
            volume: Vec::new(),
            ..object("block", x, (0.5 * h).powi(3), hard.density, hard.material)
        };
        let mut scene =
            SnowScene::new(vec![thrown, block], h, 4e-3).by(self.variant).under([0.0, -9.81, 0.0]);
        scene.settings.time_step = TimeStep::default();
        scene.settings.integration = self.integration;
        scene.settings.ballistic_below = 0.1;
        let post = Shape::Sphere(Sphere { center: [0.3, 0.1, 0.0], radius: 0.12 });
        scene.colliders = vec![
            plane([0.0; 3], [0.6, 0.8, 0.0], Contact::Separating, 0.4),
            Collider {
                shape: post,
                velocity: [-2.0, 0.0, 0.0],
                contact: Contact::Slip,
                ..plane([0.0; 3], [0.0, 1.0, 0.0], Contact::Slip, 0.2)
            },
        ];
        "post".clone_into(&mut scene.colliders[1].name);
        scene
    }

    /// The simulation after all steps.
    pub(crate) fn run(&self) -> Simulation {
        let mut simulation = self.scene().simulate(self.precision);
        advance(&mut simulation, self.steps());
        simulation
    }

    /// Its hash on so many threads.
    pub(crate) fn hash(&self, threads: usize) -> u64 {
        with_threads(threads, || self.run().state_hash())
    }
}

#[test]
fn snow_has_the_same_hash_for_any_number_of_threads() {
    for run in SnowRun::repeated() {
        let hashes = THREAD_COUNTS.map(|threads| run.hash(threads));
        assert!(
            hashes.iter().all(|h| *h == hashes[0]),
            "{}: {hashes:016x?} on {THREAD_COUNTS:?} threads",
            run.key()
        );
    }
}

#[test]
fn every_width_of_vector_instructions_gives_snow_the_same_bits() {
    let best = simd_level();
    for run in SnowRun::repeated() {
        let hashes = SimdLevel::ALL.iter().map(|level| {
            let used = force_simd_level(*level);
            (used, run.run().state_hash())
        });
        let hashes: Vec<_> = hashes.collect();
        assert!(hashes.iter().all(|(_, hash)| *hash == hashes[0].1), "{}: {hashes:016x?}", run.key());
    }

    force_simd_level(best);
}

/// What particles carry, as bits.
fn bits(simulation: &Simulation) -> Vec<u64> {
    let of = |p: ParticleState| {
        let stress = p.volume_stress.expect("a particle tells its stress");
        let tensors = [p.elastic, p.affine];
        let numbers = p.x.into_iter().chain(p.v).chain([p.plastic_ratio]).chain(stress);
        numbers.chain(tensors.as_flattened().as_flattened().to_vec()).map(f64::to_bits).collect::<Vec<_>>()
    };

    simulation.snow_particles().into_iter().flat_map(of).collect()
}

#[test]
fn snow_that_is_put_back_goes_on_with_the_same_bits() {
    for run in SnowRun::repeated() {
        let half = run.steps() / 2;
        // Colliders that move are where the time says: the new run begins at time 0.
        let mut scene = run.scene();
        scene.colliders.truncate(1);
        // Particles tell no length of certified steps, which a run that they are put into begins anew.
        scene.settings.time_step = TimeStep::Unchecked(1e-4);
        let mut whole = scene.simulate(run.precision);
        advance(&mut whole, half);
        let middle = whole.snow_particles();
        advance(&mut whole, half);
        let mut second = scene.simulate(run.precision);
        second.restore_snow(&middle);
        advance(&mut second, half);
        assert!(bits(&whole) == bits(&second), "{}: differs after it was put back", run.key());

        // The stress follows from the rest, to rounding.
        let mut third = scene.simulate(run.precision);
        third.restore_snow(&middle);
        rework(&mut third, |_, _| {});
        let rounding = if run.precision == Precision::F64 { f64::EPSILON } else { f64::from(f32::EPSILON) };
        for (i, (p, q)) in middle.iter().zip(third.snow_particles()).enumerate() {
            let (a, b) = (p.volume_stress.expect("stress"), q.volume_stress.expect("stress"));
            let off = a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let off = off / (rounding * stiffness(&scene, i, p));
            let ballistic = a == [0.0; 6];
            assert!(ballistic || off < 8.0, "{}: {a:?}, anew {b:?}: {off} roundings", run.key());
        }
    }
}

/// What a strain is multiplied with in the stress of a particle (J): a stress has the rounding of
/// its singular values, which are about 1, times this, however small it is itself.
fn stiffness(scene: &SnowScene, particle: usize, p: &ParticleState) -> f64 {
    let (object, i) = match particle.checked_sub(scene.objects[0].x.len()) {
        None => (&scene.objects[0], particle),
        Some(i) => (&scene.objects[1], i),
    };

    let hardening = object.material.plasticity.map_or(0.0, |p| p.hardening);
    let factor = object.stiffness.get(i).unwrap_or(&1.0) * (hardening * (1.0 - p.plastic_ratio)).exp();
    let modulus = 2.0 * object.material.mu() + 3.0 * object.material.lambda();

    // From the grid, a particle at a corner has up to eight times the volume of one inside.
    let volume = object.volume.get(i).copied().unwrap_or(8.0 * (0.5 * H).powi(3));
    modulus * factor * volume * p.elastic.as_flattened().iter().map(|f| f * f).sum::<f64>()
}

//! Worlds of snow alone: lattices of particles, and what particles carry changed by hand.

use nappe_sim::{
    collide::Collider,
    math::Precision,
    snow::{Law, Material, ParticleState, SnowObject, SnowSettings, SnowSetup},
    time_step::TimeStep,
    world::{Simulation, WorldSetup},
};

use crate::method::Variant;

/// An elastic material of the fixed-corotated law.
pub const fn elastic(young: f64, poisson: f64) -> Material {
    Material { law: Law::FixedCorotated, young, poisson, plasticity: None }
}

/// Centres of a lattice of `counts` boxes of size `spacing` (m) that begins at `low` (m).
pub fn lattice(low: [f64; 3], counts: [usize; 3], spacing: [f64; 3]) -> Vec<[f64; 3]> {
    let mut x = Vec::with_capacity(counts.iter().product());
    for i in 0..counts[0] {
        for j in 0..counts[1] {
            for k in 0..counts[2] {
                let index = [i, j, k];
                x.push([0, 1, 2].map(|a| low[a] + (index[a] as f64 + 0.5) * spacing[a]));
            }
        }
    }
    x
}

/// An object at rest: particles of `volume` (m³) each and of `density` (kg/m³).
pub fn object(name: &str, x: Vec<[f64; 3]>, volume: f64, density: f64, material: Material) -> SnowObject {
    let count = x.len();
    SnowObject {
        name: name.to_owned(),
        x,
        v: vec![[0.0; 3]; count],
        angular_velocity: [0.0; 3],
        mass: vec![density * volume; count],
        volume: vec![volume; count],
        stiffness: Vec::new(),
        material,
        attach: None,
    }
}

/// A world of snow alone.
#[derive(Clone, Debug)]
pub struct SnowScene {
    /// Time step of the world (s).
    pub dt: f64,
    /// Acceleration of gravity (m/s²).
    pub gravity: [f64; 3],
    /// Solids that the snow meets.
    pub colliders: Vec<Collider>,
    /// Bodies of snow, all on one grid.
    pub objects: Vec<SnowObject>,
    /// How they are stepped.
    pub settings: SnowSettings,
}

impl SnowScene {
    /// Objects on cells of side `cell` (m), without gravity or colliders; a step of the world is
    /// one step of the snow of `dt` (s), whatever the bound says.
    pub fn new(objects: Vec<SnowObject>, cell: f64, dt: f64) -> Self {
        let settings = SnowSettings { time_step: TimeStep::Unchecked(dt), ..SnowSettings::new(cell) };
        Self { dt, gravity: [0.0; 3], colliders: Vec::new(), objects, settings }
    }

    /// The same with a kernel and a transfer.
    #[must_use]
    pub fn by(mut self, variant: Variant) -> Self {
        (self.settings.kernel, self.settings.transfer) = (variant.kernel, variant.transfer);
        self
    }

    /// The same with periods of so many blocks of four cells.
    #[must_use]
    pub fn periodic(mut self, blocks: [u32; 3]) -> Self {
        self.settings.periodic = blocks;
        self
    }

    /// The same under `gravity` (m/s²).
    #[must_use]
    pub fn under(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = gravity;
        self
    }

    /// The same with `count` steps of the snow in a step of the world.
    #[must_use]
    pub fn grouped(mut self, count: u32) -> Self {
        self.dt *= f64::from(count);
        self
    }

    /// The same with velocities (m/s) by place.
    #[must_use]
    pub fn moving(mut self, v: impl Fn([f64; 3]) -> [f64; 3]) -> Self {
        for object in &mut self.objects {
            object.v = object.x.iter().map(|x| v(*x)).collect();
        }
        self
    }

    /// As the library takes it.
    pub fn setup(&self) -> WorldSetup {
        WorldSetup {
            dt: self.dt,
            gravity: self.gravity,
            wind_at: Vec::new(),
            wind: [0.0; 3],
            colliders: self.colliders.clone(),
            bodies: Vec::new(),
            snow: Some(SnowSetup { objects: self.objects.clone(), settings: self.settings }),
        }
    }

    /// Builds its simulation, which must be accepted.
    pub fn simulate(&self, precision: Precision) -> Simulation {
        match Simulation::new(&self.setup(), precision) {
            Ok((simulation, _)) => simulation,
            Err(error) => panic!("the scene was refused: {error}"),
        }
    }

    /// Masses (kg) of all particles.
    pub fn masses(&self) -> Vec<f64> {
        self.objects.iter().flat_map(|object| object.mass.iter().copied()).collect()
    }
}

/// Changes what every particle carries; the stress follows from the deformation.
pub fn rework(simulation: &mut Simulation, mut change: impl FnMut(usize, &mut ParticleState)) {
    let mut particles = simulation.snow_particles();
    for (index, particle) in particles.iter_mut().enumerate() {
        particle.volume_stress = None;
        change(index, particle);
    }
    simulation.restore_snow(&particles);
}

//! A world of one body of cloth, and plain access to what comes out.

use nappe_sim::{
    cloth::{ClothSettings, Network},
    collide::Collider,
    field::Field,
    linalg::{AtCap, OperatorKind, PreconditionerKind, SolverSettings, Stop},
    math::Precision,
    time_step::TimeStep,
    world::{BodySetup, Simulation, WorldSetup},
};

pub use nappe_sim::math::array::{cross, length as norm, minus as difference};

use crate::method::Method;

/// A linear solver that stops only at rounding: golden data were made with direct solvers.
pub const EXACT: SolverSettings = SolverSettings {
    stop: Stop::Residual { tolerance: 1e-15, max_iterations: 600 },
    preconditioner: PreconditionerKind::BlockJacobi,
    at_cap: AtCap::Stop,
    operator: OperatorKind::MatrixFree,
    warm_start: false,
    floor: 0.0,
};

/// A world of one body.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Particles and springs.
    pub network: Network,
    /// Time step (s).
    pub dt: f64,
    /// Acceleration of gravity (m/s²).
    pub gravity: [f64; 3],
    /// Velocity of the medium (m/s).
    pub wind: [f64; 3],
    /// Solids that the cloth meets.
    pub colliders: Vec<Collider>,
    /// How it is stepped.
    pub settings: ClothSettings,
}

impl Scene {
    /// A scene without gravity, wind or colliders, solved to rounding, in steps of `dt` whatever is known of them.
    pub fn new(network: Network, dt: f64) -> Self {
        let time_step = TimeStep::Unchecked(f64::INFINITY);
        let settings = ClothSettings { solver: EXACT, time_step, ..ClothSettings::default() };
        Self { network, dt, gravity: [0.0; 3], wind: [0.0; 3], colliders: Vec::new(), settings }
    }

    /// The same stepped by `method`.
    #[must_use]
    pub fn by(mut self, method: Method) -> Self {
        self.settings.integrator = method.integrator;
        self.settings.minimizer = method.minimizer;
        self.settings.hessian = method.hessian;
        self
    }

    /// The same under `gravity` (m/s²).
    #[must_use]
    pub fn under(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = gravity;
        self
    }

    /// The same in so many sub-steps per step, whatever is known of them.
    #[must_use]
    pub fn in_substeps(mut self, count: u32) -> Self {
        self.settings.time_step = TimeStep::Unchecked(self.dt / f64::from(count));
        self
    }

    /// The same in steps that are certified or accepted, as a scene has them that says nothing of it.
    #[must_use]
    pub fn certified(mut self) -> Self {
        self.settings.time_step = TimeStep::default();
        self
    }

    /// As the library takes it.
    pub fn setup(&self) -> WorldSetup {
        WorldSetup {
            dt: self.dt,
            gravity: self.gravity,
            wind_at: Vec::new(),
            wind: self.wind,
            colliders: self.colliders.clone(),
            bodies: vec![BodySetup {
                name: "body".to_owned(),
                network: self.network.clone(),
                settings: self.settings,
                forces: Vec::new(),
            }],
            snow: None,
        }
    }

    /// Builds its simulation, which must be accepted.
    pub fn simulate(&self, precision: Precision) -> Simulation {
        match Simulation::new(&self.setup(), precision) {
            Ok((simulation, _)) => simulation,
            Err(error) => panic!("the scene was refused: {error}"),
        }
    }
}

/// Positions (m), the user's numbering.
pub fn positions(simulation: &Simulation) -> Vec<[f64; 3]> {
    vectors(simulation, Field::Positions)
}

/// Velocities (m/s), the user's numbering.
pub fn velocities(simulation: &Simulation) -> Vec<[f64; 3]> {
    vectors(simulation, Field::Velocities)
}

fn vectors(simulation: &Simulation, field: Field) -> Vec<[f64; 3]> {
    let mut vectors = vec![[0.0; 3]; simulation.particle_count()];
    simulation.read::<f64>(field, vectors.as_flattened_mut());
    vectors
}

/// Largest distance between two lists of points; infinite if one is not finite.
pub fn max_distance(a: &[[f64; 3]], b: &[[f64; 3]]) -> f64 {
    assert_eq!(a.len(), b.len());
    let distances = a.iter().zip(b).map(|(p, q)| norm(difference(*p, *q)));
    distances.fold(0.0, |largest, d| if d.is_finite() { f64::max(largest, d) } else { f64::INFINITY })
}

/// Linear and angular momentum about the origin, of all particles.
pub fn momenta(simulation: &Simulation, masses: &[f64]) -> ([f64; 3], [f64; 3]) {
    let (mut linear, mut angular) = ([0.0; 3], [0.0; 3]);
    for ((x, v), m) in positions(simulation).iter().zip(velocities(simulation)).zip(masses) {
        let turning = cross(*x, v);
        for i in 0..3 {
            linear[i] += m * v[i];
            angular[i] += m * turning[i];
        }
    }
    (linear, angular)
}

//! The state of a cloth, what a checkpoint saves; and the scratch memory of a step.

use std::sync::Arc;

use super::{
    integrator::Integrator,
    model::{Model, Parameters},
};
use crate::{
    linalg::{BlockCsr, CgWorkspace, Inverse3},
    math::{Padded, Real, Vec3, vec3},
    parallel::{block_count, hash_numbers},
    surroundings::Surroundings,
};

/// A pinned particle on its way from point to point.
#[derive(Clone, Debug, PartialEq)]
pub struct PinMotion {
    /// The particle, in the model's numbering.
    pub particle: u32,
    /// Where it goes one after the other; at least one. Shared, so that a step copies none of them.
    pub points: Arc<[PathPoint]>,
    /// Index of the point that it goes to now.
    pub next: usize,
    /// Sub-steps until it arrives there.
    pub steps_left: u64,
}

/// Where a pin goes, and how long it takes from the point before.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PathPoint {
    /// Where it arrives (m).
    pub target: [f64; 3],
    /// Sub-steps that it takes, 1 or more.
    pub steps: u64,
}

impl PinMotion {
    /// Takes a pin along points, from where it is.
    pub(crate) fn along(particle: u32, points: Arc<[PathPoint]>) -> Self {
        let steps_left = points[0].steps;
        Self { particle, points, next: 0, steps_left }
    }

    /// Hash of what is left of it, a link per point.
    pub(crate) fn hash(&self, seed: u64) -> u64 {
        let start = hash_numbers(seed, [self.steps_left as f64]);
        self.points[self.next..].iter().fold(start, |hash, PathPoint { target: [x, y, z], steps }| {
            hash_numbers(hash, [*x, *y, *z, *steps as f64])
        })
    }
}

/// What changes from step to step.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct State<R: Real> {
    /// Positions (m), in the model's numbering.
    pub x: Vec<Vec3<R>>,
    /// Velocities (m/s), in the model's numbering.
    pub v: Vec<Vec3<R>>,
    /// Change of velocity of the step before (m/s): where a warm start begins.
    pub dv: Vec<Vec3<R>>,
    /// Pins on their way, in the order of their particles.
    pub motions: Vec<PinMotion>,
}

impl<R: Real> State<R> {
    /// Copies into vectors that are already there.
    pub(crate) fn copy_from(&mut self, other: &Self) {
        self.x.clone_from(&other.x);
        self.v.clone_from(&other.v);
        self.dv.clone_from(&other.dv);
        self.motions.clone_from(&other.motions);
    }

    /// Gives moving pins the velocity that brings them to their targets in the steps left.
    pub(super) fn aim_pins(&mut self, dt: f64) {
        for motion in &mut self.motions {
            let i = motion.particle as usize;
            self.v[i] = if motion.steps_left == 0 {
                Vec3::zeros()
            } else {
                let target = motion.points[motion.next].target;
                let way = vec3::<f64>(target) - self.x[i].map(R::to_f64);
                (way / (motion.steps_left as f64 * dt)).map(R::of)
            };

            motion.steps_left = motion.steps_left.saturating_sub(1);
        }
    }

    /// Sends pins that stand at a point to the next one, and forgets those that stand at their last.
    pub(super) fn rest_pins(&mut self) {
        let v = &mut self.v;
        self.motions.retain_mut(|motion| {
            if motion.steps_left > 0 {
                return true;
            }

            // It stands at every point, so that a path has the bits of its moves made one by one.
            v[motion.particle as usize] = Vec3::zeros();
            motion.next += 1;
            let next = motion.points.get(motion.next);
            motion.steps_left = next.map_or(0, |point| point.steps);
            next.is_some()
        });
    }
}

/// Parameters and time step as the kernels of one step read them.
#[derive(Clone, Debug, Default)]
pub(super) struct Frozen<R: Real> {
    /// Time step of the cloth (s): that of the world over the number of sub-steps.
    pub(super) dt: f64,
    /// (k, nu) of each law.
    pub(super) laws: Vec<[R; 2]>,
    /// (h² k, h nu) of each law.
    pub(super) implicit_laws: Vec<[R; 2]>,
    /// Linear drag of the medium (N s/m).
    pub(super) drag: R,
    /// Velocity of the medium (m/s).
    pub(super) wind: Vec3<R>,
    /// Gravity (m/s²).
    pub(super) gravity: Vec3<R>,
}

impl<R: Real> Frozen<R> {
    /// Takes over the parameters and the surroundings of a step that is divided into `substeps`.
    pub(super) fn refresh(&mut self, parameters: &Parameters, around: &Surroundings<'_>, substeps: u32) {
        let dt = around.dt / f64::from(substeps);
        self.dt = dt;
        let laws = || parameters.laws.iter().map(|entry| (entry.law.stiffness, entry.law.damping));

        self.laws.clear();
        self.laws.extend(laws().map(|(k, nu)| [R::of(k), R::of(nu)]));
        self.implicit_laws.clear();
        self.implicit_laws.extend(laws().map(|(k, nu)| [R::of(dt * dt * k), R::of(dt * nu)]));

        self.drag = R::of(parameters.drag);
        (self.gravity, self.wind) = (vec3(around.gravity), vec3(around.wind));
    }
}

/// Scratch memory: a step allocates nothing after the first.
#[derive(Clone, Debug, Default)]
pub struct Workspace<R: Real> {
    /// The state before the step, to return to.
    pub(crate) before: State<R>,
    pub(super) frozen: Frozen<R>,
    /// Positions and velocities, padded for the kernels.
    pub(super) padded: [Vec<Padded<R>>; 2],
    /// Forces of springs and medium (N).
    pub(super) f: Vec<Vec3<R>>,
    /// Accelerations (m/s²); of explicit steps alone.
    pub(super) a: Vec<Vec3<R>>,
    /// Predicted velocities (m/s); of explicit steps alone.
    pub(super) w: Vec<Vec3<R>>,
    /// Right-hand side of an implicit step (N s).
    pub(super) b: Vec<Vec3<R>>,
    /// Inverses of the diagonal blocks of its matrix (1/kg).
    pub(super) inverse: Vec<Inverse3<R>>,
    /// Its matrix, where the solver asks for an assembled one.
    pub(super) assembled: Option<BlockCsr<R>>,
    pub(super) cg: CgWorkspace<R>,
    /// Partial sums, one per block.
    pub(super) partials: Vec<[f64; 8]>,
}

impl<R: Real> Workspace<R> {
    /// Empty: the first step sizes it for its method.
    pub fn new() -> Self {
        Self::default()
    }

    pub(super) fn size_for(&mut self, model: &Model<R>, integrator: Integrator) {
        let (count, zero) = (model.count, Vec3::zeros());
        self.partials.resize(block_count(count, model.block_size), [0.0; 8]);
        self.f.resize(count, zero);
        self.padded.iter_mut().for_each(|field| field.resize(count, Padded::default()));

        if integrator.is_implicit() {
            if self.b.len() != count {
                self.cg = CgWorkspace::new(count, model.block_size);
            }

            self.b.resize(count, zero);
            self.inverse.resize(count, Inverse3::default());
        } else {
            self.a.resize(count, zero);
            self.w.resize(count, zero);
        }
    }
}

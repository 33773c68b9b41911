//! Explicit Euler at rest, mode by mode: a step of h (s) multiplies a mode of rate mu (1/s, complex) by 1 + h mu.
//!
//! Rates are eigenvalues of the motion about rest, M x'' = -K x - C x'. Its matrices come from steps of the program from
//! displaced positions and velocities, so that springs, elements and the medium are all in it. The modes of K alone are taken
//! apart first: what nothing elastic resists drifts. Its velocities stay, its positions move no other. In frequency times
//! displacement and in velocity the rest of the matrix differs from a skew one by damping alone, so that rounding does not
//! tell a mode without damping from one that is damped.

use nalgebra::{DMatrix, SymmetricEigen};
use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    field::Field,
    math::Precision,
    report::NoStopwatch,
    world::{Simulation, WorldSetup},
};
use rayon::prelude::*;

use super::{eigenvalues::eigenvalues, expected::has_one_damping, row::StabilityRow};
use crate::{
    case::{Case, masses},
    method::{Method, Setting, Steps},
    run::{Cut, Phase, Verdict},
};

/// Coordinates of free particles, at most: there are six steps for each.
const MOST: usize = 450;
/// Rows of the matrix, at most: eigenvalues of so many take seconds, and of twice as many eight times as long.
const LARGEST: usize = 600;
/// Share of the largest rate up to which a mode drifts: in steps that the fastest mode bears it gains less than 2e-10 of itself
/// per step.
const DRIFT: f64 = 1e-5;
/// Damping ratio below which a mode has none: what rounding leaves of 0 is less.
const UNDAMPED: f64 = 1e-8;
/// Displacement over the length of the shortest spring: what is left out is of its fourth power.
const DISPLACED: f64 = 1.0 / 4096.0;
/// Share of the largest rate below which a damping is what rounding leaves of 0.
const REMAINDER: f64 = 1e-12;
/// Iterations for one eigenvalue of a symmetric matrix, at most.
const ITERATIONS: usize = 60;

const TOO_LARGE: &str = "its dampings differ, and the cloth is too large for eigenvalues";
const TOO_LONG: &str = "its dampings differ, and eigenvalues would take longer than its time";
const NO_STEP: &str = "its dampings differ, and a step about rest could not be taken";
const NOT_FOUND: &str = "its dampings differ, and its eigenvalues were not found";

/// How a motion about rest is judged.
pub(super) enum Gain {
    /// Step by step.
    Measured,
    /// By its modes.
    Known(Modes),
    /// Not at all, for this reason.
    Unknown(&'static str),
}

impl Gain {
    /// How steps of a method are judged. Those of explicit Euler gain in each step, however slowly, where damping does not make up
    /// for it; a measure of that is known where there is one damping over stiffness, or none.
    pub(super) fn of(rest: &Case, method: Method, phase: &Phase) -> Self {
        let is_explicit_euler = method.integrator == Integrator::ExplicitEuler;
        // Bodies with a thickness are refused to it.
        if !is_explicit_euler || rest.is_thick() || has_one_damping(rest) || !rest.is_damped() {
            return Self::Measured;
        }
        match Modes::of(rest, phase) {
            Ok(modes) => Self::Known(modes),
            Err(reason) => Self::Unknown(reason),
        }
    }

    /// What becomes of a run of so many steps, where no step has to be taken to know it.
    pub(super) fn row(&self, row: StabilityRow, steps: u64) -> Option<StabilityRow> {
        match self {
            Self::Measured => None,
            Self::Known(modes) => Some(modes.judge(row, steps)),
            Self::Unknown(reason) => {
                let cut = (*reason == TOO_LONG).then_some(Cut::Time);
                Some(StabilityRow {
                    verdict: Verdict::NotKnown,
                    cause: Some((*reason).to_owned()),
                    cut,
                    ..row
                })
            }
        }
    }
}

/// The modes of a motion about rest, but those that drift.
pub(super) struct Modes {
    /// Real and imaginary part of their rates (1/s).
    rates: Vec<[f64; 2]>,
}

impl Modes {
    /// Finds the modes of a case at rest, if there is the time for it.
    ///
    /// # Errors
    /// Why they are not known, in words.
    fn of(rest: &Case, phase: &Phase) -> Result<Self, &'static str> {
        let method = Method::new(Integrator::ExplicitEuler, Hessian::Absolute);
        let setting = Setting::new(method, Precision::F64, Steps::Divided(0));
        // A second: accelerations are changes of velocity.
        let mut setup = setting.plan(rest, 1.0).setup;
        setup.bodies.iter_mut().for_each(|body| body.network.v.fill([0.0; 3]));
        let free = coordinates(&setup);
        if free.len() > MOST {
            return Err(TOO_LARGE);
        }
        // Steps take about as long as the modes of the stiffness.
        if 2.0 * seconds(free.len()) > phase.left() {
            return Err(TOO_LONG);
        }
        let by = DISPLACED * shortest(&setup);
        let columns: Option<Vec<_>> = free.par_iter().map(|at| columns(&setup, at, by)).collect();
        let columns = columns.ok_or(NO_STEP)?;
        let [elastic, damping] = [0, 1].map(|which| symmetric(&free, &columns, which));
        let (matrix, scale) = matrix(elastic, &damping).ok_or(NOT_FOUND)?;
        if matrix.nrows() > LARGEST {
            return Err(TOO_LARGE);
        }
        if seconds(matrix.nrows()) > phase.left() {
            return Err(TOO_LONG);
        }

        let rates = eigenvalues(matrix).ok_or(NOT_FOUND)?;
        let size = |[re, im]: [f64; 2]| re.hypot(im);
        let largest = rates.iter().map(|rate| size(*rate)).fold(0.0, f64::max);
        let moving = rates.into_iter().filter(|rate| size(*rate) > DRIFT * largest);
        Ok(Self { rates: moving.map(|rate| rate.map(|part| part * scale)).collect() })
    }

    /// The longest step (s) in which no mode grows: 0 where one has no damping, infinite where all drift.
    fn limit(&self) -> f64 {
        let limits = self.rates.iter().map(|[re, im]| {
            let size = re.hypot(*im);
            let ratio = -re / size;
            if ratio < UNDAMPED { 0.0 } else { 2.0 * ratio / size }
        });
        limits.fold(f64::INFINITY, f64::min)
    }

    /// The share of its energy that the mode which grows most gains in a step (s): |1 + h mu|² - 1.
    fn gain(&self, dt: f64) -> f64 {
        let gains = self.rates.iter().map(|[re, im]| dt * (2.0 * re + dt * (re * re + im * im)));
        gains.fold(-1.0, f64::max)
    }

    fn judge(&self, row: StabilityRow, steps: u64) -> StabilityRow {
        let gain = self.gain(row.dt);
        let growth = (steps as f64 * gain.ln_1p()).exp().max(1.0);
        let growth = Some(growth).filter(|growth| growth.is_finite());
        if row.dt <= self.limit() {
            return StabilityRow { verdict: Verdict::Stable, growth, ..row };
        }
        let cause = format!("each step adds {gain:.1e} of itself to the energy of a mode");
        StabilityRow { verdict: Verdict::Grows, cause: Some(cause), growth, step: Some(0), ..row }
    }
}

/// Seconds that eigenvalues of so many rows take, about.
fn seconds(rows: usize) -> f64 {
    1e-8 * (rows as f64).powi(3)
}

/// The matrix of the motion, over a rate (1/s) that is given beside it, from those of stiffness (1/s²) and damping (1/s) over
/// mass: of modes that swing by themselves frequency times displacement, then the velocities of these and of what is only
/// damped. None where the iteration for them does not come to an end.
fn matrix(elastic: DMatrix<f64>, damping: &DMatrix<f64>) -> Option<(DMatrix<f64>, f64)> {
    let count = elastic.nrows();
    if count == 0 {
        return Some((DMatrix::zeros(0, 0), 0.0));
    }
    let modes = SymmetricEigen::try_new(elastic, f64::EPSILON, ITERATIONS * count)?;
    let damping = modes.eigenvectors.transpose() * damping * &modes.eigenvectors;
    let frequencies: Vec<f64> = modes.eigenvalues.iter().map(|square| square.max(0.0).sqrt()).collect();
    let scale = frequencies.iter().copied().fold(damping.amax(), f64::max);
    let (swing, drift): (Vec<usize>, Vec<usize>) =
        (0..count).partition(|mode| frequencies[*mode] > DRIFT * scale);
    let first = swing.len();
    let is_damped = |mode: &usize| damping.row(*mode).amax() > REMAINDER * scale;
    let moving: Vec<usize> = swing.into_iter().chain(drift.into_iter().filter(is_damped)).collect();

    let mut matrix = DMatrix::<f64>::zeros(first + moving.len(), first + moving.len());
    for place in 0..first {
        let frequency = frequencies[moving[place]] / scale;
        matrix[(place, first + place)] = frequency;
        matrix[(first + place, place)] = -frequency;
    }
    for (row, of) in moving.iter().enumerate() {
        for (column, by) in moving.iter().enumerate() {
            matrix[(first + row, first + column)] = -damping[(*of, *by)] / scale;
        }
    }
    Some((matrix, scale))
}

/// A coordinate of a free particle.
struct Coordinate {
    body: usize,
    particle: usize,
    axis: usize,
    /// Its place among the coordinates of all particles.
    place: usize,
    /// Of its particle (kg).
    mass: f64,
}

fn coordinates(setup: &WorldSetup) -> Vec<Coordinate> {
    let (mut all, mut first) = (Vec::new(), 0);
    for (body, network) in setup.bodies.iter().map(|body| &body.network).enumerate() {
        for (particle, mass) in masses(network).into_iter().enumerate().filter(|(_, mass)| *mass > 0.0) {
            let place = 3 * (first + particle);
            all.extend([0, 1, 2].map(|axis| Coordinate { body, particle, axis, place: place + axis, mass }));
        }
        first += network.x.len();
    }
    all
}

/// The length (m) of the shortest spring that has one; a metre without springs, as the laws of elements are linear.
fn shortest(setup: &WorldSetup) -> f64 {
    let springs = setup.bodies.iter().flat_map(|body| &body.network.springs);
    let lengths = springs.map(|spring| spring.rest_length).filter(|length| *length > 0.0);
    lengths.reduce(f64::min).unwrap_or(1.0)
}

/// What is displaced.
type Vectors = fn(&mut Network) -> &mut Vec<[f64; 3]>;

fn positions(network: &mut Network) -> &mut Vec<[f64; 3]> {
    &mut network.x
}

fn velocities(network: &mut Network) -> &mut Vec<[f64; 3]> {
    &mut network.v
}

/// How accelerations depend on a position (1/s²), displaced by some length (m), and on a velocity (1/s).
fn columns(setup: &WorldSetup, at: &Coordinate, by: f64) -> Option<[Vec<f64>; 2]> {
    let [near, far] = [slope(setup, at, positions, by)?, slope(setup, at, positions, 2.0 * by)?];
    // The force of a spring across itself is of third order: this leaves it out.
    let elastic = near.iter().zip(&far).map(|(near, far)| (4.0 * near - far) / 3.0).collect();
    Some([elastic, slope(setup, at, velocities, 1.0)?])
}

fn slope(setup: &WorldSetup, at: &Coordinate, vectors: Vectors, by: f64) -> Option<Vec<f64>> {
    let displaced = |by: f64| {
        let mut setup = setup.clone();
        let value = &mut vectors(&mut setup.bodies[at.body].network)[at.particle][at.axis];
        *value += by;
        let value = *value;
        Some((value, accelerations(&setup)?))
    };
    let ((low, before), (high, after)) = (displaced(-by)?, displaced(by)?);
    Some(after.iter().zip(&before).map(|(after, before)| (after - before) / (high - low)).collect())
}

/// Accelerations (m/s²) of all particles as a setup starts, by a step; none where it cannot be taken.
fn accelerations(setup: &WorldSetup) -> Option<Vec<f64>> {
    let (mut simulation, _) = Simulation::new(setup, Precision::F64).ok()?;
    let mut before = vec![0.0_f64; Field::Velocities.width() * simulation.particle_count()];
    let mut after = before.clone();
    simulation.read(Field::Velocities, &mut before);
    simulation.step(&mut NoStopwatch).ok()?;
    simulation.read(Field::Velocities, &mut after);
    Some(after.iter().zip(&before).map(|(after, before)| (after - before) / setup.dt).collect())
}

/// What multiplies positions, or velocities, in roots of mass: symmetric, but for rounding that is taken off.
fn symmetric(free: &[Coordinate], columns: &[[Vec<f64>; 2]], which: usize) -> DMatrix<f64> {
    let matrix = DMatrix::from_fn(free.len(), free.len(), |row, column| {
        let (of, by) = (&free[row], &free[column]);
        -columns[column][which][of.place] * (of.mass / by.mass).sqrt()
    });
    (&matrix + matrix.transpose()) * 0.5
}

#[cfg(test)]
mod tests {
    use std::time::Duration;

    use nappe_sim::{
        cloth::{ClothSettings, Spring, SpringKind, SpringLaw},
        world::BodySetup,
    };

    use super::*;
    use crate::{run::Budget, stability::theory::critical_step};

    const MASS: f64 = 0.01;

    /// Particles that hang on springs of a tenth of a metre, one each, in different directions.
    fn case(laws: &[SpringLaw], drag: f64) -> Case {
        let mut network = Network { drag, ..Network::default() };
        for (i, law) in (0u32..).zip(laws) {
            let start = [f64::from(i), 0.3, -0.2];
            network.x.extend([start, [start[0] + 0.06, start[1] + 0.08, start[2]]]);
            network.masses.extend([0.0, MASS]);
            let (particles, kind) = ([2 * i, 2 * i + 1], SpringKind::Stretch);
            network.springs.push(Spring { particles, kind, rest_length: 0.1, law: *law });
        }
        network.v = vec![[0.0; 3]; network.x.len()];
        let body = BodySetup {
            name: "springs".to_owned(),
            network,
            settings: ClothSettings::default(),
            forces: Vec::new(),
        };
        let setup = WorldSetup {
            dt: 1e-3,
            gravity: [0.0; 3],
            wind_at: Vec::new(),
            wind: [0.0; 3],
            colliders: Vec::new(),
            bodies: vec![body],
            snow: None,
        };
        Case::new("springs", setup, Vec::new(), Precision::F64).expect("a cloth").at_rest()
    }

    fn limit(case: &Case) -> f64 {
        Modes::of(case, &Budget::new(None).until(1.0)).expect("modes are found").limit()
    }

    #[test]
    fn springs_of_different_damping_bear_the_step_of_the_one_that_bears_least() {
        for (drag, dampings) in [(0.0, [0.02, 0.1, 5.0]), (0.03, [0.0, 0.1, 0.4]), (0.3, [0.0, 0.0, 0.02])] {
            let laws = [80.0, 30.0, 2000.0].into_iter().zip(dampings);
            let laws: Vec<_> = laws.map(|(stiffness, damping)| SpringLaw { stiffness, damping }).collect();
            let theory = laws.iter().map(|law| {
                let frequency = (law.stiffness / MASS).sqrt();
                let ratio = 0.5 * (law.damping + drag) / MASS / frequency;
                critical_step(Integrator::ExplicitEuler, frequency, ratio).expect("a limit")
            });
            // What moves across its spring is dragged alone.
            let dragged = if drag > 0.0 { 2.0 * MASS / drag } else { f64::INFINITY };
            let (theory, found) = (theory.fold(dragged, f64::min), limit(&case(&laws, drag)));
            assert!(
                (found / theory - 1.0).abs() < 1e-8,
                "{dampings:?}, {drag} N s/m: {found} s, not {theory} s"
            );
        }
    }

    #[test]
    fn one_mode_without_damping_grows_in_every_step_beside_others_that_are_damped() {
        let laws = [0.02, 0.0].map(|damping| SpringLaw { stiffness: 80.0, damping });
        let case = case(&laws, 0.0);
        assert_eq!(limit(&case), 0.0);
        let method = Method::new(Integrator::ExplicitEuler, Hessian::Absolute);
        let gain = |budget: Budget| Gain::of(&case, method, &budget.until(1.0));
        assert!(matches!(gain(Budget::new(None)), Gain::Known(_)));
        assert!(matches!(gain(Budget::new(Some(Duration::ZERO))), Gain::Unknown(TOO_LONG)));
    }

    #[test]
    fn what_nothing_resists_bears_every_step() {
        let law = SpringLaw { stiffness: 0.0, damping: 0.0 };
        assert_eq!(limit(&case(&[law; 2], 0.0)), f64::INFINITY);
    }
}

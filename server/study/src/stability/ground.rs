//! What runs under load are judged against: a fine run of the scene, and a reference until its predictability horizon.

use std::time::Instant;

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
};

use crate::{
    case::{Case, Times},
    method::{Method, Setting, Steps},
    reference::{Effort, NoReference, OPEN, OVERHEAD, Scan, THICK, counted, reference, scan},
    run::{End, Phase, Runner},
};

/// The method of the fine run, certified at a share of the bound; that of bodies with a thickness is as in their reference.
const FINE: Setting = Setting::new(
    Method::new(Integrator::VelocityVerletPredicted, Hessian::Absolute),
    Precision::F64,
    Steps::Certified(0.45),
);
/// Times within the window at which the fine run is looked at, at least.
const TIMES: f64 = 200.0;
/// Shortest spacing of times, as a power of two that divides the time step of the scene.
const FINEST: u32 = 8;
/// Steps that a run is judged by, at least.
pub(super) const STEPS: f64 = 200.0;
/// The fine run ends with the scene, after so many windows and so many steps of the scene, or where it has taken the work of its effort.
const WINDOWS: f64 = 2.0;
const SCENE_STEPS: f64 = 2.0 * STEPS;

/// A fine run of a scene, and a reference until its predictability horizon. No clock has a part in it.
#[derive(Clone, Debug)]
pub(super) struct Ground {
    /// The class of effort of the reference and of the fine run.
    pub(super) effort: Effort,
    /// For how long (s) the answer is known to a quarter of the tolerance; 0 where it is not.
    pub(super) window: f64,
    /// The mean rate (1/s) at which what starts 1e-8 m apart grows apart until then.
    pub(super) growth_rate: Option<f64>,
    /// The largest kinetic and elastic energy (J).
    scale: f64,
    /// Between times (s).
    spacing: f64,
    /// Mechanical energy (J) at each of them, from the start on.
    energies: Vec<f64>,
    /// The largest of them from the end of the window to each time; what it is before that is not used.
    highest: Vec<f64>,
    /// Between times of the reference (s).
    interval: f64,
    /// Positions (m) of the reference at each of these times, from the start to the end of the window.
    states: Vec<Vec<f64>>,
}

impl Ground {
    /// Runs a case until a time (s), with the work of an effort; the window is that of an error (m).
    ///
    /// # Errors
    /// Why there is none: a step failed, or time was over before all of it was known.
    pub(super) fn new(
        case: &Case,
        end: f64,
        tolerance: f64,
        effort: Effort,
        phase: &Phase,
    ) -> Result<Self, NoReference> {
        let allowed = OPEN * tolerance;
        let begin = Instant::now();
        let scan = scan(case, end, allowed, Some(effort), phase);
        let seconds = begin.elapsed().as_secs_f64();
        match &scan.end {
            End::Failed(failure) => return Err(NoReference::Failed(failure.cause.clone())),
            // The scan has three copies of the scene; the reference, and the fine run, take more than as long.
            End::Cut(_) => return Err(NoReference::Time(2.0 * scan.needed(seconds, end))),
            End::Reached | End::Costly => {}
        }
        let times = Times::even(scan.spacing, scan.count_within(allowed));
        let known = reference(case, &times, scan.step, allowed, effort, phase)
            .map_err(|missing| missing.after(2.0 * seconds))?;
        let good = known.own_error.iter().take_while(|error| **error <= allowed).count();
        let window = scan.spacing * good as f64;
        let end = end.min((WINDOWS * window).max(SCENE_STEPS * case.dt()));
        let mut ground = Self::fine(case, [window, end], effort, phase)
            .map_err(|missing| missing.after(begin.elapsed().as_secs_f64()))?;
        ground.keep(&scan, known.states.into_iter().take(good));
        Ok(ground)
    }

    /// A fine run until an end (s), looked at often enough within a window (s), and once at least.
    fn fine(
        case: &Case,
        [window, end]: [f64; 2],
        effort: Effort,
        phase: &Phase,
    ) -> Result<Self, NoReference> {
        let mut spacing = case.dt();
        for _ in 0..FINEST {
            if spacing * TIMES > window && !case.has_moving_pins() && !case.is_thick() {
                spacing *= 0.5;
            }
        }
        let setting = if case.is_thick() { THICK } else { FINE };
        let runner = Runner::start(case, &setting, &Times::even(spacing, 1), phase);
        let mut runner = runner.map_err(|failure| NoReference::Failed(failure.cause))?;
        let moved = |runner: &Runner| runner.now.kinetic_energy + runner.now.elastic_energy;
        let most = effort.of_cloth() / (case.particle_count() as u64 + OVERHEAD);
        let mut ground = Self {
            effort,
            window: 0.0,
            growth_rate: None,
            scale: moved(&runner),
            spacing,
            energies: vec![runner.now.total_energy()],
            highest: Vec::new(),
            interval: spacing,
            states: vec![runner.positions()],
        };
        let begin = Instant::now();
        for _ in 0..(end / spacing - 1e-6).ceil() as u64 {
            match runner.advance() {
                Ok(_) => {}
                Err(End::Failed(failure)) => return Err(NoReference::Failed(failure.cause)),
                Err(End::Cut(_) | End::Costly | End::Reached) => {
                    let share = (runner.time() / end).max(f64::MIN_POSITIVE);
                    return Err(NoReference::Time((1.0 / share - 1.0) * begin.elapsed().as_secs_f64()));
                }
            }
            ground.scale = ground.scale.max(moved(&runner));
            ground.energies.push(runner.now.total_energy());
            if counted(runner.work()) > most {
                break;
            }
        }
        Ok(ground)
    }

    /// Takes over states of the reference at the times of a scan.
    fn keep(&mut self, scan: &Scan, states: impl Iterator<Item = Vec<f64>>) {
        self.interval = scan.spacing;
        self.states.extend(states);
        self.window = (scan.spacing * (self.states.len() - 1) as f64).min(self.end());
        self.growth_rate = scan.growth_rate(self.window);
        let first = place(self.window / self.spacing, self.energies.len())[0] as usize;
        let mut largest = f64::NEG_INFINITY;
        self.highest.extend(self.energies.iter().enumerate().map(|(i, energy)| {
            if i >= first {
                largest = largest.max(*energy);
            }
            largest
        }));
    }

    /// The time (s) that the fine run reached: nothing is judged beyond.
    pub(super) fn end(&self) -> f64 {
        self.spacing * (self.energies.len() - 1) as f64
    }

    /// Steps (s) of a run that is judged: two hundred, and to the end of the window, but not beyond the fine run.
    pub(super) fn steps(&self, dt: f64) -> u64 {
        let wanted = (self.window / dt - 1e-9).ceil().max(STEPS);
        wanted.min((self.end() / dt + 1e-9).floor()).max(1.0) as u64
    }

    /// By how much a mechanical energy (J) at a time (s) is above that of the fine run, as a share of its largest kinetic and
    /// elastic energy. After the window another motion is as right, which may lose its energy later: there it is the largest
    /// since the window ended.
    pub(super) fn rise(&self, time: f64, energy: f64) -> f64 {
        let [at, share] = place(time / self.spacing, self.energies.len());
        let next = (at as usize + 1).min(self.energies.len() - 1);
        let mut known = self.energies[at as usize] * (1.0 - share) + self.energies[next] * share;
        let first = place(self.window / self.spacing, self.energies.len())[0] as usize;
        if first < at as usize {
            known = known.max(self.highest[at as usize]);
        }
        // A scene in which nothing moves has no energy to compare with.
        (energy - known) / self.scale.max(f64::MIN_POSITIVE)
    }

    /// How far (rms, m) positions at a time (s) are from the reference; none after the window.
    pub(super) fn error(&self, case: &Case, time: f64, positions: &[f64]) -> Option<f64> {
        if time > self.window * (1.0 + 1e-9) {
            return None;
        }
        let [at, share] = place(time / self.interval, self.states.len());
        let at = at as usize;
        let next = &self.states[(at + 1).min(self.states.len() - 1)];
        let between = self.states[at].iter().zip(next).map(|(a, b)| a + (b - a) * share);
        Some(case.rms(positions, &between.collect::<Vec<_>>()))
    }
}

/// The last of so many whole numbers that is not above a number, and what is left over.
fn place(number: f64, count: usize) -> [f64; 2] {
    let place = number.clamp(0.0, (count - 1) as f64);
    [place.floor(), place.fract()]
}

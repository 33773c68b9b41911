//! What runs under load are judged against: a fine run of the scene, and a reference until its predictability horizon.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    math::Precision,
};

use crate::{
    budget::Phase,
    case::Case,
    method::Method,
    reference::reference,
    run::{End, Runner},
    setting::{Setting, Steps},
    times::Times,
    window::{OPEN, ScanEnd, scan},
};

/// The method of the fine run, certified at a share of the bound.
const FINE: Setting = Setting::new(
    Method::new(Integrator::VelocityVerletPredicted, Hessian::Absolute),
    Precision::F64,
    Steps::Certified(0.45),
);
/// Times within the window at which the fine run is looked at, at least.
const TIMES: f64 = 200.0;
/// Shortest spacing of times, as a power of two that divides the time step of the scene.
const FINEST: u32 = 8;
/// Shares of the time that is left which the window, then the reference may take.
const SCAN: f64 = 0.4;
const REFERENCE: f64 = 0.5;

/// A fine run of a scene, and a reference until its predictability horizon.
#[derive(Clone, Debug)]
pub(super) struct Ground {
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
    /// Runs a case until a time (s), or as far as the time for it reaches; the window is that of an error (m).
    ///
    /// # Errors
    /// Why there is none, in a sentence.
    pub(super) fn new(case: &Case, end: f64, tolerance: f64, phase: &Phase) -> Result<Self, String> {
        let scan = scan(case, end, OPEN * tolerance, &phase.share(SCAN));
        if let ScanEnd::Failed(cause) = scan.end {
            return Err(cause);
        }
        let count = scan.count_within(OPEN * tolerance);
        let times = Times::even(scan.spacing, count);
        let known = reference(case, &times, scan.step, OPEN * tolerance, &phase.share(REFERENCE));
        let mut spacing = case.dt();
        for _ in 0..FINEST {
            if spacing * TIMES > times.end() && !case.has_moving_pins() {
                spacing *= 0.5;
            }
        }
        let mut runner = Runner::start(case, &FINE, &Times::even(spacing, 1), phase).map_err(|f| f.cause)?;
        let moved = |runner: &Runner| runner.now.kinetic_energy + runner.now.elastic_energy;
        let mut ground = Self {
            window: 0.0,
            growth_rate: None,
            scale: moved(&runner),
            spacing,
            energies: vec![runner.now.total_energy()],
            highest: Vec::new(),
            interval: scan.spacing,
            states: vec![runner.positions()],
        };
        for _ in 0..(end / spacing - 1e-6).ceil() as u64 {
            match runner.advance() {
                Ok(_) => {}
                Err(End::Failed(failure)) => return Err(failure.cause),
                Err(End::Stopped | End::Reached) => break,
            }
            ground.scale = ground.scale.max(moved(&runner));
            ground.energies.push(runner.now.total_energy());
        }
        if let Ok(known) = known {
            let good = known.own_error.iter().take_while(|error| **error <= OPEN * tolerance).count();
            ground.states.extend(known.states.into_iter().take(good));
            ground.window = (scan.spacing * good as f64).min(ground.end());
            ground.growth_rate = scan.growth_rate(ground.window);
        }
        let first = place(ground.window / spacing, ground.energies.len())[0] as usize;
        let mut largest = f64::NEG_INFINITY;
        ground.highest.extend(ground.energies.iter().enumerate().map(|(i, energy)| {
            if i >= first {
                largest = largest.max(*energy);
            }
            largest
        }));
        Ok(ground)
    }

    /// The time (s) that the fine run reached.
    fn end(&self) -> f64 {
        self.spacing * (self.energies.len() - 1) as f64
    }

    /// Steps (s) of a run that is judged: two hundred, and to the end of the window, but not beyond the fine run.
    pub(super) fn steps(&self, dt: f64) -> u64 {
        let wanted = (self.window / dt - 1e-9).ceil().max(200.0);
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

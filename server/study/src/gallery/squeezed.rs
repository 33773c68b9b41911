//! A squeezed sheet under implicit steps: compressed by a fifth between two held edges, a little noise, no damping.

use nappe_sim::{
    cloth::{Integrator, Minimizer, Network, SpringLaw, SpringRules},
    math::Precision,
    report::NoStopwatch,
};

use super::{
    finding::Finding,
    networks::{scatter, sheet},
    row::Row,
    scene::{Scene, positions},
};
use crate::method::Method;

const SIDE: usize = 11;
const SPACING: f64 = 0.1;
const MASS: f64 = 0.01;
/// Its time step (s).
pub const DT: f64 = 0.01;
/// The steps that it takes.
pub const STEPS: u64 = 60;
/// Times the elastic energy that Newton's method leaves by implicit Euler, beyond which a run is wrong.
const WRONG: f64 = 10.0;
/// Share of the energy of the start that the midpoint, which damps nothing, must keep.
const KEPT: f64 = 0.9;

/// The sheet whose dt times sqrt(k / m) is `stiffness_number`.
pub fn squashed(stiffness_number: f64) -> Network {
    let stiffness = MASS * (stiffness_number / DT).powi(2);
    let law = |share: f64| SpringLaw { stiffness: stiffness * share, damping: 0.0 };
    let rules = SpringRules { stretch: law(1.0), shear: Some(law(0.5)), bend: Some(law(0.1)) };
    let mut network = sheet(SIDE, SPACING, &rules, MASS);
    let held = |i: usize| [0, SIDE - 1].contains(&(i % SIDE));
    network.pins = (0..SIDE * SIDE).filter(|&i| held(i)).map(|i| i as u32).collect();
    for (i, x) in network.x.iter_mut().enumerate() {
        x[0] *= 0.8;
        if !held(i) {
            *x = [0, 1, 2].map(|c| x[c] + 1e-3 * SPACING * scatter(3 * i + c));
        }
    }
    network
}

/// Sheets by dt sqrt(k/m), with the elastic energy (J) that Newton's method leaves by implicit Euler, and what it may leave by
/// any: flat they would keep 272 J at 10 and 6 869 J at 50.
pub(super) const SCENES: [Row<Method>; 5] = [
    Row {
        number: 31,
        what: "a squeezed sheet, dt sqrt(k/m) = 0.5",
        run: |method| finding(method, 0.5, [0.108, 0.6]),
    },
    Row {
        number: 31,
        what: "a squeezed sheet, dt sqrt(k/m) = 2",
        run: |method| finding(method, 2.0, [0.087, 0.3]),
    },
    Row {
        number: 31,
        what: "a squeezed sheet, dt sqrt(k/m) = 10",
        run: |method| finding(method, 10.0, [0.072, 0.6]),
    },
    Row {
        number: 31,
        what: "a squeezed sheet, dt sqrt(k/m) = 50",
        run: |method| finding(method, 50.0, [1.489, 2.3]),
    },
    Row {
        number: 31,
        what: "a squeezed sheet, dt sqrt(k/m) = 200",
        run: |method| finding(method, 200.0, [23.825, 25.0]),
    },
];

/// The sheet after all steps, with what the program does by itself: its height (m), the elastic energy (J) that is left, steps
/// that were taken again; or why it could not go on.
fn finding(method: Method, stiffness_number: f64, [settled, buckled]: [f64; 2]) -> Finding {
    let mut simulation =
        Scene::new(squashed(stiffness_number), DT).by(method).certified().simulate(Precision::F64);
    let start = simulation.diagnose().total_energy();
    let (mut gain, mut rejected) = (0.0, 0);
    for _ in 0..STEPS {
        let report = match simulation.step(&mut NoStopwatch) {
            Ok(report) => report,
            Err(error) => return Finding::stopped(&error),
        };
        gain = f64::max(gain, report.diagnostics.total_energy() / start - 1.0);
        rejected += report.cloth.map_or(0, |cloth| cloth.rejected);
    }
    let height = positions(&simulation).iter().map(|x| x[1].abs()).fold(0.0, f64::max);
    let now = simulation.diagnose();
    let left = now.elastic_energy;
    let what = format!("{height:.2} m, {left:.3} J");
    let is_midpoint = method.integrator == Integrator::ImplicitMidpoint;
    // The midpoint's energy is not that of its minimum.
    let most = if is_midpoint { 0.01 } else { 1e-6 };
    let must_buckle = matches!(method.minimizer, Minimizer::Newton(_)) && !is_midpoint;
    // Nothing damps the sheet: the midpoint must keep its energy. The others come to rest in steps as long as these.
    let is_right = if is_midpoint { now.total_energy() >= KEPT * start } else { left <= WRONG * settled };
    Finding::taken(rejected)
        .with(&what)
        .only_if(|| gain < most, || format!("gains {gain:.1e} of its energy"))
        .only_if(|| !must_buckle || height > SPACING && left < buckled, || format!("{height} m, {left} J"))
        .right_if(|| is_right)
}

//! The way in which a scene that names none has its implicit steps solved: one linear solve where it is enough, more of Newton's method
//! where it is not, and shorter steps where that is not enough either.

use nappe_sim::{
    cloth::{Air, ElementKind, ElementList, Hessian, Integrator, Minimizer, Network, SpringLaw, SpringRules},
    linalg::SolverSettings,
    math::Precision,
    mesh::TriangleMesh,
    report::StepReport,
};
use nappe_tests::{
    Method, NEWTON, Scene,
    networks::{chain, particles, sheet, sheet_rules, spring},
    scene::{advance, difference, max_distance, norm, of_text, positions},
};

const GRAVITY: f64 = 9.81;
const IMPLICIT: [Integrator; 3] = [Integrator::ImplicitEuler, Integrator::ImplicitMidpoint, Integrator::Bdf2];

fn by(integrator: Integrator, minimizer: Minimizer) -> Method {
    Method { minimizer, ..Method::new(integrator, Hessian::Absolute) }
}

/// What the steps of a run told.
#[derive(Default)]
struct Told {
    /// The largest length over rest length at the end of a step.
    stretch: f64,
    substeps: u32,
    solves: u32,
    /// Why sub-steps were not accepted.
    reasons: Vec<&'static str>,
}

impl Told {
    fn add(&mut self, report: &StepReport) {
        let steps = report.cloth.expect("a step of cloth");
        self.stretch = self.stretch.max(report.diagnostics.max_stretch);
        self.substeps += steps.substeps;
        self.solves += steps.solves;
        self.reasons.extend(report.rejections.iter().map(|rejection| rejection.cause.reason()));
    }
}

/// Two seconds of a scene of one body whose text is given, in steps of `dt` (s).
fn two_seconds(dt: f64, body: &str) -> Told {
    let text = format!("version = 1\ndt = {dt}\nprecision = \"f64\"\n[[body]]\nname = \"it\"\n{body}");
    let mut simulation = of_text(&text, Precision::F64);
    let mut told = Told::default();
    for _ in 0..(2.0 / dt).round() as u64 {
        told.add(&advance(&mut simulation, 1));
    }
    told
}

/// A stiff chain of 41 particles that is let go level, held by its first one.
const CHAIN: &str = "mesh = { chain = 41, spacing = 0.05 }\nmass = { particle = 0.01 }\npins = [\"first\"]
    springs = { stretch = { stiffness = 4e4 } }\n";

#[test]
fn a_stiff_chain_that_swings_stays_as_long_as_it_hangs() {
    let hangs = 1.0 + 40.0 * 0.01 * GRAVITY / (4e4 * 0.05);
    for dt in [0.005, 0.02, 0.04, 0.08, 0.16] {
        let told = two_seconds(dt, CHAIN);
        assert!(told.stretch < 1.02 * hangs, "{dt} s: {}, hanging {hangs}", told.stretch);
        let goes_on = told.solves > told.substeps;
        assert_eq!(goes_on, dt > 0.01, "{dt} s: {} solves, {} sub-steps", told.solves, told.substeps);
        if dt == 0.16 {
            assert!(told.reasons.contains(&"STEP_ACCURACY"), "{:?}", told.reasons);
        }
    }
    for (dt, integrator) in [(0.02, "implicit_euler"), (0.08, "bdf2")] {
        let by = format!("integrator = \"{integrator}\"\n");
        let one = two_seconds(dt, &format!("{by}minimizer = \"one_step\"\n{CHAIN}"));
        assert!(one.stretch > 1.04, "{integrator}, one solve: {}", one.stretch);
        assert!(one.solves >= one.substeps && one.reasons.iter().all(|reason| *reason == "ENERGY_GAIN"));
        let more = two_seconds(dt, &format!("{by}{CHAIN}"));
        assert!(more.stretch < 1.02 * hangs && more.solves > more.substeps, "{integrator}: {}", more.stretch);
    }
}

#[test]
fn a_sheet_that_swings_stretches_as_by_newtons_method() {
    for stiffness in [20.0, 50.0] {
        let body = format!(
            "mesh = {{ grid = [15, 15], spacing = 0.05 }}\nmass = {{ density = 0.2 }}\npins = [\"top_left\", \"top_right\"]
            springs = {{ stretch = {{ stiffness = {stiffness}, damping = 0.02 }}, shear = {{ stiffness = {}, damping = 0.01 }}, bend = {{ stiffness = {}, damping = 0.002 }} }}\n",
            stiffness / 4.0,
            stiffness / 100.0,
        );
        let [auto, newton, one] = ["auto", "newton", "one_step"]
            .map(|way| two_seconds(0.08, &format!("minimizer = \"{way}\"\n{body}")).stretch);
        assert!((auto / newton - 1.0).abs() < 0.02, "{stiffness} N/m: {auto}, by newton {newton}");
        assert!(one > 1.01 * newton, "{stiffness} N/m: {one} by one solve, by newton {newton}");
    }
}

/// A sheet of 9 x 9 particles of 1 kg on a square metre, held along x = 0 and thrown so that it would be 2.6 m wide within
/// `dt` (s): <https://github.com/alecjacobson/mesh-elasticity-solver-benchmark>, results/massspring_solvers.md.
fn thrown_wide(stiffness: f64, dt: f64) -> Network {
    let x: Vec<_> = (0..81_u32).map(|i| [f64::from(i % 9) / 8.0, f64::from(i / 9) / 8.0, 0.0]).collect();
    let mut network = particles(&x, 1.0);
    for here in 0..81_u32 {
        for [right, up] in [[1, 0], [0, 1], [1, 1]] {
            if here % 9 + right < 9 && here / 9 + up < 9 {
                let there = here + right + 9 * up;
                let rest_length = norm(difference(x[there as usize], x[here as usize]));
                network.springs.push(spring([here, there], rest_length, stiffness, 0.0));
            }
        }
    }
    network.pins = (0..9).map(|row| 9 * row).collect();
    for (v, x) in network.v.iter_mut().zip(&x).filter(|(_, x)| x[0] > 0.0) {
        *v = [1.6 * x[0] / dt, -0.1 / dt, 0.0];
    }
    network
}

/// One step of the sheet, taken whole, by the solver that scenes have; and how many solves it made.
fn thrown_in_one_step(stiffness: f64, dt: f64, minimizer: Minimizer) -> (Vec<[f64; 3]>, u32) {
    let method = by(Integrator::ImplicitEuler, minimizer);
    let mut scene = Scene::new(thrown_wide(stiffness, dt), dt).by(method).certified();
    scene.settings.solver = SolverSettings::default();
    let mut simulation = scene.simulate(Precision::F64);
    let steps = advance(&mut simulation, 1).cloth.expect("a step of cloth");
    assert_eq!((steps.substeps, steps.rejected), (1, 0), "{stiffness} N/m, {dt} s");
    (positions(&simulation), steps.solves)
}

/// Where the step is that stays in the plane: some of them could buckle out of it.
fn balance(stiffness: f64, dt: f64) -> Vec<[f64; 3]> {
    let method = Method::by_sweeps(Integrator::ImplicitEuler, 4000);
    let mut simulation = Scene::new(thrown_wide(stiffness, dt), dt).by(method).simulate(Precision::F64);
    advance(&mut simulation, 1);
    positions(&simulation)
}

#[test]
fn a_step_that_throws_a_sheet_wide_is_as_exact_as_published_ones() {
    // The published minima: corners (1, 0) and (1, 1).
    for (stiffness, dt, corners) in [
        (1e3, 1.0 / 30.0, [[2.488_846_726_1, -0.099_649_237_4], [2.385_751_627_3, 0.865_807_169_6]]),
        (1e5, 1.0 / 8.0, [[1.024_461_157_8, -0.031_620_559_6], [1.027_208_264_5, 0.968_863_964_5]]),
    ] {
        let x = balance(stiffness, dt);
        for ([cx, cy], corner) in corners.into_iter().zip([8, 80]) {
            assert!(max_distance(&[x[corner]], &[[cx, cy, 0.0]]) < 1e-9, "{:?}", x[corner]);
        }
    }
    // What extended position-based dynamics is off by after 20 sweeps, as published, of the 1.6 m by which the sheet gets wider.
    let published = [0.002, 0.012, 0.091, 0.034, 0.42, 0.65];
    let cases = [1.0 / 60.0, 1.0 / 8.0].into_iter().flat_map(|dt| [1e3, 1e4, 1e5].map(|k| (k, dt)));
    let mut worst = 0.0;
    for ((stiffness, dt), published) in cases.zip(published) {
        let expected = balance(stiffness, dt);
        let off = |minimizer| {
            let (x, solves) = thrown_in_one_step(stiffness, dt, minimizer);
            (max_distance(&x, &expected) / 1.6, solves)
        };
        let (error, solves) = off(Minimizer::default());
        assert!(error <= f64::min(published, 0.005), "{stiffness} N/m, {dt} s: {error}, {solves} solves");
        assert!(solves <= 2, "{stiffness} N/m, {dt} s: {solves} solves");
        worst = f64::max(worst, off(Minimizer::OneStep).0);
    }
    assert!(worst > 0.03, "by one solve {worst} at most");
}

#[test]
fn what_more_solves_lead_to_is_what_newtons_method_finds() {
    // Elements that are damped, in wind: each has its own part in a step from the state, and in that of an iterate.
    let dt = 1.0 / 60.0;
    let mesh = TriangleMesh::grid(9, 9, 0.125);
    let rules = SpringRules { stretch: SpringLaw { stiffness: 1e4, damping: 3.0 }, shear: None, bend: None };
    let mut network = Network::from_mesh(&mesh, &rules, 1.0);
    let law = SpringLaw { stiffness: 30.0, damping: 2.0 };
    network.elements = vec![ElementList::new(ElementKind::QuadraticBending, law, &mesh)];
    network.air = Some(Air::default());
    network.drag = 0.5;
    network.pins = (0..9).map(|row| 9 * row).collect();
    for (v, x) in network.v.iter_mut().zip(&network.x).filter(|(_, x)| x[0] > 0.0) {
        *v = [1.6 * x[0] / dt, 0.0, -0.1 / dt];
    }
    let run = |minimizer| {
        let mut scene =
            Scene::new(network.clone(), dt).by(by(Integrator::ImplicitEuler, minimizer)).certified();
        scene.wind = [0.0, 20.0, 0.0];
        let mut simulation = scene.simulate(Precision::F64);
        let steps = advance(&mut simulation, 1).cloth.expect("a step of cloth");
        assert_eq!((steps.substeps, steps.rejected), (1, 0), "{minimizer:?}");
        (positions(&simulation), steps.solves)
    };
    let (expected, _) = run(NEWTON);
    let (found, solves) = run(Minimizer::Auto { accuracy: 1e-8 });
    let error = max_distance(&found, &expected);
    assert!(solves > 1 && error < 2e-4, "{error} m after {solves} solves");
    let one = max_distance(&run(Minimizer::OneStep).0, &expected);
    assert!(one > 5.0 * error.max(1e-4), "{one} m after one solve, not {error}");
}

#[test]
fn steps_that_one_solve_is_enough_for_have_its_bits() {
    let mut network = sheet(12, 0.05, &sheet_rules(200.0, 0.02), 0.005);
    network.air = Some(Air::default());
    for integrator in IMPLICIT {
        let run = |minimizer| {
            let mut scene = Scene::new(network.clone(), 2e-3).by(by(integrator, minimizer)).certified();
            (scene.gravity, scene.wind) = ([0.0, -GRAVITY, 0.0], [1.0, 0.0, 0.5]);
            let mut simulation = scene.simulate(Precision::F32);
            let mut told = Told::default();
            (0..60).for_each(|_| told.add(&advance(&mut simulation, 1)));
            (told, simulation)
        };
        let (auto, one) = (run(Minimizer::default()), run(Minimizer::OneStep));
        assert_eq!((auto.0.solves, auto.0.substeps), (60, 60), "{integrator:?}");
        assert_eq!(auto.1.state_hash(), one.1.state_hash(), "{integrator:?}");
    }
}

#[test]
fn unchecked_steps_make_one_solve() {
    let x: Vec<_> = (0..41).map(|i| [0.05 * f64::from(i), 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.05, 4e4, 0.0, 0.01);
    network.pins = vec![0];
    let run = |minimizer| {
        let scene = Scene::new(network.clone(), 0.08).by(by(Integrator::ImplicitEuler, minimizer));
        let mut simulation = scene.under([0.0, -GRAVITY, 0.0]).simulate(Precision::F64);
        let mut told = Told::default();
        (0..10).for_each(|_| told.add(&advance(&mut simulation, 1)));
        (told.solves, simulation.state_hash())
    };
    assert_eq!(run(Minimizer::default()), run(Minimizer::OneStep));
    assert_eq!(run(Minimizer::default()).0, 10);
}

/// A stiff bar of 21 particles that spins and flies, seen from where all moves by `seen` (m/s).
fn spinning_bar(integrator: Integrator, seen: [f64; 3]) -> Scene {
    let x: Vec<_> = (0..21).map(|i| [0.05 * f64::from(i) - 0.5, 0.0, 0.0]).collect();
    let mut network = chain(&x, 0.05, 4e4, 0.0, 0.01);
    for (v, x) in network.v.iter_mut().zip(&x) {
        *v = [1.0 + seen[0], 6.0 * x[0] + seen[1], 0.5 + seen[2]];
    }
    let method = by(integrator, Minimizer::default());
    Scene::new(network, 0.03).by(method).under([0.0, -GRAVITY, 0.0]).certified()
}

#[test]
fn a_free_body_has_the_momentum_that_acts_on_it_after_every_step() {
    for integrator in IMPLICIT {
        let mut scene = spinning_bar(integrator, [0.0; 3]);
        scene.settings.solver = SolverSettings::default();
        let mut simulation = scene.simulate(Precision::F64);
        let (mass, mut told) = (0.21, Told::default());
        let mut momentum = simulation.diagnose().momentum;
        for step in 0..40 {
            let report = advance(&mut simulation, 1);
            told.add(&report);
            momentum[1] -= mass * GRAVITY * 0.03;
            let found = report.diagnostics.momentum;
            let error = norm(difference(found, momentum));
            assert!(error < 1e-10 * norm(momentum), "{integrator:?}, step {step}: {error} N s");
            momentum = found;
        }
        let goes_on = told.solves > told.substeps;
        assert!(goes_on || integrator != Integrator::ImplicitEuler, "{} solves", told.solves);
    }
}

#[test]
fn as_many_solves_are_made_and_lead_to_the_same_where_all_is_seen_from_a_train() {
    let run = |seen: [f64; 3]| {
        let mut simulation = spinning_bar(Integrator::ImplicitEuler, seen).simulate(Precision::F64);
        let mut told = Told::default();
        (0..40).for_each(|_| told.add(&advance(&mut simulation, 1)));
        let time = 40.0 * 0.03;
        let x: Vec<_> =
            positions(&simulation).iter().map(|x| [0, 1, 2].map(|c| x[c] - time * seen[c])).collect();
        (x, told)
    };
    let (here, told) = run([0.0; 3]);
    assert!(told.solves > told.substeps, "{} solves", told.solves);
    for seen in [[30.0, -20.0, 10.0], [-300.0, 0.0, 0.0]] {
        let (there, moving) = run(seen);
        assert_eq!([moving.solves, moving.substeps], [told.solves, told.substeps], "{seen:?}");
        let off = max_distance(&here, &there);
        assert!(off < 1e-6, "{seen:?}: {off} m");
    }
}

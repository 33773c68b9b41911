//! Loose particles that bounce until they rest, over every integrator, restitution and kind of collider.

use nappe_sim::{
    cloth::{Hessian, Integrator, Minimizer},
    collide::{
        Collider, Contact, Shape, StartInside,
        shape::{Cuboid, Plane, Sphere},
    },
    math::Precision,
};
use nappe_tests::{
    Method, NEWTON, Scene,
    networks::particles,
    scene::{positions, try_advance, velocities},
};

const GRAVITY: f64 = 9.81;
/// Height (m) of the start above where a particle touches.
const HEIGHT: f64 = 1.0;
const RESTITUTIONS: [f64; 4] = [1.0, 0.9, 0.5, 0.0];
const MARGIN: f64 = 0.005;

/// Every integrator by one solve, and implicit Euler by each minimizer.
fn methods() -> impl Iterator<Item = Method> {
    let by = |minimizer| Method { minimizer, ..Method::new(Integrator::ImplicitEuler, Hessian::Absolute) };
    let integrators = Integrator::ALL.map(|integrator| Method::new(integrator, Hessian::Absolute));
    let sweeps = Minimizer::VertexBlockDescent { sweeps: Minimizer::DEFAULT_SWEEPS };
    integrators.into_iter().chain([by(NEWTON), by(sweeps)])
}

/// What particles bounce on: each stands on its own collider, and the height (m) of the one that moves is taken off.
fn grounds() -> Vec<(Vec<Collider>, [f64; 3])> {
    let collider = |restitution, shape, velocity| Collider {
        name: "ground".to_owned(),
        shape,
        velocity,
        way: None,
        friction: 0.3,
        restitution,
        margin: MARGIN,
        contact: Contact::default(),
        recovery: Collider::RECOVERY,
        on_start_inside: StartInside::default(),
    };
    let axes = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
    let moving = [0.3, 0.2, -0.1];
    let plane = |e| {
        let plane = Plane { point: [0.0, -MARGIN, 0.0], normal: [0.0, 1.0, 0.0] };
        (vec![collider(e, Shape::Plane(plane), [0.0; 3])], [0.0; 3])
    };
    let place = |i: usize| 10.0 * i as f64;
    let spheres = RESTITUTIONS.iter().enumerate().map(|(i, e)| {
        let sphere = Sphere { center: [place(i), -0.4 - MARGIN, 0.0], radius: 0.4 };
        collider(*e, Shape::Sphere(sphere), [0.0; 3])
    });
    let boxes = RESTITUTIONS.iter().enumerate().map(|(i, e)| {
        let half = [0.5, 0.25, 0.5];
        let cuboid = Cuboid { center: [place(i), -0.25 - MARGIN, 0.0], half_extent: half, axes };
        collider(*e, Shape::Box(cuboid), moving)
    });
    let mut all: Vec<_> = RESTITUTIONS.map(plane).into_iter().collect();
    all.push((spheres.collect(), [0.0; 3]));
    all.push((boxes.collect(), moving));
    all
}

/// The peaks (m) of one particle, and the time (s) since which it lies still.
#[derive(Clone, Debug, Default)]
struct Bounces {
    peaks: Vec<f64>,
    highest: f64,
    last: [f64; 2],
    moved_at: f64,
}

impl Bounces {
    /// `shown` is the speed (m/s) that a particle at rest may show.
    fn add(&mut self, time: f64, height: f64, speed: f64, shown: f64) {
        let [before, last] = self.last;
        if last > before && last >= height {
            self.peaks.push(last);
        }
        self.highest = self.highest.max(height);
        if height.abs() > 1e-9 || speed > shown {
            self.moved_at = time;
        }
        self.last = [last, height];
    }
}

/// Lets particles fall for `seconds` in steps of `dt` (s), and judges every bounce.
pub(crate) fn bounces_fall_by_the_square_of_their_restitution(dt: f64, seconds: f64) {
    for method in methods() {
        for (colliders, moving) in grounds() {
            let places: Vec<f64> = (0..colliders.len()).map(|i| 10.0 * i as f64).collect();
            let start: Vec<[f64; 3]> = places.iter().map(|x| [*x, HEIGHT, 0.0]).collect();
            let mut network = particles(&start, 0.3);
            network.v.fill(moving);
            let mut scene = Scene::new(network, dt).by(method).under([0.0, -GRAVITY, 0.0]).certified();
            scene.colliders.clone_from(&colliders);
            let mut simulation = scene.simulate(Precision::F64);
            // Explicit Euler moves with the velocity before the step, and falls into the ground one step later.
            let is_late = method.integrator == Integrator::ExplicitEuler;
            let shown = if is_late { 1.001 * GRAVITY * dt } else { 1e-9 };
            let mut found = vec![Bounces { last: [HEIGHT; 2], ..Bounces::default() }; colliders.len()];
            for step in 1..=(seconds / dt).round() as u64 {
                let label = || format!("{}, dt {dt}, step {step}", method.name());
                let report = try_advance(&mut simulation, 1).unwrap_or_else(|e| panic!("{}: {e}", label()));
                assert!(report.rejections.is_empty(), "{}: {:?}", label(), report.rejections);
                let time = step as f64 * dt;
                let (x, v) = (positions(&simulation), velocities(&simulation));
                for (i, bounces) in found.iter_mut().enumerate() {
                    let height = x[i][1] - moving[1] * time;
                    let off = (x[i][0] - places[i] - moving[0] * time).abs();
                    assert!(off < 1e-9, "{}: {off:e} m beside", label());
                    bounces.add(time, height, (v[i][1] - moving[1]).abs(), shown);
                }
            }
            for (collider, bounces) in colliders.iter().zip(&found) {
                let label = format!("{}, dt {dt}, {collider:?}", method.name());
                judge(&label, bounces, collider.restitution, method.integrator, dt, seconds);
            }
        }
    }
}

fn judge(label: &str, bounces: &Bounces, e: f64, integrator: Integrator, dt: f64, seconds: f64) {
    let Bounces { peaks, highest, moved_at, .. } = bounces;
    let speed = (2.0 * GRAVITY * HEIGHT).sqrt();
    let swing = if integrator.order() == 2 { 1e-6 } else { speed * dt };
    assert!(*highest <= HEIGHT * (1.0 + swing), "{label}: rises to {highest} m");

    // A peak between two steps is seen too low by this at most.
    let seen = GRAVITY * dt * dt / 8.0;
    let first = [HEIGHT].into_iter().chain(peaks.iter().copied());
    for (before, after) in first.zip(peaks).take_while(|(_, after)| 0.02 * **after > 2.0 * seen) {
        let ratio = after / before / (e * e);
        assert!((ratio - 1.0).abs() < 0.02, "{label}: {after} m after {before} m");
    }
    if e == 0.0 {
        assert!(peaks.iter().all(|peak| *peak < 1e-9), "{label}: {peaks:?}");
    }

    let fall = (2.0 * HEIGHT / GRAVITY).sqrt();
    let rest = fall * (1.0 + e) / (1.0 - e) + 10.0 * dt;
    if rest < seconds {
        assert!(*moved_at <= rest, "{label}: moves until {moved_at} s, not {rest}");
    } else if e == 1.0 {
        let bounced = (seconds - fall) / (2.0 * fall);
        assert!((peaks.len() as f64 - bounced).abs() < 2.0, "{label}: {} of {bounced} bounces", peaks.len());
        let least = peaks.iter().copied().fold(f64::INFINITY, f64::min);
        assert!(least > HEIGHT * (1.0 - 1e-3), "{label}: falls to {least} m");
    }
}

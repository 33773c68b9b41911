//! Solids of triangles: distances are those of all triangles one after the other, a box of 12 triangles is the box by formula,
//! and a fine ball is nearly the ball.

use nappe_scene::{NoMeshes, Scene as SceneText, SceneLimits, shipped_scenes};
use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{Collider, Shape, shape::Cuboid},
    linalg::SolverSettings,
    math::{Precision, array::dot},
    world::{Simulation, WorldSetup},
};
use nappe_tests::{
    Method, NEWTON, Random, Scene,
    meshes::{Surface, axes, box12, capsule, icosphere, torus, tray, turned_box12},
    networks::{particles, sheet, sheet_rules},
    scene::{advance, difference, max_distance, norm, positions, velocities},
};

const GRAVITY: f64 = 9.81;
const MARGIN: f64 = 0.005;

/// Surfaces of every kind.
fn surfaces() -> Vec<(&'static str, Surface)> {
    vec![
        ("box", box12([0.1, -0.2, 0.3], [0.5, 0.2, 0.1])),
        ("turned box", turned_box12([0.1, 0.0, 0.2], [0.3, 0.4, 0.2], axes(0.4, -0.7))),
        ("ball", icosphere([0.1, 0.2, -0.1], 0.5, 2)),
        ("ring", torus([0.0, 0.1, 0.0], 0.4, 0.15, [24, 12])),
        ("capsule", capsule([[-0.3, 0.1, 0.2], [0.4, -0.2, 0.1]], 0.25, [12, 4])),
        ("tray of 90 degrees", tray(90.0)),
        ("tray of 60 degrees", tray(60.0)),
        ("tray of 30 degrees", tray(30.0)),
        ("tray of 150 degrees", tray(150.0)),
    ]
}

#[test]
fn every_surface_to_test_with_is_closed_and_turned_outwards() {
    let fine = ("fine ball", icosphere([0.0; 3], 0.5, 4));
    assert_eq!(fine.1.triangles.len(), 5120);
    assert_eq!(torus([0.0; 3], 0.4, 0.15, [32, 16]).triangles.len(), 1024);
    for (name, surface) in surfaces().into_iter().chain([fine]) {
        assert_eq!(surface.open_sides(), Vec::<[u32; 2]>::new(), "{name}");
        assert!(surface.volume() > 0.0, "{name}: {} m³", surface.volume());
    }
    for (volume, surface) in [
        (8.0 * 0.5 * 0.2 * 0.1, box12([0.1, -0.2, 0.3], [0.5, 0.2, 0.1])),
        (1.6 * 1.6 * 0.35 - 0.6 * 0.6 * 0.15, tray(90.0)),
    ] {
        assert!((surface.volume() - volume).abs() < 1e-12, "{} m³, not {volume}", surface.volume());
    }
}

/// Points about a surface: anywhere, near its corners, and near its edges, as far from them as a margin or rounding.
fn points_about(surface: &Surface, random: &mut Random) -> Vec<[f64; 3]> {
    let mut points: Vec<_> = (0..60).map(|_| random.vector()).collect();
    let (corners, triangles) = (surface.points.len(), surface.triangles.len());
    for i in 0..60 {
        let corner = surface.points[i * 7 % corners];
        let ends = surface.triangles[i * 11 % triangles].map(|end| surface.points[end as usize]);
        let share = random.between(0.0, 1.0);
        let on_edge = [0, 1, 2].map(|c| ends[0][c] + share * (ends[1][c] - ends[0][c]));
        for size in [0.05, 1e-3, 1e-6] {
            let off = random.vector();
            points.extend([corner, on_edge].map(|x| [0, 1, 2].map(|c| x[c] + size * off[c])));
        }
    }
    points
}

#[test]
fn distances_and_signs_are_those_of_all_triangles_and_normals_lead_to_the_surface() {
    let mut random = Random::seeded(58);
    for (name, surface) in surfaces() {
        let collider = surface.collider(0.0, 0.0);
        for point in points_about(&surface, &mut random) {
            let (distance, normal) = collider.distance(point, 0.0);
            let expected = surface.distance(point);
            // Nearer than that the sign is rounding.
            let off =
                if expected.abs() < 1e-9 { distance.abs() - expected.abs() } else { distance - expected };
            assert!(off.abs() < 1e-12, "{name} at {point:?}: {distance}, not {expected}");
            assert!((norm(normal) - 1.0).abs() < 1e-12, "{name} at {point:?}: {normal:?}");
            let nearest = [0, 1, 2].map(|c| point[c] - distance * normal[c]);
            let left = surface.distance(nearest).abs();
            assert!(left < 4e-9, "{name} at {point:?}: {normal:?} leads {left:e} m from the surface");
        }
    }
}

/// What a sheet of 12 x 12 does above a solid in 1 s; how often particles touched it, went through it, or were pinched.
pub(crate) fn falls_on(shape: Shape, method: Method) -> (Vec<[f64; 3]>, [u64; 3]) {
    let mut network = sheet(12, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - 0.275, 0.1, x[2] - 0.275]);
    let mut scene = Scene::new(network, 2e-3).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.settings.solver = SolverSettings::default();
    let some = box12([0.0; 3], [1.0; 3]).collider(0.3, MARGIN);
    scene.colliders = vec![Collider { shape, ..some }];
    let mut simulation = scene.simulate(Precision::F64);
    let mut met = [0; 3];
    for _ in 0..500 {
        let report = advance(&mut simulation, 1);
        met[0] += report.contact_count;
        met[1] += report.notices.passed_count;
        met[2] += report.notices.pinched_count;
    }
    (positions(&simulation), met)
}

#[test]
fn cloth_does_on_a_box_of_triangles_what_it_does_on_the_box_by_formula() {
    let newton = Method { minimizer: NEWTON, ..Method::new(Integrator::Bdf2, Hessian::Absolute) };
    let one_step = Integrator::ALL.map(|integrator| Method::new(integrator, Hessian::Absolute));
    // Without air no step of explicit Euler is stable.
    let methods = one_step.into_iter().filter(|method| method.integrator != Integrator::ExplicitEuler);
    for method in methods.chain([newton]) {
        for axes in [axes(0.0, 0.0), axes(0.35, -0.2)] {
            let (center, half_extent) = ([0.013, -0.1, -0.007], [0.15, 0.1, 0.15]);
            let by_formula = Shape::Box(Cuboid { center, half_extent, axes });
            let [(expected, [touched, passed, _]), (found, [_, passed_too, pinched])] =
                [by_formula, turned_box12(center, half_extent, axes).shape()]
                    .map(|shape| falls_on(shape, method));
            let (off, label) = (max_distance(&found, &expected), method.name());
            assert!(off < 1e-9, "{label}, axes {axes:?}: {off:e} m off after 1 s");
            assert!(touched > 100, "{label}: {touched} contacts");
            assert_eq!((passed_too, pinched), (passed, 0), "{label}: passed as on the box, and pinched");
        }
    }
}

/// A particle at rest on the upper side of a large box of triangles that rises towards -x by `angle` (rad).
fn on_incline(angle: f64, friction: f64, method: Method, dt: f64) -> Scene {
    let axes = axes(-angle, 0.0);
    let normal = axes[1];
    let surface = turned_box12(normal.map(|n| -0.5 * n), [4.0, 0.5, 1.0], axes);
    let mut scene = Scene::new(particles(&[normal.map(|n| n * MARGIN)], 0.3), dt).by(method);
    scene.gravity = [0.0, -GRAVITY, 0.0];
    scene.colliders = vec![surface.collider(friction, MARGIN)];
    scene
}

#[test]
fn a_particle_slips_on_a_box_of_triangles_just_when_its_slope_exceeds_the_friction() {
    for method in Method::all() {
        for friction in [0.2, 0.577] {
            for (slope, slips) in [(0.99 * friction, false), (1.01 * friction, true)] {
                let scene = on_incline(f64::atan(slope), friction, method, 1e-3);
                let mut simulation = scene.simulate(Precision::F64);
                let start = positions(&simulation)[0];
                advance(&mut simulation, 1000);
                let way = norm(difference(positions(&simulation)[0], start));
                let label = format!("{}, friction {friction}, slope {slope}", method.name());
                // As on a plane: 0.01 friction g cos a t² / 2 within a few steps' worth.
                assert!(if slips { way > 5e-3 } else { way < 1e-5 }, "{label}: {way:e} m");
            }
        }
    }
}

#[test]
fn a_particle_slides_on_a_box_of_triangles_with_the_acceleration_that_friction_leaves() {
    let angle = 0.6_f64;
    for method in Method::all() {
        for friction in [0.0, 0.3] {
            let mut simulation = on_incline(angle, friction, method, 1e-4).simulate(Precision::F64);
            advance(&mut simulation, 1000);
            let before = velocities(&simulation)[0];
            advance(&mut simulation, 5000);
            let gained = norm(difference(velocities(&simulation)[0], before)) / 0.5;
            let expected = GRAVITY * (angle.sin() - friction * angle.cos());
            let off = (gained / expected - 1.0).abs();
            assert!(off < 1e-3, "{}, friction {friction}: {gained} m/s², not {expected}", method.name());
            let height = dot(positions(&simulation)[0], axes(-angle, 0.0)[1]) - MARGIN;
            assert!(height.abs() < 1e-9, "{}: {height:e} m off the surface", method.name());
        }
    }
}

/// Velocity (m/s) of a solid under cloth, or of the cloth the other way; their step (s), and how many of them are taken.
const VELOCITY: [f64; 3] = [0.4, 0.2, -0.3];
const STEP: f64 = 2e-3;
const STEPS: u32 = 100;

/// What moves of a sheet and the ring under it.
#[derive(Clone, Copy)]
enum Moves {
    Ring,
    Sheet,
}

/// Where a sheet on a ring is in the end, as the ring sees it; and how often its particles touched the ring.
fn on_ring(method: Method, friction: f64, moves: Moves) -> (Vec<[f64; 3]>, u64) {
    let mut network = sheet(14, 0.05, &sheet_rules(100.0, 0.02), 0.005);
    network.pins.clear();
    network.x.iter_mut().for_each(|x| *x = [x[0] - 0.325, 0.0, x[2] - 0.325]);
    let mut ring = torus([0.01, -0.088, 0.02], 0.25, 0.08, [32, 16]).collider(friction, MARGIN);
    match moves {
        Moves::Ring => ring.velocity = VELOCITY,
        Moves::Sheet => network.v.fill(VELOCITY.map(|v| -v)),
    }
    let shift = ring.velocity.map(|v| v * STEP * f64::from(STEPS));
    let mut scene = Scene::new(network, STEP).by(method).under([0.0, -GRAVITY, 0.0]);
    scene.colliders = vec![ring];
    let mut simulation = scene.simulate(Precision::F64);
    let touched = (0..STEPS).map(|_| advance(&mut simulation, 1).contact_count).sum();
    (positions(&simulation).into_iter().map(|x| difference(x, shift)).collect(), touched)
}

#[test]
fn a_solid_that_moves_under_cloth_is_one_that_stands_under_cloth_that_moves_the_other_way() {
    for integrator in [Integrator::VelocityVerlet, Integrator::ImplicitEuler, Integrator::Bdf2] {
        let method = Method::new(integrator, Hessian::Absolute);
        for friction in [0.0, 0.4] {
            let label = format!("{}, friction {friction}", method.name());
            let [(moving, touched), (standing, _)] =
                [Moves::Ring, Moves::Sheet].map(|moves| on_ring(method, friction, moves));
            let off = max_distance(&moving, &standing);
            assert!(off < 1e-9, "{label}: {off:e} m off after 0.2 s");
            assert!(touched > 1000, "{label}: {touched} contacts");
        }
    }
}

/// The shipped scene of cloth over a sphere.
fn over_sphere() -> WorldSetup {
    let name = "cloth_over_sphere";
    let (_, text) = shipped_scenes().iter().find(|(found, _)| *found == name).expect("it is shipped");
    let scene = SceneText::parse(text, name).unwrap_or_else(|error| panic!("{error}"));
    let built = scene.build(&NoMeshes, &SceneLimits::default()).unwrap_or_else(|error| panic!("{error}"));
    built.setup
}

/// How near particles come to the origin in 2 s (m), and the largest stretch.
fn nearest_and_stretch(setup: &WorldSetup) -> [f64; 2] {
    let (mut simulation, _) = Simulation::new(setup, Precision::F64).expect("a scene that is shipped");
    let (mut nearest, mut stretch) = (f64::INFINITY, 0.0_f64);
    for step in 0..400 {
        let report = advance(&mut simulation, 1);
        stretch = stretch.max(report.diagnostics.max_stretch);
        nearest = positions(&simulation).into_iter().map(norm).fold(nearest, f64::min);
        let (passed, pinched) = (report.notices.passed_count, report.notices.pinched_count);
        assert_eq!((passed, pinched), (0, 0), "step {step}: passed, and pinched");
    }
    [nearest, stretch]
}

#[test]
fn a_ball_of_5120_triangles_carries_cloth_as_the_sphere_does_but_for_the_depth_of_its_facets() {
    let (radius, margin) = (0.5, 0.01);
    let by_formula = over_sphere();
    let ball = icosphere([0.0; 3], radius, 4);
    let facets = radius - ball.least_depth_of([0.0; 3]);
    assert!((1e-4..1e-3).contains(&facets), "facets are {facets} m deep");
    let mut by_triangles = by_formula.clone();
    by_triangles.colliders[0].shape = ball.shape();
    let [[_, expected], [nearest, stretch]] =
        [by_formula, by_triangles].map(|setup| nearest_and_stretch(&setup));
    let below = radius + margin - nearest;
    assert!(
        below < facets + 1e-9,
        "a particle is {below:e} m below the margin, facets are {facets:e} m deep"
    );
    let off = stretch / expected - 1.0;
    assert!(off.abs() < 0.01, "largest stretch {stretch}, on the sphere {expected}: {off:e} off");
}

//! The law of a membrane: triangles with warp and weft, against closed forms of pulls, shear and oscillations.

use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Network, SpringLaw, SpringRules, Threads, Warp},
    linalg::{OperatorKind, Stop},
    math::{
        Precision,
        array::{cross, length, minus},
    },
    mesh::TriangleMesh,
    report::StepFailure,
};
use nappe_tests::{
    Method, Scene,
    scene::{advance, max_distance, positions, try_advance},
    statics::equilibrium,
};

/// Along warp and weft and against shear (N/m).
const STIFFNESS: [f64; 3] = [1000.0, 600.0, 50.0];
const GRAVITY: f64 = 9.81;

/// What a mesh of a square is like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    OneWay,
    Alternating,
    /// Diagonals at random, and points moved within the rim.
    Irregular,
}

impl Kind {
    const ALL: [Self; 3] = [Self::OneWay, Self::Alternating, Self::Irregular];

    fn is_first(self, column: usize, row: usize) -> bool {
        match self {
            Self::OneWay => true,
            Self::Alternating => (column + row).is_multiple_of(2),
            Self::Irregular => noise(32 * row + column) > 0.0,
        }
    }
}

/// Numbers of [-1, 1] that have no pattern, the same in every run.
fn noise(i: usize) -> f64 {
    let mut hash = (i as u64 + 1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
    hash = (hash ^ (hash >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    hash = (hash ^ (hash >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    ((hash ^ (hash >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
}

/// A grid of square cells in the plane y = 0.
fn grid([columns, rows]: [usize; 2], spacing: f64, kind: Kind) -> TriangleMesh {
    let mut mesh = TriangleMesh::grid(columns + 1, rows + 1, spacing);
    for (cell, pair) in mesh.triangles.as_chunks_mut::<2>().0.iter_mut().enumerate() {
        let (column, row) = (cell % columns, cell / columns);
        if !kind.is_first(column, row) {
            let a = (row * (columns + 1) + column) as u32;
            let [b, c, d] = [a + 1, a + columns as u32 + 1, a + columns as u32 + 2];
            *pair = [[a, b, d], [a, d, c]];
        }
    }
    if kind == Kind::Irregular {
        for point in (0..mesh.points.len()).filter(|point| !is_at_rim(*point, [columns, rows])) {
            mesh.points[point][0] += 0.2 * spacing * noise(3 * point);
            mesh.points[point][2] += 0.2 * spacing * noise(3 * point + 1);
        }
    }
    mesh
}

fn is_at_rim(point: usize, [columns, rows]: [usize; 2]) -> bool {
    let (column, row) = (point % (columns + 1), point / (columns + 1));
    column == 0 || row == 0 || column == columns || row == rows
}

/// A membrane on a mesh, the warp at an angle from x (degrees), with `damping` (N s/m) along the stiffest; each particle has its
/// third of the triangles around (kg, at 1 kg/m²).
fn sheet(mesh: &TriangleMesh, degrees: f64, stiffness: [f64; 3], damping: f64) -> Network {
    let none = SpringRules { stretch: SpringLaw { stiffness: 0.0, damping: 0.0 }, shear: None, bend: None };
    let mut network = Network::from_mesh(mesh, &none, 0.0);
    network.springs.clear();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.points[corner as usize]);
        let third = length(cross(minus(b, a), minus(c, a))) / 6.0;
        for corner in triangle {
            network.masses[*corner as usize] += third;
        }
    }
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let greatest = stiffness.into_iter().fold(0.0, f64::max);
    let law = SpringLaw { stiffness: greatest, damping };
    let warp = Warp::Along([cosine, 0.0, sine]);
    let threads = Threads { warp, shares: stiffness.map(|one| one / greatest) };
    network.elements = vec![ElementList::membrane(law, threads, mesh).expect("a warp within the plane")];
    network
}

fn by(integrator: Integrator) -> Method {
    Method::new(integrator, Hessian::Absolute)
}

/// A map of the plane y = 0: what x and z become.
type Map = [[f64; 2]; 2];

/// A vector (x, z) under a map.
fn under([[a, b], [c, d]]: Map, [x, z]: [f64; 2]) -> [f64; 2] {
    [a * x + b * z, c * x + d * z]
}

/// Energy per area (J/m²) and greatest stretch under a map, the warp at an angle from x (degrees).
fn expected(map: Map, degrees: f64) -> [f64; 2] {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    let [warp, weft] = [under(map, [cosine, sine]), under(map, [-sine, cosine])];
    let [along, across] = [warp, weft].map(|[x, z]| x.hypot(z));
    let shear = warp[0] * weft[0] + warp[1] * weft[1];
    let [k_warp, k_weft, k_shear] = STIFFNESS;
    let energy = k_warp * (along - 1.0).powi(2) + k_weft * (across - 1.0).powi(2) + k_shear * shear.powi(2);
    [0.5 * energy, along.max(across)]
}

/// A vector turned about two axes.
fn turned([x, y, z]: [f64; 3]) -> [f64; 3] {
    let ((s, c), (t, d)) = (0.7_f64.sin_cos(), 2.1_f64.sin_cos());
    let (x, y) = (c * x - s * y, s * x + c * y);
    [x, d * y - t * z, t * y + d * z]
}

#[test]
fn pulls_and_shear_have_their_energy_on_every_mesh_at_every_angle() {
    let (cells, spacing) = (7, 0.05);
    let area = (cells as f64 * spacing).powi(2);
    let maps: [Map; 4] = [
        [[1.1, 0.0], [0.0, 1.0]],
        [[0.9, 0.0], [0.0, 1.2]],
        [[1.0, 0.15], [0.0, 1.0]],
        [[1.1, 0.2], [-0.1, 0.8]],
    ];
    for kind in Kind::ALL {
        let mesh = grid([cells; 2], spacing, kind);
        for (degrees, map) in
            [0.0, 30.0, 45.0, 90.0].into_iter().flat_map(|angle| maps.map(|map| (angle, map)))
        {
            let found = |precision: Precision, is_turned: bool| {
                let mut network = sheet(&mesh, degrees, STIFFNESS, 0.0);
                for x in &mut network.x {
                    let [along, across] = under(map, [x[0], x[2]]);
                    *x = if is_turned { turned([along, 0.3, across]) } else { [along, 0.3, across] };
                }
                let now = Scene::new(network, 1e-3).simulate(precision).diagnose();
                [now.elastic_energy / area, now.max_stretch]
            };
            let expected = expected(map, degrees);
            for (is_turned, tolerance) in [(false, 1e-12), (true, 1e-11)] {
                for (found, expected) in found(Precision::F64, is_turned).into_iter().zip(expected) {
                    let error = (found / expected - 1.0).abs();
                    assert!(error < tolerance, "{kind:?}, {degrees}, {map:?}: {found}, {expected}");
                }
            }
            for (found, expected) in found(Precision::F32, true).into_iter().zip(expected) {
                let error = (found / expected - 1.0).abs();
                assert!(error < 1e-4, "{kind:?}, {degrees}, {map:?}: {found} in f32, {expected}");
            }
        }
    }
}

#[test]
fn what_is_held_at_its_rim_comes_to_rest_as_the_rim_says() {
    let map: Map = [[1.2, 0.1], [0.05, 1.15]];
    let cells = [8; 2];
    for kind in Kind::ALL {
        let mesh = grid(cells, 0.05, kind);
        let mut network = sheet(&mesh, 30.0, STIFFNESS, 0.0);
        for x in &mut network.x {
            let [along, across] = under(map, [x[0], x[2]]);
            *x = [along, 0.0, across];
        }
        let expected = network.x.clone();
        for (point, x) in network.x.iter_mut().enumerate() {
            if is_at_rim(point, cells) {
                network.pins.push(point as u32);
            } else {
                *x = [0, 1, 2].map(|c| x[c] + 0.01 * noise(3 * point + c));
            }
        }
        let found = equilibrium(&Scene::new(network, 0.01), 0.01, 100);
        let off = max_distance(&found, &expected);
        assert!(off < 1e-9, "{kind:?}: {off} m");
    }
}

/// A strip whose left end is pinned and whose right end is pulled by a force per width (N/m), as weights along x.
fn pulled(kind: Kind, degrees: f64, force: f64) -> Scene {
    let (cells, spacing) = ([10, 4], 0.05);
    let mut network = sheet(&grid(cells, spacing, kind), degrees, STIFFNESS, 0.0);
    let columns = cells[0] + 1;
    for point in 0..network.x.len() {
        let (column, row) = (point % columns, point / columns);
        let share = if row == 0 || row == cells[1] { 0.5 } else { 1.0 };
        network.masses[point] = if column == cells[0] { share * spacing * force / GRAVITY } else { 1e-9 };
        if column == 0 {
            network.pins.push(point as u32);
        }
    }
    Scene::new(network, 0.02).by(by(Integrator::ImplicitEuler)).under([GRAVITY, 0.0, 0.0])
}

#[test]
fn a_strip_pulled_along_its_threads_grows_by_force_over_stiffness() {
    const FORCE: f64 = 120.0;
    for kind in Kind::ALL {
        for (degrees, stiffness) in [(0.0, STIFFNESS[0]), (90.0, STIFFNESS[1])] {
            let mut scene = pulled(kind, degrees, FORCE);
            scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 4000 };
            let rest = scene.network.x.clone();
            let found = equilibrium(&scene, 0.02, 100);
            let expected: Vec<[f64; 3]> =
                rest.iter().map(|[x, y, z]| [x * (1.0 + FORCE / stiffness), *y, *z]).collect();
            let off = max_distance(&found, &expected);
            assert!(off < 1e-8, "{kind:?} at {degrees}: {off} m");
        }
    }
}

#[test]
fn a_limit_of_the_stretch_holds_for_membranes() {
    let mut scene = pulled(Kind::Irregular, 0.0, 400.0);
    scene.settings.limits.max_stretch = Some(1.2);
    let mut simulation = scene.simulate(Precision::F64);
    let error = try_advance(&mut simulation, 200).expect_err("it is pulled further");
    let StepFailure::Stretch { particle, other, value, limit, .. } = error.failure else { panic!("{error}") };
    assert!(value > limit && limit == 1.2 && particle != other, "{error}");
    assert!(simulation.diagnose().max_stretch <= 1.2);
}

/// A row of cells between two columns of particles, the left one pinned, which swings along the warp (m) at 2 pi / s as a whole.
fn swinging(damping: f64) -> Network {
    const SPACING: f64 = 0.1;
    const ROWS: usize = 3;
    let mut network = sheet(&grid([1, ROWS], SPACING, Kind::OneWay), 0.0, [100.0, 100.0, 10.0], damping);
    // k width / spacing over (2 pi)² of all together.
    let mass = 100.0 * ROWS as f64 / std::f64::consts::TAU.powi(2);
    for row in 0..=ROWS {
        let share = if row == 0 || row == ROWS { 0.5 } else { 1.0 };
        network.masses[2 * row + 1] = mass * share / ROWS as f64;
        network.x[2 * row + 1][0] = SPACING * 1.1;
        network.pins.push(2 * row as u32);
    }
    network
}

/// How much the right column is off after 0.35 s in so many steps (m), without damping or with a share of the critical one.
fn off(integrator: Integrator, steps: u64, ratio: f64) -> f64 {
    const TIME: f64 = 0.35;
    let rate = std::f64::consts::TAU;
    // Damping over stiffness is 2 ratio / rate.
    let scene = Scene::new(swinging(100.0 * 2.0 * ratio / rate), TIME / steps as f64).by(by(integrator));
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, steps);
    let turn = rate * (1.0 - ratio * ratio).sqrt();
    let (sine, cosine) = (turn * TIME).sin_cos();
    let swing = (-ratio * rate * TIME).exp() * (cosine + ratio * rate / turn * sine);
    let x = positions(&simulation);
    let found: Vec<f64> = x.iter().skip(1).step_by(2).map(|x| x[0]).collect();
    assert!(
        found.iter().all(|x| (x - found[0]).abs() < 1e-12),
        "{integrator:?} swings as a whole: {found:?}"
    );
    (found[0] - 0.1 - 0.01 * swing).abs()
}

#[test]
fn every_integrator_swings_a_membrane_in_its_order() {
    for integrator in Integrator::ALL {
        let [coarse, fine] = [128, 256].map(|steps| off(integrator, steps, 0.0));
        let order = (coarse / fine).log2();
        let expected = f64::from(integrator.order());
        assert!((order - expected).abs() < 0.2, "{integrator:?}: {coarse}, {fine}, order {order}");
    }
    for integrator in [Integrator::VelocityVerletPredicted, Integrator::ImplicitMidpoint] {
        let found = off(integrator, 800, 0.1);
        assert!(found < 1e-6, "{integrator:?}, damped: {found} m");
    }
}

#[test]
fn a_membrane_changes_neither_momentum_nor_what_is_flat() {
    let mesh = grid([16, 20], 0.05, Kind::Irregular);
    for integrator in Integrator::ALL {
        let mut network = sheet(&mesh, 20.0, [50.0, 30.0, 2.0], 0.1);
        for (i, v) in network.v.iter_mut().enumerate() {
            *v = [0.3 + 0.1 * noise(2 * i), -0.2, 0.1 * noise(2 * i + 1)];
        }
        let mut scene = Scene::new(network, 1e-4).by(by(integrator));
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 500 };
        scene.settings.block_size = 32;
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose();
        let after = advance(&mut simulation, 50).diagnostics;
        for c in 0..3 {
            assert!((before.momentum[c] - after.momentum[c]).abs() < 1e-12, "{integrator:?}: {after:?}");
        }
        assert!(after.elastic_energy > 0.0 && after.elastic_energy < before.kinetic_energy, "{after:?}");

        let network = sheet(&mesh, 20.0, [50.0, 30.0, 2.0], 0.1);
        let rest = network.x.clone();
        let mut still = Scene::new(network, 1e-4).by(by(integrator)).simulate(Precision::F64);
        advance(&mut still, 50);
        let moved = max_distance(&positions(&still), &rest);
        assert!(moved < 1e-13, "{integrator:?}: {moved} m");
    }
}

#[test]
fn an_implicit_step_is_the_same_with_the_matrix_stored() {
    let mesh = grid([18, 20], 0.05, Kind::Irregular);
    let run = |operator: OperatorKind, block_size: usize| {
        let mut network = sheet(&mesh, 30.0, [50.0, 40.0, 5.0], 0.05);
        let bending = SpringLaw { stiffness: 0.02, damping: 1e-3 };
        network.elements.push(ElementList::new(ElementKind::Plate, bending, &mesh));
        network.pins = vec![0, 18];
        let mut scene = Scene::new(network, 5e-3).by(by(Integrator::ImplicitEuler));
        scene.settings.solver.operator = operator;
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-13, max_iterations: 2000 };
        scene.settings.block_size = block_size;
        let mut simulation = scene.under([0.0, -GRAVITY, 0.0]).simulate(Precision::F64);
        advance(&mut simulation, 20);
        positions(&simulation)
    };
    let free = run(OperatorKind::MatrixFree, 32);
    for other in [run(OperatorKind::Assembled, 32), run(OperatorKind::MatrixFree, 256)] {
        let off = max_distance(&free, &other);
        assert!(off < 1e-9, "{off} m");
    }
}

/// The greatest energy in 2000 explicit steps of a share of the first bound, in that of the start; infinite where they fail.
fn gain(network: &Network, share: f64) -> f64 {
    let mut scene = Scene::new(network.clone(), 1.0).by(by(Integrator::SymplecticEuler));
    let bound = scene.simulate(Precision::F64).step_bounds()[0].dt;
    scene.dt = share * bound;
    let mut simulation = scene.simulate(Precision::F64);
    let before = simulation.diagnose();
    let mut most = 0.0;
    for _ in 0..2000 {
        let Ok(report) = try_advance(&mut simulation, 1) else { return f64::INFINITY };
        let now = report.diagnostics;
        let energy = now.kinetic_energy + now.elastic_energy;
        most = f64::max(most, energy / (before.kinetic_energy + before.elastic_energy));
    }
    most
}

#[test]
fn an_explicit_step_is_stable_up_to_its_bound() {
    for kind in Kind::ALL {
        let mut network = sheet(&grid([12, 12], 0.05, kind), 0.0, [50.0, 30.0, 2.0], 0.0);
        for (i, v) in network.v.iter_mut().enumerate() {
            *v = [1e-4 * noise(2 * i), 0.0, 1e-4 * noise(2 * i + 1)];
        }
        let (within, beyond) = (gain(&network, 0.9), gain(&network, 2.0));
        assert!(within < 20.0, "{kind:?}: {within}");
        assert!(beyond > 1e6, "{kind:?}: the bound is not far from the limit: {beyond}");
    }
}

#[test]
fn certified_steps_keep_the_energy_of_a_crumpled_sheet() {
    for kind in Kind::ALL {
        let mut network = sheet(&grid([10, 10], 0.05, kind), 0.0, [50.0, 30.0, 20.0], 0.0);
        let bound = |network: &Network| {
            let scene = Scene::new(network.clone(), 0.01).by(by(Integrator::VelocityVerlet));
            scene.simulate(Precision::F64).step_bounds()[0].dt
        };
        let at_rest = bound(&network);
        for (i, x) in network.x.iter_mut().enumerate() {
            *x = [0, 1, 2].map(|c| x[c] + 0.015 * noise(3 * i + c));
        }
        assert!(bound(&network) < 0.95 * at_rest, "{kind:?}: what is stretched and sheared is stiffer");
        let scene = Scene::new(network, 0.01).by(by(Integrator::VelocityVerlet)).certified();
        let mut simulation = scene.simulate(Precision::F64);
        let before = simulation.diagnose();
        let start = before.kinetic_energy + before.elastic_energy;
        for _ in 0..50 {
            let now = advance(&mut simulation, 1).diagnostics;
            let share = (now.kinetic_energy + now.elastic_energy) / start;
            assert!((share - 1.0).abs() < 0.2, "{kind:?}: {share} of the energy at the start");
        }
    }
}

//! Air on triangles: plates against closed forms, meshes of several widths, energies, bounds, flags.

use nappe_sim::{
    cloth::{Air, Hessian, Integrator, Minimizer, Network, SpringLaw, SpringRules},
    linalg::Stop,
    math::{Mat3, Precision, Vec3},
    mesh::TriangleMesh,
    world::Simulation,
};
use nappe_tests::{
    Method, Scene,
    networks::sheet_rules,
    scene::{advance, momenta, positions, velocities},
};

pub(crate) const GRAVITY: f64 = 9.81;
/// Mass per area (kg/m²).
pub(crate) const SURFACE: f64 = 0.15;

/// Air of which every coefficient counts.
pub(crate) const AIR: Air = Air { density: 1.2, normal: 1.2, lift: 2.0, tangential: 0.3 };

/// A mesh as cloth in air: each particle weighs a third of its triangles.
pub(crate) fn cloth(
    mesh: &TriangleMesh,
    [columns, rows]: [usize; 2],
    rules: &SpringRules,
    surface: f64,
) -> Network {
    let mut network = Network::from_lattice(mesh, [columns, rows], rules, 0.0);
    network.masses = vec![0.0; mesh.points.len()];
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| Vec3::from(mesh.points[corner as usize]));
        for corner in triangle {
            network.masses[*corner as usize] += surface * (b - a).cross(&(c - a)).norm() / 6.0;
        }
    }
    network.air = Some(AIR);
    network
}

/// A square plate of one metre, of which `place` says where its points are.
pub(crate) fn plate(side: usize, place: impl Fn([f64; 3]) -> [f64; 3]) -> Network {
    let mut mesh = TriangleMesh::grid(side, side, 1.0 / (side - 1) as f64);
    mesh.points.iter_mut().for_each(|point| *point = place(*point));
    cloth(&mesh, [side, side], &sheet_rules(1e-3, 0.0), SURFACE)
}

/// The mean height and velocity along y.
pub(crate) fn fallen(simulation: &Simulation) -> [f64; 2] {
    let count = simulation.particle_count() as f64;
    let mean = |vectors: Vec<[f64; 3]>| vectors.iter().map(|v| v[1]).sum::<f64>() / count;
    [mean(positions(simulation)), mean(velocities(simulation))]
}

#[test]
fn a_plate_falls_broadside_and_edge_on_to_its_terminal_speed() {
    let flat = |point: [f64; 3]| point;
    let upright = |[x, _, z]: [f64; 3]| [x, -z, 0.0];
    for method in Method::all() {
        // Sweeps and Newton's method on the larger one take a minute, and the Hessian is another's subject.
        let is_plain = method.minimizer == Minimizer::OneStep && method.hessian == Hessian::default();
        let sides = if is_plain { &[10, 40][..] } else { &[10] };
        for &side in sides {
            for (place, coefficient, time) in
                [(&flat as &dyn Fn([f64; 3]) -> [f64; 3], AIR.normal, 1.5), (&upright, AIR.tangential, 3.0)]
            {
                let terminal = (2.0 * SURFACE * GRAVITY / (AIR.density * coefficient)).sqrt();
                let mut scene = Scene::new(plate(side, place), 0.01).by(method).under([0.0, -GRAVITY, 0.0]);
                if method.integrator.is_implicit() {
                    scene.network.springs.iter_mut().for_each(|spring| spring.law.stiffness *= 1e4);
                }
                let mut simulation = scene.simulate(Precision::F64);
                advance(&mut simulation, (time / 0.01) as u64);
                let speed = -fallen(&simulation)[1];
                let error = (speed / terminal - 1.0).abs();
                assert!(error < 1e-3, "{}, {side}: {speed} m/s, not {terminal}", method.name());
            }
        }
    }
}

#[test]
fn a_plate_reaches_its_terminal_speed_as_the_closed_form_does() {
    let terminal = (2.0 * SURFACE * GRAVITY / (AIR.density * AIR.normal)).sqrt();
    let time = 0.16;
    let expected = terminal * (GRAVITY * time / terminal).tanh();
    for method in Method::all() {
        let error = |dt: f64| {
            let scene = Scene::new(plate(10, |point| point), dt).by(method).under([0.0, -GRAVITY, 0.0]);
            let mut simulation = scene.simulate(Precision::F64);
            advance(&mut simulation, (time / dt).round() as u64);
            (-fallen(&simulation)[1] - expected).abs()
        };
        let errors = [0.008, 0.004, 0.002].map(error);
        // Order 1, and 2 of those whose air is that of the middle of the step, or of both of its ends.
        for pair in errors.windows(2) {
            let ratio = pair[0] / pair[1];
            assert!((1.7..4.6).contains(&ratio), "{}: {errors:?} m/s, {ratio}", method.name());
        }
        assert!(errors[2] < 0.02 * terminal, "{}: {errors:?} m/s", method.name());
    }
}

/// A third of D for each particle's mass: what the air makes of a plate whose triangles all have this normal and velocity.
fn slowing(normal: Vec3<f64>, u: Vec3<f64>) -> Mat3<f64> {
    let across = u.dot(&normal);
    let along = (u - normal * across).norm();
    let of_normal = normal * normal.transpose();
    (of_normal * (AIR.normal * across.abs() + AIR.lift * along)
        + (Mat3::identity() - of_normal) * AIR.tangential * along)
        * (0.5 * AIR.density)
}

#[test]
fn the_force_on_an_inclined_plate_is_the_closed_form_in_every_component() {
    let angle = 30_f64.to_radians();
    let inclined = |[x, _, z]: [f64; 3]| [x * angle.cos(), x * angle.sin(), z];
    let normal = Vec3::new(-angle.sin(), angle.cos(), 0.0);
    let wind = Vec3::new(7.0, -1.5, 2.5);
    let (u, dt) = (-wind, 1e-3);
    let drag = slowing(normal, u);
    // f = -rho A / 2 ((C_n |u.n| + C_l |u_t|) (u.n) n + C_t |u_t| u_t), A = 1 m².
    let across = u.dot(&normal);
    let along = u - normal * across;
    let force = -(normal * across * (AIR.normal * across.abs() + AIR.lift * along.norm())
        + along * along.norm() * AIR.tangential)
        * 0.5
        * AIR.density;
    assert!((force + drag * u).norm() < 1e-12 * force.norm());
    for method in Method::all() {
        let mut scene = Scene::new(plate(10, inclined), dt).by(method);
        scene.wind = wind.into();
        let masses = scene.network.masses.clone();
        let mut simulation = scene.simulate(Precision::F64);
        advance(&mut simulation, 1);
        let momentum = Vec3::from(momenta(&simulation, &masses).0);
        let expected = match method.integrator {
            Integrator::ExplicitEuler | Integrator::SymplecticEuler => force * dt,
            // v' = (m + h D)⁻¹ h D w, of the middle of the step and from there as far again.
            Integrator::ImplicitEuler | Integrator::Bdf2 | Integrator::ImplicitMidpoint => {
                let is_middle = method.integrator == Integrator::ImplicitMidpoint;
                let h = if is_middle { 0.5 * dt } else { dt };
                let mass = Mat3::identity() * SURFACE;
                let v = (mass + drag * h).try_inverse().expect("positive definite") * (force * h);
                v * SURFACE * (dt / h)
            }
            Integrator::VelocityVerlet | Integrator::VelocityVerletPredicted => {
                let half = force * (0.5 * dt);
                let w = half / SURFACE;
                let predicted = if method.integrator == Integrator::VelocityVerlet { w } else { w * 2.0 };
                half - slowing(normal, predicted - wind) * (predicted - wind) * (0.5 * dt)
            }
            // One without a closed form here.
            #[allow(unreachable_patterns, reason = "a new integrator needs none")]
            _ => continue,
        };
        let error = (momentum - expected).norm() / expected.norm();
        let tolerance = if method.name().contains("sweeps") { 1e-9 } else { 1e-12 };
        assert!(error < tolerance, "{}: {momentum}, not {expected}: {error:e}", method.name());
    }
}

/// The angle to the vertical (rad) at which a strip of one metre hangs by its upper edge in wind, by the mean of its free edge
/// over a second at the end.
fn angle(cells: usize, drag: Option<f64>) -> f64 {
    let (columns, rows) = (cells / 5 + 1, cells + 1);
    let mut mesh = TriangleMesh::grid(columns, rows, 1.0 / cells as f64);
    mesh.points.iter_mut().for_each(|point| *point = [point[0], -point[2], 0.0]);
    // The same cloth at every width.
    let law = |stiffness: f64| SpringLaw { stiffness, damping: 0.2 / cells as f64 };
    let rules = SpringRules { stretch: law(500.0), shear: Some(law(100.0)), bend: None };
    let mut network = cloth(&mesh, [columns, rows], &rules, 1.0);
    network.pins = (0..columns as u32).collect();
    network.air = Some(Air { lift: 0.0, ..AIR });
    if let Some(drag) = drag {
        (network.air, network.drag) = (None, drag);
    }
    let mut scene = Scene::new(network, 0.01).under([0.0, -GRAVITY, 0.0]).certified();
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-5, max_iterations: 400 };
    scene.wind = [0.0, 0.0, 5.0];
    let mut simulation = scene.simulate(Precision::F64);
    advance(&mut simulation, 400);
    let mut sum = 0.0;
    for _ in 0..100 {
        advance(&mut simulation, 1);
        let edge = &positions(&simulation)[columns * (rows - 1)..];
        sum += edge.iter().map(|[_, y, z]| z.atan2(-y)).sum::<f64>() / columns as f64;
    }
    sum / 100.0
}

#[test]
fn a_sheet_hangs_in_wind_at_the_same_angle_whatever_its_mesh_and_with_drag_it_does_not() {
    let angles = [20, 40, 80].map(|cells| angle(cells, None));
    for angle in angles {
        assert!((angle / angles[2] - 1.0).abs() < 0.01, "{angles:?} rad");
    }
    // The drag that makes the coarsest sheet hang there.
    let dragged = [20, 40].map(|cells| angle(cells, Some(0.004)));
    assert!(dragged[1] / dragged[0] > 1.3, "{dragged:?} rad");
}

/// How far the free edge of a flag of 1.5 m x 1 m moves across the wind (m): the standard deviation from 5 s to 20 s.
fn flutter(columns: usize, air: Option<Air>) -> f64 {
    let rows = 2 * (columns - 1) / 3 + 1;
    let mut mesh = TriangleMesh::grid(columns, rows, 1.5 / (columns - 1) as f64);
    mesh.points.iter_mut().for_each(|point| *point = [point[0], -point[2], 0.0]);
    let law = |stiffness: f64| SpringLaw { stiffness, damping: 1e-3 };
    let rules = SpringRules { stretch: law(500.0), shear: Some(law(60.0)), bend: Some(law(0.1)) };
    let mut network = cloth(&mesh, [columns, rows], &rules, 0.6);
    network.pins = (0..rows as u32).map(|row| row * columns as u32).collect();
    network.air = air;
    if air.is_none() {
        network.drag = 1.0 / network.x.len() as f64;
    }
    let mut scene = Scene::new(network, 5e-3).under([0.0, -GRAVITY, 0.0]).certified();
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-3, max_iterations: 200 };
    scene.wind = [8.0, 0.0, 0.1];
    let mut simulation = scene.simulate(Precision::F32);
    advance(&mut simulation, 1000);
    let (mut sums, count) = (vec![[0.0; 2]; rows], 750.0);
    for _ in 0..count as u64 {
        advance(&mut simulation, 4);
        let x = positions(&simulation);
        for (row, [sum, squares]) in sums.iter_mut().enumerate() {
            let across = x[(row + 1) * columns - 1][2];
            (*sum, *squares) = (*sum + across, *squares + across * across);
        }
    }
    let deviation = |[sum, squares]: &[f64; 2]| (squares / count - (sum / count) * (sum / count)).sqrt();
    sums.iter().map(deviation).sum::<f64>() / rows as f64
}

#[test]
fn a_flag_flutters_in_air_and_not_with_drag() {
    for columns in [22, 31] {
        let across = flutter(columns, Some(Air::default()));
        assert!(across > 0.05 * 1.5, "{columns}: {across} m");
    }
    let across = flutter(22, None);
    assert!(across < 0.001 * 1.5, "{across} m");
}

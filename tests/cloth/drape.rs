//! Cusick's drape of fabrics: a disc of 30 cm that lies on one of 18 cm and hangs over its edge. Of what hangs over, the drape
//! coefficient is the share that is still seen from above.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use std::f64::consts::{PI, TAU};

use nappe_scene::Fabric;
use nappe_sim::{
    cloth::{ElementKind, ElementList, Hessian, Integrator, Network, SpringLaw, SpringRules, Threads, Warp},
    linalg::{PreconditionerKind, Stop},
    math::{
        Precision,
        array::{cross, length, minus},
    },
    mesh::TriangleMesh,
    report::NoStopwatch,
};
use nappe_tests::{
    Method, Scene,
    networks::scatter,
    scene::{positions, velocities},
    threads::with_threads,
};

/// Radius of the disc (m), and of the one on which it lies.
const RADIUS: f64 = 0.15;
const SUPPORT: f64 = 0.09;
/// Time step (s), steps at least and at most, and the root mean square of speeds (m/s) at which it is at rest.
const DT: f64 = 0.01;
const STEPS: [u32; 2] = [100, 1500];
const REST: f64 = 1e-3;
/// Side of the cells in which an area is counted (m).
const CELL: f64 = 0.5e-3;

/// A flat disc of rings, of which ring i has 6 i points: triangles whose sides are about as long as the rings are apart.
fn disc(rings: usize) -> TriangleMesh {
    let mut points = vec![[0.0; 3]];
    for ring in 1..=rings {
        let (count, radius) = (6 * ring, RADIUS * ring as f64 / rings as f64);
        points.extend((0..count).map(|place| {
            let (sine, cosine) = (TAU * place as f64 / count as f64).sin_cos();
            [radius * cosine, 0.0, radius * sine]
        }));
    }
    // The number of a point of a ring, by its place around it.
    let number = |ring: usize, place: usize| {
        if ring == 0 { 0 } else { (1 + 3 * ring * (ring - 1) + place % (6 * ring)) as u32 }
    };
    let mut triangles = Vec::new();
    for ring in 1..=rings {
        for sector in 0..6 {
            for step in 0..ring {
                let (outer, inner) = (sector * ring + step, sector * (ring - 1) + step);
                let at = number(ring - 1, inner);
                triangles.push([at, number(ring, outer + 1), number(ring, outer)]);
                if step + 1 < ring {
                    triangles.push([at, number(ring - 1, inner + 1), number(ring, outer + 1)]);
                }
            }
        }
    }
    TriangleMesh { points, triangles, ..TriangleMesh::default() }
}

/// The cloth of a fabric as a flat mesh, with its warp at an angle from the first axis (degrees); unpinned.
pub(crate) fn cloth(fabric: &Fabric, degrees: f64, mesh: &TriangleMesh) -> Network {
    let none = SpringRules { stretch: SpringLaw { stiffness: 0.0, damping: 0.0 }, shear: None, bend: None };
    let mut network = Network::from_mesh(mesh, &none, 0.0);
    network.springs.clear();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(|corner| mesh.points[corner as usize]);
        let third = length(cross(minus(b, a), minus(c, a))) / 6.0;
        for corner in triangle {
            network.masses[*corner as usize] += third * fabric.density;
        }
    }

    let (sine, cosine) = degrees.to_radians().sin_cos();
    let Fabric { stretch: [warp, weft], shear, bending, damping, .. } = *fabric;
    let greatest = warp.max(weft).max(shear);
    let threads = Threads {
        warp: Warp::Along([cosine, 0.0, sine]),
        shares: [warp / greatest, weft / greatest, shear / greatest],
    };
    let of_threads = SpringLaw { stiffness: greatest, damping: 1e-3 * damping * greatest };
    let of_bending = SpringLaw { stiffness: bending, damping: damping * bending };
    network.elements = vec![
        ElementList::membrane(of_threads, threads, mesh).expect("a warp within the plane"),
        ElementList::new(ElementKind::Plate, of_bending, mesh),
    ];
    network
}

/// The disc of a fabric, cut with its warp at an angle from the first axis of its mesh (degrees), and held where it lies.
fn cut(fabric: &Fabric, degrees: f64, rings: usize) -> Network {
    let mut network = cloth(fabric, degrees, &disc(rings));
    for (i, x) in network.x.iter_mut().enumerate() {
        if length(*x) < SUPPORT * (1.0 + 1e-9) {
            network.pins.push(i as u32);
        } else {
            x[1] = 1e-4 * scatter(i);
        }
    }
    network
}

/// Lets a disc come to rest; its drape coefficient (%).
///
/// # Panics
/// When it does not.
fn drape(fabric: &Fabric, degrees: f64, rings: usize) -> f64 {
    let network = cut(fabric, degrees, rings);
    let triangles = network.triangles.clone();
    let mut scene = Scene::new(network, DT).by(Method::new(Integrator::ImplicitEuler, Hessian::Absolute));
    scene.settings.solver.preconditioner = PreconditionerKind::TwoLevel;
    scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 1000 };
    let mut simulation = scene.under([0.0, -9.81, 0.0]).simulate(Precision::F64);
    let mut steps = 0;
    loop {
        simulation.step(&mut NoStopwatch).unwrap_or_else(|error| panic!("{}: {error}", fabric.name));
        steps += 1;
        let v = velocities(&simulation);
        let speed = (v.iter().map(|v| length(*v).powi(2)).sum::<f64>() / v.len() as f64).sqrt();
        if steps >= STEPS[0] && speed < REST {
            break;
        }
        assert!(steps < STEPS[1], "{}: still {speed} m/s", fabric.name);
    }

    let x = positions(&simulation);
    let [inner, outer] = [SUPPORT, RADIUS].map(|radius| PI * radius * radius);
    let coefficient = 100.0 * (seen(&x, &triangles, 1.1 * RADIUS) - inner) / (outer - inner);
    let rim: Vec<f64> = x[x.len() - 6 * rings..].iter().map(|x| x[1]).collect();
    println!(
        "{} at {degrees} degrees, {rings} rings: {coefficient:.1} %, {} folds, {steps} steps",
        fabric.name,
        folds(&rim)
    );
    coefficient
}

/// The area (m²) that triangles cover, seen from above, within the square about the origin that reaches so far (m) along both axes.
pub(crate) fn seen(x: &[[f64; 3]], triangles: &[[u32; 3]], reach: f64) -> f64 {
    let side = (2.0 * reach / CELL) as usize;
    let at = |cell: usize| (cell as f64 + 0.5) * CELL - reach;
    let first = |place: f64| (((place + reach) / CELL - 0.5).ceil().max(0.0) as usize).min(side);
    let mut covered = vec![false; side * side];
    for triangle in triangles {
        let [a, b, c] = triangle.map(|corner| x[corner as usize]).map(|[x, _, z]| [x, z]);
        let turn = |p: [f64; 2], q: [f64; 2], at: [f64; 2]| {
            (q[0] - p[0]) * (at[1] - p[1]) - (q[1] - p[1]) * (at[0] - p[0])
        };
        let least = [0, 1].map(|axis| first(a[axis].min(b[axis]).min(c[axis])));
        let most = [0, 1].map(|axis| first(a[axis].max(b[axis]).max(c[axis])));
        for row in least[1]..most[1] {
            for column in least[0]..most[0] {
                let place = [at(column), at(row)];
                let turns = [turn(a, b, place), turn(b, c, place), turn(c, a, place)];
                let is_inside =
                    turns.iter().all(|turn| *turn >= 0.0) || turns.iter().all(|turn| *turn <= 0.0);
                covered[row * side + column] |= is_inside;
            }
        }
    }
    covered.iter().filter(|is_covered| **is_covered).count() as f64 * CELL * CELL
}

/// How often a rim rises by 2 mm and falls again, once around.
pub(crate) fn folds(rim: &[f64]) -> usize {
    const RISE: f64 = 2e-3;
    let lowest = (0..rim.len()).min_by(|i, j| rim[*i].total_cmp(&rim[*j])).unwrap_or_default();
    let (mut low, mut high, mut is_rising, mut count) = (f64::INFINITY, f64::NEG_INFINITY, false, 0);
    for step in 0..=rim.len() {
        let height = rim[(lowest + step) % rim.len()];
        if is_rising {
            high = high.max(height);
            if height < high - RISE {
                (is_rising, low, count) = (false, height, count + 1);
            }
        } else {
            low = low.min(height);
            if height > low + RISE {
                (is_rising, high) = (true, height);
            }
        }
    }
    count
}

/// A fabric in the band that is measured of its kind, whichever way it is cut, and with rings half as far apart.
fn drapes_as_measured(name: &str, [least, most]: [f64; 2]) {
    with_threads(0, || {
        let fabric = Fabric::from_name(name).expect("a preset");
        let found = drape(&fabric, 0.0, 30);
        assert!((least..=most).contains(&found), "{name}: {found} %");
        for (degrees, rings) in [(45.0, 30), (0.0, 60)] {
            let other = drape(&fabric, degrees, rings);
            let apart = (other - found).abs();
            assert!(apart < 2.0, "{name} at {degrees} degrees, {rings} rings: {other:?}, not {found:?}");
        }
    });
}

#[test]
fn silk_drapes_as_silk() {
    drapes_as_measured("silk", [20.0, 40.0]);
}

#[test]
fn cotton_drapes_as_cotton() {
    drapes_as_measured("cotton", [60.0, 76.0]);
}

#[test]
fn wool_drapes_as_wool() {
    drapes_as_measured("wool", [40.0, 70.0]);
}

#[test]
fn denim_drapes_as_denim() {
    drapes_as_measured("denim", [70.0, 90.0]);
}

#[test]
fn a_flat_disc_covers_what_it_is_and_folds_are_counted_once_around() {
    let mesh = disc(30);
    // A polygon of 180 corners.
    let expected = 90.0 * RADIUS * RADIUS * (TAU / 180.0).sin();
    let found = seen(&mesh.points, &mesh.triangles, 1.1 * RADIUS);
    assert!((found / expected - 1.0).abs() < 1e-3, "{found} m², of {expected} m²");
    assert_eq!((mesh.points.len(), mesh.triangles.len()), (1 + 3 * 30 * 31, 6 * 30 * 30));
    let waves = |count: f64| -> Vec<f64> {
        (0..180).map(|i| 0.01 * (count * TAU * f64::from(i) / 180.0).sin()).collect()
    };
    assert_eq!([1.0, 5.0, 8.0].map(|count| folds(&waves(count))), [1, 5, 8]);
}

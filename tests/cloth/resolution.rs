//! One garment on several meshes: a square sheet of a fabric, as a grid and in irregular triangles, with edges of 20, 10 and 5 mm,
//! rests in one shape on a round stand and where it hangs by two corners.
#![allow(clippy::print_stdout, reason = "figures beside the limits")]

use std::f64::consts::PI;

use nappe_scene::Fabric;
use nappe_sim::{
    cloth::{Hessian, Integrator, Network},
    linalg::{PreconditionerKind, Stop},
    math::{
        Precision,
        array::{cross, dot, length, minus},
    },
    mesh::TriangleMesh,
    report::NoStopwatch,
};
use nappe_tests::{
    Method, Scene,
    flat::irregular,
    meshes::to_triangle,
    scene::{positions, velocities},
    threads::with_threads,
};

use crate::drape::{cloth, folds, seen};

/// Side of the sheet (mm), and radius of the stand (m).
const SIDE: usize = 400;
const STAND: f64 = 0.09;
/// Time step (s), and steps at most.
const DT: f64 = 0.01;
const STEPS: u32 = 6000;
/// A sheet rests when the root mean square of its speeds (m/s) has been below this for so many steps: what swings is slow at its turning
/// points, too.
const REST: f64 = 1e-3;
const CALM: u32 = 50;
/// Drag over mass (1/s): a medium that slows the sheet alike on every mesh, so that it comes to rest without many swings.
const DRAG: f64 = 4.0;
/// Half the angle (rad) of the arc in which a sheet that hangs begins: sin a / a = 0.75, so that its two corners are 0.3 m apart.
const HALF_ARC: f64 = 1.275_698;

/// What its triangles are like.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    Grid,
    Irregular,
}

/// What holds it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Held {
    Stand,
    Corners,
}

impl Held {
    /// Where a point at (x, z) of the flat sheet about the origin begins (m). A smooth wave, the same on every mesh, says which of
    /// several rests is found.
    fn start(self, [x, z]: [f64; 2]) -> [f64; 3] {
        match self {
            Self::Stand => {
                let (out, angle) = ((x.hypot(z) - STAND).max(0.0) / STAND, z.atan2(x));
                let wave = 2e-3 * (4.0 * angle).cos() + 5e-4 * (7.0 * angle + 1.0).cos();
                [x, out * out * wave, z]
            }
            Self::Corners => {
                let (half, wave) = (0.5e-3 * SIDE as f64, 1e-3 * (9.0 * x + 5.0 * z).sin());
                let radius = half / HALF_ARC;
                let (sine, cosine) = (x / radius).sin_cos();
                [radius * sine, -half - z, radius * (cosine - HALF_ARC.cos()) + wave]
            }
        }
    }
}

/// A flat sheet about the origin whose edges are about so long (mm).
fn mesh(kind: Kind, edge: usize) -> TriangleMesh {
    let (cells, spacing, half) = (SIDE / edge, 1e-3 * edge as f64, 0.5e-3 * SIDE as f64);
    let mut mesh = match kind {
        Kind::Grid => TriangleMesh::grid(cells + 1, cells + 1, spacing),
        Kind::Irregular => irregular([cells; 2], spacing, 0),
    };
    for [x, _, z] in &mut mesh.points {
        (*x, *z) = (*x - half, *z - half);
    }
    mesh
}

/// A sheet that came to rest.
struct Rest {
    x: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    /// Cells along its side.
    cells: usize,
}

impl Rest {
    /// Lets a sheet come to rest.
    ///
    /// # Panics
    /// When it does not.
    fn of(fabric: &Fabric, held: Held, kind: Kind, edge: usize) -> Self {
        let network = begun(fabric, held, kind, edge);
        let triangles = network.triangles.clone();
        let mut scene = Scene::new(network, DT).by(Method::new(Integrator::ImplicitEuler, Hessian::Absolute));
        scene.settings.solver.preconditioner = PreconditionerKind::TwoLevel;
        scene.settings.solver.stop = Stop::Residual { tolerance: 1e-4, max_iterations: 1000 };
        let mut simulation = scene.under([0.0, -9.81, 0.0]).simulate(Precision::F64);

        let name = format!("{}, {held:?}, {kind:?} of {edge} mm", fabric.name);
        let (mut steps, mut calm) = (0, 0);
        while calm < CALM {
            simulation.step(&mut NoStopwatch).unwrap_or_else(|error| panic!("{name}: {error}"));
            steps += 1;
            let v = velocities(&simulation);
            let speed = (v.iter().map(|v| dot(*v, *v)).sum::<f64>() / v.len() as f64).sqrt();
            calm = if speed < REST { calm + 1 } else { 0 };
            assert!(steps < STEPS, "{name}: still {speed} m/s");
        }
        println!("{name}: at rest after {steps} steps");
        Self { x: positions(&simulation), triangles, cells: SIDE / edge }
    }

    /// Of what hangs over the stand, the share that is seen from above (%).
    fn coefficient(&self) -> f64 {
        let (stand, sheet) = (PI * STAND * STAND, 1e-6 * (SIDE * SIDE) as f64);
        // No point of the sheet is farther from its middle than a corner.
        let seen = seen(&self.x, &self.triangles, 0.75e-3 * SIDE as f64);
        100.0 * (seen - stand) / (sheet - stand)
    }

    /// Highest places of the rim, once around.
    fn folds(&self) -> usize {
        let (cells, side) = (self.cells, self.cells + 1);
        let top = 0..cells;
        let right = (0..cells).map(|step| step * side + cells);
        let bottom = (0..cells).map(|step| cells * side + cells - step);
        let left = (0..cells).map(|step| (cells - step) * side);
        let rim: Vec<f64> =
            top.chain(right).chain(bottom).chain(left).map(|point| self.x[point][1]).collect();
        folds(&rim)
    }

    fn pieces(&self) -> Vec<Piece> {
        let corners = |triangle: &[u32; 3]| triangle.map(|corner| self.x[corner as usize]);
        self.triangles.iter().map(|triangle| Piece::new(corners(triangle))).collect()
    }

    /// Mean over the area of this sheet of the distance (mm) to the nearest point of a coarser one.
    fn distance_to(&self, coarser: &Self) -> f64 {
        let (pieces, others) = (self.pieces(), coarser.pieces());
        let (mut sum, mut area) = (0.0, 0.0);
        for piece in &pieces {
            let nearest = others.iter().fold(f64::INFINITY, |nearest, other| {
                let is_near = length(minus(piece.middle, other.middle)) - other.radius < nearest;
                if is_near { nearest.min(to_triangle(piece.middle, other.corners)) } else { nearest }
            });
            sum += piece.area * nearest;
            area += piece.area;
        }
        1e3 * sum / area
    }
}

/// The sheet of a fabric as it begins. On the stand it is held where it lies, as in Cusick's test.
fn begun(fabric: &Fabric, held: Held, kind: Kind, edge: usize) -> Network {
    let mut network = cloth(fabric, 0.0, &mesh(kind, edge));
    network.drag = DRAG * network.masses.iter().sum::<f64>() / network.masses.len() as f64;
    network.pins = match held {
        Held::Stand => {
            let is_over = |point: &usize| length(network.x[*point]) < STAND * (1.0 + 1e-9);
            (0..network.x.len()).filter(is_over).map(|point| point as u32).collect()
        }
        Held::Corners => vec![0, (SIDE / edge) as u32],
    };
    for x in &mut network.x {
        *x = held.start([x[0], x[2]]);
    }
    network
}

/// A triangle within a ball.
struct Piece {
    corners: [[f64; 3]; 3],
    middle: [f64; 3],
    radius: f64,
    area: f64,
}

impl Piece {
    fn new(corners: [[f64; 3]; 3]) -> Self {
        let [a, b, c] = corners;
        let middle = [0, 1, 2].map(|axis| (a[axis] + b[axis] + c[axis]) / 3.0);
        let radius = corners.into_iter().map(|corner| length(minus(corner, middle))).fold(0.0, f64::max);
        Self { corners, middle, radius, area: 0.5 * length(cross(minus(b, a), minus(c, a))) }
    }
}

/// A fabric with edges of some lengths (mm), the longest first, both as grids and irregular: prints what it comes to, and judges it.
fn rests_alike(name: &str, held: Held, edges: &[usize]) {
    with_threads(0, || {
        let fabric = Fabric::from_name(name).expect("a preset");
        let rests = [Kind::Grid, Kind::Irregular].map(|kind| {
            let of_kind: Vec<Rest> = edges.iter().map(|edge| Rest::of(&fabric, held, kind, *edge)).collect();
            (kind, of_kind)
        });
        let mut complaints = Vec::new();
        for (kind, of_kind) in &rests {
            let of = format!("{name}, {held:?}, {kind:?}");
            let apart: Vec<f64> = of_kind.windows(2).map(|pair| pair[1].distance_to(&pair[0])).collect();
            println!("{of}, edges of {edges:?} mm: {apart:.2?} mm from each to the next");
            let last = apart[apart.len() - 1];
            if last > 3.0 {
                complaints.push(format!("{of}: the finest are {last:.2} mm apart, more than 3"));
            }
            if let [.., before, last] = apart[..]
                && last > 0.6 * before
            {
                complaints.push(format!("{of}: {before:.2}, then {last:.2} mm, more than 0.6 of it"));
            }
            if held == Held::Stand {
                complaints.extend(folds_alike(&of, of_kind));
            }
        }

        let [finest, other] = [0, 1].map(|kind| &rests[kind].1[edges.len() - 1]);
        let apart = other.distance_to(finest);
        println!("{name}, {held:?}: grid and irregular sheet are {apart:.2} mm apart");
        if apart > 3.0 {
            complaints.push(format!("{name}, {held:?}: grid and irregular sheet are {apart:.2} mm apart"));
        }
        assert!(complaints.is_empty(), "{complaints:#?}");
    });
}

/// What differs in area and folds between the two finest sheets on the stand.
fn folds_alike(of: &str, rests: &[Rest]) -> Vec<String> {
    let found: Vec<(f64, usize)> = rests.iter().map(|rest| (rest.coefficient(), rest.folds())).collect();
    println!("{of}: share that is seen (%), folds: {found:.1?}");
    let [.., (seen, folds), (finest_seen, finest_folds)] = found[..] else { panic!("two sheets or more") };
    let mut complaints = Vec::new();
    if (seen - finest_seen).abs() > 2.0 {
        complaints.push(format!("{of}: {seen:.1} and {finest_seen:.1} % are seen"));
    }
    if folds != finest_folds {
        complaints.push(format!("{of}: {folds} and {finest_folds} folds"));
    }
    complaints
}

#[test]
fn denim_lies_on_a_stand_alike_on_every_mesh() {
    rests_alike("denim", Held::Stand, &[20, 10, 5]);
}

#[test]
fn denim_hangs_by_two_corners_alike_on_every_mesh() {
    rests_alike("denim", Held::Corners, &[20, 10, 5]);
}

#[test]
fn wool_lies_on_a_stand_alike_on_every_mesh() {
    rests_alike("wool", Held::Stand, &[10, 5]);
}

#[test]
fn wool_hangs_by_two_corners_alike_on_every_mesh() {
    rests_alike("wool", Held::Corners, &[10, 5]);
}

#[test]
fn a_flat_sheet_is_as_far_from_another_as_it_is_lifted() {
    let flat = |kind: Kind, edge: usize, height: f64| {
        let TriangleMesh { points, triangles, .. } = mesh(kind, edge);
        let x = points.into_iter().map(|[x, _, z]| [x, height, z]).collect();
        Rest { x, triangles, cells: SIDE / edge }
    };
    let [coarse, fine] = [flat(Kind::Grid, 20, 0.0), flat(Kind::Irregular, 10, 0.007)];
    let apart = fine.distance_to(&coarse);
    assert!((apart - 7.0).abs() < 1e-9, "{apart} mm");
    assert_eq!(fine.folds(), 0);
    assert!((fine.coefficient() - 100.0).abs() < 0.1, "{} %", fine.coefficient());
}

#[test]
fn a_sheet_begins_in_the_same_shape_without_stretch_on_every_mesh() {
    // Along a row and down a column, in steps of a millimetre.
    for held in [Held::Stand, Held::Corners] {
        for way in [[1e-3, 0.0], [0.0, 1e-3]] {
            for step in 0..400 {
                let at = |step: i32| held.start([0, 1].map(|axis| f64::from(step - 200) * way[axis]));
                let long = 1e3 * length(minus(at(step + 1), at(step)));
                assert!((long - 1.0).abs() < 1e-2, "{held:?}: {long} at step {step} along {way:?}");
            }
        }
    }
    let [one, other] = [-0.2, 0.2].map(|x| Held::Corners.start([x, -0.2]));
    assert!((other[0] - one[0] - 0.3).abs() < 1e-6, "{one:?}, {other:?}");
}

#[test]
fn no_point_of_an_irregular_sheet_lies_within_the_circle_through_corners_of_a_triangle() {
    let mesh = irregular([12; 2], 1.0, 0);
    let at = |point: u32| [0, 2].map(|axis| mesh.points[point as usize][axis]);
    let mut area = 0.0;
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.map(at);
        let ([u, v], [s, t]) = ([b[0] - a[0], b[1] - a[1]], [c[0] - a[0], c[1] - a[1]]);
        let twice = u * t - v * s;
        assert!(twice > 0.0, "{triangle:?}");
        area += 0.5 * twice;

        let (first, second) = (u * u + v * v, s * s + t * t);
        let middle = [(t * first - v * second) / (2.0 * twice), (u * second - s * first) / (2.0 * twice)];
        let radius = middle[0].hypot(middle[1]);
        let away = |[x, y]: [f64; 2]| (x - a[0] - middle[0]).hypot(y - a[1] - middle[1]);
        let nearest =
            (0..mesh.points.len() as u32).map(|point| away(at(point))).fold(f64::INFINITY, f64::min);
        assert!(nearest > radius - 1e-6, "{triangle:?}: {nearest} within {radius}");
    }
    assert!((area - 144.0).abs() < 1e-9, "{area}");
}

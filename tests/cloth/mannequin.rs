//! A sheet that falls on a mannequin of thirty capsules: by formula, each a collider, and as one mesh of thirty closed parts that
//! overlap.

use nappe_sim::{
    cloth::{Hessian, Integrator},
    collide::{Collider, Shape, shape::Capsule},
    linalg::SolverSettings,
    math::Precision,
};
use nappe_tests::{
    Method, Scene,
    meshes::{Surface, capsule, capsule_facets},
    networks::{sheet, sheet_rules},
    scene::{advance, max_distance, norm, positions, velocities},
};

const GRAVITY: f64 = 9.81;
const MARGIN: f64 = 0.005;
const FRICTION: f64 = 0.5;
/// Strips around each capsule, and pieces of each from its straight part to either pole.
const FINE: [u32; 2] = [48, 12];
/// What rounding and pinching may add to a depth (m).
const SPARE: f64 = 1e-6;

/// Two ends (m), and a radius (m).
type Limb = ([[f64; 3]; 2], f64);

/// Limbs amid the body, which lies on its back along x.
const AMID: [Limb; 8] = [
    ([[0.0, 0.0, -0.09], [0.0, 0.0, 0.09]], 0.11),
    ([[0.13, 0.0, -0.08], [0.13, 0.0, 0.08]], 0.105),
    ([[0.28, 0.0, -0.11], [0.28, 0.0, 0.11]], 0.12),
    ([[0.4, 0.01, -0.15], [0.4, 0.01, 0.15]], 0.08),
    ([[0.0, -0.02, 0.0], [0.4, -0.02, 0.0]], 0.09),
    ([[0.45, 0.0, 0.0], [0.55, 0.0, 0.0]], 0.05),
    ([[0.6, 0.01, 0.0], [0.68, 0.01, 0.0]], 0.095),
    ([[0.58, 0.03, 0.0], [0.62, 0.05, 0.0]], 0.06),
];

/// Limbs on its left; each is on its right too.
const ASIDE: [Limb; 11] = [
    ([[0.42, 0.0, 0.02], [0.41, 0.0, 0.16]], 0.06),
    ([[0.4, 0.0, 0.17], [0.16, -0.02, 0.3]], 0.05),
    ([[0.16, -0.02, 0.3], [-0.06, -0.03, 0.36]], 0.04),
    ([[-0.06, -0.03, 0.36], [-0.14, -0.03, 0.37]], 0.035),
    ([[-0.08, -0.02, 0.35], [-0.13, -0.02, 0.32]], 0.015),
    ([[-0.14, -0.03, 0.37], [-0.22, -0.035, 0.375]], 0.02),
    ([[0.0, 0.0, 0.09], [-0.05, -0.01, 0.11]], 0.1),
    ([[-0.05, -0.01, 0.11], [-0.42, -0.02, 0.13]], 0.075),
    ([[-0.42, -0.02, 0.13], [-0.46, -0.02, 0.13]], 0.06),
    ([[-0.46, -0.02, 0.13], [-0.84, -0.04, 0.14]], 0.05),
    ([[-0.84, -0.04, 0.14], [-0.86, 0.08, 0.16]], 0.04),
];

/// The thirty capsules of both sides: those in the middle, and those aside with their mirror images.
fn limbs() -> Vec<Limb> {
    let right = ASIDE.map(|(ends, radius)| (ends.map(|[x, y, z]| [x, y, -z]), radius));
    [&AMID[..], &ASIDE, &right].concat()
}

/// Each limb a collider.
fn by_formula() -> Vec<Collider> {
    // A shape of no account: it is put in the place of each limb's own.
    let any = capsule([[0.0; 3], [1.0, 0.0, 0.0]], 0.1, [8, 2]).collider(FRICTION, MARGIN);
    let collider = |(number, ([start, end], radius)): (usize, Limb)| {
        let shape = Shape::Capsule(Capsule { start, end, radius });
        Collider { name: format!("limb {number}"), shape, ..any.clone() }
    };
    limbs().into_iter().enumerate().map(collider).collect()
}

/// All limbs as one mesh.
fn as_mesh() -> Collider {
    let limbs: Vec<Surface> = limbs().iter().map(|(ends, radius)| capsule(*ends, *radius, FINE)).collect();
    Surface::joined(&limbs).collider(FRICTION, MARGIN)
}

/// A sheet of so many particles along each side, so far apart (m), that falls for so many steps of 5 ms.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Fall {
    pub(crate) side: usize,
    pub(crate) spacing: f64,
    pub(crate) steps: u32,
}

/// What a sheet did.
struct Fallen {
    /// Where it is in the end (m).
    x: Vec<[f64; 3]>,
    /// The least distance (m) of a particle from the limbs by formula, over all steps.
    nearest: f64,
    /// Mean speed (m/s) in the end.
    speed: f64,
    /// Particles that touch in the last step, and how many went through a collider in all.
    touching: u64,
    passed: u64,
}

impl Fall {
    /// Lets it fall.
    fn on(self, colliders: Vec<Collider>) -> Fallen {
        let Self { side, spacing, steps } = self;
        let mut network = sheet(side, spacing, &sheet_rules(100.0, 0.05), 0.005);
        network.pins.clear();
        // What hangs down at its edges swings for a fraction of a second.
        network.drag = 0.02;
        let half = 0.5 * spacing * (side - 1) as f64;
        network.x.iter_mut().for_each(|x| *x = [x[0] - half + 0.15, 0.16, x[2] - half]);
        let method = Method::new(Integrator::ImplicitEuler, Hessian::Absolute);
        let mut scene = Scene::new(network, 5e-3).by(method).under([0.0, -GRAVITY, 0.0]);
        scene.settings.solver = SolverSettings::default();
        scene.colliders = colliders;

        let limbs = by_formula();
        let mut simulation = scene.simulate(Precision::F64);
        let (mut nearest, mut touching, mut passed) = (f64::INFINITY, 0, 0);
        for _ in 0..steps {
            let report = advance(&mut simulation, 1);
            touching = report.contact_count;
            passed += report.notices.passed_count;
            for x in positions(&simulation) {
                nearest = limbs.iter().map(|limb| limb.distance(x, 0.0).0).fold(nearest, f64::min);
            }
        }
        let speeds = velocities(&simulation).into_iter().map(norm);
        let speed = speeds.sum::<f64>() / (side * side) as f64;
        Fallen { x: positions(&simulation), nearest, speed, touching, passed }
    }

    /// Lets it fall on the mannequin by formula and on that of triangles; gives how far (m) particles are from each other in
    /// the end, at most, and how far the middles of both sheets.
    ///
    /// # Panics
    /// When it falls through one, does not come to rest, or lies otherwise on the mesh than facets explain.
    pub(crate) fn rests_on_a_mesh_as_on_capsules(self) -> [f64; 2] {
        let [expected, found] = [by_formula(), vec![as_mesh()]].map(|colliders| self.on(colliders));
        for (kind, Fallen { speed, touching, passed, .. }) in [("capsules", &expected), ("mesh", &found)] {
            assert_eq!(*passed, 0, "{self:?} on the {kind}: went through");
            assert!(*touching > 20, "{self:?} on the {kind}: {touching} contacts");
            assert!(*speed < 0.1, "{self:?} on the {kind}: {speed} m/s in the end");
        }

        let largest = limbs().iter().fold(0.0, |most: f64, (_, radius)| most.max(*radius));
        let facets = capsule_facets(largest, FINE);
        assert!((1e-4..1e-3).contains(&facets), "facets are {facets} m deep");
        let below = MARGIN - found.nearest;
        assert!(
            below < facets + SPARE,
            "a particle is {below:e} m below the margin, facets are {facets:e} m deep"
        );
        let off = (found.nearest - expected.nearest).abs();
        assert!(off < 1e-3, "deepest particles are {off:e} m apart in depth");

        let middle = |x: &[[f64; 3]]| {
            let sum = x.iter().fold([0.0; 3], |sum, x| [0, 1, 2].map(|c| sum[c] + x[c]));
            sum.map(|c| c / x.len() as f64)
        };
        [max_distance(&found.x, &expected.x), max_distance(&[middle(&found.x)], &[middle(&expected.x)])]
    }
}

//! Cases that a study of stability is made of: a scene's cloths at rest, damped, pressed together.

use nappe_sim::{cloth::Network, mesh::TriangleMesh};

use super::{row::Across, spectrum::largest_frequency};
use crate::case::{Case, direction, masses};

/// Speed (m/s) of the motion about rest.
const SPEED: f64 = 1e-4;
/// Where its directions come from.
const SEED: u64 = 42;

impl Case {
    /// Whether any particle can move.
    pub fn can_move(&self) -> bool {
        self.setup.bodies.iter().flat_map(|body| masses(&body.network)).any(|mass| mass > 0.0)
    }

    /// The same in steps of the world of another length (s).
    pub(super) fn with_dt(&self, dt: f64) -> Self {
        let mut case = self.clone();
        case.setup.dt = dt;
        case
    }

    /// The cloths as they lie, without gravity, wind, forces or colliders: springs are at rest, and each free particle moves at 1e-4 m/s,
    /// in a direction at random. Bending stays what it is: its rest is flat.
    pub(super) fn at_rest(&self) -> Self {
        let mut case = self.clone();
        let mut rng = fastrand::Rng::with_seed(SEED);
        (case.setup.gravity, case.setup.wind) = ([0.0; 3], [0.0; 3]);
        case.setup.wind_at.clear();
        case.setup.bodies.iter_mut().for_each(|body| body.forces.clear());
        case.setup.colliders.clear();
        case.changes.clear();
        for body in &mut case.setup.bodies {
            relax(&mut body.network);
            let masses = masses(&body.network);
            for (v, mass) in body.network.v.iter_mut().zip(masses) {
                *v = if mass > 0.0 { direction(&mut rng).map(|c| SPEED * c) } else { [0.0; 3] };
            }
        }
        case
    }

    /// The sum over springs of damping times elongation (m) times its rate (m/s), and over particles of drag times displacement
    /// times velocity (J): what damping adds to twice the energy in the measure of explicit Euler.
    pub(super) fn damped_virial(&self, x: &[f64], v: &[f64]) -> f64 {
        let mut sum = 0.0;
        let mut first = 0;
        for network in self.setup.bodies.iter().map(|body| &body.network) {
            let at = |values: &[f64], i: u32, c: usize| values[3 * (first + i as usize) + c];
            for spring in &network.springs {
                let [a, b] = spring.particles;
                let way: [f64; 3] = std::array::from_fn(|c| at(x, b, c) - at(x, a, c));
                let length = way.iter().map(|c| c * c).sum::<f64>().sqrt();
                let rate: f64 = (0..3).map(|c| way[c] * (at(v, b, c) - at(v, a, c))).sum::<f64>() / length;
                if length > 0.0 {
                    sum += spring.law.damping * (length - spring.rest_length) * rate;
                }
            }
            for (i, start) in network.x.iter().enumerate() {
                let i = i as u32;
                let product = |c: usize| (at(x, i, c) - start[c]) * at(v, i, c);
                sum += network.drag * (0..3).map(product).sum::<f64>();
            }
            first += network.x.len();
        }
        sum
    }

    /// The same with another damping, or start.
    pub(super) fn across(&self, across: Across, value: f64) -> Self {
        match across {
            Across::Damping | Across::DampingRatio => self.damped(across, value),
            Across::Compression => self.pressed(value),
        }
    }

    /// What a map over damping varies: a factor, or the ratio where nothing is damped.
    pub fn damping_axis(&self) -> Across {
        let networks = || self.setup.bodies.iter().map(|body| &body.network);
        let springs = networks().flat_map(|network| &network.springs).map(|spring| spring.law.damping);
        let elements = networks().flat_map(|network| &network.elements).map(|list| list.law.damping);
        if springs.chain(elements).any(|damping| damping > 0.0) {
            Across::Damping
        } else {
            Across::DampingRatio
        }
    }

    /// Whether anything is damped: springs, elements, or all particles by the medium.
    pub(super) fn is_damped(&self) -> bool {
        let is_dragged = || self.setup.bodies.iter().any(|body| body.network.drag != 0.0);
        self.damping_axis() == Across::Damping || is_dragged()
    }

    /// Whether anything elastic is there, of which a map over damping can be made.
    pub fn has_springs(&self) -> bool {
        let networks = || self.setup.bodies.iter().map(|body| &body.network);
        let elements = networks().flat_map(|network| &network.elements);
        let mut membranes = elements.filter(|list| list.threads().is_some());
        networks().flat_map(|network| &network.springs).any(|s| s.law.stiffness > 0.0)
            || membranes.any(|list| list.law.stiffness > 0.0)
    }

    fn damped(&self, across: Across, value: f64) -> Self {
        let mut case = self.clone();
        for body in &mut case.setup.bodies {
            let network = &mut body.network;
            if across == Across::DampingRatio {
                // Critical for the fastest mode: damping over stiffness is 2 / frequency.
                let frequency = largest_frequency(network);
                let time = if frequency > 0.0 { 2.0 * value / frequency } else { 0.0 };
                network.springs.iter_mut().for_each(|s| s.law.damping = time * s.law.stiffness);
            } else {
                network.springs.iter_mut().for_each(|s| s.law.damping *= value);
                network.elements.iter_mut().for_each(|list| list.law.damping *= value);
            }
        }
        case
    }

    fn pressed(&self, share: f64) -> Self {
        let mut case = self.clone();
        let extents = self.extents();
        let axis = (0..3).max_by(|a, b| extents[*a].total_cmp(&extents[*b])).unwrap_or(0);
        let low = self
            .setup
            .bodies
            .iter()
            .flat_map(|b| &b.network.x)
            .map(|x| x[axis])
            .fold(f64::INFINITY, f64::min);
        let middle = low + 0.5 * extents[axis];
        for x in case.setup.bodies.iter_mut().flat_map(|body| &mut body.network.x) {
            x[axis] = middle + (1.0 - share) * (x[axis] - middle);
        }
        case
    }
}

/// Takes the cloth as it lies for its rest, as far as its laws let it.
fn relax(network: &mut Network) {
    let x = &network.x;
    for spring in &mut network.springs {
        let [a, b] = spring.particles.map(|i| x[i as usize]);
        spring.rest_length = [0, 1, 2].map(|c| (a[c] - b[c]).powi(2)).iter().sum::<f64>().sqrt();
    }
    let mesh = TriangleMesh {
        points: network.x.clone(),
        triangles: network.triangles.clone(),
        uv: network.uv.clone(),
        ..TriangleMesh::default()
    };
    for list in &mut network.elements {
        *list = list.on(&mesh);
    }
}

#[cfg(test)]
mod tests {
    use nappe_sim::{
        cloth::{ClothSettings, ElementKind, ElementList, SpringLaw, SpringRules},
        math::Precision,
        world::{BodySetup, WorldSetup},
    };

    use super::*;
    use crate::{
        case::Times,
        method::{Method, Setting, Steps},
        run::{Budget, Runner},
    };

    /// A stretched sheet of 5 x 3 particles with bending, one of them pinned, under gravity.
    fn sheet(damping: f64) -> Case {
        let mesh = TriangleMesh::grid(5, 3, 0.1);
        let law = SpringLaw { stiffness: 50.0, damping };
        let rules = SpringRules { stretch: law, shear: Some(law), bend: None };
        let mut network = Network::from_lattice(&mesh, [5, 3], &rules, 0.01);
        network.elements = vec![ElementList::new(ElementKind::ALL[0], law, &mesh)];
        network.pins = vec![4];
        for [x, ..] in &mut network.x {
            *x *= 1.3;
        }
        let body = BodySetup {
            name: "sheet".to_owned(),
            network,
            settings: ClothSettings::default(),
            forces: Vec::new(),
        };
        let setup = WorldSetup {
            dt: 1e-3,
            gravity: [0.0, -9.8, 0.0],
            wind_at: Vec::new(),
            wind: [1.0, 0.0, 0.0],
            colliders: Vec::new(),
            bodies: vec![body],
            snow: None,
        };
        Case::new("sheet", setup, Vec::new(), Precision::F64).expect("a cloth")
    }

    #[test]
    fn at_rest_nothing_is_stretched_or_bent_and_what_is_free_moves_slowly() {
        let rest = sheet(0.1).at_rest();
        let method = Method::all()[0];
        let setting = Setting::new(method, Precision::F64, Steps::Divided(0));
        let budget = Budget::new(None);
        let runner =
            Runner::start(&rest, &setting, &Times::even(1e-6, 1), &budget.until(1.0)).expect("a start");
        assert!(runner.now.elastic_energy < 1e-20, "{} J", runner.now.elastic_energy);
        let expected = 0.5 * 14.0 * 0.01 * SPEED * SPEED;
        assert!((runner.now.kinetic_energy / expected - 1.0).abs() < 1e-12);
        assert_eq!(runner.velocities()[12..15], [0.0; 3]);
        assert_eq!((rest.setup.gravity, rest.setup.wind), ([0.0; 3], [0.0; 3]));
    }

    #[test]
    fn all_of_the_start_is_pressed_together_along_its_longest_side_pins_too() {
        let case = sheet(0.1);
        let pressed = case.across(Across::Compression, 0.25);
        let middle = 0.5 * 0.52;
        let [before, after] = [&case, &pressed].map(|case| case.setup.bodies[0].network.x.clone());
        for (a, b) in before.iter().zip(&after) {
            assert!((b[0] - middle - 0.75 * (a[0] - middle)).abs() < 1e-15);
            assert_eq!(a[1..], b[1..]);
        }
        let [full, short] = [case.extents()[0], pressed.extents()[0]];
        assert!((short / full - 0.75).abs() < 1e-12);
        assert_eq!(case.setup.bodies[0].network.springs, pressed.setup.bodies[0].network.springs);
    }

    #[test]
    fn damping_is_a_factor_of_everything_elastic_or_a_share_of_the_critical_one() {
        let case = sheet(0.1);
        assert_eq!(case.damping_axis(), Across::Damping);
        let network = &case.across(Across::Damping, 3.0).setup.bodies[0].network;
        let laws = network.springs.iter().map(|s| s.law).chain(network.elements.iter().map(|list| list.law));
        assert!(laws.into_iter().all(|law| (law.damping - 0.3).abs() < 1e-15 && law.stiffness == 50.0));

        let undamped = sheet(0.0);
        assert_eq!(undamped.damping_axis(), Across::DampingRatio);
        let critical = undamped.across(Across::DampingRatio, 1.0);
        let network = &critical.setup.bodies[0].network;
        // The damping ratio of a mode of frequency w is w / 2 times damping over stiffness.
        let frequency = largest_frequency(&undamped.setup.bodies[0].network);
        let law = network.springs[0].law;
        assert!((0.5 * frequency * law.damping / law.stiffness - 1.0).abs() < 1e-12);
    }
}

//! Networks that the gallery and the tests are made of: chains, sheets, and the course's rippled cloth by formula.

use nappe_sim::{
    cloth::{Network, Spring, SpringKind, SpringLaw, SpringRules},
    mesh::{TriangleMesh, grid_triangles},
};

/// A spring that stretches.
pub fn spring(particles: [u32; 2], rest_length: f64, stiffness: f64, damping: f64) -> Spring {
    Spring { particles, kind: SpringKind::Stretch, rest_length, law: SpringLaw { stiffness, damping } }
}

/// Particles at rest, unpinned, joined by nothing.
pub fn particles(x: &[[f64; 3]], mass: f64) -> Network {
    Network { x: x.to_vec(), v: vec![[0.0; 3]; x.len()], masses: vec![mass; x.len()], ..Network::default() }
}

/// Particles in a row, each joined to the next by the same spring; unpinned, at rest.
pub fn chain(x: &[[f64; 3]], rest_length: f64, stiffness: f64, damping: f64, mass: f64) -> Network {
    let mut network = particles(x, mass);
    let join = |i: u32| spring([i, i + 1], rest_length, stiffness, damping);
    network.springs = (0..x.len() as u32 - 1).map(join).collect();
    network
}

/// The rules of a sheet whose three kinds of springs differ.
pub fn sheet_rules(stiffness: f64, damping: f64) -> SpringRules {
    let law = |share: f64| SpringLaw { stiffness: stiffness * share, damping };
    SpringRules { stretch: law(1.0), shear: Some(law(0.5)), bend: Some(law(0.1)) }
}

/// A flat square sheet of `side` x `side` particles in the plane y = 0, its first row's corners pinned.
pub fn sheet(side: usize, spacing: f64, rules: &SpringRules, mass: f64) -> Network {
    let mesh = TriangleMesh::grid(side, side, spacing);
    let mut network = Network::from_lattice(&mesh, [side, side], rules, mass);
    network.pins = vec![0, side as u32 - 1];
    network
}

/// A square metre of cloth of 0.2 kg whose springs are those of a membrane of 10 kN/m, in waves that leave none at rest;
/// unpinned. The finer it is, the harder its step is to solve.
pub fn stiff_sheet(side: usize) -> Network {
    let spacing = 1.0 / (side - 1) as f64;
    let law = |length: f64| SpringLaw { stiffness: 1e4 * spacing / length, damping: 0.0 };
    let rules = SpringRules { stretch: law(1.0), shear: Some(law(2.0_f64.sqrt())), bend: Some(law(2.0)) };
    let mesh = TriangleMesh::grid(side, side, spacing);
    let mut network = Network::from_lattice(&mesh, [side, side], &rules, 0.2 / (side * side) as f64);
    for [x, y, z] in &mut network.x {
        *y = 0.02 * (7.0 * *x).sin() * (5.0 * *z).cos();
    }
    network
}

/// Which springs the course's cloth gets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum DrapSprings {
    /// Edges of the triangles, as in the course.
    Faces,
    /// Neighbours, both diagonals, and two apart.
    Full,
}

/// The course's cloth of `side` x `side` particles: a sheet with a ripple, two corners pinned,
/// 1 kg a particle and 15 000 N/m a spring, with this damping (N s/m).
pub fn drap(side: usize, springs: DrapSprings, damping: f64) -> Network {
    let point = |i: usize| {
        let (c, r) = ((i % side) as f64, (i / side) as f64);
        [six_digits(0.1 * c), six_digits(-0.1 * r), six_digits(0.1 * (-2.5 * c).sin())]
    };
    let mesh = TriangleMesh {
        points: (0..side * side).map(point).collect(),
        triangles: grid_triangles(side, side),
        ..TriangleMesh::default()
    };

    let law = SpringLaw { stiffness: 15_000.0, damping };
    let mut network = match springs {
        DrapSprings::Faces => {
            Network::from_mesh(&mesh, &SpringRules { stretch: law, shear: None, bend: None }, 1.0)
        }
        DrapSprings::Full => {
            let rules = SpringRules { stretch: law, shear: Some(law), bend: Some(law) };
            Network::from_lattice(&mesh, [side, side], &rules, 1.0)
        }
    };

    network.pins = vec![0, side as u32 - 1];
    network
}

/// Six significant digits, as the course's program printed its points.
fn six_digits(value: f64) -> f64 {
    format!("{value:.5e}").parse().expect("a number reads back")
}

/// A reproducible number in -1..1 for each index: the fractional parts of multiples of an
/// irrational number, which no grid resonates with.
pub fn scatter(index: usize) -> f64 {
    2.0 * ((index as f64 + 1.0) * 0.618_033_988_749_894_9).fract() - 1.0
}

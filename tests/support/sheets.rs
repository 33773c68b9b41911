//! Sheets anywhere in space, and several pieces of cloth in one network.

use nappe_sim::{
    cloth::{Network, Spring, SpringLaw, SpringRules},
    math::array::cross,
    mesh::{TriangleMesh, grid_triangles},
};

/// Springs of a cloth that folds well where particles are 1 to 2.5 cm apart.
pub fn soft_rules() -> SpringRules {
    let law = |stiffness, damping| SpringLaw { stiffness, damping };
    SpringRules { stretch: law(250.0, 0.03), shear: Some(law(60.0, 0.01)), bend: Some(law(6.0, 0.001)) }
}

/// A rectangular sheet, and where it lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheet {
    /// Particles in a row, and rows.
    pub size: [usize; 2],
    /// Distance between neighbours (m).
    pub spacing: f64,
    /// Where the first particle is (m).
    pub origin: [f64; 3],
    /// Unit vectors along a row, and from row to row.
    pub axes: [[f64; 3]; 2],
    /// Height (m) of a ripple across the columns, off the plane.
    pub ripple: f64,
    /// Mass per area (kg/m²).
    pub density: f64,
}

impl Sheet {
    /// A level square sheet of `side` x `side` particles about a place (m), turned by an angle (rad) about the vertical.
    pub fn level(side: usize, spacing: f64, middle: [f64; 3], turn: f64) -> Self {
        let (sin, cos) = turn.sin_cos();
        let axes = [[cos, 0.0, sin], [-sin, 0.0, cos]];
        let half = 0.5 * spacing * (side - 1) as f64;
        let origin = [0, 1, 2].map(|c| middle[c] - half * (axes[0][c] + axes[1][c]));
        Self { size: [side, side], spacing, origin, axes, ripple: 0.0, density: 0.25 }
    }

    /// An upright square sheet whose top row has its middle at the origin.
    pub fn upright(side: usize, spacing: f64) -> Self {
        let half = 0.5 * spacing * (side - 1) as f64;
        Self {
            size: [side, side],
            spacing,
            origin: [-half, 0.0, 0.0],
            axes: [[1.0, 0.0, 0.0], [0.0, -1.0, 0.0]],
            ripple: 0.0,
            density: 0.25,
        }
    }

    /// Its particles and springs, at rest as it lies; unpinned. Particles are numbered row by row.
    pub fn network(&self) -> Network {
        let [columns, rows] = self.size;
        let [along, down] = self.axes;
        let normal = cross(along, down);
        let point = |i: usize| {
            let (c, r) = ((i % columns) as f64, (i / columns) as f64);
            let up = self.ripple * (-2.5 * c).sin();
            [0, 1, 2].map(|k| self.origin[k] + self.spacing * (c * along[k] + r * down[k]) + up * normal[k])
        };

        let triangles = grid_triangles(columns, rows);
        let mut masses = vec![0.0; columns * rows];
        for corner in triangles.iter().flatten() {
            masses[*corner as usize] += self.density * self.spacing * self.spacing / 6.0;
        }
        let points = (0..columns * rows).map(point).collect();
        let mesh = TriangleMesh { points, triangles, masses, ..TriangleMesh::default() };
        Network::from_lattice(&mesh, self.size, &soft_rules(), 0.0)
    }
}

/// Several networks of springs as one, the particles of each after those of the one before.
pub fn together(parts: &[Network]) -> Network {
    let mut all = Network::default();
    for part in parts {
        assert!(part.elements.is_empty(), "pieces of springs alone");
        let first = all.x.len() as u32;
        all.x.extend(&part.x);
        all.v.extend(&part.v);
        all.masses.extend(&part.masses);
        all.pins.extend(part.pins.iter().map(|pin| first + pin));
        let moved = |spring: &Spring| Spring { particles: spring.particles.map(|p| first + p), ..*spring };
        all.springs.extend(part.springs.iter().map(moved));
        all.triangles.extend(part.triangles.iter().map(|triangle| triangle.map(|p| first + p)));
    }
    all
}

/// A closed band of `around` x `across` particles: `place(angle, along)` (m) is where one is, at an angle (rad) around the band
/// and so far (m) from its middle. Particles are numbered across the band, place by place.
pub fn band(
    [around, across]: [usize; 2],
    spacing: f64,
    place: impl Fn(f64, f64) -> [f64; 3],
    density: f64,
) -> Network {
    let mut mesh = TriangleMesh::default();
    for i in 0..around {
        let angle = std::f64::consts::TAU * i as f64 / around as f64;
        for j in 0..across {
            let along = spacing * (j as f64 - 0.5 * (across - 1) as f64);
            mesh.points.push(place(angle, along));
            if j + 1 < across {
                let at = |i: usize, j: usize| ((i % around) * across + j) as u32;
                let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
    }
    Network::from_mesh(&mesh, &soft_rules(), density * spacing * spacing)
}

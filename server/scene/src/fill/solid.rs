//! Solids that can be filled with particles: boxes, balls, the insides of closed meshes.

use super::inside::Inside;
use crate::{mesh::Closed, transform::RigidMotion};

/// A solid that is filled with particles.
#[derive(Clone, Debug)]
pub(crate) enum Solid {
    /// A box about the origin, then moved: its lattice turns with it.
    Box { half: [f64; 3], motion: RigidMotion },
    /// A ball about a centre (m).
    Ball { center: [f64; 3], radius: f64 },
    /// The inside of a mesh.
    Mesh { mesh: Closed, inside: Inside },
}

impl Solid {
    pub(crate) fn from_mesh(mesh: Closed) -> Self {
        let inside = Inside::new(&mesh);
        Self::Mesh { mesh, inside }
    }

    /// Volume (m³).
    pub(crate) fn volume(&self) -> f64 {
        match self {
            Self::Box { half, .. } => 8.0 * half[0] * half[1] * half[2],
            Self::Ball { radius, .. } => 4.0 / 3.0 * std::f64::consts::PI * radius * radius * radius,
            Self::Mesh { mesh, .. } => mesh.volume,
        }
    }

    /// Centre of mass (m).
    pub(crate) fn center(&self) -> [f64; 3] {
        match self {
            Self::Box { motion, .. } => motion.shift,
            Self::Ball { center, .. } => *center,
            Self::Mesh { mesh, .. } => mesh.center,
        }
    }

    /// Blocks of this side (m) that it meets, and those with the ones in front of them: nearly, for a box or a ball.
    pub(crate) fn blocks(&self, side: f64) -> [f64; 2] {
        match self {
            Self::Box { half, .. } => {
                [1.0, 2.0].map(|more| half.iter().map(|half| 2.0 * half / side + more).product())
            }
            Self::Ball { radius, .. } => [0.0, 0.5 * side].map(|more| {
                let radius = radius + more;
                let area = 4.0 * std::f64::consts::PI * radius * radius;
                met_blocks(area * radius / 3.0, area, side)
            }),
            // Its surface is not kept.
            Self::Mesh { mesh, .. } => [met_blocks(mesh.volume, 0.0, side); 2],
        }
    }

    /// Corners of the box around it (m), before a box is moved.
    pub(super) fn bounds(&self) -> [[f64; 3]; 2] {
        match self {
            Self::Box { half, .. } => [half.map(|c| -c), *half],
            Self::Ball { center, radius } => [center.map(|c| c - radius), center.map(|c| c + radius)],
            Self::Mesh { mesh, .. } => mesh.bounds(),
        }
    }

    /// Corners of the box around it (m), where it stands in the world.
    pub(crate) fn world_bounds(&self) -> [[f64; 3]; 2] {
        let Self::Box { half, motion } = self else { return self.bounds() };
        let reach = motion.rotation.map(|row| (0..3).map(|c| row[c].abs() * half[c]).sum::<f64>());
        [[0, 1, 2].map(|c| motion.shift[c] - reach[c]), [0, 1, 2].map(|c| motion.shift[c] + reach[c])]
    }

    /// Heights (m) between which it lies over a rectangle of the plane; none: nowhere.
    pub(super) fn heights(&self, from: [f64; 2], to: [f64; 2]) -> Option<[f64; 2]> {
        if let Self::Mesh { inside, .. } = self {
            return inside.heights(from, to);
        }
        let [low, high] = self.bounds();
        Some([low[2], high[2]])
    }

    /// Triangles that a test looks at on average; 1 for other solids.
    pub(super) fn cost(&self) -> f64 {
        match self {
            Self::Mesh { inside, .. } => 1.0 + inside.cost(),
            _ => 1.0,
        }
    }

    /// Whether a point (m) is inside, before a box is moved.
    pub(super) fn contains(&self, point: [f64; 3]) -> bool {
        match self {
            Self::Box { half, .. } => (0..3).all(|c| point[c].abs() <= half[c]),
            Self::Ball { center, radius } => {
                (0..3).map(|c| (point[c] - center[c]) * (point[c] - center[c])).sum::<f64>()
                    <= radius * radius
            }
            Self::Mesh { inside, .. } => inside.contains(point),
        }
    }

    /// Whether a point of the world (m) is inside.
    pub(crate) fn holds(&self, point: [f64; 3]) -> bool {
        match self {
            Self::Box { motion, .. } => self.contains(motion.undo(point)),
            _ => self.contains(point),
        }
    }

    /// Where a point of a filled solid stands in the world (m).
    pub(super) fn to_world(&self, point: [f64; 3]) -> [f64; 3] {
        match self {
            Self::Box { motion, .. } => motion.apply(point),
            _ => point,
        }
    }
}

/// Blocks of a side (m) that a body of so much volume (m³) and surface (m²) meets, in the mean over all places.
pub(crate) fn met_blocks(volume: f64, area: f64, side: f64) -> f64 {
    volume / (side * side * side) + 0.75 * area / (side * side) + 1.0
}

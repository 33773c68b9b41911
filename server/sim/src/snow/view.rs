//! What is looked at from outside: nodes of the grid.

/// A node of the grid, to be looked at.
#[derive(Clone, Copy, Debug, PartialEq, Default)]
pub struct GridNode {
    /// Index of the node: its place is cell * index (m).
    pub index: [i32; 3],
    /// Mass (kg).
    pub mass: f64,
    /// Velocity (m/s) after forces and colliders.
    pub velocity: [f64; 3],
}

/// Everything that a particle carries from step to step, in binary64.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ParticleState {
    /// Position (m).
    pub x: [f64; 3],
    /// Velocity (m/s).
    pub v: [f64; 3],
    /// Elastic deformation gradient F_E, by rows.
    pub elastic: [[f64; 3]; 3],
    /// Affine velocity C (1/s), by rows; for PIC/FLIP the velocity gradient of the last step.
    pub affine: [[f64; 3]; 3],
    /// Plastic volume ratio J_P.
    pub plastic_ratio: f64,
    /// Kirchhoff stress tau = P F^T (Pa): xx, yy, zz, xy, xz, yz. It follows from F_E and J_P; kept
    /// with them so that a run that goes on from here has the same bits. None: computed anew.
    pub stress: Option<[f64; 6]>,
}

//! What is told once of a body: its topology for those who draw frames, its bound on the time step.

/// What a body of a world is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum BodyRole {
    /// An object of snow.
    #[default]
    Snow,
    /// Cloth, which forces move.
    Cloth,
    /// A figure: frames lead it, and cloth meets it.
    Figure,
}

/// What a frame's consumer needs to know once about a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyTopology {
    /// Name, unique in the world.
    pub name: String,
    /// What it is.
    pub role: BodyRole,
    /// Index of its first particle among all.
    pub first_particle: u32,
    /// Number of its particles.
    pub particle_count: u32,
    /// Triangles, indices over all particles.
    pub triangles: Vec<[u32; 3]>,
    /// Springs, indices over all particles.
    pub springs: Vec<[u32; 2]>,
    /// Pinned particles, indices over all particles.
    pub pins: Vec<u32>,
    /// Texture coordinates, or empty.
    pub uv: Vec<[f64; 2]>,
    /// Mass of each particle (kg); of a pin what it would weigh, or 0.
    pub masses: Vec<f64>,
    /// Volume at rest of each particle of snow (m³); empty for cloth.
    pub volumes: Vec<f64>,
}

/// Largest explicit time step of a body, from a bound that holds for any mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct StepBound {
    /// Name of the body: of several that are stepped together, of the one that sets it.
    pub body: String,
    /// Largest stable dt (s) for small motions about the state as it is, a lower bound: of velocity Verlet where the body is
    /// stepped by it, of symplectic Euler otherwise. Infinite without springs.
    pub dt: f64,
    /// The particle that sets it, over all bodies.
    pub particle: u64,
}

//! What is read from a world: positions in the user's numbering, topology, hash, step bounds.

use nalgebra::SymmetricEigen;

use super::{Body, World};
use crate::{
    collide::Collider,
    math::{Mat3, Real, Vec3},
    snow::Snow,
};

/// What a frame's consumer needs to know once about a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodyTopology {
    /// Name.
    pub name: String,
    /// Index of its first particle among all.
    pub first_particle: u32,
    /// Number of particles.
    pub particle_count: u32,
    /// Triangles, indices over all particles.
    pub triangles: Vec<[u32; 3]>,
    /// Springs, indices over all particles.
    pub springs: Vec<[u32; 2]>,
    /// Pinned particles, indices over all particles.
    pub pins: Vec<u32>,
    /// Texture coordinates, or empty.
    pub uv: Vec<[f64; 2]>,
}

/// Largest explicit time step of a body, from a bound that holds for any mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct StepBound {
    /// Body.
    pub body: String,
    /// Largest stable dt (s) of the symplectic integrators for small motions about rest, a lower
    /// bound: sqrt(2 min m_i / lambda_max(D_i)), D_i = sum_j k_ij u u^T. Infinite without springs.
    pub dt: f64,
    /// The particle that sets it, over all bodies.
    pub particle: u64,
}

impl<R: Real> World<R> {
    /// Time step (s).
    pub fn dt(&self) -> f64 {
        self.dt
    }

    /// Steps taken.
    pub fn step_count(&self) -> u64 {
        self.step_count
    }

    /// Particles of all bodies.
    pub fn particle_count(&self) -> usize {
        self.cloth_count() + self.snow_particle_count()
    }

    /// Particles of snow: the last ones.
    pub fn snow_particle_count(&self) -> usize {
        self.snow.as_ref().map_or(0, Snow::particle_count)
    }

    /// Particles of all cloths: the snow's come after them.
    pub(super) fn cloth_count(&self) -> usize {
        self.bodies.iter().map(|body| body.model.count).sum()
    }

    /// The snow.
    pub fn snow(&self) -> Option<&Snow<R>> {
        self.snow.as_ref()
    }

    /// The snow, to be changed.
    pub fn snow_mut(&mut self) -> Option<&mut Snow<R>> {
        self.snow.as_mut()
    }

    /// Springs of all bodies.
    pub fn spring_count(&self) -> usize {
        self.bodies.iter().map(|body| body.model.spring_count).sum()
    }

    /// Colliders.
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    /// Positions (m), x y z a particle, in the user's numbering. Clears `out` first.
    pub fn positions<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        self.gather(out, &convert, |body| &body.state.x);
        self.snow.iter().for_each(|snow| snow.positions(out, &convert));
    }

    /// Velocities (m/s), x y z a particle, in the user's numbering. Clears `out` first.
    pub fn velocities<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        self.gather(out, &convert, |body| &body.state.v);
        self.snow.iter().for_each(|snow| snow.velocities(out, &convert));
    }

    /// Plastic volume ratios, one a particle; 1 for cloth. Clears `out` first.
    pub fn plastic_ratios<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        out.clear();
        out.resize(self.cloth_count(), convert(R::one()));
        self.snow.iter().for_each(|snow| snow.plastic_ratios(out, &convert));
    }

    /// Frobenius norms of the Cauchy stress (Pa), one a particle; 0 for cloth. Clears `out` first.
    pub fn stress_norms<T: Clone>(&self, out: &mut Vec<T>, convert: impl Fn(R) -> T) {
        out.clear();
        out.resize(self.cloth_count(), convert(R::zero()));
        self.snow.iter().for_each(|snow| snow.stress_norms(out, &convert));
    }

    fn gather<T>(
        &self,
        out: &mut Vec<T>,
        convert: impl Fn(R) -> T,
        field: impl Fn(&Body<R>) -> &Vec<Vec3<R>>,
    ) {
        out.clear();
        out.reserve(3 * self.particle_count());
        for body in &self.bodies {
            let values = field(body);
            for &place in &body.model.place {
                let v = &values[place as usize];
                out.extend([convert(v.x), convert(v.y), convert(v.z)]);
            }
        }
    }

    /// Hash (XXH3, 64 bits) of the steps taken and of the exact positions and velocities as
    /// little-endian binary64 in the user's numbering.
    pub fn state_hash(&self) -> u64 {
        let mut hasher = xxhash_rust::xxh3::Xxh3::new();
        hasher.update(&self.step_count.to_le_bytes());
        for body in &self.bodies {
            for &place in &body.model.place {
                let place = place as usize;
                let mut bytes = [0; 48];
                let numbers = body.state.x[place].iter().chain(&body.state.v[place]);
                for (bytes, number) in bytes.chunks_exact_mut(8).zip(numbers) {
                    bytes.copy_from_slice(&number.to_f64().to_le_bytes());
                }
                hasher.update(&bytes);
            }
        }
        self.snow.iter().for_each(|snow| snow.hash_into(&mut hasher));
        hasher.digest()
    }

    /// What frames refer to.
    pub fn topology(&self) -> Vec<BodyTopology> {
        let mut topology: Vec<_> = self.bodies.iter().map(Body::topology).collect();
        let mut first_particle = self.cloth_count() as u32;
        for (name, count) in self.snow.iter().flat_map(Snow::objects) {
            let particle_count = count as u32;
            topology.push(BodyTopology {
                name: name.to_owned(),
                first_particle,
                particle_count,
                ..BodyTopology::default()
            });
            first_particle += particle_count;
        }
        topology
    }

    /// Largest explicit steps, one a cloth; that of snow is in its report.
    pub fn step_bounds(&self) -> Vec<StepBound> {
        self.bodies.iter().map(Body::step_bound).collect()
    }
}

impl<R: Real> Body<R> {
    fn topology(&self) -> BodyTopology {
        let first = self.first_particle;
        let pinned = |(_, place): &(usize, &u32)| self.model.inv_m[**place as usize] == R::zero();
        BodyTopology {
            name: self.name.clone(),
            first_particle: first,
            particle_count: self.model.count as u32,
            triangles: self.triangles.iter().map(|t| t.map(|p| p + first)).collect(),
            springs: self.springs.iter().map(|s| s.map(|p| p + first)).collect(),
            pins: self
                .model
                .place
                .iter()
                .enumerate()
                .filter(pinned)
                .map(|(user, _)| user as u32 + first)
                .collect(),
            uv: self.uv.clone(),
        }
    }

    /// omega² <= 2 max lambda_max(D_i) / m_i, since (n.(a - b))² <= 2 (n.a)² + 2 (n.b)²; the
    /// bound on dt is 2 / omega, with the transverse stiffness of stretched springs included.
    fn step_bound(&self) -> StepBound {
        let (mut worst, mut particle) = (0.0, 0);
        for (user, &place) in self.model.place.iter().enumerate() {
            let i = place as usize;
            let omega2 = 2.0 * self.stiffness_at(i) * self.model.inv_m[i].to_f64();
            if omega2 > worst {
                (worst, particle) = (omega2, user as u64 + u64::from(self.first_particle));
            }
        }
        StepBound { body: self.name.clone(), dt: 2.0 / f64::sqrt(worst), particle }
    }

    /// Largest eigenvalue (N/m) of the diagonal block of the stiffness at particle `i`.
    fn stiffness_at(&self, i: usize) -> f64 {
        let mut block = Mat3::<f64>::zeros();
        for (j, rest_length, law) in self.model.rows.row(i) {
            let d = (self.state.x[i] - self.state.x[j as usize]).map(R::to_f64);
            let (length, stiffness) = (d.norm(), self.parameters.laws[law as usize].law.stiffness);
            if length > 0.0 {
                let across = (1.0 - rest_length.to_f64() / length).max(0.0);
                let along = d * d.transpose() / (length * length);
                block += (along * (1.0 - across) + Mat3::identity() * across) * stiffness;
            } else {
                block += Mat3::identity() * stiffness;
            }
        }
        SymmetricEigen::new(block).eigenvalues.max()
    }
}

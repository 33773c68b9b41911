//! An object of snow from its text and its solid: particles, masses, volumes, stiffness.
//!
//! Volume and mass are the solid's: each particle has the same share of the volume, and the masses
//! add up to density times volume whatever their noise.

use nappe_sim::{math::number, mesh::TriangleMesh, snow::SnowObject};

use super::material::material;
use crate::{
    error::{ErrorKind, SceneError},
    fill::{self, Arrangement, Count, Jitter, Noise, SharedByParts, Solid, Stream, TooMuch},
    location::Location,
    mesh::Closed,
    snow::{BoxText, Overlap, Sampling, SnowBody, SnowSource, VolumeFrom},
    transform::RigidMotion,
};

/// Particles in a cell of the grid, of an object that names no number.
const PARTICLES_PER_CELL: f64 = 8.0;
/// Part of a lattice's cell over which its particle may lie, of an object that names none.
const JITTER: f64 = 0.5;
/// Particles of an object in a cell of the grid, at most, as a mean over the cells of the box around it: a node adds up masses
/// in binary32, whose sum of so many may be off by a thousandth, and a step that loses more ends with `MASS_LOST`.
const MOST_PER_CELL: f64 = 16_777.0;
/// Share of the volume that particles of a lattice may fail to fill before it gives a warning.
const ODD_FILLING: f64 = 0.2;

/// An object that is ready to be filled.
pub(crate) struct Plan<'a> {
    text: &'a SnowBody,
    at: &'a Location<'a>,
    solid: Solid,
    arrangement: Arrangement,
    count: Count,
    /// What parts of its mesh share.
    shared: Option<SharedByParts>,
}

impl<'a> Plan<'a> {
    /// Checks an object's keys against each other. `mesh` is its mesh, as it was loaded, where it
    /// has one; `at` is where the object stands.
    pub(crate) fn new(
        text: &'a SnowBody,
        at: &'a Location<'a>,
        cell: f64,
        mesh: Option<&TriangleMesh>,
    ) -> Result<Self, SceneError> {
        let mut solid = solid(text, at, mesh)?;
        let arrangement = arrangement(text, at)?;
        let count = count(text, cell, at)?;
        let shared = fill::shared_by_parts(&solid);
        if let (Overlap::Drop, Some(shared)) = (text.overlap, &shared) {
            fill::count_once(&mut solid, shared);
        }
        Ok(Self { text, at, solid, arrangement, count, shared })
    }

    /// The object as it is written.
    pub(super) fn text(&self) -> &'a SnowBody {
        self.text
    }

    /// What is filled.
    pub(super) fn solid(&self) -> &Solid {
        &self.solid
    }

    /// What parts of its mesh share.
    pub(super) fn shared(&self) -> Option<&SharedByParts> {
        self.shared.as_ref()
    }

    /// Particles that it will have: exactly, or nearly where its lattice meets a curved surface.
    pub(crate) fn estimate(&self) -> u64 {
        fill::estimate(&self.solid, self.arrangement, self.count)
    }

    /// Checks how many particles lie in each cell of the grid, of side `cell` (m). Only a number of particles can be too large
    /// for its object.
    pub(super) fn check_crowding(&self, cell: f64) -> Result<(), SceneError> {
        let Some(count) = self.text.particles else { return Ok(()) };
        let [low, high] = self.solid.world_bounds();
        let cells: f64 =
            [0, 1, 2].map(|axis: usize| ((high[axis] - low[axis]) / cell).max(1.0)).iter().product();
        let per_cell = f64::from(count) / cells;
        if per_cell <= MOST_PER_CELL {
            return Ok(());
        }
        let message = format!(
            "is {count}, and a cell of the grid holds {per_cell:.0} of them; allowed: at most {MOST_PER_CELL} in a cell, \
             since a node adds up their masses in binary32: fewer particles, a larger object, or a smaller cell"
        );
        Err(self.at.key("particles").error(ErrorKind::OutOfRange, message))
    }

    /// Blocks of the grid, of this side (m), that it takes, and blocks of nodes.
    pub(crate) fn blocks(&self, side: f64) -> [f64; 2] {
        self.solid.blocks(side)
    }

    /// Makes the object; the strings are warnings.
    pub(crate) fn build(&self) -> Result<(SnowObject, Vec<String>), SceneError> {
        let (text, source) = (self.text, self.at.key(self.text.source_key()));
        let (density, material) = material(&text.material, &self.at.key("material"))?;

        let expected = self.estimate();
        let filled = fill::fill(&self.solid, self.arrangement, self.count, expected);
        let x = filled.map_err(|TooMuch| {
            let message = format!(
                "takes too long to fill with {expected} particles: most of the box around it is empty, or its triangles overlap"
            );
            source.error(ErrorKind::TooLarge, message)
        })?;

        if x.is_empty() {
            let message = "holds no particle: it is smaller than the distance between particles; allowed: a larger object, a smaller cell, or more particles";
            return Err(source.error(ErrorKind::OutOfRange, message));
        }

        let volume = self.solid.volume() / x.len() as f64;
        let noise =
            |stream, amplitude| Noise { seed: text.seed, stream, amplitude, length: text.noise_length };
        let object = SnowObject {
            name: text.name.clone(),
            v: velocities(text, &x, self.solid.center()),
            angular_velocity: text.angular_velocity,
            mass: masses(density * volume, &noise(Stream::Density, text.density_noise), &x),
            volume: match text.volume {
                VolumeFrom::Source => vec![volume; x.len()],
                VolumeFrom::Grid => Vec::new(),
            },
            stiffness: match text.stiffness_noise {
                0.0 => Vec::new(),
                amplitude => noise(Stream::Stiffness, amplitude).factors(&x),
            },
            material,
            attach: text.attach.clone(),
            x,
        };

        let warnings = self.odd_filling(expected, object.x.len()).into_iter().collect();
        Ok((object, warnings))
    }

    /// Surfaces that cross each other enclose another volume than the divergence theorem gives.
    fn odd_filling(&self, expected: u64, found: usize) -> Option<String> {
        let share = found as f64 / expected as f64;
        // What parts share is told by itself.
        let shared = match (self.text.overlap, &self.shared) {
            (Overlap::Keep, Some(shared)) => shared.volume / self.solid.volume(),
            _ => 0.0,
        };
        let odd = matches!(self.solid, Solid::Mesh { .. }) && (share - (1.0 - shared)).abs() > ODD_FILLING;
        (odd && expected > 1000).then(|| {
            format!(
                "its particles fill {:.0} % of the volume that its mesh encloses: does the mesh cross itself?",
                100.0 * share
            )
        })
    }
}

/// The solid of an object. `mesh` is its mesh, as it was loaded, where it has one; `at` is where the object stands.
pub(super) fn solid(
    text: &SnowBody,
    at: &Location<'_>,
    mesh: Option<&TriangleMesh>,
) -> Result<Solid, SceneError> {
    let scale = text.transform.scale;
    let motion = text.transform.motion(&at.key("transform"))?;
    match (&text.source, mesh) {
        (SnowSource::Box(text), _) => boxed(*text, scale, &motion, at),
        (&SnowSource::Sphere { center, radius }, _) => {
            Ok(Solid::Ball { center: motion.apply(center.map(|c| scale * c)), radius: scale * radius })
        }
        (SnowSource::Mesh(_), Some(mesh)) => meshed(mesh, scale, &motion, at),
        (SnowSource::Mesh(_), None) => Err(at.key("mesh").error(ErrorKind::MeshNotFound, "was not loaded")),
    }
}

fn boxed(text: BoxText, scale: f64, motion: &RigidMotion, at: &Location<'_>) -> Result<Solid, SceneError> {
    let (center, size) = match text {
        BoxText::Corners { min, max } => {
            if let Some(c) = (0..3).find(|c| max[*c] <= min[*c]) {
                let message = format!(
                    "is {} along {}, and min is {}: a box needs max above min along each axis",
                    number(max[c]),
                    ["x", "y", "z"][c],
                    number(min[c])
                );
                return at.key("box").key("max").inconsistent(message);
            }
            ([0, 1, 2].map(|c| 0.5 * (min[c] + max[c])), [0, 1, 2].map(|c| max[c] - min[c]))
        }
        BoxText::Centered { center, size } => (center, size),
    };

    let shift = motion.apply(center.map(|c| scale * c));
    Ok(Solid::Box { half: size.map(|s| 0.5 * scale * s), motion: RigidMotion { shift, ..*motion } })
}

fn meshed(
    mesh: &TriangleMesh,
    scale: f64,
    motion: &RigidMotion,
    at: &Location<'_>,
) -> Result<Solid, SceneError> {
    mesh.check().map_err(|error| at.key("mesh").error(ErrorKind::BadMesh, error.to_string()))?;
    let mut moved = mesh.clone();
    for point in &mut moved.points {
        *point = motion.apply(point.map(|c| scale * c));
    }
    let closed =
        Closed::new(&moved).map_err(|error| at.key("mesh").error(ErrorKind::BadMesh, error.to_string()))?;
    Ok(Solid::from_mesh(closed))
}

fn arrangement(text: &SnowBody, at: &Location<'_>) -> Result<Arrangement, SceneError> {
    match (text.sampling, text.jitter) {
        (Sampling::Jittered, jitter) => {
            Ok(Arrangement::Lattice(Jitter { amount: jitter.unwrap_or(JITTER), seed: text.seed }))
        }
        (Sampling::Lattice | Sampling::Poisson, Some(_)) => {
            at.key("jitter").inconsistent("works only with sampling = \"jittered\"")
        }
        (Sampling::Lattice, None) => Ok(Arrangement::Lattice(Jitter { amount: 0.0, seed: text.seed })),
        (Sampling::Poisson, None) => Ok(Arrangement::Poisson { seed: text.seed }),
    }
}

fn count(text: &SnowBody, cell: f64, at: &Location<'_>) -> Result<Count, SceneError> {
    match (text.particles, text.particles_per_cell) {
        (Some(_), Some(_)) => {
            at.key("particles").inconsistent("does not go with particles_per_cell: one of them is needed")
        }
        (Some(count), None) => Ok(Count::Exactly(u64::from(count))),
        (None, per_cell) => Ok(Count::Spacing(cell / libm::cbrt(per_cell.unwrap_or(PARTICLES_PER_CELL)))),
    }
}

/// Particles per volume (1/m³) of an object that names no number of them.
pub(crate) fn particles_per_volume(text: &SnowBody, cell: f64) -> f64 {
    text.particles_per_cell.unwrap_or(PARTICLES_PER_CELL) / (cell * cell * cell)
}

/// v + omega x (x - centre) for each particle (m/s).
fn velocities(text: &SnowBody, x: &[[f64; 3]], center: [f64; 3]) -> Vec<[f64; 3]> {
    let (v, w) = (text.velocity, text.angular_velocity);
    let velocity = |x: &[f64; 3]| {
        let r = [0, 1, 2].map(|c| x[c] - center[c]);
        [v[0] + w[1] * r[2] - w[2] * r[1], v[1] + w[2] * r[0] - w[0] * r[2], v[2] + w[0] * r[1] - w[1] * r[0]]
    };
    x.iter().map(velocity).collect()
}

/// Masses (kg) with noise, whose mean is `mean`.
fn masses(mean: f64, noise: &Noise, x: &[[f64; 3]]) -> Vec<f64> {
    if noise.amplitude == 0.0 {
        return vec![mean; x.len()];
    }
    let mut factors = noise.factors(x);
    let scale = mean * x.len() as f64 / factors.iter().sum::<f64>();
    for factor in &mut factors {
        *factor *= scale;
    }
    factors
}

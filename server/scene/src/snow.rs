//! Snow as it is written in a scene: how it is stepped, and its objects.
//!
//! Ranges, units and defaults stand in `keys`, against which a text is checked before serde sees it.

use nappe_sim::snow::{Kernel, Law, SnowSettings};
use serde::{Deserialize, Serialize};

use crate::{body::Mesh, names, transform::Transform};

/// Snow of a scene: all of it is on one grid.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Snow {
    /// Side of a cell of the grid (m).
    pub cell: f64,
    /// B-spline that spreads a particle over nodes; default: quadratic.
    #[serde(default, with = "names::kernel")]
    pub kernel: Kernel,
    /// How velocities go to the grid and back.
    #[serde(default)]
    pub transfer: TransferName,
    /// Share of FLIP in each step of the snow, 0 to 1; none: 0.95 with PIC/FLIP.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flip: Option<f64>,
    /// Time constant of FLIP (s), in place of `flip`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub flip_time: Option<f64>,
    /// Which velocity moves a particle of PIC/FLIP.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub advection: Option<AdvectionName>,
    /// Share of the certified bound that a step takes, above 0 and at most 1; none: 0.9.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub safety: Option<f64>,
    /// Length of the steps of the snow (s); none: as long as the bound allows.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substep: Option<f64>,
    /// Takes the fixed step whatever the bound says.
    #[serde(default)]
    pub unchecked: bool,
    /// Share of the step after which forces are taken, 0.5 to 1; 0: an explicit step.
    #[serde(default)]
    pub beta: f64,
    /// Linear solver of a semi-implicit step.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub solver: Option<SnowSolver>,
    /// The most steps of the snow within one step of the scene.
    #[serde(default = "max_substeps")]
    pub max_substeps: u32,
    /// Share of its density at rest below which a particle flies without stress; 0: none does.
    #[serde(default)]
    pub ballistic_below: f64,
    /// Largest kinetic plus elastic energy of all snow (J); none: no limit.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub max_energy: Option<f64>,
    /// Linear drag of the medium, for each kilogram (1/s); 0: none.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub drag: f64,
    /// What the snow is made of, at least one object.
    #[serde(rename = "object")]
    pub objects: Vec<SnowBody>,
}

impl Snow {
    /// Snow on cells of side `cell` (m), with the defaults of the format.
    pub fn new(cell: f64, objects: Vec<SnowBody>) -> Self {
        Self {
            cell,
            kernel: Kernel::default(),
            transfer: TransferName::default(),
            flip: None,
            flip_time: None,
            advection: None,
            safety: None,
            substep: None,
            unchecked: false,
            beta: 0.0,
            solver: None,
            max_substeps: max_substeps(),
            ballistic_below: 0.0,
            max_energy: None,
            drag: 0.0,
            objects,
        }
    }
}

/// How velocities go to the grid and back.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum TransferName {
    /// Velocities alone (Stomakhin et al. 2013).
    PicFlip,
    /// Affine velocities (Jiang et al. 2015).
    Apic,
    /// Affine velocities, and forces through the same affine field (Hu et al. 2018).
    #[default]
    Mls,
}

/// Which velocity moves a particle of PIC/FLIP.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum AdvectionName {
    /// The particle's own velocity.
    Particle,
    /// The velocity of the grid around it.
    Grid,
}

/// Linear solver of a semi-implicit step of snow.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct SnowSolver {
    /// The relative residual at which it stops; default: 1e-4.
    pub tolerance: f64,
    /// The most iterations that it makes; default: 500.
    pub max_iterations: u32,
}

impl Default for SnowSolver {
    fn default() -> Self {
        Self { tolerance: 1e-4, max_iterations: 500 }
    }
}

/// An object of snow.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnowBody {
    /// Name, unique among bodies and objects.
    pub name: String,
    /// What is filled with particles.
    #[serde(flatten)]
    pub source: SnowSource,
    /// Moves the source before it is filled.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub transform: Transform,
    /// Where particles go.
    #[serde(default)]
    pub sampling: Sampling,
    /// Part of a lattice's cell over which its particle may lie, 0 to 1; none: 0.5, with jittered sampling.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub jitter: Option<f64>,
    /// Particles per cell of the grid; none: 8, unless `particles` is given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particles_per_cell: Option<f64>,
    /// Exact number of particles of the object, in place of `particles_per_cell`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub particles: Option<u32>,
    /// Seed of the positions and of the noise.
    #[serde(default)]
    pub seed: u32,
    /// Velocity of the centre (m/s).
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub velocity: [f64; 3],
    /// Angular velocity about the centre (rad/s).
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub angular_velocity: [f64; 3],
    /// What it is made of.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub material: MaterialText,
    /// Relative amplitude of the noise on density, 0 to 0.95; 0: no noise.
    #[serde(default)]
    pub density_noise: f64,
    /// Relative amplitude of the noise on stiffness, 0 to 0.95; 0: no noise.
    #[serde(default)]
    pub stiffness_noise: f64,
    /// Distance over which noise changes (m); none: each particle has its own.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub noise_length: Option<f64>,
    /// Where the particles' volumes come from.
    #[serde(default)]
    pub volume: VolumeFrom,
    /// What becomes of space that it shares with earlier objects, or that parts of its mesh share.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub overlap: Overlap,
    /// Name of a sticky collider that its particles within half a cell are held to; none: they are not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub attach: Option<String>,
}

impl SnowBody {
    /// An object with the defaults of the format.
    pub fn new(name: impl Into<String>, source: SnowSource) -> Self {
        Self {
            name: name.into(),
            source,
            transform: Transform::default(),
            sampling: Sampling::default(),
            jitter: None,
            particles_per_cell: None,
            particles: None,
            seed: 0,
            velocity: [0.0; 3],
            angular_velocity: [0.0; 3],
            material: MaterialText::default(),
            density_noise: 0.0,
            stiffness_noise: 0.0,
            noise_length: None,
            volume: VolumeFrom::default(),
            overlap: Overlap::default(),
            attach: None,
        }
    }

    /// The key that names what is filled.
    pub(crate) fn source_key(&self) -> &'static str {
        match self.source {
            SnowSource::Box(_) => "box",
            SnowSource::Sphere { .. } => "sphere",
            SnowSource::Mesh(_) => "mesh",
        }
    }

    /// The mesh that it fills, if it fills one.
    pub(crate) fn mesh(&self) -> Option<&Mesh> {
        match &self.source {
            SnowSource::Mesh(mesh) => Some(mesh),
            SnowSource::Box(_) | SnowSource::Sphere { .. } => None,
        }
    }

    /// The same, to be changed.
    pub(crate) fn mesh_mut(&mut self) -> Option<&mut Mesh> {
        match &mut self.source {
            SnowSource::Mesh(mesh) => Some(mesh),
            SnowSource::Box(_) | SnowSource::Sphere { .. } => None,
        }
    }
}

/// What is filled with particles.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum SnowSource {
    /// A box along the axes, which the object's transform turns.
    Box(BoxText),
    /// A ball about a centre.
    Sphere {
        /// Centre (m).
        center: [f64; 3],
        /// Radius (m).
        radius: f64,
    },
    /// The inside of a closed mesh: a file or an upload.
    Mesh(Mesh),
}

/// A box along the axes.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum BoxText {
    /// Given by two opposite corners.
    Corners {
        /// Lower corner (m).
        min: [f64; 3],
        /// Upper corner (m).
        max: [f64; 3],
    },
    /// Given by its centre and its edges.
    Centered {
        /// Centre (m).
        center: [f64; 3],
        /// Edges (m).
        size: [f64; 3],
    },
}

/// Where particles of an object go.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Sampling {
    /// One at a random position in each cell of a lattice.
    #[default]
    Jittered,
    /// One in the middle of each cell of a lattice.
    Lattice,
    /// At random positions, none too near to another.
    Poisson,
}

impl Sampling {
    /// Names in scene files.
    pub const NAMES: [&str; 3] = ["jittered", "lattice", "poisson"];
}

/// Where volumes at rest come from.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum VolumeFrom {
    /// The volume of the source, the same share for each particle.
    #[default]
    Source,
    /// The density on the grid before the first step (Stomakhin et al. 2013, step 2).
    Grid,
}

impl VolumeFrom {
    /// Names in scene files.
    pub const NAMES: [&str; 2] = ["source", "grid"];
}

/// What becomes of space that an object shares with earlier ones, or that parts of its mesh share.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Overlap {
    /// It counts for each.
    #[default]
    Keep,
    /// It counts once: for the earlier object.
    Drop,
}

impl Overlap {
    /// Names in scene files.
    pub const NAMES: [&str; 2] = ["keep", "drop"];
}

/// A material: a preset, and what differs from it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MaterialText {
    /// Name of the preset.
    pub preset: String,
    /// Elastic law; here and below, none: as the preset has it.
    #[serde(skip_serializing_if = "Option::is_none", with = "names::maybe_law")]
    pub law: Option<Law>,
    /// Young's modulus (Pa).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub young: Option<f64>,
    /// Poisson's ratio, 0 to 0.49.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub poisson: Option<f64>,
    /// Density at rest (kg/m³).
    #[serde(skip_serializing_if = "Option::is_none")]
    pub density: Option<f64>,
    /// theta_c: compression at which it begins to yield.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub critical_compression: Option<f64>,
    /// theta_s: stretch at which it begins to yield.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub critical_stretch: Option<f64>,
    /// xi: stiffness grows as exp(xi (1 - J_P)) while the snow is packed.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub hardening: Option<f64>,
    /// Range in which the plastic volume ratio J_P is kept.
    #[serde(skip_serializing_if = "Option::is_none", alias = "jp_range")]
    pub plastic_ratio_range: Option<[f64; 2]>,
    /// Whether it yields; false: elastic.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub plastic: Option<bool>,
}

impl MaterialText {
    /// The preset of an object that names none.
    pub const PRESET: &str = "stomakhin";
}

impl Default for MaterialText {
    fn default() -> Self {
        Self {
            preset: Self::PRESET.to_owned(),
            law: None,
            young: None,
            poisson: None,
            density: None,
            critical_compression: None,
            critical_stretch: None,
            hardening: None,
            plastic_ratio_range: None,
            plastic: None,
        }
    }
}

fn max_substeps() -> u32 {
    SnowSettings::MAX_SUBSTEPS
}

//! A body as it is written in a scene: mesh, transform, masses, springs, pins, solver, limits.
//!
//! Ranges, units and defaults stand in `keys`, against which a text is checked before serde sees it.

use std::borrow::Cow;

use nappe_sim::cloth::{Air, ClothSettings, Hessian, Integrator, MinimizerKind, OnPass};
use serde::{Deserialize, Serialize};

use crate::{
    air,
    element_law::ElementLaw,
    fabric::FabricText,
    names,
    solver::{Limits, Solver},
    transform::Transform,
};

/// Particles joined by springs.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Body {
    /// Name, unique among bodies.
    pub name: String,
    /// Red, green and blue of sRGB, each 0 to 1, for viewers; none: they choose one.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub color: Option<[f64; 3]>,
    /// Where the particles are.
    pub mesh: Mesh,
    /// Moves the mesh before springs are made.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub transform: Transform,
    /// Velocity of free particles at the start (m/s).
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub velocity: [f64; 3],
    /// A fabric: its mass and its laws, in place of masses, springs and other laws.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub material: Option<FabricText>,
    /// Masses; none: those of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mass: Option<Mass>,
    /// Springs; none: the particles are free of each other.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub springs: Option<Springs>,
    /// Laws of elements of three to six particles, beside the springs.
    #[serde(default, rename = "law", skip_serializing_if = "names::is_default")]
    pub laws: Vec<ElementLaw>,
    /// Particles that do not move.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub pins: Vec<Pin>,
    /// Pins that move from the start.
    #[serde(default, rename = "moving_pin", skip_serializing_if = "names::is_default")]
    pub moving_pins: Vec<MovingPin>,
    /// Forces on its particles.
    #[serde(default, rename = "force", skip_serializing_if = "names::is_default")]
    pub forces: Vec<ForceText>,
    /// Linear drag of the medium on each particle (N s/m); 0: none.
    #[serde(default)]
    pub drag: f64,
    /// Distance (m) that its surface keeps from itself; 0: it passes through itself.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub thickness: f64,
    /// Air that acts on its triangles; none: it feels none.
    #[serde(default, with = "air", skip_serializing_if = "Option::is_none")]
    pub air: Option<Air>,
    /// How positions and velocities advance; default: implicit Euler.
    #[serde(default = "default_integrator", with = "names::integrator")]
    pub integrator: Integrator,
    /// How the minimisation is solved that an implicit step stands for.
    #[serde(default, with = "names::minimizer", skip_serializing_if = "names::is_default")]
    pub minimizer: MinimizerKind,
    /// How much of the energy that moves and is stretched a fall may lack of what a linear solve promised; none: its default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub accuracy: Option<f64>,
    /// Largest acceleration (m/s²) that Newton's method may leave over; none: its default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub newton_tolerance: Option<f64>,
    /// Cap on the linear solves of Newton's method in a sub-step; none: its default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub newton_iterations: Option<u32>,
    /// Sweeps of vertex block descent in a sub-step; none: its default.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sweeps: Option<u32>,
    /// What an implicit step does with the negative transverse stiffness of compressed springs.
    #[serde(default, with = "names::hessian")]
    pub hessian: Hessian,
    /// Sub-steps of one length within one step of the scene, 1 or more; none: as many as are needed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substeps: Option<u32>,
    /// Length of the sub-steps (s), in place of their number.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub substep: Option<f64>,
    /// Share of the certified bound that an explicit sub-step takes, above 0 and at most 1; none: 0.9.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub safety: Option<f64>,
    /// Takes the sub-steps whatever is known of them.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub unchecked: bool,
    /// Largest estimated error of a position that a sub-step may make (m); none: any.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tolerance: Option<f64>,
    /// What becomes of a sub-step in which particles go through a collider.
    #[serde(default, with = "names::on_pass", skip_serializing_if = "names::is_default")]
    pub on_pass: OnPass,
    /// Linear solver of an implicit step; explicit integrators have none.
    #[serde(default)]
    pub solver: Solver,
    /// When the state counts as diverged; default: no limits.
    #[serde(default, skip_serializing_if = "names::is_default")]
    pub limits: Limits,
    /// Particles per block, the unit of parallel work and of sums: a power of two, 32 to 4096.
    #[serde(alias = "grain", default = "default_block_size", serialize_with = "names::whole")]
    pub block_size: usize,
}

impl Body {
    /// A body with the defaults of the format.
    pub fn new(name: impl Into<String>, mesh: Mesh) -> Self {
        Self {
            name: name.into(),
            color: None,
            mesh,
            transform: Transform::default(),
            velocity: [0.0; 3],
            material: None,
            mass: None,
            springs: None,
            laws: Vec::new(),
            pins: Vec::new(),
            moving_pins: Vec::new(),
            forces: Vec::new(),
            drag: 0.0,
            thickness: 0.0,
            air: None,
            integrator: default_integrator(),
            minimizer: MinimizerKind::default(),
            accuracy: None,
            newton_tolerance: None,
            newton_iterations: None,
            sweeps: None,
            hessian: Hessian::default(),
            substeps: None,
            substep: None,
            safety: None,
            unchecked: false,
            tolerance: None,
            on_pass: OnPass::default(),
            solver: Solver::default(),
            limits: Limits::default(),
            block_size: default_block_size(),
        }
    }

    /// What its particles weigh: as it says, or as its fabric does.
    pub(crate) fn mass_of_all(&self) -> Option<Mass> {
        let fabric = self.material.as_ref().and_then(FabricText::fabric);
        fabric.map_or(self.mass, |fabric| Some(Mass::Density(fabric.density)))
    }

    /// The table of its springs, if it names one.
    pub(crate) fn springs_file(&self) -> Option<&str> {
        self.springs.as_ref()?.file.as_deref()
    }

    /// All its laws of elements: those that it names, and those of its fabric.
    pub(crate) fn laws_of_all(&self) -> Cow<'_, [ElementLaw]> {
        match &self.material {
            Some(material) => Cow::Owned(material.laws()),
            None => Cow::Borrowed(&self.laws),
        }
    }
}

/// Where the particles of a body are.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Mesh {
    /// A flat grid.
    Grid {
        /// Columns and rows.
        grid: [u32; 2],
        /// Distance between neighbours (m).
        spacing: f64,
        /// How it lies.
        #[serde(default)]
        plane: GridPlane,
        /// Height of the ripple across its columns (m); 0: flat.
        #[serde(default)]
        ripple: f64,
    },
    /// Particles in a row along x.
    Chain {
        /// How many particles there are.
        chain: u32,
        /// Distance between neighbours (m).
        spacing: f64,
    },
    /// The course's square grid.
    CourseGrid {
        /// Particles per side.
        course_grid: u32,
    },
    /// An uploaded mesh.
    Upload {
        /// The id that the server gave to it.
        upload: String,
        /// What is put in order before it is used.
        #[serde(flatten)]
        repair: MeshRepair,
    },
    /// A mesh file beside the scene.
    File {
        /// Its path, relative to the scene's folder.
        file: String,
        /// What is put in order before it is used.
        #[serde(flatten)]
        repair: MeshRepair,
    },
}

impl Mesh {
    /// The mesh in a file, as it is.
    pub fn file(path: impl Into<String>) -> Self {
        Self::File { file: path.into(), repair: MeshRepair::default() }
    }

    /// An uploaded mesh, as it is.
    pub fn upload(id: impl Into<String>) -> Self {
        Self::Upload { upload: id.into(), repair: MeshRepair::default() }
    }

    /// What is put in order in it; nothing in one by formula.
    pub(crate) fn repair(&self) -> MeshRepair {
        match self {
            Self::Upload { repair, .. } | Self::File { repair, .. } => *repair,
            Self::Grid { .. } | Self::Chain { .. } | Self::CourseGrid { .. } => MeshRepair::default(),
        }
    }
}

/// What is put in order in a mesh from outside before it is used; default: nothing.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct MeshRepair {
    /// What becomes of points that no triangle names.
    #[serde(skip_serializing_if = "names::is_default")]
    pub unused: Unused,
    /// Points that are nearer to each other than this become one (m, before the transform); 0: none do.
    #[serde(skip_serializing_if = "names::is_default")]
    pub weld: f64,
}

/// What becomes of points that no triangle names.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Unused {
    /// They are particles like all others.
    #[default]
    Keep,
    /// They are left out, and the others are numbered anew.
    Drop,
}

impl Unused {
    /// Names in scene files.
    pub const NAMES: [&str; 2] = ["keep", "drop"];
}

/// How a grid lies.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum GridPlane {
    /// In the plane y = 0; row r at z = r spacing.
    #[default]
    Horizontal,
    /// In the plane z = 0; row r at y = -r spacing.
    Upright,
}

impl GridPlane {
    /// Names in scene files.
    pub const NAMES: [&str; 2] = ["horizontal", "upright"];
}

/// Masses of a body's particles.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Mass {
    /// Of each particle (kg).
    Particle(f64),
    /// Of the body (kg), the same share for each particle.
    Total(f64),
    /// Per area (kg/m²).
    Density(f64),
}

/// Springs of a body.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Springs {
    /// A table of all springs, its path relative to the scene's folder, in place of the other keys.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub file: Option<String>,
    /// Between which particles; none: lattice for a grid, edges for other meshes.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub pattern: Option<Pattern>,
    /// Springs that resist change of length; none: the springs are those of the mesh.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub stretch: Option<SpringLaw>,
    /// Springs that resist change of angle; none: there are no such springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shear: Option<SpringLaw>,
    /// Springs that resist folding; none: there are no such springs.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub bend: Option<SpringLaw>,
}

/// Between which particles springs are.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Pattern {
    /// Along and across the edges of triangles.
    Edges,
    /// Along rows, columns and diagonals of a grid.
    Lattice,
    /// Where the mesh has springs of its own, which say what they are.
    File,
}

impl Pattern {
    /// Names in scene files.
    pub const NAMES: [&str; 3] = ["edges", "lattice", "file"];
}

/// Stiffness and damping of springs.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SpringLaw {
    /// Stiffness (N/m).
    pub stiffness: f64,
    /// Damping along the spring (N s/m).
    #[serde(default)]
    pub damping: f64,
}

/// A particle or a named row of particles.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(untagged)]
pub enum Pin {
    /// Its index within the body, from 0.
    Index(u32),
    /// A name: `top_left`, `top`, `first`.
    Name(String),
}

/// A pin that moves from the start.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MovingPin {
    /// The pin or row of pins that moves.
    pub pin: Pin,
    /// Where a single pin goes (m); in place of `offset`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub target: Option<[f64; 3]>,
    /// How far each pin goes (m); in place of `target`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub offset: Option<[f64; 3]>,
    /// How long it takes (s), rounded up to one step.
    pub duration: f64,
}

/// A force on particles for a time.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct ForceText {
    /// The particle or row of particles that it acts on, or `all`.
    pub on: Pin,
    /// The force on each of them (N).
    pub force: [f64; 3],
    /// When it begins (s).
    #[serde(default)]
    pub from: f64,
    /// When it ends (s); none: it does not.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub until: Option<f64>,
}

fn default_integrator() -> Integrator {
    ClothSettings::default().integrator
}

fn default_block_size() -> usize {
    ClothSettings::DEFAULT_BLOCK_SIZE
}

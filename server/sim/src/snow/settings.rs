//! How snow is stepped: kernel, transfer, time step, integration.

use serde::{Deserialize, Serialize};

use crate::{linalg::Stop, names::names, time_step::TimeStep};

/// B-spline that spreads a particle over nodes (Steffen, Kirby, Berzins 2008; docs/laws/snow.md).
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Kernel {
    /// Two nodes per axis, slope with jumps: forces jump when a particle crosses a cell, and the
    /// error grows under refinement. Here to show that, with PIC/FLIP only.
    Linear,
    /// Three nodes per axis, continuous slope.
    #[default]
    Quadratic,
    /// Four nodes per axis, continuous second derivative (Stomakhin et al. 2013).
    Cubic,
}

names!(Kernel { Linear: "linear", Quadratic: "quadratic", Cubic: "cubic" });

impl Kernel {
    /// Nodes that a particle reaches along each axis.
    pub const fn width(self) -> usize {
        match self {
            Self::Linear => 2,
            Self::Quadratic => 3,
            Self::Cubic => 4,
        }
    }

    /// h² / D, where D I is the second moment of the weights: 4 quadratic, 3 cubic. That of the
    /// linear kernel depends on the place: it has none.
    pub const fn inverse_moment(self) -> f64 {
        match self {
            Self::Linear => 0.0,
            Self::Quadratic => 4.0,
            Self::Cubic => 3.0,
        }
    }
}

/// How much of the FLIP velocity a particle keeps.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub enum Blend {
    /// The share of FLIP in every step, 0 to 1: 0.95 in Stomakhin et al. 2013. Halving dt doubles
    /// the damping per second.
    PerStep(f64),
    /// Time (s) within which the PIC share takes over: the share of FLIP is exp(-dt / tau), so
    /// that the damping per second does not depend on dt.
    TimeConstant(f64),
}

/// How velocities go from particles to nodes and back.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub enum Transfer {
    /// Velocities alone, blended from PIC and FLIP; forces by the slope of the kernel.
    PicFlip(Blend),
    /// Affine velocities (Jiang et al. 2015); forces by the slope of the kernel.
    Apic,
    /// Affine velocities, and forces through the same affine field (Hu et al. 2018).
    #[default]
    Mls,
}

impl Transfer {
    /// Names in scene files, in the order of the variants.
    pub const NAMES: [&str; 3] = ["pic_flip", "apic", "mls"];

    /// Its name in scene files.
    pub const fn name(self) -> &'static str {
        match self {
            Self::PicFlip(_) => Self::NAMES[0],
            Self::Apic => Self::NAMES[1],
            Self::Mls => Self::NAMES[2],
        }
    }
}

/// Whether forces are mixed with momenta on the nodes, or kept apart.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Forces {
    /// One tile per block, of momenta and impulses together.
    Fused,
    /// A tile of momenta and one of impulses: FLIP asks for velocities before forces.
    Apart,
}

impl Transfer {
    /// Whether C is an affine velocity; for PIC/FLIP it is the velocity gradient of the last step.
    pub(super) const fn is_affine(self) -> bool {
        !matches!(self, Self::PicFlip(_))
    }

    /// Where forces go on the grid.
    pub(super) const fn forces(self) -> Forces {
        if self.is_affine() { Forces::Fused } else { Forces::Apart }
    }

    /// Share of FLIP in a step of `dt` (s); 0 for affine transfers.
    pub(super) fn flip_share(self, dt: f64) -> f64 {
        match self {
            Self::PicFlip(Blend::PerStep(share)) => share,
            Self::PicFlip(Blend::TimeConstant(tau)) => libm::exp(-dt / tau),
            Self::Apic | Self::Mls => 0.0,
        }
    }
}

/// Which velocity moves a particle of PIC/FLIP; with affine transfers both are the same.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash, Default, Serialize, Deserialize)]
pub enum Advection {
    /// Its own (Stomakhin et al. 2013, step 10).
    #[default]
    Particle,
    /// That of the grid around it.
    Grid,
}

/// How grid velocities answer to forces.
#[derive(Clone, Copy, Debug, PartialEq, Default, Serialize, Deserialize)]
pub enum Integration {
    /// Symplectic Euler: forces at the start of the step.
    #[default]
    Explicit,
    /// (M + beta dt² H) v = M v* (Stomakhin et al. 2013, eq. 9; Brasseur 2014, eq. 2.7), by
    /// MINRES, matrix-free; the elastic bounds alone do not limit dt then.
    SemiImplicit {
        /// Forces are those after this share of the step, to first order. 0: explicit; 1: backward Euler;
        /// [`Integration::LEAST_BETA`] to 1 is allowed. Every one is of order 1.
        beta: f64,
        /// When the solve stops; one that stops above its tolerance fails the step.
        stop: Stop,
    },
}

impl Integration {
    /// The least beta above 0 whose steps no elastic wave bounds (docs/laws/snow.md).
    pub const LEAST_BETA: f64 = 0.5;

    /// Whether velocities are solved for.
    pub(crate) fn is_implicit(&self) -> bool {
        matches!(self, Self::SemiImplicit { beta, .. } if *beta > 0.0)
    }
}

/// How snow is stepped: one grid for all objects.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SnowSettings {
    /// Side of a cell, distance of nodes h (m).
    pub cell: f64,
    /// How wide a particle is spread over nodes.
    pub kernel: Kernel,
    /// How velocities and forces go between particles and nodes.
    pub transfer: Transfer,
    /// Which velocity moves particles of PIC/FLIP.
    pub advection: Advection,
    /// How long a step of the snow is.
    pub time_step: TimeStep,
    /// Whether velocities are solved for.
    pub integration: Integration,
    /// Steps of the snow in one step of the world, at most: a run that needs more stops.
    pub max_substeps: u32,
    /// Particles whose density on the grid is below this share of their own are ballistic: no
    /// stress, and a deformation that stays. They then do not limit dt by the bound of a lone
    /// particle. 0: none.
    pub ballistic_below: f64,
    /// Period of the grid along each axis, in blocks of four cells; 0: not periodic. Positions are
    /// not wrapped.
    pub periodic: [u32; 3],
    /// Largest kinetic plus elastic energy (J): a step that ends with more fails. None: no limit.
    pub max_energy: Option<f64>,
    /// Drag of the medium (1/s): a node of mass m feels -drag m (v - wind), by the velocity at the end of a step. 0: none.
    pub drag: f64,
}

impl SnowSettings {
    /// Defaults on cells of side `cell` (m).
    pub fn new(cell: f64) -> Self {
        Self {
            cell,
            kernel: Kernel::default(),
            transfer: Transfer::default(),
            advection: Advection::default(),
            time_step: TimeStep::default(),
            integration: Integration::default(),
            max_substeps: Self::MAX_SUBSTEPS,
            ballistic_below: 0.0,
            periodic: [0; 3],
            max_energy: None,
            drag: 0.0,
        }
    }

    /// Says why a kernel and a transfer do not go together.
    pub(super) fn invalid_combination(&self) -> Option<String> {
        let linear = self.kernel == Kernel::Linear;
        if linear && !matches!(self.transfer, Transfer::PicFlip(_)) {
            return Some(
                "the linear kernel goes with pic_flip alone: its second moment is not constant".into(),
            );
        }
        if linear && matches!(self.integration, Integration::SemiImplicit { .. }) {
            return Some("the linear kernel goes with explicit integration alone".into());
        }
        None
    }

    /// The largest drag (1/s) that is taken.
    pub const MOST_DRAG: f64 = 1e9;

    /// The cap on sub-steps of a scene that names none.
    pub const MAX_SUBSTEPS: u32 = 10_000;
}

//! Transfers as types: what each gathers and scatters is known when its kernel is compiled.

/// A transfer.
pub(crate) trait Scheme: Copy + Send + Sync {
    /// Particles carry an affine velocity.
    const AFFINE: bool;
    /// Forces and velocity gradients by the slope of the kernel.
    const SLOPES: bool;
    /// Velocities before forces are needed: forces are kept apart.
    const APART: bool;
}

/// Affine velocities; forces through the same affine field (Hu et al. 2018).
#[derive(Clone, Copy)]
pub(crate) struct MlsScheme;

/// Affine velocities; forces by slopes (Jiang et al. 2015).
#[derive(Clone, Copy)]
pub(crate) struct ApicScheme;

/// Velocities alone; forces by slopes (Stomakhin et al. 2013).
#[derive(Clone, Copy)]
pub(crate) struct FlipScheme;

impl Scheme for MlsScheme {
    const AFFINE: bool = true;
    const SLOPES: bool = false;
    const APART: bool = false;
}

impl Scheme for ApicScheme {
    const AFFINE: bool = true;
    const SLOPES: bool = true;
    const APART: bool = false;
}

impl Scheme for FlipScheme {
    const AFFINE: bool = false;
    const SLOPES: bool = true;
    const APART: bool = true;
}

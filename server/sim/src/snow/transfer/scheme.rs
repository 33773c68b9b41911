//! Transfers as types: what each gathers and scatters is known when its kernel is compiled.

/// What a transfer carries, known when its kernels are compiled.
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

/// The same expression for the transfer and kernel of the settings.
macro_rules! with_scheme {
    ($settings:expr, ($scheme:ident, $width:ident) => $body:expr) => {{
        use $crate::snow::{
            settings::{Kernel, Transfer},
            transfer::scheme::{ApicScheme, FlipScheme, MlsScheme},
        };
        macro_rules! of {
            ($s:ty, $n:literal) => {{
                type $scheme = $s;
                const $width: usize = $n;
                $body
            }};
        }
        match ($settings.transfer, $settings.kernel) {
            (Transfer::PicFlip(_), Kernel::Linear) => of!(FlipScheme, 2),
            (Transfer::PicFlip(_), Kernel::Quadratic) => of!(FlipScheme, 3),
            (Transfer::PicFlip(_), Kernel::Cubic) => of!(FlipScheme, 4),
            (Transfer::Apic, Kernel::Cubic) => of!(ApicScheme, 4),
            (Transfer::Apic, _) => of!(ApicScheme, 3),
            (Transfer::Mls, Kernel::Cubic) => of!(MlsScheme, 4),
            (Transfer::Mls, _) => of!(MlsScheme, 3),
        }
    }};
}
pub(crate) use with_scheme;

//! Instructions that kernels are timed with: those of other machines too, where this one has them.

use clap::ValueEnum;
use nappe_sim::math::{SimdLevel, force_simd_level};

use crate::words::error::{CliError, Result};

/// Instructions of vectors on x86-64.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub(crate) enum Isa {
    /// 256 bits, as most desktops have them.
    Avx2,
    /// 512 bits.
    Avx512,
}

/// Times with these instructions from now on. Results have the same bits.
///
/// # Errors
/// When this build or this processor lacks them.
pub(crate) fn use_from_now_on(isa: Isa) -> Result<()> {
    let level = match isa {
        Isa::Avx2 => SimdLevel::Avx2,
        Isa::Avx512 => SimdLevel::Avx512,
    };
    if SimdLevel::ALL.contains(&level) && force_simd_level(level) == level {
        return Ok(());
    }
    Err(CliError::failure(
        format!("--isa {isa:?}: this processor, or this build, lacks these instructions").to_lowercase(),
    ))
}

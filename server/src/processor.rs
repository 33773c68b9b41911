//! Whether this processor has the instructions that steps are compiled for: programs ask at their start.

use std::env;

use nappe_sim::math;

pub use nappe_sim::math::MissingInstructions;

/// Hides AVX2 from a program of x86-64, so that a test sees what it says without.
const HIDE: &str = "NAPPE_HIDE_AVX2";

/// Looks whether steps can be computed on this processor.
///
/// # Errors
/// When they cannot: the message says what is missing.
pub fn check_processor() -> Result<(), MissingInstructions> {
    if cfg!(target_arch = "x86_64") && env::var_os(HIDE).is_some() {
        return Err(MissingInstructions);
    }
    math::check_processor()
}

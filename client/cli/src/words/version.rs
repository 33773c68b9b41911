//! What `nappe --version` says: the version, the commit that it is built from, and the processor level.

use std::sync::LazyLock;

use nappe_sim::math::{SimdLevel, simd_level};

/// The version as people read it: `0.1.0 (commit 099c90b1a2b3, avx512 of this processor)`.
pub(crate) fn text() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let [version, commit] = [env!("CARGO_PKG_VERSION"), env!("NAPPE_COMMIT")];
        format!("{version} (commit {commit}, {})", level())
    });
    &TEXT
}

/// The processor level, in words.
fn level() -> &'static str {
    // A processor without kernels has no level.
    if nappe_server::check_processor().is_err() {
        return "no avx2 in this processor";
    }
    match simd_level() {
        SimdLevel::Portable => "portable instructions",
        SimdLevel::Avx2 => "avx2 of this processor",
        SimdLevel::Avx512 => "avx512 of this processor",
    }
}

//! Every width of vector instructions gives the same bits.

use nappe_sim::math::{Precision, SimdLevel, force_simd_level, simd_level};

use crate::scenes::{NAMES, methods, run};

#[test]
fn every_width_of_vector_instructions_gives_the_same_bits() {
    let best = simd_level();
    for name in NAMES {
        for method in methods(name) {
            for precision in Precision::ALL {
                let hashes = SimdLevel::ALL.iter().map(|level| {
                    let used = force_simd_level(*level);
                    (used, run(name, method, precision).state_hash())
                });
                let hashes: Vec<_> = hashes.collect();
                let same = hashes.iter().all(|(_, hash)| *hash == hashes[0].1);
                assert!(same, "{name} by {} in {precision}: {hashes:016x?}", method.name());
            }
        }
    }

    force_simd_level(best);
}

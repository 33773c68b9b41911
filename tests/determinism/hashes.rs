//! One hash per scene, method and precision, for 1, 2, 3 and 8 threads.

use std::{collections::BTreeMap, env, fmt::Write, fs};

use nappe_sim::{BITS, math::Precision};
use nappe_tests::{
    Method, golden,
    threads::{THREAD_COUNTS, with_threads},
};
use xxhash_rust::xxh3::xxh3_64;

use crate::{
    scenes::{NAMES, STEPS, methods, run},
    snow::SnowRun,
};

const FILE: &str = "hashes.txt";

/// The file with the number of the bits, seen from the folder of golden data.
const BITS_FILE: &str = "../../server/sim/src/bits.rs";

const HEADER: &str = "\
# State hashes: scene, method, precision, steps, hash. The same for any number of threads, in debug
# and in release, on any processor. Rewritten by `cargo xtask bless hashes`.
";

/// `scene method precision steps` of every run.
pub(crate) fn runs() -> Vec<(String, &'static str, Method, Precision)> {
    let mut runs = Vec::new();
    for name in NAMES {
        for method in methods(name) {
            for precision in Precision::ALL {
                let key = format!("{name} {} {precision} {STEPS}", method.name());
                runs.push((key, name, method, precision));
            }
        }
    }

    runs
}

fn hash(name: &str, method: Method, precision: Precision, threads: usize) -> u64 {
    with_threads(threads, || run(name, method, precision).state_hash())
}

/// The committed hashes by key.
pub(crate) fn committed() -> BTreeMap<String, u64> {
    let text = fs::read_to_string(golden::path(FILE)).expect("tests/golden/hashes.txt is there");
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let entry = |line: &str| {
        let (key, hash) = line.rsplit_once(' ').expect("a hash at the end of a line");
        (key.to_owned(), u64::from_str_radix(hash, 16).expect("a hexadecimal hash"))
    };

    lines.map(entry).collect()
}

/// Whether tests write what they compare.
fn is_blessing() -> bool {
    env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1")
}

#[test]
fn every_run_has_the_same_hash_for_any_number_of_threads() {
    for (key, name, method, precision) in runs() {
        let hashes = THREAD_COUNTS.map(|threads| hash(name, method, precision, threads));
        assert!(hashes.iter().all(|h| *h == hashes[0]), "{key}: {hashes:016x?} on {THREAD_COUNTS:?} threads");
    }
}

#[test]
fn every_run_has_its_committed_hash() {
    let mut found: Vec<_> = runs().into_iter().map(|(key, n, m, p)| (key, hash(n, m, p, 2))).collect();
    found.extend(SnowRun::all().into_iter().map(|run| (run.key(), run.hash(2))));
    if is_blessing() {
        let mut text = HEADER.to_owned();
        for (key, hash) in &found {
            writeln!(text, "{key} {hash:016x}").expect("a string takes text");
        }

        fs::write(golden::path(FILE), text).expect("tests/golden/hashes.txt can be written");
    }

    let committed = committed();
    let different: Vec<_> = found
        .iter()
        .filter(|(key, hash)| committed.get(key) != Some(hash))
        .map(|(key, hash)| format!("{key} {hash:016x}"))
        .collect();
    assert!(different.is_empty(), "not as committed:\n{}", different.join("\n"));
    assert_eq!(committed.len(), found.len(), "hashes of runs that are no more");
}

#[test]
fn the_number_of_the_bits_is_the_hash_of_the_committed_hashes() {
    let hash = xxh3_64(&fs::read(golden::path(FILE)).expect("tests/golden/hashes.txt is there"));
    if !is_blessing() {
        assert_eq!(format!("{BITS:016x}"), format!("{hash:016x}"), "`cargo xtask bless hashes` writes it");
        return;
    }
    let path = golden::path(BITS_FILE);
    let text = fs::read_to_string(&path).expect("server/sim/src/bits.rs is there");
    let (before, _) = text.split_once("= 0x").expect("a number in hexadecimal");
    let digits = format!("{hash:016x}");
    let parts: Vec<&str> = (0..4).map(|part| &digits[4 * part..4 * part + 4]).collect();
    fs::write(path, format!("{before}= 0x{};\n", parts.join("_"))).expect("it can be written");
}

#[test]
fn runs_that_differ_have_different_hashes() {
    let committed = committed();
    let mut hashes: Vec<_> = committed.values().collect();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), committed.len());
}

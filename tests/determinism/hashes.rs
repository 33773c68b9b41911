//! One hash per scene, method and precision, for 1, 2, 3 and 8 threads.

use std::{collections::BTreeMap, env, fmt::Write, fs};

use nappe_sim::{math::Precision, world::Simulation};
use nappe_tests::{
    Method, golden,
    scene::{positions, velocities},
    threads::{THREAD_COUNTS, with_threads},
};
use xxhash_rust::xxh3::Xxh3;

use crate::{
    scenes::{NAMES, STEPS, run},
    snow::SnowRun,
};

const FILE: &str = "hashes.txt";

const HEADER: &str = "\
# State hashes: scene, method, precision, steps, hash. The same for any number of threads, in debug
# and in release, on any processor. Rewritten by `cargo xtask bless hashes`.
";

/// `scene method precision steps` of every run.
fn runs() -> Vec<(String, &'static str, Method, Precision)> {
    let mut runs = Vec::new();
    for name in NAMES {
        for method in Method::all() {
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
fn committed() -> BTreeMap<String, u64> {
    parse(&fs::read_to_string(golden::path(FILE)).expect("tests/golden/hashes.txt is there"))
}

fn parse(text: &str) -> BTreeMap<String, u64> {
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    let entry = |line: &str| {
        let (key, hash) = line.rsplit_once(' ').expect("a hash at the end of a line");
        (key.to_owned(), u64::from_str_radix(hash, 16).expect("a hexadecimal hash"))
    };

    lines.map(entry).collect()
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
    if env::var_os("NAPPE_BLESS").is_some_and(|value| value == "1") {
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

/// The definition before: step, then positions, velocities and the rest, particle by particle in the user's order.
fn hash_before(simulation: &Simulation) -> u64 {
    let snow = simulation.snow_particles();
    let mut hasher = Xxh3::new();
    hasher.update(&simulation.step_count().to_le_bytes());
    let mut add = |numbers: &[f64]| numbers.iter().for_each(|number| hasher.update(&number.to_le_bytes()));
    let cloth = positions(simulation).len() - snow.len();
    for (x, v) in positions(simulation).iter().zip(velocities(simulation)).take(cloth) {
        add(x);
        add(&v);
    }
    for p in snow {
        add(&p.x);
        add(&p.v);
        add(&[p.elastic, p.affine].concat().concat());
        add(&[p.plastic_ratio]);
    }
    hasher.digest()
}

#[test]
fn every_run_has_the_hash_that_it_had_by_the_definition_before() {
    let text = fs::read_to_string(golden::path("hashes_before.txt")).expect("the file is there");
    let mut found = BTreeMap::new();
    for (key, name, method, precision) in runs() {
        found.insert(key, hash_before(&run(name, method, precision)));
    }
    for run in SnowRun::all() {
        found.insert(run.key(), hash_before(&run.run()));
    }
    let before = parse(&text);
    assert_eq!(found, before);
}

#[test]
fn runs_that_differ_have_different_hashes() {
    let committed = committed();
    let mut hashes: Vec<_> = committed.values().collect();
    hashes.sort_unstable();
    hashes.dedup();
    assert_eq!(hashes.len(), committed.len());
}

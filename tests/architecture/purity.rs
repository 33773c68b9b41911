//! What is deliberately absent from the numerics, and where `unsafe` may stand.

use std::collections::BTreeSet;

use crate::{
    assert_none, tokens,
    tree::{self, Source},
};

/// The numerics' sources.
const SIM: &str = "server/sim/src/";

/// Paths that the numerics may not name: results must not depend on the moment or the machine.
const BANNED_PATHS: [&str; 7] =
    ["std::time", "std::env", "std::fs", "std::io", "std::net", "std::process", "std::thread"];

/// Words that the numerics may not use: waiting, locks, globals, printing.
const BANNED_WORDS: [&str; 13] = [
    "async",
    "await",
    "static",
    "thread_local",
    "Mutex",
    "RwLock",
    "OnceLock",
    "LazyLock",
    "println",
    "eprintln",
    "print",
    "eprint",
    "dbg",
];

/// Exceptions in the numerics: file, word, why.
const PURITY_EXCEPTIONS: [(&str, &str, &str); 5] = [
    (
        "server/sim/src/math/simd/mod.rs",
        "static",
        "remembers which instructions the processor has; results have the same bits for any",
    ),
    (
        "server/sim/src/interrupt.rs",
        "static",
        "which request a build obeys; a build that ends is the same for any",
    ),
    ("server/sim/src/interrupt.rs", "thread_local", "the same"),
    (
        "server/sim/src/cloth/layout/scratch.rs",
        "Mutex",
        "scratch memory of which each thread takes one that is free: nobody waits, and no result depends on it",
    ),
    (
        "server/sim/src/parallel/spare.rs",
        "Mutex",
        "what one call leaves for the next: it is held while that is taken or put back",
    ),
];

/// The one file of the numerics that names the library of threads.
const PARALLEL_LOOP: &str = "server/sim/src/parallel/each.rs";

/// Files, and folders of files, that may hold `unsafe`, and why.
const UNSAFE: [(&str, &str); 15] = [
    ("server/sim/src/math/real.rs", "declares the gather that the SIMD kernels define"),
    ("server/sim/src/math/simd/", "the SIMD kernels: instructions found at run time"),
    ("server/sim/src/cloth/layout/rows.rs", "gathers whose indices were checked when the rows were built"),
    ("server/sim/src/cloth/layout/lists.rs", "the same of elements and triangles"),
    ("server/sim/src/cloth/evaluate/evaluation.rs", "slots and frozen elements of blocks, which do not meet"),
    ("server/sim/src/cloth/evaluate/freeze.rs", "slots of blocks, likewise"),
    ("server/sim/src/linalg/dot.rs", "reads 3-vectors as the numbers that they are"),
    ("server/sim/src/parallel/disjoint.rs", "a field written by several threads, each place by one of them"),
    ("server/sim/src/parallel/each.rs", "gives each block its part of a field: ranges of blocks do not meet"),
    (
        "server/sim/src/snow/particles/layout.rs",
        "reads and writes particles through the sorted order, which names each once",
    ),
    (
        "server/sim/src/snow/grid/migration.rs",
        "positions of a block in the sorted order do not meet those of others",
    ),
    ("server/sim/src/snow/particles/in_order.rs", "writes each particle to the place of its number"),
    ("server/src/trim.rs", "a function of the C library that gives free memory back"),
    ("tests/allocation/counting.rs", "a counting allocator"),
    ("tests/hostile/main.rs", "a counting allocator"),
];

fn against_purity(source: &Source) -> Vec<String> {
    let excepted = |word: &str| {
        PURITY_EXCEPTIONS.iter().any(|(file, excepted, _)| *file == source.path && *excepted == word)
    };
    let names = |path: &String, banned: &str| path == banned || path.starts_with(&format!("{banned}::"));
    let mut found: BTreeSet<&str> = BTreeSet::new();
    for path in tokens::paths(tokens::parse(source)) {
        found.extend(BANNED_PATHS.iter().filter(|banned| names(&path, banned)));
    }
    for word in tokens::words(tokens::parse(source)) {
        found.extend(BANNED_WORDS.iter().filter(|banned| **banned == word && !excepted(&word)));
    }
    found.iter().map(|banned| format!("{}: {banned} does not belong to the numerics", source.path)).collect()
}

fn against_another_loop(source: &Source) -> Option<String> {
    let names_rayon = tokens::words(tokens::parse(source)).iter().any(|word| word == "rayon");
    (names_rayon && source.path != PARALLEL_LOOP).then(|| {
        format!("{}: names rayon; use `Own::each`, or add what is missing to {PARALLEL_LOOP}", source.path)
    })
}

fn holds_unsafe(source: &Source) -> bool {
    tokens::words(tokens::parse(source)).iter().any(|word| word == "unsafe")
}

/// Whether `place` is the file itself, or its folder.
fn is_at(source: &Source, place: &str) -> bool {
    source.path == place || (place.ends_with('/') && source.path.starts_with(place))
}

fn against_unsafe(source: &Source) -> Option<String> {
    let allowed = UNSAFE.iter().any(|(file, _)| is_at(source, file));
    (holds_unsafe(source) && !allowed).then(|| format!("{}: holds unsafe code", source.path))
}

#[test]
fn the_numerics_read_no_clock_no_environment_and_keep_no_global() {
    let sources = tree::sources(|path| path.starts_with(SIM) && tree::has_extension(path, "rs"));
    assert!(sources.len() > 10, "{SIM} has files");
    assert_none(&sources.iter().flat_map(against_purity).collect::<Vec<_>>());
}

#[test]
fn one_file_of_the_numerics_names_the_library_of_threads() {
    let sources = tree::sources(|path| path.starts_with(SIM) && tree::has_extension(path, "rs"));
    assert!(sources.iter().any(|source| source.path == PARALLEL_LOOP), "{PARALLEL_LOOP} is a file");
    assert_none(&sources.iter().filter_map(against_another_loop).collect::<Vec<_>>());
}

#[test]
fn unsafe_code_stands_only_where_it_is_expected() {
    let sources = tree::rust_sources();
    assert_none(&sources.iter().filter_map(against_unsafe).collect::<Vec<_>>());
    for (file, why) in UNSAFE {
        let needed = sources.iter().any(|source| is_at(source, file) && holds_unsafe(source));
        assert!(needed, "{file} holds no unsafe code (any more): take it off the list ({why})");
    }
}

#[test]
fn the_rules_find_what_they_are_for() {
    let clock = Source::example("server/sim/src/x.rs", "use std::{fmt, time::Instant}; static N: u8 = 0;");
    assert_eq!(against_purity(&clock).len(), 2);
    let fine =
        Source::example("server/sim/src/x.rs", "/// println!\nfn f(x: &'static str) -> std::fmt::Result {}");
    assert_none(&against_purity(&fine));
    let excepted =
        Source::example("server/sim/src/math/simd/mod.rs", "static LEVEL: u8 = 0; async fn f() {}");
    assert_eq!(against_purity(&excepted).len(), 1);
    let chain = "use rayon::prelude::*; fn f(x: &mut [u8]) { x.par_iter_mut().for_each(g); }";
    assert!(against_another_loop(&Source::example("server/sim/src/x.rs", chain)).is_some());
    assert!(against_another_loop(&Source::example(PARALLEL_LOOP, chain)).is_none());
    assert!(against_another_loop(&Source::example("server/sim/src/x.rs", "/// rayon\nfn f() {}")).is_none());
    assert!(against_unsafe(&Source::example("client/src/x.rs", "fn f() { unsafe { g() } }")).is_some());
    assert!(against_unsafe(&Source::example("client/src/x.rs", "// unsafe\nfn unsafely() {}")).is_none());
}

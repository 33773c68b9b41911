//! Scenes of many seeds against each law. A seed that breaks one is made smaller, and printed as a scene that `nappe run` takes.
//!
//! `cargo xtask prove laws` sets what is asked: `NAPPE_LAWS_FIRST`, `NAPPE_LAWS_SEEDS`, `NAPPE_LAWS_MINUTES`, `NAPPE_LAWS_LAW`; or the file of
//! a scene, `NAPPE_LAWS_SCENE`.

use std::{
    env,
    path::{Path, PathBuf},
    sync::{
        Mutex,
        atomic::{AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use nappe_tests::at_random::{Case, of_seed, smallest};

use crate::{
    books, boost, going_on, halves,
    law::{Law, Verdict},
    order, smooth, stranger, turn, units,
};

/// Every law, those that say most first.
const LAWS: [Law; 9] = [
    boost::LAW,
    stranger::LAW,
    books::LAW,
    units::LAW,
    turn::LAW,
    order::LAW,
    going_on::LAW,
    smooth::LAW,
    halves::LAW,
];

/// Seeds that break a law that is known to be broken: a test fails once one of them begins to hold.
const KNOWN: [(&str, u64); 1] = [("halves", 258)];

/// Seeds where nobody asks for more.
const SEEDS: u64 = 300;

fn number(name: &str) -> Option<u64> {
    env::var(name)
        .ok()
        .map(|text| text.parse().unwrap_or_else(|_| panic!("{name} is '{text}': a number is needed")))
}

/// What is wrong with a seed, law by law; and whether its scene was refused.
fn ask(seed: u64, only: Option<&str>) -> (Vec<String>, bool) {
    let case = of_seed(seed);
    let mut broken = Vec::new();
    if let Err(refused) = case.world().and_then(|world| world.begin()) {
        if env::var_os("NAPPE_LAWS_REFUSED").is_some() {
            eprintln!("seed {seed} is refused: {refused}");
        }
        return (broken, true);
    }
    for law in LAWS.iter().filter(|law| only.is_none_or(|only| only == law.name)) {
        if KNOWN.contains(&(law.name, seed)) {
            continue;
        }
        match law.ask(&case) {
            // The world that a law makes of it may be refused, as a surface that a train makes too fast.
            Err(_) | Ok(Verdict::Holds | Verdict::Silent) => {}
            Ok(Verdict::Broken(why)) => broken.push(describe(law, seed, &why)),
        }
    }
    (broken, false)
}

/// What broke a law, with the smallest scene that does.
fn describe(law: &Law, seed: u64, why: &str) -> String {
    let breaks = |case: &Case| matches!(law.ask(case), Ok(Verdict::Broken(_)));
    let is_short = env::var_os("NAPPE_LAWS_SHORT").is_some();
    let least = if is_short { of_seed(seed) } else { smallest(&of_seed(seed), breaks) };
    let Ok(Verdict::Broken(of_least)) = law.ask(&least) else { return format!("{} {seed}: {why}", law.name) };
    let target = env::var_os("CARGO_TARGET_DIR").map_or_else(|| PathBuf::from("../target"), PathBuf::from);
    let folder = target.join("laws").join(format!("{}-{seed}", law.name));
    let place =
        least.write(&folder).map_or_else(|error| error.to_string(), |path| path.display().to_string());
    let text = if is_short { String::new() } else { least.scene.to_toml() };
    format!(
        "seed {seed} breaks the law '{name}': {why}\nthe smallest scene that does: {of_least}\n{text}({place}; again: cargo xtask prove laws --law {name} --seed {seed})",
        name = law.name
    )
}

/// What laws say of the scene of a file.
fn ask_file(path: &Path, only: Option<&str>) {
    let case = Case::of_file(path).unwrap_or_else(|refused| panic!("{}: {refused}", path.display()));
    for law in LAWS.iter().filter(|law| only.is_none_or(|only| only == law.name)) {
        println!("{}: {:?}", law.name, law.ask(&case));
    }
}

#[test]
fn scenes_at_random_keep_every_law() {
    if let Some(path) = env::var_os("NAPPE_LAWS_SCENE") {
        ask_file(Path::new(&path), env::var("NAPPE_LAWS_LAW").ok().as_deref());
        return;
    }
    let (first, count) =
        (number("NAPPE_LAWS_FIRST").unwrap_or(0), number("NAPPE_LAWS_SEEDS").unwrap_or(SEEDS));
    let time = number("NAPPE_LAWS_MINUTES").map(|minutes| Duration::from_secs(60 * minutes));
    let only = env::var("NAPPE_LAWS_LAW").ok();
    let (next, start) = (AtomicU64::new(first), Instant::now());
    let found = Mutex::new((Vec::new(), 0_u64, 0_u64));
    thread::scope(|scope| {
        for _ in 0..thread::available_parallelism().map_or(1, usize::from) {
            scope.spawn(|| {
                while time.is_none_or(|time| start.elapsed() < time) {
                    let seed = next.fetch_add(1, Ordering::Relaxed);
                    if seed >= first + count {
                        break;
                    }
                    let began = Instant::now();
                    let (broken, is_refused) = ask(seed, only.as_deref());
                    if env::var_os("NAPPE_LAWS_SLOW").is_some() && began.elapsed() > Duration::from_secs(1) {
                        eprintln!("seed {seed} takes {:.1?}", began.elapsed());
                    }
                    let mut found = found.lock().expect("no other one panicked");
                    found.0.extend(broken);
                    found.1 += 1;
                    found.2 += u64::from(is_refused);
                }
            });
        }
    });
    let (broken, asked, refused) = found.into_inner().expect("no one panicked");
    println!("{asked} seeds in {:.1?}, {refused} refused, {} broken", start.elapsed(), broken.len());
    assert!(broken.is_empty(), "{}", broken.join("\n\n"));
    assert!(
        5 * refused <= asked || asked < 20,
        "{refused} of {asked} scenes are refused: the generator is at fault"
    );
}

#[test]
fn what_is_known_to_break_a_law_still_does() {
    for (name, seed) in KNOWN {
        let law = LAWS.iter().find(|law| law.name == name).expect("a law");
        let verdict = law.ask(&of_seed(seed));
        assert!(
            matches!(verdict, Ok(Verdict::Broken(_))),
            "seed {seed} keeps the law '{name}' now: take it off the list"
        );
    }
}

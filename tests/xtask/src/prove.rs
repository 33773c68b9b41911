//! `cargo xtask prove [cloth|snow|laws|service|viewer|docs|builds]`: the proofs that take long, for a release and for who changes what
//! they prove.
//!
//! Slow tests are suites of their own, behind the feature `slow` of nappe-tests.

use crate::{
    additions, clients, drill, going_on, install, laws, machine_code, mutants, nginx, python, saved,
    shell::{Failure, Shell},
    suites, tutorials, typescript, viewer, ways, web,
};

/// The `nappe` command, as `cargo nappe` runs it.
const NAPPE: &str = "run --release --bin nappe --";

/// The committed hashes alone: that neither threads nor widths of vectors change bits is tested in release, and takes
/// as long again without optimisation.
const COMMITTED: [&str; 1] = ["every_run_has_its_committed_hash"];

/// Tests of a suite that compare widths of vectors, the portable packs among them.
const WIDTHS: [&str; 1] = ["every_width_of_vector"];

/// Tests of the service that do more with the feature `slow`: sequences of calls, shipped scenes, altered files, sessions made and
/// deleted.
const MORE: [&str; 4] = [
    "every_call_that_waits",
    "shipped_scenes_go_on_from_files",
    "files_altered_at_random",
    "sessions_that_were_made_and_deleted",
];

/// A part of the program: its name, and the proofs of it.
type Part = (&'static str, fn(&mut Shell) -> Result<(), Failure>);

const PARTS: [Part; 7] = [
    ("cloth", cloth),
    ("snow", snow),
    ("laws", |shell| laws::run(shell, &[])),
    ("service", service),
    ("viewer", viewer::prove),
    ("docs", docs),
    ("builds", builds),
];

/// Proves the parts named in `names`, or all; of the laws alone as options say.
pub(crate) fn run(shell: &mut Shell, names: &[String]) -> Result<(), Failure> {
    if let [first, options @ ..] = names
        && first == "laws"
        && options.iter().any(|option| option.starts_with("--"))
    {
        return shell.step("laws", |shell| laws::run(shell, options));
    }
    if let Some(unknown) = names.iter().find(|name| !PARTS.iter().any(|(known, _)| known == name)) {
        let known = PARTS.map(|(name, _)| name).join(", ");
        return Err(Failure(format!("there is no part '{unknown}'; there are: {known}")));
    }
    let asked = |part: &str| names.is_empty() || names.iter().any(|name| name == part);
    if asked("cloth") || asked("snow") {
        shell.step("bits", bits)?;
    }
    for (name, prove) in PARTS.into_iter().filter(|(name, _)| asked(name)) {
        shell.step(name, prove)?;
    }
    Ok(())
}

/// The same bits without optimisation, and with the packs of processors that have no kernels of their own.
fn bits(shell: &mut Shell) -> Result<(), Failure> {
    let libraries = "-p nappe-sim -p nappe-scene";
    suites::run(shell, "libraries in debug", libraries, &[], suites::SLOW)?;
    let determinism = "-p nappe-tests --no-default-features --test determinism";
    suites::run(shell, "same bits in debug", determinism, &COMMITTED, suites::SLOW)?;
    let portable = format!("--release {determinism} --features portable");
    suites::run(shell, "same bits of portable packs", &portable, &WIDTHS, suites::SLOW)
}

fn cloth(shell: &mut Shell) -> Result<(), Failure> {
    slow(shell, "cloth_slow")?;
    mutants::run(shell, &["cloth".to_owned()])?;
    mutants::run(shell, &["surfaces".to_owned()])?;
    shell.cargo("bench zara", &format!("{NAPPE} bench zara --sizes 2500,22500"))
}

fn snow(shell: &mut Shell) -> Result<(), Failure> {
    slow(shell, "snow_slow")?;
    mutants::run(shell, &["snow".to_owned()])?;
    shell.cargo("bench snow", &format!("{NAPPE} bench snow --particles 50000 --repetitions 3"))
}

fn service(shell: &mut Shell) -> Result<(), Failure> {
    slow(shell, "hostile")?;
    let waiting = "--release --features nappe-tests/slow --test service";
    suites::run(shell, "calls that wait, and files of sessions", waiting, &MORE, suites::SLOW)?;
    programs(shell)?;
    going_on::run(shell)?;
    saved::run(shell)?;
    python::read_back(shell)?;
    for name in drill::ALL {
        drill::run(shell, &[name.to_owned()])?;
    }
    shell.cargo("demo", &format!("{NAPPE} --save target/demo.rrd --force"))?;
    shell.cargo("bench stream", &format!("{NAPPE} bench stream --sizes 10000,100000"))?;
    clients::examples(shell)?;
    nginx::run(shell)?;
    web::loads(shell)?;
    web::boxes(shell)?;
    python::measure(shell)?;
    typescript::measure(shell)
}

fn builds(shell: &mut Shell) -> Result<(), Failure> {
    machine_code::prove(shell)?;
    ways::prove(shell)?;
    install::proof::prove(shell)
}

fn docs(shell: &mut Shell) -> Result<(), Failure> {
    programs(shell)?;
    additions::run(shell, &[])?;
    tutorials::run(shell, &[])
}

/// Builds the programs and examples that the tutorials and the examples run from where cargo leaves them.
fn programs(shell: &mut Shell) -> Result<(), Failure> {
    shell.cargo("programs", "build --release --bins --examples")?;
    shell.cargo("viewer: program", "build --release -p nappe-viewer")
}

/// Runs a suite of slow tests, built beside the program.
fn slow(shell: &mut Shell, suite: &str) -> Result<(), Failure> {
    let selection = format!("--release --features nappe-tests/slow --test {suite}");
    suites::run(shell, suite, &selection, &[], suites::SLOW)
}

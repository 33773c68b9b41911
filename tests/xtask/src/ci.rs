//! `cargo xtask ci`: everything that must hold before a change lands.

use crate::{
    additions, check, clients, mutants,
    shell::{Failure, Shell},
    test, tutorials,
};

/// The `nappe` command, as `cargo nappe` runs it.
const NAPPE: &str = "run --release --bin nappe --";

/// Runs the checks, the tests, the mutants, the demo, short benchmarks, the
/// examples and the tutorials.
pub(crate) fn run(shell: &mut Shell, arguments: &[String]) -> Result<(), Failure> {
    check::run(shell, arguments)?;
    additions::run(shell, arguments)?;
    test::run(shell, arguments)?;
    test::debug(shell)?;
    mutants::run(shell, arguments)?;
    shell.cargo("demo", &format!("{NAPPE} --save target/demo.rrd"))?;
    shell.cargo("bench zara", &format!("{NAPPE} bench zara --sizes 2500,22500"))?;
    shell.cargo("bench snow", &format!("{NAPPE} bench snow --particles 50000 --repetitions 3"))?;
    shell.cargo("bench stream", &format!("{NAPPE} bench stream --sizes 10000,100000"))?;
    clients::examples(shell)?;
    tutorials::run(shell, &[])
}

//! `cargo xtask bench`: the benchmarks of the `nappe` command.

use crate::shell::{Failure, Shell};

/// Names of all benchmarks.
const BENCHES: [&str; 8] = ["zara", "cloth", "solver", "snow", "stomakhin", "stream", "packed", "serve"];

/// Runs the benchmarks named in `names`, or all.
pub(crate) fn run(shell: &mut Shell, names: &[String]) -> Result<(), Failure> {
    if let Some(unknown) = names.iter().find(|name| !BENCHES.contains(&name.as_str())) {
        return Err(Failure(format!("there is no benchmark '{unknown}'; there are: {}", BENCHES.join(", "))));
    }
    for name in BENCHES.into_iter().filter(|name| names.is_empty() || names.iter().any(|n| n == name)) {
        let arguments = format!("run --release --bin nappe -- bench {name}");
        shell.cargo(&format!("bench {name}"), &arguments)?;
    }
    Ok(())
}

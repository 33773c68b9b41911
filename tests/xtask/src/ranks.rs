//! What ranks of an MPI job need: their program, built where MPI and libclang are installed.

use std::{env, fs, path::Path};

use crate::{
    shell::{Failure, Shell},
    suites,
};

/// Builds the program that ranks are, for the suites that start some; or says why not.
pub(crate) fn build(shell: &mut Shell) -> Result<(), Failure> {
    if is_possible(shell) {
        return shell.cargo("build nappe-rank", "ranks");
    }
    let why = "MPI or libclang is not installed (Debian packages libopenmpi-dev, openmpi-bin, libclang-dev)";
    shell.skip("ranks of MPI", why);
    Ok(())
}

/// Tests ranks by themselves.
pub(crate) fn test(shell: &mut Shell) -> Result<(), Failure> {
    if !is_possible(shell) {
        return Ok(());
    }
    let selection = "--release --features nappe-cluster/mpi --test mpi";
    suites::run(shell, "ranks of MPI", selection, &[], suites::QUICK)
}

/// Whether MPI and what reads its header are installed.
pub(crate) fn is_possible(shell: &Shell) -> bool {
    ["mpicc", "mpirun"].iter().all(|program| shell.find(program).is_some()) && has_libclang()
}

/// Whether bindgen, which reads the header of MPI, will find what it reads with.
fn has_libclang() -> bool {
    let entries = |folder: &Path| fs::read_dir(folder).into_iter().flatten().flatten();
    let has_it = |folder: &Path| {
        let name = |entry: fs::DirEntry| entry.file_name().to_string_lossy().into_owned();
        entries(folder).map(name).any(|name| name.starts_with("libclang") && name.contains(".so"))
    };
    let named = env::var_os("LIBCLANG_PATH").is_some();
    let of_versions = || {
        entries(Path::new("/usr/lib")).any(|entry| {
            entry.file_name().to_string_lossy().starts_with("llvm") && has_it(&entry.path().join("lib"))
        })
    };
    named || of_versions() || ["/usr/lib64", "/usr/lib"].iter().any(|folder| has_it(Path::new(folder)))
}

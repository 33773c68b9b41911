//! The programs as they are installed: built for release, without names of functions; and the oldest system that runs them.

use std::{
    env::consts::ARCH,
    fmt, fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::shell::{Failure, Shell};

/// The command, the server, and the viewer that the command starts.
pub(super) const NAMES: [&str; 3] = ["nappe", "nappe-server", "nappe-viewer"];

/// The version of all of them.
pub(super) const VERSION: &str = env!("CARGO_PKG_VERSION");

/// How cargo builds them: as every other way into the workspace does, so that no crate is compiled a second time.
const BUILDS: [(&str, &str); 2] = [
    ("programs to install", "build --release --locked --bin nappe --bin nappe-server"),
    ("viewer to install", "build --release --locked -p nappe-viewer"),
];

/// Libraries that a system with the GNU C library has, beside its loader.
const LIBRARIES: [&str; 6] =
    ["libc.so.6", "libdl.so.2", "libgcc_s.so.1", "libm.so.6", "libpthread.so.0", "librt.so.1"];

/// How the names of loaders begin.
const LOADER: &str = "ld-linux";

/// How the versions of the C library's symbols begin.
const SYMBOLS: &str = "GLIBC_";

/// A version of the GNU C library, such as 2.35.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct Glibc {
    major: u32,
    minor: u32,
}

impl Glibc {
    /// Older ones have no tag of the form that names a version; Rust asks for this one in any case.
    const OLDEST: Self = Self { major: 2, minor: 17 };

    /// The version that a symbol's names, such as `GLIBC_2.3.4`.
    fn of_symbol(name: &str) -> Option<Self> {
        let mut numbers = name.strip_prefix(SYMBOLS)?.split('.').map(|number| number.parse::<u32>().ok());
        Some(Self { major: numbers.next()??, minor: numbers.next()?? })
    }

    /// The tag of a wheel that runs with this version and with newer ones.
    pub(super) fn platform(self) -> String {
        format!("manylinux_{}_{}_{ARCH}", self.major, self.minor)
    }
}

impl fmt::Display for Glibc {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}.{}", self.major, self.minor)
    }
}

/// Programs that are ready to be installed.
pub(super) struct Programs {
    /// Where they are, alone.
    pub(super) folder: PathBuf,
    pub(super) files: Vec<PathBuf>,
    /// The oldest C library that they run with.
    pub(super) needs: Glibc,
}

impl Programs {
    /// Copies of what was built, without names of functions.
    ///
    /// # Errors
    /// When one was not built, or needs what not every system has.
    pub(super) fn stripped(shell: &mut Shell) -> Result<Self, Failure> {
        let folder = shell.target().join("stripped");
        make_anew(&folder)?;
        let files = Vec::from(NAMES.map(|name| folder.join(name)));
        for (name, file) in NAMES.into_iter().zip(&files) {
            let mut strip = Command::new("strip");
            strip.args(["--strip-all", "-o"]).arg(file).arg(shell.target().join("release").join(name));
            shell.run(&format!("stripped: {name}"), &mut strip)?;
        }
        let needs = needed(shell, &files)?;
        Ok(Self { folder, files, needs })
    }
}

/// Builds the programs.
///
/// # Errors
/// When a build fails, or the system has another C library.
pub(super) fn build(shell: &mut Shell) -> Result<(), Failure> {
    if !cfg!(all(target_os = "linux", target_env = "gnu")) {
        return Err(Failure("programs to install are made on Linux with the GNU C library".to_owned()));
    }
    BUILDS.into_iter().try_for_each(|(title, words)| shell.cargo(title, words))
}

/// Where files to install are left.
pub(super) fn dist(shell: &Shell) -> PathBuf {
    shell.target().join("dist")
}

/// The oldest C library that all these programs run with, by the versions of the symbols that they ask for.
///
/// # Errors
/// When one asks for a library or a version that not every system has.
pub(super) fn needed(shell: &Shell, files: &[PathBuf]) -> Result<Glibc, Failure> {
    let mut needs = Glibc::OLDEST;
    for file in files {
        let mut objdump = Command::new("objdump");
        objdump.env("LC_ALL", "C").arg("--private-headers").arg(file);
        let headers = shell.printed(&mut objdump)?;
        needs = needs.max(newest(&headers).map_err(|what| failure(file, &what))?);
    }
    Ok(needs)
}

/// The newest version that the headers of a program ask for, as objdump lists them.
fn newest(headers: &str) -> Result<Glibc, String> {
    let mut newest: Option<Glibc> = None;
    for line in headers.lines() {
        let words: Vec<&str> = line.split_whitespace().collect();
        match words.as_slice() {
            ["NEEDED", library] if !LIBRARIES.contains(library) && !library.starts_with(LOADER) => {
                return Err(format!("it needs {library}, which not every Linux has"));
            }
            [.., symbol] if symbol.starts_with(SYMBOLS) => {
                let version = Glibc::of_symbol(symbol);
                let version =
                    version.ok_or_else(|| format!("it needs {symbol}, for which there is no tag"))?;
                newest = newest.max(Some(version));
            }
            _ => {}
        }
    }
    newest.ok_or_else(|| "it asks for no symbol of the C library".to_owned())
}

/// Makes an empty folder, also where one of this name is.
///
/// # Errors
/// When the system does not let it.
pub(super) fn make_anew(folder: &Path) -> Result<(), Failure> {
    if folder.is_dir() {
        fs::remove_dir_all(folder).map_err(|error| failure(folder, &error))?;
    }
    fs::create_dir_all(folder).map_err(|error| failure(folder, &error))
}

/// What is wrong with a file or a folder.
pub(super) fn failure(path: &Path, error: &dyn fmt::Display) -> Failure {
    Failure(format!("{}: {error}", path.display()))
}

#[cfg(test)]
mod tests {
    use super::{Glibc, newest};

    const HEADERS: &str = "Dynamic Section:\n  NEEDED               libc.so.6\n  NEEDED               ld-linux-x86-64.so.2\n\
        Version References:\n  required from libc.so.6:\n    0x09691974 0x00 10 GLIBC_2.3.4\n    0x069691b4 0x00 02 GLIBC_2.34\n    \
        0x06969185 0x00 25 GLIBC_2.9\n";

    #[test]
    fn the_newest_version_of_a_symbol_decides() {
        let found = newest(HEADERS).expect("every system has what it needs");
        assert_eq!(found, Glibc { major: 2, minor: 34 });
        assert!(found.platform().starts_with("manylinux_2_34_"));
        assert_eq!(found.to_string(), "2.34");
    }

    #[test]
    fn what_not_every_system_has_is_named() {
        let refused = |headers: &str| newest(headers).expect_err("not every system has it");
        let other = HEADERS.replace("NEEDED               libc.so.6", "NEEDED               libmpi.so.40");
        assert!(refused(&other).contains("libmpi.so.40"));
        assert!(refused(&HEADERS.replace("GLIBC_2.34", "GLIBC_PRIVATE")).contains("GLIBC_PRIVATE"));
        assert!(refused("Dynamic Section:\n").contains("no symbol"));
    }
}

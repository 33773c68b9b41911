//! Where `nappe-viewer` is: `NAPPE_VIEWER`, beside this command, on PATH; and whether it is of this version.

use std::{
    ffi::OsString,
    io,
    path::{Path, PathBuf},
    process::Stdio,
    time::Duration,
};

use nappe_server::find_program;
use tokio::{io::AsyncReadExt as _, process::Command, time::timeout};

use super::{Child, Form, Place};
use crate::words::error::{CliError, Result};

/// The program that is looked for.
const NAME: &str = "nappe-viewer";
/// The variable that names another.
const VARIABLE: &str = "NAPPE_VIEWER";
/// How to come by it.
const BUILD: &str = "cargo build --release --package nappe-viewer";
/// How long it may take to tell its version.
const PATIENCE: Duration = Duration::from_secs(5);
/// Most that is read of what it tells (bytes).
const LIMIT: u64 = 200;

/// The viewer: it is there, and of this version.
#[derive(Clone, Debug)]
pub(crate) struct Viewer(PathBuf);

impl Viewer {
    /// The viewer that `NAPPE_VIEWER` names, or else the one beside this command, or else the first on PATH.
    ///
    /// # Errors
    /// When there is none; when what there is is no viewer, or one of another version.
    pub(crate) async fn find() -> Result<Self> {
        let named = std::env::var_os(VARIABLE).filter(|path| !path.is_empty()).map(PathBuf::from);
        let origin = if named.is_some() { format!("{VARIABLE} names ") } else { String::new() };
        let Some(path) = named.or_else(|| find_program(NAME)) else {
            return Err(CliError::usage(format!(
                "Rerun needs {NAME}, which is neither beside this command nor on PATH: `{BUILD}` builds it"
            )));
        };

        let program = format!("{origin}{}", path.display());
        let wrong =
            |what: String| CliError::usage(format!("{program}, {what}: `{BUILD}` builds the right one"));
        let answer = version(&path)
            .await
            .map_err(|error| wrong(format!("which cannot be asked for its version ({error})")))?;
        let ours = env!("CARGO_PKG_VERSION");
        match answer.strip_prefix(NAME).map(str::trim) {
            Some(version) if version == ours => Ok(Self(path)),
            Some(version) => Err(wrong(format!("which is of version {version}, and this command of {ours}"))),
            None => Err(wrong(format!("which is no {NAME}: asked for its version, it says {answer:?}"))),
        }
    }

    /// Starts it for a server, with these options.
    ///
    /// # Errors
    /// When the system does not start it.
    pub(crate) async fn start(&self, place: &Place, options: Vec<OsString>, form: Form) -> Result<Child> {
        let mut command = Command::new(&self.0);
        command.args(place.options()).args(options).args(["--json", "--until-stdin-closes"]);
        Child::start(command, place.told(), form)
            .await
            .map_err(|error| CliError::failure(format!("cannot start {}: {error}", self.0.display())))
    }
}

/// The first line that a program says when it is asked for its version.
async fn version(path: &Path) -> io::Result<String> {
    let mut command = Command::new(path);
    command.arg("--version").stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut process = command.kill_on_drop(true).spawn()?;
    let mut said = Vec::new();
    if let Some(stdout) = process.stdout.take() {
        let mut stdout = stdout.take(LIMIT);
        timeout(PATIENCE, stdout.read_to_end(&mut said)).await??;
    }
    Ok(String::from_utf8_lossy(&said).lines().next().unwrap_or_default().to_owned())
}

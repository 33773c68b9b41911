//! The examples of docs/service.md against a real server: the client in Rust, and the one in Python
//! with stubs made from the contract.

use std::{
    fs,
    io::{BufRead as _, BufReader},
    path::Path,
    process::{Child, Command, Stdio},
};

use crate::shell::{Failure, Shell};

/// The contract's files.
const PROTOS: [&str; 2] = ["nappe/v1/frame.proto", "nappe/v1/simulation.proto"];

/// Runs the examples against the server that was built.
pub(crate) fn examples(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("examples", run)
}

fn run(shell: &mut Shell) -> Result<(), Failure> {
    let built = shell.target().join("release");
    let server = Server::start(&built.join("nappe-server"), &[])?;
    let mut rust = Command::new(built.join("examples/watch"));
    shell.run("example in Rust", rust.arg(format!("http://{}", server.address)).stdout(Stdio::null()))?;
    if let Some(python) = shell.python_with("grpc_tools, numpy") {
        return python_example(shell, &python, &server);
    }
    shell.skip("example in Python", "grpcio-tools and numpy are not installed");
    Ok(())
}

fn python_example(shell: &mut Shell, python: &Path, server: &Server) -> Result<(), Failure> {
    let stubs = shell.target().join("tools/stubs");
    // The stubs are called `nappe` as the package is, which may be installed: a folder with this file comes before it.
    let modules = stubs.join("nappe");
    fs::create_dir_all(&modules)
        .and_then(|()| fs::write(modules.join("__init__.py"), ""))
        .map_err(|error| Failure(format!("{} cannot be made: {error}", modules.display())))?;
    let out = |kind: &str| format!("--{kind}_out={}", stubs.display());
    let mut generate = Command::new(python);
    generate.args(["-m", "grpc_tools.protoc", "--proto_path=proto"]).args(["python", "grpc_python"].map(out));
    shell.run("stubs for Python", generate.args(PROTOS))?;
    let mut example = Command::new(python);
    example.args(["client/examples/watch.py", &server.address]).env("PYTHONPATH", stubs);
    shell.run("example in Python", example.stdout(Stdio::null()))
}

/// A server on a free loopback port, ended when dropped.
pub(crate) struct Server {
    process: Child,
    /// Host and port, `host:port`.
    pub(crate) address: String,
}

impl Server {
    /// Starts it, with further arguments.
    ///
    /// # Errors
    /// When it does not start, or does not say where it listens.
    pub(crate) fn start(program: &Path, arguments: &[&str]) -> Result<Self, Failure> {
        let failure = |what: String| Failure(format!("{}: {what}", program.display()));
        let mut command = Command::new(program);
        command.args(["--address", "127.0.0.1:0", "--log", "warn"]).args(arguments).stdout(Stdio::piped());
        let process = command.spawn().map_err(|error| failure(format!("cannot be started: {error}")))?;
        let mut server = Self { process, address: String::new() };
        let mut line = String::new();
        let output = server.process.stdout.take().expect("its output is a pipe");
        BufReader::new(output).read_line(&mut line).map_err(|error| failure(error.to_string()))?;
        match line.trim().rsplit_once("http://") {
            Some((_, address)) => address.clone_into(&mut server.address),
            None => return Err(failure(format!("said '{}' and no address", line.trim()))),
        }
        Ok(server)
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        // It may have ended by itself; either way nothing is left running.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

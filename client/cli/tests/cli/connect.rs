//! `nappe connect` against a real sshd on loopback, run by the test's own user with keys of its own.

#![cfg(unix)]

use std::{
    fs,
    io::Read as _,
    net::{TcpListener, TcpStream},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    time::Duration,
};

use serde_json::Value;

use crate::{
    links::opened,
    support::{Folder, Lines, Server, command, end_by, folder, nappe, skipped, until},
};

/// A daemon that lets its own user in with one key.
struct Sshd {
    process: Child,
    port: u16,
    folder: Folder,
}

impl Sshd {
    /// None where no sshd is installed.
    fn start() -> Option<Self> {
        let path = std::env::var_os("PATH").unwrap_or_default();
        let places = std::env::split_paths(&path).chain([PathBuf::from("/usr/sbin")]);
        let Some(program) = places.map(|place| place.join("sshd")).find(|program| program.is_file()) else {
            skipped("sshd is not installed (Debian: openssh-server), nappe connect is not tested");
            return None;
        };
        // Where root runs it, it wants this folder, which its package makes at a boot.
        let _ = fs::create_dir_all("/run/sshd");

        // Somebody else may take the port before it listens.
        let mut started = None;
        until("sshd listens", || {
            started = Self::at_a_port(&program);
            started.is_some()
        });
        started
    }

    /// None if it has ended before it listened.
    fn at_a_port(program: &Path) -> Option<Self> {
        let folder = folder();
        let port =
            TcpListener::bind("127.0.0.1:0").and_then(|free| free.local_addr()).expect("a port").port();
        for key in ["host", "user"] {
            let mut keygen = Command::new("ssh-keygen");
            keygen.args(["-q", "-t", "ed25519", "-N", "", "-f"]).arg(folder.path().join(key));
            assert!(keygen.status().expect("ssh-keygen is installed with ssh").success());
        }
        let host = fs::read_to_string(folder.path().join("host.pub")).expect("a key");
        let known = format!("[127.0.0.1]:{port} {host}");
        fs::write(folder.path().join("known"), known).expect("written");
        let place = folder.path().display();
        let settings = format!(
            "Port {port}\nListenAddress 127.0.0.1\nHostKey {place}/host\nAuthorizedKeysFile {place}/user.pub\n\
             PidFile none\nUsePAM no\nStrictModes no\nPasswordAuthentication no\nKbdInteractiveAuthentication no\n"
        );
        fs::write(folder.path().join("settings"), settings).expect("written");

        let log = fs::File::create(folder.path().join("log")).expect("a log");
        let mut sshd = Command::new(program);
        sshd.args(["-D", "-e", "-f"]).arg(folder.path().join("settings"));
        let process = sshd.stdin(Stdio::null()).stderr(log).spawn().expect("it starts");
        let mut sshd = Self { process, port, folder };
        let mut has_ended = false;
        until("sshd listens or ends", || {
            has_ended = sshd.process.try_wait().expect("it can be asked").is_some();
            has_ended || greets(port)
        });
        if has_ended {
            skipped(&format!("an attempt of sshd: {}", sshd.logs()));
            return None;
        }
        Some(sshd)
    }

    /// What the command is told: where it goes, with which key, and whom it knows.
    fn options(&self, known: &Path) -> Vec<String> {
        let mut options = vec!["connect".to_owned(), "127.0.0.1".to_owned()];
        for option in [
            format!("Port={}", self.port),
            format!("IdentityFile={}", self.folder.path().join("user").display()),
            format!("UserKnownHostsFile={}", known.display()),
            "GlobalKnownHostsFile=/dev/null".to_owned(),
            "IdentitiesOnly=yes".to_owned(),
            "BatchMode=yes".to_owned(),
        ] {
            options.extend(["--ssh-option".to_owned(), option]);
        }
        options.extend(["--program".to_owned(), env!("CARGO_BIN_EXE_nappe").to_owned()]);
        options
    }

    /// Connects, and reads what it says.
    fn connect(&self, more: &[&str]) -> (Child, Value) {
        let mut connecting = command();
        connecting.args(self.options(&self.folder.path().join("known"))).arg("--json").args(more);
        let log = fs::File::create(self.folder.path().join("connect.log")).expect("a log");
        let mut process = connecting.stdout(Stdio::piped()).stderr(log).spawn().expect("it starts");
        let line = Lines::of(process.stdout.take().expect("a pipe")).next().unwrap_or_default();
        let said = serde_json::from_str(&line);
        (process, said.unwrap_or_else(|error| panic!("{error}: '{line}', {}", self.logs())))
    }

    fn logs(&self) -> String {
        let log = |name: &str| fs::read_to_string(self.folder.path().join(name)).unwrap_or_default();
        format!("connect: {}sshd: {}", log("connect.log"), log("log"))
    }
}

impl Drop for Sshd {
    fn drop(&mut self) {
        // It may have ended already.
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}

/// Whether it is a daemon of ssh that listens at a port. Who is late with its greeting is asked again.
fn greets(port: u16) -> bool {
    let Ok(mut stream) = TcpStream::connect(("127.0.0.1", port)) else { return false };
    let mut greeting = [0; 4];
    let time = Some(Duration::from_secs(2));
    stream.set_read_timeout(time).is_ok() && stream.read_exact(&mut greeting).is_ok() && &greeting == b"SSH-"
}

/// Whether somebody listens at an address of an answer.
fn listens(address: &Value) -> bool {
    TcpStream::connect(address.as_str().expect("an address")).is_ok()
}

#[test]
fn a_server_is_started_elsewhere_used_from_here_and_ended() {
    let Some(sshd) = Sshd::start() else { return };
    let (mut connected, said) = sshd.connect(&["--far-port", "1"]);
    assert_eq!(said["started"], true, "{said}");
    let url = said["url"].as_str().expect("an address").to_owned();
    assert_ne!(url, format!("http://{}", said["far_address"].as_str().expect("an address")));

    // The token was fetched, and is found by itself.
    nappe(&["create", "demo", "--id", "far-away", "--server", &url]).ok();
    assert_eq!(nappe(&["step", "far-away", "3", "--json", "--server", &url]).ok().json()["step"], 3);
    assert!(listens(&said["far_address"]));

    let code = end_by(&mut connected, "TERM");
    assert_eq!(code, Some(0), "{}", sshd.logs());
    until("the server that it started ends with it", || !listens(&said["far_address"]));
    assert_eq!(nappe(&["list", "--server", &url]).code, Some(4), "the port is closed");
}

#[test]
fn a_server_that_runs_is_found_and_goes_on() {
    let Some(sshd) = Sshd::start() else { return };
    let server = Server::plain(&[]);
    let port = server.url.rsplit(':').next().expect("a port").to_owned();
    let (mut connected, said) = sshd.connect(&["--far-port", &port]);
    assert_eq!(said["started"], false, "{said}");
    let url = said["url"].as_str().expect("an address");
    nappe(&["list", "--server", url]).ok();
    let code = end_by(&mut connected, "INT");
    assert_eq!(code, Some(0), "{}", sshd.logs());
    assert!(listens(&said["far_address"]), "it was not ours to end");

    let (mut own, said) = sshd.connect(&["--far-port", &port, "--", "--max-sessions", "0"]);
    assert_eq!(said["started"], true, "arguments are for a server of its own");
    let refused = nappe(&["create", "demo", "--server", said["url"].as_str().expect("an address")]);
    assert!(refused.stderr.contains("TOO_MANY_SESSIONS"), "{}", refused.stderr);
    end_by(&mut own, "TERM");
}

#[test]
fn a_link_to_a_server_elsewhere_opens_from_here() {
    let Some(sshd) = Sshd::start() else { return };
    let mut connecting = command();
    connecting.args(sshd.options(&sshd.folder.path().join("known"))).args(["--far-port", "1", "--link"]);
    let mut process = connecting.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    lines.with("In a browser, good once");
    let link = lines.with("http://");
    assert!(opened(link.trim()).contains("grpc-status:0"), "{link}");
    assert!(opened(link.trim()).contains("grpc-status: 5"), "once");
    let code = end_by(&mut process, "TERM");
    assert_eq!(code, Some(0), "{}", sshd.logs());
}

#[test]
fn a_machine_that_ssh_does_not_know_is_refused() {
    let Some(sshd) = Sshd::start() else { return };
    let words = sshd.options(Path::new("/dev/null"));
    let refused = nappe(&words.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(refused.code, Some(4), "{refused:?}");
    assert!(refused.stderr.contains("Host key verification failed"), "{}", refused.stderr);
}

#[test]
fn a_machine_without_nappe_says_so() {
    let Some(sshd) = Sshd::start() else { return };
    let mut words = sshd.options(&sshd.folder.path().join("known"));
    let last = words.last_mut().expect("the program");
    "no-such-nappe".clone_into(last);
    let refused = nappe(&words.iter().map(String::as_str).collect::<Vec<_>>());
    assert_eq!(refused.code, Some(1), "{refused:?}");
    assert!(refused.stderr.contains("no-such-nappe") && refused.stderr.contains("--program"), "{refused:?}");
}

#[test]
fn ctrl_c_ends_a_connection_that_does_not_come_about_and_its_ssh() {
    let folder = folder();
    // A shell writes it: a file that a process of this test still holds open for writing cannot be started.
    let text = "#!/bin/sh\necho $$ > \"$0.pid\"\nexec sleep 60\n";
    let write = ["-c", "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"", "sh", text];
    let status = Command::new("sh").args(write).arg(folder.path().join("ssh")).status();
    assert!(status.expect("there is a shell").success());

    let path = std::env::var_os("PATH").unwrap_or_default();
    let path =
        std::env::join_paths([folder.path().to_owned()].into_iter().chain(std::env::split_paths(&path)));
    let mut connecting = command();
    connecting.args(["connect", "nowhere"]).env("PATH", path.expect("a list of folders"));
    let mut process = connecting.stdout(Stdio::null()).stderr(Stdio::null()).spawn().expect("it starts");
    let pid = folder.path().join("ssh.pid");
    until("ssh runs", || fs::read_to_string(&pid).is_ok_and(|pid| pid.ends_with('\n')));

    assert_eq!(end_by(&mut process, "INT"), Some(130));
    let pid = fs::read_to_string(&pid).expect("its number");
    let is_there = Command::new("kill").args(["-0", pid.trim()]).stderr(Stdio::null()).status();
    assert!(!is_there.expect("it can be asked").success(), "ssh has ended");
}

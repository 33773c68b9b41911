//! `deploy/nginx.conf` as it stands, but for names and places, before a server that was built: calls of gRPC and gRPC-Web,
//! metrics and the page of a run through nginx.

use std::{fs, path::PathBuf, process::Command};

use crate::{
    clients::Server,
    shell::{Failure, Shell},
};

/// Where Debian installs it, which is not on everybody's PATH.
const SBIN: &str = "/usr/sbin/nginx";
/// The session whose frames are watched, and its steps.
const SESSION: &str = "first";
const STEPS: &str = "3";

/// As `deploy/compose.yaml` draws a token.
const DRAW: &str = r"umask 077; head -c 16 /dev/urandom | od -An -tx1 | tr -d ' \n' > token";
/// What openssl makes a certificate with.
const CERTIFICATE: &str = "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=localhost \
    -addext subjectAltName=DNS:localhost -keyout key.pem -out cert.pem";

/// An empty message of gRPC: not compressed, of no bytes.
const EMPTY: &[u8] = &[0; 5];
/// A `WatchFramesRequest` for the session.
const WATCH: &[u8] = b"\0\0\0\0\x07\x0a\x05first";

/// Tries the configuration, if nginx is installed.
pub(crate) fn run(shell: &mut Shell) -> Result<(), Failure> {
    shell.step("nginx", |shell| {
        let nginx = shell.find("nginx").or_else(|| Some(PathBuf::from(SBIN)).filter(|path| path.is_file()));
        let found = (nginx, shell.find("curl"), shell.find("openssl"));
        let (Some(nginx), Some(_), Some(_)) = found else {
            shell.skip("deploy/nginx.conf", "nginx, curl or openssl is not installed");
            return Ok(());
        };
        through(shell, nginx)
    })
}

/// Serves, and asks through nginx.
fn through(shell: &mut Shell, program: PathBuf) -> Result<(), Failure> {
    let folder = shell.target().join(format!("nginx-{}", std::process::id()));
    let made = fs::create_dir_all(folder.join("www/runs"));
    made.map_err(|error| Failure(format!("{}: {error}", folder.display())))?;
    let proxy = Proxy { program, folder };

    shell.run("token", Command::new("sh").current_dir(&proxy.folder).args(["-c", DRAW]))?;
    let mut certificate = Command::new("openssl");
    certificate.args(CERTIFICATE.split_whitespace()).current_dir(&proxy.folder);
    shell.run("certificate", &mut certificate)?;

    let token = proxy.folder.join("token");
    let built = shell.target().join("release");
    let server = Server::start(&built.join("nappe-server"), &["--token", &token.display().to_string()])?;
    let nappe = |arguments: &[&str]| {
        let mut command = Command::new(built.join("nappe"));
        command.args(arguments).env("NAPPE_SERVER", &server.address).env("NAPPE_TOKEN_FILE", &token);
        command
    };
    let page = proxy.folder.join("www/runs/flag.html");
    let page = page.display().to_string();
    shell.run("page of a run", &mut nappe(&["run", "flag", "--steps", STEPS, "--save", &page]))?;
    shell.run("session", &mut nappe(&["create", "flag", "--id", SESSION, "--steps", STEPS]))?;
    shell.run("its steps", &mut nappe(&["step", SESSION, STEPS]))?;

    let text = fs::read_to_string(shell.root().join("deploy/nginx.conf"));
    let text = text.map_err(|error| Failure(format!("deploy/nginx.conf: {error}")))?;
    proxy.configure(&text, &server.address)?;
    shell.run("nginx starts", &mut proxy.nginx())?;
    shell.step("calls", |_| proxy.check())
}

/// An nginx of this proof alone, in a folder: it listens on a Unix socket, since no port is free for sure.
struct Proxy {
    program: PathBuf,
    folder: PathBuf,
}

impl Proxy {
    fn path(&self, name: &str) -> String {
        self.folder.join(name).display().to_string()
    }

    /// Writes its configuration: the one that is tried, with the names of this proof, in one that holds the rest.
    fn configure(&self, tried: &str, server: &str) -> Result<(), Failure> {
        let site = replaced(
            tried,
            &[
                ("listen 443 ", format!("listen unix:{} ", self.path("socket"))),
                ("server_name nappe.example.org;", "server_name localhost;".to_owned()),
                ("/etc/ssl/nappe/fullchain.pem", self.path("cert.pem")),
                ("/etc/ssl/nappe/privkey.pem", self.path("key.pem")),
                ("grpc://127.0.0.1:6277", format!("grpc://{server}")),
                ("root /srv/nappe;", format!("root {};", self.path("www"))),
            ],
        )?;
        let temporary = ["client_body", "proxy", "fastcgi", "uwsgi", "scgi"]
            .map(|kind| format!("{kind}_temp_path {};\n", self.path(kind)));
        let main = format!(
            "master_process off;\npid {};\nerror_log {};\nevents {{}}\nhttp {{\naccess_log off;\n{}include {};\n}}\n",
            self.path("pid"),
            self.path("error.log"),
            temporary.concat(),
            self.path("site.conf"),
        );
        let write = |name: &str, text: &str| fs::write(self.folder.join(name), text);
        let written = write("site.conf", &site).and_then(|()| write("main.conf", &main));
        written.map_err(|error| Failure(format!("{}: {error}", self.folder.display())))
    }

    /// Starts it: the command ends once it listens.
    fn nginx(&self) -> Command {
        let mut command = Command::new(&self.program);
        command.args(["-e", &self.path("error.log"), "-c", &self.path("main.conf")]);
        command
    }

    /// What comes through it, headers and trailers included.
    fn answer(&self, path: &str, options: &[&str], message: Option<&[u8]>) -> Result<Vec<u8>, Failure> {
        let mut command = Command::new("curl");
        command.args(["--silent", "--show-error", "--max-time", "60", "--dump-header", "-", "--cacert"]);
        command.arg(self.path("cert.pem")).args(["--unix-socket", &self.path("socket")]).args(options);
        if let Some(message) = message {
            let file = self.folder.join("message");
            fs::write(&file, message).map_err(|error| Failure(format!("{}: {error}", file.display())))?;
            command.args(["--data-binary", &format!("@{}", file.display())]);
        }
        let done = command.arg(format!("https://localhost{path}")).output();
        let done = done.map_err(|error| Failure(format!("curl: {error}")))?;
        if done.status.success() {
            return Ok(done.stdout);
        }
        let log = fs::read_to_string(self.folder.join("error.log")).unwrap_or_default();
        Err(Failure(format!("{path}: {}\n{log}", String::from_utf8_lossy(&done.stderr))))
    }

    fn check(&self) -> Result<(), Failure> {
        let token = fs::read_to_string(self.folder.join("token"));
        let token = token.map_err(|error| Failure(format!("the token: {error}")))?;
        let shown = format!("authorization: Bearer {token}");
        let call = |method: &str, options: &[&str], message: &[u8]| {
            self.answer(&format!("/nappe.v1.SimulationService/{method}"), options, Some(message))
        };
        let native = ["--http2", "-H", "content-type: application/grpc", "-H", "te: trailers"];
        let with_token = [&native[..], &["-H", &shown]].concat();
        let web = ["--http1.1", "-H", "content-type: application/grpc-web+proto", "-H", &shown];

        let refused = call("GetServerInfo", &native, EMPTY)?;
        expect("a call without the token", &refused, &["grpc-status: 16"])?;
        let answered = call("GetServerInfo", &with_token, EMPTY)?;
        expect("a call", &answered, &["HTTP/2 200", "snow_and_cloth", "grpc-status: 0"])?;
        let answered = call("GetServerInfo", &with_token, &large())?;
        expect("a message of 2 MiB", &answered, &["snow_and_cloth", "grpc-status: 0"])?;
        let watched = call("WatchFrames", &with_token, WATCH)?;
        expect("a stream", &watched, &["HTTP/2 200", "grpc-status: 0"])?;
        let answered = call("GetServerInfo", &web, EMPTY)?;
        expect("a call of gRPC-Web", &answered, &["HTTP/1.1 200", "snow_and_cloth", "grpc-status:0"])?;

        let refused = self.answer("/metrics", &[], None)?;
        expect("metrics without the token", &refused, &[" 401", "www-authenticate: Bearer"])?;
        let told = self.answer("/metrics", &["-H", &shown], None)?;
        expect("metrics", &told, &[" 200", "nappe_sessions{state=\"finished\"} 1"])?;

        let file = self.folder.join("www/runs/flag.html");
        let page = fs::read(&file).map_err(|error| Failure(format!("{}: {error}", file.display())))?;
        let sent = self.answer("/runs/flag.html", &[], None)?;
        if page.is_empty() || !sent.ends_with(&page) {
            return Err(Failure("the page of a run does not come through nginx as it is".to_owned()));
        }
        Ok(())
    }
}

impl Drop for Proxy {
    fn drop(&mut self) {
        // It may not have been started; either way nothing is left.
        let _ = self.nginx().args(["-s", "stop"]).output();
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// A text with names replaced, each of which it has once.
fn replaced(text: &str, names: &[(&str, String)]) -> Result<String, Failure> {
    let mut text = text.to_owned();
    for (name, own) in names {
        if text.matches(*name).count() != 1 {
            return Err(Failure(format!("deploy/nginx.conf does not have '{name}' once")));
        }
        text = text.replace(name, own);
    }
    Ok(text)
}

/// A message of 2 MiB: a field that the server does not know, and leaves unread.
fn large() -> Vec<u8> {
    const BYTES: usize = 2 << 20;
    let field = [&[0x0a, 0x80, 0x80, 0x80, 0x01][..], &b"x".repeat(BYTES)].concat();
    [&[0][..], &(field.len() as u32).to_be_bytes(), &field].concat()
}

/// Fails unless an answer has all of these words.
fn expect(what: &str, answer: &[u8], words: &[&str]) -> Result<(), Failure> {
    let text = String::from_utf8_lossy(answer);
    match words.iter().find(|word| !text.contains(**word)) {
        None => Ok(()),
        Some(word) => {
            let start: String = text.chars().take(1000).collect();
            Err(Failure(format!("{what} through nginx is answered without '{word}': {start}")))
        }
    }
}

#[test]
fn a_name_that_is_not_there_once_is_told() {
    let names = [("a", "c".to_owned())];
    assert_eq!(replaced("a b", &names).ok().as_deref(), Some("c b"));
    assert!(replaced("a a", &names).is_err() && replaced("b", &names).is_err());
}

//! The commands and settings of `deploy/nappe.service`: they leave a token that members of the group can read, and the
//! server that the unit starts asks for it.

#![cfg(unix)]

mod support;

use std::{
    fs,
    os::unix::fs::{MetadataExt as _, PermissionsExt as _},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
};

use nappe_proto::v1::{GetServerInfoRequest, simulation_service_client::SimulationServiceClient};
use support::first_line;
use tonic::{Code, Request};

/// The folder of settings that the unit names.
const SETTINGS: &str = "/etc/nappe";
/// The group that its commands name.
const GROUP: &str = "--group users";

/// The unit, with folders of this test instead of those of the system.
struct Unit {
    text: String,
    folder: PathBuf,
}

impl Unit {
    fn read() -> Self {
        let unit = Path::new(env!("CARGO_MANIFEST_DIR")).join("../deploy/nappe.service");
        let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("unit-{}", std::process::id()));
        fs::create_dir_all(&folder).expect("made");
        let text = fs::read_to_string(unit).expect("the unit");
        let settings = folder.join("settings");
        Self { text: text.replace(SETTINGS, settings.to_str().expect("a text")), folder }
    }

    fn settings(&self) -> PathBuf {
        self.folder.join("settings")
    }

    /// The commands of its head that make the folder and the token.
    fn commands(&self) -> Vec<&str> {
        let settings = self.settings();
        let settings = settings.to_str().expect("a text");
        let commands = self.text.lines().filter_map(|line| line.strip_prefix("#   "));
        commands.filter(|line| line.contains(settings) && !line.starts_with("nappe ")).collect()
    }

    /// What it says of a key.
    fn value(&self, key: &str) -> &str {
        let mut values = self.text.lines().filter_map(|line| line.strip_prefix(key)?.strip_prefix('='));
        values.next().unwrap_or_else(|| panic!("no {key}"))
    }

    /// Hands the token over as the service manager does, and starts the program that was built with what the unit sets.
    fn start(&self) -> Server {
        let credentials = self.folder.join("credentials");
        fs::create_dir_all(&credentials).expect("made");
        let (name, source) = self.value("LoadCredential").split_once(':').expect("a name and a file");
        let credential = credentials.join(name);
        fs::copy(source, &credential).expect("copied");
        fs::set_permissions(&credential, fs::Permissions::from_mode(0o400)).expect("set");

        let mut words = self.value("ExecStart").split_whitespace();
        assert_eq!(words.next(), Some("/usr/local/bin/nappe-server"));
        let (name, value) = self.value("Environment").split_once('=').expect("a name and a value");
        let value = value.replace("%d", credentials.to_str().expect("a text"));
        let mut command = Command::new(env!("CARGO_BIN_EXE_nappe-server"));
        command.args(words).env(name, value).env("NAPPE_ADDRESS", "127.0.0.1:0");
        command.env("XDG_RUNTIME_DIR", &self.folder);
        Server(command.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("it starts"))
    }
}

impl Drop for Unit {
    fn drop(&mut self) {
        // What is left of a test that failed is in nobody's way.
        let _ = fs::remove_dir_all(&self.folder);
    }
}

/// The server of the unit, ended with the test.
struct Server(Child);

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// What a command of the system says.
fn said(program: &str, argument: &str) -> String {
    let done = Command::new(program).arg(argument).output().expect("it runs");
    assert!(done.status.success(), "{program} {argument}: {done:?}");
    String::from_utf8(done.stdout).expect("a text").trim().to_owned()
}

/// A group that is not the one of new files, if there is one to which this user may give a folder.
fn other_group() -> String {
    let (own, all) = (said("id", "-g"), said("id", "-G"));
    match all.split_whitespace().find(|group| *group != own) {
        _ if said("id", "-u") == "0" => "users".to_owned(),
        Some(group) => group.to_owned(),
        None => own,
    }
}

/// Runs the commands, as root or not.
fn make_token(unit: &Unit) {
    let commands = unit.commands();
    assert_eq!(commands.len(), 2, "a folder and a token: {commands:?}");
    for command in commands {
        let command = command.replace("sudo ", "").replace(GROUP, &format!("--group {}", other_group()));
        let done = Command::new("sh").args(["-c", &command]).output().expect("a shell");
        assert!(done.status.success(), "{command}: {done:?}");
    }
}

#[tokio::test]
async fn the_unit_leaves_a_token_for_its_group_alone_and_starts_a_server_that_asks_for_it() {
    let unit = Unit::read();
    make_token(&unit);
    let token = unit.settings().join("token");
    let [folder, file] = [&unit.settings(), &token].map(|path| fs::metadata(path).expect("it is there"));
    assert_eq!((folder.mode() & 0o7777, file.mode() & 0o7777), (0o2750, 0o640));
    assert_eq!(file.gid(), folder.gid(), "whoever may enter the folder may read the token");

    let mut server = unit.start();
    let line = first_line(server.0.stdout.take().expect("its output"));
    let url = format!("http://{}", line.trim().rsplit_once("http://").expect("an address").1);
    let mut client = SimulationServiceClient::connect(url).await.expect("connected");
    let refused = client.get_server_info(GetServerInfoRequest {}).await.expect_err("no token");
    assert_eq!(refused.code(), Code::Unauthenticated, "{refused}");
    let shown = format!("Bearer {}", fs::read_to_string(&token).expect("read"));
    let mut request = Request::new(GetServerInfoRequest {});
    request.metadata_mut().insert("authorization", shown.parse().expect("a header"));
    client.get_server_info(request).await.expect("answered");
}

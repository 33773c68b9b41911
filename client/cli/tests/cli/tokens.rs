//! Tokens as users meet them: found without a word, named as a file, and never written anywhere.

use std::{
    fs,
    io::{Read as _, Write as _},
    net::TcpStream,
    path::Path,
};

use crate::{
    links::opened,
    support::{PATIENCE, Server, folder, nappe},
};

/// A token that no server has.
const WRONG: &str = "0123456789abcdef0123456789abcdef";

#[test]
fn the_command_finds_the_token_of_its_users_server() {
    let server = Server::start();
    let file = server.token_file.clone().expect("it says where its token is");
    server.nappe(&["list"]).ok();
    server.nappe(&["list", "--token", &file]).ok();

    let folder = folder();
    let wrong = folder.path().join("wrong.token");
    write_private(&wrong, WRONG);
    let refused = server.nappe(&["list", "--token", wrong.to_str().expect("UTF-8")]);
    assert_eq!(refused.code, Some(5), "{refused:?}");
    assert!(refused.stderr.contains("TOKEN_WRONG") && !refused.stderr.contains(WRONG), "{}", refused.stderr);
    let missing = server.nappe(&["list", "--token", "no-such-file"]);
    assert_eq!(missing.code, Some(1), "{missing:?}");
    assert!(missing.stderr.contains("no-such-file"), "{}", missing.stderr);

    server.end_by("TERM");
    assert!(!Path::new(&file).exists(), "it goes with its server");
}

#[test]
fn a_server_can_ask_for_none_or_for_one_of_a_file() {
    let open = Server::with(&["--no-token"]);
    assert_eq!(open.token_file, None);
    open.nappe(&["list"]).ok();

    let folder = folder();
    let file = folder.path().join("my.token");
    write_private(&file, "one-of-my-own-choice\n");
    let fixed = Server::with(&["--token", file.to_str().expect("UTF-8")]);
    fixed.nappe(&["list"]).ok();
    fixed.nappe(&["list", "--token", file.to_str().expect("UTF-8")]).ok();
}

/// Writes a file that its user alone can read.
fn write_private(path: &Path, text: &str) {
    fs::write(path, text).expect("written");
    #[cfg(unix)]
    set_mode(path, 0o600);
}

#[cfg(unix)]
fn set_mode(path: &Path, mode: u32) {
    use std::os::unix::fs::PermissionsExt as _;
    fs::set_permissions(path, fs::Permissions::from_mode(mode)).expect("set");
}

#[test]
#[cfg(unix)]
fn a_token_that_every_user_may_read_is_refused_by_server_and_client() {
    let folder = folder();
    let file = folder.path().join("my.token");
    write_private(&file, "one-of-my-own-choice\n");
    set_mode(&file, 0o644);
    let path = file.to_str().expect("UTF-8");
    for verb in [&["serve", "--address", "127.0.0.1:0", "--token", path][..], &["list", "--token", path]] {
        let refused = nappe(verb);
        assert_eq!(refused.code, Some(1), "{refused:?}");
        assert!(refused.stderr.contains(&format!("chmod 600 {path}")), "{}", refused.stderr);
    }
}

#[test]
#[cfg(unix)]
fn a_unix_socket_needs_no_token_and_is_its_users_alone() {
    use std::os::unix::fs::PermissionsExt as _;
    let folder = folder();
    let path = folder.path().join("nappe.sock");
    let address = format!("unix:{}", path.display());
    let server = Server::with(&["--address", &address]);
    assert_eq!((server.url.as_str(), &server.token_file), (address.as_str(), &None));
    assert_eq!(fs::metadata(&path).expect("it is there").permissions().mode() & 0o777, 0o600);
    server.nappe(&["create", "demo", "--id", "over-there"]).ok();
    assert_eq!(server.nappe(&["step", "over-there", "2"]).ok().json()["step"], 2);
    server.nappe(&["watch", "over-there", "--count", "1"]).ok();
    server.end_by("TERM");
    assert!(!path.exists(), "it goes with its server");
}

#[test]
fn a_token_is_in_no_log_and_no_list_of_processes() {
    let folder = folder();
    let log = folder.path().join("log");
    let server = Server::logging(&["--log", "trace"], &log);
    let file = server.token_file.clone().expect("it says where its token is");
    let text = fs::read_to_string(&file).expect("its user reads it");
    let token = text.lines().next().expect("a line");
    assert_eq!(token.len(), 32);

    // Shown by the command, by a browser, wrongly; and half of it.
    server.nappe(&["create", "demo", "--id", "seen"]).ok();
    server.nappe(&["step", "seen", "2"]).ok();
    let wrong = folder.path().join("wrong.token");
    write_private(&wrong, WRONG);
    server.nappe(&["list", "--token", wrong.to_str().expect("UTF-8")]);
    for shown in [token, WRONG, &token[..16]] {
        browse(&server, shown);
    }

    // Given for a link, of which the second was never good.
    let made = server.nappe(&["view", "--web"]).ok().json();
    let link = made["url"].as_str().expect("an address");
    let code = link.rsplit('#').next().expect("a code");
    assert!(opened(link).contains(token));
    opened(&link.replace(code, WRONG));

    for place in ["cmdline", "environ"] {
        let place = format!("/proc/{}/{place}", server.id());
        if let Ok(text) = fs::read(place) {
            assert!(!String::from_utf8_lossy(&text).contains(token));
        }
    }
    server.end_by("TERM");
    let log = fs::read_to_string(log).expect("the log");
    assert!(log.contains("TRACE"), "everything is logged");
    for secret in [token, WRONG, &token[..16], &token[16..], code] {
        let line = log.lines().find(|line| line.contains(secret));
        assert!(line.is_none(), "{line:?}");
    }
}

/// Calls as a web page does.
fn browse(server: &Server, token: &str) {
    let mut stream = TcpStream::connect(server.url.trim_start_matches("http://")).expect("accepted");
    let head = format!(
        "POST /nappe.v1.SimulationService/GetServerInfo HTTP/1.1\r\nHost: localhost\r\nConnection: close\r\n\
         Content-Type: application/grpc-web+proto\r\nContent-Length: 5\r\nAuthorization: Bearer {token}\r\n\r\n"
    );
    stream.write_all(&[head.as_bytes(), &[0; 5]].concat()).expect("sent");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    let mut answer = String::new();
    // The message is no text, which does not matter here.
    let _ = stream.read_to_string(&mut answer);
    assert!(!answer.contains(token));
}

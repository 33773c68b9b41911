//! Links to the page as users meet them: printed by `serve`, `connect` and `view --web`, good once, and in no log unasked.

use std::{
    fs,
    io::{Read as _, Write as _},
    net::TcpStream,
    process::Stdio,
};

use crate::support::{Lines, PATIENCE, Server, command, end_by, folder, nappe, until};

/// What a server answers to a request of HTTP/1.1, given without its line ends.
fn answer(server: &str, head: &str, body: &[u8]) -> String {
    let head = format!("{head}\nHost: {server}\nConnection: close\nContent-Length: {}\n\n", body.len());
    let mut stream = TcpStream::connect(server).expect("accepted");
    stream.set_read_timeout(Some(PATIENCE)).expect("set");
    stream.write_all(&[head.replace('\n', "\r\n").as_bytes(), body].concat()).expect("sent");
    let mut answer = Vec::new();
    stream.read_to_end(&mut answer).expect("answered");
    String::from_utf8_lossy(&answer).into_owned()
}

/// What the server of an address answers to a code without a token, as a web page asks it.
pub(crate) fn opened(link: &str) -> String {
    let (place, code) = link.strip_prefix("http://").and_then(|rest| rest.split_once('#')).expect(link);
    let server = place.split('/').next().expect("an address");
    let message = [&[0x0a, code.len() as u8][..], code.as_bytes()].concat();
    let frame = [&[0, 0, 0, 0, message.len() as u8][..], &message].concat();
    let head = "POST /nappe.v1.SimulationService/OpenLink HTTP/1.1\nContent-Type: application/grpc-web+proto";
    answer(server, head, &frame)
}

/// The token in the file that a server left.
fn token(server: &Server) -> String {
    let text = fs::read_to_string(server.token_file.as_ref().expect("a file")).expect("its user reads it");
    text.lines().next().expect("a line").to_owned()
}

#[test]
fn view_makes_a_link_to_the_list_or_to_a_session_and_it_gives_the_token_once() {
    let server = Server::start();
    let token = token(&server);
    server.nappe(&["create", "demo", "--id", "shown"]).ok();
    for (args, place) in
        [(&["view", "--web"][..], "/#"), (&["view", "shown", "--web"][..], "/?session=shown#")]
    {
        let made = server.nappe(args).ok();
        let said = made.json();
        assert_eq!(said["expires_in_seconds"], 600.0);
        let link = said["url"].as_str().expect("an address");
        assert!(link.starts_with(&format!("{}{place}", server.url)), "{link}");
        assert!(!made.stdout.contains(&token) && !made.stderr.contains(&token));
        assert!(opened(link).contains(&token), "it gives the token");
        let again = opened(link);
        assert!(again.contains("grpc-status: 5") && !again.contains(&token), "once: {again}");
    }

    // For people the address stands alone on a line, for `$(nappe view --web)`.
    let made = nappe(&["view", "--web", "--server", &server.url]).ok();
    assert_eq!(made.stdout.lines().count(), 1, "{made:?}");
    assert!(opened(made.stdout.trim()).contains(&token));
    assert!(made.stderr.contains("once") && made.stderr.contains("10 minutes"), "{made:?}");
}

#[test]
fn an_address_by_name_becomes_the_one_that_the_server_listens_on() {
    let server = Server::start();
    let port = server.url.rsplit(':').next().expect("a port");
    let made = nappe(&["view", "--web", "--server", &format!("localhost:{port}")]).ok();
    assert!(made.stdout.starts_with(&format!("http://127.0.0.1:{port}/#")), "{made:?}");
}

#[test]
fn a_link_needs_a_session_that_is_there_and_goes_with_nothing_of_rerun() {
    let server = Server::start();
    let missing = server.nappe(&["view", "nobody", "--web"]);
    assert_eq!(missing.code, Some(5), "{missing:?}");
    assert!(missing.stderr.contains("SESSION_NOT_FOUND"), "{}", missing.stderr);
    for wrong in [
        &["view"][..],
        &["view", "--open"],
        &["view", "shown", "--open"],
        &["view", "--web", "--connect"],
        &["view", "--web", "--save", "x.rrd"],
        &["view", "--web", "--force"],
        &["view", "--web", "--color", "speed"],
        &["view", "--web", "--grid", "smoke"],
        &["view", "--web", "--server", "unix:x.sock"],
    ] {
        let done = nappe(wrong);
        assert_eq!((done.code, done.stdout.as_str()), (Some(2), ""), "{wrong:?}: {done:?}");
    }
    assert_eq!(nappe(&["view", "--web", "--server", "http://127.0.0.1:1"]).code, Some(4));
}

#[test]
#[cfg(target_os = "linux")]
fn a_browser_is_started_where_that_is_asked_for_and_nowhere_else() {
    use std::process::Command;

    use crate::support::run_to_end;

    let server = Server::start();
    let here = folder();
    let [opener, seen] = ["xdg-open", "seen"].map(|name| here.path().join(name));
    let browser = |what: &str| {
        // A shell writes it: a file that a process of this test still holds open for writing cannot be started.
        let write = ["-c", "printf %s \"$1\" > \"$2\" && chmod +x \"$2\"", "sh", what];
        assert!(Command::new("sh").args(write).arg(&opener).status().expect("there is a shell").success());
    };
    let view = |args: &[&str]| {
        let mut view = command();
        view.args(["view", "--web", "--json", "--server", &server.url]).args(args);
        run_to_end(view.env("PATH", format!("{}:/usr/bin:/bin", here.path().display())))
    };

    browser(&format!("#!/bin/sh\nprintf %s \"$*\" > '{}'\n", seen.display()));
    view(&[]).ok();
    assert!(!seen.exists(), "a link is printed and nothing else");
    let made = view(&["--open"]).ok();
    until("the browser has the address", || fs::read_to_string(&seen).is_ok_and(|seen| !seen.is_empty()));
    let url = fs::read_to_string(&seen).expect("an address");
    assert_eq!(made.json()["url"], url);

    // Where there is no browser, the link is printed all the same.
    browser("#!/bin/sh\nexit 3\n");
    let failed = view(&["--open"]);
    assert_eq!(failed.code, Some(1), "{failed:?}");
    assert!(failed.stderr.contains("no browser was started") && failed.stderr.contains("by hand"));
    assert!(opened(failed.json()["url"].as_str().expect("an address")).contains(&token(&server)));
}

#[test]
fn serve_prints_a_link_where_it_is_asked_for_and_the_address_where_no_token_is() {
    let mut serve = command();
    serve.args(["serve", "--address", "127.0.0.1:0", "--link"]).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut process = serve.spawn().expect("the server starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    let line = lines.with("in a browser");
    let link = line.rsplit(' ').next().expect("an address");
    assert!(opened(link).contains("grpc-status:0"), "it is good: {line}");
    assert!(opened(link).contains("grpc-status: 5"), "once");
    let (server, _) = link.trim_start_matches("http://").split_once('/').expect("an address");
    let page = answer(server, "GET / HTTP/1.1", b"");
    assert!(page.starts_with("HTTP/1.1 200 ") && page.contains("<!doctype html"), "it leads to the page");
    end_by(&mut process, "TERM");
    assert!(lines.rest().is_empty(), "and nothing else");

    let mut open = command();
    open.args(["serve", "--address", "127.0.0.1:0", "--no-token"]);
    let mut process = open.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the server starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    let line = lines.with("in a browser");
    assert!(line.ends_with('/') && !line.contains('#'), "whoever reaches it may call: {line}");
    end_by(&mut process, "TERM");
}

#[test]
fn serve_prints_as_many_links_as_are_asked_for_and_each_is_good_once() {
    let mut serve = command();
    serve.args(["serve", "--address", "127.0.0.1:0", "--links", "3"]);
    let mut process = serve.stdout(Stdio::piped()).stderr(Stdio::null()).spawn().expect("the server starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    assert!(lines.with("in 3 browsers").ends_with("good once and for 10 minutes each:"));
    // The last is looked for, so that all are printed.
    let links = [lines.with("http://"), lines.with("http://"), lines.with("http://")];
    for (i, link) in links.iter().enumerate() {
        assert!(!links[..i].contains(link), "{links:?}");
        assert!(opened(link).contains("grpc-status:0"), "it is good: {link}");
        assert!(opened(link).contains("grpc-status: 5"), "once: {link}");
    }
    end_by(&mut process, "TERM");
    assert!(lines.rest().is_empty(), "and no other");

    for wrong in [&["0"][..], &["65"], &["many"], &["3", "--json"], &["3", "--link"]] {
        let done = nappe(&[&["serve", "--address", "127.0.0.1:0", "--links"], wrong].concat());
        assert_eq!((done.code, done.stdout.as_str()), (Some(2), ""), "{wrong:?}: {done:?}");
    }
    let done = nappe(&["serve", "--address", "unix:/nowhere/socket", "--links", "3"]);
    assert_eq!(done.code, Some(2), "{done:?}");
    assert!(done.stderr.contains("browsers cannot reach a Unix socket"), "{}", done.stderr);
}

#[test]
fn no_link_stands_in_a_file_or_a_pipe_unasked_and_the_way_to_one_does() {
    let here = folder();
    let log = here.path().join("serve.log");
    let mut serve = command();
    serve.args(["serve", "--address", "127.0.0.1:0"]).stderr(Stdio::null());
    let mut process =
        serve.stdout(fs::File::create(&log).expect("a file")).spawn().expect("the server starts");
    let said = || fs::read_to_string(&log).expect("a text");
    until("it says how a browser comes in", || {
        said().contains("a link for a browser: ") && said().ends_with('\n')
    });
    let said = said();
    assert!(!said.contains('#'), "{said}");
    let way = said.lines().last().and_then(|line| line.split_once("nappe ")).expect("a command").1;
    let made = nappe(&way.split(' ').collect::<Vec<_>>()).ok();
    assert!(opened(made.stdout.trim()).contains("grpc-status:0"), "{way}: {made:?}");
    end_by(&mut process, "TERM");

    let done = nappe(&["serve", "--address", "127.0.0.1:0", "--link", "--json"]);
    assert_eq!((done.code, done.stdout.as_str()), (Some(2), ""), "{done:?}");
}

#[test]
#[cfg(unix)]
fn a_server_on_a_unix_socket_prints_no_link() {
    let here = folder();
    let address = format!("unix:{}", here.path().join("nappe.sock").display());
    let mut serve = command();
    serve.args(["serve", "--address", &address, "--link"]).stdout(Stdio::piped()).stderr(Stdio::null());
    let mut process = serve.spawn().expect("the server starts");
    let lines = Lines::of(process.stdout.take().expect("a pipe"));
    lines.with("serves on");
    end_by(&mut process, "TERM");
    let said = lines.rest().join("\n");
    assert!(!said.contains("browser"), "{said}");
}

//! `nappe-viewer`, the program that shows and records sessions in Rerun, as this command starts it.
//!
//! Enters: `NAPPE_VIEWER`, what stands beside this command or on PATH; a server, a session, what is kept of it. Leaves:
//! a child, which is told by its command line and its standard input, and answers in lines of JSON.

mod lines;
mod child;
mod program;

use std::{
    ffi::{OsStr, OsString},
    path::{Path, PathBuf},
};

use nappe_client::Token;

pub(crate) use self::{
    child::{Child, Failure, Shown},
    program::Viewer,
};
use crate::options::args::TokenArgs;

/// Whom what a child notes is for, and where its standard error goes.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Form {
    /// A recording: the last lines of standard error are told if the child ends without an answer.
    Recording,
    /// A view on a screen: it may outlive this command, and keeps its standard error.
    View,
}

/// A server, as a viewer is told of it.
#[derive(Clone, Debug)]
pub(crate) struct Place {
    url: String,
    token: Shows,
}

/// What a viewer shows to a server.
#[derive(Clone, Debug)]
enum Shows {
    /// The token that it finds, if there is one.
    Found,
    /// The token in a file.
    File(PathBuf),
    /// A token that stands in no file: it goes through standard input, since every user may read arguments.
    Told(Token),
}

impl Place {
    /// The server at an address that the command line names.
    pub(crate) fn at(address: &str, token: &TokenArgs) -> Self {
        let token = token.file.clone().map_or(Shows::Found, Shows::File);
        Self { url: address.to_owned(), token }
    }

    /// A server in this process.
    pub(crate) fn here(url: String, token: Option<&Token>) -> Self {
        Self { url, token: token.cloned().map_or(Shows::Found, Shows::Told) }
    }

    /// How a command line names it.
    fn options(&self) -> Vec<OsString> {
        let mut options: Vec<OsString> = vec!["--server".into(), self.url.clone().into()];
        match &self.token {
            Shows::Found => {}
            Shows::File(path) => options.extend(["--token".into(), path.into()]),
            Shows::Told(_) => options.extend(["--token".into(), "-".into()]),
        }
        options
    }

    /// The token that is told on standard input.
    fn told(&self) -> Option<&Token> {
        match &self.token {
            Shows::Told(token) => Some(token),
            Shows::Found | Shows::File(_) => None,
        }
    }
}

/// The address of a viewer that runs: `HOST:PORT`, or as Rerun writes it; an empty text stands for none.
///
/// # Errors
/// What is an address of something else.
pub(crate) fn address(typed: &str) -> Result<String, String> {
    match typed.split_once("://") {
        None if typed.is_empty() => Ok(String::new()),
        None => Ok(format!("rerun+http://{typed}/proxy")),
        Some((scheme, _)) if scheme.starts_with("rerun") => Ok(typed.to_owned()),
        Some((_, rest)) => {
            let place = rest.split('/').next().unwrap_or_default();
            Err(format!("a Rerun viewer is reached at {place}, or in full at rerun+http://{place}/proxy"))
        }
    }
}

/// Options of a session's recording, which is called as the file at a path, and written at a place.
pub(crate) fn recording(session_id: &str, path: &Path, place: &Path) -> Vec<OsString> {
    let mut options = saved(session_id, place);
    if let Some(stem) = path.file_stem() {
        options.push(joined("--name=", stem));
    }
    options
}

/// Options of a session's recording in a file, which is called as the session.
pub(crate) fn saved(session_id: &str, path: &Path) -> Vec<OsString> {
    let mut options = session(session_id);
    options.push(joined("--save=", path.as_os_str()));
    options
}

/// The option that names a session.
pub(crate) fn session(session_id: &str) -> Vec<OsString> {
    vec![format!("--session={session_id}").into()]
}

/// An option and its value in one word, whatever the value begins with.
fn joined(option: &str, value: &OsStr) -> OsString {
    let mut word = OsString::from(option);
    word.push(value);
    word
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_token_stands_in_no_argument() {
        let token = Token::parse("0123456789abcdef").expect("a token");
        let here = Place::here("http://127.0.0.1:1".to_owned(), Some(&token));
        assert_eq!(here.options(), ["--server", "http://127.0.0.1:1", "--token", "-"]);
        assert_eq!(here.told().map(Token::reveal), Some("0123456789abcdef"));
        let file = TokenArgs { file: Some("my.token".into()) };
        assert_eq!(Place::at("unix:s", &file).options(), ["--server", "unix:s", "--token", "my.token"]);
        assert_eq!(Place::at("unix:s", &TokenArgs::default()).options(), ["--server", "unix:s"]);
    }

    #[test]
    fn a_viewer_is_reached_at_a_host_and_a_port() {
        let full = "rerun+http://localhost:9876/proxy";
        assert_eq!(address("localhost:9876").as_deref(), Ok(full));
        assert_eq!(address(full).as_deref(), Ok(full));
        assert_eq!(address("").as_deref(), Ok(""));
        assert!(address("http://localhost:9876/x").is_err_and(|error| error.contains(full)));
    }

    #[test]
    fn names_that_look_like_options_stay_names() {
        let options = recording("-x", Path::new("-y.rrd"), Path::new("-y.rrd.new"));
        assert_eq!(options, ["--session=-x", "--save=-y.rrd.new", "--name=-y"]);
    }
}

//! The page of a server in a browser: its address, a link that lets one browser in, and the browser itself.

use std::{
    io::{self, IsTerminal as _},
    process::{Command, Stdio},
    thread,
    time::{Duration, Instant},
};

use clap::Args;
use nappe_client::{Client, ClientError};

use crate::words::error::{CliError, Result};

/// What opens an address on this system, and its arguments before the address.
const OPENER: (&str, &[&str]) = if cfg!(windows) {
    ("rundll32", &["url.dll,FileProtocolHandler"])
} else if cfg!(target_os = "macos") {
    ("open", &[])
} else {
    ("xdg-open", &[])
};
/// How long it may take to say that it cannot; one that takes longer is a browser.
const PATIENCE: Duration = Duration::from_secs(2);

/// The option of verbs that print a link when a server is there.
#[derive(Args, Clone, Copy, Debug)]
pub(crate) struct LinkArgs {
    /// Print a link that lets a browser in, also into a file or a pipe: whoever reads it first has the token
    #[arg(long, conflicts_with = "json")]
    link: bool,
}

impl LinkArgs {
    /// Whether a link is printed: on a terminal, which nobody else reads, or where it is asked for.
    pub(crate) fn is_wanted(self) -> bool {
        self.link || io::stdout().is_terminal()
    }
}

/// A link to the page of a server.
pub(crate) struct Link {
    pub(crate) url: String,
    /// Seconds for which it is good.
    pub(crate) expires_in_seconds: f64,
}

impl Link {
    /// Makes a link to the list of sessions, or to one of them.
    ///
    /// # Errors
    /// The server's, and when there is none any more.
    pub(crate) async fn make(
        client: &Client,
        session_id: Option<&str>,
    ) -> std::result::Result<Self, ClientError> {
        let made = client.make_link().await?;
        let query = session_id.map(|id| format!("?session={id}")).unwrap_or_default();
        let place = client.endpoint().trim_end_matches('/');
        let url = format!("{place}/{query}#{}", made.code);
        Ok(Self { url, expires_in_seconds: made.expires_in_seconds })
    }

    /// What it is good for, in words.
    pub(crate) fn told(&self) -> String {
        format!("good once and for {} minutes", (self.expires_in_seconds / 60.0).round())
    }
}

/// Has the system's browser open an address.
///
/// # Errors
/// When the system has none, or says so within two seconds.
pub(crate) fn open(url: &str) -> Result<()> {
    let (program, arguments) = OPENER;
    let failed = |cause: String| {
        CliError::failure(format!("no browser was started: {program}: {cause}"))
            .hint("open the address that is printed above by hand")
    };
    let mut command = Command::new(program);
    command.args(arguments).arg(url).stdin(Stdio::null()).stdout(Stdio::null()).stderr(Stdio::null());
    let mut child = command.spawn().map_err(|error| failed(error.to_string()))?;
    let begin = Instant::now();
    while begin.elapsed() < PATIENCE {
        match child.try_wait() {
            Ok(Some(status)) if status.success() => return Ok(()),
            Ok(Some(status)) => return Err(failed(status.to_string())),
            Ok(None) => thread::sleep(Duration::from_millis(20)),
            Err(error) => return Err(failed(error.to_string())),
        }
    }
    Ok(())
}

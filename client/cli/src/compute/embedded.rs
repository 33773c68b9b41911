//! A server inside this command, on a free loopback port, for the demo, `run` and `mecasim`.
//!
//! The command still talks to it through gRPC, so what it shows is what a remote client gets.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use nappe_client::Client;
use nappe_server::{App, Config, Limits, RankSettings, TokenPlace};

use crate::{
    outside::viewer::Place,
    words::error::{CliError, Result},
};

/// How long the server waits for this command to take a frame (s): a disk may be slow.
const STALL_SECONDS: f64 = 3600.0;
/// More than any file of a session has (bytes): the memory of the machine is the limit.
const FILE_BYTES: u64 = 1 << 44;

/// A running server and a client connected to it.
#[derive(Debug)]
pub(crate) struct Embedded {
    app: App,
    /// A client of that server.
    pub(crate) client: Client,
}

impl Embedded {
    /// Starts a server, which starts ranks so, and connects to it.
    ///
    /// # Errors
    /// When the system gives no port, or the connection fails.
    pub(crate) async fn start(ranks: RankSettings) -> Result<Self> {
        Self::within(ranks, Limits::default()).await
    }

    /// The same for a run that is kept: the file of a session may be as large as there is memory.
    ///
    /// # Errors
    /// As [`Self::start`].
    pub(super) async fn for_files(ranks: RankSettings) -> Result<Self> {
        let limits = Limits {
            max_mesh_bytes: FILE_BYTES,
            max_mesh_store_bytes: FILE_BYTES,
            max_request_bytes: FILE_BYTES,
            ..Limits::default()
        };
        Self::within(ranks, limits).await
    }

    async fn within(ranks: RankSettings, limits: Limits) -> Result<Self> {
        let address = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0).into();
        // Nobody else on this machine gets in, and nobody has to be told the token.
        let token_place = TokenPlace::Memory;
        // Whoever runs it asks for as many ranks as he has.
        let limits = Limits { max_ranks: Some(u32::MAX), ..limits };
        let config = Config {
            address,
            token_place,
            watcher_stall_seconds: STALL_SECONDS,
            ranks,
            limits,
            ..Config::default()
        };
        let app = App::start(config)
            .map_err(|error| CliError::failure(format!("cannot start a server in this command: {error}")))?;
        let token =
            app.token().ok_or_else(|| CliError::failure("the server in this command has no token"))?;
        let client = Client::connect_with(&app.url(), token).await?;
        Ok(Self { app, client })
    }

    /// The server, as a viewer is told of it.
    pub(crate) fn place(&self) -> Place {
        Place::here(self.app.url(), self.app.token())
    }

    /// Ends the server and every session on it.
    pub(crate) async fn shutdown(self) {
        drop(self.client);
        self.app.shutdown().await;
    }
}

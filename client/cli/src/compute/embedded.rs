//! A server inside this command, on a free loopback port, for the demo, `run` and `mecasim`.
//!
//! The command still talks to it through gRPC, so what it shows is what a remote client gets.

use std::net::{IpAddr, Ipv4Addr, SocketAddr};

use nappe_client::Client;
use nappe_server::{App, Config};

use crate::error::{CliError, Result};

/// A running server and a client connected to it.
#[derive(Debug)]
pub(crate) struct Embedded {
    app: App,
    /// A client of that server.
    pub(crate) client: Client,
}

impl Embedded {
    /// Starts a server and connects to it.
    ///
    /// # Errors
    /// When the system gives no port, or the connection fails.
    pub(crate) async fn start() -> Result<Self> {
        let address = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), 0);
        let app = App::start(Config { address, ..Config::default() })
            .map_err(|error| CliError::failure(format!("cannot start a server in this command: {error}")))?;
        let client = Client::connect(&app.url()).await?;
        Ok(Self { app, client })
    }

    /// Ends the server and every session on it.
    pub(crate) async fn shutdown(self) {
        drop(self.client);
        self.app.shutdown().await;
    }
}

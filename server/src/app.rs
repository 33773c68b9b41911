//! The server as a value: start, address, shutdown.
//!
//! Enters: a configuration. Leaves: a running server, until it is shut down or dropped.

use std::{
    io,
    net::{SocketAddr, TcpListener},
    sync::Arc,
    time::Duration,
};

use thiserror::Error;
use tokio::{runtime::Handle, task::JoinHandle};
use tokio_util::sync::CancellationToken;
use tonic_health::{ServingStatus, server::HealthReporter};

use crate::{
    config::Config,
    rpc::Shared,
    transport::{ListenerSettings, router, serve},
};

/// Name of the service in health checks.
const SERVICE: &str = "nappe.v1.SimulationService";

/// Longest time in a configuration: a day.
const MAX_SECONDS: f64 = 86_400.0;

/// A server that could not be started.
#[derive(Debug, Error)]
pub enum StartError {
    /// An address that other machines reach, without the flag.
    #[error(
        "refusing to listen on {0}: other machines could reach it, and there is no encryption and no \
         authentication yet. Listen on 127.0.0.1 and forward the port (ssh -L), or give --allow-remote \
         on a network that you trust"
    )]
    Remote(SocketAddr),
    /// The system refused the address.
    #[error("cannot listen on {address}: {source}")]
    Bind {
        /// The address that was asked for.
        address: SocketAddr,
        /// What the system answered.
        source: io::Error,
    },
    /// A time of the configuration outside its range.
    #[error("{name} is {value}: allowed are 0 to {MAX_SECONDS} seconds")]
    BadSeconds {
        /// The name of the setting.
        name: &'static str,
        /// The value that it has (s).
        value: f64,
    },
    /// The caller runs in no tokio runtime.
    #[error("the server runs in a tokio runtime, and there is none")]
    NoRuntime,
}

/// A running server. Dropping it begins a shutdown without waiting for it.
#[derive(Debug)]
pub struct App {
    address: SocketAddr,
    shared: Arc<Shared>,
    draining: CancellationToken,
    server: Option<JoinHandle<()>>,
    health: HealthReporter,
}

impl App {
    /// Binds the address and serves from now on, in the tokio runtime of the caller.
    ///
    /// # Errors
    /// If the address is refused, or there is no runtime.
    pub fn start(config: Config) -> Result<Self, StartError> {
        let runtime = Handle::try_current().map_err(|_none| StartError::NoRuntime)?;
        config.check()?;
        let requested = config.address;

        let failed = |source| StartError::Bind { address: requested, source };
        let listener = TcpListener::bind(requested).map_err(failed)?;
        listener.set_nonblocking(true).map_err(failed)?;
        let address = listener.local_addr().map_err(failed)?;
        let listener = tokio::net::TcpListener::from_std(listener).map_err(failed)?;

        let draining = CancellationToken::new();
        let settings = ListenerSettings {
            max_connections: config.limits.max_connections,
            max_connections_per_address: config.limits.max_connections_per_address,
            max_streams: config.limits.max_streams_per_connection,
            handshake: Duration::from_secs_f64(config.handshake_seconds),
            drain: Duration::from_secs_f64(config.drain_seconds),
            draining: draining.clone(),
        };

        let shared = Arc::new(Shared::new(config, draining.clone()));
        let health = HealthReporter::new();
        let handler = router(&shared, &health);
        let server = runtime.spawn({
            let health = health.clone();
            async move {
                health.set_service_status(SERVICE, ServingStatus::Serving).await;
                serve(listener, handler, settings).await;
            }
        });
        Ok(Self { address, shared, draining, server: Some(server), health })
    }

    /// The address that the server listens on, with the port that it got.
    pub fn local_addr(&self) -> SocketAddr {
        self.address
    }

    /// The URL that clients connect to.
    pub fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// Drains: health turns NOT_SERVING, new calls are refused, streams end with `SERVER_DRAINING`,
    /// sessions end. Connections that are left after `drain_seconds` are cut.
    pub async fn shutdown(mut self) {
        self.health.set_service_status(SERVICE, ServingStatus::NotServing).await;
        self.health.set_service_status("", ServingStatus::NotServing).await;
        self.draining.cancel();

        let patience = Duration::from_secs_f64(self.shared.config.drain_seconds);
        let server = self.server.take();
        let connections = async {
            if let Some(server) = server
                && let Err(error) = server.await
            {
                tracing::error!("the listener panicked: {error}");
            }
        };
        tokio::join!(connections, self.shared.registry.end_all(patience));
    }

    /// Makes the next step of a session panic, as a bug would; false if there is no such session.
    /// For tests of isolation.
    #[doc(hidden)]
    pub fn inject_panic(&self, session_id: &str) -> bool {
        self.shared.registry.get(session_id).map(|session| session.inject_panic()).is_ok()
    }
}

impl Drop for App {
    fn drop(&mut self) {
        self.draining.cancel();
    }
}

impl Config {
    fn check(&self) -> Result<(), StartError> {
        if !self.address.ip().is_loopback() && !self.allow_remote {
            return Err(StartError::Remote(self.address));
        }

        for (name, value) in [
            ("drain_seconds", self.drain_seconds),
            ("handshake_seconds", self.handshake_seconds),
            ("request_seconds", self.request_seconds),
            ("upload_idle_seconds", self.upload_idle_seconds),
        ] {
            if !(0.0..=MAX_SECONDS).contains(&value) {
                return Err(StartError::BadSeconds { name, value });
            }
        }
        Ok(())
    }

    /// How long a request may take to arrive whole.
    pub(crate) fn request_time(&self) -> Duration {
        Duration::from_secs_f64(self.request_seconds)
    }

    /// How long an upload may pause.
    pub(crate) fn upload_idle(&self) -> Duration {
        Duration::from_secs_f64(self.upload_idle_seconds)
    }
}

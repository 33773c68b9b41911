//! The server as a value: start, address, shutdown.
//!
//! Enters: a configuration. Leaves: a running server, until it is shut down or dropped.

use std::{
    io,
    net::SocketAddr,
    path::{Path, PathBuf},
    sync::Arc,
    time::{Duration, Instant},
};

use nappe_proto::token::Token;
use tokio::{runtime::Handle, task::JoinHandle};
use tokio_util::sync::CancellationToken;
use tonic_health::{ServingStatus, server::HealthReporter};

use crate::{
    address::Address,
    config::Config,
    links,
    rpc::{Shared, UploadTimes, restore},
    start_error::{LEAST_RANK_SILENCE, MAX_SECONDS, StartError},
    state::StateFolder,
    token_keeper,
    transport::{Listener, ListenerSettings, router, serve},
    trim,
};

/// Name of the service in health checks.
const SERVICE: &str = "nappe.v1.SimulationService";

/// Time between two looks for sessions that nobody uses, for passes that end, and for refusals that were counted.
const LOOK_INTERVAL: Duration = Duration::from_millis(500);

/// A running server. Dropping it begins a shutdown without waiting for it.
#[derive(Debug)]
pub struct App {
    address: Address,
    shared: Arc<Shared>,
    draining: CancellationToken,
    server: Option<JoinHandle<()>>,
    health: HealthReporter,
    token: Option<Token>,
    /// Where clients of the same user find the token.
    token_path: Option<PathBuf>,
    token_keeper: Option<JoinHandle<()>>,
}

impl App {
    /// Binds the address and serves from now on, in the tokio runtime of the caller.
    ///
    /// # Errors
    /// If the address is refused, or there is no runtime.
    pub fn start(config: Config) -> Result<Self, StartError> {
        let runtime = Handle::try_current().map_err(|_none| StartError::NoRuntime)?;
        config.check()?;
        let state = config.state_dir.as_deref().map(|path| state_folder(path, config.max_state_bytes));
        let state = state.transpose()?;
        let (address, listener) = Listener::bind(&config.address)
            .map_err(|source| StartError::Bind { address: config.address.clone(), source })?;

        let token = token_keeper::token(&config, state.as_deref())?;
        let left = token_keeper::leave(&config, token.as_ref(), &address)?;
        let token_path = left.as_ref().map(|file| file.path().to_owned());

        let draining = CancellationToken::new();
        let shared = Arc::new(Shared::new(config, token.clone(), state, draining.clone()));
        let config = &shared.config;
        let settings = ListenerSettings {
            max_connections: config.limits.max_connections,
            max_connections_per_address: config.limits.max_connections_per_address,
            max_streams: config.limits.max_streams_per_connection,
            handshake: Duration::from_secs_f64(config.handshake_seconds),
            idle: Duration::from_secs_f64(config.idle_seconds),
            drain: Duration::from_secs_f64(config.drain_seconds),
            drain_stall: Duration::from_secs_f64(config.drain_stall_seconds),
            counters: Arc::clone(&shared.counters),
            refusals: Arc::clone(&shared.refusals),
            draining: draining.clone(),
        };

        let health = HealthReporter::new();
        let handler = router(&shared, &health, token.clone());
        let token_keeper = left.map(|file| runtime.spawn(token_keeper::keep(file, draining.clone())));
        let server = runtime.spawn({
            let (health, shared, draining) = (health.clone(), Arc::clone(&shared), draining.clone());
            async move {
                // Who connects meanwhile waits.
                tokio::select! {
                    () = restore(&shared) => {}
                    () = draining.cancelled() => {}
                }
                drop(shared);
                health.set_service_status(SERVICE, ServingStatus::Serving).await;
                serve(listener, handler, settings).await;
            }
        });
        runtime.spawn(look(Arc::clone(&shared), draining.clone()));
        runtime.spawn(trim::keep(Arc::clone(&shared.memory), draining.clone()));
        tracing::info!(
            version = env!("CARGO_PKG_VERSION"),
            %address,
            memory = shared.memory.limit(),
            launcher = config.ranks.launcher,
            limits = ?config.limits,
            "started"
        );
        let server = Some(server);
        Ok(Self { address, shared, draining, server, health, token, token_path, token_keeper })
    }

    /// Where the server listens, with the port that it got.
    pub fn address(&self) -> &Address {
        &self.address
    }

    /// The address of TCP that the server listens on, with the port that it got.
    ///
    /// # Panics
    /// If it listens on a Unix socket: [`Self::address`] tells.
    pub fn local_addr(&self) -> SocketAddr {
        match &self.address {
            Address::Tcp(address) => *address,
            Address::Unix(path) => panic!("the server listens on {}, not on TCP", path.display()),
        }
    }

    /// What clients connect to: a URL, or `unix:PATH`.
    pub fn url(&self) -> String {
        self.address.url()
    }

    /// Links that are good at a time; the oldest of more gives way.
    pub const MOST_LINKS: u64 = links::MOST as u64;

    /// What a browser on this machine opens, once: the address of the page, with a code where a token is asked for. None for
    /// a Unix socket, which no browser opens, and without the feature `page`.
    ///
    /// # Errors
    /// If the system has no random numbers.
    pub fn page_link(&self) -> io::Result<Option<String>> {
        let Some(url) = self.address.page_url().filter(|_| cfg!(feature = "page")) else { return Ok(None) };
        if self.token.is_none() {
            return Ok(Some(url));
        }
        let code = self.shared.links.make(Instant::now())?;
        Ok(Some(format!("{url}#{}", code.reveal())))
    }

    /// What callers must show; none if everybody may call.
    pub fn token(&self) -> Option<&Token> {
        self.token.as_ref()
    }

    /// The file in which clients of the same user find the token, if there is one.
    pub fn token_path(&self) -> Option<&Path> {
        self.token_path.as_deref()
    }

    /// Drains: health turns NOT_SERVING, new calls are refused, streams end with `SERVER_DRAINING`,
    /// sessions end. Connections whose peers take nothing for `drain_stall_seconds` are cut, and so are those that are
    /// left after `drain_seconds`.
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
        self.shared.refusals.tell_rest();
        if let Some(keeper) = self.token_keeper.take() {
            // It ends with the drain; a panic in it was told where it happened.
            let _ = keeper.await;
        }
    }

    /// What reads how many bytes are reserved for sessions, meshes and requests, also while calls are answered. For tests of
    /// memory.
    #[doc(hidden)]
    pub fn reserved(&self) -> Arc<dyn Fn() -> u64 + Send + Sync> {
        let memory = Arc::clone(&self.shared.memory);
        Arc::new(move || memory.used())
    }

    /// Makes the next step of a session panic, as a bug would; false if there is no such session.
    /// For tests of isolation.
    #[doc(hidden)]
    pub fn inject_panic(&self, session_id: &str) -> bool {
        self.shared.registry.get(session_id).map(|session| session.inject_panic()).is_ok()
    }
}

/// Takes the folder of sessions for this server.
fn state_folder(path: &Path, most_bytes: u64) -> Result<Arc<StateFolder>, StartError> {
    let opened = StateFolder::open(path, most_bytes).map(Arc::new);
    opened.map_err(|source| StartError::State { path: path.to_owned(), source })
}

/// Looks now and then for sessions that nobody uses, for passes that end, and for refusals that the log is to be told of.
async fn look(shared: Arc<Shared>, draining: CancellationToken) {
    let mut times = tokio::time::interval(LOOK_INTERVAL);
    loop {
        tokio::select! {
            _ = times.tick() => {
                shared.registry.end_unused();
                shared.end_passes();
                shared.refusals.tell_due(Instant::now());
            }
            () = draining.cancelled() => return,
        }
    }
}

impl Drop for App {
    fn drop(&mut self) {
        self.draining.cancel();
    }
}

impl Config {
    fn check(&self) -> Result<(), StartError> {
        if self.address.is_remote() && !self.allow_remote {
            return Err(StartError::Remote(self.address.clone()));
        }

        for (name, value) in [
            ("drain_seconds", self.drain_seconds),
            ("drain_stall_seconds", self.drain_stall_seconds),
            ("handshake_seconds", self.handshake_seconds),
            ("idle_seconds", self.idle_seconds),
            ("request_seconds", self.request_seconds),
            ("upload_idle_seconds", self.upload_idle_seconds),
            ("watcher_stall_seconds", self.watcher_stall_seconds),
            ("checkpoint_seconds", self.checkpoint_seconds),
        ] {
            if !(0.0..=MAX_SECONDS).contains(&value) {
                return Err(StartError::BadSeconds { name, value });
            }
        }
        let launcher = &self.ranks.launcher;
        if !launcher.contains("{ranks}") || !launcher.contains("{program}") {
            return Err(StartError::Launcher(launcher.clone()));
        }
        let silence = self.ranks.rank_silence;
        if silence < LEAST_RANK_SILENCE || f64::from(silence) > MAX_SECONDS {
            return Err(StartError::RankSilence(silence));
        }
        Ok(())
    }

    /// How long a request may take to arrive whole.
    pub(crate) fn request_time(&self) -> Duration {
        Duration::from_secs_f64(self.request_seconds)
    }

    /// How long a message may wait for a watcher.
    pub(crate) fn watcher_stall(&self) -> Duration {
        Duration::from_secs_f64(self.watcher_stall_seconds)
    }

    /// Time between two states of a session that are kept.
    pub(crate) fn checkpoint_time(&self) -> Duration {
        Duration::from_secs_f64(self.checkpoint_seconds)
    }

    /// How long an upload may take.
    pub(crate) fn upload_times(&self) -> UploadTimes {
        UploadTimes {
            idle: Duration::from_secs_f64(self.upload_idle_seconds),
            whole: Duration::from_secs(self.limits.upload_seconds.into()),
            least_rate: self.limits.min_upload_rate,
        }
    }
}

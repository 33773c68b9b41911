//! Every setting of the server: its default, its unit, its flag and its environment variable.
//!
//! Reads nothing by itself: a program parses it with clap (flags win over the environment, which wins
//! over defaults), and a test writes it down.

use std::{path::PathBuf, time::Duration};

use crate::{
    address::Address,
    machine::memory_bytes,
    numbers::{Least, SECONDS, real, whole},
};

/// Largest piece of a mesh upload, and largest message of a frame (bytes).
pub const PIECE_BYTES: usize = 1 << 20;

/// Where the server listens, whom it answers, how it ends.
#[derive(Clone, Debug, PartialEq, clap::Args)]
pub struct Config {
    /// Address and port to listen on, as localhost:6277, port 0 for a free one; or unix:PATH, a socket that its user alone can
    /// open, and that asks for no token unless one is given.
    #[arg(long, env = "NAPPE_ADDRESS", default_value_t = Config::default().address)]
    pub address: Address,
    /// Allows an address that other machines can reach. There is no encryption: whoever listens on the way
    /// reads the token and everything else.
    #[arg(long, env = "NAPPE_ALLOW_REMOTE")]
    pub allow_remote: bool,
    /// File whose first line is the token that callers must show; without it, a token is drawn at each start.
    #[arg(long = "token", env = "NAPPE_TOKEN_FILE", value_name = "FILE", conflicts_with = "no_token")]
    pub token_file: Option<PathBuf>,
    /// Lets everybody call who reaches the address, as every user of this machine does.
    #[arg(long, env = "NAPPE_NO_TOKEN")]
    pub no_token: bool,
    /// Where clients of the same user find the token.
    #[arg(skip)]
    pub token_place: TokenPlace,
    /// How long a link to the page is good.
    #[arg(skip = Config::default().link_time)]
    pub link_time: Duration,
    /// Web origins whose pages may call the server (scheme://host:port, separated by commas). Pages
    /// served from loopback always may.
    #[arg(long = "allow-origin", env = "NAPPE_ALLOW_ORIGIN", value_delimiter = ',')]
    pub allowed_origins: Vec<String>,
    /// Names under which the server may be called, separated by commas, besides addresses, `localhost` and
    /// the name of the machine: any other is refused, since a web page can make its own name mean this machine.
    #[arg(long = "allow-host", env = "NAPPE_ALLOW_HOST", value_delimiter = ',')]
    pub allowed_hosts: Vec<String>,
    /// Seconds that a drain may take before connections are cut.
    #[arg(long, env = "NAPPE_DRAIN_SECONDS", default_value_t = Config::default().drain_seconds, value_parser = real(SECONDS, Least::From0))]
    pub drain_seconds: f64,
    /// Seconds in which a connection writes nothing before a drain cuts it: its peer takes nothing any more.
    #[arg(long, env = "NAPPE_DRAIN_STALL_SECONDS", default_value_t = Config::default().drain_stall_seconds, value_parser = real(SECONDS, Least::From0))]
    pub drain_stall_seconds: f64,
    /// Seconds in which a new connection has to show the token, or send a whole request where none is asked for, before it
    /// is closed.
    #[arg(long, env = "NAPPE_HANDSHAKE_SECONDS", default_value_t = Config::default().handshake_seconds, value_parser = real(SECONDS, Least::From0))]
    pub handshake_seconds: f64,
    /// Seconds that a connection may be open without a call in progress before it is closed. An open stream is
    /// a call.
    #[arg(long, env = "NAPPE_IDLE_SECONDS", default_value_t = Config::default().idle_seconds, value_parser = real(SECONDS, Least::From0))]
    pub idle_seconds: f64,
    /// Seconds that a request may take to arrive whole; uploads have limits of their own.
    #[arg(long, env = "NAPPE_REQUEST_SECONDS", default_value_t = Config::default().request_seconds, value_parser = real(SECONDS, Least::From0))]
    pub request_seconds: f64,
    /// Seconds that an upload may pause before it is dropped.
    #[arg(long, env = "NAPPE_UPLOAD_IDLE_SECONDS", default_value_t = Config::default().upload_idle_seconds, value_parser = real(SECONDS, Least::From0))]
    pub upload_idle_seconds: f64,
    /// Seconds that a message may wait for a watcher to fetch it, before the watcher's stream ends.
    #[arg(long, env = "NAPPE_WATCHER_STALL_SECONDS", default_value_t = Config::default().watcher_stall_seconds, value_parser = real(SECONDS, Least::From0))]
    pub watcher_stall_seconds: f64,
    /// Folder in which sessions are kept: a server that is started again with it has its sessions. Without it, they end with the
    /// server.
    #[arg(long, env = "NAPPE_STATE_DIR", value_name = "DIR")]
    pub state_dir: Option<PathBuf>,
    /// Seconds between two states of a session that are kept, if something happened; more where taking one would cost more than
    /// 2 % of the stepping.
    #[arg(long, env = "NAPPE_CHECKPOINT_SECONDS", default_value_t = Config::default().checkpoint_seconds, value_parser = real(SECONDS, Least::From0))]
    pub checkpoint_seconds: f64,
    /// Bytes of all files in the folder of sessions.
    #[arg(long, env = "NAPPE_MAX_STATE_BYTES", default_value_t = Config::default().max_state_bytes, value_parser = whole::<u64>(0..))]
    pub max_state_bytes: u64,
    /// How ranks are started.
    #[command(flatten)]
    pub ranks: RankSettings,
    /// Limits on what clients can ask for.
    #[command(flatten)]
    pub limits: Limits,
}

/// How ranks are started that step a session together.
#[derive(Clone, Debug, PartialEq, Eq, clap::Args)]
pub struct RankSettings {
    /// The program that each rank is, built by `cargo ranks` [default: nappe-rank beside this program, or on PATH]
    #[arg(long, env = "NAPPE_RANK_PROGRAM", value_name = "PATH")]
    pub rank_program: Option<PathBuf>,
    /// Host or address at which rank 0 finds the server; other than loopback, the link is open to the network while
    /// ranks start.
    #[arg(long, env = "NAPPE_LINK_ADDRESS", value_name = "HOST", default_value_t = RankSettings::default().link_address)]
    pub link_address: String,
    /// What starts ranks: words separated by spaces, run without a shell. {ranks} stands for their number, {program} for the program.
    #[arg(long, env = "NAPPE_LAUNCHER", value_name = "TEXT", default_value_t = RankSettings::default().launcher)]
    pub launcher: String,
    /// Seconds without a word of ranks that work after which they are lost, 5 or more; rank 0 gives a sign of life every 2 s,
    /// unless it waits for another rank.
    #[arg(long, env = "NAPPE_RANK_SILENCE", value_name = "SECONDS", default_value_t = RankSettings::default().rank_silence, value_parser = whole::<u32>(0..))]
    pub rank_silence: u32,
}

impl Default for RankSettings {
    fn default() -> Self {
        Self {
            rank_program: None,
            link_address: "127.0.0.1".to_owned(),
            launcher: "mpirun -n {ranks} --oversubscribe --bind-to none -x NAPPE_LINK {program}".to_owned(),
            rank_silence: 60,
        }
    }
}

impl Default for Config {
    fn default() -> Self {
        Self {
            address: Address::default(),
            allow_remote: false,
            token_file: None,
            no_token: false,
            token_place: TokenPlace::default(),
            link_time: Duration::from_mins(10),
            allowed_origins: Vec::new(),
            allowed_hosts: Vec::new(),
            drain_seconds: 4.0,
            drain_stall_seconds: 0.4,
            handshake_seconds: 10.0,
            idle_seconds: 300.0,
            request_seconds: 10.0,
            upload_idle_seconds: 30.0,
            watcher_stall_seconds: 30.0,
            state_dir: None,
            checkpoint_seconds: 2.0,
            max_state_bytes: 16 << 30,
            ranks: RankSettings::default(),
            limits: Limits::default(),
        }
    }
}

/// Where clients find a server's token.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum TokenPlace {
    /// In a file of the user's runtime directory, named after the port.
    #[default]
    RuntimeFolder,
    /// With [`crate::App::token`] alone: for a server inside its only client.
    Memory,
}

/// Limits on what clients can ask for; `GetServerInfo` reports them.
#[derive(Clone, Debug, PartialEq, Eq, clap::Args)]
pub struct Limits {
    /// Sessions at a time.
    #[arg(long, env = "NAPPE_MAX_SESSIONS", default_value_t = Limits::default().max_sessions, value_parser = whole::<u32>(0..))]
    pub max_sessions: u32,
    /// Seconds after which a session is deleted that nobody calls, watches or plays; 0: never.
    #[arg(long, env = "NAPPE_IDLE_SESSION_SECONDS", default_value_t = Limits::default().idle_session_seconds, value_parser = whole::<u32>(0..))]
    pub idle_session_seconds: u32,
    /// Watchers of one session at a time.
    #[arg(long, env = "NAPPE_MAX_WATCHERS", default_value_t = Limits::default().max_watchers_per_session, value_parser = whole::<u32>(0..))]
    pub max_watchers_per_session: u32,
    /// Particles of one session.
    #[arg(long, env = "NAPPE_MAX_PARTICLES", default_value_t = Limits::default().max_particles, value_parser = whole::<u64>(0..))]
    pub max_particles: u64,
    /// Springs of one session.
    #[arg(long, env = "NAPPE_MAX_SPRINGS", default_value_t = Limits::default().max_springs, value_parser = whole::<u64>(0..))]
    pub max_springs: u64,
    /// Bytes of one mesh upload.
    #[arg(long, env = "NAPPE_MAX_MESH_BYTES", default_value_t = Limits::default().max_mesh_bytes, value_parser = whole::<u64>(0..))]
    pub max_mesh_bytes: u64,
    /// Bytes of one scene text.
    #[arg(long, env = "NAPPE_MAX_SCENE_BYTES", default_value_t = Limits::default().max_scene_bytes, value_parser = whole::<u64>(0..))]
    pub max_scene_bytes: u64,
    /// Uploaded meshes kept at a time; the one longest unused goes first.
    #[arg(long, env = "NAPPE_MAX_MESHES", default_value_t = Limits::default().max_meshes, value_parser = whole::<u32>(0..))]
    pub max_meshes: u32,
    /// Bytes of all uploaded meshes kept; the one longest unused goes first.
    #[arg(long, env = "NAPPE_MAX_MESH_STORE_BYTES", default_value_t = Limits::default().max_mesh_store_bytes, value_parser = whole::<u64>(0..))]
    pub max_mesh_store_bytes: u64,
    /// Uploads in progress at a time.
    #[arg(long, env = "NAPPE_MAX_UPLOADS", default_value_t = Limits::default().max_uploads, value_parser = whole::<u32>(0..))]
    pub max_uploads: u32,
    /// Seconds that an upload may take.
    #[arg(long, env = "NAPPE_UPLOAD_SECONDS", default_value_t = Limits::default().upload_seconds, value_parser = whole::<u32>(0..))]
    pub upload_seconds: u32,
    /// Bytes per second that an upload has to send once its first 10 s are over; 0 means any.
    #[arg(long, env = "NAPPE_MIN_UPLOAD_RATE", default_value_t = Limits::default().min_upload_rate, value_parser = whole::<u64>(0..))]
    pub min_upload_rate: u64,
    /// Bytes of all requests in progress, uploads included.
    #[arg(long, env = "NAPPE_MAX_REQUEST_BYTES", default_value_t = Limits::default().max_request_bytes, value_parser = whole::<u64>(0..))]
    pub max_request_bytes: u64,
    /// Bytes of all sessions, meshes, histories and requests together; 0 means 80 % of the memory that this
    /// machine, its control group and the limits of the process allow.
    #[arg(long, env = "NAPPE_MAX_SERVER_BYTES", default_value_t = Limits::default().max_server_bytes, value_parser = whole::<u64>(0..))]
    pub max_server_bytes: u64,
    /// Seconds that building a session may be estimated to take, and may take.
    #[arg(long, env = "NAPPE_MAX_BUILD_SECONDS", default_value_t = Limits::default().max_build_seconds, value_parser = whole::<u32>(0..))]
    pub max_build_seconds: u32,
    /// Threads of one session; 0 means as many as there are logical cores.
    #[arg(long, env = "NAPPE_MAX_THREADS", default_value_t = Limits::default().max_threads_per_session, value_parser = whole::<u32>(0..))]
    pub max_threads_per_session: u32,
    /// Ranks of one session, 0: none are started [default: as many as there are logical cores]
    #[arg(long, env = "NAPPE_MAX_RANKS", value_parser = whole::<u32>(0..))]
    pub max_ranks: Option<u32>,
    /// Steps in one `StepSession` call.
    #[arg(long, env = "NAPPE_MAX_STEPS_PER_CALL", default_value_t = Limits::default().max_steps_per_call, value_parser = whole::<u64>(0..))]
    pub max_steps_per_call: u64,
    /// Bytes of frames that a session keeps for watchers that lag or resume.
    #[arg(long, env = "NAPPE_HISTORY_BYTES", default_value_t = Limits::default().history_bytes_per_session, value_parser = whole::<u64>(0..))]
    pub history_bytes_per_session: u64,
    /// Bytes of frames that watchers hold beyond those that sessions keep; above it, the watcher stalled longest ends.
    #[arg(long, env = "NAPPE_MAX_HELD_BYTES", default_value_t = Limits::default().max_held_bytes, value_parser = whole::<u64>(0..))]
    pub max_held_bytes: u64,
    /// Bytes of one request message.
    #[arg(long, env = "NAPPE_MAX_MESSAGE_BYTES", default_value_t = Limits::default().max_message_bytes, value_parser = whole::<u64>(0..))]
    pub max_message_bytes: u64,
    /// Connections at a time.
    #[arg(long, env = "NAPPE_MAX_CONNECTIONS", default_value_t = Limits::default().max_connections, value_parser = whole::<u32>(0..))]
    pub max_connections: u32,
    /// Connections at a time from one address.
    #[arg(long, env = "NAPPE_MAX_CONNECTIONS_PER_ADDRESS", default_value_t = Limits::default().max_connections_per_address, value_parser = whole::<u32>(0..))]
    pub max_connections_per_address: u32,
    /// Calls in progress on one connection.
    #[arg(long, env = "NAPPE_MAX_STREAMS", default_value_t = Limits::default().max_streams_per_connection, value_parser = whole::<u32>(0..))]
    pub max_streams_per_connection: u32,
    /// Changes of parameters that wait for their step, in one session.
    #[arg(long, env = "NAPPE_MAX_PENDING_CHANGES", default_value_t = Limits::default().max_pending_changes, value_parser = whole::<u32>(0..))]
    pub max_pending_changes: u32,
    /// Changes of parameters in one `UpdateParameters` call.
    #[arg(long, env = "NAPPE_MAX_CHANGES_PER_CALL", default_value_t = Limits::default().max_changes_per_call, value_parser = whole::<u32>(0..))]
    pub max_changes_per_call: u32,
    /// Particles that the pulls of one call hold.
    #[arg(long, env = "NAPPE_MAX_PULLS", default_value_t = Limits::default().max_pulls, value_parser = whole::<u32>(0..))]
    pub max_pulls: u32,
    /// Nodes of the snow's grid in one frame, for each watcher.
    #[arg(long, env = "NAPPE_MAX_GRID_NODES", default_value_t = Limits::default().max_grid_nodes, value_parser = whole::<u32>(0..))]
    pub max_grid_nodes: u32,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            max_sessions: 16,
            idle_session_seconds: 0,
            max_watchers_per_session: 64,
            max_particles: 4_000_000,
            max_springs: 40_000_000,
            max_mesh_bytes: 256 << 20,
            max_scene_bytes: 1 << 20,
            max_meshes: 32,
            max_mesh_store_bytes: 1 << 30,
            max_uploads: 4,
            upload_seconds: 600,
            min_upload_rate: 64_000,
            max_request_bytes: 256 << 20,
            max_server_bytes: 0,
            max_build_seconds: 120,
            max_threads_per_session: 0,
            max_ranks: None,
            max_steps_per_call: 10_000_000,
            history_bytes_per_session: 256 << 20,
            max_held_bytes: 512 << 20,
            max_message_bytes: 4 << 20,
            max_connections: 256,
            max_connections_per_address: 64,
            max_streams_per_connection: 128,
            max_pending_changes: 100_000,
            max_changes_per_call: 10_000,
            max_pulls: 4096,
            max_grid_nodes: 1 << 18,
        }
    }
}

impl Limits {
    /// Threads that a session may use: the limit, or every logical core.
    pub fn thread_limit(&self) -> u32 {
        if self.max_threads_per_session == 0 { core_count() } else { self.max_threads_per_session }
    }

    /// Ranks that a session may have: the limit, or as many as there are logical cores.
    pub fn rank_limit(&self) -> u32 {
        self.max_ranks.unwrap_or_else(core_count)
    }

    /// Bytes of sessions, meshes, histories and requests: the limit, or 80 % of what there is.
    pub fn server_bytes(&self) -> u64 {
        if self.max_server_bytes == 0 { memory_bytes() / 5 * 4 } else { self.max_server_bytes }
    }
}

/// Logical cores that this process may use; 1 if the system does not say.
pub fn core_count() -> u32 {
    std::thread::available_parallelism().map_or(1, |count| count.get() as u32)
}

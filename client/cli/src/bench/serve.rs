//! `nappe bench serve`: what streams cost a server that many watch, some of them badly.
//!
//! The server runs in a process of its own, so that its processor time and memory are told from those of the clients.

use std::time::{Duration, Instant};

use clap::Args;
use nappe_client::{Client, CreateSession, Event, FrameStream, Precision, Wait, WatchOptions, v1};
use nappe_server::numbers::whole;
use serde::Serialize;

use super::{
    cloud::cloud,
    loopback::{self, Load},
    process::ServerProcess,
    sample,
};
use crate::{
    outside::remote,
    words::{
        error::Result,
        output::{self, Column, Format, OutputArgs},
    },
};

/// Particles of the sessions that live watchers watch.
const LIVE_PARTICLES: usize = 100_000;
/// Watchers that read everything.
const LIVE_WATCHERS: usize = 8;
/// Frames per second that they read.
const LIVE_HZ: f64 = 60.0;
/// Particles of the sessions whose frames and stalled watchers are measured.
const PARTICLES: usize = 160_000;
/// Watchers that read nothing.
const STALLED_WATCHERS: usize = 100;
/// Steps that are timed together.
const STEPS: u64 = 40;
/// Times that the two cases of a ratio are measured in turn.
const TURNS: usize = 7;
/// Bytes per particle of a frame: a position in binary32.
const PARTICLE_BYTES: f64 = 12.0;

/// What streams cost: stalled watchers, live ones, the making of a frame
#[derive(Args, Debug)]
pub(crate) struct ServeArgs {
    /// Seconds for which live watchers are measured
    #[arg(long, value_name = "S", default_value_t = 10, value_parser = whole::<u64>(1..))]
    seconds: u64,
    #[command(flatten)]
    output: OutputArgs,
}

/// A measurement. These names are stable: scripts read them.
#[derive(Clone, Debug, Default, Serialize)]
struct ServeRow {
    /// `stalled`, `live` or `publish`.
    name: &'static str,
    watchers: usize,
    particles: usize,
    /// Time of a step over that of one without watchers, or without a frame.
    step_ratio: Option<f64>,
    /// What a frame adds to a step (s).
    frame_seconds: Option<f64>,
    /// Processor time of the server per gigabyte that it sends (s).
    cpu_seconds_per_gb: Option<f64>,
    /// The same of a thread that only writes such frames to as many connections, in the same run (s): what ordinary
    /// writes take on this machine in this hour.
    plain_cpu_seconds_per_gb: Option<f64>,
    /// Share of one core that streaming takes.
    core_share: Option<f64>,
    /// Memory of the server per watcher.
    bytes_per_watcher: Option<f64>,
}

/// Runs `nappe bench serve`.
///
/// # Errors
/// When the server cannot be started or measured.
pub(crate) fn run(args: &ServeArgs) -> Result<()> {
    let rows = remote::block_on(async {
        Ok(vec![stalled().await?, live(Duration::from_secs(args.seconds)).await?, publish().await?])
    })?;
    match args.output.format() {
        Format::Json => output::json(&rows),
        Format::Text => output::line(&text(&rows)),
    }
}

fn server() -> Result<ServerProcess> {
    let places = (STALLED_WATCHERS + 28).to_string();
    // Stalled watchers stay until they are measured.
    ServerProcess::start(&[
        "--max-watchers-per-session",
        &places,
        "--max-connections-per-address",
        &places,
        "--watcher-stall-seconds",
        "600",
    ])
}

async fn session(client: &Client, scene: nappe_client::Scene, thread_count: u32) -> Result<v1::Session> {
    let precision = Some(Precision::F32);
    let wanted = CreateSession { scene, precision, thread_count, ..CreateSession::default() };
    Ok(client.create_session(wanted).await?.session)
}

/// Seconds per step, measured over [`STEPS`] of them.
async fn step_seconds(client: &Client, id: &str) -> Result<f64> {
    let start = Instant::now();
    client.step(id, STEPS, Wait::Yes).await?;
    Ok(start.elapsed().as_secs_f64() / STEPS as f64)
}

/// Medians of the seconds per step of two sessions, which are measured in turn.
async fn in_turn(client: &Client, [first, second]: [&str; 2]) -> Result<[f64; 2]> {
    let mut seconds = [Vec::new(), Vec::new()];
    for _ in 0..TURNS {
        seconds[0].push(step_seconds(client, first).await?);
        seconds[1].push(step_seconds(client, second).await?);
    }
    Ok(seconds.map(sample::median))
}

/// Steps of a session with watchers that read nothing, beside one without any.
async fn stalled() -> Result<ServeRow> {
    output::note("stalled watchers ...");
    let server = server()?;
    let client = server.connect().await?;
    let [alone, watched] = [
        session(&client, cloud(&client, PARTICLES, 1e-3, 1).await?, 1).await?,
        session(&client, cloud(&client, PARTICLES, 1e-3, 1).await?, 1).await?,
    ];
    // The histories fill before memory is read.
    for id in [&alone.session_id, &watched.session_id] {
        client.step(id, 200, Wait::Yes).await?;
    }

    let before = server.resident_bytes()?;
    let mut streams: Vec<(Client, FrameStream)> = Vec::new();
    for _ in 0..STALLED_WATCHERS {
        let client = server.connect().await?;
        let mut stream = client.watch(&watched.session_id, WatchOptions::latest(0.0)).await?;
        // The stream is open once its topology is there; nothing is read after that.
        stream.next().await;
        streams.push((client, stream));
    }
    let [alone_seconds, watched_seconds] = in_turn(&client, [&alone.session_id, &watched.session_id]).await?;
    let held = server.resident_bytes()? - before;
    let watchers = client.get_session(&watched.session_id).await?.watcher_count as usize;
    drop(streams);
    Ok(ServeRow {
        name: "stalled",
        watchers,
        particles: PARTICLES,
        step_ratio: Some(watched_seconds / alone_seconds),
        bytes_per_watcher: Some(held / STALLED_WATCHERS as f64),
        ..ServeRow::default()
    })
}

/// Processor time of a session in real time with watchers that read everything, less that without them.
async fn live(time: Duration) -> Result<ServeRow> {
    output::note("live watchers ...");
    let server = server()?;
    let client = server.connect().await?;
    let scene = cloud(&client, LIVE_PARTICLES, 1.0 / LIVE_HZ, 1).await?;
    let session = session(&client, scene, 1).await?;
    let id = session.session_id.as_str();
    client.play(id, 1.0).await?;
    tokio::time::sleep(Duration::from_secs(2)).await;

    let unwatched = cpu_share(&server, time).await?;
    let mut readers = tokio::task::JoinSet::new();
    for _ in 0..LIVE_WATCHERS {
        let client = server.connect().await?;
        let mut stream = client.watch(id, WatchOptions::default()).await?;
        readers.spawn(async move {
            let mut frames = 0_u64;
            while let Some(Ok(event)) = stream.next().await {
                frames += u64::from(matches!(event, Event::Frame(_)));
            }
            frames
        });
    }
    tokio::time::sleep(Duration::from_secs(1)).await;
    let begin = Instant::now();
    let watched = cpu_share(&server, time).await?;
    let measured = begin.elapsed().as_secs_f64();
    client.stop(id).await?;
    let mut frames = 0;
    while let Some(read) = readers.join_next().await {
        frames += read.unwrap_or_default();
    }

    drop(client);
    drop(server);
    let plain = loopback::cpu_seconds_per_gb(Load {
        readers: LIVE_WATCHERS,
        frame_bytes: LIVE_PARTICLES * PARTICLE_BYTES as usize,
        frames_per_second: LIVE_HZ,
        time,
    })?;

    let sent = frames as f64 * LIVE_PARTICLES as f64 * PARTICLE_BYTES / 1e9 / (measured + 1.0);
    let core_share = watched - unwatched;
    Ok(ServeRow {
        name: "live",
        watchers: LIVE_WATCHERS,
        particles: LIVE_PARTICLES,
        cpu_seconds_per_gb: Some(core_share / sent),
        plain_cpu_seconds_per_gb: Some(plain),
        core_share: Some(core_share),
        ..ServeRow::default()
    })
}

/// Processor time that the server uses per second.
async fn cpu_share(server: &ServerProcess, time: Duration) -> Result<f64> {
    let (begin, used) = (Instant::now(), server.cpu_seconds()?);
    tokio::time::sleep(time).await;
    Ok((server.cpu_seconds()? - used) / begin.elapsed().as_secs_f64())
}

/// Steps with a frame each, beside steps without.
async fn publish() -> Result<ServeRow> {
    output::note("frames ...");
    let server = server()?;
    let client = server.connect().await?;
    let [without, with] = [
        session(&client, cloud(&client, PARTICLES, 1e-3, 1_000_000).await?, 0).await?,
        session(&client, cloud(&client, PARTICLES, 1e-3, 1).await?, 0).await?,
    ];
    // Until the history is full, frames take new memory.
    client.step(&with.session_id, 200, Wait::Yes).await?;
    let [without, with] = in_turn(&client, [&without.session_id, &with.session_id]).await?;
    Ok(ServeRow {
        name: "publish",
        watchers: 0,
        particles: PARTICLES,
        step_ratio: Some(with / without),
        frame_seconds: Some(with - without),
        ..ServeRow::default()
    })
}

fn text(rows: &[ServeRow]) -> String {
    let columns = [
        Column::Left("case"),
        Column::Right("watchers"),
        Column::Right("particles"),
        Column::Right("step ratio"),
        Column::Right("per frame"),
        Column::Right("CPU s per GB"),
        Column::Right("plain writes"),
        Column::Right("of a core"),
        Column::Right("MB per watcher"),
    ];
    let number = |value: Option<f64>, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |value| format!("{value:.digits$}"))
    };
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.name.to_owned(),
                row.watchers.to_string(),
                output::count(row.particles as u64),
                number(row.step_ratio, 3),
                row.frame_seconds.map_or_else(|| "-".to_owned(), output::time),
                number(row.cpu_seconds_per_gb, 3),
                number(row.plain_cpu_seconds_per_gb, 3),
                number(row.core_share, 3),
                number(row.bytes_per_watcher.map(|bytes| bytes / 1e6), 2),
            ]
        })
        .collect();
    format!(
        "{}\n\nFree particles, positions in binary32, over loopback; server and clients share this machine.",
        output::table(&columns, &cells)
    )
}

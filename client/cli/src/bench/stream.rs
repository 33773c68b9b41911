//! `nappe bench stream`: frames per second over loopback, from a server in this command to a client.
//!
//! The frames are computed first and kept by the server; then the client watches them all, several
//! times. So the time is that of the stream alone: reading what is kept, gRPC, TCP, decoding.
//! The particles are not joined by springs, which makes no difference to a stream.

use std::time::{Duration, Instant};

use clap::Args;
use nappe_client::{Client, CreateSession, Event, Precision, Wait, WatchOptions, v1};
use nappe_server::numbers::whole;
use serde::Serialize;

use super::{cloud::cloud, row::Row, sample};
use crate::{
    compute::Embedded,
    outside::remote,
    words::{
        error::{CliError, Result},
        output::{self, Column, Format, OutputArgs},
    },
};

/// Bytes per particle of a frame: a position in binary32.
const PARTICLE_BYTES: u64 = 12;
/// Time step of the particles (s).
const DT: f64 = 1e-3;
/// Frames computed at most; small ones would otherwise take thousands.
const MAX_FRAMES: u64 = 200;
/// Least time that the passes over the frames of one size take together (s).
const PASSES_SECONDS: f64 = 3.0;

/// Frames per second from an embedded server to one client over loopback
#[derive(Args, Debug)]
pub(crate) struct StreamArgs {
    /// Particles of a frame
    #[arg(long, value_name = "N,N,...", value_delimiter = ',', default_values_t = [10_000, 100_000, 1_000_000],
          value_parser = whole::<u32>(1..=2_000_000))]
    sizes: Vec<u32>,
    #[command(flatten)]
    output: OutputArgs,
}

#[derive(Serialize)]
struct StreamRow {
    #[serde(flatten)]
    row: Row,
    frame_bytes: u64,
    megabytes_per_second: f64,
    passes: usize,
}

/// Runs `nappe bench stream`.
///
/// # Errors
/// When a frame is lost, or the server refuses the sizes.
pub(crate) fn run(args: &StreamArgs) -> Result<()> {
    let rows = remote::block_on(async {
        let embedded = Embedded::start(nappe_server::RankSettings::default()).await?;
        let rows = measure_all(&embedded.client, &args.sizes).await;
        embedded.shutdown().await;
        rows
    })?;
    match args.output.format() {
        Format::Json => output::json(&rows),
        Format::Text => output::line(&text(&rows)),
    }
}

async fn measure_all(client: &Client, sizes: &[u32]) -> Result<Vec<StreamRow>> {
    let limits = client.server_info().await?.limits.unwrap_or_default();
    let mut rows = Vec::new();
    for &particles in sizes {
        output::note(&format!("{} particles ...", output::count(particles.into())));
        rows.push(measure(client, particles as usize, &limits).await?);
    }
    Ok(rows)
}

async fn measure(client: &Client, particles: usize, limits: &v1::Limits) -> Result<StreamRow> {
    let frame_bytes = particles as u64 * PARTICLE_BYTES;
    // Half of what the server keeps, so that the first frame is still there at the last pass.
    let frames = (limits.history_bytes_per_session / 2 / frame_bytes).clamp(2, MAX_FRAMES);
    let session = client
        .create_session(CreateSession {
            scene: cloud(client, particles, DT, 1).await?,
            precision: Some(Precision::F32),
            ..CreateSession::default()
        })
        .await?
        .session;
    let id = session.session_id.as_str();
    let session = client.step(id, frames, Wait::Yes).await?;

    let seconds = passes(client, &session).await?;
    client.delete_session(id).await?;

    let median_seconds = sample::median(seconds.iter().copied());
    let row = Row {
        name: "stream/every".to_owned(),
        particles,
        threads: session.thread_count as usize,
        precision: "f32",
        median_seconds,
        min_seconds: sample::minimum(seconds.iter().copied()),
        rate: 1.0 / median_seconds,
        unit: "frames/s",
    };
    let megabytes_per_second = frame_bytes as f64 / median_seconds / 1e6;
    Ok(StreamRow { row, frame_bytes, megabytes_per_second, passes: seconds.len() })
}

/// Watches all that is kept, over and over; seconds per frame of each pass.
async fn passes(client: &Client, session: &v1::Session) -> Result<Vec<f64>> {
    let start = Instant::now();
    let mut seconds = Vec::new();
    while seconds.len() < 3 || start.elapsed() < Duration::from_secs_f64(PASSES_SECONDS) {
        seconds.push(pass(client, session).await?);
    }
    Ok(seconds)
}

/// Seconds per frame, from the first to the last that the server keeps.
async fn pass(client: &Client, session: &v1::Session) -> Result<f64> {
    let options = WatchOptions::every_from(session.oldest_frame);
    let mut stream = client.watch(&session.session_id, options).await?;
    let mut first: Option<(Instant, u64)> = None;
    while let Some(event) = stream.next().await {
        let Event::Frame(frame) = event? else { continue };
        match first {
            None => first = Some((Instant::now(), frame.frame)),
            Some((start, from)) if frame.frame >= session.frame => {
                return Ok(start.elapsed().as_secs_f64() / (frame.frame - from) as f64);
            }
            Some(_) => {}
        }
    }
    Err(CliError::failure(format!("the stream ended before frame {}", session.frame)))
}

fn text(rows: &[StreamRow]) -> String {
    let columns = [
        Column::Right("particles"),
        Column::Right("frame size"),
        Column::Right("median"),
        Column::Right("fastest"),
        Column::Right("frames/s"),
        Column::Right("MB/s"),
    ];
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                output::count(row.row.particles as u64),
                format!("{:.2} MB", row.frame_bytes as f64 / 1e6),
                output::time(row.row.median_seconds),
                output::time(row.row.min_seconds),
                format!("{:.1}", row.row.rate),
                format!("{:.0}", row.megabytes_per_second),
            ]
        })
        .collect();
    format!(
        "{}\n\nFrames that the server keeps, read by one client over loopback, positions in binary32; server and client share this machine.",
        output::table(&columns, &cells)
    )
}

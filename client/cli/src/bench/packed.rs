//! `nappe bench packed`: how small the frames of a scene become, and how fast they are packed and unpacked, on one thread.
//!
//! A server in this command computes the frames; positions alone are packed.

use std::time::Instant;

use clap::Args;
use nappe_client::{
    Client, CreateSession, Event, Wait, WatchOptions,
    packed::{Effort, Step, pack, unpack},
};
use nappe_server::numbers::{Least, METRES, real};
use serde::Serialize;

use super::sample;
use crate::{
    compute::Embedded,
    outside::remote,
    words::{
        error::{CliError, Result},
        output::{self, Column, Format, OutputArgs},
    },
};

/// Frames of a scene that are computed, if it has as many; the second half is packed, in which something moves.
const FRAMES: u64 = 64;
/// How often they all are packed and unpacked.
const PASSES: usize = 15;
/// Components of a position, and the bytes of one in binary32.
const COMPONENTS: usize = 3;
const POSITION_BYTES: f64 = 12.0;

/// Bytes per particle of packed frames, and the speed of packing, on one thread
#[derive(Args, Debug)]
pub(crate) struct PackedArgs {
    /// Shipped scenes, of which some frames are packed
    #[arg(long, value_name = "NAME,...", value_delimiter = ',',
          default_values = ["demo", "flag", "two_snowballs", "rolling_snowball"])]
    scenes: Vec<String>,
    /// How far a packed coordinate may be from what it was (m)
    #[arg(long, value_name = "METRES", default_value_t = 6.2e-5, value_parser = real(METRES, Least::Above0))]
    max_error: f64,
    #[command(flatten)]
    output: OutputArgs,
}

/// A scene, packed in one way. These names are stable: scripts read them.
#[derive(Debug, Serialize)]
struct PackedRow {
    scene: String,
    particles: usize,
    /// `key`, or `delta` to the frame before.
    kind: &'static str,
    /// Level of deflate, 1 or 6.
    level: u32,
    bytes_per_particle: f64,
    /// Bytes of binary32 per second, median (MB/s).
    pack_megabytes_per_second: f64,
    unpack_megabytes_per_second: f64,
}

/// What is packed of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Kind {
    /// Its whole numbers, alone.
    Key,
    /// What they differ by from the frame before.
    Delta,
}

/// Runs `nappe bench packed`.
///
/// # Errors
/// When there is no such scene, or no step for the error.
pub(crate) fn run(args: &PackedArgs) -> Result<()> {
    let step = Step::within(args.max_error).ok_or_else(|| {
        CliError::usage(format!("--max-error is {}: it is a number above 0 (m)", args.max_error))
    })?;
    let rows = remote::block_on(async {
        let embedded = Embedded::start(nappe_server::RankSettings::default()).await?;
        let rows = Box::pin(measure_all(&embedded.client, &args.scenes, step)).await;
        embedded.shutdown().await;
        rows
    })?;
    match args.output.format() {
        Format::Json => output::json(&rows),
        Format::Text => output::line(&text(&rows, step)),
    }
}

async fn measure_all(client: &Client, scenes: &[String], step: Step) -> Result<Vec<PackedRow>> {
    let mut rows = Vec::new();
    for scene in scenes {
        output::note(&format!("{scene} ..."));
        let frames = frames(client, scene).await?;
        for effort in [Effort::Fast, Effort::Small] {
            for kind in [Kind::Key, Kind::Delta] {
                rows.push(measure(scene, &frames, step, effort, kind)?);
            }
        }
    }
    Ok(rows)
}

/// Positions of some frames of a scene.
async fn frames(client: &Client, scene: &str) -> Result<Vec<Vec<f32>>> {
    let session = client.create_session(CreateSession::named(scene)).await?.session;
    let id = session.session_id.as_str();
    let steps = FRAMES * u64::from(session.frame_interval_steps);
    let last = client.step(id, steps, Wait::Yes).await?.frame;
    let mut stream = client.watch(id, WatchOptions::every_from(last / 2)).await?;
    let mut frames = Vec::new();
    loop {
        let event = stream.next().await;
        let event = event
            .ok_or_else(|| CliError::failure(format!("the stream of {scene} ended before frame {last}")))?;
        let Event::Frame(frame) = event? else { continue };
        frames.push(frame.positions.to_f32().into_owned());
        if frame.frame == last {
            break;
        }
    }
    client.delete_session(id).await?;
    Ok(frames)
}

/// Packs and unpacks the frames, several times.
fn measure(scene: &str, frames: &[Vec<f32>], step: Step, effort: Effort, kind: Kind) -> Result<PackedRow> {
    let quantized = |frame: &Vec<f32>| step.quantize(frame).map_err(CliError::failure);
    let numbers = frames.iter().map(quantized).collect::<Result<Vec<_>>>()?;
    let base = |index: usize| (kind == Kind::Delta).then(|| numbers[index - 1].as_slice());
    let (mut packing, mut unpacking) = (Vec::new(), Vec::new());
    let mut bytes = 0;
    for _ in 0..PASSES {
        let begin = Instant::now();
        let mut packed = Vec::new();
        for (index, frame) in frames.iter().enumerate().skip(1) {
            packed.push(pack(&quantized(frame)?, COMPONENTS, base(index), effort));
        }
        packing.push(begin.elapsed().as_secs_f64());
        bytes = packed.iter().map(Vec::len).sum();

        let begin = Instant::now();
        for (index, packed) in packed.iter().enumerate() {
            let count = frames[0].len() / COMPONENTS;
            let again = unpack(packed, count, COMPONENTS, base(index + 1)).map_err(CliError::failure)?;
            std::hint::black_box(step.restore(&again));
        }
        unpacking.push(begin.elapsed().as_secs_f64());
    }
    let particles = frames[0].len() / COMPONENTS;
    let packed_particles = (particles * (frames.len() - 1)) as f64;
    let rate =
        |seconds: &[f64]| packed_particles * POSITION_BYTES / sample::median(seconds.iter().copied()) / 1e6;
    Ok(PackedRow {
        scene: scene.to_owned(),
        particles,
        kind: match kind {
            Kind::Key => "key",
            Kind::Delta => "delta",
        },
        level: match effort {
            Effort::Fast => 1,
            Effort::Small => 6,
        },
        bytes_per_particle: bytes as f64 / packed_particles,
        pack_megabytes_per_second: rate(&packing),
        unpack_megabytes_per_second: rate(&unpacking),
    })
}

fn text(rows: &[PackedRow], step: Step) -> String {
    let columns = [
        Column::Left("scene"),
        Column::Right("particles"),
        Column::Left("array"),
        Column::Right("level"),
        Column::Right("bytes per particle"),
        Column::Right("packed MB/s"),
        Column::Right("unpacked MB/s"),
    ];
    let cells: Vec<Vec<String>> = rows
        .iter()
        .map(|row| {
            vec![
                row.scene.clone(),
                output::count(row.particles as u64),
                row.kind.to_owned(),
                row.level.to_string(),
                format!("{:.2}", row.bytes_per_particle),
                format!("{:.0}", row.pack_megabytes_per_second),
                format!("{:.0}", row.unpack_megabytes_per_second),
            ]
        })
        .collect();
    format!(
        "{}\n\nPositions of the second half of the first {FRAMES} frames, each coordinate within {:.1e} m; 12 bytes per particle in binary32, of which MB/s are counted.",
        output::table(&columns, &cells),
        step.bound()
    )
}

//! `nappe watch`: follows a session's diagnostics, or saves its frames.

use std::{ffi::OsString, path::PathBuf};

use clap::Args;
use nappe_client::{Client, DiagnosticsEvent, Event, WatchOptions, v1};
use nappe_scene::mesh::six_digits;
use nappe_server::numbers::{HERTZ, Least, real, whole};

use crate::{
    files::write::ForceArgs,
    options::{args::SessionArgs, fields::FieldsArgs, picture_args::PictureArgs},
    outside::{remote, viewer::Place},
    save::{Beside, Destination, Form, Recording, Sink},
    words::{
        diagnostics,
        error::{CliError, Result},
        output::{self, Format},
        session,
    },
};

/// Follow a session's diagnostics, or save its frames
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe watch first                          diagnostics until the session ends, 5 per second
  nappe watch first --rate 0 --json          diagnostics of every frame, one JSON object per line
  nappe watch first --save frames            every frame from now on, PLY files in a folder
  nappe watch first --save all.rrd --from 0  from its start, if the server still keeps it
  nappe watch first --save frames --fields velocity,plastic_ratio,stress
  nappe watch first --count 1 --save now.png a picture of its newest frame
  nappe watch first --save frames --grid slice:y=0.5   also mass and velocity on a plane")]
pub(crate) struct WatchArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Largest rate of the diagnostics (Hz); 0: those of every frame
    #[arg(long, value_name = "HZ", default_value_t = 5.0, conflicts_with = "save", value_parser = real(HERTZ, Least::From0))]
    rate: f64,
    /// End after N diagnostics, or N frames saved
    #[arg(long, value_name = "N", value_parser = whole::<u64>(1..))]
    count: Option<u64>,
    /// Keep every frame: a page FILE.html, a Rerun recording FILE.rrd, files for ParaView FILE.pvd, a scene of USD FILE.usda, a table
    /// FILE.csv, or a folder of PLY files; or draw them: the last one, a picture FILE.png, or all, a film FILE.mp4
    #[arg(long, value_name = "FILE.html|FILE.rrd|FILE.pvd|FILE.usda|FILE.csv|FILE.png|FILE.mp4|FOLDER")]
    save: Option<PathBuf>,
    #[command(flatten)]
    force: ForceArgs,
    /// First frame to save [default: the newest]
    #[arg(long, value_name = "FRAME", requires = "save", value_parser = whole::<u64>(0..))]
    from: Option<u64>,
    #[command(flatten)]
    fields: FieldsArgs,
    #[command(flatten)]
    picture: PictureArgs,
}

/// Runs `nappe watch`.
///
/// # Errors
/// When the session fails or was never there, a frame cannot be saved, or there is no server.
pub(crate) fn run(args: &WatchArgs) -> Result<()> {
    args.fields.check(args.save.as_deref())?;
    args.picture.check(args.save.as_deref())?;
    remote::block_on(async {
        let Some(path) = &args.save else {
            return follow(&remote::connect(&args.session.server).await?, args).await;
        };
        let beside = Beside { picture: args.picture, ..Beside::default() };
        let destination = Destination::open(path, args.force.existing(), &args.fields, beside).await?;
        let client = remote::connect(&args.session.server).await?;
        if let Some(picture) = &destination.picture {
            picture.check(&client.get_session(&args.session.id).await?)?;
        }
        let saved = match destination.form {
            Form::Sink(sink) => Box::pin(save(&client, args, sink)).await,
            Form::Recording(recording, _) => Box::pin(record(&client, args, &recording)).await,
        };
        // What came is drawn, of a session that failed too.
        let drawn = match destination.picture {
            Some(picture) => Box::pin(picture.draw()).await,
            None => Ok(()),
        };
        let count = saved?;
        drawn?;
        match args.session.output.format() {
            Format::Json => output::json(&serde_json::json!({ "frames": count, "saved": path })),
            Format::Text => {
                let frames = output::several(count, "frame");
                output::line(&format!("{frames} in {}", path.display()))
            }
        }
    })
}

/// Prints diagnostics until the session ends, the count is reached, or the user ends it. A connection that breaks
/// comes back, as that of frames does.
async fn follow(client: &Client, args: &WatchArgs) -> Result<()> {
    let mut stream = client.watch_diagnostics(&args.session.id, args.rate).await?;
    let mut left = args.count.unwrap_or(u64::MAX);
    let mut end = std::pin::pin!(remote::interrupted());
    while left > 0 {
        let next = tokio::select! {
            next = stream.next_event() => next,
            signal = &mut end => return signal,
        };
        match next {
            Some(Ok(DiagnosticsEvent::Diagnostics(diagnostics))) => {
                print(&diagnostics, args.session.output.format())?;
                left -= 1;
            }
            Some(Ok(DiagnosticsEvent::Broken { cause })) => output::note(&remote::broke(client, &cause)),
            Some(Ok(DiagnosticsEvent::Reconnected { attempts, cause })) => {
                output::note(&remote::back(attempts, &cause));
            }
            Some(Ok(DiagnosticsEvent::Change(change))) if !change.notice.is_empty() => {
                output::note(&change.notice);
            }
            Some(Ok(DiagnosticsEvent::Change(v1::StateChange { rejected: Some(step), .. }))) => {
                output::note(&diagnostics::rejected(&step));
            }
            Some(Ok(_)) => {}
            Some(Err(error)) => return Err(in_words_of(client, &args.session.id, error.into()).await),
            None => break,
        }
    }
    Ok(())
}

fn print(step: &v1::Diagnostics, format: Format) -> Result<()> {
    // Snow alone has no springs to stretch.
    let stretch = match step.max_stretch {
        stretch if stretch > 0.0 => format!("  stretch {stretch:>7.4}"),
        _ => String::new(),
    };
    match format {
        Format::Json => output::json(step),
        Format::Text => output::line(&format!(
            "step {:>8}  t = {:>9.3} s  energy {:>12} J{}  {:>9} per step{}{}",
            step.step,
            step.time_seconds,
            six_digits(diagnostics::total_energy(step)),
            stretch,
            output::time(step.step_seconds),
            step.solve.as_ref().map_or_else(String::new, |solve| {
                format!("  {} iterations, residual {:.1e}", solve.iterations, solve.relative_residual)
            }),
            diagnostics::snow_phrase(step),
        )),
    }
}

/// Saves frames until the session ends, the count is reached, or the user ends it; counts them.
async fn save(client: &Client, args: &WatchArgs, mut sink: Sink) -> Result<u64> {
    let options = WatchOptions {
        from_frame: args.from,
        delivery: nappe_client::Delivery::Every,
        ..WatchOptions::default()
    };
    let session = client.get_session(&args.session.id).await?;
    let mut stream = client.watch(&args.session.id, sink.watch(options, &session)).await?;

    let (mut saved, mut ended, mut failure) = (0, None, None);
    let mut end = std::pin::pin!(remote::interrupted());
    while args.count.is_none_or(|count| saved < count) {
        let next = tokio::select! {
            next = stream.next() => next,
            signal = &mut end => { signal?; break }
        };
        match next {
            Some(Ok(Event::Topology(topology))) => sink.topology(topology),
            Some(Ok(Event::Frame(frame))) => {
                sink.frame(&frame)?;
                saved += 1;
            }
            Some(Ok(Event::Broken { cause })) => output::note(&remote::broke(client, &cause)),
            Some(Ok(Event::Reconnected { attempts, cause })) => {
                output::note(&remote::back(attempts, &cause));
            }
            Some(Ok(Event::Change(change))) => failure = change.failure,
            Some(Ok(Event::End(end))) => {
                ended = Some(end);
                break;
            }
            None => break,
            Some(Ok(_)) => {}
            Some(Err(error)) => {
                // A session that fails says why, and its stream ends with the same as an error.
                sink.finish(None, failure.as_ref())?;
                return Err(in_words_of(client, &args.session.id, error.into()).await);
            }
        }
    }
    sink.finish(ended, None)?;
    Ok(saved)
}

/// Records frames until the session ends, the count is reached, or the user ends it; counts them.
async fn record(client: &Client, args: &WatchArgs, recording: &Recording) -> Result<u64> {
    let SessionArgs { id, server, .. } = &args.session;
    client.get_session(id).await?;
    let from = args.from.map_or_else(|| "newest".to_owned(), |frame| frame.to_string());
    let words = [Some(format!("--from={from}")), args.count.map(|count| format!("--count={count}"))];
    let options = words.into_iter().flatten().map(OsString::from);
    let mut child = recording.start(&Place::at(&server.server, &server.token), id, options).await?;
    let ended = tokio::select! {
        ended = child.end() => ended,
        signal = remote::interrupted() => { signal?; child.finish().await }
    };
    let kept = recording.file().keep(&ended);
    match ended {
        Ok(shown) => kept.map(|()| shown.frames),
        Err(failure) => Err(recording.file().told(in_words_of(client, id, failure.into()).await)),
    }
}

/// A stream that ends because its session failed says so in the session's words.
async fn in_words_of(client: &Client, id: &str, error: CliError) -> CliError {
    let session = client.get_session(id).await.ok();
    session.as_ref().and_then(session::failure).unwrap_or(error)
}

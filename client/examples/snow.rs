//! Creates a scene with snow on a running server, plays it, prints how the snow packs:
//! `cargo run --example snow -- URL SCENE`.

#![allow(clippy::print_stdout, reason = "an example speaks")]

use nappe_client::{
    Axis, Client, ClientError, CreateSession, Event, Field, Fields, Frame, GridFrame, GridOptions,
    WatchOptions,
};

#[tokio::main]
async fn main() -> Result<(), ClientError> {
    let mut arguments = std::env::args().skip(1);
    let server = arguments.next().unwrap_or_else(|| "http://127.0.0.1:6277".to_owned());
    let scene = arguments.next().unwrap_or_else(|| "snowball_wall".to_owned());
    let client = Client::connect(&server).await?;

    let session = client.create_session(CreateSession::named(scene)).await?.session;
    let options = WatchOptions {
        fields: Fields::positions().with(Field::PlasticRatios),
        // Velocities of the grid on the plane of nodes nearest to z = 0.
        grid: Some(GridOptions::slice(Axis::Z, 0.0)),
        ..WatchOptions::every_from(0)
    };
    let mut frames = client.watch(&session.session_id, options).await?;

    client.play(&session.session_id, 0.0).await?;
    while let Some(event) = frames.next().await {
        if let Event::Frame(frame) = event? {
            print(&frame);
        }
    }
    client.delete_session(&session.session_id).await
}

fn print(frame: &Frame) {
    let packed =
        frame.plastic_ratios.iter().flat_map(|ratios| (0..ratios.len()).filter_map(|p| ratios.get(p)));
    let densest = packed.fold(f64::INFINITY, f64::min);
    let nodes = frame.grid.as_ref().map_or(0, GridFrame::len);
    print!("{:8.4} s  densest J_P {densest:.3}  {nodes} nodes on the slice", frame.time);
    match frame.diagnostics.as_ref().and_then(|diagnostics| diagnostics.snow.as_ref()) {
        Some(snow) => println!("  {} steps, bound by {}", snow.substeps, snow.bound().word()),
        None => println!(),
    }
}

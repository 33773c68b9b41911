//! Creates the demo on a running server, plays it, prints each frame: `cargo run --example watch -- URL`.

#![allow(clippy::print_stdout, reason = "an example speaks")]

use nappe_client::{Client, ClientError, CreateSession, Event, WatchOptions};

#[tokio::main]
async fn main() -> Result<(), ClientError> {
    let server = std::env::args().nth(1).unwrap_or_else(|| "http://127.0.0.1:6277".to_owned());
    let client = Client::connect(&server).await?;
    let session = client.create_session(CreateSession::named("demo")).await?.session;

    let mut frames = client.watch(&session.session_id, WatchOptions::every_from(0)).await?;
    client.play(&session.session_id, 0.0).await?;
    while let Some(event) = frames.next().await {
        match event? {
            Event::Topology(topology) => println!("{} particles", topology.particle_count),
            Event::Frame(frame) => println!("{:8.4} s  {:?} m", frame.time, frame.positions.get(0)),
            Event::End(end) => println!("{} steps, state {:016x}", end.step, end.state_hash),
            other => println!("{other:?}"),
        }
    }
    client.delete_session(&session.session_id).await
}

//! Writes every frame of a session to the standard output, raw: `cargo run --example raw -- URL ID f64 TOKEN-FILE`.
//!
//! Per frame, little-endian: its number (u64), its state hash (u64, 0 where it has none), bytes of its positions (u64),
//! and these. Clients in other languages are compared with it.

use std::{
    env,
    error::Error,
    io::{self, Write as _},
    path::Path,
};

use nappe_client::{Client, Encoding, Event, Token, Vectors, WatchOptions};

#[tokio::main]
async fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = env::args().skip(1).collect();
    let [url, id, encoding, token] = arguments.as_slice() else {
        return Err("expected: URL ID f32|f64 TOKEN-FILE".into());
    };
    let client = Client::connect_with(url, &Token::read(Path::new(token))?).await?;
    let encoding = if encoding == "f64" { Encoding::F64 } else { Encoding::F32 };
    let mut frames = client.watch(id, WatchOptions { encoding, ..WatchOptions::every_from(0) }).await?;
    let mut out = io::stdout().lock();
    while let Some(event) = frames.next().await {
        if let Event::Frame(frame) = event? {
            let positions: Vec<u8> = match &frame.positions {
                Vectors::F32(numbers) => numbers.iter().flat_map(|number| number.to_le_bytes()).collect(),
                Vectors::F64(numbers) => numbers.iter().flat_map(|number| number.to_le_bytes()).collect(),
            };
            for word in [frame.frame, frame.state_hash.unwrap_or(0), positions.len() as u64] {
                out.write_all(&word.to_le_bytes())?;
            }
            out.write_all(&positions)?;
        }
    }
    Ok(())
}

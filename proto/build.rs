//! Compiles the .proto files without protoc, and keeps the descriptors for server reflection.

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message as _;

const FILES: [&str; 2] = ["nappe/v1/simulation.proto", "nappe/v1/frame.proto"];

fn main() -> Result<(), Box<dyn Error>> {
    for file in FILES {
        println!("cargo:rerun-if-changed={file}");
    }
    let descriptors = protox::compile(FILES, ["."])?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("nappe_v1.bin"), descriptors.encode_to_vec())?;
    tonic_prost_build::configure()
        // Byte fields decode without a copy.
        .bytes(".")
        .compile_fds(descriptors)?;
    Ok(())
}

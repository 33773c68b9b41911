//! Compiles the .proto files without protoc: messages, their form as JSON, descriptors for reflection. The crate's test
//! compares them with `proto/generated/`, which is what programs are built from.

use std::{env, error::Error, fs, path::PathBuf};

use prost::Message as _;

const FILES: [&str; 2] = ["nappe/v1/simulation.proto", "nappe/v1/frame.proto"];

/// Where the files are.
const CONTRACT: &str = "..";

/// Messages that are also written as JSON, under the names of their fields.
const JSON_MESSAGES: [&str; 18] = [
    "Session",
    "SessionRanks",
    "Durability",
    "Failure",
    "Parameters",
    "ClothParameters",
    "Air",
    "SpringParameters",
    "ColliderPose",
    "Diagnostics",
    "ColliderLoad",
    "SurfaceReport",
    "RestReport",
    "ClothSteps",
    "SnowDiagnostics",
    "SolveReport",
    "StageTime",
    "Notices",
];

/// Fields whose shape in JSON is not that of the Rust type: the function of `src/json.rs` that writes each.
const JSON_FIELDS: [(&str, &str); 18] = [
    ("Session.state", "session_state"),
    ("Session.precision", "precision"),
    ("Session.state_hash", "state_hash"),
    ("Session.create_time", "time"),
    ("Parameters.gravity", "vector"),
    ("Parameters.wind", "vector"),
    ("Parameters.forces", "forces"),
    ("SpringParameters.kind", "spring_kind"),
    ("ColliderPose.position", "vector"),
    ("ColliderPose.turn", "quaternion"),
    ("Diagnostics.momentum", "vector"),
    ("ColliderLoad.force", "vector"),
    ("ColliderLoad.torque", "vector"),
    ("RestReport.wake_cause", "wake_cause"),
    ("ClothSteps.bound", "time_bound"),
    ("SnowDiagnostics.bound", "time_bound"),
    ("SnowDiagnostics.angular_momentum", "vector"),
    ("SolveReport.outcome", "solve_outcome"),
];

fn main() -> Result<(), Box<dyn Error>> {
    for file in FILES {
        println!("cargo:rerun-if-changed={CONTRACT}/{file}");
    }
    let descriptors = protox::compile(FILES, [CONTRACT])?;
    let out = PathBuf::from(env::var("OUT_DIR")?);
    fs::write(out.join("nappe.v1.binpb"), descriptors.encode_to_vec())?;

    // Byte fields decode without a copy.
    let mut builder = tonic_prost_build::configure().bytes(".");
    for message in JSON_MESSAGES {
        builder = builder.type_attribute(format!(".nappe.v1.{message}"), "#[derive(serde::Serialize)]");
    }
    for (field, writer) in JSON_FIELDS {
        let attribute = format!("#[serde(serialize_with = \"crate::json::{writer}\")]");
        builder = builder.field_attribute(format!(".nappe.v1.{field}"), attribute);
    }
    // A report of the solver is part of the diagnostics: its fields stand beside theirs.
    let flat = "#[serde(flatten, serialize_with = \"crate::json::solve\")]";
    builder.field_attribute(".nappe.v1.Diagnostics.solve", flat).compile_fds(descriptors)?;
    Ok(())
}

//! `nappe changes`: lists the changes of parameters that wait for their step, or drops some.

use clap::Args;
use nappe_client::v1;
use nappe_server::numbers::whole;
use serde_json::json;

use crate::{
    options::args::SessionArgs,
    outside::remote,
    words::{
        error::Result,
        output::{self, Format},
    },
};

/// List or drop the changes of a session that wait for their step
#[derive(Args, Debug)]
#[command(after_help = "\
Examples:
  nappe changes first                 what waits, in the order in which it takes effect
  nappe changes first --drop 3,4      drop the changes numbered 3 and 4
  nappe changes first --drop-all")]
pub(crate) struct ChangesArgs {
    #[command(flatten)]
    session: SessionArgs,
    /// Numbers of the changes to drop, separated by commas
    #[arg(long, value_name = "ORDER", value_delimiter = ',', conflicts_with = "drop_all", value_parser = whole::<u64>(0..))]
    drop: Vec<u64>,
    /// Drop all of them
    #[arg(long)]
    drop_all: bool,
}

/// Runs `nappe changes`.
///
/// # Errors
/// When there is no such session or no server.
pub(crate) fn run(args: &ChangesArgs) -> Result<()> {
    let SessionArgs { id, server, output } = &args.session;
    remote::block_on(async {
        let client = remote::connect(server).await?;
        if args.drop_all || !args.drop.is_empty() {
            let dropped_count = client.drop_changes(id, &args.drop).await?;
            return match output.format() {
                Format::Json => output::json(&json!({ "session_id": id, "dropped_count": dropped_count })),
                Format::Text => output::line(&format!("{id}: {dropped_count} changes dropped")),
            };
        }

        let changes = client.pending_changes(id).await?;
        match output.format() {
            Format::Json => output::json(&changes.iter().map(json).collect::<Vec<_>>()),
            Format::Text if changes.is_empty() => output::line(&format!("{id}: no change waits")),
            Format::Text => changes.iter().try_for_each(|change| {
                let v1::UpdateParametersResponse { effective_step, order } = place(change);
                output::line(&format!("{order}: before step {effective_step}: {}", sets(change).join("; ")))
            }),
        }
    })
}

fn json(change: &v1::PendingChange) -> serde_json::Value {
    let v1::UpdateParametersResponse { effective_step, order } = place(change);
    json!({ "order": order, "effective_step": effective_step, "sets": sets(change) })
}

fn place(change: &v1::PendingChange) -> v1::UpdateParametersResponse {
    change.accepted.unwrap_or_default()
}

/// What a change sets, in words.
fn sets(change: &v1::PendingChange) -> Vec<String> {
    let request = change.changes.clone().unwrap_or_default();
    let vector = |v: v1::Vector3| format!("{},{},{}", v.x, v.y, v.z);
    let mut sets = Vec::new();
    sets.extend(request.gravity.map(|gravity| format!("gravity {}", vector(gravity))));
    sets.extend(request.wind.map(|wind| format!("wind {}", vector(wind))));
    sets.extend(request.drag.map(|drag| format!("drag {drag}")));
    if !request.springs.is_empty() {
        sets.push(format!("springs ({})", request.springs.len()));
    }
    for (what, count) in [
        ("air", request.air.len()),
        ("forces", request.forces.len()),
        ("pulls", request.pulls.len()),
        ("states", request.states.len()),
        ("paths", request.paths.len()),
        ("colliders", request.colliders.len()),
        ("collider paths", request.collider_paths.len()),
    ] {
        if count > 0 {
            sets.push(format!("{what} ({count})"));
        }
    }
    if !request.pins.is_empty() {
        sets.push(format!("pins ({})", request.pins.len()));
    }
    sets
}

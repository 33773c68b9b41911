//! Sessions that go on from the file of one that was saved.
//!
//! Enters: a file, and what is asked for beside it. Leaves: a session on a server; warnings on standard error.

use nappe_client::{Client, Scene as Sent, v1};

use crate::{options::args::OverrideArgs, scenes::meshes, words::error::Result};

/// Makes a session that goes on from a file; tells what is odd about it. With an empty id, the server chooses one.
///
/// # Errors
/// When the server refuses the file, or what is asked for beside it.
pub(crate) async fn go_on(
    client: &Client,
    file: Vec<u8>,
    id: String,
    overrides: &OverrideArgs,
) -> Result<v1::Session> {
    let sent = Sent::Checkpoint(client.upload_saved(file).await?);
    let created = client.create_session(overrides.session(id, sent)).await?;
    meshes::note(&created.warnings);
    Ok(created.session)
}

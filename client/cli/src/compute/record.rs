//! Records a session while it is driven: a viewer beside this command keeps every frame.
//!
//! The session waits for the recording: none of its frames is lost, however slow the disk.

use std::{future::Future, path::Path, time::Duration};

use nappe_client::{Client, v1};

use crate::{
    outside::viewer::{Child, Failure, Place},
    save::Recording,
    words::{
        error::{CliError, Result},
        output,
    },
};

/// How long a viewer may take until it watches.
const PATIENCE: Duration = Duration::from_secs(10);

/// Starts the recording of a session that is paused at its start, and waits until it watches.
///
/// # Errors
/// When it cannot be started, ends at once, or does not watch in time; nothing is left of it then.
pub(super) async fn begin(recording: &Recording, place: &Place, id: &str, path: &Path) -> Result<Child> {
    let mut child = recording.start(place, id, ["--paced".into()]).await?;
    if tokio::time::timeout(PATIENCE, child.watches()).await.is_err() {
        let (seconds, lines) = (PATIENCE.as_secs(), child.last_lines());
        return Err(CliError::failure(format!(
            "nappe-viewer does not watch the session {seconds} s after its start: {} is not recorded{lines}",
            path.display()
        )));
    }
    Ok(child)
}

/// Plays and waits until every frame is recorded, and is kept by who plays if that keeps it too.
///
/// # Errors
/// When the session cannot be played, or not all of it is recorded. One that fails is recorded as far as it came.
pub(super) async fn follow(
    child: &mut Child,
    client: &Client,
    id: &str,
    played: impl Future<Output = Result<()>>,
) -> Result<()> {
    let mut played = std::pin::pin!(played);
    let ended = tokio::select! {
        // First, so that nothing is played that nobody records.
        biased;
        ended = child.end() => Some(ended),
        done = &mut played => { done?; None }
    };
    let is_played = ended.is_none();
    let ended = match ended {
        Some(ended) => ended,
        None => child.end().await,
    };
    match ended {
        Ok(shown) if shown.finished => {}
        Ok(shown) => {
            return Err(CliError::failure(format!(
                "nappe-viewer was ended before the session, with {} recorded",
                output::several(shown.frames, "frame")
            )));
        }
        Err(failure) if told_by(&failure, client, id).await => {}
        Err(failure) => return Err(failure.into()),
    }
    // The session has ended: what is kept beside the recording gets the frames that are left.
    if is_played { Ok(()) } else { played.await }
}

/// Whether a failure is no news: the server gave it, and the session itself says why it failed.
async fn told_by(failure: &Failure, client: &Client, id: &str) -> bool {
    let failed = |session: v1::Session| session.state() == v1::SessionState::Failed;
    failure.reason.is_some() && client.get_session(id).await.is_ok_and(failed)
}

//! Saves a session: of what its thread takes between two steps, the bytes of a file.
//!
//! Enters: a call that waits. Leaves: a file in memory that is counted. It is written on a thread that may block, while the session goes
//! on.

use bytes::Bytes;
use tokio::{sync::OwnedSemaphorePermit, task::spawn_blocking};

use super::{handle::Session, status::Properties, taken::Taken};
use crate::{
    config::Limits,
    error::ServiceError,
    memory::Claim,
    state::{FileError, bytes_to_write, write_with},
};

/// A file of a session, and what its memory is claimed by.
#[derive(Debug)]
pub(crate) struct SavedFile {
    pub bytes: Bytes,
    pub memory: Claim,
}

impl Session {
    /// The session as it stands between two steps, as a file, whose memory is taken from `memory`; with `place`, which is held until it
    /// is made, also where the caller goes.
    ///
    /// # Errors
    /// If it failed or stands within a step that was given up, too many calls wait, there is no memory, or it is deleted meanwhile.
    pub(crate) async fn save(
        &self,
        limits: Limits,
        memory: Claim,
        place: OwnedSemaphorePermit,
    ) -> Result<(SavedFile, OwnedSemaphorePermit), ServiceError> {
        // What is taken of its state is not larger than what it takes itself.
        memory.grow(self.claimed_bytes())?;
        let taken = self.control.save()?.await.map_err(|_gone| self.untaken())?;
        let properties = self.status.properties.clone();
        let make = move || file(taken, &properties, &limits, memory).map(|file| (file, place));
        spawn_blocking(make).await.map_err(|_panic| {
            ServiceError::internal("writing the session panicked: this is a bug in the server")
        })?
    }
}

fn file(
    taken: Taken,
    properties: &Properties,
    limits: &Limits,
    mut memory: Claim,
) -> Result<SavedFile, ServiceError> {
    memory.grow(taken.pending.bytes())?;
    let setup = properties.origin.setup_section(limits, &memory)?;
    let saved = taken.saved(properties, setup);
    let refused =
        |error: FileError| ServiceError::internal(format!("the session cannot be written: {error}"));
    memory.grow(bytes_to_write(&saved).map_err(refused)?)?;
    let bytes = write_with(&saved).map_err(refused)?;
    drop(saved);
    memory.shrink_to(bytes.len() as u64);
    Ok(SavedFile { bytes: bytes.into(), memory })
}

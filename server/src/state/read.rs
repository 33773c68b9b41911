//! A session, from the sections of a file.
//!
//! Enters: a file of which the hashes were checked. Leaves: what its sections say, of which nothing was checked yet.

use nappe_proto::v1;
use prost::Message;
use serde::de::DeserializeOwned;

use super::{
    format::{FileError, Opened, Section},
    write::SavedSession,
};

/// Reads all sections. It takes no more memory than [`Opened::bytes_to_read`] says; meshes of colliders are closed, which may
/// take long, on the rayon pool that the caller installed.
///
/// # Errors
/// The first section that does not say what it should.
pub fn read(file: &Opened<'_>) -> Result<SavedSession, FileError> {
    let request = file.section(Section::Request);
    let (state_hash, hash_interval) = value(file, Section::Hash)?;
    Ok(SavedSession {
        session: message(file, Section::Session)?,
        request: if request.is_empty() { None } else { Some(message(file, Section::Request)?) },
        setup: value(file, Section::Setup)?,
        initial: value(file, Section::Initial)?,
        state: value(file, Section::State)?,
        pending: value(file, Section::Pending)?,
        frame: message(file, Section::Frame)?,
        positions: file.section(Section::Positions).to_vec(),
        state_hash,
        hash_interval,
        colors: value(file, Section::Colors)?,
    })
}

/// The session as the service described it, alone.
///
/// # Errors
/// If its section says something else.
pub(crate) fn told_session(file: &Opened<'_>) -> Result<v1::Session, FileError> {
    let told: v1::CreateSessionResponse = message(file, Section::Session)?;
    told.session.ok_or_else(|| FileError::of(Section::Session, "it describes no session"))
}

/// A message of the contract.
fn message<T: Message + Default>(file: &Opened<'_>, section: Section) -> Result<T, FileError> {
    T::decode(file.section(section)).map_err(|error| FileError::of(section, error))
}

/// A value that takes the whole section.
fn value<T: DeserializeOwned>(file: &Opened<'_>, section: Section) -> Result<T, FileError> {
    let (value, rest) =
        postcard::take_from_bytes(file.section(section)).map_err(|error| FileError::of(section, error))?;
    if rest.is_empty() {
        return Ok(value);
    }
    Err(FileError::of(section, format!("{} bytes are left after its end", rest.len())))
}

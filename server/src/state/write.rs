//! A session, to bytes.

use nappe_proto::v1;
use nappe_sim::world::{Change, WorldSetup, WorldState};
use postcard::ser_flavors::Size;
use prost::Message as _;
use serde::{Deserialize, Serialize};

use super::format::{Digest, FileError, Section, join, join_without_setup};

/// What a file has beside its sections, and what the hash takes, at most (bytes).
const BESIDE_BYTES: usize = 1024;

/// Changes of one call, which wait.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct PendingGroup {
    /// Index of the step before which they take effect.
    pub step: u64,
    /// The place of the call among those that changed the session, from 1.
    pub order: u64,
    /// What it changes, in its order.
    pub changes: Vec<Change>,
}

/// The changes that wait for their step.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Waiting {
    /// Groups of them, in the order in which they take effect.
    pub groups: Vec<PendingGroup>,
    /// Calls so far that changed the session.
    pub last_order: u64,
}

/// All that a server needs to go on with a session; its setup may be the section of a file already.
#[derive(Clone, Debug, PartialEq)]
pub struct SavedSession<Setup = WorldSetup> {
    /// The session as the service describes it, and the warnings that it was made with.
    pub session: v1::CreateSessionResponse,
    /// The request that made it, or the session of which it is a copy; none where that is not known.
    pub request: Option<v1::CreateSessionRequest>,
    /// What its world is built from.
    pub setup: Setup,
    /// Changes with which it begins, and begins again after a reset.
    pub initial: Vec<Change>,
    /// What further steps depend on.
    pub state: WorldState,
    /// The changes that wait for their step.
    pub pending: Waiting,
    /// The newest frame; it has no fields.
    pub frame: v1::Frame,
    /// The positions of that frame (m), as numbers in binary32, the lowest byte first.
    pub positions: Vec<u8>,
    /// The hash of the state.
    pub state_hash: u64,
    /// Frames between those that carry a hash, 1 or more.
    pub hash_interval: u32,
    /// Colours of bodies by their names, of those that the scene gives one: 0xRRGGBB.
    pub colors: Vec<(String, u32)>,
}

/// The bytes of a file with this session.
///
/// # Errors
/// If a section cannot be written.
pub fn write(saved: &SavedSession) -> Result<Vec<u8>, FileError> {
    Ok(join(&sections(saved, setup_section(&saved.setup)?)?))
}

/// The same of a session whose setup is the section of a file already.
///
/// # Errors
/// If a section cannot be written.
pub fn write_with(saved: &SavedSession<Vec<u8>>) -> Result<Vec<u8>, FileError> {
    Ok(join(&sections(saved, saved.setup.clone())?))
}

/// Memory at most that this takes (bytes), to be counted before: each section, and the file.
///
/// # Errors
/// If a section cannot be written.
pub fn bytes_to_write(saved: &SavedSession<Vec<u8>>) -> Result<u64, FileError> {
    Ok(2 * (saved.setup.len() + bytes_beside_setup(saved)?) as u64)
}

/// The bytes of a file with this session, but for its setup, which stands in a file of its own.
///
/// # Errors
/// If a section cannot be written.
pub(crate) fn write_without_setup(saved: &SavedSession<Digest>) -> Result<Vec<u8>, FileError> {
    Ok(join_without_setup(&sections(saved, Vec::new())?, saved.setup))
}

/// Memory at most that this takes (bytes), to be counted before.
///
/// # Errors
/// If a section cannot be written.
pub(crate) fn bytes_to_write_without_setup(saved: &SavedSession<Digest>) -> Result<u64, FileError> {
    Ok(2 * bytes_beside_setup(saved)? as u64)
}

/// Bytes of a file but for its setup, at most.
fn bytes_beside_setup<Setup>(saved: &SavedSession<Setup>) -> Result<usize, FileError> {
    let request = saved.request.as_ref().map_or(0, v1::CreateSessionRequest::encoded_len);
    let messages = saved.session.encoded_len() + request + saved.frame.encoded_len();
    let values = size(Section::Initial, &saved.initial)?
        + size(Section::State, &saved.state)?
        + size(Section::Pending, &saved.pending)?
        + size(Section::Colors, &saved.colors)?;
    Ok(saved.positions.len() + messages + values + BESIDE_BYTES)
}

/// The section that a setup is in a file.
///
/// # Errors
/// If it cannot be written.
pub fn setup_section(setup: &WorldSetup) -> Result<Vec<u8>, FileError> {
    bytes_of(Section::Setup, setup)
}

/// Memory at most that this takes (bytes), to be counted before.
///
/// # Errors
/// If it cannot be written.
pub fn bytes_of_setup(setup: &WorldSetup) -> Result<u64, FileError> {
    size(Section::Setup, setup).map(|size| size as u64)
}

/// The sections of a file, with this one of the setup.
fn sections<Setup>(
    saved: &SavedSession<Setup>,
    setup: Vec<u8>,
) -> Result<[Vec<u8>; Section::ALL.len()], FileError> {
    let request = saved.request.as_ref().map(v1::CreateSessionRequest::encode_to_vec);
    let sections = [
        saved.session.encode_to_vec(),
        request.unwrap_or_default(),
        setup,
        bytes_of(Section::Initial, &saved.initial)?,
        bytes_of(Section::State, &saved.state)?,
        bytes_of(Section::Pending, &saved.pending)?,
        saved.frame.encode_to_vec(),
        saved.positions.clone(),
        bytes_of(Section::Hash, &(saved.state_hash, saved.hash_interval))?,
        bytes_of(Section::Colors, &saved.colors)?,
    ];
    let too_long = |(section, bytes): &(Section, &Vec<u8>)| bytes.len() as u64 > section.most_bytes();
    if let Some((section, bytes)) = Section::ALL.into_iter().zip(&sections).find(too_long) {
        let (found, allowed) = (bytes.len(), section.most_bytes());
        return Err(FileError::of(section, format!("it takes {found} bytes: allowed are at most {allowed}")));
    }
    Ok(sections)
}

fn bytes_of(section: Section, value: &impl Serialize) -> Result<Vec<u8>, FileError> {
    let room = Vec::with_capacity(size(section, value)?);
    postcard::to_extend(value, room).map_err(|error| FileError::of(section, error))
}

/// Bytes that a value takes in a file.
fn size(section: Section, value: &impl Serialize) -> Result<usize, FileError> {
    let size = postcard::serialize_with_flavor(value, Size::default());
    size.map_err(|error| FileError::of(section, error))
}

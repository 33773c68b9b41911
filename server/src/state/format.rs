//! The frame of a file: a head, a table of sections with a hash for each, and the sections one after the other.
//!
//! Numbers have their lowest byte first. The head: eight bytes that name the format, its number (u32), the count of sections
//! (u32), the length of the file (u64), which bits the version computes (u64), and the name of the version in 32 bytes, 0 behind
//! it. For each section: its code (u32), where it begins (u64), its length (u64), and its XXH3 (u64). Behind the table stands the
//! XXH3 of all before it.

use std::{fmt, ops::Range};

use nappe_sim::{BITS, world::Change};
use thiserror::Error;
use xxhash_rust::xxh3::xxh3_64;

/// The number of the format. A file of another one is refused: it grows with every change of what a section holds.
pub const FORMAT: u32 = 3;

/// How a file begins: a byte that is no text, the name, and the end of a line, which careless copies change.
const MAGIC: [u8; 8] = *b"\x89nappe\r\n";
/// Bytes of the name of a version.
const VERSION_BYTES: usize = 32;
/// Bytes before the table.
const HEAD_BYTES: usize = 32 + VERSION_BYTES;
/// Bytes of a row of the table.
const ROW_BYTES: usize = 28;
/// Bytes before the first section.
pub(super) const FRONT_BYTES: usize = HEAD_BYTES + Section::ALL.len() * ROW_BYTES + 8;
/// Bytes of a message of the contract, at most: as many as a call may have.
const MOST_MESSAGE_BYTES: u64 = 4 << 20;

/// A part of a file.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Section {
    /// The session as the service describes it, and the warnings that it was made with.
    Session,
    /// The request that made it, or the session of which it is a copy; empty where that is not known.
    Request,
    /// The setup of its world.
    Setup,
    /// The changes with which it begins.
    Initial,
    /// The state of its world.
    State,
    /// The changes that wait for their step.
    Pending,
    /// The newest frame without its fields.
    Frame,
    /// The positions of that frame (m), in binary32.
    Positions,
    /// The hash of the state.
    Hash,
    /// The colours of bodies, for viewers.
    Colors,
}

impl Section {
    /// All of them, in the order in which they stand.
    pub const ALL: [Self; 10] = [
        Self::Session,
        Self::Request,
        Self::Setup,
        Self::Initial,
        Self::State,
        Self::Pending,
        Self::Frame,
        Self::Positions,
        Self::Hash,
        Self::Colors,
    ];

    /// Its name in messages.
    pub const fn name(self) -> &'static str {
        match self {
            Self::Session => "session",
            Self::Request => "request",
            Self::Setup => "setup",
            Self::Initial => "initial",
            Self::State => "state",
            Self::Pending => "pending",
            Self::Frame => "frame",
            Self::Positions => "positions",
            Self::Hash => "hash",
            Self::Colors => "colors",
        }
    }

    /// Its code in the table.
    const fn code(self) -> u32 {
        self as u32 + 1
    }

    /// The most bytes that it may have.
    pub(super) const fn most_bytes(self) -> u64 {
        match self {
            Self::Session | Self::Request | Self::Frame => MOST_MESSAGE_BYTES,
            _ => u64::MAX,
        }
    }

    /// Bytes of memory at most for each byte of it that is read: an element of a list may take less of a file than of memory,
    /// and a list grows by doubling.
    const fn bytes_per_byte(self) -> u64 {
        match self {
            // An empty message within a message.
            Self::Session | Self::Frame => 64,
            // An empty text.
            Self::Request => 24,
            // A body without particles; of the mesh of a collider what is made of it. A colour of a body without a name.
            Self::Setup | Self::Colors => 16,
            // A reset is one number in the file.
            Self::Initial | Self::Pending => 2 * size_of::<Change>() as u64,
            // A pin on its way.
            Self::State => 8,
            Self::Positions | Self::Hash => 1,
        }
    }
}

impl fmt::Display for Section {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

/// Why a file is not taken.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[allow(missing_docs, reason = "the messages say what the fields are")]
pub enum FileError {
    #[error(
        "it is no session that was saved: a file of another kind, or one that was altered at its beginning"
    )]
    Kind,
    #[error("it has format {found}: this version reads format {}", FORMAT)]
    Format { found: u32 },
    #[error("it has {found} bytes, and {needed} are needed: it was cut, or something was added")]
    Length { found: u64, needed: u64 },
    #[error("its table of sections is damaged: {0}")]
    Table(String),
    #[error("section '{section}': {message}")]
    Section { section: Section, message: String },
}

impl FileError {
    /// That a section is wrong.
    pub(super) fn of(section: Section, message: impl fmt::Display) -> Self {
        Self::Section { section, message: message.to_string() }
    }
}

/// What the table says of the bytes of a section: by this a setup is known that stands in a file of its own.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Digest {
    /// How many there are.
    pub length: u64,
    /// Their XXH3.
    pub hash: u64,
}

impl Digest {
    /// That of these bytes.
    pub(crate) fn of(bytes: &[u8]) -> Self {
        Self { length: bytes.len() as u64, hash: xxh3_64(bytes) }
    }
}

/// A file of sections, in their order.
pub(super) fn join(sections: &[Vec<u8>; Section::ALL.len()]) -> Vec<u8> {
    join_without_setup(sections, Digest::of(&sections[Section::Setup as usize]))
}

/// The same with a setup of this digest. Its section may be empty: once its bytes stand where they belong, the file is whole.
pub(super) fn join_without_setup(sections: &[Vec<u8>; Section::ALL.len()], setup: Digest) -> Vec<u8> {
    let is_setup = |index: usize| index == Section::Setup as usize;
    let digests = std::array::from_fn(|at| if is_setup(at) { setup } else { Digest::of(&sections[at]) });
    let length = FRONT_BYTES + sections.iter().map(Vec::len).sum::<usize>();
    let mut file = front(&digests, length);
    for bytes in sections {
        file.extend(bytes);
    }
    file
}

/// Head and table of a file with such sections, with room for so many bytes in all.
fn front(digests: &[Digest; Section::ALL.len()], room: usize) -> Vec<u8> {
    let length = FRONT_BYTES as u64 + digests.iter().map(|digest| digest.length).sum::<u64>();
    let mut file = Vec::with_capacity(room);
    file.extend(MAGIC);
    file.extend(FORMAT.to_le_bytes());
    file.extend((Section::ALL.len() as u32).to_le_bytes());
    file.extend(length.to_le_bytes());
    file.extend(BITS.to_le_bytes());
    let version = env!("CARGO_PKG_VERSION").as_bytes();
    let named = version.len().min(VERSION_BYTES);
    file.extend(&version[..named]);
    file.resize(HEAD_BYTES, 0);

    let mut offset = FRONT_BYTES as u64;
    for (section, digest) in Section::ALL.into_iter().zip(digests) {
        file.extend(section.code().to_le_bytes());
        for number in [offset, digest.length, digest.hash] {
            file.extend(number.to_le_bytes());
        }
        offset += digest.length;
    }
    seal(&mut file);
    file
}

/// Adds the hash of all that is there.
fn seal(front: &mut Vec<u8>) {
    let hash = xxh3_64(front);
    front.extend(hash.to_le_bytes());
}

/// A file of which the table was checked, and the hash of every section. What the sections say was not read yet.
#[derive(Clone, Debug)]
pub struct Opened<'a> {
    bytes: &'a [u8],
    /// Where each section stands.
    places: [Range<usize>; Section::ALL.len()],
    bits: u64,
    version: String,
}

impl<'a> Opened<'a> {
    /// Takes a file apart; nothing is copied.
    ///
    /// # Errors
    /// What is wrong with it, and in which section.
    pub fn of(bytes: &'a [u8]) -> Result<Self, FileError> {
        let table = checked_table(bytes)?;
        let found = bytes.len() as u64;
        let [count, length, bits] = [u32_at(table, 12).map(u64::from), u64_at(table, 16), u64_at(table, 24)];
        if count != Some(Section::ALL.len() as u64) {
            let (listed, needed) = (count.unwrap_or_default(), Section::ALL.len());
            let message = format!("it lists {listed} sections: {needed} are needed");
            return Err(FileError::Table(message));
        }
        let needed = length.unwrap_or_default();
        if needed != found {
            return Err(FileError::Length { found, needed });
        }
        let places = places(table, bytes.len())?;
        for (section, place) in Section::ALL.into_iter().zip(&places) {
            let row = HEAD_BYTES + section as usize * ROW_BYTES;
            if u64_at(table, row + 20) != Some(xxh3_64(&bytes[place.clone()])) {
                return Err(FileError::of(
                    section,
                    "its hash is another one: the file was altered or damaged",
                ));
            }
        }
        let version = String::from_utf8_lossy(&table[HEAD_BYTES - VERSION_BYTES..HEAD_BYTES]);
        let version = version.trim_end_matches('\0').to_owned();
        Ok(Self { bytes, places, bits: bits.unwrap_or_default(), version })
    }

    /// The bytes of a section.
    pub fn section(&self, section: Section) -> &'a [u8] {
        &self.bytes[self.places[section as usize].clone()]
    }

    /// The version that wrote it.
    pub fn version(&self) -> &str {
        &self.version
    }

    /// Whether the version that wrote it computes the same bits as this one.
    pub const fn has_own_bits(&self) -> bool {
        self.bits == BITS
    }

    /// Memory at most that reading its sections takes (bytes), to be counted before.
    pub fn bytes_to_read(&self) -> u64 {
        let of_section = |(section, place): (Section, &Range<usize>)| {
            section.bytes_per_byte().saturating_mul(place.len() as u64)
        };
        Section::ALL.into_iter().zip(&self.places).map(of_section).fold(0, u64::saturating_add)
    }
}

/// Head and table of a file whose beginning is one, of this format.
fn checked_table(bytes: &[u8]) -> Result<&[u8], FileError> {
    if !bytes.starts_with(&MAGIC) {
        return Err(FileError::Kind);
    }
    let cut = || FileError::Length { found: bytes.len() as u64, needed: FRONT_BYTES as u64 };
    let format = u32_at(bytes, 8).ok_or_else(cut)?;
    if format != FORMAT {
        return Err(FileError::Format { found: format });
    }
    let front = bytes.get(..FRONT_BYTES).ok_or_else(cut)?;
    let (table, hash) = front.split_at(FRONT_BYTES - 8);
    if u64_at(hash, 0) == Some(xxh3_64(table)) {
        Ok(table)
    } else {
        Err(FileError::Table("its hash is another one".to_owned()))
    }
}

/// The setup that a file needs, and at which byte it belongs, by the beginning of the file.
///
/// # Errors
/// If that is damaged, or of no session.
pub(crate) fn needed_setup(beginning: &[u8]) -> Result<(Digest, u64), FileError> {
    let table = checked_table(beginning)?;
    let row = HEAD_BYTES + Section::Setup as usize * ROW_BYTES;
    let [offset, length, hash] = [4, 12, 20].map(|at| u64_at(table, row + at).unwrap_or_default());
    Ok((Digest { length, hash }, offset))
}

/// Where the sections of a table stand in a file of so many bytes: one after the other, to its end.
fn places(table: &[u8], length: usize) -> Result<[Range<usize>; Section::ALL.len()], FileError> {
    let mut places = std::array::from_fn(|_| 0..0);
    let mut at = FRONT_BYTES as u64;
    for (index, section) in Section::ALL.into_iter().enumerate() {
        let row = HEAD_BYTES + index * ROW_BYTES;
        let (code, offset, own) = (u32_at(table, row), u64_at(table, row + 4), u64_at(table, row + 12));
        if code != Some(section.code()) || offset != Some(at) {
            let message = format!("it begins at byte {}: byte {at} is needed", offset.unwrap_or_default());
            return Err(FileError::of(section, message));
        }
        let own = own.unwrap_or_default();
        let end = at.checked_add(own).filter(|end| *end <= length as u64);
        let Some(end) = end else {
            let left = length as u64 - at;
            return Err(FileError::of(section, format!("it takes {own} bytes: {left} are there")));
        };
        if own > section.most_bytes() {
            let message = format!("it takes {own} bytes: allowed are at most {}", section.most_bytes());
            return Err(FileError::of(section, message));
        }
        places[index] = at as usize..end as usize;
        at = end;
    }
    if at == length as u64 {
        Ok(places)
    } else {
        let message = format!("its sections end at byte {at}, and the file has {length}");
        Err(FileError::Table(message))
    }
}

/// The number of four bytes from a place on, if there are as many.
fn u32_at(bytes: &[u8], at: usize) -> Option<u32> {
    Some(u32::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// The number of eight bytes from a place on, if there are as many.
fn u64_at(bytes: &[u8], at: usize) -> Option<u64> {
    Some(u64::from_le_bytes(*bytes.get(at..)?.first_chunk()?))
}

/// What tests do to a file.
#[cfg(test)]
pub(super) mod altered {
    use super::{FRONT_BYTES, HEAD_BYTES, ROW_BYTES, Section, u64_at, xxh3_64};

    /// Bytes before the first section.
    pub(crate) const FRONT: usize = FRONT_BYTES;

    /// The file with another number in the row of a section (1: where it begins, 2: its length), its table sealed again.
    pub(crate) fn with_number(file: &[u8], section: Section, column: usize, number: u64) -> Vec<u8> {
        let at = HEAD_BYTES + section as usize * ROW_BYTES + 4 + 8 * (column - 1);
        let mut file = file.to_vec();
        file[at..at + 8].copy_from_slice(&number.to_le_bytes());
        sealed(file)
    }

    /// The file with another number of its format.
    pub(crate) fn with_format(file: &[u8], format: u32) -> Vec<u8> {
        let mut file = file.to_vec();
        file[8..12].copy_from_slice(&format.to_le_bytes());
        sealed(file)
    }

    /// The file with another byte of a section, all hashes made anew: as who means harm would write it.
    pub(crate) fn forged(file: &[u8], section: Section, place: usize, mask: u8) -> Vec<u8> {
        let row = HEAD_BYTES + section as usize * ROW_BYTES;
        let number = |column: usize| u64_at(file, row + 4 + 8 * (column - 1)).expect("a row") as usize;
        let (offset, length) = (number(1), number(2));
        let mut file = file.to_vec();
        file[offset + place % length] ^= mask;
        let hash = xxh3_64(&file[offset..offset + length]);
        file[row + 20..row + 28].copy_from_slice(&hash.to_le_bytes());
        sealed(file)
    }

    fn sealed(mut file: Vec<u8>) -> Vec<u8> {
        let hash = xxh3_64(&file[..FRONT_BYTES - 8]);
        file[FRONT_BYTES - 8..FRONT_BYTES].copy_from_slice(&hash.to_le_bytes());
        file
    }
}

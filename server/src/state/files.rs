//! Files of a folder that this user alone reads: written whole, listed, known by their bytes.

use std::{
    fs::{self, DirBuilder, File, OpenOptions},
    io::{self, Read as _, Write as _},
    os::unix::fs::{DirBuilderExt as _, OpenOptionsExt as _},
    path::Path,
};

use xxhash_rust::xxh3::Xxh3;

use super::format::Digest;

/// How the name of a file ends until it is whole.
const NEW: &str = "new";
/// Bytes of a file that are looked at together.
const PART_BYTES: usize = 1 << 20;

/// Makes a folder that this user alone can enter, unless there is one.
pub(super) fn make_folder(path: &Path) -> io::Result<()> {
    match DirBuilder::new().mode(0o700).create(path) {
        Err(error) if error.kind() == io::ErrorKind::AlreadyExists && path.is_dir() => Ok(()),
        made => made,
    }
}

/// Writes a file that this user alone can read: once it has its name, it is whole, also after a power cut.
pub(super) fn put(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let new = path.with_extension(NEW);
    let written = write_new(&new, bytes).and_then(|()| fs::rename(&new, path));
    if written.is_err() {
        // Its bytes may be what another file needs.
        let _ = fs::remove_file(&new);
    }
    written?;
    let folder = path.parent().unwrap_or(Path::new("."));
    File::open(folder)?.sync_all()
}

fn write_new(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let mut options = OpenOptions::new();
    let mut file = options.write(true).create(true).truncate(true).mode(0o600).open(path)?;
    file.write_all(bytes)?;
    file.sync_all()
}

/// The names in a folder, in order; one that is no text is left out.
pub(super) fn names(folder: &Path) -> io::Result<Vec<String>> {
    let mut names = Vec::new();
    for entry in fs::read_dir(folder)? {
        names.extend(entry?.file_name().into_string().ok());
    }
    names.sort_unstable();
    Ok(names)
}

/// What a file is to be called that was not written to its end; none if it was.
pub(super) fn unfinished(name: &str) -> Option<&str> {
    name.strip_suffix(NEW)?.strip_suffix('.')
}

/// Bytes of the files in a folder.
pub(super) fn bytes_in(folder: &Path) -> io::Result<u64> {
    let mut bytes = 0;
    for entry in fs::read_dir(folder)? {
        // It may be removed meanwhile.
        bytes += entry?.metadata().map_or(0, |metadata| metadata.len());
    }
    Ok(bytes)
}

/// What the bytes of a file are known by; they are looked at part by part.
pub(super) fn digest_of(file: &mut File) -> io::Result<Digest> {
    let (mut hash, mut length, mut part) = (Xxh3::new(), 0, vec![0; PART_BYTES]);
    loop {
        let count = file.read(&mut part)?;
        if count == 0 {
            return Ok(Digest { length, hash: hash.digest() });
        }
        hash.update(&part[..count]);
        length += count as u64;
    }
}
